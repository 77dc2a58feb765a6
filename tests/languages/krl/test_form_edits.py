"""A field of an inline form of KRL changes in all its copies or, with a reason, in none."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

import pytest
from hypothesis import given
from hypothesis import strategies as st

from respot.issues import BadInputError
from respot.program.forms import Form
from tests.languages.krl.inline_forms import EXPECTED, change, form_at, load, sources_of, swap


def refusal(files: Mapping[str, bytes], form: Form, field: str, value: str) -> str:
    with pytest.raises(BadInputError) as caught:
        form.edits(field, value, sources_of(files))
    issue = caught.value.issue
    assert (issue.code, issue.path, issue.line) == ("FORM_NOT_CHANGED", form.path, form.line)
    return issue.message


#: Fields that cannot be changed: their data are $config.dat's, which is not there, or in another module.
REFUSED = {
    ("basis", 28, "point"), ("basis", 28, "data"), ("bmw", 22, "spot"), ("bmw", 22, "type_id"),
}  # fmt: skip
NEW = {"on": "off", "off": "on"}
NUMBERS = {
    "velocity", "tool", "base", "gun", "gun_open", "program", "program_2", "pressure", "pressure_2", "close_time",
    "offset", "spot", "type_id", "nut_data",
}  # fmt: skip


def fields() -> list[tuple[str, int, str]]:
    return [(module, line, name) for module, forms in EXPECTED.items() for _, line, known in forms for name in known]


def new_value(form: Form, field: str) -> str:
    if field in NUMBERS:
        return "63"
    return NEW.get(form.value(field) or "", "Q5A")


def without(files: Mapping[str, bytes], form: Form, field: str) -> dict[str, str]:
    """The files without the copies of a field and without what is only suggested."""
    texts = {path: source.text for path, source in sources_of(files).items()}
    copies = [*form.fields[field], *form.contents.suggestions.get(field, ())]
    for path, (start, end) in sorted({(copy.path, copy.span) for copy in copies}, reverse=True):
        texts[path] = texts[path][:start] + "<>" + texts[path][end:]
    return texts


@pytest.mark.parametrize(("module", "line", "field"), fields())
def test_a_change_reaches_every_copy_and_nothing_else(module, line, field):
    files = load(module)
    form = form_at(files, line)
    value = new_value(form, field)
    if field in form.fixed:
        assert "cannot be changed by itself" in refusal(files, form, field, value)
        return
    if (module, line, field) in REFUSED:
        assert "another module" in (message := refusal(files, form, field, value)) or "not declared" in message
        return
    changed = change(files, form, field, value)
    again = form_at(changed, line)
    assert changed != files
    assert again.value(field) == value
    assert {copy.value for copy in again.fields[field]} == {value}
    assert Counter(c.region for c in again.fields[field]) == Counter(c.region for c in form.fields[field])
    assert not again.disagreements()
    assert without(changed, again, field) == without(files, form, field)
    back = change(changed, again, field, form.value(field))
    assert back == files


def test_a_renamed_point_and_nothing_but_it():
    files = load("basis")
    found = change(files, form_at(files, 15), "point", "DoorLeft")
    text, data = files["basis.src"].decode("cp1252"), files["basis.dat"].decode("cp1252")
    for old in ("LIN P2  Vel=", "2:P2, 3:, 5:0.5", "FDAT_ACT=FP2\r", "LIN  XP2 ; XP1 C_DIS"):
        assert text.count(old) == 1
        text = text.replace(old, old.replace("P2", "DoorLeft"))
    for old in ("E6POS XP2=", "FDAT FP2="):
        assert data.count(old) == 1
        data = data.replace(old, old.replace("P2", "DoorLeft"))
    # the pendant proposed P2 for the next form: 24 characters with its blanks
    old, new = '"P2' + 22 * " " + '"', '"DoorLeft' + 16 * " " + '"'
    assert data.count(old) == 2
    data = data.replace(old, new)
    assert found == {"basis.src": text.encode("cp1252"), "basis.dat": data.encode("cp1252")}


def test_suggestions_that_hold_another_name_stay():
    files = load("basis")
    found = change(files, form_at(files, 8), "point", "DoorLeft")
    assert found["basis.dat"].count(b'"P2' + 22 * b" ") == 2
    assert b"DoorLeft " not in found["basis.dat"]


def test_blending_follows_the_version_of_the_controller():
    old = change(files := load("krc2"), form_at(files, 3), "blend", "on")["krc2.src"]
    assert b"PTP P7 CONT  Vel= 100 %" in old
    assert b" 3:C_PTP, 5:100" in old
    assert b"PTP XP7 C_PTP\n" in old
    new = change(files := load("basis"), form_at(files, 15), "blend", "on")["basis.src"]
    assert b"LIN P2 CONT  Vel= 0.5 m/s" in new
    assert b" 3:C_DIS C_DIS, 5:0.5" in new
    assert b"LIN  XP2 C_DIS C_DIS ; XP1 C_DIS" in new


def test_each_copy_keeps_its_own_spelling_of_a_number():
    files = load("params")
    found = change(files, form_at(files, 2), "velocity", "0.75")["params.src"]
    assert b" Vel=0.75 m/s " in found
    assert b"Kuka.VelocityPath=0.75;" in found
    assert b"BAS(#CP_PARAMS, 0.75)" in found
    files = load("spottech")
    assert b"PRESS1 3.50000," in change(files, form_at(files, 2), "pressure", "3.5")["spottech.dat"]


def test_a_copy_that_has_the_value_already_keeps_its_spelling():
    files = swap(load("basis"), "basis.src", "5:80,", "5:80.0,")
    files = swap(files, "basis.src", "PTP P1 CONT Vel=80 %", "PTP P1 CONT Vel=60 %")
    found = change(files, form_at(files, 8), "velocity", "80")
    assert found == swap(files, "basis.src", "PTP P1 CONT Vel=60 %", "PTP P1 CONT Vel=80 %")


def test_suggestions_of_another_module_stay():
    config = b'DEFDAT $CONFIG\r\nDECL BASIS_SUGG_T LAST_BASIS={POINT1[] "P7"}\r\nENDDAT\r\n'
    files = {**load("krc2"), "$config.dat": config}
    assert change(files, form_at(files, 3), "point", "P77")["$config.dat"] == config


def test_a_spot_number_changes_in_every_name_made_of_it():
    files = load("bmw")
    found = change(files, form_at(files, 12), "spot", "40712")
    assert found == {path: data.replace(b"40711", b"40712") for path, data in files.items()}


def test_no_edit_where_every_copy_has_the_value():
    files = load("basis")
    assert form_at(files, 8).edits("velocity", "80.0", sources_of(files)) == {}
    assert form_at(files, 8).edits("point", "P1", sources_of(files)) == {}


ALL = [(module, line, name) for module, line, name in fields() if (module, line, name) not in REFUSED]
NAMES = st.from_regex(r"[A-Za-z][A-Za-z0-9_]{1,18}", fullmatch=True).filter(lambda name: name.upper() not in ("ON",))


@given(st.sampled_from(ALL), NAMES, st.integers(1, 999).map(str))
def test_a_field_changed_and_changed_back_gives_the_same_bytes(place, name, number):
    module, line, field = place
    files = load(module)
    form = form_at(files, line)
    value = number if field in NUMBERS else NEW.get(form.value(field) or "", name)
    try:
        changed = change(files, form, field, value)
    except BadInputError as error:
        assert error.issue.code == "FORM_NOT_CHANGED"
        return
    again = form_at(changed, line)
    assert again.value(field) == value
    assert change(changed, again, field, form.value(field) or "") == files


# refusals ---------------------------------------------------------------------------------------------------------------


def test_a_name_with_its_prefix_has_at_most_24_characters():
    files = load("basis")
    form = form_at(files, 8)
    assert "24 characters" not in str(change(files, form, "point", "A" * 23))
    assert f"X{'A' * 24} has 25 characters" in refusal(files, form, "point", "A" * 24)


def test_a_point_of_two_forms_is_not_renamed_and_its_tool_stays():
    text = load("basis")["basis.src"].decode("cp1252")
    first = text[text.index(";FOLD PTP P1") : text.index("  ; FOLD LIN P2")]
    files = swap(load("basis"), "basis.src", first, first + first)
    form = form_at(files, 8)
    assert "FP1 is used elsewhere too (basis.src:18)" in refusal(files, form, "point", "P77")
    assert "FP1 is used elsewhere too (basis.src:18)" in refusal(files, form, "tool", "5")
    assert form.edits("velocity", "70", sources_of(files))


def test_a_point_in_code_written_by_hand_is_not_renamed():
    files = swap(load("basis"), "basis.src", "\r\nEND\r\n", "\r\nxp1.Z = xp1.Z+5\r\nEND\r\n")
    assert "xp1 is used elsewhere too (basis.src:35)" in refusal(files, form_at(files, 8), "point", "P77")


def test_a_name_in_a_comment_is_no_use():
    files = swap(load("basis"), "basis.src", "\r\nEND\r\n", "\r\n;PTP XP1\r\nEND\r\n")
    assert form_at(files, 8).edits("point", "P77", sources_of(files))


def test_a_local_name_of_another_module_is_another_datum():
    other = b"DEF other ( )\r\nPTP XP1\r\nEND\r\n"
    files = {**load("basis"), "other.src": other}
    assert change(files, form_at(files, 8), "point", "P77")["other.src"] == other


def test_a_global_point_of_another_module_is_not_renamed():
    files = load("bmw")
    assert "Xrvt50321_1 is declared in another module (bmw_global.dat:2)" in refusal(
        files, form_at(files, 22), "spot", "50322"
    )


def test_a_global_point_of_the_own_module_is_renamed_only_if_no_other_module_uses_it():
    files = swap(load("basis"), "basis.dat", "DEFDAT basis", "DEFDAT basis PUBLIC")
    files = swap(files, "basis.dat", "DECL E6POS XP1=", "DECL GLOBAL E6POS XP1=")
    assert form_at(files, 8).edits("point", "P77", sources_of(files))
    files["other.src"] = b"DEF other ( )\r\nPTP XP1\r\nEND\r\n"
    assert "XP1 is used elsewhere too (other.src:2)" in refusal(files, form_at(files, 8), "point", "P77")


def test_a_name_that_is_taken_is_refused():
    files = load("basis")
    assert "the name XP4 is taken already (basis.dat:11)" in refusal(files, form_at(files, 8), "point", "P4")


def test_data_that_nobody_declared_are_not_renamed():
    files = {"basis.src": load("basis")["basis.src"]}
    assert "XP1, FP1 holds point too and is not declared" in refusal(files, form_at(files, 8), "point", "P77")
    assert "FP1 holds tool too" in refusal(files, form_at(files, 8), "tool", "5")


def test_a_velocity_from_a_variable_is_not_overwritten():
    files = swap(load("basis"), "basis.src", "BAS(#PTP_PARAMS,80)", "BAS(#PTP_PARAMS,rSpeed)")
    form = form_at(files, 8)
    assert form.value("velocity") == "80"
    assert not form.disagreements()
    assert "BAS(#PTP_PARAMS,rSpeed) in the body (basis.src:12) is no number" in refusal(files, form, "velocity", "70")


@pytest.mark.parametrize(
    ("field", "value", "why"),
    [
        ("force", "3", "the form has no field force; it has motion, point"),
        ("motion", "LIN", "motion cannot be changed by itself"),
        ("blend", "C_DIS", "blend is either on or off, not 'C_DIS'"),
        ("tool", "Gun", "tool is a number; 'Gun' is none"),
        ("point", "P 1", "'P 1'"),
        ("point", "", "''"),
        ("point", "P\n1", "does not fit on one line"),
        ("tool_name", "Gun]", "cannot hold 'Gun]'"),
        ("tool_name", "Пистолет", "cannot hold 'Пистолет' in its code page cp1252"),
    ],
)
def test_a_value_that_does_not_fit_is_refused(field, value, why):
    files = load("basis")
    assert why in refusal(files, form_at(files, 8), field, value)


def test_a_file_that_changed_since_is_refused():
    files = load("basis")
    form = form_at(files, 8)
    assert "was changed since the form was read" in refusal(
        swap(files, "basis.src", "DEF basis", "DEF the_basis"), form, "velocity", "70"
    )
    assert "basis.dat is not among the files" in refusal({"basis.src": files["basis.src"]}, form, "tool", "5")
