"""Which KRL targets move, which stay, and what refuses a program."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from typer.testing import CliRunner

from respot.cli import app
from tests.correction.small import SPOTS, convert, convert_again, fdat, krl, krl_in_base1, krl_point, lin, moved

NUMBERS = re.compile(r"[XYZ] (-?[\d.]+)")


def xyz(text: str, name: str) -> np.ndarray:
    (body,) = re.findall(rf"\bX{name}=\{{(.*?)\}}", text)
    return np.array([float(number) for number in NUMBERS.findall(body)])


def assert_all_as_before(done, files):
    for path, text in files.items():
        assert (done.folder / path).read_bytes() == text.replace("\n", "\r\n").encode("latin-1"), path


def test_spots_move_in_their_own_base(tmp_path):
    done = convert(tmp_path, krl())
    assert done.code == 0, done.err
    for name, place in SPOTS.items():
        assert xyz(done.text("weld.dat"), name) == pytest.approx(krl_in_base1(moved(place)), abs=6e-5)


def test_a_motion_of_unknown_base_refuses_the_whole_program(tmp_path):
    files = krl(body="LIN XFREE\n", data=krl_point("FREE", 1, 2, 3), after="DEF other()\nEND\n")
    files["KRC/R1/Program/weld.src"] = files["KRC/R1/Program/weld.src"].replace("LIN XFREE", "weird()\nLIN XFREE")
    files["KRC/R1/Program/weird.src"] = "DEF weird()\n$BASE=CALCULATED(1)\nEND\n"
    done = convert(tmp_path, files)
    assert done.code == 1
    assert done.refusals() == {("weld", "XFREE", "UNKNOWN_FRAME")}
    assert_all_as_before(done, files)


def test_a_program_that_shares_a_moved_point_is_refused_with_it(tmp_path):
    shared = "&ACCESS RVP\nDEFDAT SHARED PUBLIC\n" + krl_point("GATE", 10, 20, 30, kind="GLOBAL E6POS") + "ENDDAT\n"
    other = "DEF other( )\n" + lin("S1X", "XS1X", weld=True) + lin("GATE") + "END\n"
    other_dat = "DEFDAT OTHER\n" + krl_point("S1X", 0, 0, 0) + fdat("S1X") + fdat("GATE") + "ENDDAT\n"
    files = krl(
        body=lin("GATE") + "LIN CALC(1)\n",
        data=fdat("GATE"),
        more={"shared.dat": shared, "other.src": other, "other.dat": other_dat},
    )
    files["KRC/R1/Program/weld.src"] = files["KRC/R1/Program/weld.src"].replace("LIN CALC", "other()\nLIN CALC")
    done = convert(tmp_path, files)
    assert done.code == 1
    assert {(program, code) for program, _, code in done.refusals()} == {("weld", "RUN_TIME_POSE")}
    assert_all_as_before(done, files)


def test_programs_that_share_a_point_are_corrected_together(tmp_path):
    shared = "&ACCESS RVP\nDEFDAT SHARED PUBLIC\n" + krl_point("GATE", 10, 20, 30, kind="GLOBAL E6POS") + "ENDDAT\n"
    other = "DEF other( )\n" + lin("GATE") + lin("P7") + "END\n"
    other_dat = "DEFDAT OTHER\n" + krl_point("P7", 0, 0, 0) + fdat("P7") + fdat("GATE") + "ENDDAT\n"
    more = {"shared.dat": shared, "other.src": other, "other.dat": other_dat}
    done = convert(tmp_path, krl(body=lin("GATE") + "other()\n", data=fdat("GATE"), more=more))
    assert done.code == 0, done.err
    assert {"XGATE", "XP7"} <= done.edited()


def test_partial_corrects_the_rest(tmp_path):
    files = krl(body="LIN CALC(1)\n" + lin("P1"), data=krl_point("P1", 5, 6, 7) + fdat("P1"))
    assert convert(tmp_path, files).edited() == set()
    done = convert_again(tmp_path, tmp_path / "backup", "--partial", name="partial")
    assert done.code == 1
    assert done.edited() == {"XS1", "XS2", "XS3", "XS4", "XP1"}


def test_a_target_in_the_world_frame_of_a_weld_routine_is_refused(tmp_path):
    done = convert(tmp_path, krl(body=lin("P1"), data=krl_point("P1", 5, 6, 7) + fdat("P1", base=0)))
    assert done.refusals() == {("weld", "XP1", "WORLD_BASE")}


def test_a_service_routine_in_the_world_frame_stays(tmp_path):
    tip = "DEF tip_dress( )\n" + lin("P1") + "END\n"
    dat = "DEFDAT TIP_DRESS\n" + krl_point("P1", 5, 6, 7) + fdat("P1", base=0) + "ENDDAT\n"
    done = convert(tmp_path, krl(body="tip_dress( )\n", more={"tip_dress.src": tip, "tip_dress.dat": dat}))
    assert done.code == 0, done.err
    assert done.stays()["XP1"] == "OUT_OF_SCOPE"


def test_another_base_home_and_unused_points_stay(tmp_path):
    data = krl_point("RACK", 5, 6, 7) + fdat("RACK", base=5) + krl_point("OLD", 1, 1, 1)
    done = convert(tmp_path, krl(body=lin("RACK") + "PTP XHOME\n", data=data))
    assert done.code == 0, done.err
    assert done.stays() == {"XRACK": "OUT_OF_SCOPE", "XHOME": "JOINT_TARGET", "XOLD": "NOT_REACHED"}
    assert {(item["from"], item["to"]) for item in done.record["transitions"]} == {("XS4", "XRACK")}


def test_the_approach_in_the_caller_moves_with_the_spots(tmp_path):
    main = "DEF main( )\n" + lin("PRE") + "weld( )\n" + "END\n"
    dat = "DEFDAT MAIN\n" + krl_point("PRE", 100, 0, 100) + fdat("PRE") + "ENDDAT\n"
    done = convert(tmp_path, krl(more={"main.src": main, "main.dat": dat}))
    assert done.code == 0, done.err
    assert "XPRE" in done.edited()


def test_a_routine_without_spots_under_the_same_base_is_warned_of(tmp_path):
    alone = "DEF alone( )\n" + lin("P9") + "END\n"
    dat = "DEFDAT ALONE\n" + krl_point("P9", 100, 0, 100) + fdat("P9") + "ENDDAT\n"
    done = convert(tmp_path, krl(more={"alone.src": alone, "alone.dat": dat}))
    assert done.stays()["XP9"] == "SAME_BASE_STAYS"
    assert "SAME_BASE_STAYS" in {issue["code"] for issue in done.record["issues"]}


def test_programs_takes_a_glob_in_place_of_the_spots(tmp_path):
    alone = "DEF alone( )\n" + lin("P9") + "END\n"
    dat = "DEFDAT ALONE\n" + krl_point("P9", 100, 0, 100) + fdat("P9") + "ENDDAT\n"
    done = convert(tmp_path, krl(more={"alone.src": alone, "alone.dat": dat}), "--programs", "ALO*")
    assert done.edited() == {"XP9"}


@pytest.mark.parametrize("code", ["XP1=$POS_ACT\n", "XP1.Z=XP1.Z+5\n"])
def test_a_point_that_the_program_changes_is_refused(tmp_path, code):
    done = convert(tmp_path, krl(body=code + lin("P1"), data=krl_point("P1", 5, 6, 7) + fdat("P1")))
    assert done.refusals() == {("weld", "XP1", "RUN_TIME_POSE")}


def test_an_undeclared_point_is_refused(tmp_path):
    done = convert(tmp_path, krl(body=lin("NONE"), data=fdat("NONE")))
    assert {code for _, _, code in done.refusals()} == {"UNKNOWN_TARGET"}


def test_one_point_under_two_bases_is_refused(tmp_path):
    data = krl_point("P1", 5, 6, 7) + fdat("P1") + fdat("P2", base=5)
    done = convert(tmp_path, krl(body=lin("P1") + lin("P2", "XP1"), data=data))
    assert done.refusals() == {("weld", "XP1", "SHARED_TARGET")}


@pytest.mark.parametrize(
    ("branches", "known"),
    [
        ("IF A THEN\n$BASE=BASE_DATA[1]\nELSE\n$BASE=BASE_DATA[2]\nENDIF\n", False),
        ("IF A THEN\n$BASE=BASE_DATA[5]\nENDIF\n", False),
        ("IF A THEN\n$BASE=BASE_DATA[1]\nELSE\n$BASE=BASE_DATA[1]\nENDIF\n", True),
        (
            "SWITCH A\nCASE 1\n$BASE=BASE_DATA[1]\nCASE 2\n$BASE=BASE_DATA[5]\nDEFAULT\n$BASE=BASE_DATA[1]\nENDSWITCH\n",
            False,
        ),
        ("SWITCH A\nCASE 1\n$BASE=BASE_DATA[1]\nDEFAULT\n$BASE=BASE_DATA[1]\nENDSWITCH\n", True),
    ],
)
def test_what_branches_set_differently_is_not_known_after_them(tmp_path, branches, known):
    done = convert(tmp_path, krl(body=branches + "LIN XP1\n", data=krl_point("P1", 5, 6, 7)))
    assert ("XP1" in done.edited()) is known
    assert done.refusals() == (set() if known else {("weld", "XP1", "UNKNOWN_FRAME")})


def test_a_moving_base_is_refused(tmp_path):
    files = krl(body=lin("P1"), data=krl_point("P1", 5, 6, 7) + fdat("P1", base=2))
    config = files["KRC/R1/System/$config.dat"]
    moving = 'MACHINE_FRAME_DAT[2]={MACH_DEF_INDEX 2,PARENT[] " ",GEOMETRY[] " "}\nENDDAT'
    files["KRC/R1/System/$config.dat"] = config.replace("ENDDAT", moving)
    assert convert(tmp_path, files).refusals() == {("weld", "XP1", "UNKNOWN_FRAME")}


def test_tool_side_operands_stay_and_the_first_operand_moves(tmp_path):
    done = convert(
        tmp_path, krl(body=lin("P1", "XP1:{X 0,Y 0,Z -60,A 0,B 0,C 0}"), data=krl_point("P1", 5, 6, 7) + fdat("P1"))
    )
    assert "XP1" in done.edited()
    assert "LIN XP1:{X 0,Y 0,Z -60,A 0,B 0,C 0}" in done.text("weld.src")


def test_a_relative_motion_in_the_base_turns_and_gets_the_components_it_lacks(tmp_path):
    done = convert(tmp_path, krl(body="LIN_REL {Y 100.0}\nLIN_REL {X 0.0,Y 0.0,Z 80.0} #TOOL\nLIN_REL {Z 50}\n"))
    assert done.code == 0, done.err
    # base 1 is turned by 90 degrees about z, and so is the correction: a turn about z stays one
    x, y = -100 * np.sin(0.05), 100 * np.cos(0.05)
    assert f"LIN_REL {{Y {y:.3f},X {x:.3f}}}" in done.text("weld.src")
    assert "LIN_REL {X 0.0,Y 0.0,Z 80.0} #TOOL" in done.text("weld.src")
    assert "LIN_REL {Z 50}" in done.text("weld.src")


def test_circular_motions_move_both_points(tmp_path):
    data = krl_point("C1", 5, 6, 7) + krl_point("C2", 8, 9, 10) + fdat("C1")
    done = convert(tmp_path, krl(body="FDAT_ACT=FC1\nBAS(#CP_PARAMS,1)\nCIRC XC1,XC2,CA 90\n", data=data))
    assert {"XC1", "XC2"} <= done.edited()


def test_a_point_shared_by_two_motions_moves_once(tmp_path):
    done = convert(tmp_path, krl(body=lin("P1") + lin("P1"), data=krl_point("P1", 5, 6, 7) + fdat("P1")))
    assert [edit["target"] for edit in done.record["edits"]].count("XP1") == 1
    assert xyz(done.text("weld.dat"), "P1") == pytest.approx(
        krl_in_base1(moved(np.array([1000, 0, 500]) + [-6, 5, 7])), abs=6e-5
    )


def test_a_local_point_hides_a_global_one(tmp_path):
    shared = "DEFDAT SHARED PUBLIC\n" + krl_point("P1", 10, 20, 30, kind="GLOBAL E6POS") + "ENDDAT\n"
    done = convert(
        tmp_path, krl(body=lin("P1"), data=krl_point("P1", 5, 6, 7) + fdat("P1"), more={"shared.dat": shared})
    )
    assert done.code == 0, done.err
    assert done.text("shared.dat") == shared.replace("\n", "\r\n")


def test_other_case_and_array_elements_are_found(tmp_path):
    data = "DECL E6POS XLIST[2]\nXLIST[1]={X 1.0,Y 2.0,Z 3.0,A 0.0,B 0.0,C 0.0}\nXLIST[2]={X 4.0,Y 5.0,Z 6.0,A 0.0,B 0.0,C 0.0}\n"
    done = convert(tmp_path, krl(body="lin xList[2]\nLIN Xs1\n", data=data))
    assert done.code == 0, done.err
    assert "XLIST[2]" in done.edited()
    assert "XLIST[1]" not in done.edited()


def test_status_and_turn_without_a_model_are_refused_unless_kept(tmp_path):
    files = krl(body=lin("P1"), data=krl_point("P1", 5, 6, 7, ",S 2,T 35") + fdat("P1"))
    done = convert(tmp_path, files)
    assert done.refusals() == {("weld", "XP1", "CONFIG_NOT_CHECKED")}
    assert_all_as_before(done, files)
    kept = convert_again(tmp_path, tmp_path / "backup", "--keep-config", name="kept")
    assert kept.code == 0, kept.err
    assert ",S 2,T 35}" in kept.text("weld.dat")


def test_a_second_calibration_replaces_the_header(tmp_path):
    first = convert(tmp_path, krl())
    second = convert_again(tmp_path, first.folder, translation=[5.0, 0.0, 0.0], name="second")
    assert second.code == 0, second.err
    assert second.text("weld.dat").count(";respot: calibration") == 1
    assert second.record["calibration"]["hash"] in second.text("weld.dat")
    assert second.text("weld.dat").startswith("&ACCESS RVP\r\nDEFDAT  WELD\r\n;respot: ")


@pytest.mark.parametrize(
    "damage",
    [
        lambda data: data.replace(b"\r\n", b"\n"),
        lambda data: data.rstrip(b"\r\n"),
        lambda data: data.replace(b"\r\n", b"\r\r\n"),
        lambda data: data.replace(b"\r\n", b"\n", 3),
        lambda data: b"\xef\xbb\xbf" + data,
        lambda data: data + b"\x1a",
        lambda data: data.replace(b"DEFDAT  WELD", b"DEFDAT  WELD ;gepr\xfcft"),
        lambda data: data.replace(b"DECL E6POS XS2", b";\x81\x8d\r\n  decl\te6pos\txs2"),
    ],
    ids=["lf", "no_final_newline", "cr_cr_lf", "mixed", "bom", "trailing_1a", "cp1252", "latin_1"],
)
def test_bytes_outside_the_numbers_survive(tmp_path, damage):
    files = krl()
    convert(tmp_path, files, name="first")
    path = tmp_path / "backup" / "KRC/R1/Program/weld.dat"
    path.write_bytes(damage(path.read_bytes()))
    old = path.read_bytes()
    done = convert_again(tmp_path, tmp_path / "backup")
    assert done.code == 0, done.err
    new = (done.folder / "KRC/R1/Program/weld.dat").read_bytes()
    new = re.sub(rb";respot: [^\r\n]*\r*\n", b"", new)
    number = re.compile(rb"-?\d+\.\d+")
    assert number.sub(b"#", new) == number.sub(b"#", old)
    assert new != old


# --------------------------------------------------------------- what a hostile reader tried, each by what must not happen


def twice(tmp_path, files, more: str, content: str):
    return convert(tmp_path, {**files, more: content})


def test_a_stale_copy_of_the_data_list_in_another_folder_is_not_the_live_one(tmp_path):
    files = krl()
    stale = files["KRC/R1/Program/weld.dat"].replace("E6POS", "E6POS")
    done = twice(tmp_path, files, "KRC/R1/Program/zzold/weld.dat", stale)
    assert done.code == 0, done.err
    assert {edit["path"] for edit in done.record["edits"]} == {"KRC/R1/Program/weld.dat"}


def test_a_global_point_of_the_robots_own_folder_wins_over_a_copy(tmp_path):
    shared = "DEFDAT SHARED PUBLIC\n" + krl_point("G1", 10, 20, 30, kind="GLOBAL E6POS") + "ENDDAT\n"
    files = krl(body=lin("G1"), data=fdat("G1"), more={"shared.dat": shared})
    done = twice(tmp_path, files, "KRC/BackupOld/sharedx.dat", shared)
    assert {edit["path"] for edit in done.record["edits"] if edit["target"] == "XG1"} == {"KRC/R1/Program/shared.dat"}


def test_a_global_point_that_stands_twice_is_refused(tmp_path):
    shared = "DEFDAT SHARED PUBLIC\n" + krl_point("G1", 10, 20, 30, kind="GLOBAL E6POS") + "ENDDAT\n"
    files = krl(body=lin("G1"), data=fdat("G1"), more={"shared.dat": shared, "other.dat": shared})
    assert {(program, code) for program, _, code in convert(tmp_path, files).refusals()} == {("weld", "AMBIGUOUS_NAME")}


def test_names_that_differ_in_case_only_are_refused(tmp_path):
    files = krl()
    done = twice(tmp_path, files, "KRC/R1/Program/WELD.DAT", files["KRC/R1/Program/weld.dat"])
    assert done.code == 2
    assert "UNSAFE_ARCHIVE" in done.err


P8 = krl_point("P8", 5, 6, 7) + fdat("P8")


@pytest.mark.parametrize(
    "code",
    [
        "BASE_DATA[1].A=BASE_DATA[1].A+90\n",
        "BASE_DATA[N]=SOME\n",
        "BASE_CORR_ON=TRUE\n",
    ],
)
def test_a_base_that_the_program_changes_is_not_known(tmp_path, code):
    done = convert(tmp_path, krl(body=code))
    assert done.code == 2
    assert "UNKNOWN_FRAME" in done.err


@pytest.mark.parametrize(
    ("code", "expected"),
    [
        ("FP8.BASE_NO=2\n" + lin("P8"), "UNKNOWN_FRAME"),
        ("SHIFT(XP8)\n" + lin("P8"), "RUN_TIME_POSE"),
        ("LOOP\nLIN XP8\n$BASE=BASE_DATA[2]\nENDLOOP\n", "UNKNOWN_FRAME"),
        ("$BASE=BASE_DATA[2]\nWHILE A\n$BASE=BASE_DATA[1]\nENDWHILE\nLIN XP8\n", "UNKNOWN_FRAME"),
        ("$BASE=BASE_DATA[2]\nGOTO L1\n$BASE=BASE_DATA[1]\nL1:\nLIN XP8\n", "UNKNOWN_FRAME"),
        (
            "SWITCH N\nCASE 1\nN=2\nCASE 2\n$BASE=BASE_DATA[2]\nDEFAULT\n$BASE=BASE_DATA[2]\nENDSWITCH\nLIN XP8\n",
            "UNKNOWN_FRAME",
        ),
        ("SPLINE WITH $BASE=UNKNOWN[2]\nSPL XP8\nENDSPLINE\n", "UNKNOWN_FRAME"),
        ("BAS(#EX_BASE,2)\nLIN XP8\n", "UNKNOWN_FRAME"),
        ("A=SETB(2)\nLIN XP8\n", "UNKNOWN_FRAME"),
        ("SET_BASE2( )\nLIN XP8\n", "UNKNOWN_FRAME"),
        ("TRIGGER WHEN DISTANCE=0 DELAY=0 DO SB()\nLIN XP8\n", "UNKNOWN_FRAME"),
        ("LIN XP8 C_FOO BAR\n", "OPAQUE_STATEMENT"),
        ('CREAD(H,SW,MR,TO,OFS,"%f",XP8.Z)\n' + lin("P8"), "RUN_TIME_POSE"),
        ("TRIGGER WHEN DISTANCE=0 DELAY=0 DO XP8.Z=XP8.Z+300\n" + lin("P8"), "RUN_TIME_POSE"),
        ("TRIGGER WHEN DISTANCE=0 DELAY=0 DO $BASE=UNKNOWN\nLIN XP8\n", "UNKNOWN_FRAME"),
        (lin("P8", "XS1:XP8"), "RUN_TIME_POSE"),
        (lin("P8", "{X 0,Y 0,Z 50,A 0,B 0,C 0}:XP8"), "RUN_TIME_POSE"),
        (lin("P8", "$NULLFRAME:XP8"), "RUN_TIME_POSE"),
        (lin("P8", "{A 10,B 20,C 40}"), "RUN_TIME_POSE"),
        ("DECL E6POS XG\n" + lin("P8", "XG"), "RUN_TIME_POSE"),
    ],
)
def test_what_is_not_certain_refuses_the_program(tmp_path, code, expected):
    files = krl(body=code, data=P8)
    files["KRC/R1/System/$config.dat"] = files["KRC/R1/System/$config.dat"].replace(
        "ENDDAT", krl_point("G", 9, 9, 9) + "ENDDAT"
    )
    done = convert(tmp_path, files)
    assert done.code == 1
    assert expected in {found for _, _, found in done.refusals()}
    assert_all_as_before(done, files)


def test_an_array_element_that_the_program_changes_is_refused(tmp_path):
    data = "DECL E6POS XA[1]\nXA[1]={X 1.0,Y 2.0,Z 3.0,A 0.0,B 0.0,C 0.0}\n"
    done = convert(tmp_path, krl(body="XA[1].Z=XA[1].Z+300\nLIN XA[1]\n", data=data))
    assert done.refusals() == {("weld", "XA[1]", "RUN_TIME_POSE")}


def test_a_global_point_that_another_module_changes_is_refused(tmp_path):
    shared = "DEFDAT SHARED PUBLIC\n" + krl_point("G1", 10, 20, 30, kind="GLOBAL E6POS") + "ENDDAT\n"
    other = "DEF other( )\nXG1.Z=5\nEND\n"
    done = convert(tmp_path, krl(body=lin("G1"), data=fdat("G1"), more={"shared.dat": shared, "other.src": other}))
    assert done.refusals() == {("weld", "XG1", "RUN_TIME_POSE")}


def test_a_parameter_hides_a_global_point(tmp_path):
    files = krl(body="SUB1(XS1)\n", after="DEF SUB1(P :IN)\nDECL E6POS P\n$BASE=BASE_DATA[1]\nLIN P\nEND\n")
    config = files["KRC/R1/System/$config.dat"]
    files["KRC/R1/System/$config.dat"] = config.replace("ENDDAT", krl_point("", 9, 9, 9).replace("X=", "P=") + "ENDDAT")
    done = convert(tmp_path, files)
    assert {code for _, _, code in done.refusals()} == {"RUN_TIME_POSE"}
    assert_all_as_before(done, files)


def test_a_routine_that_uses_a_moved_point_comes_into_scope(tmp_path):
    other = "DEF other( )\n" + lin("G1") + "LIN_REL {Y 100.0}\n" + lin("P9") + "END\n"
    dat = "DEFDAT OTHER\n" + krl_point("P9", 1, 2, 3) + fdat("P9") + fdat("G1") + "ENDDAT\n"
    shared = "DEFDAT SHARED PUBLIC\n" + krl_point("G1", 10, 20, 30, kind="GLOBAL E6POS") + "ENDDAT\n"
    more = {"other.src": other, "other.dat": dat, "shared.dat": shared}
    done = convert(tmp_path, krl(body=lin("G1"), data=fdat("G1"), more=more))
    assert done.code == 0, done.err
    assert {"XG1", "XP9"} <= done.edited()
    assert "LIN_REL {Y 100.0}" not in done.text("other.src")


def test_a_matched_spot_is_in_no_service_routine(tmp_path):
    files = krl()
    text = {path: content.replace("weld", "wartung").replace("WELD", "WARTUNG") for path, content in files.items()}
    text = {
        path.replace("weld", "wartung"): content.replace("BASE_NO 1", "BASE_NO 0") for path, content in text.items()
    }
    done = convert(tmp_path, text)
    assert done.code == 0, done.err
    assert done.edited() == {"XS1", "XS2", "XS3", "XS4"}


def test_status_as_bits_is_a_configuration_too(tmp_path):
    done = convert(tmp_path, krl(body=lin("P1"), data=krl_point("P1", 5, 6, 7, ",S 'B010',T 'B100010'") + fdat("P1")))
    assert {code for _, _, code in done.refusals()} <= {"CONFIG_NOT_CHECKED", "CONFIG_INCONSISTENT"}
    assert done.refusals()


def test_equal_literal_bases_are_one(tmp_path):
    frame = "$BASE={X 1000.0,Y 0.0,Z 500.0,A 90.0,B 0.0,C 0.0}\n"
    files = krl(body=frame + "LIN XP8\n" + frame + "LIN XP9\n", data=P8 + krl_point("P9", 1, 1, 1))
    assert {"XP8", "XP9"} <= convert(tmp_path, files).edited()


def test_a_transition_through_a_called_routine_is_listed(tmp_path):
    home = "DEF homer( )\nPTP XHOME\nEND\n"
    done = convert(tmp_path, krl(body="homer( )\n" + lin("P8"), data=P8, more={"homer.src": home}))
    assert {("XS4", "XHOME"), ("XHOME", "XP8")} <= {(t["from"], t["to"]) for t in done.record["transitions"]}


def test_a_calibration_is_known_again_behind_another(tmp_path):
    first = convert(tmp_path, krl())
    second = convert_again(tmp_path, first.folder, translation=[5.0, 0.0, 0.0], name="second")
    assert second.code == 0, second.err
    third = convert_again(tmp_path, second.folder, name="third")
    assert third.code == 2
    assert "ALREADY_APPLIED" in third.err


@pytest.mark.parametrize("number", ["1E400", "--5"])
def test_numbers_that_no_controller_holds(tmp_path, number):
    done = convert(tmp_path, krl(body=f"LIN {{X {number},Y 0,Z 0,A 0,B 0,C 0}}\n"))
    assert done.code == 1
    assert done.refusals()


@pytest.mark.parametrize("options", [("--programs", "nosuch*"), ("--templates", "/nosuch")])
def test_options_that_would_do_nothing(tmp_path, options):
    done = convert(tmp_path, krl(), *options)
    assert done.code == 2
    assert "BAD_OPTION" in done.err


def test_a_program_that_comes_without_its_config_goes_home_all_the_same(tmp_path):
    files = krl(body="PTP XHOME1\n")
    assert convert(tmp_path, files).code == 0
    elsewhere = krl(body="PTP XAWAY\n")
    assert convert(tmp_path / "away", elsewhere).refusals() == {("weld", "PTP@19", "UNKNOWN_TARGET")}


def test_a_dresser_under_a_base_that_nobody_set_stays(tmp_path):
    """Spots in the world frame; an unset base lies in the world too, but the dresser is no part."""
    files = {path: text.replace("BASE_NO 1", "BASE_NO 0") for path, text in krl(body="kappen( )\n").items()}
    files["KRC/R1/Program/kappen.src"] = "DEF kappen( )\n" + lin("P8") + "END\n"
    files["KRC/R1/Program/kappen.dat"] = "DEFDAT KAPPEN\n" + krl_point("P8", 5, 6, 7) + fdat("P8", base=2) + "ENDDAT\n"
    done = convert(tmp_path, files)
    assert done.code == 0, done.err
    assert "XS1" in done.edited()
    assert "XP8" not in done.edited()


def test_a_weld_behind_another_routines_motion_is_nobodys(tmp_path):
    more = {"appr.src": "DEF appr( )\n" + lin("P9") + "END\n"}
    more["appr.dat"] = "DEFDAT APPR\n" + krl_point("P9", 1, 2, 3) + fdat("P9") + "ENDDAT\n"
    files = krl(body=lin("P8") + "appr( )\nUSERSPOT(#SPOT,S_ACT)\n", data=P8, more=more)
    convert(tmp_path, files)
    record = json.loads(CliRunner().invoke(app, ["inspect", str(tmp_path / "backup"), "--json"]).stdout)
    assert {t["name"] for t in record["robots"][0]["targets"] if t["weld"]} == {"XS1", "XS2", "XS3", "XS4"}


def test_routines_that_call_each_other_many_times_are_followed_in_bounded_time(tmp_path):
    more = {f"m{n}.src": f"DEF m{n}( )\n" + f"m{n + 1}( )\n" * 12 + "END\n" for n in range(1, 9)}
    more["m9.src"] = "DEF m9( )\nEND\n"
    assert convert(tmp_path, krl(body="m1( )\n", more=more)).code == 0


def test_a_kept_target_of_a_partial_correction_makes_transitions(tmp_path):
    data = krl_point("P8", 5, 6, 7, ",S 2,T 2") + fdat("P8") + krl_point("P9", 1, 2, 3) + fdat("P9")
    done = convert(tmp_path, krl(body=lin("P8") + lin("P9"), data=data), "--partial")
    assert {("XS4", "XP8"), ("XP8", "XP9")} <= {(t["from"], t["to"]) for t in done.record["transitions"]}


def test_a_target_that_is_first_used_with_a_computed_shift_is_judged_by_itself(tmp_path):
    """Far outside of the spots, and where its first motion goes is not known: it moves, and is flagged all the same."""
    body = "SH=$POS_ACT\n" + lin("P1", "XP1:SH") + lin("P1")
    done = convert(tmp_path, krl(body=body, data="DECL FRAME SH\n" + krl_point("P1", 900, 0, 0) + fdat("P1")))
    assert done.code == 0, done.err
    assert "XP1" in done.edited()
    (message,) = [issue["message"] for issue in done.record["issues"] if issue["code"] == "EXTRAPOLATED"]
    assert "XP1" in message
