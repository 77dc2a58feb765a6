"""A plant's templates: one file overrides one of ours, errors say file and line, and nothing that they get wrong is written."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from respot.cli import app
from respot.issues import BadInputError
from respot.languages.overlay import COMMENT_MARKS
from respot.languages.writing import Header, Templates, applied_calibrations
from respot.source import SourceText
from tests.correction.small import Converted, krl, lin, rapid
from tests.correction.small import convert as convert_small
from tests.output.runs import state

SHIPPED = Path(__file__).parents[2] / "templates"
GOLDEN = Path(__file__).parent / "golden"
#: A relative motion whose literal gets a component more, which `complete.j2` writes.
RELATIVE = "LIN_REL {Y 100.0}\n"


def convert(tmp_path: Path, files: dict[str, str], *options: str, name: str = "out") -> Converted:
    """The small backups have no machine data, so that nobody can compute configurations."""
    return convert_small(tmp_path, files, "--keep-config", *options, name=name)


def laid(tmp_path: Path, name: str, text: str) -> Path:
    place = tmp_path / "plant" / name
    place.parent.mkdir(parents=True, exist_ok=True)
    place.write_text(text)
    return tmp_path / "plant"


def shipped(name: str) -> str:
    return (SHIPPED / name).read_text()


def shipped_header(language: str) -> str:
    """Our header, each line ended, without the remark behind it."""
    return shipped(f"{language}/header.j2").partition("<#-")[0]


def refused(tmp_path: Path, files: dict[str, str], plant: Path, *words: str) -> str:
    made = convert(tmp_path, files, "--templates", str(plant))
    assert made.code == 2, made.err
    assert "BAD_TEMPLATE" in made.err
    for word in words:
        assert word in made.err
    assert not made.folder.exists()
    assert not [path for path in tmp_path.iterdir() if "respot" in path.name]
    return made.err


# ------------------------------------------------------------------------------------------------------------ overriding


@pytest.mark.parametrize(
    ("files", "language", "mark", "program"),
    [(krl(), "krl", ";", "weld.dat"), (rapid(), "rapid", "!", "Weld.mod")],
    ids=["krl", "rapid"],
)
def test_one_template_overrides_one_of_ours(tmp_path, files, language, mark, program):
    header = shipped_header(language)
    plant = laid(tmp_path, f"{language}/header.j2", f"{header}{mark}respot: plant 7, line << 1 + 1 >>\n")
    ours = convert(tmp_path, files, name="ours")
    theirs = convert(tmp_path, files, "--templates", str(plant), name="theirs")
    added = f"{mark}respot: plant 7, line 2\r\n"
    assert theirs.text(program).replace(added, "") == ours.text(program)
    assert theirs.text(program).count(added) == 1
    again = CliRunner().invoke(
        app, ["convert", str(theirs.folder), "-c", str(tmp_path / "theirs.json"), "-o", str(tmp_path / "twice")]
    )
    assert (again.exit_code, "ALREADY_APPLIED" in again.stderr) == (2, True)


def test_templates_of_another_language_change_nothing(tmp_path):
    plant = laid(tmp_path, "rapid/header.j2", shipped("rapid/header.j2").replace("for the cell", "FOR THE CELL"))
    ours, theirs = (
        convert(tmp_path, krl(), *options, name=name)
        for name, options in (("ours", ()), ("theirs", ("--templates", str(plant))))
    )
    before, after = state(ours.folder, times=False), state(theirs.folder, times=False)
    assert {name for name in before if before[name] != after[name]} == set()


@pytest.mark.parametrize(
    ("names", "words"),
    [
        (["krl/literals.j2"], ["literals.j2", "did you mean literal.j2?"]),
        (["krl/header.j2", "krl/notes.txt"], ["notes.txt", "there is complete.j2"]),
        (["rapid/complete.j2"], ["complete.j2", "is no template of rapid"]),
        (["rapdi/header.j2"], ["rapdi", "did you mean rapid?"]),
        (["krl/header.j2", "KRL2/header.j2"], ["KRL2", "did you mean krl?"]),
        (["header.j2"], ["holds no folder krl or rapid"]),
        (["krl/header.j2/inner.j2"], ["header.j2", "is no template of krl"]),
    ],
    ids=str,
)
def test_a_name_that_overrides_nothing_is_refused_with_a_suggestion(tmp_path, names, words):
    for name in names:
        plant = laid(tmp_path, name, shipped("krl/header.j2"))
    refused(tmp_path, krl(), plant, *words)


def test_a_folder_of_templates_that_is_none(tmp_path):
    (tmp_path / "file").write_text("")
    for name in ("file", "nowhere"):
        made = convert(tmp_path, krl(), "--templates", str(tmp_path / name))
        assert made.code == 2 and "BAD_OPTION" in made.err and name in made.err


def test_hidden_files_and_pages_beside_the_templates_are_nobodys_business(tmp_path):
    for name in ("krl/.DS_Store", ".git/config", "pages/fit.html.j2", "README.md", "krl/header.j2"):
        plant = laid(tmp_path, name, shipped("krl/header.j2"))
    assert convert(tmp_path, krl(), "--templates", str(plant)).code == 0


# ---------------------------------------------------------------------------------------------------------------- errors


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("<% if %>", "Expected an expression"),
        ("<< fields | spel >>", "spel"),
        ("<% for field in fields %>", "endfor"),
        ("<< feilds >>", "'feilds' is undefined"),
        ("<< fields[0].gapp >>", "gapp"),
        ("<< fields[99].gap >>", "99"),
        ("<< fields[0].value | spell(3) >>", "int"),
        ("<< 1 / 0 >>", "division"),
        ("<< fields + 1 >>", "list"),
        ("<% include 'other.j2' %>", "other.j2"),
        ("<% include 'literal.j2' %>", "recursion"),
    ],
    ids=str,
)
def test_an_error_names_the_templates_file_and_line(tmp_path, line, words):
    plant = laid(tmp_path, "krl/literal.j2", f"<#- one -#>\n<#- two -#>\n{line}\n")
    said = refused(tmp_path, krl(), plant, words)
    place = re.escape(str(plant / "krl" / "literal.j2"))
    assert re.search(rf"^error: {place}:[34]: BAD_TEMPLATE ", said), said
    assert f"{plant / 'krl' / 'literal.j2'}:3: " in said or "recursion" in words or "endfor" in words


def test_a_template_in_another_code_page_is_named(tmp_path):
    plant = laid(tmp_path, "krl/literal.j2", "")
    (plant / "krl" / "literal.j2").write_bytes(b"\xff\xfe<")
    refused(tmp_path, krl(), plant, f"{plant / 'krl' / 'literal.j2'}: BAD_TEMPLATE")


def test_a_template_that_is_broken_is_said_though_nothing_needs_it(tmp_path):
    plant = laid(tmp_path, "rapid/header.j2", "\n\n<% endif %>")
    refused(tmp_path, krl(), plant, f"{plant / 'rapid' / 'header.j2'}:3: BAD_TEMPLATE")


@pytest.mark.parametrize(
    "reach",
    [
        "<< ''.__class__ >>",
        "<< fields.__class__.__mro__ >>",
        "<< fields[0].style.__init__.__globals__ >>",
        "<< fields[0].value.__class__.__base__.__subclasses__() >>",
        "<< ('%s' | format(1)).__class__ >>",
        "<< self.__init__.__globals__ >>",
        "<% set _ = fields.clear() %>",
        "<< '{0.__class__}'.format(tail) >>",
        "<% include '/etc/hostname' %>",
        "<% include '../../cal.json' %>",
    ],
)
def test_a_plants_template_reaches_nothing_but_what_it_is_to_write(tmp_path, reach):
    plant = laid(tmp_path, "krl/literal.j2", f"{reach}{shipped('krl/literal.j2')}")
    said = refused(tmp_path, krl(), plant, f"{plant / 'krl' / 'literal.j2'}:1: BAD_TEMPLATE")
    assert "unsafe" in said or "not found" in said


# ----------------------------------------------------------------------------------------------------------------- proof


LITERAL = "<%- for field in fields -%>\n{}\n<%- endfor -%>\n{}"
WRONG = {
    "extra line": LITERAL.format("<< field.gap >><< field.value | spell(field.style) >>", "<< tail >>\n;extra"),
    "extra motion": LITERAL.format("<< field.gap >><< field.value | spell(field.style) >>", "<< tail >>\nLIN P9"),
    "other gaps": LITERAL.format(
        "<< field.gap | replace(',', ' , ') >><< field.value | spell(field.style) >>", "<< tail >>"
    ),
    "lost number": LITERAL.format(
        "<% if not loop.first %><< field.gap >><< field.value | spell(field.style) >><% endif %>", "<< tail >>"
    ),
    "lost digits": LITERAL.format("<< field.gap >><< '%.1f' | format(field.value) >>", "<< tail >>"),
    "wrong sign": LITERAL.format("<< field.gap >><< -field.value | spell(field.style) >>", "<< tail >>"),
    "lost tail": LITERAL.format("<< field.gap >><< field.value | spell(field.style) >>", ""),
    "nothing": "",
}


@pytest.mark.parametrize("wrong", WRONG)
@pytest.mark.parametrize(
    ("files", "language", "program"),
    [(krl(), "krl", "KRC/R1/Program/weld.dat"), (rapid(), "rapid", "RAPID/TASK1/PROGMOD/Weld.mod")],
    ids=["krl", "rapid"],
)
def test_what_a_template_gets_wrong_is_seen_before_anything_is_written(tmp_path, files, language, program, wrong):
    plant = laid(tmp_path, f"{language}/literal.j2", WRONG[wrong])
    said = refused(tmp_path, files, plant, str(plant / language / "literal.j2"), "Nothing was written")
    (first,) = re.findall(r"^error: (.*?): BAD_TEMPLATE", said)
    path, _, line = first.partition(":")
    assert path == program
    if line:  # it is the line of the first spot, or the one below it
        text = (tmp_path / "backup" / program).read_text(encoding="latin-1").splitlines()
        (spot,) = [number for number, each in enumerate(text, 1) if re.search(r"\bX?S1(=|:=)", each)]
        assert spot <= int(line) <= spot + 4  # three lines of header lie above it
    assert line or wrong in ("lost number", "lost tail", "nothing", "extra motion")


def test_in_place_a_wrong_template_changes_nothing(tmp_path):
    assert convert(tmp_path, krl(), name="once").code == 0
    before = state(tmp_path / "backup")
    plant = laid(tmp_path, "krl/literal.j2", WRONG["wrong sign"])
    arguments = ["convert", str(tmp_path / "backup"), "-c", str(tmp_path / "once.json"), "--templates", str(plant)]
    result = CliRunner().invoke(app, [*arguments, "--in-place"])
    assert (result.exit_code, "BAD_TEMPLATE" in result.stderr) == (2, True)
    assert state(tmp_path / "backup") == before


def test_a_wrong_template_of_added_components_is_seen(tmp_path):
    assert "{Y 99.875,X -4.998}" in convert(tmp_path, krl(RELATIVE), name="ours").text("weld.src")
    for wrong, words in (
        ("<< literal[:-1] >>}", "lacks x"),
        (shipped("krl/complete.j2").rstrip() + "\nHALT", "differs outside"),
        (shipped("krl/complete.j2").replace("value |", "-value |"), "was intended"),
    ):
        plant = laid(tmp_path, "krl/complete.j2", wrong)
        refused(tmp_path, krl(RELATIVE), plant, str(plant / "krl" / "complete.j2"), "weld.src:", words)


@pytest.mark.parametrize("wrong", ["wrong sign", "lost number", "lost digits", "other gaps", "extra line"])
@pytest.mark.parametrize(("files", "language"), [(krl(), "krl"), (rapid(), "rapid")], ids=["krl", "rapid"])
def test_a_wrong_template_of_a_frame_is_seen(tmp_path, files, language, wrong):
    ours = convert(tmp_path, files, "--apply", "frames", name="ours")
    assert {edit["depth"] for edit in ours.record["edits"]} == {"base"}
    plant = laid(tmp_path, f"{language}/frame.j2", WRONG[wrong])
    made = convert(tmp_path, files, "--apply", "frames", "--templates", str(plant))
    assert (made.code, "BAD_TEMPLATE" in made.err, "frame.j2" in made.err) == (2, True, True), made.err
    assert not made.folder.exists()


@pytest.mark.parametrize(
    ("header", "words"),
    [
        ("", "has no line ';respot: "),
        ("; changed by respot\n", "must begin with ';respot: '"),
        ("{shipped}LIN P9\n", "'LIN P9'"),
        ("!respot: in the comment of the other language\n{shipped}", "'!respot: in"),
        ("{shipped}\n\n\n", "the line ''"),
        (";respot: << header.version >> << header.direction >> << header.kind >>\n", "applied twice"),
        (
            ";respot: << header.version >> << header.direction >> << header.kind >>\n"
            ";respot: calibration sha256 << header.calibration_sha256 >>\n",
            "source sha256",
        ),
        ("{shipped};respot: earlier calibration sha256 " + "0" * 64 + "\n", "applied twice"),
        ("{shipped};respot: f\u00fcr Linie 2\n", "plain ASCII"),
    ],
)
def test_a_header_that_would_not_be_found_again_is_refused(tmp_path, header, words):
    plant = laid(tmp_path, "krl/header.j2", header.replace("{shipped}", shipped_header("krl")))
    refused(tmp_path, krl(), plant, f"{plant / 'krl' / 'header.j2'}: BAD_TEMPLATE", words)


# ------------------------------------------------------------------------------------------------ program text is data


ORDERS = ("<< 7*7 >>", "<% for %>", "<# #>", "{{ 7*7 }}", "<< header.__class__ >>")


def test_text_of_a_krl_program_reaches_a_template_as_data_only(tmp_path):
    comments = "".join(f";{text}\n" for text in ORDERS)
    body = comments + "".join(f'MsgNotify("{text}")\n' for text in ORDERS)
    data = f'CHAR text[40]="{ORDERS[0]}"\nDECL E6POS XP9={{X 1.0, Y 2.0 ,  Z 3.0,A 0.0,B 0.0,C 0.0}} ;{ORDERS[1]}\n'
    made = convert(tmp_path, krl(comments + body + lin("S1", "XP9"), data), name="<< 7*7 >>")
    assert made.code == 0, made.err
    for name in ("weld.src", "weld.dat"):
        old = (tmp_path / "backup" / "KRC" / "R1" / "Program" / name).read_text(encoding="latin-1")
        for text in ORDERS:
            assert made.text(name).count(text) == old.count(text)
        assert "49" not in made.text(name).replace("sha256", "") or "49" in old
    assert re.search(r"XP9=\{X \S+, Y \S+ ,  Z \S+,A", made.text("weld.dat"))


def test_a_comment_inside_a_rapid_literal_reaches_a_template_as_data_only(tmp_path):
    inner = "".join(f" ! {text}\n" for text in ORDERS)
    literal = f"[[10.0,{inner}  20.0,30.0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"
    made = convert(
        tmp_path,
        rapid("    MoveL P9,v800,z50,tGun\\WObj:=wDoor;\n", f"  CONST robtarget P9:={literal};\n"),
    )
    assert made.code == 0, made.err
    assert "P9" in made.edited()
    assert inner.replace("\n", "\r\n") in made.text("Weld.mod")


# ---------------------------------------------------------------------------------------------------------------- header


@pytest.mark.parametrize("language", ["krl", "rapid"])
@pytest.mark.parametrize(
    ("direction", "kind"), [("align", "theory"), ("compensate", "measured"), ("compensate", "theory")]
)
def test_the_header_says_version_hashes_kind_direction_and_cell_and_no_time(language, direction, kind):
    header = Header("1.2.3", direction, kind, "a" * 64, "b" * 64, ("c" * 64, "d" * 64))
    text = Templates(language).header(header, "\r\n")
    assert text == (GOLDEN / f"{language}_{direction}_{kind}.txt").read_text().replace("\n", "\r\n")
    assert applied_calibrations(SourceText("a", text.encode())) == {"b" * 64, "c" * 64, "d" * 64}


@pytest.mark.parametrize("language", ["krl", "rapid"])
@pytest.mark.parametrize(
    ("header", "template"),
    [
        (("align", "theory", True), "respot: << header.version >> << header.direction >> << header.kind >>"),
        (("align", "theory", False), "respot: << header.version >> << header.direction >> << header.kind >> snapped"),
        (("align", "theory", False), "{0}\n{1}respot: 1 compensate measured"),
        (("compensate", "measured", False), "respot: << header.version >> compensated << header.kind >>"),
        (("compensate", "theory", False), "respot: << header.version >> << header.direction >> measured"),
    ],
)
def test_a_header_that_says_something_else_than_what_was_done_is_refused(tmp_path, language, header, template):
    mark = COMMENT_MARKS[language]
    own = shipped_header(language)
    first = own.splitlines()[0].strip().removeprefix(mark)
    wrong = own.replace(own.partition("<%- if")[0], f"{mark}{template.format(first, mark)}\n", 1)
    plant = laid(tmp_path, f"{language}/header.j2", wrong)
    direction, kind, snapped = header
    made = Header("1.2.3", direction, kind, "a" * 64, "b" * 64, (), snapped)
    assert Templates(language).header(made, "\n").count("snapped") == snapped
    with pytest.raises(BadInputError, match="which says what was done"):
        Templates(language, plant).header(made, "\n")


@pytest.mark.parametrize(("files", "program"), [(krl(), "weld.dat"), (rapid(), "Weld.mod")], ids=["krl", "rapid"])
def test_the_header_of_a_file_names_what_was_applied_to_which_bytes(tmp_path, files, program):
    made = convert(tmp_path, files)
    lines = [line.strip() for line in made.text(program).splitlines() if "respot: " in line]
    record = json.loads((made.folder / "respot.json").read_text())
    (path,) = [path for path in record["files"] if path.endswith(program)]
    assert lines[0][1:] == f"respot: {record['version']} align theory, for the cell as simulated; " + (
        "the real old cell must never load this file"
    )
    assert [line[1:] for line in lines[1:]] == [
        f"respot: source sha256 {record['files'][path]['before']}",
        f"respot: calibration sha256 {record['applied'][0].strip()}",
    ]
    assert convert(tmp_path, files, name="later").text(program) == made.text(program)
