"""Robots from machine data: what makes a model, what does not, and why."""

import math
import re
from pathlib import Path

import numpy as np
import pytest

from respot.backups import open_backup
from respot.geometry import abc_from_rotation
from respot.kinematics.abb_machine import robot_of_type
from respot.kinematics.cell import Reason, RobotCell
from respot.kinematics.configuration import configuration_of, taught_joints
from respot.kinematics.from_backup import cell_of, model_of
from respot.kinematics.robots import find_robot
from respot.program.robot import Machine

DOOR = Path(__file__).parents[2] / "samples" / "rear_door"
KUKA, ABB = (open_backup(DOOR / name).robot() for name in ("kuka", "abb"))


def changed(robot, **values):
    """Machine of a sample with some values replaced; None leaves one out."""
    data = {**robot.machine.values, **values}
    return Machine(robot.machine.model, {key: value for key, value in data.items() if value is not None})


def test_kuka_sample():
    cell = cell_of(KUKA.machine, "krl")
    assert isinstance(cell, RobotCell)
    assert (cell.model.name, cell.model.source) == ("KR210R2700 EXTRA C4 FLR", "$machine.dat")
    built_in = find_robot("kr210_r2700_extra")
    q = np.random.default_rng(7).uniform(-150, 150, (9, 6))
    assert cell.model.forward(q).as_matrix() == pytest.approx(built_in.forward(q).as_matrix())
    assert cell.limits.tolist() == [[-185, 185], [-140, -5], [-120, 155], [-350, 350], [-125, 125], [-350, 350]]
    assert cell.robroot.translation == pytest.approx([6581.25, 256.875, -34.5])
    assert abc_from_rotation(cell.robroot.rotation) == pytest.approx([179.75, 0, 0])
    assert (cell.external_axes, cell.on_track, cell.absolute_accuracy, cell.notes) == (1, False, False, ())


def test_abb_sample():
    cell = cell_of(ABB.machine, "rapid")
    assert isinstance(cell, RobotCell)
    assert cell.model.name == "irb6700_200_260"
    expected = [[-170, 170], [-65, 85], [-180, 70], [-300, 300], [-130, 130], [-360, 360]]
    assert cell.limits == pytest.approx(np.array(expected), abs=1e-3)
    assert cell.robroot.translation == pytest.approx([6454.25, 120, -98])
    assert abc_from_rotation(cell.robroot.rotation) == pytest.approx(
        [180 - 2 * math.degrees(0.00218166), 0, 0], abs=1e-3
    )
    assert (cell.external_axes, cell.on_track, cell.absolute_accuracy, cell.notes) == (1, False, False, ())


@pytest.mark.parametrize("robot", [KUKA, ABB])
def test_every_taught_point_of_the_rear_door_is_reproduced(robot):
    cell = cell_of(robot.machine, robot.language)
    fields = ("S", "T") if robot.language == "krl" else ("cf1", "cf4", "cf6", "cfx")
    checked = 0
    for move in robot.moves():
        if move.world is None or move.tool is None or move.offset is not None:
            continue
        old = [int(move.target.number(field)) for field in fields]
        joints, reasons = taught_joints(cell, move.tool.pose, move.world, old)
        assert reasons == (None,), move.target.name
        assert configuration_of(cell, joints)[0].tolist() == old, move.target.name
        assert (joints[0] >= cell.limits[:, 0]).all() and (joints[0] <= cell.limits[:, 1]).all()
        checked += 1
    assert checked > 25


@pytest.mark.parametrize(
    ("values", "match"),
    [
        ({"$LENGTH_A": None}, "missing"),
        ({"$LENGTH_B": 0.0}, "c2"),
        ({"$TX3P3": {"X": 1200.0, "Y": 0.0, "Z": -41.0, "A": 0.0, "B": 0.0, "C": 0.0}}, "B of \\$TX3P3 is 0"),
        ({"$TX3P3": {"X": 1200.0, "Y": 12.0, "Z": -41.0, "A": 0.0, "B": 90.0, "C": 0.0}}, "Y of \\$TX3P3"),
        ({"$TFLWP": {"X": 0.0, "Y": 0.0, "Z": 215.0, "A": 90.0, "B": 0.0, "C": 0.0}}, "A of \\$TFLWP"),
        ({"$TIRORO": None}, "\\$TIRORO"),
        ({"$A4PAR": 1.0}, "A4PAR"),
        ({"$WRIST_AXIS": "#DEG90"}, "WRIST_AXIS"),
        ({"$AXIS_DIR[1]": 1.0}, "AXIS_DIR"),
        ({"$DH_4": {"DHART_A": 10.0, "DHART_D": 0.0, "DHART_ALPHA": 90.0}}, "DHART_A of \\$DH_4"),
        ({"$SOFTN_END[2]": 10.0}, "axis 2"),
        ({"$ROBROOT": {"X": 1.0}}, "ROBROOT"),
        ({"$LENGTH_A": None, "$LENGTH_B": None, "$TX3P3": None}, "no machine data"),
    ],
)
def test_kuka_machines_that_make_no_model(values, match):
    found = cell_of(changed(KUKA, **values), "krl")
    assert isinstance(found, Reason) and found.code == "CONFIG_NOT_CHECKED"
    assert re.search(match, found.message)
    assert model_of(changed(KUKA, **values), "krl") is None


def test_kuka_notes():
    limits = {f"$SOFT{end}_END[{n}]": None for end in "NP" for n in range(1, 7)}
    cell = cell_of(changed(KUKA, **limits), "krl")
    assert cell.limits is None and cell.notes == ("software limits unknown, not checked",)
    cell = cell_of(changed(KUKA, **{"$SOFTP_END[4]": None}), "krl")
    assert cell.limits[3].tolist() == [-350, np.inf] and cell.notes == ("software limit of axis 4 unknown",)
    cell = cell_of(changed(KUKA, **{"$AXIS_TYPE[6]": 5.0}), "krl")
    assert cell.limits[5].tolist() == [-np.inf, np.inf]
    cell = cell_of(changed(KUKA, **{"$ROBROOT": None}), "krl")
    assert cell.robroot.translation == pytest.approx([0, 0, 0]) and "ROBROOT" in cell.notes[0]
    cell = cell_of(changed(KUKA, **{"$EX_KIN": {"ET1": "#ERSYS", "ET2": "#NONE"}}), "krl")
    assert cell.on_track and "#ERSYS" in cell.notes[0]


def rows(**attributes):
    """The sample's ROBOT row with other attributes; None leaves one out."""
    row = {**ABB.machine.values["ROBOT"][0], **attributes}
    return {"ROBOT": [{key: value for key, value in row.items() if value is not None}]}


@pytest.mark.parametrize(
    ("values", "match"),
    [
        ({"ROBOT": []}, "no MOC.cfg"),
        ({"ROBOT": [{"name": "ROB_1"}, {"name": "ROB_2"}]}, "ROB_1, ROB_2"),
        (rows(use_robot_type="ROB1_6700_LeanID_2.65_220"), "LeanID"),
        (rows(use_robot_type="ROB1_6700_2.60_205"), "irb6700_200_260"),
        (rows(use_robot_type="ROB1_6660_1.90_205"), "not in the built-in list"),
        (rows(base_frame_orient_u3="0.5"), "base frame"),
        (rows(base_frame_pos_x="far"), "base_frame_pos_x"),
    ],
)
def test_abb_machines_that_make_no_model(values, match):
    found = cell_of(changed(ABB, **values), "rapid")
    assert isinstance(found, Reason) and match in found.message


def test_abb_notes():
    cell = cell_of(changed(ABB, **rows(use_robot_calib="r1_calib", base_frame_coordinated="M7DM1")), "rapid")
    assert cell.absolute_accuracy and cell.on_track and "M7DM1" in cell.notes[0]
    cell = cell_of(changed(ABB, ARM=[]), "rapid")
    assert cell.limits is None and cell.notes == ("joint bounds unknown, not checked",)
    cell = cell_of(changed(ABB, ARM=ABB.machine.values["ARM"][:3]), "rapid")
    assert cell.notes == ("joint bounds of axis 4, 5, 6 unknown",) and np.isinf(cell.limits[3]).all()


@pytest.mark.parametrize("explicit", [True, False])
def test_abb_base_frames_write_only_what_is_not_the_default(explicit):
    names = ("pos_x", "pos_y", "pos_z", "orient_u0", "orient_u3")
    bare = rows(**{f"base_frame_{name}": None for name in names})
    assert cell_of(changed(ABB, **bare), "rapid").robroot.as_matrix() == pytest.approx(np.eye(4))
    # EdgarIvanMM/Tamponadora hangs upside down: u0 0, u1 1
    bare["ROBOT"][0] |= {"base_frame_orient_u1": "1"} | ({"base_frame_orient_u0": "0"} if explicit else {})
    hanging = cell_of(changed(ABB, **bare), "rapid").robroot.rotation.as_matrix()
    assert hanging == pytest.approx(np.diag([1, -1, -1]), abs=1e-12)


@pytest.mark.parametrize(
    ("kind", "name"),
    [("ROB1_6700_2.60_200", "irb6700_200_260"), ("ROB1_1200_0.7_7", "irb1200_7_70"),
     ("ROB1_1600_1.2_6", "irb1600_6_12"), ("ROB1_1600_1.45_8", "irb1600_8_145"),
     ("ROB1_120_0.58_3", "irb120_3_58"), ("ROB2_6640_2.8_185", "irb6640_185_280"),
     ("ROB1_2400_1.55_12", "irb2400_12_155"), ("ROB1_6650S_3.5_125", "irb6650s_125_350")],
)  # fmt: skip
def test_robot_types(kind, name):
    assert robot_of_type(kind).name == name


def test_a_named_robot_replaces_the_lengths_only():
    robot = find_robot("irb6700_235_265")
    cell = cell_of(changed(ABB, **rows(use_robot_type="ROB1_6700_LeanID_2.65_220")), "rapid", robot)
    assert cell.model.name == "irb6700_235_265" and cell.limits.shape == (6, 2)
    assert cell.robroot.translation == pytest.approx([6454.25, 120, -98])
    assert "named by the user" in cell.notes[-1]
    cell = cell_of(Machine(), "krl", find_robot("kr210_r2700_2"))
    assert cell.limits is None and "limits unknown" in cell.notes[0] and "world's origin" in cell.notes[1]
    cell = cell_of(Machine(), "rapid", find_robot("irb6700_200_260"))
    assert "world's origin" in cell.notes[0] and "limits unknown" in cell.notes[1]
    assert isinstance(cell_of(Machine(), "fanuc"), Reason)
