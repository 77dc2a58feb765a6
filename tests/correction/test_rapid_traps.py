"""Ways in which a RAPID program changes a work object or uses one literal twice: no silence, no internal error."""

from __future__ import annotations

import numpy as np
import pytest

from tests.correction.small import DATA, SPOTS, TURN, convert, krl_in_base1, moved, rapid, robtarget

P1 = f"  CONST robtarget p1:={robtarget(1, 2, 3)};\n"
MOVE = "    MoveL p1,v100,z10,tGun\\WObj:=wDoor;\n"
SHIFT_ROUTINE = "  PROC rShift(INOUT wobjdata w)\n    w.uframe.trans.x:=5;\n  ENDPROC\n"
LOOK_ROUTINE = "  PROC rLook(PERS wobjdata w)\n    TPWrite w.ufmec;\n  ENDPROC\n"


def run(tmp_path, files, *options):
    return convert(tmp_path, files, "--keep-config", *options)


@pytest.mark.parametrize(
    ("body", "after"),
    [
        ('    %"rShi"+sEnd% wDoor;\n', SHIFT_ROUTINE),
        ("    %sName% wDoor;\n", SHIFT_ROUTINE),
        ("    CorrectFrame wDoor;\n", ""),
        ("    RMQGetMsgData msg,wDoor;\n", ""),
    ],
)
def test_a_work_object_that_may_be_changed_by_what_gets_it(tmp_path, body, after):
    """By a routine bound late, by one outside of the backup, by a message of another task."""
    done = run(tmp_path, rapid(body=body, after=after))
    assert done.code == 2
    assert "UNKNOWN_FRAME" in done.err


@pytest.mark.parametrize(
    ("body", "after"),
    [
        ('    %"rLo"+sEnd% wDoor;\n', LOOK_ROUTINE),
        ("    MoveOther p1,v100,z10,tGun,wDoor;\n", ""),
        ("    SetSysData wDoor;\n", ""),
    ],
)
def test_a_work_object_that_is_only_used_stays_known(tmp_path, body, after):
    done = run(tmp_path, rapid(body=body, data=P1, after=after))
    assert done.code == 0, done.err
    assert set(SPOTS) <= done.edited()


def test_an_offset_handed_to_a_routine_with_two_motions_turns_once(tmp_path):
    after = "  PROC rTwo(robtarget p)\n    MoveJ p,v100,z10,tGun\\WObj:=wDoor;\n"
    after += "    MoveL p,v100,z10,tGun\\WObj:=wDoor;\n  ENDPROC\n"
    done = run(tmp_path, rapid(body="    rTwo Offs(p1,10,0,50);\n", data=P1, after=after))
    assert done.code == 0, done.err
    text = done.text("Weld.mod")
    found = [float(number) for number in text.split("Offs(p1,")[1].split(")")[0].split(",")]
    assert found == pytest.approx(TURN @ [10.0, 0.0, 50.0], abs=6e-4)  # wDoor is turned about the same axis


def test_an_approach_in_the_caller_that_cannot_be_read_is_refused(tmp_path):
    main = f"MODULE Main\n  CONST robtarget pApp:={robtarget(1, 2, 3)};\n  PROC main()\n"
    main += "    MoveL pApp v100,z10,tGun\\WObj:=wDoor;\n    rWeld;\n  ENDPROC\nENDMODULE\n"
    done = run(tmp_path, rapid(more={"Main.mod": main}))
    assert done.refusals() == {("Main", "line 4", "OPAQUE_STATEMENT")}


def shift_mm(point) -> float:
    return float(np.linalg.norm(moved(point) - np.asarray(point)))


def test_the_original_of_a_refused_target_stays_with_it(tmp_path):
    """``--partial`` must not part the two that the controller compares."""
    near, far = (1000.0, 0.0, 500.0), (1000.0, 40.0, 500.0)
    limit = (shift_mm(near) + shift_mm(far)) / 2
    near, far = sorted((near, far), key=shift_mm)
    data = f"  CONST robtarget p1:={robtarget(*krl_in_base1(far))};\n"
    data += f"  CONST o_robtarget o_p1:={robtarget(*krl_in_base1(near))};\n"
    done = run(tmp_path, rapid(body=MOVE, data=data), "--partial", "--max-shift", f"{limit},10")
    assert ("Weld", "p1", "SHIFT_TOO_LARGE") in done.refusals()
    assert done.edited() & {"p1", "o_p1"} == set()


def test_the_original_of_another_target_of_the_same_name_stays(tmp_path):
    """The routine moves to a p1 of its own; the original belongs to that of the module."""
    data = P1 + f"  CONST o_robtarget o_p1:={robtarget(1, 2, 3)};\n"
    own = f"  PROC rOwn()\n    CONST robtarget p1:={robtarget(9, 9, 9)};\n{MOVE}  ENDPROC\n"
    done = run(tmp_path, rapid(body="    rOwn;\n", data=data, after=own))
    assert done.code == 0, done.err
    assert done.edited() == {*SPOTS, "p1"}
    assert {"p1", "o_p1"} <= set(done.stays())


def held_in(first: str, second: str) -> dict[str, str]:
    """Backup whose spots 1 and 2 are on the held work object ``first``, 3 and 4 on ``second``."""
    files = rapid()
    module = files["RAPID/TASK1/PROGMOD/Weld.mod"].replace("tGun", "tFixed")
    for name in SPOTS:
        frame = first if name in ("S1", "S2") else second
        module = module.replace(
            f"SpotL {name},v800,gun1,sd1,tFixed\\WObj:=wDoor", f"SpotL {name},v800,gun1,sd1,tFixed\\WObj:={frame}"
        )
    files["RAPID/TASK1/PROGMOD/Weld.mod"] = module
    turned = '  PERS wobjdata wTurned:=[TRUE,TRUE,"",[[300,0,0],[0,1,0,0]],[[0,0,0],[1,0,0,0]]];\n'
    same = '  PERS wobjdata wSame:=[TRUE,TRUE,"",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];\n'
    files["RAPID/TASK1/SYSMOD/Frames.sys"] = DATA.replace("ENDMODULE", turned + same + "ENDMODULE")
    return files


def test_spots_in_two_frames_of_the_held_part_are_refused(tmp_path):
    """A deviation of the part is told in one frame of it; in a turned one the same numbers are another motion."""
    done = run(tmp_path, held_in("wPart", "wTurned"))
    assert done.code == 1
    assert {code for _, _, code in done.refusals()} == {"EXTERNAL_TCP"}
    assert done.edited() == set()


def test_two_names_of_one_frame_of_the_held_part_are_one(tmp_path):
    done = run(tmp_path, held_in("wPart", "wSame"))
    assert done.code == 0, done.err
    assert done.edited() == set(SPOTS)
