"""Simulated lines: the same for the same seed, reachable, with effects of the size that was asked for."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from respot.simulation import EFFECTS, OUTSIDE, ROBOTS, simulate
from respot.simulation.arm import apply, forward
from respot.simulation.line import rigid_rest, rms

NAMES = (*EFFECTS, *OUTSIDE)
COLUMNS = {"time_min", "welds_since_cap", "dress_count", "temperature_c", "humidity_pct", "force_n", "station", "fixture", "program", "operator", "shift", "session", "batch", "gun_voltage", "line_speed", *(f"approach_a{k}" for k in range(1, 7))}  # fmt: skip


def in_world(line):
    """Noise-free measured places brought back into the world frame."""
    return (line.measured_true - line.world2tracker[:3, 3]) @ line.world2tracker[:3, :3]


@pytest.mark.parametrize("layout", ["easy", "hard"])
@pytest.mark.parametrize("name", NAMES)
def test_every_effect_runs_and_leaves_what_its_truth_says(name, layout):
    line = simulate(spots=60, effects=[f"{name}:0.7"], seed=11, layout=layout)
    (truth,) = line.truth
    assert truth["name"] == name
    programmed = dict(zip(line.ids, line.positions, strict=True))
    listed = np.array([programmed[spot] for spot in line.measured_ids])
    assert rms(rigid_rest(listed, line.measured_true)) == pytest.approx(truth["left_rms"], rel=1e-6, abs=1e-9)
    assert rms(in_world(line) - listed) == pytest.approx(truth["raw_rms"], rel=1e-6, abs=1e-9)
    if name not in ("swapped_ids", "convention"):
        assert truth["left_rms"] == pytest.approx(0.7, rel=0.02)
    assert np.isfinite(line.measured).all()


@pytest.mark.parametrize("size", [0.05, 0.3, 3.0])
@pytest.mark.parametrize("name", ["joint_zero", "gravity_sag", "gear", "tip_wear", "gun_flex", "rail"])
def test_sizes_are_met(name, size):
    for seed in range(3):
        line = simulate(spots=60, effects=[f"{name}:{size}"], seed=seed)
        assert line.truth[0]["left_rms"] == pytest.approx(size, rel=0.02)


@pytest.mark.parametrize("name", ["joint_zero@1", "link_length@c1"])
def test_what_the_rigid_fit_swallows_is_sized_before_it(name):
    truth = simulate(spots=60, effects=[f"{name}:2"], seed=2).truth[0]
    assert truth["raw_rms"] == pytest.approx(2, rel=0.02)
    assert truth["left_rms"] < 0.05 * truth["raw_rms"]


@pytest.mark.parametrize(
    ("wish", "where"),
    [
        ("joint_zero@2", {"axis": 2}),
        ("gear@5", {"axis": 5}),
        ("backlash@4", {"axis": 4}),
        ("joint_profile@3", {"axis": 3}),
        ("link_length@a2", {"parameter": "a2"}),
        ("covariate@operator", {"column": "operator"}),
        ("covariate@humidity_pct", {"column": "humidity_pct"}),
        ("convention@radians", {"convention": "radians"}),
        ("axis_scale@y", {"axis": "y"}),
    ],
)
def test_places(wish, where):
    assert simulate(spots=40, effects=[wish], seed=1).truth[0]["where"] == where


def test_a_group_is_one_level_of_its_column():
    line = simulate(effects=["group_shift@station:1"], seed=4)
    where = line.truth[0]["where"]
    assert where["column"] == "station"
    inside = line.columns["station"] == where["level"]
    moved = np.linalg.norm(in_world(line) - line.positions, axis=1)
    assert 4 <= inside.sum() <= 60
    assert moved[inside].min() > 0.1
    assert moved[~inside].max() < 1e-9
    named = simulate(effects=[f"group_shift@station={where['level']}"], seed=5 - 1)
    assert named.truth[0]["where"] == where


@pytest.mark.parametrize(
    ("wish", "message"),
    [
        ("joint_zer", "did you mean joint_zero"),
        ("joint_zero@7", "7 is no axis"),
        ("joint_zero@", "place is empty"),
        ("joint_zero:-1", "no size"),
        ("joint_zero:big", "no size"),
        ("link_length@d4", "no length"),
        ("covariate@moon", "no column moon"),
        ("group_shift@time_min", "names no groups"),
        ("group_shift@station=ST999", "has no ST999"),
        ("convention@upside", "no convention"),
        ("scale@3", "has no place"),
    ],
)
def test_what_cannot_be_wished_for(wish, message):
    with pytest.raises(ValueError, match=message):
        simulate(spots=40, effects=[wish])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"robot": "kr210"}, "did you mean kr210"),
        ({"layout": "harder"}, "no layout"),
        ({"spots": 7}, "at least 8"),
        ({"noise": -1.0}, "negative"),
        ({"noise": np.nan}, "negative"),
    ],
)
def test_what_a_line_cannot_be(options, message):
    with pytest.raises(ValueError, match=message):
        simulate(**options)


def same(one, two):
    return (
        one.ids == two.ids
        and one.measured_ids == two.measured_ids
        and np.array_equal(one.measured, two.measured)
        and np.array_equal(one.joints, two.joints)
        and all(np.array_equal(one.columns[name], two.columns[name]) for name in one.columns)
        and one.truth == two.truth
    )


@pytest.mark.parametrize("layout", ["easy", "hard"])
def test_the_seed_decides_all(layout):
    options = {"spots": 50, "effects": ["tip_wear:0.5", "swapped_ids"], "layout": layout}
    assert same(simulate(seed=8, **options), simulate(seed=8, **options))
    assert not same(simulate(seed=8, **options), simulate(seed=9, **options))


def test_another_effect_leaves_spots_columns_and_noise_as_they_are():
    one, two = (simulate(spots=50, seed=3, effects=wishes) for wishes in ([], ["gear:1"]))
    assert np.array_equal(one.positions, two.positions)
    assert np.array_equal(one.columns["welds_since_cap"], two.columns["welds_since_cap"])
    assert one.measured - one.measured_true == pytest.approx(two.measured - two.measured_true, abs=1e-9)


@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize(("layout", "spots", "rail"), [("easy", 120, False), ("hard", 40, False), ("hard", 80, True)])
def test_the_programmed_line(robot, layout, spots, rail):
    for seed in range(3):
        line = simulate(robot, spots, layout=layout, seed=seed, rail=rail)
        foot = np.zeros((spots, 3))
        if rail:
            foot[:, 1] = line.external_axes[:, 0]
            assert np.isnan(line.external_axes[:, 1:]).all()
        else:
            assert line.external_axes is None
        frames = forward(ROBOTS[robot], line.joints, root_at=foot)
        tool = line.flange2tool
        assert frames.flange_at + apply(frames.flange, tool[:3, 3]) == pytest.approx(line.positions, abs=1e-9)
        assert frames.flange @ tool[:3, :3] == pytest.approx(line.rotations.as_matrix(), abs=1e-12)
        limits = np.array(line.robot["limits_deg"])
        for joints in (line.joints, line.approach_joints):
            assert ((joints > limits[:, 0]) & (joints < limits[:, 1])).all()
        assert np.mean(np.abs(line.joints[:, 4]) > 10) > 0.9
        turned = np.degrees((line.rotations.mean().inv() * line.rotations).magnitude())
        assert np.sqrt(np.mean(turned**2)) > 35
        assert sorted(line.order) == list(range(spots))
        assert len(set(line.ids)) == spots
        assert all(name.startswith("P02WP") for name in line.ids)
        assert np.ptp(line.positions, axis=0)[1] > 1000


@pytest.mark.parametrize("layout", ["easy", "hard"])
def test_no_two_columns_of_names_make_the_same_group(layout):
    for seed in range(10):
        line = simulate(spots=50, seed=seed, layout=layout)
        groups = {}
        for column in ("station", "fixture", "program", "session", "operator"):
            for level in np.unique(line.columns[column].astype(str)):
                inside = (line.columns[column] == level).tobytes()
                assert inside not in groups, f"{column} {level} is {groups[inside]}"
                groups[inside] = f"{column} {level}"


def test_easy_and_hard_lines_differ_where_they_should():
    def spread(line):
        """Spread of the stations in space beside that of all spots, and whether the clock follows the path."""
        inner = [
            np.var(line.positions[line.columns["station"] == name], axis=0).sum()
            for name in np.unique(line.columns["station"].astype(str))
        ]
        clock = np.corrcoef(line.columns["time_min"].astype(float), line.order)[0, 1]
        return np.mean(inner) / np.var(line.positions, axis=0).sum(), clock

    easy = np.array([spread(simulate(spots=80, seed=seed)) for seed in range(8)])
    hard = np.array([spread(simulate(spots=80, seed=seed, layout="hard")) for seed in range(8)])
    assert easy[:, 0].min() > 0.8
    assert hard[:, 0].max() < 0.5
    assert np.abs(easy[:, 1]).mean() < 0.2
    assert hard[:, 1].min() > 0.98


@pytest.mark.parametrize(("layout", "ratio"), [("easy", 1.0), ("hard", 1.3 / 0.6)])
def test_noise(layout, ratio):
    noise = np.concatenate(
        [
            np.sort(np.std(line.measured - line.measured_true, axis=0))[None]
            for line in (simulate(spots=400, noise=0.3, layout=layout, seed=seed) for seed in range(6))
        ]
    ).mean(axis=0)
    assert np.sqrt(np.mean(noise**2)) == pytest.approx(0.3, rel=0.03)
    assert noise[2] / noise[0] == pytest.approx(ratio, rel=0.12)


def test_columns_are_there_whatever_the_effect_and_only_if_wanted():
    for wishes in ([], ["gear"], ["covariate"]):
        line = simulate(spots=40, effects=wishes, seed=1)
        assert set(line.columns) == COLUMNS
        assert all(len(column) == 40 for column in line.columns.values())
    assert simulate(spots=40, effects=["tip_wear"], columns=False).columns == {}


def test_columns_are_as_in_a_plant():
    line = simulate(seed=2)
    when = np.argsort(line.columns["time_min"].astype(float))
    welds = line.columns["welds_since_cap"].astype(float)[when]
    falls = np.diff(welds) < 0
    assert 1 <= falls.sum() <= 8
    assert welds[1:][falls].max() < 30
    sign = np.sign(line.joints - line.approach_joints)
    assert np.array_equal(np.column_stack([line.columns[f"approach_a{k}"] for k in range(1, 7)]), sign)
    assert np.abs(sign).min() == 1
    sizes = np.unique(line.columns["station"].astype(str), return_counts=True)[1]
    assert sizes.min() >= 8
    assert sizes.max() > sizes.min()


def test_exchanged_names_change_names_alone():
    for seed in range(10):
        line, clean = (simulate(seed=seed, effects=wishes) for wishes in (["swapped_ids"], []))
        assert np.array_equal(line.measured, clean.measured)
        other = [one for one, two in zip(line.ids, line.measured_ids, strict=True) if one != two]
        assert sorted(other) == sorted(line.truth[0]["where"]["ids"])
        assert 2 <= len(other) <= 3
        assert sorted(line.measured_ids) == sorted(line.ids)


def test_conventions_keep_places_and_spell_orientations_otherwise():
    right = simulate(spots=40, seed=5, orientations=True)
    turn = Rotation.from_matrix(right.world2tracker[:3, :3])
    assert np.degrees((right.measured_rotations.inv() * turn * right.rotations).magnitude()).max() < 0.3
    assert simulate(spots=40, seed=5).measured_rotations is None
    angles = right.measured_rotations.as_euler("ZYX", degrees=True)
    spelt = {
        "euler_xyz": right.measured_rotations.as_euler("XYZ", degrees=True),
        "sign": -angles,
        "radians": np.radians(angles),
    }
    for kind, written in spelt.items():
        line = simulate(spots=40, seed=5, effects=[f"convention@{kind}"])
        assert np.array_equal(line.measured, right.measured)
        read = Rotation.from_euler("ZYX", written, degrees=True)
        assert (read.inv() * line.measured_rotations).magnitude().max() < 1e-9
    line = simulate(spots=40, seed=5, effects=["convention@quaternion_scalar_last"])
    written, meant = line.measured_rotations.as_quat(scalar_first=True), right.measured_rotations.as_quat()
    assert np.abs(np.sum(written * meant, axis=1)) == pytest.approx(np.ones(40))


def test_encoders_say_the_command_unless_the_robot_had_not_settled():
    steady = simulate(spots=60, seed=3)
    assert np.abs(steady.measured_joints - steady.joints).max() < 2e-3
    moving = simulate(spots=60, seed=3, effects=["readback_lag:1"])
    late = moving.measured_joints - moving.joints
    assert np.abs(late).max() > 0.01
    real = forward(ROBOTS["kr210_r2700_extra"], moving.measured_joints)
    there = real.flange_at + apply(real.flange, moving.flange2tool[:3, 3])
    assert np.abs(there - in_world(moving)).max() < 0.1  # the encoders' own noise
