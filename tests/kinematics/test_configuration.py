"""Status and turn, confdata: tables worked by hand, both directions, full turns, borders, and what is refused."""

import dataclasses

import numpy as np
import pytest
from branches import ABB_BRANCHES, KUKA_BRANCHES
from by_hand import ABB, KUKA
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.spatial.transform import RigidTransform, Rotation

from respot.geometry import IDENTITY, pose, rotation_from_abc
from respot.kinematics.cell import RobotCell
from respot.kinematics.configuration import configuration_of, reconfigure, taught_joints
from respot.kinematics.dh import DhRobot, Link
from respot.kinematics.posture import posture
from respot.kinematics.robots import built_in_robots, find_robot

WIDE = np.array([[-185, 185], [-175, 175], [-175, 175], [-350, 350], [-175, 175], [-350, 350.0]])
PRIME = RobotCell(find_robot("kr210_r2700_prime").with_limits(WIDE), "krl")
IRB6700 = RobotCell(find_robot("irb6700_200_260").with_limits(WIDE), "rapid")
TOOL = pose([120, -40, 310], rotation_from_abc([20, -70, 15]))

ROWS = [(PRIME, KUKA, q, (s, t)) for q, s, t in KUKA_BRANCHES] + [(IRB6700, ABB, q, c) for q, c in ABB_BRANCHES]


@pytest.mark.parametrize(("cell", "hand", "joints", "configuration"), ROWS)
def test_branches_by_hand(cell, hand, joints, configuration):
    # the table itself: every row reaches the pose of its first one
    first = ROWS[0][2] if cell is PRIME else ROWS[8][2]
    assert np.array(hand.forward(joints)) == pytest.approx(np.array(hand.forward(first)), abs=1e-3)
    assert configuration_of(cell, joints)[0].tolist() == list(configuration)
    flange = RigidTransform.from_matrix(np.array(hand.forward(first)))
    found, reasons = taught_joints(cell, IDENTITY, flange, configuration)
    assert reasons == (None,)
    assert found[0] == pytest.approx(joints, abs=1e-5)


@pytest.mark.parametrize(("angle", "bit"), [(0.0, 0), (-0.0, 0), (1e-9, 0), (-1e-9, 1), (190, 0), (-190, 1), (-0.5, 1)])
def test_turn_bits_are_signs(angle, bit):
    for axis in range(6):
        joints = np.full(6, 10.0)
        joints[axis] = angle
        assert configuration_of(PRIME, joints)[0, 1] == bit << axis


@pytest.mark.parametrize(
    ("angle", "quadrant"),
    [(0, 0), (89.999, 0), (90, 1), (179.9, 1), (180, 2), (269, 2), (270, 3), (-1e-9, -1), (-90, -1), (-90.001, -2),
     (-180, -2), (-180.5, -3), (-359, -4), (-360, -4), (300, 3)],
)  # fmt: skip
def test_quadrants_are_floors(angle, quadrant):
    for column, axis in enumerate((0, 3, 5)):
        joints = np.full(6, 10.0)
        joints[axis] = angle
        assert configuration_of(IRB6700, joints)[0, column] == quadrant


def test_status_bit_of_the_elbow_is_1_at_the_stretched_angle():
    phi = -np.degrees(np.arctan2(41, 1200))
    assert [
        configuration_of(PRIME, [0, -60, a3, 0, 30, 0])[0, 0] for a3 in (0, phi + 1e-9, phi - 1e-9, -1.9, -2.0)
    ] == [2, 2, 0, 2, 0]


def test_overhead_is_the_wrist_behind_axis_one():
    # 350 forward, then the arm leans back: 1150 upright, the forearm 1200 backwards
    assert configuration_of(PRIME, [0, -90, -90, 0, 30, 0])[0, 0] == 1
    assert configuration_of(PRIME, [0, -90, 90, 0, 30, 0])[0, 0] == 2


def test_unused_bits_are_kept():
    result = configuration_of(PRIME, [[0, -90, 90, 10, -30, 0]], [[16 + 2, 8]])
    assert result.tolist() == [[16 + 6, 2 + 16]]


# never nearer than 0.15 degrees to a multiple of 90
ANGLES = st.lists(st.integers(-566, 566).map(lambda n: 0.3 * n + 0.15), min_size=6, max_size=6)
WRISTS = st.integers(-1160, 1160).map(lambda n: 0.3 * n + 0.15)


@given(st.sampled_from(sorted(built_in_robots())), ANGLES, WRISTS, WRISTS)
def test_joints_to_configuration_to_joints(name, joints, fourth, sixth):
    joints = np.array([*joints[:3], fourth, joints[4], sixth])
    language = "krl" if name.startswith("kr") else "rapid"
    cell = RobotCell(find_robot(name).with_limits(WIDE), language)
    assume(not cell.model.coupled_23)
    front, elbow, wrist = np.abs(posture(cell.model, joints))
    assume(front > 1.0 and min(elbow, 180 - elbow) > 0.1 and min(wrist, 180 - wrist) > 0.1)
    configuration = configuration_of(cell, joints)
    found, reasons = taught_joints(cell, TOOL, cell.model.forward(joints) * TOOL, configuration)
    assert reasons == (None,)
    assert found[0] == pytest.approx(joints, abs=1e-5)


@given(st.sampled_from([PRIME, IRB6700]), ANGLES, WRISTS, WRISTS)
def test_a_point_that_does_not_move_keeps_everything(cell, joints, fourth, sixth):
    joints = np.array([*joints[:3], fourth, joints[4], sixth])
    front, elbow, wrist = np.abs(posture(cell.model, joints))
    assume(front > 1.0 and min(elbow, 180 - elbow) > 0.1 and min(wrist, 180 - wrist) > 0.1)
    world = cell.model.forward(joints) * TOOL
    configuration = configuration_of(cell, joints)
    result = reconfigure(cell, TOOL, world, world, configuration)
    assert result.reasons == (None,)
    assert result.configuration.tolist() == configuration.tolist()
    assert result.joints == pytest.approx(result.old_joints, abs=1e-9)


def moved(cell, before, after, configuration=None):
    """Reconfigure the flange pose of some joints to that of other joints."""
    old = configuration_of(cell, before) if configuration is None else configuration
    return reconfigure(cell, TOOL, cell.model.forward(before) * TOOL, cell.model.forward(after) * TOOL, old)


def test_a4_from_179_to_181_keeps_its_turn():
    result = moved(PRIME, [10, -80, 90, 179, 40, 20], [10, -80, 90, 181, 40, 20])
    assert result.joints[0] == pytest.approx([10, -80, 90, 181, 40, 20])
    assert result.configuration.tolist() == [[2, 2]]  # arctan2 says -179, which would set bit 3


def test_a6_from_minus_179_to_minus_181_keeps_its_turn():
    result = moved(PRIME, [10, -80, 90, 20, 40, -179], [10, -80, 90, 20, 40, -181])
    assert result.joints[0, 5] == pytest.approx(-181)
    assert result.configuration.tolist() == [[2, 2 + 32]]


def test_a_bit_that_must_flip_flips():
    result = moved(PRIME, [0.4, -80, 90, 20, 40, 20], [-0.4, -80, 90, 20, 40, 20])
    assert result.configuration.tolist() == [[2, 2 + 1]]


def test_a_wrist_that_passes_its_singularity_changes_status():
    result = moved(PRIME, [10, -80, 90, 20, 1, 20], [10, -80, 90, 20, -1, 20])
    assert result.configuration.tolist() == [[2 + 4, 2 + 16]]
    assert result.joints[0] == pytest.approx([10, -80, 90, 20, -1, 20])


def test_quadrants_count_on_over_the_half_turn():
    result = moved(IRB6700, [10, 5, 5, 179, 40, -269], [10, 5, 5, 181, 40, -271])
    assert result.configuration.tolist() == [[0, 2, -4, 0]]
    assert result.joints[0] == pytest.approx([10, 5, 5, 181, 40, -271])


@pytest.mark.parametrize("side", [1, -1])
def test_within_a_millionth_of_the_border_the_old_value_stays(side):
    for cell, kept in ((PRIME, [2, 2]), (IRB6700, [0, 0, 0, 0])):
        joints = [20, -80, 90, 30, 40, 50] if cell is PRIME else [20, 5, 5, 30, 40, 50]
        border = [*joints[:3], side * 5e-7, *joints[4:]]
        assert configuration_of(cell, border, [kept]).tolist() == [kept]
        other = [2, 2 + 8] if cell is PRIME else [0, -1, 0, 0]
        assert configuration_of(cell, border, [other]).tolist() == [other]
        beyond = [*joints[:3], side * 2e-6, *joints[4:]]
        assert configuration_of(cell, beyond, [kept]).tolist() == [kept if side > 0 else other]
        assert configuration_of(cell, beyond, [other]).tolist() == [kept if side > 0 else other]


def test_a_number_that_is_not_next_to_the_border_is_not_kept():
    joints = [20, 5, 5, 1e-7, 40, 50]
    assert configuration_of(IRB6700, joints, [[0, 3, 0, 0]]).tolist() == [[0, 0, 0, 0]]


def test_taught_points_are_printed_with_few_digits():
    # A4 = 0 exactly when taught, a hair below it from the printed pose: T says >= 0, and nobody turns axis 4 for it
    before = [10, -80, 90, -0.004, 40, 20]
    result = moved(PRIME, before, before, [[2, 2]])
    assert result.reasons == (None,)
    assert result.old_joints[0, 3] == pytest.approx(-0.004)


def test_leaving_the_limits_names_axis_and_angle():
    result = moved(PRIME, [10, -80, 90, 349, 40, 20], [10, -80, 90, 351, 40, 20])
    assert result.reasons[0].code == "OUT_OF_LIMITS"
    assert "axis 4" in str(result.reasons[0]) and "351.000" in str(result.reasons[0])
    result = moved(PRIME, [0.4, -80, 90, 349, 40, 20], [-0.4, -80, 90, 351, 40, 20])
    assert result.reasons[0].code == "OUT_OF_LIMITS"
    assert result.configuration.tolist() == [[2, 2]]  # the old numbers, untouched


def test_without_limits_nothing_is_out_of_them():
    free = dataclasses.replace(PRIME, model=PRIME.model.with_limits(None))
    assert moved(free, [10, -80, 90, 349, 40, 20], [10, -80, 90, 351, 40, 20]).joints[0, 3] == pytest.approx(351)


def test_out_of_reach_says_how_far():
    old = PRIME.model.forward([10, -80, 90, 20, 40, 20]) * TOOL
    new = RigidTransform.from_translation([3000, 0, 0]) * old
    result = reconfigure(PRIME, TOOL, old, new, [[2, 2]])
    assert result.reasons[0].code == "OUT_OF_REACH" and "mm beyond the arm" in str(result.reasons[0])
    assert np.isnan(result.joints).all()


def test_numbers_that_fit_no_solution_are_not_guessed():
    joints = [10, -80, 90, 20, 40, 20]
    for wrong in ([3, 2], [6, 2], [0, 2], [2, 3], [2, 0], [2, 64], [40, 2], [-1, 2]):
        result = moved(PRIME, joints, joints, [wrong])
        assert result.reasons[0].code == "CONFIG_INCONSISTENT", wrong
        assert f"S {wrong[0]}, T {wrong[1]}" in str(result.reasons[0])
        assert "S 2, T 2" in str(result.reasons[0])
        assert result.configuration.tolist() == [wrong]
    joints = [10, 5, 5, 20, 40, 20]
    for wrong in ([1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1], [0, 0, 0, 4], [0, 0, 0, 9], [0, 12, 0, 0]):
        result = moved(IRB6700, joints, joints, [wrong])
        assert result.reasons[0].code == "CONFIG_INCONSISTENT", wrong
        assert "[0,0,0,0]" in str(result.reasons[0])


def test_without_limits_a_wrong_quadrant_is_still_wrong():
    free = dataclasses.replace(IRB6700, model=IRB6700.model.with_limits(None))
    joints = [10, 5, 5, 20, 40, 20]
    assert moved(free, joints, joints, [[0, 1, 0, 0]]).reasons[0].code == "CONFIG_INCONSISTENT"
    assert moved(free, joints, joints, [[0, 4, 0, 0]]).joints[0, 3] == pytest.approx(380)


def test_a_taught_pose_out_of_reach_blames_the_model():
    far = RigidTransform.from_translation([9000, 0, 0])
    result = reconfigure(PRIME, IDENTITY, far, far, [[2, 2]])
    assert result.reasons[0].code == "CONFIG_INCONSISTENT" and "out of reach" in str(result.reasons[0])


def test_a_pose_that_is_no_number_is_a_reason():
    good = RigidTransform.from_translation([1500, 0, 1200])
    bad = RigidTransform.from_translation([np.nan, 0, 0])
    conf = configuration_of(PRIME, PRIME.model.inverse(good)[0, :1])
    assert "not a number" in str(reconfigure(PRIME, IDENTITY, good, bad, conf).reasons[0])
    assert reconfigure(PRIME, IDENTITY, bad, good, conf).reasons[0].code == "CONFIG_INCONSISTENT"


def test_many_targets_at_once_are_the_same_as_one_by_one():
    random = np.random.default_rng(3)
    low, high = [-100, -120, 40, -340, -100, -340], [100, -40, 120, 340, 100, 340]
    joints = random.uniform(low, high, (40, 6))
    old = PRIME.model.forward(joints) * TOOL
    shift = pose([12, -7, 5], rotation_from_abc([1.0, -0.5, 0.7]))
    conf = configuration_of(PRIME, joints)
    many = reconfigure(PRIME, TOOL, old, shift * old, conf)
    for row in range(40):
        one = reconfigure(PRIME, TOOL, old[row], shift * old[row], conf[row])
        assert one.joints[0] == pytest.approx(many.joints[row], nan_ok=True)
        assert one.reasons[0] == many.reasons[row]
        assert one.configuration[0].tolist() == many.configuration[row].tolist()
    assert many.valid.sum() > 30


def test_the_robot_root_stands_in_the_chain():
    root = pose([6581.25, 256.875, -34.5], rotation_from_abc([179.75, 0, 0]))
    cell = dataclasses.replace(PRIME, robroot=root)
    joints = [10, -80, 90, 20, 40, 20]
    found, reasons = taught_joints(cell, TOOL, root * cell.model.forward(joints) * TOOL, [[2, 2]])
    assert reasons == (None,) and found[0] == pytest.approx(joints)


def test_who_is_not_computed():
    joints = [10, -80, 90, 20, 40, 20]
    track = dataclasses.replace(PRIME, on_track=True)
    result = moved(track, joints, joints, [[2, 2]])
    assert result.reasons[0].code == "CONFIG_NOT_CHECKED" and "external axis" in str(result.reasons[0])
    seven = RobotCell(DhRobot(name="seven", links=(Link(d=300.0),) * 7))
    result = reconfigure(seven, IDENTITY, IDENTITY, IDENTITY, [[2, 2]])
    assert result.reasons[0].code == "CONFIG_NOT_CHECKED"
    with pytest.raises(ValueError, match="seven"):
        configuration_of(seven, np.zeros(7))


@pytest.mark.parametrize("by_bit", [True, False])
def test_absolutely_accurate_robots_decide_nothing_near_a_border(by_bit):
    cell = PRIME if by_bit else dataclasses.replace(PRIME, absolute_accuracy=True)
    bit = 16 if by_bit else 0
    far = moved(cell, [10, -80, 90, 20, 40, 20], [10, -80, 90, 22, 40, 20], [[bit + 2, 2]])
    assert far.reasons == (None,) and far.configuration.tolist() == [[bit + 2, 2]]
    near = moved(cell, [10, -80, 90, 0.3, 40, 20], [10, -80, 90, 0.2, 40, 20], [[bit + 2, 2]])
    assert near.reasons[0].code == "CONFIG_NOT_CHECKED"


def test_parallel_linkage_keeps_cfx_and_refuses_what_is_ambiguous():
    narrow = np.array([[-180, 180], [-100, 110], [-60, 65], [-200, 200], [-120, 120], [-400, 400.0]])
    cell = RobotCell(find_robot("irb2400").with_limits(narrow), "rapid")
    joints, after = [20, 30, -5, 40, -50, 60], [20, 31, -5, 40, -50, 95]
    result = moved(cell, joints, after, [[0, 0, 0, 0]])
    assert result.reasons == (None,)
    assert result.configuration.tolist() == [[0, 0, 1, 0]]
    assert result.joints[0] == pytest.approx(after)


def test_a_large_travel_of_one_axis_does_not_hide_the_others():
    # almost stretched: both elbow branches are near, and axis 1 alone travels most in both
    joints = [0.15, 0.15, -0.75, 0.15, -0.15, 0.15]
    result = moved(PRIME, joints, [-2.85, *joints[1:]])
    assert result.joints[0] == pytest.approx([-2.85, *joints[1:]])


@given(ANGLES, st.floats(-4, 4))
def test_rotation_about_the_robot_base_only_turns_axis_one(joints, turn):
    joints = np.array(joints)
    front, elbow, wrist = np.abs(posture(PRIME.model, joints))
    assume(front > 1 and min(elbow, 180 - elbow) > 0.1 and min(wrist, 180 - wrist) > 0.1)
    base = RigidTransform.from_rotation(Rotation.from_euler("z", turn, degrees=True))
    old = PRIME.model.forward(joints) * TOOL
    result = reconfigure(PRIME, TOOL, old, base * old, configuration_of(PRIME, joints))
    assert result.reasons == (None,)
    assert result.joints[0] - joints == pytest.approx([-turn, 0, 0, 0, 0, 0], abs=1e-6)
