"""Ways in which a KRL program changes a frame or hands a point away: nothing may be moved, or left behind, in silence."""

from __future__ import annotations

import pytest

from tests.correction.small import SPOTS, convert, fdat, krl, krl_point, lin

VIA = krl_point("V1", 10, 20, 30) + fdat("V1")
SPOT_EDITS = {f"X{name}" for name in SPOTS}


def test_the_same_program_without_a_trap(tmp_path):
    """Control of all tests below: under the base of the spots the point moves."""
    done = convert(tmp_path, krl("SETB(1)\nLIN XV1\n", VIA, "DEF SETB(N :IN)\nEND\n"))
    assert done.code == 0, done.err
    assert done.edited() == {*SPOT_EDITS, "XV1"}


@pytest.mark.parametrize(
    ("call", "routine"),
    [
        ("SETB($BASE)\n", "DEF SETB(F :OUT)\nF=BASE_DATA[5]\nEND\n"),
        ("SETB($BASE)\n", "DEF SETB(F)\nF.X=5\nEND\n"),
        ("FDAT_ACT=FS1\nSETB(FDAT_ACT)\nBAS(#CP_PARAMS,1)\n", "DEF SETB(F :OUT)\nF.BASE_NO=5\nEND\n"),
        ("SETB($IPO_MODE)\n", "DEF SETB(F :OUT)\nF=#TCP\nEND\n"),
        ("N=SETB($BASE)\n", "DEFFCT INT SETB(F :OUT)\nF=BASE_DATA[5]\nRETURN 1\nENDFCT\n"),
        ("LOOP\nLIN XV1\nSETB($BASE)\nENDLOOP\n", "DEF SETB(F :OUT)\nF=BASE_DATA[5]\nEND\n"),
    ],
)
def test_a_frame_that_is_handed_by_reference_is_not_known(tmp_path, call, routine):
    done = convert(tmp_path, krl(f"{call}LIN XV1\n", VIA, routine))
    assert done.code == 1
    assert done.edited() == set()
    assert "XV1" in {target for _, target, _ in done.refusals()}


def test_a_frame_that_is_handed_for_reading_stays_known(tmp_path):
    done = convert(tmp_path, krl("SHOW($BASE)\nLIN XV1\n", VIA, "DEF SHOW(F :IN)\nEND\n"))
    assert done.code == 0, done.err
    assert done.edited() == {*SPOT_EDITS, "XV1"}


def test_a_function_among_the_arguments_of_a_call_runs_too(tmp_path):
    after = "DEFFCT INT SETB( )\n$BASE=BASE_DATA[5]\nRETURN 1\nENDFCT\nDEF SHOW(N :IN)\nEND\n"
    done = convert(tmp_path, krl("SHOW(SETB())\nLIN XV1\n", VIA, after))
    assert done.stays()["XV1"] == "OUT_OF_SCOPE"  # base 5 holds no spot


@pytest.mark.parametrize("call", ["OK=STRTOINT(TEXT[],NB)", "MBX_REC(1,NB)"])
def test_a_number_that_a_function_of_the_system_writes_is_no_constant(tmp_path, call):
    done = convert(tmp_path, krl(f"{call}\n$BASE=BASE_DATA[NB]\nLIN XV1\n", "DECL INT NB=1\n" + VIA))
    assert done.refusals() == {("weld", "XV1", "UNKNOWN_FRAME")}


@pytest.mark.parametrize("point", ["XV1", "{X 1.0,Y 2.0,Z 3.0,A 0.0,B 0.0,C 0.0}"])
def test_a_point_handed_to_a_routine_outside_of_the_backup_is_refused(tmp_path, point):
    """The routine may go there: left behind it would be approached at its old place between moved spots."""
    done = convert(tmp_path, krl(lin("S1") + f"MOVETO({point})\n" + lin("S1"), VIA))
    assert done.code == 1
    assert done.edited() == set()


def test_a_home_position_handed_to_a_routine_outside_of_the_backup_stays(tmp_path):
    done = convert(tmp_path, krl(lin("S1") + "CHECKHOME(XHOME)\n" + lin("S1")))
    assert done.code == 0, done.err
    assert done.stays()["XHOME"] == "JOINT_TARGET"


@pytest.mark.parametrize("motion", ["LIN XAPP C_FOO BAR", "LIN {X 1.0,Y 2.0,Z 3.0,A 0.0,B 0.0,C 0.0} C_FOO BAR"])
def test_an_approach_in_the_caller_that_cannot_be_read_is_refused(tmp_path, motion):
    caller = f"DEF main( )\nFDAT_ACT=FAPP\nBAS(#CP_PARAMS,1)\n{motion}\nweld()\nEND\n"
    data = "DEFDAT MAIN\n" + krl_point("APP", 1, 2, 3) + fdat("APP") + "ENDDAT\n"
    done = convert(tmp_path, krl(more={"main.src": caller, "main.dat": data}))
    assert done.code == 1
    assert done.refusals() == {("main", "line 4", "OPAQUE_STATEMENT")}


def test_another_statement_of_the_caller_that_cannot_be_read_refuses_nothing(tmp_path):
    caller = "DEF main( )\nFOO BAR BAZ\nweld()\nEND\n"
    assert convert(tmp_path, krl(more={"main.src": caller})).code == 0


@pytest.mark.parametrize("base", ["XV1", "BASE_DATA[2]:XV1"])
def test_a_point_that_is_a_base_too_does_not_move(tmp_path, base):
    """What is programmed in it would move with it; a spot there would move twice."""
    data = VIA + krl_point("W", 5, 6, 7)
    done = convert(tmp_path, krl(lin("V1") + f"$BASE={base}\nLIN XW\n", data))
    assert done.refusals() == {("weld", "XV1", "SHARED_TARGET")}
    assert done.edited() == set()


PLANT = 'language = "krl"\ntitle = "plant"\nharmless_calls = ["SETX"]\n[[weld_call]]\nname = "GUNX"\n'


@pytest.mark.parametrize("name", ["SETX", "GUNX", "CLEAR"])
@pytest.mark.parametrize("code", ["$BASE=BASE_DATA[5]\n", "FDAT_ACT.BASE_NO=5\nBAS(#FRAMES)\n"])
def test_the_code_of_a_routine_counts_more_than_its_harmless_name(tmp_path, name, code):
    """Whether respot's own forms or those of the plant call it harmless."""
    (tmp_path / "plant.toml").write_text(PLANT)
    body = lin("S1") + f"{name}( )\nLIN XV1\n"
    done = convert(tmp_path, krl(body, VIA, f"DEF {name}( )\n{code}END\n"), "--profile", str(tmp_path / "plant.toml"))
    assert "XV1" not in done.edited()


@pytest.mark.parametrize("name", ["SETX", "GUNX"])
def test_a_harmless_routine_that_sets_no_frame_is_harmless(tmp_path, name):
    (tmp_path / "plant.toml").write_text(PLANT)
    body = lin("S1") + f"{name}( )\nLIN XV1\n"
    done = convert(
        tmp_path, krl(body, VIA, f"DEF {name}( )\nNOT_HERE( )\nEND\n"), "--profile", str(tmp_path / "plant.toml")
    )
    assert done.code == 0, done.err
    assert done.edited() == {*SPOT_EDITS, "XV1"}


def test_a_base_that_another_is_composed_on_is_not_corrected_itself(tmp_path):
    """Both would move the targets of the composed one: they stand on it, and are on the same part."""
    body = "$BASE=$BASE:{X 10.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}\nLIN XQ\n"
    done = convert(tmp_path, krl(body, krl_point("Q", 1, 2, 3)), "--apply", "frames")
    assert done.code == 0, done.err
    assert {edit["depth"] for edit in done.record["edits"]} == {"point"}
    assert done.edited() == {"XS1", "XS2", "XS3", "XS4", "XQ"}
