"""Compensated programs land where the old ones said: judged by a simulator that shares no code with the engine."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from respot.calibration.effects.catalogue import MECHANISMS, terms_of
from respot.calibration.effects.moved import moved
from respot.correction.conversion import Conversion
from respot.correction.gauge import best_motion
from respot.correction.landing import Errors, Seats, landed, solve
from respot.correction.written import WRITTEN
from respot.geometry import distance_mm, pose, turn_deg
from tests.correction.simulated import ABB, KUKA, Cell, cell, model_error
from tests.discovery.lines import observations_of

CASES = [
    (KUKA, "joint_zero", 1),
    (KUKA, "joint_profile", 1),
    (KUKA, "gear", 1),
    (KUKA, "link_length", 1),
    (KUKA, "link_geometry", 1),
    (KUKA, "gravity_sag", 1),
    (KUKA, "tool_offset", 1),
    (KUKA, "gun_sag", 1),
    (KUKA, "gun_deflection", 1),
    (KUKA, "backlash", 1),
    (KUKA, "group_shift@station", 1),
    (KUKA, "scale", 1),
    (KUKA, "deformation", 1),
    (KUKA, "rail", 1),
    (ABB, "joint_zero", 1),
    (ABB, "gravity_sag", 1),
    (ABB, "tool_offset", 1),
    (ABB, "link_length", 1),
    (ABB, "backlash", 1),
    (ABB, "gun_sag", 2),
    (ABB, "group_shift@station", 1),
]


@dataclass(frozen=True)
class Done:
    """A plant and what became of its programs, with the calibration on disk."""

    plant: Cell
    made: Conversion
    out: Path

    @property
    def calibration(self) -> Path:
        return self.out.parent / "cal.json"


@pytest.fixture(scope="module")
def compensated(tmp_path_factory):
    """Compensate a simulated line once for all tests that look at it."""
    known: dict[tuple[str, str, int], Done] = {}

    def give(robot: str, effect: str, seed: int = 1) -> Done:
        if (robot, effect, seed) not in known:
            folder = tmp_path_factory.mktemp("plant")
            plant = cell(folder / "line", robot, effect, seed=seed)
            made = plant.convert(folder / "out", (effect.partition("@")[0],))
            made.calibration.save(folder / "cal.json")
            known[robot, effect, seed] = Done(plant, made, folder / "out")
        return known[robot, effect, seed]

    return give


@pytest.mark.parametrize(("robot", "effect", "seed"), CASES)
def test_the_real_robot_lands_where_the_old_programs_said(compensated, robot, effect, seed):
    done = compensated(robot, effect, seed)
    assert not done.made.correction.refused
    assert done.made.correction.direction == "compensate"
    before, after = done.plant.error(done.plant.backup), done.plant.error(done.out)
    reached = model_error(done.made, done.plant.line)
    assert before == pytest.approx(1.0, abs=1e-3)
    assert after <= 1.2 * reached + 2e-3  # printed digits and the model: nothing is lost on the way
    assert after < 0.2 * before


def test_a_robot_on_a_rail_is_compensated_where_it_stands(tmp_path):
    plant = cell(tmp_path, KUKA, "joint_zero", spots=40, rail=True)
    made = plant.convert(tmp_path / "out", ("joint_zero",))
    assert not made.correction.refused
    assert plant.error(tmp_path / "out") < 0.05 < 0.95 < plant.error(plant.backup)


@pytest.mark.parametrize(("robot", "effect"), [(KUKA, "joint_zero"), (ABB, "gravity_sag")])
def test_tools_stand_as_the_old_programs_said(compensated, robot, effect):
    done = compensated(robot, effect)
    told = done.plant.told(done.plant.backup)[1]

    def uneven(backup: Path) -> float:
        turns = done.plant.run(backup).rotations * told.inv()
        return float(np.degrees((turns * turns.mean().inv()).magnitude()).max())

    assert uneven(done.out) < 0.2 * uneven(done.plant.backup)


def test_what_discovery_finds_by_itself_reaches_what_the_truth_would(compensated, tmp_path):
    oracle = compensated(KUKA, "joint_zero")
    oracle.plant.convert(tmp_path / "found", "auto")
    assert oracle.plant.error(tmp_path / "found") <= 1.2 * oracle.plant.error(oracle.out)


@pytest.mark.parametrize("effect", ["tip_wear", "warmup", "drift", "covariate", "readback_lag", "group_shift@session"])
def test_what_comes_and_goes_is_not_written_and_said(tmp_path, effect):
    plant = cell(tmp_path, KUKA, effect, seed=1)
    made = plant.convert(tmp_path / "out", (effect.partition("@")[0],))
    assert not made.correction.edits
    assert made.as_json()["effects_written"] == []
    assert "EFFECT_NOT_WRITTEN" in [issue.code for issue in made.issues]


# ----------------------------------------------------------------------------------------------------------- the gauge


def test_shifts_of_a_kept_base_hold_no_rigid_motion(compensated, tmp_path):
    done = compensated(KUKA, "gravity_sag")
    plant = done.plant
    plant.convert(tmp_path / "out", "auto", calibration=done.calibration, bases="remeasured")
    old = plant.told(plant.backup)[0]
    middle = RigidTransform.from_translation(old.mean(axis=0))
    folders = {"kept": done.out, "remeasured": tmp_path / "out"}
    motions = {name: best_motion(old, plant.told(folder)[0]) for name, folder in folders.items()}
    shift = {name: float(distance_mm(motion * middle, middle)) for name, motion in motions.items()}
    turn = {name: float(np.degrees(motion.rotation.magnitude())) for name, motion in motions.items()}
    assert shift["kept"] < 1e-4
    assert turn["kept"] < 1e-5
    assert shift["remeasured"] > 0.3
    (left,) = done.made.as_json()["left_to_registration"]
    assert left["spots"] == 60
    assert left["shift_mm"] == pytest.approx(shift["remeasured"], rel=0.05)
    assert "RIGID_PART_KEPT" in [issue.code for issue in done.made.issues]

    # a base that the tracker measures anew lands at the registration itself
    model = done.made.calibration
    goal = old @ model.rotation.T + model.translation

    def error(backup: Path) -> float:
        return float(np.sqrt(np.mean(np.sum((plant.run(backup).positions - goal) ** 2, axis=1))))

    assert error(tmp_path / "out") < 0.15
    assert error(plant.backup) > 1.0
    assert error(done.out) > 0.3


# ------------------------------------------------------------------------------------------------------- the way back

_NUMBER = re.compile(r"[-+]?\d+\.\d+")


def _numbers(folder: Path) -> list[list[str]]:
    files = sorted(path for path in folder.rglob("*") if path.suffix in (".dat", ".mod"))
    lines = [line for file in files for line in file.read_bytes().decode("cp1252").splitlines()]
    return [_NUMBER.findall(line) for line in lines if "respot:" not in line]


@pytest.mark.parametrize(("robot", "bases"), [(KUKA, "kept"), (ABB, "kept"), (KUKA, "remeasured")])
@pytest.mark.parametrize("effect", ["gravity_sag", "tool_offset", "group_shift@station"])
def test_the_inverse_restores_every_number(compensated, tmp_path, robot, bases, effect):
    done = compensated(robot, effect)
    plant, out = done.plant, done.out
    how = {"calibration": done.calibration, "bases": bases, "covariates": plant.measured}
    if bases == "remeasured":
        out = tmp_path / "out"
        plant.convert(out, "auto", **how)
    back = plant.convert(tmp_path / "back", "auto", source=out, inverse=True, **how)
    assert back.correction.direction == "align"
    changed = 0
    old, new, there = (_numbers(folder) for folder in (plant.backup, tmp_path / "back", out))
    for was, now, between in zip(old, new, there, strict=True):
        changed += was != between
        # a number with more digits than its neighbours cannot get back more than these carry
        digits = [10.0 ** -len(number.partition(".")[2]) for number in was]
        coarsest = max((digit for digit in digits if digit < 1e-3), default=0.0)
        limits = [max(digit, 0.5 * coarsest) * 1.001 for digit in digits]
        for number, again, limit in zip(was, now, limits, strict=True):
            assert abs(float(number) - float(again)) <= limit, (was, now)
    assert changed >= 10


# ---------------------------------------------------------------------------------------------------- the solve itself


@pytest.fixture(scope="module")
def seats() -> Seats:
    from respot.simulation import simulate

    line = simulate(KUKA, 40, 0.1, (), 4, rail=True)
    seen = observations_of(line)
    flange = seen.base2source * seen.flange2base
    return Seats(seen, flange.inv() * pose(seen.positions, seen.rotations))


@pytest.mark.parametrize("seed", range(24))
def test_any_mixture_of_effects_is_solved_to_a_millionth(seats, seed):
    rng = np.random.default_rng(seed)
    every = [term for term in terms_of(seats.observations) if term.effect in WRITTEN]
    terms = [every[row] for row in rng.choice(len(every), 4, replace=False)]
    values = [
        0.2 * rng.standard_normal(len(term.parameters)) * [min(p.prior, 10.0) for p in term.parameters]
        for term in terms
    ]
    errors = Errors(terms, values, rng.normal(0.0, 2.0, 3) if seed % 2 else None)
    solution = solve(errors, seats, seats.poses)
    assert solution.found.all()
    # read again from the poses alone, joints by inverse kinematics
    told, reached = seats.at(solution.seats.poses)
    assert reached.all()
    there = landed(errors, told)
    assert float(distance_mm(there, seats.poses).max()) < 1e-6
    assert float(turn_deg(there, seats.poses).max()) < 1e-7
    assert float(distance_mm(solution.seats.poses, seats.poses).max()) > 1e-3


def test_joints_of_the_new_poses_are_taken_not_of_the_old(seats):
    term = next(term for term in terms_of(seats.observations) if term.effect == "joint_zero")
    gear = next(term for term in terms_of(seats.observations) if term.effect == "gear")
    errors = Errors([term, gear], [np.array([0.5]), np.full(len(gear.parameters), 0.05)])
    solution = solve(errors, seats, seats.poses)
    old = replace(seats.observations, positions=np.asarray(solution.seats.poses.translation))
    stale, _ = moved(replace(old, rotations=solution.seats.poses.rotation), errors.terms, errors.values)
    assert np.abs(stale - seats.observations.positions).max() > 1e-4  # the joints of the old poses do not do
    assert solution.found.all()


def test_a_place_out_of_reach_does_not_spoil_the_others(seats):
    term = next(term for term in terms_of(seats.observations) if term.effect == "joint_zero")
    wanted = seats.poses
    points = np.array(wanted.translation)
    points[3] += 9000.0
    solution = solve(Errors([term], [np.array([0.1])]), seats, pose(points, wanted.rotation))
    assert not solution.found[3]
    assert not solution.reached[3]
    assert solution.found.sum() == len(seats) - 1


def test_every_effect_of_the_catalogue_is_decided_about():
    left = {"drift", "warmup", "tip_wear", "covariate", "readback_lag", "wrong_frame"}
    assert set(MECHANISMS) == WRITTEN | left
    assert not WRITTEN & left


def test_few_or_straight_points_tell_a_shift_alone():
    points = np.arange(5.0)[:, None] * [100.0, 0.0, 0.0]
    turned = Rotation.from_rotvec([0.0, 0.0, 0.1]).apply(points) + [1.0, 2.0, 3.0]
    for rows in (slice(0, 5), slice(0, 1), slice(0, 3)):
        motion = best_motion(points[rows], turned[rows])
        assert motion.rotation.magnitude() == 0.0
        assert np.asarray(motion.apply(points[rows])).mean(axis=0) == pytest.approx(turned[rows].mean(axis=0))
    wide = np.vstack([points, [[0.0, 300.0, 0.0], [0.0, 0.0, 300.0]]])
    assert np.degrees(best_motion(wide, Rotation.from_rotvec([0, 0, 0.1]).apply(wide)).rotation.magnitude()) > 5.0
