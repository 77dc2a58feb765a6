"""Joints that code computes from a position: they would have to go where the position goes."""

from __future__ import annotations

import pytest

from tests.correction.small import convert, krl, krl_point, rapid, robtarget

JOINTS = "{A1 0.0,A2 -90.0,A3 90.0,A4 0.0,A5 0.0,A6 0.0}"
MORE = {"data.dat": f"DEFDAT  DATA PUBLIC\nDECL GLOBAL E6AXIS XJ={JOINTS}\nENDDAT\n"}
INVERSE = "XJ=INVERSE(XFAR,$POS_ACT,N)\n"
OTHER = {"other.src": "DEF other( )\nXJ=INVERSE(XFAR,$POS_ACT,N)\nEND\n"}


@pytest.mark.parametrize("place", ["here", "elsewhere", "own"])
def test_krl_joints_of_a_position_refuse_the_program(tmp_path, place):
    data = krl_point("FAR", 1.0, 2.0, 3.0) + "DECL INT N=0\n" + (f"DECL E6AXIS XJ={JOINTS}\n" if place == "own" else "")
    more = {} if place == "own" else {**MORE, **OTHER} if place == "elsewhere" else MORE
    done = convert(tmp_path, krl("PTP XJ\n" if place == "elsewhere" else INVERSE + "PTP XJ\n", data=data, more=more))
    assert done.code == 1
    assert {(program, code) for program, _, code in done.refusals()} == {("weld", "RUN_TIME_POSE")}
    assert not done.edited()


def test_krl_joints_that_are_read_or_set_otherwise_stay(tmp_path):
    code = "XJ=$AXIS_ACT\nXJ.A1=XJ.A1+5.0\nPTP XJ\n"
    done = convert(tmp_path, krl(code, data=f"DECL E6AXIS XJ={JOINTS}\n"))
    assert done.code == 0
    assert done.stays()["XJ"] == "JOINT_TARGET"


CALCULATED = "CalcJointT(pFar,tGun\\WObj:=wDoor)"


@pytest.mark.parametrize(
    "code", [f"    MoveAbsJ {CALCULATED},v100,z10,tGun;\n", f"    jt:={CALCULATED};\n    MoveAbsJ jt,v100,z10,tGun;\n"]
)
def test_rapid_joints_of_a_position_refuse_the_program(tmp_path, code):
    data = f"  CONST robtarget pFar:={robtarget(1, 2, 3)};\n  VAR jointtarget jt;\n"
    done = convert(tmp_path, rapid(code, data), "--keep-config")
    assert done.code == 1
    assert {code for _, _, code in done.refusals()} == {"RUN_TIME_POSE"}
    assert not done.edited()


def test_rapid_joints_that_are_read_stay(tmp_path):
    code = "    jt:=CJointT();\n    MoveAbsJ jt,v100,z10,tGun;\n"
    assert convert(tmp_path, rapid(code, "  VAR jointtarget jt;\n"), "--keep-config").code == 0
