"""One table has one decimal sign: what is read is what was meant, or the table is refused."""

from __future__ import annotations

import csv

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from respot.issues import BadInputError
from respot.tables import read_table


def table_of(tmp_path, cells, delimiter=";", note=""):
    path = tmp_path / "t.csv"
    with path.open("w", newline="", encoding="utf-8") as file:
        file.write(note)
        writer = csv.writer(file, delimiter=delimiter, lineterminator="\n")
        writer.writerow(["id", "x", "y", "z"])
        writer.writerows([f"S{row}", *cells[3 * row : 3 * row + 3]] for row in range(len(cells) // 3))
    return path


def values_of(*arguments, **options):
    return read_table(table_of(*arguments, **options)).positions.ravel().tolist()


DECIDED = {
    "decimal_comma_by_one_cell": (["1,234", "0,5", "12"], [1.234, 0.5, 12.0]),
    "decimal_point_by_one_cell": (["1.234", "0.5", "12"], [1.234, 0.5, 12.0]),
    "a_zero_before_groups_nothing": (["1.234", "0.567", "-12.345"], [1.234, 0.567, -12.345]),
    "four_digits_are_not_grouped": (["1234.567", "123.456", "1.234"], [1234.567, 123.456, 1.234]),
    "a_bare_whole_number_of_four_digits": (["1,234", "1500", "12"], [1.234, 1500.0, 12.0]),
    "thousands_proven_by_both_signs": (["1,234.5", "1,234", "12"], [1234.5, 1234.0, 12.0]),
    "german_thousands_proven": (["1.234,5", "1.234", "12"], [1234.5, 1234.0, 12.0]),
    "millions_prove_thousands": (["1,234,567", "1,234", "12"], [1234567.0, 1234.0, 12.0]),
    "an_exponent_groups_nothing": (["1,234E3", "1,234", "12"], [1234.0, 1.234, 12.0]),
    "whole_numbers": (["1234", "-5", "12"], [1234.0, -5.0, 12.0]),
    "no_digits_on_one_side": (["12.", ".5", "-.25"], [12.0, 0.5, -0.25]),
}


@pytest.mark.parametrize("name", DECIDED)
def test_decided_by_the_table(tmp_path, name):
    cells, wanted = DECIDED[name]
    assert values_of(tmp_path, cells) == wanted


AMBIGUOUS = {
    "every_cell_with_a_comma": (["1,234", "2,345", "-3,456"], "1,234", 2),
    "every_cell_with_a_point": (["1.234", "2.345", "-3.456"], "1.234", 2),
    "with_small_whole_numbers": (["12", "2.345", "7"], "2.345", 2),
    "both_signs": (["1.234", "2,345", "7"], "1.234", 2),
    "thousands_that_nothing_proves": (["1.5", "2.5", "3.5", "1.5", "1,234", "3"], "1,234", 3),
    "thousands_beside_bare_ones": (["4,324.31", "4322.7", "1,276"], "1,276", 2),
    "german_thousands_that_nothing_proves": (["1,5", "2,5", "3,5", "1,5", "1.234", "3"], "1.234", 3),
}


@pytest.mark.parametrize("name", AMBIGUOUS)
def test_refused_where_a_cell_can_be_read_in_two_ways(tmp_path, name):
    cells, cell, line = AMBIGUOUS[name]
    with pytest.raises(BadInputError) as error:
        values_of(tmp_path, cells)
    issue = error.value.issue
    assert (issue.code, issue.line) == ("AMBIGUOUS_NUMBER", line)
    assert f"is '{cell}', which can be" in issue.message
    assert "add a line decimal=" in issue.message


@pytest.mark.parametrize(
    "note", ["decimal=,\n", "Decimal: comma\n", "# decimal=,\n", "Dezimaltrennzeichen = Komma;;;\n"]
)
def test_the_table_says_comma(tmp_path, note):
    assert values_of(tmp_path, ["1,234", "2,345", "-3,456"], note=note) == [1.234, 2.345, -3.456]
    assert values_of(tmp_path, ["1.234", "2.345", "-3.456"], note=note) == [1234.0, 2345.0, -3456.0]


@pytest.mark.parametrize("delimiter", [";", ",", "\t"])
def test_the_table_says_point(tmp_path, delimiter):
    assert values_of(tmp_path, ["1,234", "2,345", "-3,456"], delimiter, "decimal=.\n") == [1234.0, 2345.0, -3456.0]
    assert values_of(tmp_path, ["1.234", "2.345", "-3.456"], delimiter, "decimal=.\n") == [1.234, 2.345, -3.456]


def test_points_between_commas_are_decimal_points(tmp_path):
    """Three decimals everywhere, as Process Simulate writes: nobody groups thousands with points in such a file."""
    assert values_of(tmp_path, ["1.234", "2.345", "-3.456"], ",") == [1.234, 2.345, -3.456]


def test_an_angle_cannot_be_123456_degrees(tmp_path):
    (tmp_path / "t.csv").write_text("id;x;y;z;a;b;c\nS1;1,234;2,345;3,456;123,456;7;8\n")
    assert read_table(tmp_path / "t.csv").positions.tolist() == [[1.234, 2.345, 3.456]]


@pytest.mark.parametrize("cells", [["1.5", "2,5", "3"], ["1.5", "2.5", "3,25"], ["1.234,5", "1,234.5", "3"]])
def test_two_decimal_signs_in_one_table(tmp_path, cells):
    with pytest.raises(BadInputError) as error:
        values_of(tmp_path, cells)
    assert error.value.issue.code == "NOT_A_NUMBER"
    assert "write every number of the table alike" in error.value.issue.message


STYLES = {
    "point": (lambda value, places: f"{value:.{places}f}"),
    "comma": (lambda value, places: f"{value:.{places}f}".replace(".", ",")),
    "english": (lambda value, places: f"{value:,.{places}f}"),
    "german": (lambda value, places: f"{value:,.{places}f}".translate(str.maketrans(",.", ".,"))),
    "french": (lambda value, places: f"{value:,.{places}f}".translate(str.maketrans(",.", "\u00a0,"))),
    "swiss": (lambda value, places: f"{value:,.{places}f}".translate(str.maketrans(",", "'"))),
}


@pytest.mark.parametrize("delimiter", [";", ",", "\t", "|"])
@pytest.mark.parametrize("style", STYLES)
@given(
    millis=st.lists(st.integers(-20_000_000, 20_000_000), min_size=12, max_size=12),
    rows=st.integers(1, 4),
    places=st.integers(0, 3),
)
def test_never_wrong_by_a_thousand(tmp_path_factory, delimiter, style, millis, rows, places):
    """Numbers written by any country's rules come back as they are, or not at all.

    But for one: whole numbers grouped with points between commas. No country's spreadsheet writes such a file, and to
    refuse 1.234 there would refuse every machine's CSV of small coordinates.
    """
    wanted = [round(milli / 1000, places) for milli in millis[: 3 * rows]]
    assume(not (style == "german" and delimiter == "," and places == 0))
    path = table_of(tmp_path_factory.mktemp("t"), [STYLES[style](value, places) for value in wanted], delimiter)
    try:
        found = read_table(path).positions.ravel().tolist()
    except BadInputError as error:
        assert error.issue.code == "AMBIGUOUS_NUMBER"
    else:
        assert found == wanted
