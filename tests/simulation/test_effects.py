"""Effects do what their cause does: weight pulls down, play lags behind, wear follows the count."""

from __future__ import annotations

import numpy as np
import pytest

from respot.simulation import ROBOTS, simulate
from respot.simulation.effects_arm import loads, torque
from respot.simulation.line import draw_cell
from respot.simulation.state import GRAVITY


def shifts(line):
    """Where the spots went in the world frame (n, 3) [mm]."""
    real = (line.measured_true - line.world2tracker[:3, 3]) @ line.world2tracker[:3, :3]
    return real - line.positions


@pytest.mark.parametrize("robot", ["kr210_r2700_extra", "irb6640_185_280"])
@pytest.mark.parametrize("name", ["gravity_sag", "gun_sag", "floor"])
def test_weight_pulls_down(name, robot):
    for seed in range(4):
        moved = shifts(simulate(robot, effects=[name], seed=seed))[:, 2]
        assert moved.mean() < -0.5
        assert np.mean(moved < 0) > 0.9


def test_torque_is_the_slope_of_potential_energy():
    cell = draw_cell(ROBOTS["kr210_r2700_extra"], 20, "easy", False, 1)
    step = 1e-3

    def energy(joint, by):
        from dataclasses import replace

        from respot.simulation.arm import forward

        joints = cell.layout.joints.copy()
        joints[:, joint] += by
        moved = replace(cell, frames=forward(cell.robot, joints))
        return sum(-mass * (centre / 1000.0) @ GRAVITY for _, mass, centre in loads(moved))

    for joint in (1, 2, 4):
        slope = (energy(joint, step) - energy(joint, -step)) / (2 * np.radians(step))
        assert torque(cell, joint) == pytest.approx(-slope, rel=1e-5, abs=1e-3)


def test_play_lags_behind_and_not_equally():
    for axis in (1, 3, 5):
        line = simulate(effects=[f"backlash@{axis}"], seed=axis)
        values = line.truth[0]["parameters"]
        up, down = values["short_coming_up_deg"], values["short_coming_down_deg"]
        assert up > 0 < down
        assert abs(up / down - 1) > 0.1
        clean = line.joints.copy()
        sense = np.sign(line.joints - line.approach_joints)[:, axis - 1]
        clean[:, axis - 1] -= np.where(sense > 0, up, -down)
        from respot.simulation.arm import apply, forward

        frames = forward(ROBOTS["kr210_r2700_extra"], clean)
        there = frames.flange_at + apply(frames.flange, line.flange2tool[:3, 3])
        assert there - line.positions == pytest.approx(shifts(line), abs=1e-8)


def test_wear_follows_the_count_along_a_slant():
    line = simulate(effects=["tip_wear"], seed=6)
    moved = line.rotations.inv().apply(shifts(line))
    worn = np.linalg.norm(moved, axis=1)
    count = line.columns["welds_since_cap"].astype(float)
    assert np.corrcoef(np.argsort(np.argsort(worn)), np.argsort(np.argsort(count)))[0, 1] > 0.999
    used = count > 20
    ways = moved[used] / worn[used, None]
    assert np.ptp(ways, axis=0).max() < 1e-6
    slant = np.degrees(np.arccos(abs(ways[0, 2])))
    assert 10 < slant < 32
    ratio = worn[used] / count[used]
    assert np.ptp(ratio) / ratio.mean() > 0.05  # not in proportion


def test_squeezing_follows_the_force_alone():
    line = simulate(effects=["gun_deflection"], seed=6)
    moved = line.rotations.inv().apply(shifts(line))
    order = np.argsort(line.columns["force_n"].astype(float))
    assert (np.diff(moved[order, 2]) > -1e-9).all()


def test_warming_up_saturates_and_drift_does_not():
    line = simulate(effects=["warmup"], seed=2)
    when = np.argsort(line.columns["time_min"].astype(float))
    way = np.linalg.norm(shifts(line), axis=1)[when]
    third = len(when) // 3
    assert np.diff(way[[0, third]])[0] > 1.5 * np.diff(way[[-third, -1]])[0]
    assert line.truth[0]["parameters"]["minutes"][0] != simulate(effects=["warmup"], seed=3).truth[0]["parameters"]["minutes"][0]  # fmt: skip


@pytest.mark.parametrize(
    "name", ["rail", "drift", "hvac", "tip_wear", "group_shift", "covariate", "scale", "deformation"]
)
def test_nuisance_columns_know_nothing(name):
    """No number that belongs to no effect goes with the shifts more often than chance lets it."""
    strengths = []
    for seed in range(12):
        line = simulate(spots=80, effects=[name if name != "covariate" else "covariate@operator"], seed=seed)
        moved = shifts(line)
        for column in ("gun_voltage", "line_speed"):
            values = line.columns[column].astype(float)
            strengths += [abs(np.corrcoef(values, moved[:, k])[0, 1]) for k in range(3) if np.std(moved[:, k]) > 1e-9]
    assert np.median(strengths) < 0.15


def test_two_gear_harmonics_with_phases_of_their_own():
    line = simulate(effects=["gear@1"], seed=3)
    values = line.truth[0]["parameters"]
    assert values["harmonics"][1] == 2 * values["harmonics"][0]
    assert values["harmonics"][0] > 4
    # axis 1 turns everything about the world's Z: its error is the angle by which the spots turned
    turned = np.cross(line.positions, shifts(line))[:, 2] / np.sum(line.positions[:, :2] ** 2, axis=1)
    angle = np.radians(line.joints[:, 0])
    waves = [
        part * np.sin(turns * angle + np.radians(phase))
        for turns, part, phase in zip(values["harmonics"], values["amplitudes_deg"], values["phases_deg"], strict=True)
    ]
    assert -np.degrees(turned) == pytest.approx(np.sum(waves, axis=0), abs=1e-4)


def test_a_level_of_an_operator_moves_as_one():
    line = simulate(effects=["covariate@operator"], seed=3)
    moved = shifts(line)
    means = []
    for name in np.unique(line.columns["operator"].astype(str)):
        inside = moved[line.columns["operator"] == name]
        assert np.ptp(inside, axis=0).max() < 1e-9
        means.append(inside[0])
    assert len(means) == 4
    assert np.ptp(means, axis=0).max() > 0.3
