from __future__ import annotations

import pytest

from respot.figures.verdict import verdict
from respot.figures.words import (
    EFFECTS,
    chance,
    effect_noun,
    figure,
    finding,
    in_plain_words,
    listing,
    place,
    sentence,
    separation,
    size,
    value_text,
)

CATALOGUE = (
    "swapped_ids",
    "convention",
    "tool_offset",
    "scale",
    "joint_zero",
    "joint_profile",
    "gear",
    "link_length",
    "link_geometry",
    "gravity_sag",
    "gun_sag",
    "gun_deflection",
    "backlash",
    "readback_lag",
    "drift",
    "warmup",
    "tip_wear",
    "group_shift",
    "rail",
    "covariate",
    "deformation",
    "unexplained",
)


@pytest.mark.parametrize(
    ("where", "words"),
    [
        ({}, ""),
        ({"axis": 3}, "axis 3"),
        ({"axis": [2, 3]}, "axes 2 and 3"),
        ({"column": "station", "level": "S2"}, "station S2"),
        ({"column": "temperature_c"}, "column temperature_c"),
        ({"ids": ["A", "B", "C"]}, "spots A, B and C"),
        ({"ids": ["A"]}, "spot A"),
        ({"parameter": "a2"}, "arm length a2"),
        ({"parameter": "tau"}, "parameter tau"),
        ({"external_axis": 1}, "external axis 1"),
        ({"frame": "tool"}, "tool frame"),
        ({"link": 4, "new_key": "x"}, "link 4, new key x"),
        (
            {"column": "program", "level": "w", "frame": "base", "written": "B[3]", "real": "B[4]"},
            "program w, B[4] in the place of B[3]",
        ),
        ({"frame": "uframe", "written": "w3", "real": "w4"}, "the user frame of w4 in the place of that of w3"),
    ],
)
def test_places(where, words):
    assert place(where) == words


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_effect_of_the_catalogue_has_words(name):
    assert name in EFFECTS
    for where in ({}, {"axis": 2}):
        for parameters in ({}, {"a": {"value": 0.5, "unit": "mm", "ci95": None}}):
            said = finding({"name": name, "where": where, "parameters": parameters})
            assert "{" not in said
            assert "  " not in said
            assert "_" not in said
            assert "{" not in effect_noun(name, where)


def test_an_unknown_effect_stays_readable():
    assert effect_noun("moon_phase", {"axis": 1}) == "moon phase (axis 1)"
    assert finding({"name": "moon_phase", "where": {}}) == "the spots follow moon phase"
    assert effect_noun("names right, spots displaced") == "names right, spots displaced"
    assert in_plain_words("joint_zero beats temperature_c") == "mastering of an axis beats temperature_c"


@pytest.mark.parametrize(
    ("label", "words"),
    [
        ("joint_zero axis 3", "mastering of axis 3"),
        ("gear axis 4", "gear error of axis 4"),
        ("group_shift column station level S 2", "a shift of station S 2 as a body"),
        ("gravity_sag axes 2, 3", "sag of axes 2, 3 under weight"),
        ("link_length parameter a2", "arm length a2"),
        ("rail external_axis 1", "error along external axis 1"),
        (
            "wrong_frame column program level w frame base written B[3] real B[4]",
            "a wrong frame (tool or base): program w, B[4] in the place of B[3]",
        ),
        ("scale", "growth or shrinkage (scale)"),
        ("rigid transform alone", "rigid transform alone"),
        ("scale of the drawing", "scale of the drawing"),
    ],
)
def test_labels_of_rivals(label, words):
    assert effect_noun(label) == words


def test_groups_without_a_level():
    said = finding({"name": "group_shift", "where": {"column": "station"}})
    assert said == "the groups of column station are shifted against each other"


def test_sizes():
    one = {"offset": {"value": -0.12, "unit": "deg"}}
    assert size(one) == "0.12 degrees"
    assert (
        finding({"name": "joint_zero", "where": {"axis": 3}, "parameters": one})
        == "axis 3 is mastered 0.12 degrees off"
    )
    three = {name: {"value": value, "unit": "mm"} for name, value in (("dx", 3.0), ("dy", 4.0), ("dz", 0.0))}
    assert size(three) == "5.00 mm"
    assert size({"gain": {"value": 1.0, "unit": "mm"}, "phase": {"value": 2.0, "unit": "degrees"}}) == ""
    assert size({"x": {"value": None, "unit": "mm"}}) == ""


@pytest.mark.parametrize(
    ("p_value", "words"),
    [
        (None, "not computed"),
        (0.0, "less than 1 in 1,000"),
        (0.001, "1 in 1,000"),
        (0.0074, "7 in 1,000"),
        (0.01, "1 in 100"),
        (0.05, "5 in 100"),
        (0.3, "3 in 10"),
        (1.0, "nearly always"),
    ],
)
def test_chances(p_value, words):
    assert chance(p_value) == words


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((0.1204, [0.1073, 0.1335], "degrees"), "0.120 +- 0.013 degrees"),
        ((0.5, [0.1, 1.6], ""), "0.50 (0.10 to 1.60)"),
        ((12.0, None, "mm"), "12.00 mm"),
        ((12.0, [None, 13.0], "mm"), "12.00 mm"),
        ((None, None, "mm"), "not determined by these spots"),
        ((0.2, [0.2, 0.2], "mm"), "0.20 +- 0.00 mm"),
    ],
)
def test_values(arguments, words):
    assert value_text(*arguments) == words


def test_figures():
    assert [figure(value) for value in (1234.56, 76.391, 0.1904, 0.08, 0.0, None, float("nan"))] == [
        "1234.6",
        "76.39",
        "0.19",
        "0.080",
        "0.00",
        "-",
        "-",
    ]
    assert figure(-0.001, 2) == "0.00"


def test_lists_and_sentences():
    assert [listing(names) for names in ([], ["A"], ["A", "B"], ["A", "B", "C"])] == ["", "A", "A and B", "A, B and C"]
    assert listing("ABCDEFGH", most=3) == "A, B and 6 more"
    assert [sentence(text) for text in ("", "a b", "done!")] == ["", "A b.", "Done!"]


def test_how_sure_a_cause_is():
    assert "named" in separation({"named": True, "not_separated_from": ["scale"]})
    assert separation({"named": False, "not_separated_from": ["joint_zero", "drift"]}) == (
        "Not separated from mastering of an axis or drift with time: those would fit as well."
    )
    assert "no other cause" in separation({"named": False})


def test_advice_checks_first_what_is_not_proved(records):
    record = records.everything()
    record["effects"] = record["effects"][1:2]
    short = verdict(record)
    assert short.headline == "Axis 3 is mastered 0.12 degrees off."
    assert short.advice == "Check the cause first, it is not proved; then put the robot right."
    assert short.error.startswith("With this in the model the error of spots that took no part falls from 1.51 to 0.21")
    assert not short.causes[0].named
