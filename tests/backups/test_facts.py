"""What a backup says about its controller: plain values, each with the line it stands in."""

from __future__ import annotations

import pytest

from respot.backups import open_backup
from tests.backups.trees import MOC, MULTIMOVE, krc, write

AM_INI = """[archive]
NAME=d:\\st20r01.zip\\
Config=All
Date=2016-02-18_06-42-10
[ROBOTER]
RobName = ST20R01
IRSerialNr=604217
[Version]
Version=V8.3.29
[TechPacks]
TechPacks=GripperSpotTech|SafeOperation|NoVersion|
GripperSpotTech=4.0.4
SafeOperation=3.2.4
"""
CUSTOM = "DEFDAT $CUSTOM PUBLIC\nBOOL $DEACTIVATE_ABS_ACCUR=TRUE\nENDDAT\n"


def lines_of(files: dict[str, str], fact) -> str:
    return files[fact.path].splitlines()[fact.line - 1]


def test_kuka(tmp_path):
    files = {**krc("x"), "am.ini": AM_INI, "KRC/STEU/Mada/$custom.dat": CUSTOM}
    machine = open_backup(write(tmp_path / "all", files)).robot().machine
    said = {key: fact.value for key, fact in machine.facts.items()}
    assert said == {
        "controller": "ST20R01",
        "serial": "604217",
        "version": "V8.3.29",
        "archive": "d:\\st20r01.zip\\",
        "archive holds": "All",
        "saved": "2016-02-18_06-42-10",
        "tech packs": "GripperSpotTech 4.0.4; SafeOperation 3.2.4; NoVersion",
        "robot type": "#KR210R2700 EXTRA C4 FLR",
        "machine data": "V8.3.29/KUKA8.3",
        "absolute accuracy": "switched off ($DEACTIVATE_ABS_ACCUR)",
    }
    expected = {
        "serial": "IRSerialNr",
        "version": "Version=",
        "tech packs": "TechPacks=",
        "robot type": "$TRAFONAME[]=",
    }
    for key, start in {**expected, "absolute accuracy": "BOOL $DEACT"}.items():
        assert lines_of(files, machine.facts[key]).startswith(start)
    assert machine.lines["$TRAFONAME[]"] == machine.facts["robot type"].line


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "all"),
        ("[Roboter]\nRobName=\n", "all"),
        ("no section\n[Roboter\nRobName=A\n", "all"),
        ("[Roboter]\n;RobName=B\nRobName=A=B\n", "A=B"),
    ],
)
def test_a_strange_am_ini_stops_nothing(tmp_path, text, expected):
    files = {"am.ini": text, "KRC/R1/Program/a.src": "DEF a( )\nEND\n"}
    assert open_backup(write(tmp_path / "all", files)).robot().name == expected


def test_the_archive_of_the_robot_itself_names_it(tmp_path):
    """A full archive holds further am.ini of options below: the nearest one counts."""
    files = {**krc("MINE"), "C/KRC/TP/am.ini": "[Roboter]\nRobName=OTHER\n", "A/am.ini": "[Roboter]\nRobName=THIRD\n"}
    assert open_backup(write(tmp_path / "all", files)).robot().name == "MINE"


def test_abb(tmp_path):
    first, second = (robot.machine for robot in open_backup(write(tmp_path / "all", MULTIMOVE)).robots)
    said = {key: fact.value for key, fact in first.facts.items()}
    assert said == {
        "controller": "SYS1",
        "system id": "4600-700123",
        "version": "6.13.01.00",
        "saved": "2024-05-06  07:08:09",
        "options": "English; 604-1 MultiMove Coordinated",
        "serial": "67-111",
        "robot type": "ROB1_6700_2.60_200",
        "absolute accuracy": "active (r1_calib)",
        "task": "T_ROB1",
        "program": "Left",
        "hidden modules": "SYSMOD/user.sys",
    }
    starts = {
        "version": "RobotWare Version",
        "task": ">>TASK2:",
        "controller": "  <SystemName>",
        "options": "  English",
    }
    for key, start in starts.items():
        assert lines_of(MULTIMOVE, first.facts[key]).startswith(start)
    assert '"ROB_2"' in lines_of(MULTIMOVE, second.facts["robot type"])
    assert second.facts["task"].value == "T_ROB2" and "program" not in second.facts


def test_instances_of_moc_cfg_keep_their_line(tmp_path):
    """A line that goes on in the next counts as one instance and two lines; line ends are mixed in real files."""
    for text in (MOC, MOC.replace("\n", "\r\n", 9)):
        files = {**MULTIMOVE, "SYSPAR/MOC.cfg": text}
        folder = write(tmp_path / str(len(text)), files)
        (folder / "SYSPAR" / "MOC.cfg").write_bytes(text.encode())
        first = open_backup(folder).robots[0].machine
        (row,) = first.values["ROBOT"]
        lines = MOC.splitlines()
        assert lines[row.line - 1].strip().startswith('-name "ROB_1"') and row.path == "SYSPAR/MOC.cfg"
        assert [lines[arm.line - 1].split('"')[1] for arm in first.values["ARM"]] == ["rob1_1", "rob2_1"]
        assert row["base_frame_pos_y"] == "0.25" and row["use_joint_0"] == "rob1_1"


def test_copies_in_home_say_nothing_about_the_controller(tmp_path):
    files = {"RAPID/TASK1/PROGMOD/A.mod": "MODULE A\nENDMODULE\n", "HOME/MOC.cfg": MOC}
    assert open_backup(write(tmp_path / "all", files)).robot().machine.values == {}
