"""Rails, external TCPs and tilted mounting, worked by hand."""

import math

import numpy as np
import pytest
from by_hand import KUKA, along, product, turn
from scipy.spatial.transform import RigidTransform

from respot.geometry import IDENTITY, abc_from_rotation
from respot.kinematics.cell import Reason, RobotCell
from respot.kinematics.configuration import reconfigure, taught_joints
from respot.kinematics.from_backup import cell_of
from respot.kinematics.gravity import gravity_basis, gravity_in_base
from respot.kinematics.robots import find_robot
from respot.kinematics.track import Track
from respot.program.robot import Machine

ZERO = dict.fromkeys("XYZABC", 0.0)
PRIME = find_robot("kr210_r2700_prime")
# The rail starts at 1000, 200, 50 and runs along the world's y. Its axis is the z of a frame tilted by B 90; the robot
# stands 300 above it (minus x of that frame), upright again by B -90.
RAIL = {
    "$TIRORO": {**ZERO, "Z": 675.0},
    "$TFLWP": {**ZERO, "Z": 240.0},
    "$TX3P3": {**ZERO, "X": 1200.0, "Z": -41.0, "B": 90.0},
    "$LENGTH_A": 350.0,
    "$LENGTH_B": 1150.0,
    "$ROBROOT": ZERO,
    "$AXIS_TYPE[7]": 1.0,
    "$EX_KIN": {"ET1": "#ERSYS", "ET2": "#NONE"},
    "$ERSYSROOT": {**ZERO, "X": 1000.0, "Y": 200.0, "Z": 50.0, "A": 90.0},
    "$ET1_AX": {"TR_A1": "#E1", "TR_A2": "#NONE", "TR_A3": "#NONE"},
    "$ET1_TA1KR": {**ZERO, "B": 90.0},
    "$ET1_TA2A1": ZERO,
    "$ET1_TA3A2": ZERO,
    "$ET1_TFLA3": {**ZERO, "X": -300.0, "B": -90.0},
}


def krl(**changes):
    return cell_of(Machine("test", {**RAIL, **changes}), "krl")


def rigid(matrix):
    return RigidTransform.from_matrix(np.array(matrix, dtype=float))


def test_a_rail_by_hand():
    cell = krl()
    assert cell.on_track and cell.track.name == "E1"
    place = cell.at([800.0, 0, 0, 0, 0, 0]).robroot
    assert place.translation == pytest.approx([1000, 200 + 800, 50 + 300])
    assert abc_from_rotation(place.rotation) == pytest.approx([90, 0, 0], abs=1e-9)
    assert cell.robroot.translation == pytest.approx([1000, 200, 350])


def test_each_point_stands_where_its_rail_does():
    rows = [((10, -75, 100, 35, 40, -60), 800.0), ((-5, -80, 95, 20, -30, 15), -450.0)]
    world = [product(along(1000, 200 + e1, 350), turn("z", 90), KUKA.forward(q)) for q, e1 in rows]
    external = np.array([[e1, 0, 0, 0, 0, 0] for _, e1 in rows])
    joints, reasons = taught_joints(krl().at(external), IDENTITY, rigid(world), [[2, 2 + 32], [6, 1 + 2 + 16]])
    assert reasons == (None, None)
    assert joints == pytest.approx(np.array([q for q, _ in rows]), abs=1e-6)
    # without its rail the robot is not asked at all
    _, reasons = taught_joints(krl(), IDENTITY, rigid(world), [[2, 34], [6, 19]])
    assert {reason.code for reason in reasons} == {"CONFIG_NOT_CHECKED"}


def test_reconfigure_with_a_rail_moves_axis_one_by_hand():
    """A turn about the world's z through the foot at E1 = 800 moves axis 1 alone: 1 degree becomes -1."""
    joints = (1, -75, 100, 35, 40, -60)
    foot = along(1000, 1000, 350)
    old = product(foot, turn("z", 90), KUKA.forward(joints))
    back = along(-1000, -1000, -350)
    new = product(foot, turn("z", 2), back, old)
    cell = krl().at([[800.0, 0, 0, 0, 0, 0]])
    result = reconfigure(cell, IDENTITY, rigid([old]), rigid([new]), [[2, 2 + 32]])
    assert result.configuration.tolist() == [[2, 1 + 2 + 32]]
    assert result.joints[0] == pytest.approx([-1, *joints[1:]], abs=1e-6)
    far = product(along(9000, 0, 0), old)
    (reason,) = reconfigure(cell, IDENTITY, rigid([old]), rigid([far]), [[2, 2 + 32]]).reasons
    assert reason.code == "OUT_OF_REACH"


@pytest.mark.parametrize(
    "changes",
    [
        {"$ET1_AX": {"TR_A1": "#E1", "TR_A2": "#E2", "TR_A3": "#NONE"}},
        {"$ET1_TA1KR": None},
        {"$AXIS_TYPE[7]": None},
        {"$ROBROOT": {**ZERO, "X": 77.0}},
        {"$EX_KIN": {"ET1": "#ERSYS", "ET2": "#ERSYS"}},
    ],
)
def test_a_rail_that_cannot_be_told_is_not_guessed(changes):
    cell = krl(**changes)
    assert isinstance(cell, RobotCell) and cell.on_track and cell.track is None
    assert any("#ERSYS" in note for note in cell.notes)
    with pytest.raises(ValueError, match="do not tell"):
        cell.at(np.zeros(6))


def test_robroot_that_repeats_the_rail_at_zero_is_taken():
    cell = krl(**{"$ROBROOT": {**ZERO, "X": 1000.0, "Y": 200.0, "Z": 350.0, "A": 90.0}})
    assert cell.at([100.0, 0, 0, 0, 0, 0]).robroot.translation == pytest.approx([1000, 300, 350])


def test_a_turning_column():
    track = Track(1, rigid(along(500, 0, 0)), carriage=rigid(along(x=200)), turns=True)
    assert track.base2world([0, 90]).translation == pytest.approx([500, 200, 0])
    for external in ([90], [0, math.nan]):
        with pytest.raises(ValueError, match="external axis 2"):
            track.base2world(external)


HALF = "0.70710678"
MOC = {
    "ROBOT": [
        {
            "name": "ROB_1",
            "use_robot_type": "ROB1_6700_2.60_200",
            "base_frame_coordinated": "M7DM1",
            "base_frame_pos_z": "0.3",
            "base_frame_orient_u0": HALF,
            "base_frame_orient_u3": HALF,
        }
    ],
    "SINGLE": [
        {
            "name": "M7DM1",
            "use_single_type": "KIND",
            "use_joint": "JOINT8",
            "base_frame_pos_x": "1",
            "base_frame_orient_u0": HALF,
            "base_frame_orient_u3": HALF,
        }
    ],
    "SINGLE_TYPE": [{"name": "KIND", "mechanics": "TRACK"}],
    "JOINT": [{"name": "JOINT8", "logical_axis": "8"}],
}


def rapid(**changes):
    return cell_of(Machine("test", {**MOC, **changes}), "rapid")


def test_an_abb_track_by_hand():
    # the track's x is the world's y; logical axis 8 is eax_b; the robot is turned by another 90 degrees on it
    place = rapid().at([math.nan, 500.0, *[math.nan] * 4]).robroot
    assert place.translation == pytest.approx([1000, 500, 300])
    assert abs(abc_from_rotation(place.rotation)[0]) == pytest.approx(180)


@pytest.mark.parametrize(
    "changes",
    [
        {"SINGLE": []},
        {"SINGLE_TYPE": [{"name": "KIND", "mechanics": "FREE_ROT"}]},
        {"JOINT": [{"name": "JOINT8"}]},
    ],
)
def test_an_abb_track_that_cannot_be_told_is_not_guessed(changes):
    cell = rapid(**changes)
    assert not isinstance(cell, Reason)
    assert cell.on_track and cell.track is None and "M7DM1" in cell.notes[0] + cell.notes[1]


# -------------------------------------------------------------------------------------------------------- external TCP


def test_an_external_tcp_by_hand():
    """The gun stands in the world, the part hangs on the flange; the flange comes to gun * (part * target)^-1.

    A part that is turned by -2 degrees about the flange's z must be carried with axis 6 turned by -2 (its sign is
    minus, and the part's turn is undone): from 1 to -1, bit 5.
    """
    joints = (10, -75, 100, 35, 40, 1)
    flange = KUKA.forward(joints)
    rotation = [[flange[j][i] for j in range(3)] for i in range(3)]
    place = [-sum(rotation[i][j] * flange[j][3] for j in range(3)) for i in range(3)]
    back = [[*rotation[i], place[i]] for i in range(3)] + [[0, 0, 0, 1]]
    gun = product(along(1900, 300, 1200), turn("y", 70), turn("x", 25))
    target = product(back, gun)
    moved = product(turn("z", -2), target)
    cell = RobotCell(PRIME)
    found, reasons = taught_joints(cell, rigid(target), rigid(gun), [[2, 2]])
    assert reasons == (None,)
    assert found[0] == pytest.approx(joints, abs=1e-6)
    result = reconfigure(cell, rigid(target), rigid(gun), rigid(gun), [[2, 2]], rigid(moved))
    assert result.joints[0] == pytest.approx([*joints[:5], -1], abs=1e-6)
    assert result.configuration.tolist() == [[2, 2 + 32]]


# ------------------------------------------------------------------------------------------------------------- gravity


@pytest.mark.parametrize(
    ("changes", "down"),
    [
        ({}, (0, 0, -1)),
        ({"gravity_beta": "1.57079632679"}, (1, 0, 0)),  # on a wall: its x points down
        ({"gravity_beta": "3.14159265359"}, (0, 0, 1)),
        ({"gravity_alpha": "1.57079632679"}, (0, -1, 0)),
    ],
)
def test_gravity_as_the_controller_was_told(changes, down):
    row = {**MOC["ROBOT"][0], **changes}
    assert gravity_in_base(rapid(ROBOT=[row])) == pytest.approx(down, abs=1e-9)


def test_gravity_for_each_place():
    down = np.array([[0, 0, -1.0], [1.0, 0, 0]])
    both = gravity_basis(PRIME, np.zeros((2, 6)), down)
    for row in range(2):
        assert both[row] == pytest.approx(gravity_basis(PRIME, np.zeros(6), down[row])[0])
