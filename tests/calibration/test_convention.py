"""Orientations written in another convention: found, told from a turned tool frame, and never claimed on right tables."""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from respot.calibration.effects.convention import find_convention, investigate_convention
from respot.calibration.effects.convention_tool import find_convention_by_tool, investigate_by_tool
from respot.calibration.effects.readings import READINGS, reread

FRAME = Rotation.from_rotvec([0.3, -0.2, 0.5])
PROBE = Rotation.from_euler("xz", [180, 35], degrees=True)


def read(angles):
    """What comes of numbers in the columns A, B, C, degrees."""
    return Rotation.from_euler("ZYX", angles, degrees=True)


WRITTEN = {
    "xyz_fixed": lambda r: read(r.as_euler("xyz", degrees=True)),
    "xyz_moving": lambda r: read(r.as_euler("XYZ", degrees=True)),
    "zyx_fixed": lambda r: read(r.as_euler("zyx", degrees=True)),
    "zyz_moving": lambda r: read(r.as_euler("ZYZ", degrees=True)),
    "zxz_moving": lambda r: read(r.as_euler("ZXZ", degrees=True)),
    "sign_a": lambda r: read(r.as_euler("ZYX", degrees=True) * [-1, 1, 1]),
    "sign_b": lambda r: read(r.as_euler("ZYX", degrees=True) * [1, -1, 1]),
    "sign_c": lambda r: read(r.as_euler("ZYX", degrees=True) * [1, 1, -1]),
    "sign_abc": lambda r: read(-r.as_euler("ZYX", degrees=True)),
    "inverse": lambda r: r.inv(),
    "zyx_radians": lambda r: read(r.as_euler("ZYX")),
    "xyz_fixed_radians": lambda r: read(r.as_euler("xyz")),
    "vector_xyz_radians": lambda r: read(r.as_rotvec()),
    "columns_bc": lambda r: read(r.as_euler("ZYX", degrees=True)[:, [0, 2, 1]]),
    "scalar_last": lambda r: Rotation.from_quat(r.as_quat(scalar_first=False), scalar_first=True),
}
COLUMNS = {"scalar_last": "quaternion"}


def tools(dice, n, spread, middle=None):
    """Orientations about a middle, spread by so many degrees per axis."""
    around = Rotation.random(random_state=dice) if middle is None else middle
    return around * Rotation.from_rotvec(dice.normal(size=(n, 3)) * spread, degrees=True)


def seen(dice, source, noise, frame=FRAME, probe=PROBE, wrong=0):
    """The same orientations in the reference's frame, measured."""
    n = len(source)
    there = frame * source * probe * Rotation.from_rotvec(dice.normal(size=(n, 3)) * noise, degrees=True)
    if wrong:
        quaternions = there.as_quat()
        quaternions[dice.permutation(n)[:wrong]] = Rotation.random(wrong, random_state=dice).as_quat()
        there = Rotation.from_quat(quaternions)
    return there


def found(source, reference, registration=FRAME, **options):
    matrix = None if registration is None else registration.as_matrix()
    return investigate_convention(source, reference, registration=matrix, kind="measured", **options)


@pytest.mark.parametrize("registered", [True, False], ids=["registered", "joint"])
@pytest.mark.parametrize("turned", [True, False], ids=["probe turned", "same tool frame"])
def test_right_tables_raise_no_alarm(turned, registered):
    for number in range(75 if registered else 25):
        dice = np.random.default_rng((number, turned, registered))
        n, noise = int(dice.integers(8, 121)), float(dice.uniform(0.1, 1.0))
        source = tools(dice, n, float(dice.uniform(5.0, 60.0)))
        probe = PROBE if turned else Rotation.identity()
        reference = seen(dice, source, noise, probe=probe, wrong=int(dice.integers(n // 10 + 1)))
        trial = found(source, reference, FRAME if registered else None)
        assert trial.finding is None, (number, trial.verdict)


@pytest.mark.parametrize("registered", [True, False], ids=["registered", "joint"])
def test_lists_that_have_nothing_to_do_with_each_other(registered):
    for number in range(10):
        dice = np.random.default_rng((number, registered))
        n = int(dice.integers(8, 60))
        trial = found(tools(dice, n, 40.0), Rotation.random(n, random_state=dice), FRAME if registered else None)
        assert trial.finding is None
        assert "no other reading" in trial.verdict


@pytest.mark.parametrize("side", ["source", "reference"])
@pytest.mark.parametrize("key", WRITTEN)
def test_every_wrong_reading_is_found(key, side):
    columns = COLUMNS.get(key, "abc")
    for number in range(6):
        dice = np.random.default_rng((number, sorted(WRITTEN).index(key), side == "source"))
        n = int(dice.integers(10, 80))
        true = tools(dice, n, float(dice.uniform(15.0, 60.0)))
        lists = {"source": true, "reference": seen(dice, true, float(dice.uniform(0.1, 0.8)), wrong=n // 10)}
        right = lists[side]
        lists[side] = WRITTEN[key](right)
        trial = found(lists["source"], lists["reference"], source_columns=columns, reference_columns=columns)
        finding = trial.finding
        assert finding is not None, (number, trial.verdict)
        assert (finding.reading, finding.side, finding.tied) == (key, side, ()), number
        assert finding.effect.named
        assert finding.effect.where == {"list": side, "reading": key}
        assert finding.spread_after < 0.2 * finding.spread_before
        off = np.degrees((finding.rotations.inv() * right).magnitude())
        assert np.median(off) < 1e-6
        assert np.linalg.norm(finding.turn) == pytest.approx(np.degrees(PROBE.magnitude()), abs=3.0)


@pytest.mark.parametrize("key", WRITTEN)
def test_without_a_registration_the_right_reading_is_among_those_that_fit(key):
    columns = COLUMNS.get(key, "abc")
    for number in range(4):
        dice = np.random.default_rng((number, sorted(WRITTEN).index(key), 7))
        source = tools(dice, 40, 35.0)
        written = WRITTEN[key](seen(dice, source, 0.3, wrong=3))
        trial = found(source, written, None, source_columns=columns, reference_columns=columns)
        assert trial.finding is not None, (number, trial.verdict)
        assert f"reference: {key}" in {f"{trial.finding.side}: {trial.finding.reading}", *trial.finding.tied}


def test_single_signs_are_one_without_a_registration_and_none_is_named():
    dice = np.random.default_rng(3)
    source = tools(dice, 40, 35.0)
    effect = found(source, WRITTEN["sign_b"](seen(dice, source, 0.3)), None).finding.effect
    assert not effect.named
    told = {effect.where["reading"], *(name.split("(")[-1].rstrip(")") for name in effect.not_separated_from)}
    assert {"sign_a", "sign_b", "sign_c", "sign_abc"} <= told
    assert "do not tell" in effect.remedy.text


def test_which_list_is_not_said_where_both_would_do():
    """The same frame and the same tool frame: a sign turned back in either list makes them agree."""
    dice = np.random.default_rng(4)
    source = tools(dice, 30, 30.0)
    none = Rotation.identity()
    reference = WRITTEN["sign_b"](seen(dice, source, 0.3, none, none))
    finding = found(source, reference, none).finding
    assert (finding.side, finding.reading, finding.side_known) == ("reference", "sign_b", False)
    assert finding.effect.where == {"list": "either", "reading": "sign_b"}
    assert finding.effect.named
    assert "cannot tell which" in finding.effect.remedy.text
    only = found(source, reference, none, sides=("reference",)).finding
    assert (only.effect.where["list"], only.side_known) == ("reference", True)


def test_tools_that_turn_about_one_axis_do_not_prove_a_sign():
    """A alone varies: its sign turned round is a frame turned upside down, and all signs turned round."""
    dice = np.random.default_rng(5)
    angles = np.column_stack([dice.uniform(-60, 60, 30), np.full(30, 12.0), np.full(30, 140.0)])
    flat = found(read(angles), read(angles * [-1, 1, 1]), Rotation.identity()).finding.effect
    assert flat.where["reading"] == "sign_a"
    assert not flat.named
    assert "convention (sign_abc)" in flat.not_separated_from
    assert "wrong_frame" in flat.not_separated_from


def test_half_turns_of_guns_along_the_axes_are_no_proof():
    """Tools along the axes of the car: the sign of A turned round is a gun turned half round wherever A is 90."""
    dice = np.random.default_rng(14)
    angles = np.column_stack([dice.integers(-1, 3, 40) * 90.0, np.zeros(40), dice.integers(0, 2, 40) * 90.0])
    source = read(angles)
    effect = found(source, FRAME * read(angles * [-1, 1, 1])).finding.effect
    assert not effect.named
    assert "half_turn" in effect.not_separated_from
    assert "half round" in effect.remedy.text


def test_guns_turned_anyhow_about_their_own_axis_or_half_round_are_no_convention():
    for number in range(20):
        dice = np.random.default_rng((number, 15))
        source = tools(dice, 40, 35.0)
        spun = Rotation.from_euler("z", dice.uniform(-180, 180, 40)[:, None], degrees=True)
        half = Rotation.from_euler("z", dice.integers(0, 2, 40)[:, None] * 180.0, degrees=True)
        for turn in (spun, half):
            assert found(source, seen(dice, source, 0.3) * turn).finding is None


@pytest.mark.parametrize("key", ["sign_a", "xyz_moving", "inverse"])
def test_orientations_that_do_not_differ_tell_nothing(key):
    dice = np.random.default_rng(6)
    middle = read([40.0, 25.0, 110.0])
    for count in (1, 2):
        family = tools(dice, count, 40.0, middle)[np.arange(24) % count]
        trial = found(family, WRITTEN[key](seen(dice, family, 0.2)))
        assert trial.finding is None
        assert trial.verdict
    assert "spots" in found(family[:4], family[:4]).verdict


def test_numbers_as_written_help_where_b_is_at_90_degrees():
    dice = np.random.default_rng(7)
    true = tools(dice, 30, 40.0)
    numbers = true.as_euler("XYZ", degrees=True)
    flat = np.arange(30) % 5 < 3
    numbers[flat, 1] = 90.0
    true = Rotation.from_euler("XYZ", numbers, degrees=True)
    source = FRAME.inv() * true
    lost = found(source, read(numbers))
    known = found(source, read(numbers), reference_numbers=numbers)
    assert lost.finding is None
    assert known.finding.reading == "xyz_moving"
    assert np.degrees((known.finding.rotations.inv() * true).magnitude()).max() < 1e-6


def test_a_table_that_somebody_converted_from_wrong_angles_to_quaternions():
    dice = np.random.default_rng(8)
    source = tools(dice, 30, 40.0)
    written = WRITTEN["xyz_moving"](seen(dice, source, 0.3))
    finding = found(source, written, reference_columns="quaternion").finding
    assert finding.reading == "xyz_moving"


def test_the_record():
    dice = np.random.default_rng(9)
    source = tools(dice, 30, 40.0)
    finding = find_convention(
        source, WRITTEN["zyz_moving"](seen(dice, source, 0.3)), registration=FRAME.as_matrix(), kind="measured"
    )
    record = json.loads(json.dumps(finding.effect.to_dict(), allow_nan=False))
    assert record["name"] == "convention"
    assert record["remedy"]["where"] == "spot_list"
    for words in ("measured list", "moving z, y, z", "Rz(A) Ry(B) Rx(C)", "Positions are not affected", "were tried"):
        assert words in record["remedy"]["text"]
    assert record["evidence"]["spread_after_deg"] < 1.0 < record["evidence"]["spread_before_deg"]
    assert finding.runner_up_spread > 5.0


def test_the_order_of_rows_plays_no_part():
    dice = np.random.default_rng(10)
    source = tools(dice, 60, 30.0)
    written = WRITTEN["zxz_moving"](seen(dice, source, 0.5, wrong=6))
    one = found(source, written).finding
    mixed = dice.permutation(60)
    two = found(source[mixed], written[mixed]).finding
    assert (one.reading, one.tied) == (two.reading, two.tied)
    assert one.spread_after == pytest.approx(two.spread_after, rel=1e-3)


@pytest.mark.parametrize("key", [each.key for each in READINGS])
def test_every_reading_can_be_made_of_rotations(key):
    rotations = Rotation.random(20, random_state=1)
    again = reread(rotations, key)
    assert np.degrees((again.inv() * rotations).magnitude()).max() > 5.0
    assert np.degrees((reread(rotations, "as_written").inv() * rotations).magnitude()).max() == 0.0


def positions(dice, n, offset, noise=0.3, spread=30.0, wrong=0):
    source = dice.uniform(-0.5, 0.5, (n, 3)) * [1600.0, 800.0, 1200.0]
    rotations = tools(dice, n, spread)
    reference = FRAME.apply(source + rotations.apply(offset)) + [500.0, -200.0, 900.0]
    reference += dice.normal(size=reference.shape) * noise
    reference[:wrong] += 20.0
    return source, rotations, reference


@pytest.mark.parametrize("key", ["xyz_fixed", "xyz_moving", "sign_c", "inverse", "zyx_radians"])
def test_positions_alone_tell_through_a_large_tool_offset(key):
    for number in range(1):
        dice = np.random.default_rng((number, sorted(WRITTEN).index(key), 11))
        source, rotations, reference = positions(dice, 40, [300.0, -120.0, 250.0], wrong=3)
        finding = find_convention_by_tool(source, WRITTEN[key](rotations), reference, seed=0)
        assert (finding.side, finding.reading, finding.unit) == ("source", key, "mm")
        assert finding.effect.named
        assert finding.effect.heldout_gain > 10.0
        assert np.degrees((finding.rotations.inv() * rotations).magnitude()).max() < 1e-6


@pytest.mark.parametrize(
    "offset", [[0.0, 0.0, 0.0], [3.0, -2.0, 5.0], [300.0, -100.0, 200.0]], ids=["none", "5", "370"]
)
def test_positions_with_right_orientations_raise_no_alarm(offset):
    for number in range(4):
        dice = np.random.default_rng((number, 12))
        source, rotations, reference = positions(dice, int(dice.integers(12, 80)), offset, spread=25.0, wrong=1)
        assert investigate_by_tool(source, rotations, reference, seed=0).finding is None


def test_too_few_positions_are_not_judged():
    source, rotations, reference = positions(np.random.default_rng(13), 10, [300.0, 0.0, 0.0])
    assert "12 spots" in investigate_by_tool(source, rotations, reference, seed=0).verdict
