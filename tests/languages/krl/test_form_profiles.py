"""Profiles of KRL: a plant adds its own forms, and where weld calls and spot numbers stand."""

from __future__ import annotations

import pytest

from respot.issues import BadInputError
from respot.languages.krl.forms import FORMS
from respot.languages.profile_file import read_profile
from respot.program.moves import Label, LabelKind
from tests.languages.krl.inline_forms import change, read, src

PTP = ";FOLD PTP P1 Vel=100 % PDAT1 Tool[1] Base[1];%{PE}%R 8.3.29,%MKUKATPBASIS,%CMOVE,%VPTP,%P 1:PTP, 2:P1, 3:, 5:100, 7:PDAT1\n"
# profiles ---------------------------------------------------------------------------------------------------------------

PLANT = r"""
language = "krl"
title = "A plant's glue gun"

[[form]]
title = '^GLUE\b'
numbers = ["amount"]

[[form.copy]]
in = "title"
pattern = '^GLUE (?P<point>\w+)'

[[form.copy]]
in = "title"
pattern = '\bAmount (?P<amount>[\d.]+)'

[[form.copy]]
in = "body"
pattern = '^Glue_On\((?P<amount>[^)]*)\)'
"""
GLUE = ";FOLD GLUE P1 Amount 12.5 ml\nLIN XP1\nGlue_On(12.50)\n;ENDFOLD"


def test_a_plant_adds_a_dialect(tmp_path):
    (tmp_path / "glue.toml").write_text(PLANT, encoding="utf-8")
    profiles = FORMS.with_plant([read_profile(tmp_path / "glue.toml")])
    files = src(GLUE)
    assert read(files) == []
    [form] = read(files, profiles)
    assert (form.profile, form.value("point"), form.value("amount")) == ("glue", "P1", "12.5")
    assert form.disagreements() == []
    changed = change(files, form, "amount", "8")
    assert changed == src(GLUE.replace("12.50", "8.00").replace("12.5", "8"))
    assert [form.value("amount") for form in read(changed, profiles)] == ["8"]


def test_the_plant_is_asked_first(tmp_path):
    (tmp_path / "own.toml").write_text(PLANT.replace("^GLUE", "^PTP"), encoding="utf-8")
    profiles = FORMS.with_plant([read_profile(tmp_path / "own.toml")])
    [form] = read(src(PTP + "PTP XP1\n;ENDFOLD"), profiles)
    assert form.profile == "own"


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ("(?P<point>", "(", "form 1, copy 1: the pattern names no field"),
        ('in = "body"', 'in = "head"', "form 1, copy 3: in is 'head'; it must be one of title, tail, params, body, data"),
        ('in = "body"', 'in = "data"', "form 1, copy 3: a copy in data, and only such a copy, needs the name"),
        ('in = "body"', 'in = "body"\nname = "F{point}"', "a copy in data, and only such a copy, needs the name"),
        ('in = "body"', 'in = "data"\nname = "F{point"', "the name 'F{point' is not well formed"),
        ('in = "body"', 'in = "data"\nname = "F{0.real}"', "needs names of fields in its braces"),
        ('in = "body"', 'in = "body"\nno = "False"', "a copy with a text for no needs one for yes"),
        ('in = "body"', 'in = "body"\ndecimals = "2"', "form 1, copy 3: decimals must be a whole number"),
        ('in = "body"', 'in = "body"\nwhere = "x"', "form 1, copy 3 has the unknown key where; it may have decimals, in"),
        ("[[form.copy]]", "[form.copy]", "is no TOML"),
        ("'^GLUE\\b'", "'^GLUE('", "form 1: '^GLUE(' is no regular expression"),
        ("numbers =", "common = 1\nnumbers =", "form 1: common must be true or false"),
        ('language = "krl"', 'language = "karel"', "language is 'karel'; it must be one of krl, rapid"),
    ],
)  # fmt: skip
def test_a_profile_that_cannot_be_used_says_why(tmp_path, old, new, why):
    assert old in PLANT
    path = tmp_path / "glue.toml"
    path.write_text(PLANT.replace(old, new), encoding="utf-8")
    with pytest.raises(BadInputError) as caught:
        read_profile(path)
    assert caught.value.issue.code == "BAD_PROFILE"
    assert caught.value.issue.path == str(path)
    assert why in caught.value.issue.message


# spots ------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("call", "arguments", "welds"),
    [
        ("USERSPOT", ["#SPOT", "S_ACT"], True),
        ("UserSpot", [" #spot ", "S_ACT"], True),
        ("USERSPOT", ["#ADVSPOT", "S_ACT"], False),
        ("USERSPOT", [], False),
        ("Swp_Exe", ["1", "22", "40711", "180"], True),
        ("SPOT_EXE", ["1", "22", "40711"], True),
        ("Rvt_Exe", ["2", "1", "50321", "128", "1", "0"], True),
        ("Rvt_Pre", ["2", "1", "50321", "1", "0", "0"], False),
        ("VW_USR_R", ["#USR_MAIN", "101", "1"], True),
        ("VW_USR_R", ["#USR_MAIN", " 199 ", "1"], True),
        ("VW_USR_R", ["#USR_MAIN", "307", "1"], False),
        ("VW_USR_R", ["#USR_MAIN", "100", "1"], False),
        ("VW_USR_R", ["#USR_ADV", "101", "1"], False),
        ("VW_USER", ["#USR_MAIN", "101", "1"], False),
    ],
)
def test_calls_that_weld(call, arguments, welds):
    assert FORMS.welds(call, arguments) is welds


@pytest.mark.parametrize(
    ("kind", "text", "spot", "weld"),
    [
        (LabelKind.NAME, "Xswp40711_22", "40711", True),
        (LabelKind.NAME, "XLSP40711_22", "40711", True),
        (LabelKind.NAME, "Xrvt50321_1", "50321", True),
        (LabelKind.NAME, "XPNW1", "PNW1", True),
        (LabelKind.NAME, "XP02WP1", "P02WP1", False),
        (LabelKind.TITLE, "Swp Spotpoint PTP TypeId:22 SpotNo:40711 GunNo:1", "40711", True),
        (LabelKind.TITLE, "Rvt Rivet PTP TypId:1 RivetNo:50321 GunNo:2", "50321", True),
        (LabelKind.PARAMS, ";Params IlfProvider=x; Swp_SpotNo=40711; Swp_TypeId=22", "40711", True),
        (LabelKind.PARAMS, ";Params Rvt_RivetNo=50321; Rvt_TypId=1", "50321", True),
        (LabelKind.PARAMS, "1: TECH1 Punktschweissen S-Punkt=10067 Techaufruf=EIN", "10067", True),
        (LabelKind.ARGUMENT, "1,22,40711,180,1,0", "40711", False),
        (LabelKind.ARGUMENT, "Rvt_Exe (2,1,50321,128,1,0)", "50321", False),
    ],
)
def test_where_a_spot_number_stands(kind, text, spot, weld):
    assert FORMS.spot_ids([Label(kind, text)]) in (
        ((spot,), weld),
        ((spot, text), weld),
        ((spot, text[1:], text), weld),
    )
