"""Traps of depth: what else may read, use or be made of a frame, so that it stays; each was walked into once."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from respot.calibration.calibration import Calibration
from respot.cli import app
from tests.correction.simulated import ABB, KUKA, cell
from tests.correction.small import (
    CONFIG,
    SHIFT,
    SPOTS,
    TURN,
    convert,
    fdat,
    krl,
    krl_point,
    lin,
    rapid,
    robtarget,
)
from tests.correction.test_depth import FRAMES, depths, flange_of, kept, krl_flange, krl_frame, krl_pose, rapid_flange
from tests.correction.test_external_tcp import krl_held_part

CONFIG_PATH = "KRC/R1/System/$config.dat"
WELD_PATH = "RAPID/TASK1/PROGMOD/Weld.mod"
WORK_OBJECT = (
    '[FALSE,TRUE,"",[[1000,0,500],[0.707106781186548,0,0,0.707106781186548]],[[0,0,0],[1,0,0,0]]]'  # that of wDoor
)
R1 = krl_point("R1", 1, 2, 3)
P10 = f"  CONST robtarget p10:={robtarget(1, 2, 3)};\n"


def program(code: str, data: str = "", name: str = "other") -> dict[str, str]:
    found = {f"{name}.src": f"DEF {name}( )\n{code}END\n"}
    return {**found, f"{name}.dat": f"DEFDAT {name.upper()}\n{data}ENDDAT\n"} if data else found


def module(code: str, data: str = "") -> dict[str, str]:
    return {"Other.mod": f"MODULE Other\n{data}  PROC rOther()\n{code}  ENDPROC\nENDMODULE\n"}


def with_config(files: dict[str, str], old: str, new: str) -> dict[str, str]:
    assert old in files[CONFIG_PATH]
    return {**files, CONFIG_PATH: files[CONFIG_PATH].replace(old, new)}


def assert_kept(tmp_path: Path, files: dict[str, str], words: str) -> None:
    done = convert(tmp_path, files, *FRAMES, "--keep-config")
    assert done.code == 0, done.err
    assert words in kept(done)
    assert set(depths(done).values()) == {"point"}


# ------------------------------------------------------------------------------------------------------ code that reads

NULL = "$BASE=$NULLFRAME\n$TOOL=TOOL_DATA[1]\n"
KRL_READINGS = {
    "a condition": (program("IF BASE_DATA[1].X>100 THEN\nHALT\nENDIF\n"), "code reads it"),
    "a loop's end": (program("DECL INT I\nFOR I=1 TO BASE_DATA[1].X\nENDFOR\n"), "code reads it"),
    "a wait": (program("WAIT FOR BASE_DATA[1].X>5\n"), "code reads it"),
    "a function's value": ({"calc.src": "DEFFCT REAL calc( )\nRETURN BASE_DATA[1].X\nENDFCT\n"}, "code reads it"),
    "a submit program": ({"sps.sub": "DEF sps( )\nDECL REAL R\nR=BASE_DATA[1].X\nEND\n"}, "code reads it"),
    "a motion to the base": (program(NULL + "LIN BASE_DATA[1]\n"), "code reads it"),
    "a motion seen from the base": (program(NULL + "LIN BASE_DATA[1]:XR1\n", R1), "code reads it"),
    "a shift by the base": (program(NULL + "LIN $POS_ACT:BASE_DATA[1]\n"), "code reads it"),
    "an index in an index": (program("DECL FRAME F\nDECL INT N[3]\nF=BASE_DATA[N[2]]\n"), "code reads it"),
    "an import": ({"o.dat": "DEFDAT O\nIMPORT FRAME XB[32] IS /R1/$CONFIG..BASE_DATA\nENDDAT\n"}, "code reads it"),
    "an argument": (
        {"o.src": "DEF o( )\nhand(BASE_DATA[1])\nEND\nDEF hand(F:IN)\nDECL FRAME F\nDECL REAL R\nR=F.X\nEND\n"},
        "code reads it",
    ),
    "a copy of the base in force": (
        program("DECL FRAME F\nBAS(#BASE,1)\nF=$BASE\n" + NULL + "LIN F\n"),
        "code reads $BASE",
    ),
    "its inverse": (program("DECL FRAME F\nBAS(#BASE,1)\nF=INV_POS($BASE)\n"), "code reads $BASE"),
    "a base made of the one in force": (
        program("BAS(#BASE,1)\n$BASE=$BASE:{X 5.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}\nBAS(#TOOL,1)\nLIN XR1\n", R1),
        "code reads $BASE",
    ),
    "a base made of one by a constant": (
        program("$BASE=BASE_DATA[NO[1]]:{X 5.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}\n", "DECL INT NO[2]\nNO[1]=1\n"),
        "$BASE is made of it",
    ),
    "a watch on where the robot is": (
        {"sps.sub": "DEF sps( )\nLOOP\n$OUT[1]=$POS_ACT.Z>500\nENDLOOP\nEND\n"},
        "code reads $POS_ACT",
    ),
    "forward kinematics": (program("DECL E6POS P\nDECL INT E\nP=FORWARD($AXIS_ACT,E)\n"), "code reads FORWARD"),
}


@pytest.mark.parametrize(("more", "words"), KRL_READINGS.values(), ids=KRL_READINGS.keys())
def test_krl_a_base_that_code_reads_in_whatever_way_stays(tmp_path, more, words):
    assert_kept(tmp_path, krl(more=more), words)


@pytest.mark.parametrize(
    "code",
    [
        "; BASE_DATA[1] is the door\n",
        "IF TRUE THEN\n$BASE=BASE_DATA[1]\nENDIF\n",
        "LIN $POS_ACT\n",
        "DECL REAL R\nR=TOOL_DATA[1].X\n",
    ],
    ids=["a comment", "to take it", "to stay where the robot is", "its tool is read"],
)
def test_krl_what_is_no_reading_of_a_base(tmp_path, code):
    body = code if code.startswith("LIN") else ""
    more = {} if body else program(code)
    assert depths(convert(tmp_path, krl(body=body, more=more), *FRAMES)) == {"BASE_DATA[1]": "base"}


def test_krl_a_base_with_two_values_stays(tmp_path):
    (line,) = [line for line in CONFIG.splitlines() if line.startswith("BASE_DATA[1]")]
    files = with_config(krl(), "BASE_DATA[2]=", f"{line}\nBASE_DATA[2]=")
    assert_kept(tmp_path, files, "another line gives it a value as well")


def test_krl_another_list_of_the_controller_is_no_second_value(tmp_path):
    done = convert(tmp_path, {**krl(), "KRC/STEU/Mada/$config.dat": CONFIG}, *FRAMES)
    assert [(edit["path"], edit["depth"]) for edit in done.record["edits"]] == [(CONFIG_PATH, "base")]


WOBJ = "  PERS wobjdata wA:=" + WORK_OBJECT.replace("1000", "0") + ";\n"
RAPID_READINGS = {
    "a compact IF": (module("    IF wDoor.oframe.trans.x>100 Stop;\n"), "code reads it"),
    "a condition": (module("    IF wDoor.oframe.trans.x>100 THEN\n    Stop;\n    ENDIF\n"), "code reads it"),
    "a test": (module("    TEST wDoor.oframe.trans.x\n    CASE 1:\n    Stop;\n    ENDTEST\n"), "code reads it"),
    "a function's value": (
        {"Other.mod": "MODULE Other\n  FUNC pose fP()\n    RETURN wDoor.oframe;\n  ENDFUNC\nENDMODULE\n"},
        "code reads it",
    ),
    "joints computed for a motion": (
        module("    MoveAbsJ CalcJointT(p10,tGun\\WObj:=wDoor),v100,fine,tGun;\n", P10),
        "code reads it",
    ),
    "an offset of another motion": (
        module("    MoveL Offs(p10,wDoor.oframe.trans.x,0,0),v100,fine,tGun\\WObj:=wDress;\n", P10),
        "code reads it",
    ),
    "a speed of its own motion": (
        module("    MoveL p10,[wDoor.oframe.trans.x,5,5,1],fine,tGun\\WObj:=wDress;\n", P10),
        "code reads it",
    ),
    "another's initial value": (
        module("", '  PERS wobjdata wA:=[FALSE,TRUE,"",wDoor.uframe,[[0,0,0],[1,0,0,0]]];\n'),
        "code reads it",
    ),
    "a name in a text": (module('    GetDataVal "wDoor",wA;\n', WOBJ), "GetDataVal may read it"),
    "a name that is computed": (
        module('    GetDataVal "w"+stX,wA;\n', WOBJ + "  VAR string stX;\n"),
        "GetDataVal may read it",
    ),
    "where the robot is, by what a routine may be given": (
        module("    rAt\\w:=wDoor;\n  ENDPROC\n  PROC rAt(\\PERS wobjdata w)\n    pA:=CRobT(\\Tool:=tool0\\WObj?w);\n",
               "  VAR robtarget pA;\n"),
        "a routine that gets it reads it",
    ),
    "where the robot is": (module("    pA:=CRobT(\\Tool:=tool0);\n", "  VAR robtarget pA;\n"), "code reads CRobT"),
    "the work object in force": (module("    wA:=CWObj();\n", WOBJ), "code reads CWObj"),
    "system data": (module("    GetSysData wA;\n", WOBJ), "code reads GetSysData"),
    "a file with two modules": (
        {"Two.mod": f"MODULE A\n{P10}  PROC a()\n    MoveL p10,v9,fine,tGun\\WObj:=wDoor;\n  ENDPROC\nENDMODULE\n"
         "MODULE B\nENDMODULE\n"},
        "a file that is no part of the programs names it",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("more", "words"), RAPID_READINGS.values(), ids=RAPID_READINGS.keys())
def test_rapid_a_work_object_that_code_reads_in_whatever_way_stays(tmp_path, more, words):
    assert_kept(tmp_path, rapid(more=more), words)


@pytest.mark.parametrize("moves", ["IF w.oframe.trans.x>5 Stop;\n    ", "rAsk w;\n    "], ids=["itself", "by another"])
def test_rapid_a_routine_that_moves_under_what_it_gets_may_read_it_too(tmp_path, moves):
    after = "  PROC rAsk(PERS wobjdata v)\n    IF v.oframe.trans.x>5 Stop;\n  ENDPROC\n"
    after += "  PROC rGo(robtarget p,PERS wobjdata w)\n    MOVES_MoveL p,v9,fine,tGun\\WObj:=w;\n  ENDPROC\n"
    files = rapid(after=after.replace("MOVES_", moves), body="    rGo S1,wDoor;\n")
    assert_kept(tmp_path / "a", files, "a routine that gets it reads it")
    files = rapid(after=after.replace("MOVES_", ""), body="    rGo S1,wDoor;\n")
    assert depths(convert(tmp_path / "b", files, *FRAMES, "--keep-config")) == {"wDoor": "base"}


def test_rapid_a_module_that_may_be_loaded_while_the_robot_runs_uses_its_work_object(tmp_path):
    part = f"MODULE Part\n{P10}  PROC rPart()\n    MoveL p10,v9,fine,tGun\\WObj:=wDoor;\n  ENDPROC\nENDMODULE\n"
    load = module('    Load \\Dynamic,"HOME:/Part.mod";\n')
    assert_kept(tmp_path / "a", {**rapid(more=load), "HOME/Part.mod": part}, "a file that is no part of the programs")
    done = convert(tmp_path / "b", {**rapid(), "HOME/Part.mod": part}, *FRAMES, "--keep-config")
    assert depths(done) == {"wDoor": "base"}  # nothing loads it


@pytest.mark.parametrize(
    ("pers", "other"),
    [("LOCAL PERS", "RAPID/TASK1/PROGMOD/Other.mod"), ("TASK PERS", "RAPID/TASK2/PROGMOD/Other.mod")],
)
def test_rapid_another_datum_of_the_same_name_is_another(tmp_path, pers, other):
    files = rapid()
    frames = "RAPID/TASK1/SYSMOD/Frames.sys"
    if "TASK2" in other:
        files[frames] = files[frames].replace("PERS wobjdata wDoor", "TASK PERS wobjdata wDoor")
    text = module("    x:=wDoor.oframe.trans.x;\n", f"  VAR num x;\n  {pers} wobjdata wDoor:={WORK_OBJECT};\n")
    done = convert(tmp_path, {**files, other: text["Other.mod"]}, *FRAMES, "--keep-config")
    assert [(edit["path"], edit["depth"]) for edit in done.record["edits"]] == [(frames, "base")]


ARRAY = f"  PERS wobjdata wArr{{2}}:=[{WORK_OBJECT},{WORK_OBJECT}];\n"


def under(files: dict[str, str], name: str) -> dict[str, str]:
    return {**files, WELD_PATH: files[WELD_PATH].replace("\\WObj:=wDoor", f"\\WObj:={name}")}


@pytest.mark.parametrize(
    "code",
    ["x:=wArr{1}.oframe.trans.x;", "wA:=wArr{n};", "MoveL p10,v9,fine,tGun\\WObj:=wArr{n};"],
    ids=["read", "copied by a computed number", "used by a computed number"],
)
def test_rapid_an_element_of_an_array_that_code_may_mean_stays(tmp_path, code):
    more = module(f"    {code}\n", f"{P10}{WOBJ}  VAR num x;\n  VAR num n;\n")
    assert_kept(tmp_path / "a", under(rapid(data=ARRAY, more=more), "wArr{1}"), "code reads it")
    done = convert(tmp_path / "b", under(rapid(data=ARRAY), "wArr{1}"), *FRAMES, "--keep-config")
    assert depths(done) == {"wArr{1}": "base"}


def test_rapid_an_array_that_is_read_by_its_name_in_a_text_stays(tmp_path):
    more = module('    GetDataVal "wArr",wB;\n', "  VAR wobjdata wB{2};\n")
    assert_kept(tmp_path, under(rapid(data=ARRAY, more=more), "wArr{1}"), "GetDataVal may read it")


def test_rapid_encoded_modules_are_named_where_a_frame_changes(tmp_path):
    for options, said in (((), False), (FRAMES, True)):
        folder = tmp_path / str(len(options))
        backup = folder / "backup/RAPID/TASK1/SYSMOD"
        backup.mkdir(parents=True)
        (backup / "Secret.sys").write_bytes(b"\xfc\x00\x01\x02")
        done = convert(folder, rapid(), *options, "--keep-config")
        assert done.code == 0, done.err
        messages = [issue["message"] for issue in done.record["issues"] if issue["code"] == "NOT_CHECKED"]
        assert any("whether they use wDoor is not known" in message for message in messages) == said


def test_rapid_a_work_object_within_other_data_stays(tmp_path):
    record = "  RECORD stn\n    num no;\n    wobjdata wo;\n  ENDRECORD\n" + f"  PERS stn st1:=[1,{WORK_OBJECT}];\n"
    files = under(rapid(), "st1.wo")
    files[WELD_PATH] = files[WELD_PATH].replace("MODULE Weld\n", f"MODULE Weld\n{record}")
    assert_kept(tmp_path, files, "it stands in a routine or within other data")


# -------------------------------------------------------------------------------- motions of which the frame is not known

HOMELESS = {
    "a way along a base": "DECL INT N\nBAS(#BASE,N)\nLIN_REL {Z 100.0} #BASE\n",
    "a way along whatever base": "LIN_REL {Z 100.0}\n",
    "a position of the routine's own": "DECL E6POS XT\nXT=$AXIS_RET\nLIN XT\n",
    "an interrupt's way": "INTERRUPT DECL 3 WHEN $IN[1] DO back( )\nEND\nDEF back( )\nLIN_REL {Z 50.0} #BASE\n",
}


@pytest.mark.parametrize("code", HOMELESS.values(), ids=HOMELESS.keys())
def test_krl_a_motion_without_a_target_in_a_file_needs_its_base_all_the_same(tmp_path, code):
    assert_kept(tmp_path, krl(more=program(code)), "the program does not tell which base")


def test_krl_a_statement_that_nobody_knows_may_go_to_a_point_under_any_base(tmp_path):
    assert_kept(tmp_path, krl(more=program("LINX XR1 ??\n", R1)), "nobody knows what 'LINX XR1 ??' does")


def test_krl_a_file_that_is_no_program_may_use_any_base(tmp_path):
    files = {**krl(), "KRC/R1/Program/old.src": "\x00\x01 BAS(#BASE,1) LIN XR1"}
    assert_kept(tmp_path, files, "a file that is not understood may use it")


def test_krl_a_way_along_the_axes_of_a_held_part_turns_with_its_frame(tmp_path):
    other = program("FDAT_ACT={TOOL_NO 1,BASE_NO 3,IPO_FRAME #TCP}\nBAS(#FRAMES)\nLIN_REL {Z -50.0} #TOOL\n")
    files = {**krl_held_part(), **{f"KRC/R1/Program/{name}": text for name, text in other.items()}}
    assert_kept(tmp_path, files, "LIN_REL@4 goes along its axes")


# ------------------------------------------------------------------------------------------------------- what changes

EQUAL = "BASE_DATA[6]={X 1000.0,Y 0.0,Z 500.0,A 90.0,B 0.0,C 0.0}\nBASE_DATA[5]="


@pytest.mark.parametrize("reads", [False, True])
def test_krl_a_point_under_two_bases_in_one_place_takes_both_or_none(tmp_path, reads):
    body = "FDAT_ACT=FQ\nBAS(#CP_PARAMS,1)\nLIN XS1\n"
    more = program("DECL REAL R\nR=BASE_DATA[6].X\n") if reads else {}
    files = with_config(krl(body=body, data=fdat("Q", 6), more=more), "BASE_DATA[5]=", EQUAL)
    points, frames = convert(tmp_path / "a", files), convert(tmp_path / "b", files, *FRAMES)
    changed = {name for name, depth in depths(frames).items() if depth == "base"}
    assert changed == (set() if reads else {"BASE_DATA[1]", "BASE_DATA[6]"})
    for base in ("BASE_DATA[1]", "BASE_DATA[6]"):
        wanted = krl_flange(points.folder, "S1", base)
        assert krl_flange(frames.folder, "S1", base) == pytest.approx(wanted, abs=1e-3)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("{X 1000.0,Y 0.0,Z 500.0,A 90.0,", "{X 1.00000E+03,Y -0.0,Z 5.0E2,A +90.0,"),
        ("{X 1000.0,Y 0.0,", "{X 1000.00000000000000000001,Y 0.000000000000000000,"),
        ("A 90.0,B 0.0,C 0.0}\nBASE_DATA[2]", "A 90.0,B 89.9999,C 12.0}\nBASE_DATA[2]"),
    ],
    ids=["exponents and signs", "long numbers", "steep"],
)
def test_krl_whatever_the_spelling_of_a_base(tmp_path, old, new):
    files = with_config(krl(), old, new)
    wide = ("--max-shift", "5000,180")
    points, frames = convert(tmp_path / "a", files, *wide), convert(tmp_path / "b", files, *FRAMES, *wide)
    assert depths(frames) == {"BASE_DATA[1]": "base"}
    for name in SPOTS:
        assert krl_flange(frames.folder, name) == pytest.approx(krl_flange(points.folder, name), abs=1e-3)


def test_krl_a_base_in_hexadecimal_numbers_gets_decimals(tmp_path):
    done = convert(tmp_path, with_config(krl(), "{X 1000.0,", "{X 'H3E8',"), *FRAMES)
    assert depths(done) == {"BASE_DATA[1]": "base"}
    wanted = TURN @ [1000.0, 0.0, 500.0] + SHIFT
    assert krl_frame(done.folder, "BASE_DATA[1]")[:3, 3] == pytest.approx(wanted, abs=1e-6)


@pytest.mark.parametrize("length", [0.7071, 0.7066], ids=["rounded", "norm .999"])
def test_rapid_a_quaternion_that_is_not_of_length_one(tmp_path, length):
    files = rapid()
    path = "RAPID/TASK1/SYSMOD/Frames.sys"
    files[path] = files[path].replace("0.707106781186548", f"{length}")
    options = ("--keep-config",)
    points, frames = convert(tmp_path / "a", files, *options), convert(tmp_path / "b", files, *FRAMES, *options)
    assert depths(frames) == {"wDoor": "base"}
    for name in SPOTS:
        assert rapid_flange(frames.folder, name) == pytest.approx(rapid_flange(points.folder, name), abs=1e-3)


# -------------------------------------------------------------------------------------------------------------- tools

OFFSET = np.array([1.0, 2.0, -3.0])


class Tool:
    """A calibration with a tool offset, and what becomes of a backup under it."""

    def __init__(self, folder: Path, files: dict[str, str], kind: str = "measured", rigid: bool = True) -> None:
        self.folder, self.backup = folder, folder / "backup"
        self.add(self.backup, files)
        turn, shift = (TURN, SHIFT) if rigid else (np.eye(3), np.zeros(3))
        made = Calibration(turn, np.asarray(shift), kind, "same" if rigid else "free", tuple(SPOTS))
        (folder / "cal.json").write_text(replace(made, tool_offset=OFFSET).to_json())

    @staticmethod
    def add(folder: Path, files: dict[str, str]) -> None:
        for path, text in files.items():
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            (folder / path).write_bytes(text.replace("\n", "\r\n").encode("latin-1"))

    def convert(self, source: Path, name: str, *options: str) -> tuple[int, dict, str, Path]:
        out = self.folder / name
        arguments = ["convert", source, "-c", self.folder / "cal.json", "-o", out, "--json", "--force"]
        result = CliRunner().invoke(app, [str(item) for item in (*arguments, "--max-shift", "5000,180", *options)])
        return result.exit_code, json.loads(result.stdout) if result.stdout else {}, result.stderr, out


def depths_of(record: dict) -> dict[str, str]:
    return {edit["target"]: edit["depth"] for edit in record["edits"]}


def same_flanges(one: Path, other: Path) -> None:
    for name in SPOTS:
        assert krl_flange(one, name) == pytest.approx(krl_flange(other, name), abs=1e-3)


def test_where_a_tool_changes_and_the_base_taught_with_it_stays_the_points_change(tmp_path):
    """The flange stays where it is, but the numbers cannot: P' = P d."""
    plant = Tool(tmp_path, krl(more=program("DECL REAL R\nR=BASE_DATA[1].X\n")), rigid=False)
    code, record, err, out = plant.convert(plant.backup, "frames", *FRAMES)
    assert code == 0, err
    assert depths_of(record) == {"TOOL_DATA[1]": "tool", **{f"X{name}": "point" for name in SPOTS}}
    same_flanges(out, plant.convert(plant.backup, "points", "--apply", "points")[3])
    for name in SPOTS:
        assert krl_pose(out, name)[:3, 3] == pytest.approx(krl_pose(plant.backup, name)[:3, 3] + OFFSET, abs=1e-3)
    assert not record["transitions"]


@pytest.mark.parametrize("code", ["LIN_REL {A 5.0} #TOOL\n", "BAS(#TOOL,1)\nLIN_REL {A 5.0} #TOOL\n"])
def test_a_turn_about_a_tip_keeps_the_tool_wherever_it_stands(tmp_path, code):
    plant = Tool(tmp_path, krl(more=program(code)))
    _, record, _, _ = plant.convert(plant.backup, "out", *FRAMES)
    assert depths_of(record)["BASE_DATA[1]"] == "base"
    assert "TOOL_DATA[1]" not in depths_of(record)


def test_a_tool_offset_in_the_points_is_taken_out_of_them_where_the_base_went_into_its_data(tmp_path):
    """The tool is another program's too, both times."""
    plant = Tool(tmp_path, krl(more=program(lin("R1"), R1 + fdat("R1", 5))))
    code, record, err, out = plant.convert(plant.backup, "frames", *FRAMES)
    assert code == 0, err
    assert set(depths_of(record).values()) == {"base", "point"}
    code, _, err, back = plant.convert(out, "back", *FRAMES, "--inverse")
    assert code == 0, err
    same_flanges(back, plant.backup)


def test_a_tool_offset_in_a_tool_that_has_got_another_user_is_not_taken_out_of_the_points(tmp_path):
    plant = Tool(tmp_path, krl())
    code, _, err, out = plant.convert(plant.backup, "frames", *FRAMES)
    assert code == 0, err
    more = {f"KRC/R1/Program/{name}": text for name, text in program(lin("R1"), R1 + fdat("R1", 5)).items()}
    plant.add(out, more)
    code, _, err, back = plant.convert(out, "back", *FRAMES, "--inverse")
    assert code == 2
    assert "stands in TOOL_DATA[1] and cannot be taken out: XR1 in other uses it too" in err
    assert not back.exists()


def test_the_way_back_of_a_way_back_asks_too_where_the_offset_stands(tmp_path):
    """Simulation to the floor with a theory calibration, and up again."""
    plant = Tool(tmp_path, krl(), kind="theory")
    code, _, err, floor = plant.convert(plant.backup, "floor", "--inverse", *FRAMES)
    assert code == 0, err
    code, _, err, _ = plant.convert(floor, "wrong", "--apply", "points")
    assert code == 2
    assert "add --apply frames" in err
    code, _, err, back = plant.convert(floor, "back", *FRAMES)
    assert code == 0, err
    same_flanges(back, plant.backup)


@pytest.mark.parametrize("robot", [KUKA, ABB])
def test_a_tool_offset_that_was_found_beside_other_effects_goes_into_the_tool(tmp_path, robot):
    """It is a term of the model then; the axis' error stays in the points."""
    effects = ("joint_zero", "tool_offset")
    plant = cell(tmp_path / "line", robot, *effects, seed=2, spots=40)
    plant.convert(tmp_path / "points", effects).calibration.save(tmp_path / "cal.json")
    made = plant.convert(tmp_path / "frames", (), calibration=tmp_path / "cal.json", apply="frames")
    assert {edit.depth for edit in made.correction.edits} == {"point", "base", "tool"}
    for name in plant.line.ids[:10]:
        wanted = flange_of(tmp_path / "points", name)
        assert flange_of(tmp_path / "frames", name) == pytest.approx(wanted, abs=2e-3)
        assert np.abs(wanted - flange_of(plant.backup, name)).max() > 0.1
