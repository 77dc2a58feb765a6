"""External TCP from joints to status and turn, or confdata: the gun stands in the world, the robot holds the part.

flange * part * target = gun. KUKA (#TCP): $BASE is the gun, $TOOL the part (krl.md 5). ABB: the gun is the tool's tframe,
the part is uframe * oframe (rapid.md 2.4). A part that is off by D has targets P' = D P. With D a turn about z of a part
frame that lies on the flange's axis, the robot carries the part as before if axis 6 alone turns the other way: by the turn
on a KUKA, whose axis 6 counts clockwise, by minus the turn on an ABB.
"""

import math
import re

import numpy as np
import pytest
from by_pinocchio import KUKA as KUKA_BY_PINOCCHIO
from scipy.spatial.transform import RigidTransform

from respot.geometry import pose, rotation_from_abc, rotation_from_quaternion
from respot.kinematics.cell import RobotCell
from respot.kinematics.configuration import reconfigure, taught_joints
from respot.kinematics.robots import find_robot
from tests.correction import small
from tests.correction.test_preflight import frame, machine
from tests.correction.test_preflight_rapid import moc, quaternion
from tests.kinematics.by_hand import ABB, KUKA, along, product, turn

PRIME, IRB6700 = RobotCell(find_robot("kr210_r2700_prime")), RobotCell(find_robot("irb6700_200_260"), "rapid")
PART = along(z=300)
GUN = product(along(1900, 300, 1200), turn("y", 70), turn("x", 25))


def undone(matrix):
    """The way back."""
    turned = [[matrix[j][i] for j in range(3)] for i in range(3)]
    return [
        [*row, -sum(a * matrix[j][3] for j, a in enumerate(row))] for row in turned
    ] + [[0, 0, 0, 1]]  # fmt: skip


def seen(flange, gun=GUN):
    """The gun seen from the part."""
    return product(undone(product(flange, PART)), gun)


# -------------------------------------------------------------------------------------------------------- by hand alone

# A KR 210 R2700 prime with every axis square: 1550 in front of it stands the wrist, A4 lays the hand to its right, A1
# swings all that to -y. The flange comes to (-240, -1550, 1784); its z looks along -x, its x up, its y along y.
SQUARE = (90, -90, 90, 90, 90, 90)
# The part 300 mm before the flange is at (-540, -1550, 1784). The gun stands 100 mm further out, 50 mm to the left of it,
# 120 mm above; its x looks along the part's y, its z along the part's z.
BASE = pose([-640, -1500, 1904], rotation_from_abc([90, 0, -90]))
TOOL = pose([0, 0, 300], rotation_from_abc([0, 0, 0]))
P = pose([120, 50, 100], rotation_from_abc([90, 0, 0]))
# Turned by -120 degrees: cos = -1/2, sin = -sqrt(3)/2
H = math.sqrt(3) / 2
MOVED = pose([-60 + 50 * H, -120 * H - 25, 100], rotation_from_abc([-30, 0, 0]))


def test_kuka_worked_by_hand():
    # S: in front, elbow above, A5 positive; T: A2 alone is negative
    taught, reasons = taught_joints(PRIME, TOOL * P, BASE, [[2, 2]])
    assert reasons == (None,)
    assert taught[0] == pytest.approx(SQUARE, abs=1e-6)
    # flange * TOOL * P = BASE, by the numbers above and by pinocchio's flange
    flange = RigidTransform.from_matrix(KUKA_BY_PINOCCHIO.forward(SQUARE))
    assert flange.translation == pytest.approx([-240, -1550, 1784])
    assert (flange * TOOL * P).as_matrix() == pytest.approx(BASE.as_matrix(), abs=1e-9)


def test_kuka_a_part_that_turns_takes_axis_six_along():
    result = reconfigure(PRIME, TOOL * P, BASE, BASE, [[2, 2]], TOOL * MOVED)
    assert result.reasons == (None,)
    assert result.joints[0] == pytest.approx([*SQUARE[:5], 90 - 120], abs=1e-6)
    assert result.configuration.tolist() == [[2, 2 + 32]]
    # the same numbers taken for a gun that the robot holds lead elsewhere
    wrong = reconfigure(PRIME, TOOL, BASE * P, BASE * MOVED, [[2, 2]])
    assert wrong.reasons != (None,) or wrong.configuration.tolist() != [[2, 2 + 32]]


@pytest.mark.parametrize(
    ("sixth", "turned", "before", "after"),
    [(120, 35, 1, 0), (85, -10, 0, 1), (-85, 10, -1, -2), (1, 2, 0, -1), (179, -3, 1, 2), (-179, 3, -2, -3)],
)
def test_abb_quadrant_six_goes_against_the_part(sixth, turned, before, after):
    joints = (35, 15, 10, -50, 55, sixth)
    target = seen(ABB.forward(joints))
    uframe, oframe = along(z=200), along(z=100)
    old, new = (
        RigidTransform.from_matrix(np.array(product(uframe, oframe, way, target)))
        for way in (turn("z", 0), turn("z", turned))
    )
    tframe = RigidTransform.from_matrix(np.array(GUN))
    result = reconfigure(IRB6700, old, tframe, tframe, [[0, -1, before, 0]], new)
    assert result.reasons == (None,)
    assert result.old_joints[0] == pytest.approx(joints, abs=1e-6)
    assert result.joints[0] == pytest.approx([*joints[:5], sixth - turned], abs=1e-6)
    assert result.configuration.tolist() == [[0, -1, after, 0]]


def test_a_gun_that_was_moved_in_the_world_by_hand():
    """The gun and the robot's foot turn together about the world's z: axis 1 alone answers for it."""
    joints = (1, -75, 100, 35, 40, -60)
    target = RigidTransform.from_matrix(np.array(product(PART, seen(KUKA.forward(joints)))))
    old, new = (RigidTransform.from_matrix(np.array(product(turn("z", angle), GUN))) for angle in (0, 2))
    result = reconfigure(PRIME, target, old, new, [[2, 2 + 32]])
    assert result.joints[0] == pytest.approx([-1, *joints[1:]], abs=1e-6)
    assert result.configuration.tolist() == [[2, 1 + 2 + 32]]


# ------------------------------------------------------------------------------------------------------------- programs

HELD = {"S1": 1, "S2": 3, "S3": -1, "S4": 179}


@pytest.fixture
def convert(tmp_path, monkeypatch):
    """Converts with a part that is off by a turn about its z."""

    def run(files, degrees):
        monkeypatch.setattr(small, "TURN", np.array(turn("z", degrees))[:3, :3])
        done = small.convert(tmp_path, files, translation=(0, 0, 0))
        assert done.code == 0, done.err
        return done

    return run


def krl_held_part():
    src = "DEF weld( )\n" + "".join(small.lin(name, weld=True) for name in HELD) + "END\n"
    data = ""
    for name, sixth in HELD.items():
        target = seen(KUKA.forward((10, -75, 100, 35, 40, sixth)))
        turns = 2 + 32 * (sixth < 0)
        data += f"DECL E6POS X{name}={{{frame(target)},S 2,T {turns}}}\n" + small.fdat(name, base=3, mode="#TCP")
    config = small.CONFIG.replace("E6AXIS", f"BASE_DATA[3]={{{frame(GUN)}}}\nE6AXIS")
    return {
        "KRC/R1/Program/weld.src": src,
        "KRC/R1/Program/weld.dat": f"DEFDAT  WELD\n{data}ENDDAT\n",
        "KRC/R1/System/$config.dat": config,
        **machine(),
    }


def test_kuka_programs_with_a_held_part(convert):
    done = convert(krl_held_part(), -2.0)
    numbers = r"-?\d+\.?\d*"
    for name, sixth in HELD.items():
        found = re.search(rf"X{name}=\{{[XYZABC \-\d.,]*,S (\d+),T (\d+)\}}", done.text("weld.dat"))
        assert [int(number) for number in found.groups()] == [2, 2 + 32 * (sixth - 2 < 0)], name
        x, y, z, a, b, c = (float(n) for n in re.findall(rf"[XYZABC] ({numbers})", found[0]))
        printed = pose([x, y, z], rotation_from_abc([a, b, c]))
        flange = RigidTransform.from_matrix(KUKA_BY_PINOCCHIO.forward((10, -75, 100, 35, 40, sixth - 2)))
        error = (flange * TOOL * printed).inv() * RigidTransform.from_matrix(np.array(GUN))
        assert np.linalg.norm(error.translation) < 2e-3 and error.rotation.magnitude() < 1e-5


def test_abb_programs_with_a_held_part(convert):
    def literal(matrix):
        return "[" + ",".join(f"{matrix[i][3]:.6f}" for i in range(3)) + "],[" + ",".join(
            f"{value:.9f}" for value in quaternion(matrix)) + "]"  # fmt: skip

    text, arm = "MODULE Weld\n", (35, 15, 10, -50, 55)
    for name, sixth in HELD.items():
        numbers = f"[0,-1,{math.floor(sixth / 90)},0]"
        target = literal(seen(ABB.forward((*arm, sixth))))
        text += f"  CONST robtarget {name}:=[[{target[1:]},{numbers},[9E9,9E9,9E9,9E9,9E9,9E9]];\n"
    text += "  PROC rWeld()\n"
    text += (
        "".join(f"    SpotL {name},v800,gun1,sd1,tFixed\\WObj:=wPart;\n" for name in HELD) + "  ENDPROC\nENDMODULE\n"
    )
    frames = small.DATA.replace("tFixed:=[FALSE,[[0,0,300],[1,0,0,0]]", f"tFixed:=[FALSE,[{literal(GUN)}]")
    frames = frames.replace('wPart:=[TRUE,TRUE,"",[[0,0,0]', 'wPart:=[TRUE,TRUE,"",[[0,0,300]')
    assert "[[0,0,300],[1,0,0,0]],[[0,0,0],[1,0,0,0]]]" in frames and literal(GUN) in frames
    files = {"RAPID/TASK1/PROGMOD/Weld.mod": text, "RAPID/TASK1/SYSMOD/Frames.sys": frames, "SYSPAR/MOC.cfg": moc()}
    done = convert(files, 2.0)
    for name, sixth in HELD.items():
        row = re.search(rf"{name}:=\[\[(.*?)\],\[(.*?)\],\[(.*?)\]", done.text("Weld.mod")).groups()
        place, q, conf = ([float(number) for number in part.split(",")] for part in row)
        assert conf == [0, -1, math.floor((sixth - 2) / 90), 0], name
        printed = pose(place, rotation_from_quaternion(q))
        flange = RigidTransform.from_matrix(np.array(ABB.forward((*arm, sixth - 2))))
        error = (flange * TOOL * printed).inv() * RigidTransform.from_matrix(np.array(GUN))
        assert np.linalg.norm(error.translation) < 2e-3 and error.rotation.magnitude() < 1e-5
