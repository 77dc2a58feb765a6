"""DH robots: forward against plain products, numerical inverse, TOML files."""

import numpy as np
import pytest
from by_hand import along, product, turn
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import RigidTransform

from respot.issues import BadInputError
from respot.kinematics.dh import DhRobot, Link
from respot.kinematics.robot_file import read_robot_file, robot_of
from respot.kinematics.robots import find_robot

# UR10, nominal, from the data set's own documentation (shared data, ur10/ur10.toml)
UR10 = DhRobot(
    name="UR10",
    links=(Link(0, 90, 127.3), Link(-612), Link(-572.3), Link(0, 90, 163.941), Link(0, -90, 115.7), Link(0, 0, 92.2)),
)
GANTRY = DhRobot(
    name="gantry",
    links=(
        Link(0, 90, 0, 90, True), Link(0, 90, 0, 90, True), Link(0, 0, 100, 0, True),
        Link(0, 90, 300), Link(0, -90, 0), Link(0, 0, 80),
    ),
)  # fmt: skip
SEVEN = DhRobot(
    name="seven",
    links=(
        Link(0, -90, 340),
        Link(0, 90),
        Link(0, 90, 400),
        Link(0, -90),
        Link(0, -90, 400),
        Link(0, 90),
        Link(0, 0, 126),
    ),
)
# A KR 210 R2700 prime in standard DH: the closed form and the numerical inverse see the same robot.
PRIME_DH = DhRobot(
    name="prime_dh",
    links=(
        Link(350, -90, 675), Link(1150, 0, 0, -90), Link(41, 90, 0, 90), Link(0, -90, 1200), Link(0, 90), Link(0, 0, 240),
    ),
)  # fmt: skip
SIGNS, ZERO = np.array([-1, 1, 1, -1, 1, -1]), np.array([0, 90, 0, 0, 0, 0])


def plain(robot, joints):
    """The textbook's products, link by link."""
    result = along()
    for link, joint in zip(robot.links, joints, strict=True):
        theta, d = (link.offset, link.d + joint) if link.prismatic else (link.offset + joint, link.d)
        twist, length = turn("x", link.alpha), along(x=link.a)
        screw = product(turn("z", theta), along(z=d))
        result = product(result, twist, length, screw) if robot.modified else product(result, screw, length, twist)
    return np.array(result)


@pytest.mark.parametrize("modified", [False, True])
@pytest.mark.parametrize("robot", [UR10, GANTRY, SEVEN])
@given(st.lists(st.floats(-180, 180), min_size=7, max_size=7))
def test_forward_is_the_textbooks_product(robot, modified, joints):
    robot = DhRobot(links=robot.links, modified=modified)
    q = joints[: robot.axes]
    assert robot.forward(q).as_matrix() == pytest.approx(plain(robot, q), abs=1e-9)


def test_ur10_by_hand():
    # arm stretched along -x at height d1; d4 and d6 stand off along -y; d5 hangs down
    flange = UR10.forward(np.zeros(6))
    assert flange.translation == pytest.approx([-612 - 572.3, -163.941 - 92.2, 127.3 - 115.7], abs=1e-9)


def test_closed_form_and_dh_are_the_same_robot():
    prime = find_robot("kr210_r2700_prime")
    q = np.random.default_rng(2).uniform(-170, 170, (50, 6))
    assert PRIME_DH.forward(q * SIGNS + ZERO).as_matrix() == pytest.approx(prime.forward(q).as_matrix(), abs=1e-9)


@pytest.mark.parametrize("robot", [UR10, SEVEN, GANTRY, PRIME_DH])
def test_numerical_inverse_reaches_what_can_be_reached(robot):
    random = np.random.default_rng(4)
    span = np.where(robot.revolute, 180.0, 800.0)
    joints = random.uniform(-span, span, (400, robot.axes))
    poses = robot.forward(joints)
    found = robot.inverse(poses, near=np.zeros(robot.axes))
    reached = np.isfinite(found[:, 0]).all(axis=1)
    assert reached.mean() >= 0.999
    again = robot.forward(found[reached, 0])
    assert np.linalg.norm(again.translation - poses[reached].translation, axis=1).max() < 1e-5
    assert np.degrees((again.rotation * poses[reached].rotation.inv()).magnitude()).max() < 1e-6
    assert np.isnan(found[:, 1:]).all()


def test_descent_from_near_stays_near():
    joints = np.random.default_rng(6).uniform(-100, 100, (50, 6))
    joints[:, 5] += 360
    joints[:, 4] = np.abs(joints[:, 4]) + 20
    found = UR10.inverse(UR10.forward(joints + 0.2), near=joints)[:, 0]
    assert np.median(np.abs(found - joints - 0.2).max(axis=1)) < 1e-6


def test_all_branches_of_a_dh_robot_are_those_of_the_closed_form():
    prime = find_robot("kr210_r2700_prime")
    q = np.array([25, -75, 100, 35, 40, -60.0])
    solutions = PRIME_DH.inverse(PRIME_DH.forward(q * SIGNS + ZERO))[0]
    assert np.isfinite(solutions).all()
    back = (solutions - ZERO) * SIGNS
    closed = prime.inverse(prime.forward(q))[0]
    for solution in closed:
        difference = (back - solution + 180) % 360 - 180
        assert np.abs(difference).max(axis=1).min() < 1e-4


def test_out_of_reach_is_nan():
    assert np.isnan(UR10.inverse(RigidTransform.from_translation([3000, 0, 0]), near=np.zeros(6))).all()
    assert UR10.inverse(RigidTransform.from_translation(np.zeros((0, 3)))).shape == (0, 8, 6)


FILE = """
name = "UR10"
convention = "dh"
payload_kg = 10
limits_deg = [[-360, 360], [-360, 360], [-360, 360], [-360, 360], [-360, 360], [-360, 360]]
[[link]]
a = 0.0
alpha = 90.0
d = 127.3
[[link]]
a = -612.0
alpha = 0.0
d = 0.0
[[link]]
a = -572.3
alpha = 0.0
d = 0.0
[[link]]
a = 0.0
alpha = 90.0
d = 163.941
[[link]]
a = 0.0
alpha = -90.0
d = 115.7
[[link]]
a = 0.0
alpha = 0.0
d = 92.2
"""
OPW = """
convention = "opw"
a1 = 350
a2 = 41.0
c1 = 675
c2 = 1150
c3 = 1200
c4 = 240
offsets_deg = [0, -90, 0, 0, 0, 0]
signs = [-1, 1, 1, -1, 1, -1]
"""


def written(tmp_path, text):
    path = tmp_path / "robot.toml"
    path.write_text(text)
    return path


def test_files(tmp_path):
    robot = read_robot_file(written(tmp_path, FILE))
    assert robot.name == "UR10" and robot.payload_kg == 10 and robot.limits_deg.shape == (6, 2)
    q = [10, 20, 30, 40, 50, 60]
    assert robot.forward(q).as_matrix() == pytest.approx(UR10.forward(q).as_matrix())
    robot = robot_of(str(written(tmp_path, OPW)))
    assert robot.name == "robot"
    assert robot.forward(q).as_matrix() == pytest.approx(find_robot("kr210_r2700_prime").forward(q).as_matrix())
    assert robot_of("irb6700_200_260").name == "irb6700_200_260"
    gantry = FILE.replace("d = 92.2", 'd = 92.2\ntype = "prismatic"\noffset = 30').replace('"dh"', '"mdh"')
    robot = read_robot_file(written(tmp_path, gantry))
    assert robot.modified and robot.revolute.tolist() == [True] * 5 + [False]


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        ('"dh"', '"hd"', "convention"),
        ("a = -612.0", "", "link 2 lacks a"),
        ("a = -612.0", "a = nan", "link 2: a"),
        ("a = -612.0", 'a = "long"', "link 2: a"),
        ("a = -612.0", "a = -612000.0", "link 2: a"),
        ("a = -612.0", "aa = -612.0", "did you mean a"),
        ("payload_kg", "payload", "payload_kg"),
        ("payload_kg = 10", "payload_kg = true", "payload_kg"),
        ("[-360, 360], [-360, 360]]", "[-360, 360]]", "limits must be 6 pairs"),
        ("[-360, 360]]", "[360, -360]]", "axis 6"),
        ("d = 92.2", 'd = 92.2\ntype = "helical"', "helical"),
        ("[[link]]", "[link]", "TOML|link"),
        ('name = "UR10"', "name = ", "TOML"),
    ],
)
def test_bad_files_say_where(tmp_path, old, new, match):
    with pytest.raises(BadInputError, match=match):
        read_robot_file(written(tmp_path, FILE.replace(old, new)))


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [("c2 = 1150", "", "lacks c2"), ("c2 = 1150", "c2 = -1150", "c2"), ("-1, 1]", "-1, 2]", "signs"),
     ("signs = [-1, 1, 1, -1, 1, -1]", "signs = [-1]", "signs"), ("[0, -90,", '["0", -90,', "offsets_deg")],
)  # fmt: skip
def test_bad_opw_files_say_where(tmp_path, old, new, match):
    text = OPW.replace(old, new).replace("1, -1]\n", "1, -2]\n") if "2]" in new else OPW.replace(old, new)
    with pytest.raises(BadInputError, match=match):
        read_robot_file(written(tmp_path, text))


def test_missing_files_and_names():
    with pytest.raises(BadInputError, match="CANNOT_READ"):
        robot_of("no/such/robot.toml")
    with pytest.raises(BadInputError, match="kr210_r2700_2"):
        robot_of("kr210r2700")


def test_a_robot_without_links_or_lengths_is_none():
    with pytest.raises(ValueError, match="no links"):
        DhRobot(links=())
    with pytest.raises(ValueError, match="lengths are 0"):
        DhRobot(links=(Link(), Link()))
