"""Confdata, limits, reach and joint travel of converted RAPID programs; rails and external TCPs in the chain.

As in `test_preflight`, a turn about the robot's foot moves axis 1 alone.
"""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform

from respot.kinematics.cell import RobotCell
from respot.kinematics.motion_chain import chains_of
from respot.kinematics.robots import find_robot
from respot.kinematics.track import Track
from respot.program.frames import Frame
from respot.program.moves import Motion, Move
from respot.program.targets import Target, TargetKind
from tests.correction import small
from tests.correction.test_preflight import GOOD as KUKA_GOOD
from tests.correction.test_preflight import convert, frame, machine, program, said  # noqa: F401
from tests.kinematics.by_hand import ABB, KUKA, along, product, turn

GOOD = (35, 15, 10, -50, 55, 120)
CONF = (0, -1, 1, 0)
BOUNDS = [(-170, 170), (-65, 85), (-180, 70), (-300, 300), (-130, 130), (-360, 360)]
NONE = ("9E9",) * 6


def moc() -> str:
    joints = " ".join(f'-use_joint_{n} "rob1_{n + 1}"' for n in range(6))
    text = f'MOC:CFG_1.0:6:0::\n\n#\nROBOT:\n\n      -name "ROB_1" -use_robot_type "ROB1_6700_2.60_200" {joints}\n#\n'
    text += (
        "JOINT:\n\n" + "\n".join(f'      -name "rob1_{n}" -use_arm "rob1_{n}"\n' for n in range(1, 7)) + "#\nARM:\n\n"
    )
    for n, (low, high) in enumerate(BOUNDS, start=1):
        text += (
            f'      -name "rob1_{n}" -lower_joint_bound {math.radians(low)} -upper_joint_bound {math.radians(high)}\n\n'
        )
    return text


def quaternion(m) -> tuple[float, ...]:
    """By the largest of its four squares."""
    t = [1 + m[0][0] + m[1][1] + m[2][2], 1 + m[0][0] - m[1][1] - m[2][2]]
    t += [1 - m[0][0] + m[1][1] - m[2][2], 1 - m[0][0] - m[1][1] + m[2][2]]
    a, b, c = m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]
    d, e, f = m[0][1] + m[1][0], m[0][2] + m[2][0], m[1][2] + m[2][1]
    rows = [(t[0], a, b, c), (a, t[1], d, e), (b, d, t[2], f), (c, e, f, t[3])]
    row = rows[t.index(max(t))]
    return tuple(value / math.hypot(*row) for value in row)


def robtarget(joints, conf, external=NONE) -> str:
    pose = product(ABB.forward(joints), along(z=300))
    place = ",".join(f"{pose[i][3]:.6f}" for i in range(3))
    turned = ",".join(f"{value:.9f}" for value in quaternion(pose))
    return f"[[{place}],[{turned}],[{','.join(map(str, conf))}],[{','.join(external)}]]"


def rapid(body: str, data: str) -> dict[str, str]:
    frames = small.DATA.replace(
        "  PERS gundata",
        '  PERS wobjdata wFloor:=[FALSE,TRUE,"",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];\n  PERS gundata',
    )
    text = "MODULE Weld\n"
    for n, a1 in enumerate((35, 40, 45, 50), start=1):
        text += f"  CONST robtarget S{n}:={robtarget((a1, *GOOD[1:]), CONF)};\n"
    text += data + "  PROC rWeld()\n"
    text += "".join(f"    SpotL {name},v800,gun1,sd1,tGun\\WObj:=wFloor;\n" for name in small.SPOTS) + body
    text += "  ENDPROC\nENDMODULE\n"
    return {"RAPID/TASK1/PROGMOD/Weld.mod": text, "RAPID/TASK1/SYSMOD/Frames.sys": frames, "SYSPAR/MOC.cfg": moc()}


def one(joints, conf) -> dict[str, str]:
    return rapid("    MoveJ P1,v800,z10,tGun\\WObj:=wFloor;\n", f"  CONST robtarget P1:={robtarget(joints, conf)};\n")


def conf_of(done, name: str) -> list[int]:
    literal = re.search(rf"{name}:=\[\[.*?\],\[.*?\],\[(.*?)\]", done.text("Weld.mod"))[1]
    return [int(number) for number in literal.split(",")]


@pytest.mark.parametrize(
    ("start", "turned", "before", "after"),
    [(1, 2.0, 0, -1), (89, -2.0, 0, 1), (-91, -2.0, -2, -1), (91, -2.0, 1, 1)],
)
def test_a_quadrant_follows_axis_one(convert, start, turned, before, after):  # noqa: F811
    """`turned` goes clockwise, as KUKA's axis 1; ABB's counts the other way."""
    done = convert(one((start, *GOOD[1:]), (before, *CONF[1:])), a1=turned)
    assert done.code == 0, done.err
    assert conf_of(done, "P1") == [after, *CONF[1:]]


def test_a_target_that_leaves_its_bounds_refuses_the_module(convert):  # noqa: F811
    done = convert(one((169, *GOOD[1:]), (1, *CONF[1:])), a1=-2.0)
    assert done.refusals() == {("Weld", "P1", "OUT_OF_LIMITS")}
    assert "axis 1 would stand at 171.000" in said(done, "OUT_OF_LIMITS")[0]
    assert done.edited() == set()


@pytest.mark.parametrize(("push", "code"), [(10.0, 0), (60.0, 1)])
def test_an_offset_pose_must_be_in_reach(convert, push, code):  # noqa: F811
    """Outwards from S1 to 30 mm before the end of the reach, then further by ``push``."""
    heading = np.array([math.cos(math.radians(35)), math.sin(math.radians(35)), 0.0])
    flange = ABB.forward((35, *GOOD[1:]))
    reach = max(way for way in range(2000) if ABB.inverse(product(along(*(way * heading)), flange)))
    words = ",".join(f"{value:.3f}" for value in (reach - 30.0) * heading)
    done = convert(rapid(f"    MoveL Offs(S1,{words}),v800,z10,tGun\\WObj:=wFloor;\n", ""), shift=push * heading)
    assert done.code == code, done.err
    assert done.refusals() == ({("Weld", "S1", "OUT_OF_REACH")} if code else set())


def test_joint_positions_are_part_of_the_path(convert):  # noqa: F811
    """Axis 5 goes from 0.2 to below 0: its sign changes on the way there and on the way to the joint position."""
    data = f"  CONST robtarget P1:={robtarget((35, 15, 10, 0, 0.2, 0), (0, 0, 0, 0))};\n"
    data += "  CONST jointtarget jPark:=[[35,15,10,10,40,10],[9E9,9E9,9E9,9E9,9E9,9E9]];\n"
    body = "    MoveJ P1,v800,z10,tGun\\WObj:=wFloor;\n    MoveAbsJ jPark,v800,z10,tGun\\WObj:=wFloor;\n"
    done = convert(rapid(body, data), shift=(0, 0, -20))
    assert done.code == 0, done.err
    (message,) = said(done, "BRANCH_CHANGE")
    assert "2 motions" in message and conf_of(done, "P1")[3] == 1


# --------------------------------------------------------------------------------------------------------------- chain


def test_a_rail_is_in_the_chain_of_a_conversion(convert):  # noqa: F811
    """The rail runs along y; each point stands at its own place on it. Ten millimetres along minus x, seen from a
    robot that looks along y, flip the sign of an axis 1 that stood at 0.1."""
    rail = "$AXIS_TYPE[7]=1\nDECL EX_KIN $EX_KIN={ET1 #ERSYS,ET2 #NONE}\nDECL ET_AX $ET1_AX={TR_A1 #E1,TR_A2 #NONE,TR_A3 #NONE}\n"
    parts = {
        "$ERSYSROOT": "X 1000.0,Y 200.0,Z 50.0,A 90.0,B 0.0,C 0.0",
        "$ET1_TA1KR": "X 0.0,Y 0.0,Z 0.0,A 0.0,B 90.0,C 0.0",
    }
    parts |= dict.fromkeys(("$ET1_TA2A1", "$ET1_TA3A2"), "X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0")
    parts["$ET1_TFLA3"] = "X -300.0,Y 0.0,Z 0.0,A 0.0,B -90.0,C 0.0"
    rail += "".join(f"FRAME {name}={{{text}}}\n" for name, text in parts.items())

    def literal(joints, e1, s, t):
        pose = product(along(1000, 200 + e1, 350), turn("z", 90), KUKA.forward(joints), along(z=300))
        return f"{{{frame(pose)},S {s},T {t},E1 {e1:.1f}}}"

    names = {"S1": 0.0, "S2": 250.0, "S3": 500.0, "S4": 750.0, "P1": 900.0}
    data = "".join(
        f"DECL E6POS X{name}={literal((0.1 if name == 'P1' else 10, *KUKA_GOOD[1:]), e1, 2, 34)}\n"
        + small.fdat(name, 2)
        for name, e1 in names.items()
    )
    files = {**program(small.lin("P1"), ""), **machine(rail)}
    files["KRC/R1/Program/weld.dat"] = f"DEFDAT  WELD\n{data}ENDDAT\n"
    done = convert(files, shift=(-10, 0, 0))
    assert done.code == 0, done.err
    found = dict(re.findall(r"X(\w\d)=\{.*?,T (\d+)", done.text("weld.dat")))
    assert found == {"S1": "34", "S2": "34", "S3": "34", "S4": "34", "P1": "35"}
    files["KRC/R1/Program/weld.dat"] = files["KRC/R1/Program/weld.dat"].replace(",E1 900.0", "")
    refused = convert(files, shift=(-10, 0, 0), name="without")
    assert refused.refusals() == {("weld", "XP1", "CONFIG_NOT_CHECKED")}


def rigid(matrix) -> RigidTransform:
    return RigidTransform.from_matrix(np.array(matrix, dtype=float))


GUN, PART, SEEN = product(along(1900, 300, 1200), turn("y", 70)), along(10, 20, 30), product(along(5), turn("z", 40))


@pytest.mark.parametrize("language", ["krl", "rapid"])
def test_the_chain_of_an_external_tcp(language):
    """flange * part * target = gun. KUKA: $BASE is the gun, $TOOL the part; ABB: the tool is the gun."""
    gun, part = Frame("gun", pose=rigid(GUN)), Frame("part", pose=rigid(PART), held=language == "rapid")
    tool, base = (part, gun) if language == "krl" else (gun, part)
    move = Move(Motion.LINEAR, "LIN", None, "p", "p", "p", 1, tool=tool, base=base, external_tcp=True)
    cell = RobotCell(find_robot("kr210_r2700_prime"), language)
    targets, seen = [Target("t", TargetKind.POSE, "p", 1, 1, (0, 0))], rigid([SEEN])
    _, (chain,) = chains_of(cell, [move], targets, [seen])
    flange = cell.flange2base(chain.tool2world, chain.tool2flange)
    assert flange.as_matrix()[0] @ np.array(PART) @ np.array(SEEN) == pytest.approx(np.array(GUN))


def test_what_is_not_known_of_a_chain_is_said():
    cell = RobotCell(find_robot("kr210_r2700_prime"), on_track=True, track=Track(0))
    target, known = Target("t", TargetKind.POSE, "p", 1, 1, (0, 0)), Frame("f")

    def code(tool, base):
        move = Move(Motion.LINEAR, "LIN", None, "p", "p", "p", 1, tool=tool, base=base)
        (found,), chains = chains_of(cell, [move], [target], [rigid([SEEN])])
        assert chains == []
        return found.code

    assert code(None, known) == "UNKNOWN_TOOL"
    assert code(known, Frame("b", pose=None, unknown="why")) == "UNKNOWN_FRAME"
    assert code(known, known) == "CONFIG_NOT_CHECKED"


@pytest.mark.parametrize("far", [False, True])
def test_a_shift_along_the_tool_must_be_in_reach(convert, far):  # noqa: F811
    """RelTool from S1 along the gun's z to some way, or to 30 mm before the end of the reach and then 60 mm further."""
    flange = ABB.forward((35, *GOOD[1:]))
    reach = max(way for way in range(3000) if ABB.inverse(product(flange, along(z=way))))
    heading = np.array([flange[row][2] for row in range(3)])
    files = rapid(f"    MoveL RelTool(S1,0,0,{reach - 30.0 if far else 120.0}),v800,z10,tGun\\WObj:=wFloor;\n", "")
    done = convert(files, shift=60.0 * heading)
    assert done.code == int(far), done.err
    assert done.refusals() == ({("Weld", "S1", "OUT_OF_REACH")} if far else set())


def test_a_shift_along_the_tool_that_is_computed_is_said_to_be_unchecked(convert):  # noqa: F811
    data = "  VAR num nWay:=5;\n"
    body = "    nWay:=nWay+1;\n    MoveL RelTool(S1,0,0,nWay),v800,z10,tGun\\WObj:=wFloor;\n"
    done = convert(rapid(body, data), a1=1.0)
    assert any("shift along the tool" in text for text in said(done, "NOT_CHECKED"))
