"""Motions relative to a point: after a correction they end where the correction takes their old end.

A turn about the robot's foot moves axis 1 alone, so every end must be reached with the old joints and another A1. Along the
axes of the tool (LIN_REL #TOOL, a point with a shift behind a colon, RelTool) the numbers stay, along those of the base
(LIN_REL #BASE, Offs) they turn.
"""

import math
import re

import numpy as np
import pytest
from by_hand import ABB, KUKA, along, product, turn

from tests.correction import small
from tests.correction.test_preflight import GOOD as KUKA_GOOD
from tests.correction.test_preflight import machine, point, program
from tests.correction.test_preflight_rapid import CONF, rapid, robtarget
from tests.correction.test_preflight_rapid import GOOD as ABB_GOOD

DEGREES = 3.0
HAND = along(z=300)  # the tool, on the flange's axis
TURNED = product(turn("z", -12.0))


@pytest.fixture
def convert(tmp_path, monkeypatch):
    def run(files):
        monkeypatch.setattr(small, "TURN", np.array(turn("z", DEGREES))[:3, :3])
        done = small.convert(tmp_path, files, translation=(0, 0, 0))
        assert done.code == 0, done.err
        return done

    return run


def numbers(text: str) -> list[float]:
    return [float(number) for number in re.findall(r"-?\d+\.?\d*(?:E[+-]?\d+)?", text)]


def assert_only_axis_one_moved(arm, end, joints, axis_one):
    """The end of a motion, its tool taken off, is reached with the same joints but another first one."""
    old = product(arm.forward(joints), HAND)
    there = product(turn("z", DEGREES), old)
    assert np.abs(np.array(end)[:3, 3] - np.array(there)[:3, 3]).max() < 2e-3
    back = product(end, along(z=-300))
    found = [q for q, _, _ in arm.inverse(back)]
    wanted = [joints[0] + axis_one, *joints[1:]]
    assert min(max(abs((a - b + 180) % 360 - 180) for a, b in zip(q, wanted, strict=True)) for q in found) < 1e-3


def joints_of(arm, end, near):
    """Joints of the end of a motion in the branch that it starts from."""
    found = [q for q, _, _ in arm.inverse(product(end, along(z=-300)))]
    return min(found, key=lambda q: max(abs(a - b) for a, b in zip(q, near, strict=True)))


@pytest.mark.parametrize(
    ("motion", "pattern", "in_tool"),
    [
        ("LIN_REL {X 15.0,Y -20.0,Z -80.0,A -12.0,B 0.0,C 0.0} #TOOL", r"LIN_REL \{(.*?)\}", True),
        ("LIN XP1:{X 15.0,Y -20.0,Z -80.0,A -12.0,B 0.0,C 0.0}", r"LIN XP1:\{(.*?)\}", True),
        ("LIN_REL {X 15.0,Y -20.0,Z 80.0} #BASE", r"LIN_REL \{(.*?)\}", False),
    ],
)
def test_kuka(convert, motion, pattern, in_tool):
    first = product(KUKA.forward(KUKA_GOOD), HAND)
    body = small.lin("P1") + motion + "\n"
    files = {**program(body, point("P1", KUKA_GOOD, 2, 2 + 32)), **machine()}
    done = convert(files)
    x, y, z, *_ = numbers(re.search(pattern, done.text("weld.src"))[1])
    if in_tool:
        assert [x, y, z] == [15, -20, -80]
        before = product(first, along(15, -20, -80), TURNED)
    else:
        before = product(along(15, -20, 80), first)
    literal = re.search(r"XP1=\{(.*?),S", done.text("weld.dat"))[1]
    px, py, pz, a, b, c = numbers(literal)
    printed = product(along(px, py, pz), turn("z", a), turn("y", b), turn("x", c))
    after = product(printed, along(x, y, z), TURNED) if in_tool else product(along(x, y, z), printed)
    assert_only_axis_one_moved(KUKA, after, joints_of(KUKA, before, KUKA_GOOD), -DEGREES)


@pytest.mark.parametrize(
    ("goal", "in_tool"), [("RelTool(P1,15,-20,-80\\Rz:=-12)", True), ("Offs(P1,15,-20,80)", False)]
)
def test_abb(convert, goal, in_tool):
    first = product(ABB.forward(ABB_GOOD), HAND)
    files = rapid(
        f"    MoveL {goal},v800,z10,tGun\\WObj:=wFloor;\n", f"  CONST robtarget P1:={robtarget(ABB_GOOD, CONF)};\n"
    )
    done = convert(files)
    text = re.search(r"MoveL \w+\(P1,(.*?)\),", done.text("Weld.mod"))[1]
    x, y, z = numbers(text.partition("\\")[0])
    before = product(first, along(15, -20, -80), TURNED) if in_tool else product(along(15, -20, 80), first)
    place, q = re.search(r"P1:=\[\[(.*?)\],\[(.*?)\]", done.text("Weld.mod")).groups()
    w, *axis = numbers(q)
    sine = math.hypot(*axis)
    printed = product(along(*numbers(place)), about(axis, 2 * math.atan2(sine, w)))
    if in_tool:
        assert goal.removeprefix("RelTool(P1,").removesuffix(")") == text
    after = product(printed, along(x, y, z), TURNED) if in_tool else product(along(x, y, z), printed)
    assert_only_axis_one_moved(ABB, after, joints_of(ABB, before, ABB_GOOD), DEGREES)


def about(axis, angle):
    """Rotation about an axis of any length [rad], by Rodrigues."""
    x, y, z = (value / math.hypot(*axis) for value in axis)
    c, s, v = math.cos(angle), math.sin(angle), 1 - math.cos(angle)
    return [
        [c + x * x * v, x * y * v - z * s, x * z * v + y * s, 0],
        [y * x * v + z * s, c + y * y * v, y * z * v - x * s, 0],
        [z * x * v - y * s, z * y * v + x * s, c + z * z * v, 0],
        [0, 0, 0, 1],
    ]
