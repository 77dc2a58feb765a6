"""Which RAPID targets move, which stay, and what refuses a program."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest

from tests.correction.small import SPOTS, convert, convert_again, krl_in_base1, moved, rapid, robtarget

NUMBER = r"-?\d+(?:\.\d+)?"
P1 = f"  CONST robtarget p1:={robtarget(5, 6, 7)};\n"
MOVE = "    MoveL p1,v100,z10,tGun\\WObj:=wDoor;\n"


def run(tmp_path, files, *options, name="out"):
    """Without machine data no confdata can be computed: it is kept, on demand."""
    return convert(tmp_path, files, "--keep-config", *options, name=name)


def xyz(text: str, start: str) -> np.ndarray:
    (body,) = re.findall(rf"{start}\[\[({NUMBER},{NUMBER},{NUMBER})\]", text)
    return np.array([float(number) for number in body.split(",")])


def in_world(point) -> np.ndarray:
    x, y, z = point
    return np.array([-y, x, z]) + [1000.0, 0.0, 500.0]


def assert_all_as_before(done, files):
    for path, text in files.items():
        assert (done.folder / path).read_bytes() == text.replace("\n", "\r\n").encode("latin-1"), path


def test_spots_move_in_their_own_work_object(tmp_path):
    done = run(tmp_path, rapid())
    assert done.code == 0, done.err
    for name, place in SPOTS.items():
        assert xyz(done.text("Weld.mod"), f"{name}:=") == pytest.approx(krl_in_base1(moved(place)), abs=6e-5)


def test_confdata_without_a_model_is_refused_unless_kept(tmp_path):
    files = rapid()
    done = convert(tmp_path, files)
    assert {code for _, _, code in done.refusals()} == {"CONFIG_NOT_CHECKED"}
    assert_all_as_before(done, files)


def test_inline_targets_move_and_keep_their_spelling(tmp_path):
    inline = "    MoveL [[5.0000,6.0000, 7.0000],[1,0,0,0],[0,0,0,0],[9E9,9E+09,9E+9,9.0000E+09,1E+10,9E9]],v100,z10,tGun\\WObj:=wDoor;\n"
    text = run(tmp_path, rapid(body=inline)).text("Weld.mod")
    assert xyz(text.replace(" ", ""), "MoveL") == pytest.approx(krl_in_base1(moved(in_world((5, 6, 7)))), abs=6e-5)
    assert "],[0,0,0,0],[9E9,9E+09,9E+9,9.0000E+09,1E+10,9E9]],v100" in text
    assert re.search(r"MoveL \[\[-?[\d.]+,-?[\d.]+, -?[\d.]+\]", text)


def test_offs_turns_and_reltool_does_not(tmp_path):
    body = "    MoveL Offs(p1,0,100,7),v100,z10,tGun\\WObj:=wDoor;\n    MoveL RelTool(p1,1,2,-80\\Rx:=3),v100,z10,tGun\\WObj:=wDoor;\n"
    done = run(tmp_path, rapid(body=body, data=P1))
    assert done.code == 0, done.err
    x, y = -100 * np.sin(0.05), 100 * np.cos(0.05)
    assert f"Offs(p1,{x:.3f},{y:.3f},7)" in done.text("Weld.mod")
    assert "RelTool(p1,1,2,-80\\Rx:=3)" in done.text("Weld.mod")
    assert "p1" in done.edited()


def test_a_quaternion_keeps_its_sign(tmp_path):
    data = "  CONST robtarget p1:=[[5.0,6.0,7.0],[-0.7071068,0,0,-0.7071068],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\n"
    text = run(tmp_path, rapid(body=MOVE, data=data)).text("Weld.mod")
    (quaternion,) = re.findall(rf"p1:=\[\[.*?\],\[({NUMBER}),", text)
    assert float(quaternion) < 0


def test_both_points_of_a_circle_and_a_compact_if_move(tmp_path):
    data = "".join(f"  CONST robtarget p{n}:={robtarget(n, 6, 7)};\n" for n in (1, 2, 3))
    body = "    MoveC p1,p2,v100,z10,tGun\\WObj:=wDoor;\n    IF di1=1 MoveL p3,v100,z10,tGun\\WObj:=wDoor;\n"
    assert {"p1", "p2", "p3"} <= run(tmp_path, rapid(body=body, data=data)).edited()


def test_a_commented_out_motion_does_not_count(tmp_path):
    body = "    ! MoveL p1,v100,z10,tGun\\WObj:=wDoor;\n"
    done = run(tmp_path, rapid(body=body, data=P1))
    assert done.stays()["p1"] == "NOT_REACHED"


def test_another_work_object_stays(tmp_path):
    done = run(tmp_path, rapid(body=MOVE.replace("wDoor", "wDress"), data=P1))
    assert done.code == 0, done.err
    assert done.stays()["p1"] == "OUT_OF_SCOPE"


def test_wobj0_in_a_weld_routine_is_refused(tmp_path):
    done = run(tmp_path, rapid(body=MOVE.replace("\\WObj:=wDoor", ""), data=P1))
    assert done.refusals() == {("Weld", "p1", "WORLD_BASE")}


@pytest.mark.parametrize(
    ("frames", "code"),
    [
        ("tGun\\WObj:=wTurn", "UNKNOWN_FRAME"),  # its user frame moves with a positioner
        ("tGun\\WObj:=wNowhere", "UNKNOWN_FRAME"),
    ],
)
def test_a_frame_that_is_not_known_is_refused(tmp_path, frames, code):
    done = run(tmp_path, rapid(body=f"    MoveL p1,v100,z10,{frames};\n", data=P1))
    assert done.refusals() == {("Weld", "p1", code)}


def test_a_work_object_that_the_program_changes_is_not_known(tmp_path):
    done = run(tmp_path, rapid(body="    wDoor.oframe.trans.x:=5;\n"))
    assert done.code == 2
    assert "UNKNOWN_FRAME" in done.err


def test_a_displaced_program_has_no_known_targets(tmp_path):
    done = run(tmp_path, rapid(body="    PDispSet peShift;\n"))
    assert done.code == 2


def test_a_target_that_the_program_changes_is_refused(tmp_path):
    data = P1.replace("CONST", "PERS")
    done = run(tmp_path, rapid(body="    p1:=CRobT();\n" + MOVE, data=data))
    assert done.refusals() == {("Weld", "p1", "RUN_TIME_POSE")}


def test_a_computed_target_is_refused(tmp_path):
    done = run(tmp_path, rapid(body="    MoveL pCalc(1),v100,z10,tGun\\WObj:=wDoor;\n"))
    assert {code for _, _, code in done.refusals()} == {"RUN_TIME_POSE"}


def test_a_stationary_gun_that_no_matched_spot_uses_stays(tmp_path):
    files = rapid(body="    SpotL p1,v800,gun1,sd1,tFixed\\WObj:=wPart;\n", data=P1)
    done = run(tmp_path, files)
    assert done.edited() == {"S1", "S2", "S3", "S4"}
    assert done.stays()["p1"] == "OUT_OF_SCOPE"


def test_a_wrapper_is_known_by_the_types_of_its_arguments(tmp_path):
    wrapper = "  PROC MoveLG(num n,robtarget p,speeddata v,PERS tooldata t\\PERS wobjdata WObj)\n    MoveL p,v,z10,t\\WObj?WObj;\n  ENDPROC\n"
    done = run(tmp_path, rapid(body="    MoveLG 5,p1,v100,tGun\\WObj:=wDoor;\n", data=P1, after=wrapper))
    assert done.code == 0, done.err
    assert "p1" in done.edited()


def test_a_wrapper_with_its_own_frames_is_judged_where_it_is_called(tmp_path):
    routine = "  PROC rGo(robtarget p)\n    MoveL p,v100,z10,tGun\\WObj:=wDoor;\n  ENDPROC\n"
    done = run(tmp_path, rapid(body="    rGo p1;\n", data=P1, after=routine))
    assert done.code == 0, done.err
    assert xyz(done.text("Weld.mod"), "p1:=") == pytest.approx(krl_in_base1(moved(in_world((5, 6, 7)))), abs=6e-5)


def test_a_target_handed_to_an_unknown_routine_is_refused(tmp_path):
    done = run(tmp_path, rapid(body="    rNotHere p1;\n", data=P1))
    assert done.code == 1
    assert {code for _, _, code in done.refusals()} == {"UNKNOWN_FRAME"}
    assert done.edited() == set()


def test_a_local_target_hides_one_of_another_module(tmp_path):
    other = f"MODULE Other\n  CONST robtarget p1:={robtarget(1, 1, 1)};\nENDMODULE\n"
    done = run(tmp_path, rapid(body=MOVE, data=P1.replace("CONST", "LOCAL CONST"), more={"Other.mod": other}))
    assert done.code == 0, done.err
    assert done.text("Other.mod") == other.replace("\n", "\r\n")


def test_arrays_of_targets(tmp_path):
    data = f"  CONST robtarget pList{{2}}:=[{robtarget(1, 2, 3)},{robtarget(4, 5, 6)}];\n"
    done = run(tmp_path, rapid(body="    MoveL pList{2},v100,z10,tGun\\WObj:=wDoor;\n", data=data))
    assert done.code == 0, done.err
    assert "pList{2}" in done.edited()
    assert "pList{1}" not in done.edited()


def test_an_array_element_chosen_while_the_robot_runs_is_refused(tmp_path):
    data = f"  CONST robtarget pList{{2}}:=[{robtarget(1, 2, 3)},{robtarget(4, 5, 6)}];\n"
    done = run(tmp_path, rapid(body="    MoveL pList{i},v100,z10,tGun\\WObj:=wDoor;\n", data=data))
    assert {code for _, _, code in done.refusals()} == {"RUN_TIME_POSE"}


def test_copies_under_home_are_not_live(tmp_path):
    files = rapid()
    files["HOME/Weld.mod"] = files["RAPID/TASK1/PROGMOD/Weld.mod"]
    done = run(tmp_path, files)
    assert done.code == 0, done.err
    assert (done.folder / "HOME/Weld.mod").read_bytes() == files["HOME/Weld.mod"].replace("\n", "\r\n").encode(
        "latin-1"
    )


def test_an_encoded_module_is_copied(tmp_path):
    files = rapid()
    convert(tmp_path, files, name="first")
    binary = b"\xfc\x00\x01MOD\xff\r\n\x00"
    (tmp_path / "backup/RAPID/TASK1/SYSMOD/GAP_USER.sys").write_bytes(binary)
    done = convert_again(tmp_path, tmp_path / "backup", "--keep-config")
    assert done.code == 0, done.err
    assert (done.folder / "RAPID/TASK1/SYSMOD/GAP_USER.sys").read_bytes() == binary
    assert "BINARY_MODULE" in {issue["code"] for issue in done.record["issues"]}


# --------------------------------------------------------------- what a hostile reader tried, each by what must not happen


def test_local_work_objects_of_many_routines_are_kept_apart(tmp_path):
    routines = "".join(
        f'  PROC a{i}()\n    VAR wobjdata w:=[FALSE,TRUE,"",[[{1000 + i},0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];\n'
        f"    MoveL {robtarget(1, 2, 3)},v100,z10,tGun\\WObj:=w;\n  ENDPROC\n"
        for i in range(60)
    )
    files = rapid(after=routines)
    convert(tmp_path, files, "--keep-config")
    from typer.testing import CliRunner

    from respot.cli import app

    record = json.loads(CliRunner().invoke(app, ["inspect", str(tmp_path / "backup"), "--json"]).stdout)
    worlds = {t["routine"]: t["world"]["x"] for t in record["robots"][0]["targets"] if t["routine"].startswith("a")}
    assert worlds == {f"a{i}": 1001 + i for i in range(60)}


def test_a_displacement_behind_a_compact_if_counts(tmp_path):
    done = run(tmp_path, rapid(body="    IF b PDispSet peShift;\n"))
    assert done.code == 2
    assert "PDispSet" in done.err


def test_another_task_that_changes_a_shared_work_object(tmp_path):
    files = rapid()
    files["RAPID/TASK2/PROGMOD/Other.mod"] = (
        'MODULE Other\n  PERS wobjdata wDoor:=[FALSE,TRUE,"",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];\n'
        "  PROC main()\n    wDoor.uframe.trans.x:=5;\n  ENDPROC\nENDMODULE\n"
    )
    done = run(tmp_path, files)
    assert done.code == 2
    assert "UNKNOWN_FRAME" in done.err


def test_a_routine_that_changes_what_it_is_handed(tmp_path):
    shift = "  PROC ShiftW(PERS wobjdata w)\n    w.oframe.trans.x:=5;\n  ENDPROC\n"
    done = run(tmp_path, rapid(body="    ShiftW wDoor;\n", after=shift))
    assert done.code == 2
    assert "UNKNOWN_FRAME" in done.err


def test_a_function_that_changes_the_target_it_is_handed(tmp_path):
    adjust = "  FUNC bool Adj(INOUT robtarget p)\n    p.trans.x:=5;\n    RETURN TRUE;\n  ENDFUNC\n"
    data = P1.replace("CONST", "PERS")
    done = run(tmp_path, rapid(body="    ok:=Adj(p1);\n" + MOVE, data=data, after=adjust))
    assert done.refusals() == {("Weld", "p1", "RUN_TIME_POSE")}


def test_a_motion_without_a_comma_refuses_the_program(tmp_path):
    files = rapid(body="    MoveL p1 v100,z10,tGun\\WObj:=wDoor;\n", data=P1)
    done = run(tmp_path, files)
    assert {code for _, _, code in done.refusals()} == {"OPAQUE_STATEMENT"}
    assert_all_as_before(done, files)


def test_a_wrapper_that_offsets_along_the_base_is_refused(tmp_path):
    wrapper = (
        "  PROC mvAbove(robtarget p,PERS tooldata t\\PERS wobjdata WObj)\n"
        "    MoveL Offs(p,0,0,300),v100,z10,t\\WObj?WObj;\n  ENDPROC\n"
    )
    done = run(tmp_path, rapid(body="    mvAbove p1,tGun\\WObj:=wDoor;\n", data=P1, after=wrapper))
    assert done.code == 1
    assert done.edited() == set()


def test_a_routine_that_uses_a_moved_target_comes_into_scope(tmp_path):
    other = (
        f"MODULE Srv\n  CONST robtarget p9:={robtarget(4, 5, 6)};\n  PROC rSrv()\n"
        "    MoveL Offs(S1,0,100,0),v100,z10,tGun\\WObj:=wDoor;\n    MoveL p9,v100,z10,tGun\\WObj:=wDoor;\n"
        "  ENDPROC\nENDMODULE\n"
    )
    done = run(tmp_path, rapid(more={"Srv.mod": other}))
    assert done.code == 0, done.err
    assert "p9" in done.edited()
    assert "Offs(S1,0,100,0)" not in done.text("Srv.mod")


def test_another_task_with_routines_of_the_same_names_stays(tmp_path):
    sub = f"  PROC sub()\n    MoveL {robtarget(1, 2, 3)},v100,z10,tGun\\WObj:=wDoor;\n  ENDPROC\n"
    files = rapid(body="    sub;\n", after=sub)
    second = {path.replace("TASK1", "TASK2"): text.replace("PERS", "TASK PERS") for path, text in files.items()}
    second = {path: text.replace("SpotL", "MoveJ").replace("gun1,sd1,", "z10,") for path, text in second.items()}
    done = run(tmp_path, {**files, **second})
    assert done.code == 0, done.err
    assert {edit["path"] for edit in done.record["edits"]} == {"RAPID/TASK1/PROGMOD/Weld.mod"}


def test_a_held_work_object_is_no_fixed_base_even_if_the_tool_is_unknown(tmp_path):
    files = {
        path: text.replace("wDoor", "wPart") if path.endswith("Weld.mod") else text for path, text in rapid().items()
    }
    files["RAPID/TASK1/PROGMOD/Weld.mod"] = files["RAPID/TASK1/PROGMOD/Weld.mod"].replace("tGun", "tNowhere")
    done = run(tmp_path, files)
    assert done.code == 2
    assert "whether the gun stands still is not known" in done.err


def test_persistent_targets_of_several_tasks_are_copies(tmp_path):
    files = rapid(body=MOVE, data=P1.replace("CONST", "PERS"))
    files["RAPID/TASK2/PROGMOD/Two.mod"] = "MODULE Two\n" + P1.replace("CONST", "PERS") + "ENDMODULE\n"
    assert run(tmp_path, files).refusals() == {("Weld", "p1", "RUN_TIME_POSE")}


def test_a_file_with_several_modules_is_left_alone(tmp_path):
    files = rapid()
    files["RAPID/TASK1/PROGMOD/Both.prg"] = "MODULE A\nENDMODULE\nMODULE B\nENDMODULE\n"
    done = run(tmp_path, files)
    assert "SEVERAL_MODULES" in {issue["code"] for issue in done.record["issues"]}


@pytest.mark.parametrize("data", ['CONST string s:=\n    "a";', "CONST num n:=1; CONST num m:=\n2;"])
def test_the_header_stands_between_statements(tmp_path, data):
    files = rapid()
    path = "RAPID/TASK1/PROGMOD/Weld.mod"
    files[path] = files[path].replace("MODULE Weld\n", f"MODULE Weld {data}\n", 1)
    done = run(tmp_path, files)
    assert done.code == 0, done.err
    text = re.sub(r" *!respot: [^\r\n]*\r\n", "", done.text("Weld.mod"))
    assert text.startswith(files[path].partition("  CONST robtarget")[0].replace("\n", "\r\n"))
    assert re.search(r";\r\n  !respot: ", done.text("Weld.mod"))


def test_a_fragment_without_a_module_is_not_corrected_twice(tmp_path):
    files = rapid()
    path = "RAPID/TASK1/PROGMOD/Weld.mod"
    files[path] = files[path].replace("MODULE Weld\n", "").replace("ENDMODULE\n", "")
    first = run(tmp_path, files)
    assert first.code == 0, first.err
    second = convert_again(tmp_path, first.folder, "--keep-config", name="second")
    assert second.code == 2
    assert "ALREADY_APPLIED" in second.err


def test_joints_that_are_declared_elsewhere_do_not_refuse_a_program(tmp_path):
    assert run(tmp_path, rapid(body="    MoveAbsJ jHome\\NoEOffs,v100,fine,tGun;\n")).code == 0


@pytest.mark.parametrize(
    "code", ["SearchL\\Stop,di1,p1,S1,v100,tGun\\WObj:=wDoor;", "ok:=StrToVal(st,p1);", "Move1\\p:=p1;"]
)
def test_what_writes_into_a_target_makes_it_a_run_time_pose(tmp_path, code):
    routine = "  PROC Move1(\\INOUT robtarget p)\n    p.trans.z:=5;\n  ENDPROC\n"
    data = P1.replace("CONST", "PERS")
    done = run(tmp_path, rapid(body=f"    {code}\n" + MOVE, data=data, after=routine))
    assert "p1" not in done.edited()
    assert "RUN_TIME_POSE" in {found for _, _, found in done.refusals()}


def test_the_original_of_a_touched_up_target_moves_with_it(tmp_path):
    """Option "Absolute Limit ModPos" compares both: left behind, the next touch-up is refused (facts: rapid.md 2.4)."""
    data = f"  CONST o_robtarget o_S1:={robtarget(*krl_in_base1((1001, 0, 500)))};\n"
    data += f"  CONST o_robtarget o_P9:={robtarget(7, 8, 9)};\n"
    done = run(tmp_path, rapid(data=data))
    assert done.code == 0, done.err
    place = xyz(done.text("Weld.mod"), "o_S1:=")
    assert place == pytest.approx(krl_in_base1(moved((1001, 0, 500))), abs=6e-4)
    assert done.stays()["o_P9"] == "NOT_REACHED"
