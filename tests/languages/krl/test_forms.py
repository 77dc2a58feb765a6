"""Inline forms of KRL: what is read from each dialect, from folds of all kinds, and which copies disagree."""

from __future__ import annotations

import pytest

from respot.languages.krl.forms import Data, read_forms
from respot.languages.krl.symbols import Symbols
from respot.languages.krl.syntax import read_statements
from tests.languages.krl.inline_forms import EXPECTED, LETTERS, MODULES, load, read, sources_of, src, swap


@pytest.mark.parametrize("module", MODULES)
def test_fields(module):
    found = [
        (
            form.profile,
            form.line,
            {
                name: (form.value(name), "".join(sorted(LETTERS[copy.region] for copy in copies)))
                for name, copies in form.fields.items()
            },
        )
        for form in read(load(module))
    ]
    assert found == EXPECTED[module]


@pytest.mark.parametrize("module", MODULES)
def test_every_copy_is_where_it_says(module):
    files = load(module)
    sources = sources_of(files)
    forms = read(files)
    assert not [issue for form in forms for issue in form.disagreements()]
    for form in forms:
        assert sources[form.path].place(form.span[0])[0] == form.line
        for name, copies in form.fields.items():
            for copy in copies:
                assert sources[copy.path].text[slice(*copy.span)] == copy.text
                assert sources[copy.path].place(copy.span[0])[0] == copy.line
                assert copy.field == name
                assert copy.within[0] <= copy.span[0] <= copy.span[1] <= copy.within[1]


def test_fields_are_read_only_when_they_are_asked_for():
    class Untouched(Symbols):
        def find(self, name, module):
            raise LookupError(name, module)

    files = load("basis")
    sources = sources_of(files)
    source = sources["basis.src"]
    statements = read_statements(source.text, source.line_starts)
    form = read_forms(source, statements, Data(Untouched([]), sources))[0]
    assert (form.profile, form.line) == ("basis", 8)
    with pytest.raises(LookupError):
        form.value("point")


# disagreements --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("module", "line", "path", "old", "new", "said"),
    [
        ("basis", 8, "dat", "FP1={TOOL_NO 3", "FP1={TOOL_NO 28",
         "tool: TOOL_NO 28 in FP1 (basis.dat:5), Tool[3] in the title (basis.src:8)"),
        ("basis", 8, "src", "PTP P1 CONT Vel=80 %", "PTP P1 CONT Vel=60 %",
         "velocity: BAS(#PTP_PARAMS,80) in the body (basis.src:12), Vel=60 in the title (basis.src:8)"),
        ("basis", 8, "src", "5:80,", "5:60,",
         "velocity: BAS(#PTP_PARAMS,80) in the body (basis.src:12), 5:60 in the tail (basis.src:8)"),
        ("basis", 8, "src", "1:PTP, 2:P1, ", "1:PTP, 2:P10, ",
         "point: PTP XP1 in the body (basis.src:13), 2:P10 in the tail (basis.src:8)"),
        ("basis", 8, "src", "FDAT_ACT= FP1\r", "FDAT_ACT= FP2\r",
         "point: PTP XP1 in the body (basis.src:13), FDAT_ACT= FP2 in the body (basis.src:11)"),
        ("basis", 8, "src", "PTP XP1 C_DIS\r", "PTP XP1\r",
         "blend: PTP XP1 in the body (basis.src:13), 3:C_DIS in the tail (basis.src:8)"),
        ("basis", 15, "dat", "BASE_NO 4,IPO_FRAME #TCP", "BASE_NO 4,IPO_FRAME #BASE",
         "external: IPO_FRAME #BASE in FP2 (basis.dat:8)"),
        ("params", 2, "src", "VelocityPath=2;", "VelocityPath=3;",
         "velocity: BAS(#CP_PARAMS, 2.0) in the body (params.src:9), Kuka.VelocityPath=3 in the parameters"),
        ("params", 2, "src", "BlendingEnabled=True", "BlendingEnabled=False",
         "blend: LIN XP21 C_DIS C_DIS in the body (params.src:11), Kuka.BlendingEnabled=False in the parameters"),
        ("params", 2, "src", "LIN P21 CONT", "LIN P22 CONT",
         "point: LIN XP21 in the body (params.src:11), LIN P22 in the title (params.src:2)"),
        ("params", 2, "src", "LIN XP21 C_DIS", "LIN ParkPosition C_Dis",
         "point: LIN ParkPosition in the body (params.src:11), FDAT_ACT = FP21 in the body (params.src:8)"),
        ("spline", 4, "src", "MoveDataName=CPDAT6", "MoveDataName=CPDAT7", "data: "),
        ("spline", 12, "src", "SBASE(FP6.BASE_NO)", "SBASE(FP5.BASE_NO)", "point: SPTP XP6 in the body"),
        ("spottech", 2, "dat", "PGNO1 21", "PGNO1 22",
         "program: PGNO1 22 in SDAT8 (spottech.dat:6), Prog=21 in the title (spottech.src:2)"),
        ("bmw", 12, "src", "SpotNo:40711", "SpotNo:40712", "spot: "),
        ("bmw", 22, "src", "Rvt_Exe (2,1,", "Rvt_Exe (1,1,", "gun: "),
        ("bmw", 22, "src", "Rvt_Feed=1", "Rvt_Feed=0",
         "feed: Rvt_Feed=0 in the parameters (bmw.src:24), Feed:On in the title (bmw.src:22)"),
        ("nut_weld", 2, "dat", "SpotNr 7", "SpotNr 8", "program: SpotNr 8 in NutWeldDAT1 (nut_weld.dat:5)"),
        ("vkrc", 6, "src", "12:2,", "12:1,", "tool: 11: RobWzg=, 12:1 in the tail (vkrc.src:6), RobWzg=2 in the title (vkrc.src:6)"),
    ],
)  # fmt: skip
def test_copies_that_differ_are_an_issue(module, line, path, old, new, said):
    files = swap(load(module), f"{module}.{path}", old, new)
    found = {form.line: form.disagreements() for form in read(files)}
    [issue] = found.pop(line)
    assert issue.code == "FORM_DISAGREES"
    assert (issue.path, issue.line) == (f"{module}.src", line)
    assert issue.message.startswith(said)
    assert not any(found.values())


@pytest.mark.parametrize(
    ("path", "old", "new"),
    [
        ("src", "PTP XP1 C_DIS\r", "PTP xp1 c_dis\r"),  # the controller changes the case of names
        ("src", "5:80,", "5:80.000,"),
        ("src", "PTP XP1 C_DIS\r", "PTP XP1 C_PTP C_DIS\r"),
        ("src", "PTP P1 CONT Vel=80 %", "PTP P1 CONT  Vel= 80 %"),
        ("src", "PDAT_ACT= PPDAT1\r\n", ""),
        ("src", " Tool[3]:Zange groß Base[4]:Tür links;%{PE}%R 8.3.29,%MKUKATPBASIS,%CMOVE,%VPTP", ";%{PE}%R 8.3.29,%MKUKATPBASIS,%CMOVE,%VPTP"),
    ],
)  # fmt: skip
def test_the_same_written_otherwise_or_not_at_all_is_no_disagreement(path, old, new):
    files = swap(load("basis"), f"basis.{path}", old, new)
    assert not [issue for form in read(files) for issue in form.disagreements()]


# folds ------------------------------------------------------------------------------------------------------------------

PTP = ";FOLD PTP P1 Vel=100 % PDAT1 Tool[1] Base[1];%{PE}%R 8.3.29,%MKUKATPBASIS,%CMOVE,%VPTP,%P 1:PTP, 2:P1, 3:, 5:100, 7:PDAT1\n"


def found_in(text: str) -> list[tuple[int, str | None]]:
    return [(form.line, form.value("point")) for form in read(src(text))]


def test_a_form_that_is_commented_out_is_none():
    assert found_in(PTP + ";FDAT_ACT=FP1\n;PTP XP1\n;ENDFOLD") == []


def test_a_fold_around_forms_is_none():
    assert found_in(";FOLD approach\n" + PTP + "PTP XP1\n;ENDFOLD\n;ENDFOLD (approach)") == [(3, "P1")]


def test_trap_unbalanced_folds():
    form = PTP + "PTP XP1\n"
    assert found_in(";ENDFOLD\n" + form + ";ENDFOLD\n;ENDFOLD\n" + form + ";ENDFOLD") == [(3, "P1"), (7, "P1")]
    # the first form is never closed: it ends where the next begins
    other = form.replace("P1", "P2")
    assert found_in(form + other + ";ENDFOLD") == [(2, "P1"), (4, "P2")]
    assert found_in(form + "END\nDEF b ( )\n" + other + ";ENDFOLD") == [(2, "P1"), (6, "P2")]


def test_a_fold_that_is_not_closed_ends_with_its_routine():
    assert found_in(PTP + "END\nDEF b ( )\nPTP XP1\n;ENDFOLD") == []


def test_a_form_that_is_not_closed_takes_nothing_from_the_next():
    form, other = read(src(PTP + "PTP XP1\n" + PTP.replace("P1", "P2") + "BAS(#PTP_PARAMS,50)\nPTP XP2\n;ENDFOLD"))
    assert {copy.line for copies in form.fields.values() for copy in copies} == {2, 3}
    assert form.disagreements() == []
    text = PTP + "PTP XP1\n" + PTP.replace("P1", "P2") + "PTP XP2\n;ENDFOLD\nBAS(#PTP_PARAMS,50)\n;ENDFOLD"
    assert [issue for found in read(src(text)) for issue in found.disagreements()] == []
    assert other.disagreements()[0].message.startswith("velocity: BAS(#PTP_PARAMS,50)")


def test_folds_that_are_never_closed_do_not_slow_down():
    count = 20_000
    forms = read(src(count * (";FOLD x\n;Params A=1\nHALT\n") + PTP + "PTP XP1\n"))
    assert [form.value("point") for form in forms] == ["P1"]


def test_a_title_of_any_length_is_read_to_its_limit():
    assert found_in(PTP.rstrip() + 100_000 * "," + "\nPTP XP1\n;ENDFOLD") == [(2, "P1")]


def test_params_of_an_inner_fold_belong_to_the_form():
    inner = ";FOLD Parameters ;%{h}\n;Params IlfProvider=kukaroboter.basistech.inlineforms.movement.old; Kuka.PointName=P2\n;ENDFOLD\n"
    [form] = read(src(";FOLD PTP P1 Vel=100 % PDAT1 Tool[1] Base[1] ;%{PE}\n" + inner + "PTP XP1\n;ENDFOLD"))
    assert form.profile == "params"
    assert [copy.region for copy in form.fields["point"]] == ["body", "params", "title"]


def test_a_semicolon_in_a_string_ends_no_code():
    [form] = read(src(PTP + 'MsgNotify("a;b") ; PTP XP9\nPTP XP1 ; C_DIS\n;ENDFOLD'))
    assert form.value("blend") == "off"
    assert {copy.text for copy in form.fields["point"]} == {"P1"}


@pytest.mark.parametrize("target", ["XP1[3]", "XP1:{X 5}", "$AXIS_ACT", "{X 1}", "S.P"])
def test_a_target_that_is_no_plain_name_is_no_copy(target):
    [form] = read(src(PTP + f"PTP {target}\n;ENDFOLD"))
    assert [copy.region for copy in form.fields["point"]] == ["tail", "title"]
