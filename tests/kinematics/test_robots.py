"""Robot models against tables worked by hand, an independent kinematics, and each other."""

import itertools
import math

import numpy as np
import pytest
from by_hand import ABB, KUKA
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.spatial.transform import RigidTransform, Rotation

from respot.geometry import abc_from_rotation, quaternion_from_rotation
from respot.issues import BadInputError
from respot.kinematics.opw import OpwRobot
from respot.kinematics.posture import posture
from respot.kinematics.robots import built_in_robots, find_robot, similar_robots

ROBOTS = built_in_robots()
PRIME, IRB6700 = find_robot("kr210_r2700_prime"), find_robot("irb6700_200_260")
ANGLES = st.lists(st.floats(-179.0, 179.0), min_size=6, max_size=6)
names = st.sampled_from(sorted(ROBOTS))


def nearest(solutions, joints):
    """Largest joint difference of the solution that is nearest to joints."""
    return np.nanmin(np.abs(solutions - joints).max(axis=1))


# Flange of a KR 210 R2700 prime, from its drawing: 350 + 1200 + 240 forward, 675 + 1150 - 41 up. Each row turns one
# axis of the first; the columns are A1..A6, X, Y, Z and where the flange's z and x axes point.
KUKA_TABLE = [
    ((0, -90, 90, 0, 0, 0), (1790, 0, 1784), (1, 0, 0), (0, 0, -1)),
    ((90, -90, 90, 0, 0, 0), (0, -1790, 1784), (0, -1, 0), (0, 0, -1)),  # A1 clockwise from above
    ((0, 0, 0, 0, 0, 0), (350 + 1150 + 1200 + 240, 0, 675 - 41), (1, 0, 0), (0, 0, -1)),  # stretched out
    ((0, -90, 0, 0, 0, 0), (350 + 41, 0, 675 + 1150 + 1200 + 240), (0, 0, 1), (1, 0, 0)),  # straight up
    ((0, -90, 90, 0, 90, 0), (1550, 0, 1784 - 240), (0, 0, -1), (-1, 0, 0)),  # A5 nods down
    ((0, -90, 90, 90, 90, 0), (1550, -240, 1784), (0, -1, 0), (-1, 0, 0)),  # A4 rolls left, seen from behind
    ((0, -90, 90, 0, 0, 90), (1790, 0, 1784), (1, 0, 0), (0, -1, 0)),  # A6 as A4
]
# IRB 6700-200/2.60: 320 + 1142.5 + 200 forward, 780 + 1125 + 200 up.
ABB_TABLE = [
    ((0, 0, 0, 0, 0, 0), (1662.5, 0, 2105), (1, 0, 0), (0, 0, -1)),
    ((90, 0, 0, 0, 0, 0), (0, 1662.5, 2105), (0, 1, 0), (0, 0, -1)),
    ((0, 90, 0, 0, 0, 0), (320 + 1125 + 200, 0, 780 - 1342.5), (0, 0, -1), (-1, 0, 0)),
    ((0, 0, 90, 0, 0, 0), (320 + 200, 0, 780 + 1125 - 1342.5), (0, 0, -1), (-1, 0, 0)),
    ((0, 0, 0, 0, 90, 0), (1462.5, 0, 2105 - 200), (0, 0, -1), (-1, 0, 0)),
    ((0, 0, 0, 90, 90, 0), (1462.5, 200, 2105), (0, 1, 0), (-1, 0, 0)),
    ((0, 0, 0, 0, 0, 90), (1662.5, 0, 2105), (1, 0, 0), (0, 1, 0)),
]


@pytest.mark.parametrize(
    ("robot", "joints", "position", "z", "x"),
    [(PRIME, *row) for row in KUKA_TABLE] + [(IRB6700, *row) for row in ABB_TABLE],
)
def test_flange_by_hand(robot, joints, position, z, x):
    flange = robot.forward(joints)
    assert flange.translation == pytest.approx(position, abs=1e-9)
    assert flange.rotation.as_matrix()[:, 2] == pytest.approx(z, abs=1e-12)
    assert flange.rotation.as_matrix()[:, 0] == pytest.approx(x, abs=1e-12)


def test_prime_home_as_the_pendant_shows_it():
    flange = PRIME.forward([0, -90, 90, 0, 0, 0])
    assert flange.translation == pytest.approx([1790, 0, 1784])
    assert abc_from_rotation(flange.rotation) == pytest.approx([0, 90, 0], abs=1e-6)


def test_abb_zero_as_the_pendant_shows_it():
    assert quaternion_from_rotation(IRB6700.forward(np.zeros(6)).rotation) == pytest.approx(
        [math.sqrt(0.5), 0, math.sqrt(0.5), 0]
    )


def test_parallel_linkage_holds_the_forearm_level():
    # IRB 2400: axis 3 is the forearm's own angle; with axis 2 at 30 degrees and axis 3 at 0 the forearm stays level
    robot = find_robot("irb2400")
    flange = robot.forward([0, 30, 0, 0, 0, 0])
    forward, up = 100 + 705 * 0.5 + 755 + 85, 615 + 705 * math.sqrt(0.75) + 135
    assert flange.translation == pytest.approx([forward, 0, up])
    assert flange.rotation.as_matrix()[:, 2] == pytest.approx([1, 0, 0], abs=1e-12)
    solutions = robot.inverse(robot.forward([10, 30, -5, 20, 40, 60]))[0]
    assert nearest(solutions, [10, 30, -5, 20, 40, 60]) < 1e-9


def test_every_row_has_a_source_and_a_commit():
    assert len(ROBOTS) == 74
    for name, row in ROBOTS.items():
        assert "/" in row.source and len(row.commit) >= 7, name
        assert row.model.limits_deg is None and row.model.limits_text == "limits unknown, not checked"
        kuka = name.startswith("kr")
        assert row.model.signs == ((-1, 1, 1, -1, 1, -1) if kuka else (1,) * 6), name


def test_quantec_generations_differ_in_the_sign_of_the_elbow_offset():
    assert {find_robot(n).a2 for n in ("kr210_r2700_extra", "kr210_r2700_prime", "kr210_r3100_ultra")} == {41.0}
    assert {find_robot(n).a2 for n in ("kr210_r2700_2", "kr210_r3100_2", "kr120_r2700_2")} == {-115.0}


def test_names_are_forgiving_and_suggestions_help():
    assert find_robot("KR 210 R2700-2").name == "kr210_r2700_2"
    with pytest.raises(BadInputError, match="irb6700_200_260"):
        find_robot("irb6700_205_260")
    assert similar_robots("nothing like it at all") == []


@given(names, ANGLES)
def test_forward_inverse_forward(name, joints):
    robot = ROBOTS[name].model
    flange = robot.forward(joints)
    solutions = robot.inverse(flange)[0]
    exists = np.isfinite(solutions).all(axis=1)
    assert exists.any()
    again = robot.forward(solutions[exists])
    assert np.abs(again.translation - flange.translation).max() < 1e-6
    assert np.degrees((again.rotation * flange.rotation.inv()).magnitude()).max() < 1e-6


@pytest.mark.parametrize("fifth", [0.0, 1e-8, -1e-6, 1e-4, 180.0, 30.0])
@pytest.mark.parametrize("bend", [0.0, 1e-8, -1e-6, 1e-4, 60.0])
@pytest.mark.parametrize("robot", [PRIME, IRB6700, find_robot("irb1600_6_12"), find_robot("irb2400")])
def test_singular_poses_are_solved_as_exactly_as_others(robot, bend, fifth):
    # axis 3 such that the arm is bent by so much from stretched
    stretched = -math.degrees(math.atan2(robot.a2, robot.c3)) + robot.offsets_deg[2] + (20 if robot.coupled_23 else 0)
    flange = robot.forward([10, 20, stretched + bend, 30, fifth, 40])
    solutions = robot.inverse(flange)[0]
    exists = np.isfinite(solutions).all(axis=1)
    again = robot.forward(solutions[exists])
    assert exists.any()
    assert np.abs(again.translation - flange.translation).max(initial=0.0) < 1e-6
    assert np.degrees((again.rotation * flange.rotation.inv()).magnitude()).max(initial=0.0) < 1e-7


@given(names, ANGLES)
def test_the_joints_are_among_the_branches(name, joints):
    robot = ROBOTS[name].model
    front, elbow, wrist = posture(robot, np.array(joints))
    assume(abs(front) > 1.0 and min(abs(elbow), 180 - abs(elbow)) > 0.1 and min(abs(wrist), 180 - abs(wrist)) > 0.1)
    solutions = robot.inverse(robot.forward(joints), near=joints)[0]
    assert nearest(solutions, joints) < 1e-5


@given(st.sampled_from([(PRIME, KUKA), (IRB6700, ABB)]), ANGLES)
def test_forward_is_the_product_by_hand(pair, joints):
    robot, hand = pair
    assert robot.forward(joints).as_matrix() == pytest.approx(np.array(hand.forward(joints)), abs=1e-9)


@given(st.sampled_from([(PRIME, KUKA), (IRB6700, ABB)]), ANGLES)
def test_branches_are_those_of_the_law_of_cosines(pair, joints):
    robot, hand = pair
    front, elbow, wrist = posture(robot, np.array(joints))
    assume(abs(front) > 50 and 3 < abs(elbow) < 177 and 3 < abs(wrist) < 177)
    found = robot.inverse(robot.forward(joints))[0]
    found = found[np.isfinite(found).all(axis=1)]
    expected = np.array([q for q, _, _ in hand.inverse(hand.forward(joints))])
    assume(all(abs(math.sin(math.radians(q[4]))) > 0.02 for q in expected))
    assert len(found) == len(expected)
    for solution in expected:
        difference = (found - solution + 180) % 360 - 180
        assert np.abs(difference).max(axis=1).min() < 1e-5


@given(names, ANGLES)
def test_forward_is_py_opw_kinematics(name, joints):
    robot = ROBOTS[name].model
    serial = np.array(joints)
    if robot.coupled_23:
        serial[2] -= serial[1]
    expected = robot._solver.forward(tuple(serial)).as_matrix()
    assert robot.forward(joints).as_matrix() == pytest.approx(expected, abs=1e-9)


def test_sideways_offset():
    robot = OpwRobot(name="side", a1=100, a2=0, b=30, c1=0, c2=500, c3=400, c4=50)
    assert robot.forward(np.zeros(6)).translation == pytest.approx([100, 30, 950])
    flange = robot.forward([10, 20, 60, 30, 40, 50])
    solutions = robot.inverse(flange)[0]
    assert nearest(solutions, [10, 20, 60, 30, 40, 50]) < 1e-9
    assert robot.reach_text(RigidTransform.from_translation([10, 0, 0])).startswith(
        "the wrist centre is 20.0 mm too near"
    )


def test_single_and_batch_agree():
    joints = np.random.default_rng(1).uniform(-150, 150, (5, 6))
    batch = PRIME.forward(joints)
    assert PRIME.forward(joints[2]).as_matrix() == pytest.approx(batch[2].as_matrix())
    assert PRIME.inverse(batch).shape == (5, 8, 6)
    assert PRIME.inverse(batch[2]) == pytest.approx(PRIME.inverse(batch)[2:3], nan_ok=True)
    assert PRIME.inverse(batch[:0]).shape == (0, 8, 6)


def test_near_gives_every_branch_its_full_turns():
    flange = PRIME.forward([10, -80, 80, 30, 40, 20])
    near = [10, -80, 80, 390, 40, -340]
    solutions = PRIME.inverse(flange, near=near)[0]
    assert nearest(solutions, near) < 1e-9
    assert np.nanmax(np.abs(solutions - near)) <= 180.0 + 1e-9


def test_out_of_reach_is_nan_and_says_how_far():
    pose = RigidTransform.from_components([4000, 0, 675], Rotation.from_euler("y", 90, degrees=True))
    assert np.isnan(PRIME.inverse(pose)).all()
    reach = 1150 + math.hypot(1200, 41)
    assert f"{4000 - 240 - 350 - reach:.1f} mm beyond" in PRIME.reach_text(pose)


def test_a_pose_that_is_no_number_has_no_solution():
    poses = RigidTransform.from_translation([[np.nan, 0, 0], [1500, 0, 1000]])
    found = PRIME.inverse(poses)
    assert np.isnan(found[0]).all() and np.isfinite(found[1]).any()


@pytest.mark.parametrize(
    ("joints", "match"),
    [
        ([0, 0, 0, 0, 0], "shape"),
        ([0, 0, np.nan, 0, 0, 0], "axis 3"),
        ([[0] * 6, [0, 0, 0, 0, np.inf, 0]], "row 2, axis 5"),
    ],
)
def test_bad_joints_are_refused(joints, match):
    with pytest.raises(ValueError, match=match):
        PRIME.forward(joints)


@pytest.mark.parametrize(
    ("change", "match"),
    [({"c2": 0.0}, "c2"), ({"c3": -5.0}, "c3"), ({"a1": np.nan}, "a1"), ({"c4": 2e5}, "c4"),
     ({"signs": (1, 1, 1, 1, 1, 0)}, "signs"), ({"offsets_deg": (0.0,)}, "offsets_deg")],
)  # fmt: skip
def test_absurd_lengths_are_refused(change, match):
    row = {"name": "x", "a1": 350, "a2": 41, "c1": 675, "c2": 1150, "c3": 1200, "c4": 240} | change
    with pytest.raises(ValueError, match=match):
        OpwRobot(**row)


def test_limits_must_be_in_order():
    limits = [[-180, 180]] * 6
    assert PRIME.with_limits(limits).limits_text == "limits known"
    limits[3] = [10, -10]
    with pytest.raises(ValueError, match="axis 4"):
        PRIME.with_limits(limits)


def test_eight_branches_differ_in_the_three_choices():
    flange = PRIME.forward([25, -75, 100, 35, 40, -60])
    signs = posture(PRIME, PRIME.inverse(flange)[0]) < 0
    assert {tuple(row) for row in signs.tolist()} == set(itertools.product((True, False), repeat=3))
