"""Which RAPID targets move, which stay, and what refuses a program."""

from __future__ import annotations

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


def test_a_target_handed_to_an_unknown_routine_is_refused(tmp_path):
    routine = "  PROC rGo(robtarget p)\n    MoveL p,v100,z10,tGun\\WObj:=wDoor;\n  ENDPROC\n"
    done = run(tmp_path, rapid(body="    rGo p1;\n", data=P1, after=routine))
    assert done.code == 1
    assert {code for _, _, code in done.refusals()} == {"RUN_TIME_POSE", "UNKNOWN_FRAME"}
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
