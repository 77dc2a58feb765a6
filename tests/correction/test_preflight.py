"""Status and turn, limits, reach and joint travel of converted programs.

A turn about the world's z through the robot's foot moves axis 1 and nothing else: what must come out is known to the
digit. The taught poses come from `by_hand`, which shares nothing with respot.
"""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from tests.correction import small
from tests.kinematics.by_hand import KUKA, along, product, turn

LIMITS = [(-185, 185), (-140, -5), (-120, 155), (-350, 350), (-125, 125), (-350, 350)]
GOOD = (10, -75, 100, 35, 40, -60)
GOOD_S, GOOD_T = 2, 2 + 32
PROGRAM = "KRC/R1/Program/"


def machine(more: str = "", robroot: str = "X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0") -> dict[str, str]:
    frames = {"TIRORO": (0, 675, 0), "TFLWP": (0, 240, 0), "TX3P3": (1200, -41, 90)}
    text = "DEFDAT $MACHINE PUBLIC\n"
    for name, (x, z, b) in frames.items():
        text += f"FRAME ${name}={{X {x:.1f},Y 0.0,Z {z:.1f},A 0.0,B {b:.1f},C 0.0}}\n"
    text += f"REAL $LENGTH_A=350.0\nREAL $LENGTH_B=1150.0\nFRAME $ROBROOT={{{robroot}}}\n"
    for n, (low, high) in enumerate(LIMITS, start=1):
        text += f"$SOFTN_END[{n}]={low:.1f}\n$SOFTP_END[{n}]={high:.1f}\n"
    return {"KRC/R1/Mada/$machine.dat": text + more + "ENDDAT\n"}


def frame(matrix) -> str:
    """X .. C of a pose, R = Rz(A) Ry(B) Rx(C)."""
    (a0, _, _, x), (a1, _, _, y), (a2, b2, c2, z), _ = matrix
    a, b = math.degrees(math.atan2(a1, a0)), math.degrees(math.atan2(-a2, math.hypot(a0, a1)))
    return f"X {x:.6f},Y {y:.6f},Z {z:.6f},A {a:.7f},B {b:.7f},C {math.degrees(math.atan2(b2, c2)):.7f}"


def world(joints):
    """TCP of TOOL_DATA[1], 300 mm in front of the flange; BASE_DATA[2] is the world."""
    return product(KUKA.forward(joints), along(z=300))


def point(name: str, joints, s=None, t=None, more: str = "") -> str:
    kind, configuration = ("FRAME", "") if s is None else ("E6POS", f",S {s},T {t}")
    return f"DECL {kind} X{name}={{{frame(world(joints))}{configuration}{more}}}\n" + small.fdat(name, base=2)


def spots(more: str = "") -> str:
    return "".join(point(f"S{n}", (a1, *GOOD[1:]), GOOD_S, GOOD_T, more) for n, a1 in enumerate((10, 15, 20, 25), 1))


def program(body: str, data: str, more: str = "", **kept) -> dict[str, str]:
    src = "DEF weld( )\n" + "".join(small.lin(name, weld=True) for name in small.SPOTS) + body + "END\n"
    files = {f"{PROGRAM}weld.src": src, f"{PROGRAM}weld.dat": f"DEFDAT  WELD\n{spots(more)}{data}ENDDAT\n"}
    return {**files, "KRC/R1/System/$config.dat": small.CONFIG, **kept}


def ptp(name: str) -> str:
    return f"FDAT_ACT=F{name}\nBAS(#PTP_PARAMS,50)\nPTP X{name}\n"


@pytest.fixture
def convert(tmp_path, monkeypatch):
    """Converts with a turn of axis 1 by ``a1`` degrees and a shift."""

    def run(files, *options, a1=0.0, shift=(0, 0, 0), name="out"):
        c, s = math.cos(math.radians(a1)), math.sin(math.radians(a1))
        monkeypatch.setattr(small, "TURN", np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]))
        return small.convert(tmp_path, files, *options, translation=shift, name=name)

    return run


def configuration(done, name: str) -> tuple[int, int]:
    found = re.search(rf"X{name}=.*?,S (\d+),T (\d+)[,}}]", done.text("weld.dat"))
    return int(found[1]), int(found[2])


def said(done, code: str) -> list[str]:
    return [issue["message"] for issue in done.record["issues"] if issue["code"] == code]


def one(joints, s=GOOD_S, t=GOOD_T, move=ptp):
    return {**program(move("P1"), point("P1", joints, s, t)), **machine()}


# ------------------------------------------------------------------------------------------------------ status and turn


def test_a_turn_bit_that_must_flip_flips(convert):
    done = convert(one((1, *GOOD[1:])), a1=-2.0)
    assert done.code == 0, done.err
    assert configuration(done, "P1") == (GOOD_S, GOOD_T + 1)
    assert configuration(done, "S1") == (GOOD_S, GOOD_T)


def test_179_to_181_keeps_its_turn(convert):
    done = convert(one((179, *GOOD[1:])), a1=2.0)
    assert done.code == 0, done.err
    assert configuration(done, "P1") == (GOOD_S, GOOD_T)  # arctan2 says -179, which would set bit 0


def test_the_printed_pose_decides(convert):
    """Axis 1 comes to 0 but for a hair; the rounding of the third decimal puts some points on the other side."""
    hairs = {f"P{n}": 1e-6 * (n - 10) for n in range(21)}
    joints = {name: (2 + hair, -75 - n, *GOOD[2:]) for n, (name, hair) in enumerate(hairs.items())}
    data = "".join(point(name, q, GOOD_S, GOOD_T) for name, q in joints.items())
    data = re.sub(r"([XYZ] -?\d+\.\d{3})\d+", r"\1", re.sub(r"([ABC] -?\d+\.\d{4})\d+", r"\1", data))
    done = convert({**program("".join(map(ptp, hairs)), data), **machine()}, a1=-2.0)
    assert done.code == 0, done.err
    across = 0
    for name, hair in hairs.items():
        text = re.search(rf"X{name}=.*?Z [-\d.]+,A.*?C [-\d.]+", done.text("weld.dat"))[0]
        x, y, z, a, b, c = (float(number) for number in re.findall(r"[A-Z] (-?\d+\.\d+)", text))
        printed = product(along(x, y, z), turn("z", a), turn("y", b), turn("x", c), along(z=-300))
        first = KUKA.inverse(printed)[0][0][0]
        across += (first < 0) != (hair < 0)
        if abs(first) > 2e-6:
            assert configuration(done, name)[1] & 1 == (first < 0), (name, first)
    assert across > 3


def test_without_a_model_a_target_with_status_is_refused(convert):
    files = program(ptp("P1"), point("P1", GOOD, GOOD_S, GOOD_T))
    done = convert(files, a1=-2.0)
    assert done.code == 1
    assert {code for _, _, code in done.refusals()} == {"CONFIG_NOT_CHECKED"}
    assert not done.edited()
    kept = convert(files, "--keep-config", a1=-2.0, name="kept")
    assert kept.code == 0, kept.err
    assert configuration(kept, "P1") == (GOOD_S, GOOD_T)
    assert any("reach, limits and joint travel" in message for message in said(kept, "NOT_CHECKED"))


@pytest.mark.parametrize(("sideways", "code"), [(0.0, 0), (-20.0, 0), (80.0, 1)])
def test_a_point_used_with_two_tools_is_judged_with_both(convert, sideways, code):
    """With a second tool 80 mm to the side axis 1 stands about 2 degrees higher, and keeps the sign that it loses."""
    joints = (1, *GOOD[1:])
    flange = KUKA.forward(joints)
    x, y, z = (sideways * flange[1][i] + 300.0 * (i == 2) for i in range(3))
    data = small.fdat("P2", base=2).replace("TOOL_NO 1", "TOOL_NO 2")
    files = {**program(ptp("P1") + ptp("P2").replace("PTP XP2", "PTP XP1"), point("P1", joints, GOOD_S, GOOD_T) + data)}
    tool = f"TOOL_DATA[2]={{X {x:.6f},Y {y:.6f},Z {z:.6f},A 0.0,B 0.0,C 0.0}}\n"
    files["KRC/R1/System/$config.dat"] = small.CONFIG.replace("BASE_DATA[1]=", tool + "BASE_DATA[1]=")
    done = convert({**files, **machine()}, a1=-2.0)
    assert done.code == code, done.err
    if code:
        assert done.refusals() == {("weld", "XP1", "CONFIG_INCONSISTENT")}
        assert "several tools" in said(done, "CONFIG_INCONSISTENT")[0]


# ---------------------------------------------------------------------------------------------------- limits and reach


def test_a_target_that_leaves_its_limits_refuses_the_program(convert):
    done = convert(one((184, *GOOD[1:])), a1=2.0)
    assert done.code == 1
    assert done.refusals() == {("weld", "XP1", "OUT_OF_LIMITS")}
    assert done.edited() == set()
    (message,) = said(done, "OUT_OF_LIMITS")
    assert "axis 1" in message and "186.000" in message and "-185 .. 185" in message and "184.000" in message


@pytest.mark.parametrize(("start", "a1", "code"), [(182, 2.0, 0), (184, 2.0, 1)])
def test_limits_of_a_target_without_status(convert, start, a1, code):
    """LIN goes on from where the arm stands: 150 degrees, then 182 or 184."""
    between = {150: (150, *GOOD[1:]), 100: (100, *GOOD[1:]), 50: (50, *GOOD[1:])}
    data = "".join(point(f"P{n}", joints) for n, joints in enumerate(reversed(between.values()), 2))
    body = "".join(small.lin(f"P{n}") for n in (2, 3, 4)) + small.lin("P1")
    done = convert({**program(body, data + point("P1", (start, *GOOD[1:]))), **machine()}, a1=a1)
    assert done.code == code, done.err
    assert done.refusals() == ({("weld", "XP1", "OUT_OF_LIMITS")} if code else set())
    if code:
        assert "axis 1 would stand at 186.000" in said(done, "OUT_OF_LIMITS")[0]


def near_the_end(back: float):
    """Stretched arm, a little bent; ``back`` mm are left to the end of its reach, about."""
    return (10, -40, math.degrees(math.sqrt(2 * back * 2350 / (1150 * 1200))) - 1.957, 5, 40, 5)


@pytest.mark.parametrize(("push", "code"), [(5.0, 0), (60.0, 1)])
def test_a_target_without_status_must_be_in_reach(convert, push, code):
    heading = np.array([math.cos(math.radians(10)), -math.sin(math.radians(10)), 0.0])
    files = {**program(small.lin("P1"), point("P1", near_the_end(20.0))), **machine()}
    done = convert(files, shift=push * heading)
    assert done.code == code, done.err
    assert done.refusals() == ({("weld", "XP1", "OUT_OF_REACH")} if code else set())


def test_a_relative_motion_must_be_in_reach(convert):
    heading = np.array([math.cos(math.radians(10)), -math.sin(math.radians(10)), 0.0])
    x, y, _ = 60.0 * heading
    body = small.lin("P1") + f"LIN_REL {{X {x:.4f},Y {y:.4f},Z 0.0}} #BASE\n"
    files = {**program(body, point("P1", near_the_end(80.0), 2, 2)), **machine()}
    assert convert(files, shift=5.0 * heading).code == 0
    done = convert(files, shift=40.0 * heading, name="far")
    assert done.refusals() == {("weld", "XP1", "OUT_OF_REACH")}


def test_a_robot_that_does_not_reach_the_taught_point_is_another_robot(convert):
    files = {**program(small.lin("P1"), point("P1", near_the_end(20.0))), **machine()}
    files["KRC/R1/Mada/$machine.dat"] = files["KRC/R1/Mada/$machine.dat"].replace("1150.0", "900.0")
    done = convert(files, a1=1.0)
    assert ("weld", "XP1", "CONFIG_INCONSISTENT") in done.refusals()
    assert all("--keep-config" in message for message in said(done, "CONFIG_INCONSISTENT"))
    kept = convert(files, "--keep-config", a1=1.0, name="kept")
    assert kept.code == 0, kept.err
    assert "XP1" in kept.edited()


def test_what_was_not_checked_is_said(convert):
    data = point("P1", GOOD).replace("TOOL_NO 1", "TOOL_NO 7")
    done = convert({**program(small.lin("P1"), data), **machine()}, a1=1.0)
    assert done.code == 0, done.err
    (message,) = (text for text in said(done, "NOT_CHECKED") if "reach" in text)
    assert "the motion to XP1" in message and "TOOL_DATA[7]" in message


# -------------------------------------------------------------------------------------------------------- joint travel


def test_an_axis_that_unwinds_refuses_the_program(convert):
    """From home at 0 to 179.5 without a turn: moved by one degree, the near way is the other way round."""
    home = "E6AXIS XHOME={" + ",".join(f"A{n} {a:.1f}" for n, a in enumerate((0, *GOOD[1:]), 1)) + "}\n"
    files = {**program("PTP XHOME\n" + ptp("P1"), point("P1", (179.5, *GOOD[1:]))), **machine()}
    files["KRC/R1/System/$config.dat"] = re.sub(r"E6AXIS XHOME=.*\n", home, small.CONFIG)
    assert convert(files, a1=0.2).code == 0
    done = convert(files, a1=1.0, name="unwound")
    assert done.code == 1
    assert done.refusals() == {("weld", "XP1", "JOINT_TRAVEL")}
    assert done.edited() == set()
    (message,) = said(done, "JOINT_TRAVEL")
    assert "axis 1 turns -179.5 deg" in message and "179.5 before" in message


@pytest.mark.parametrize(("move", "code"), [(ptp, 0), (small.lin, 1)])
def test_a_free_motion_stays_inside_the_limits(convert, move, code):
    """From A6 = 340 to -5 or 355: PTP takes the one inside the limits, LIN goes on and would leave them."""
    home = "E6AXIS XHOME={" + ",".join(f"A{n} {a:.1f}" for n, a in enumerate((*GOOD[:5], 340), 1)) + "}\n"
    files = {**program("PTP XHOME\n" + move("P1"), point("P1", (*GOOD[:5], -5))), **machine()}
    files["KRC/R1/System/$config.dat"] = re.sub(r"E6AXIS XHOME=.*\n", home, small.CONFIG)
    done = convert(files, a1=1.0)
    assert done.code == code, done.err
    assert done.refusals() == ({("weld", "XP1", "OUT_OF_LIMITS")} if code else set())
    if code:
        assert "axis 6 would stand at 355.000" in said(done, "OUT_OF_LIMITS")[0]


# ------------------------------------------------------------------------------------------------------------ warnings

WARNINGS = ("NEAR_SINGULARITY", "NEAR_LIMIT", "BRANCH_CHANGE", "JOINT_TRAVEL")


def test_a_path_that_gets_no_worse_says_nothing(convert):
    """Wrist singularity, limits and a change of branch: all were there before."""
    near, flipped = (10, -75, 100, 35, 1.0, -60), (10, -75, 100, 35, -40, 349.5)
    data = point("P1", near, 2, 2 + 32) + point("P2", flipped, 6, 2 + 16)
    done = convert({**program(ptp("P1") + ptp("P2"), data), **machine()}, a1=2.0)
    assert done.code == 0, done.err
    assert not [code for code in WARNINGS if said(done, code)]


def test_near_a_limit(convert):
    done = convert(one((183.5, *GOOD[1:])), a1=1.0)
    assert done.code == 0, done.err
    (message,) = said(done, "NEAR_LIMIT")
    assert "1 motion to XP1" in message and "axis 1 stands at 184.500" in message


def test_a_branch_that_changes_and_the_singularity_between(convert):
    """Axis 5 stands at 0.2 degrees; 20 mm down bend it to the other side."""
    done = convert(one((10, -80, 90, 0, 0.2, 0), 2, 2), shift=(0, 0, -20))
    assert done.code == 0, done.err
    s, _ = configuration(done, "P1")
    (message,) = said(done, "BRANCH_CHANGE")
    assert s == 6 and "axis 5 changes its sign" in message


def test_nearer_to_a_singularity(convert):
    done = convert(one((10, -80, 90, 0, 2.3, 0), 2, 2), shift=(0, 0, -20))
    (message,) = said(done, "NEAR_SINGULARITY")
    assert "axis 5 stands" in message and "XP1" in message


@pytest.mark.parametrize("way", ["LIN_REL {{Z {0:.1f}}} #TOOL\n", "LIN XS1:{{X 0,Y 0,Z {0:.1f},A 0,B 0,C 0}}\n"])
@pytest.mark.parametrize("far", [False, True])
def test_a_shift_along_the_tool_must_be_in_reach(convert, way, far):
    """From S1 along the gun's z to some way, or to 30 mm before the end of the reach and then 60 mm further."""
    flange = KUKA.forward((10, *GOOD[1:]))
    reach = max(distance for distance in range(3000) if KUKA.inverse(product(flange, along(z=distance))))
    heading = np.array([flange[row][2] for row in range(3)])
    files = program(small.lin("S1") + way.format(reach - 30.0 if far else 120.0), "")
    done = convert({**files, **machine()}, shift=60.0 * heading)
    assert done.code == int(far), done.err
    assert done.refusals() == ({("weld", "XS1", "OUT_OF_REACH")} if far else set())


def test_status_and_turn_written_as_bits_stay_bits(convert):
    """Axis 1 goes from 1 to -1 degrees: bit 0 of T is set; the literal keeps its base and its width."""
    joints = (1, *GOOD[1:])
    done = convert({**program(ptp("P1"), point("P1", joints, "'B00000010'", "'B100010'")), **machine()}, a1=-2.0)
    assert done.code == 0, done.err
    literal = next(line for line in done.text("weld.dat").splitlines() if "XP1=" in line)
    assert "S 'B00000010',T 'B100011'" in literal
