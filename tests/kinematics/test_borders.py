"""Traps at the borders: limits met exactly, axes that a pose does not tell, quadrants to the last digit, many turns."""

import dataclasses
import math

import numpy as np
import pytest
from by_hand import ABB, KUKA
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.spatial.transform import RigidTransform

from respot.geometry import IDENTITY, abc_from_rotation, pose, rotation_from_abc
from respot.kinematics.cell import RobotCell
from respot.kinematics.configuration import all_solutions, configuration_of, nearest_inside, reconfigure, taught_joints
from respot.kinematics.path import check_path, made_worse
from respot.kinematics.robots import built_in_robots, find_robot
from respot.kinematics.turns import outside

LIMITS = np.array([[-185, 185], [-140, -5], [-120, 155], [-350, 350], [-125, 125], [-350, 350.0]])
PRIME = RobotCell(find_robot("kr210_r2700_prime").with_limits(LIMITS), "krl")
# A6 of an IRB 6700 turns 930 degrees to both sides
BOUNDS = np.array([[-170, 170], [-65, 85], [-180, 70], [-300, 300], [-130, 130], [-930, 930.0]])
IRB6700 = RobotCell(find_robot("irb6700_200_260").with_limits(BOUNDS), "rapid")
GOOD = (10, -80, 90, 20, 40, 20)


def flange(hand, joints):
    return RigidTransform.from_matrix(np.array(hand.forward(joints), dtype=float))


def as_printed(found, digits=3):
    """With as many digits as a pendant writes."""
    angles = np.round(abc_from_rotation(found.rotation), digits)
    return pose(np.round(found.translation, digits), rotation_from_abc(angles))


def stays(cell, hand, joints, numbers, digits=None):
    """Reconfigure a point that does not move."""
    found = flange(hand, joints)
    found = found if digits is None else as_printed(found, digits)
    return reconfigure(cell, IDENTITY, found, found, [numbers])


# --------------------------------------------------------------------------------------------------------------- limits


@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize("axis", range(6))
def test_a_point_taught_exactly_at_a_limit_is_inside(axis, side):
    random = np.random.default_rng(axis)
    for _ in range(20):  # rounding goes either way
        joints = random.uniform(*(LIMITS + [[5, -5]]).T)
        joints[4] = math.copysign(random.uniform(10, 120), joints[4])
        joints[axis] = LIMITS[axis, side]
        status, turn = configuration_of(PRIME, joints)[0]
        assert turn == sum(1 << bit for bit in range(6) if joints[bit] < 0)
        result = stays(PRIME, KUKA, joints, [status, turn])
        assert result.reasons == (None,)
        assert result.joints[0] == pytest.approx(joints, abs=1e-6)


def test_a_millionth_of_a_degree_is_on_the_limit_and_two_are_not():
    limits = np.array([[-10.0, 10.0]])
    assert outside(np.array([[10 + 9e-7], [-10 - 9e-7], [10 + 2e-6], [-12.0], [3.0]]), limits)[:, 0] == pytest.approx(
        [0, 0, 2e-6, 2, 0]
    )
    codes = [check_path(PRIME, [[*GOOD[:3], 350 + beyond, 40, 20]])[0].code for beyond in (1e-9, 1e-3)]
    assert codes == ["NEAR_LIMIT", "OUT_OF_LIMITS"]


def test_a_free_motion_to_an_axis_at_its_limit_does_not_unwind():
    random = np.random.default_rng(8)
    for _ in range(200):
        fourth, sixth = random.choice([-350.0, 350.0], 2)
        joints = np.array([[random.uniform(-60, 60), random.uniform(-100, -60), random.uniform(60, 110), fourth,
                            random.uniform(20, 100), sixth]])  # fmt: skip
        branches = all_solutions(PRIME, PRIME.model, flange(KUKA, joints[0].tolist()), IDENTITY, 1)
        assert nearest_inside(PRIME.model, branches, joints, PRIME.limits) == pytest.approx(joints, abs=1e-6)


# ------------------------------------------------------------------------------------------ axes that a pose does not tell


@pytest.mark.parametrize("digits", [3, 4, None])
@pytest.mark.parametrize(
    ("cell", "hand", "joints", "numbers"),
    [
        (PRIME, KUKA, (10, -80, 90, 0, 0, 0), [2, 2]),
        (PRIME, KUKA, (10, -80, 90, 130, 0, -60), [2, 2 + 32]),
        (PRIME, KUKA, (10, -80, 90, 130, 0.004, -60), [2, 2 + 32]),
        (PRIME, KUKA, (10, -80, 90, 190, 0.01, -190), [2, 2 + 32]),
        (IRB6700, ABB, (10, 5, 5, 100, 0, 50), [0, 1, 0, 0]),
    ],
)
def test_a_straight_wrist_does_not_tell_axes_four_and_six(cell, hand, joints, numbers, digits):
    """Printed digits bend it a thousandth of a degree to any side: axis 4 would come out anywhere, and nobody would know."""
    result = stays(cell, hand, joints, numbers, digits)
    assert result.reasons[0].code == "CONFIG_NOT_CHECKED"
    assert "axes 4 and 6" in str(result.reasons[0])
    assert result.configuration.tolist() == [numbers]
    assert np.isnan(result.old_joints).all()


@pytest.mark.parametrize("fourth", ["any", "zero"])
@pytest.mark.parametrize("name", sorted(built_in_robots()))
def test_a_straight_wrist_does_not_lose_its_arm(name, fourth):
    """Rounding makes the cosine of axis 5 a hair larger than 1 in a third of these poses."""
    robot = find_robot(name)
    random = np.random.default_rng(3)
    joints = random.uniform(-90, 90, (24, 6))
    joints[:, 4] = random.choice([0.0, 1e-12, -1e-9, 1e-8, 3e-7], 24)
    joints[:, 3] *= fourth == "any"
    poses = robot.forward(joints)
    solutions = robot.inverse(poses, near=joints)
    for row in range(24):
        found = solutions[row][np.isfinite(solutions[row]).all(axis=1)]
        own = found[np.abs(found[:, :3] - joints[row, :3]).max(axis=1) < 1e-3]
        assert len(own)
        again = robot.forward(own)
        assert np.abs(again.translation - poses[row].translation).max() < 1e-6
        assert np.degrees((again.rotation * poses[row].rotation.inv()).magnitude()).max() < 1e-6


def test_a_point_that_comes_to_a_straight_wrist_is_not_guessed_either():
    before, after = (flange(KUKA, (10, -80, 90, 30, fifth, 20)) for fifth in (1.0, 0.0))
    result = reconfigure(PRIME, IDENTITY, before, after, [[2, 2]])
    assert result.reasons[0].code == "CONFIG_NOT_CHECKED" and "moved pose" in str(result.reasons[0])
    assert result.configuration.tolist() == [[2, 2]]


def test_a_wrist_centre_over_axis_one_does_not_tell_axis_one():
    # the arm leans back until the wrist centre stands over axis 1: 350 + 1150 cos + 1200 cos 60 + 41 sin 60 = 0
    free = RobotCell(find_robot("kr210_r2700_prime"))
    forearm, up = 60.0, math.radians(60.0)
    lean = math.acos((-350 - 1200 * math.cos(up) - 41 * math.sin(up)) / 1150)
    joints = (40, -math.degrees(lean), math.degrees(lean) - forearm, 30, 50, -70)
    wrist = np.array(KUKA.forward(joints)) @ [0, 0, -240, 1]
    assert wrist[:2] == pytest.approx([0, 0], abs=1e-9)
    taught, reasons = taught_joints(free, IDENTITY, as_printed(flange(KUKA, joints)), configuration_of(free, joints))
    assert reasons[0].code in ("CONFIG_NOT_CHECKED", "CONFIG_INCONSISTENT")
    assert np.isnan(taught).all()
    # half a millimetre off it is told again, to as many digits as the pose has
    near = (40, joints[1] + math.degrees(0.5 / wrist[2]), *joints[2:])
    taught, reasons = taught_joints(free, IDENTITY, as_printed(flange(KUKA, near)), configuration_of(free, near))
    assert reasons == (None,)
    assert taught[0] == pytest.approx(near, abs=0.2)


def test_of_two_branches_within_the_tolerance_the_numbers_name_one():
    # 0.3 degrees from straight, which an absolutely accurate robot may take for both: S says positive, so A4 is 190
    joints = (10, -80, 90, 190, 0.3, -190)
    cell = dataclasses.replace(PRIME, absolute_accuracy=True)
    taught, reasons = taught_joints(cell, IDENTITY, flange(KUKA, joints), [[2, 2 + 32]])
    assert reasons == (None,)
    assert taught[0] == pytest.approx(joints, abs=1e-6)
    # and the other way: A5 is negative, A4 is 10
    other = (10, -80, 90, 10, -0.3, -10)
    taught, _ = taught_joints(cell, IDENTITY, flange(KUKA, joints), [[6, 2 + 16 + 32]])
    assert taught[0] == pytest.approx(other, abs=1e-6)


@pytest.mark.parametrize(("bend", "status"), [(0.015, 2), (-0.015, 0)])
def test_next_to_the_stretched_arm_the_elbow_stays_where_it_is(bend, status):
    stretched = -math.degrees(math.atan2(41, 1200))
    result = stays(PRIME, KUKA, (10, -60, stretched + bend, 30, 50, -70), [status, 2 + 4 + 32])
    assert result.reasons == (None,)
    assert result.configuration.tolist() == [[status, 2 + 4 + 32]]
    assert result.joints[0, 2] == pytest.approx(stretched + bend, abs=1e-6)


@given(
    st.sampled_from([(PRIME, KUKA), (IRB6700, ABB)]),
    st.lists(st.floats(0, 1), min_size=6, max_size=6),
    st.sampled_from([0.0, 0.003, -0.01, 0.02, 0.05, -0.1, 1.0, -40.0]),
)
def test_a_printed_point_that_does_not_move_keeps_its_numbers_or_says_why(pair, shares, fifth):
    cell, hand = pair
    low, high = cell.limits.T
    joints = low + 5 + np.array(shares) * (high - low - 10)
    joints[4] = fifth
    # away from what printing could flip: at 0.02 degrees of A5 it turns axis 4 by 5 degrees
    counted = joints[[0, 3, 5]]
    assume(np.abs(counted - 90 * np.round(counted / 90)).min() > 6 and np.abs(joints[1:3]).min() > 1)
    numbers = configuration_of(cell, joints)[0]
    found = flange(hand, joints.tolist())
    seen = np.array(as_printed(found).as_matrix()) @ [0, 0, -hand.flange, 1]
    assume(math.hypot(*seen[:2]) > 20)
    result = stays(cell, hand, joints, numbers, digits=3)
    if result.reasons == (None,):
        assert result.configuration[0].tolist() == numbers.tolist()
        assert np.abs(result.joints[0] - joints).max() < 5
    assert result.reasons == (None,) or abs(fifth) < 0.03 or result.reasons[0].code == "CONFIG_INCONSISTENT"


# ------------------------------------------------------------------------------------------------- signs, quadrants, turns


@pytest.mark.parametrize("axis", [0, 3, 5])
@pytest.mark.parametrize(("angle", "bit"), [(180.0, 0), (-180.0, 1), (180 - 1e-9, 0), (-180 + 1e-9, 1), (181.0, 0)])
def test_half_a_turn_keeps_its_side(axis, angle, bit):
    joints = [*GOOD]
    joints[axis] = angle
    turn = 2 | bit << axis
    result = stays(PRIME, KUKA, joints, [2, turn])
    assert result.reasons == (None,)
    assert result.joints[0] == pytest.approx(joints, abs=1e-6)
    assert result.configuration.tolist() == [[2, turn]]


@pytest.mark.parametrize("off", [-1e-9, 0.0, 1e-9])
@pytest.mark.parametrize("quarters", range(-9, 10))
def test_a_billionth_from_a_quadrant_its_number_stays_whichever_it_is(quarters, off):
    joints = (10, 5, 5, 40, 50, 90 * quarters + off)
    for cf6 in (quarters - 1, quarters):
        result = stays(IRB6700, ABB, joints, [0, 0, cf6, 0])
        assert result.reasons == (None,)
        assert result.configuration.tolist() == [[0, 0, cf6, 0]]
        assert result.joints[0, 5] == pytest.approx(joints[5], abs=1e-6)
    for cf6 in (quarters - 2, quarters + 1):
        assert stays(IRB6700, ABB, joints, [0, 0, cf6, 0]).reasons[0].code == "CONFIG_INCONSISTENT"


@pytest.mark.parametrize(
    ("before", "after", "old", "new"),
    [(359, 361, 3, 4), (719, 721, 7, 8), (-719, -721, -8, -9), (899, 901, 9, 10), (-1, 1, -1, 0), (-361, -359, -5, -4)],
)
def test_axis_six_counts_on_over_full_turns(before, after, old, new):
    poses = [flange(ABB, (10, 5, 5, 40, 50, sixth)) for sixth in (before, after)]
    result = reconfigure(IRB6700, IDENTITY, *poses, [[0, 0, old, 0]])
    assert result.reasons == (None,)
    assert result.joints[0, 5] == pytest.approx(after)
    assert result.configuration.tolist() == [[0, 0, new, 0]]


def test_a_turn_too_many_leaves_the_bounds():
    poses = [flange(ABB, (10, 5, 5, 40, 50, sixth)) for sixth in (929, 931)]
    (reason,) = reconfigure(IRB6700, IDENTITY, *poses, [[0, 0, 10, 0]]).reasons
    assert reason.code == "OUT_OF_LIMITS" and "931.000" in str(reason)


@pytest.mark.parametrize("wrong", [[2.5, 2], [2, math.nan], [math.inf, 2], [1e300, 2], [2, 2.0000001]])
def test_what_is_no_whole_number_is_no_status(wrong):
    place = flange(KUKA, GOOD)
    for numbers in (wrong, [2.0, 2.0]):
        result = reconfigure(PRIME, IDENTITY, place, place, [numbers, [2, 2]])
        assert result.reasons[1] is None and result.configuration[1].tolist() == [2, 2]
        assert (result.reasons[0] is None) == (numbers is not wrong)
    assert reconfigure(PRIME, IDENTITY, place, place, [wrong]).reasons[0].code == "CONFIG_INCONSISTENT"


def test_rounding_at_zero_changes_no_branch():
    before, after = ([GOOD, [12, -80, 90, 20, fifth, 20]] for fifth in (1e-13, -1e-13))
    before[0] = after[0] = [10, -80, 90, 20, 0, 20]
    assert made_worse(check_path(PRIME, before), check_path(PRIME, after)) == []
    bent = [before[0], [12, -80, 90, 20, -0.5, 20]]
    assert [finding.code for finding in made_worse(check_path(PRIME, before), check_path(PRIME, bent))] == [
        "BRANCH_CHANGE"
    ]
