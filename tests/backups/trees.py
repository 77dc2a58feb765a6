"""Small backups, written by us, in the layouts that controllers make."""

from __future__ import annotations

import zipfile
from pathlib import Path

CONFIG = """DEFDAT  $CONFIG
DECL FRAME TOOL_DATA[16]
DECL FRAME BASE_DATA[32]
TOOL_DATA[1]={X 0.0,Y 0.0,Z 300.0,A 0.0,B 0.0,C 0.0}
BASE_DATA[1]={X 1000.0,Y 0.0,Z 500.0,A 90.0,B 0.0,C 0.0}
ENDDAT
"""
MACHINE = """DEFDAT $MACHINE PUBLIC
CHAR $V_R1MADA[32]
$V_R1MADA[]="V8.3.29/KUKA8.3"
CHAR $TRAFONAME[32]
$TRAFONAME[]="#KR210R2700 EXTRA C4 FLR"
ENDDAT
"""


def src(name: str, x: float = 100.0) -> str:
    return f"&ACCESS RVP\nDEF {name}( )\n  LIN {{X {x},Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}}\nEND\n"


def am_ini(name: str) -> str:
    return f"[Archive]\nName=d:\\{name}.zip\\\nConfig=All\n[Roboter]\nRobName={name}\nIRSerialNr=700123\n"


def krc(name: str, root: str = "") -> dict[str, str]:
    """Whole archive of a KUKA robot."""
    return {
        f"{root}am.ini": am_ini(name),
        f"{root}KRC/R1/Program/weld.src": src("weld"),
        f"{root}KRC/R1/System/$config.dat": CONFIG,
        f"{root}KRC/R1/Mada/$machine.dat": MACHINE,
        f"{root}KRC/STEU/$config.dat": "DEFDAT $CONFIG\nENDDAT\n",
    }


def target(x: float = 600.0) -> str:
    return f"[[{x},0,800],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"


def module(name: str, x: float = 600.0, more: str = "") -> str:
    return (
        f"MODULE {name}\n  CONST robtarget p1:={target(x)};\n{more}"
        "  PROC r1()\n    MoveL p1,v100,fine,tool0;\n  ENDPROC\nENDMODULE\n"
    )


def system_xml(name: str, *options: str) -> str:
    listed = "".join(f'    <Option descr="{option}">\n    </Option>\n' for option in options)
    return f"<SystemProperties>\n  <SystemName>{name}</SystemName>\n{listed}</SystemProperties>\n"


def backinfo(*tasks: str, version: str = "6.13.01.00") -> str:
    listed = "".join(f">>{task}\n\n" for task in tasks)
    head = (
        "#\n# Generated backup file, do not edit.\n#\n# Originally at: /hd0a/TEMP/backup\n# 2024-05-06  07:08:09\n#\n"
    )
    products = f">>PRODUCTS_ID:\nRobotWare Version: {version}\n\n  English\n  604-1 MultiMove Coordinated\n\n"
    return f"{head}>>SYSTEM_ID:\n4600-700123\n\n{products}{listed}\n>>EOF:\n"


MOC = """MOC:CFG_1.0:6:0::
#
MECHANICAL_UNIT:

      -name "TRACK_2" -use_single_0 "TRACK_2"
#
ROBOT:

      -name "ROB_1" -use_robot_serial_number "rob_1"\\
      -use_robot_type "ROB1_6700_2.60_200" -use_robot_calib "r1_calib"\\
      -use_joint_0 "rob1_1" -base_frame_pos_x 1.5 -base_frame_pos_y 0.25

      -name "ROB_2" -use_robot_serial_number "rob_2"\\
      -use_robot_type "ROB2_1200_0.7_7" -use_robot_calib "r2_uncalib"\\
      -use_joint_0 "rob2_1" -base_frame_pos_x -3.5
#
ROBOT_SERIAL_NUMBER:

      -name "rob_1" -robot_serial_number_high_part "67  "\\
      -robot_serial_number_low_part 111

      -name "rob_2" -robot_serial_number_high_part "12"\\
      -robot_serial_number_low_part 222
#
SINGLE:

      -name "TRACK_2" -use_single_type "T" -use_joint "track2"
#
ARM:

      -name "rob1_1" -upper_joint_bound 2.0 -lower_joint_bound -2.0

      -name "rob2_1" -upper_joint_bound 1.0 -lower_joint_bound -1.0
"""
SYS = """SYS:CFG_1.0:6:0::
#
CAB_TASKS:

      -Name "T_ROB2" -Type "NORMAL" -UseMechanicalUnitGroup "second" -MotionTask 

      -Name "T_COMM" -Type "NORMAL" -UseMechanicalUnitGroup "first"

      -Name "T_ROB1" -Type "NORMAL" -UseMechanicalUnitGroup "first" -MotionTask 
#
MECHANICAL_UNIT_GROUP:

      -Name "first" -Robot "ROB_1" -UseMotionPlanner "motion_planner_1"

      -Name "second" -Robot "ROB_2" -MechanicalUnit_1 "TRACK_2"\\
      -UseMotionPlanner "motion_planner_2"
"""  # noqa: W291 - as a controller writes it
MULTIMOVE = {
    "system.xml": system_xml("SYS1", "604-1 MultiMove Coordinated"),
    "BACKINFO/backinfo.txt": backinfo(
        "TASK1: (T_COMM,,)\nPROGMOD/Comm.mod @ ",
        "TASK2: (T_ROB1,Left,)\nSYSMOD/user.sys @ HIDDEN\nPROGMOD/Main.mod @ ",
        "TASK10: (T_ROB2,,)\nPROGMOD/Main.mod @ ",
    ),
    "SYSPAR/SYS.cfg": SYS,
    "SYSPAR/MOC.cfg": MOC,
    "RAPID/TASK1/PROGMOD/Comm.mod": "MODULE Comm\n  PERS num shared:=1;\n  PROC main()\n    shared:=2;\n  ENDPROC\nENDMODULE\n",
    "RAPID/TASK2/PROGMOD/Main.mod": module("Main", 601.0),
    "RAPID/TASK2/SYSMOD/user.sys": "MODULE user(SYSMODULE)\nENDMODULE\n",
    "RAPID/TASK10/PROGMOD/Main.mod": module("Main", 602.0),
}


def write(folder: Path, files: dict[str, str]) -> Path:
    """Write a tree into a folder, with the line ends of a controller."""
    for name, text in files.items():
        place = folder / name
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_bytes(text.replace("\n", "\r\n").encode("latin-1"))
    return folder


def packed(path: Path, files: dict[str, str]) -> Path:
    """Pack a tree into a zip, under its names as they are."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in files.items():
            archive.writestr(name, text.replace("\n", "\r\n").encode("latin-1"))
    return path
