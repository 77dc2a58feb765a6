"""Lengths come out in mm and angles in degrees, and every conversion is said."""

from __future__ import annotations

import numpy as np
import pytest

from respot.issues import BadInputError
from respot.tables import read_table

INCHES = {
    "in_brackets": "id,X [in],Y [in],Z [in]\nA,1,2,-0.5\n",
    "in_round_brackets": "id,x (inch),y (inch),z (inch)\nA,1,2,-0.5\n",
    "after_an_underscore": "id,X_inch,Y_inch,Z_inch\nA,1,2,-0.5\n",
    "after_a_slash": 'id;Pos X/Zoll;Pos Y/Zoll;Pos Z/"\nA;1;2;-0,5\n',
    "after_the_word_in": "id,x in inches,y in in,z in inch\nA,1,2,-0.5\n",
    "row_below": "id,x,y,z\n,in,in,in\nA,1,2,-0.5\n",
    "row_below_in_brackets": "id,x,y,z,a,b,c\n[-],[inch],[inch],[inch],[deg],[deg],[deg]\nA,1,2,-0.5,,,\n",
    "column": "id,x,y,z,unit\nA,1,2,-0.5,inch\n",
    "german_column": "id;x;y;z;Einheit\nA;1;2;-0,5;Zoll\n",
    "line_above": "Units: inch\nid,x,y,z\nA,1,2,-0.5\n",
    "cells_above": "Einheit;Zoll;;\nid;x;y;z\nA;1;2;-0,5\n",
    "sentence_above": "All dimensions in inches, angles in degrees\nid,x,y,z\nA,1,2,-0.5\n",
    "two_units_above": "# Units: in, deg\nid,x,y,z\nA,1,2,-0.5\n",
    "cells": "id,x,y,z\nA,1 in,2 inch,-0.5in\n",
    "said_twice": "Units: inch\nid,x (in),y (in),z (in)\nA,1 in,2 in,-0.5 in\n",
}


@pytest.mark.parametrize("name", INCHES)
def test_inches(tmp_path, name):
    (tmp_path / "t.csv").write_text(INCHES[name])
    table = read_table(tmp_path / "t.csv")
    assert np.allclose(table.positions, [[25.4, 50.8, -12.7]], rtol=0, atol=1e-12)
    assert (table.ids, table.unit) == (["A"], "inch")
    (issue,) = table.issues
    assert issue.code == "TABLE_UNITS"
    assert "x, y, z are in inches (" in issue.message
    assert "converted to mm" in issue.message


@pytest.mark.parametrize(
    ("header", "unit", "size"),
    [
        ("X [m],Y [m],Z [m]", "m", 1000.0),
        ("X/m,Y/m,Z/m", "m", 1000.0),
        ("X meters,Y meters,Z meters", "m", 1000.0),
        ("x in m,y in m,z in m", "m", 1000.0),
        ("X [cm],Y [cm],Z [cm]", "cm", 10.0),
        ("X [µm],Y [µm],Z [µm]", "um", 0.001),
        ("X [mm],Y [mm],Z [mm]", "mm", 1.0),
        ("x_mm,y_mm,z_mm", "mm", 1.0),
        ("X [mm],Y,Z", "mm", 1.0),
        ("X,Y,Z", "mm", 1.0),
    ],
)
def test_other_lengths(tmp_path, header, unit, size):
    (tmp_path / "t.csv").write_text(f"id,{header}\nA,1,2,3.5\n", encoding="utf-8")
    table = read_table(tmp_path / "t.csv")
    assert table.unit == unit
    assert np.allclose(table.positions, np.array([[1, 2, 3.5]]) * size, rtol=1e-15)
    assert [issue.code for issue in table.issues] == (["TABLE_UNITS"] if size != 1.0 else [])


def test_a_table_that_says_nothing_is_in_mm_however_small(tmp_path):
    (tmp_path / "t.csv").write_text("id,x,y,z\nA,0.1,0.2,0.3\n")
    table = read_table(tmp_path / "t.csv")
    assert (table.positions.tolist(), table.issues) == ([[0.1, 0.2, 0.3]], [])


@pytest.mark.parametrize("title", ["x_m", "x_in", "X m", "X [ft lbs]", "X (nominal)"])
def test_a_letter_behind_a_name_is_no_unit(tmp_path, title):
    """x_m is a measured x as often as one in metres: such a column is not taken for x."""
    (tmp_path / "t.csv").write_text(f"id,{title},y,z\nA,1,2,3.5\n")
    with pytest.raises(BadInputError) as error:
        read_table(tmp_path / "t.csv")
    assert (error.value.issue.code, error.value.issue.line) == ("MISSING_COLUMN", 1)
    assert title in error.value.issue.message


MIXED = {
    "titles": ("id,X [mm],Y [in],Z [mm]\nA,1,2,3\n", 1, "x in mm, y in inches, z in mm"),
    "one_title_only": ("id,X [in],Y,Z\nA,1,2,3\n", 1, "x in inches, y in no unit"),
    "title_and_row": ("id,X [in],Y [in],Z [in]\n,mm,mm,mm\nA,1,2,3\n", 2, "x in inches (line 1) and in mm"),
    "title_and_cell": ("id,X [in],Y [in],Z [in]\nA,1,2,3\nB,1,2 mm,3\n", 3, "y in inches (line 1) and in mm"),
    "cells": ("id,x,y,z\nA,1 mm,2,3\nB,1 in,2,3\n", 3, "x in mm (line 2) and in inches"),
    "bare_cells": ("id,x,y,z\nA,1 in,2 in,3 in\nB,1,2 in,3 in\n", 3, "x in inches in line 2 and without a unit here"),
    "line_above_and_title": ("Units: mm\nid,X [in],Y [in],Z [in]\nA,1,2,3\n", 2, "in mm by a line above its header"),
    "lines_above": ("Units: mm\nUnits: inch\nid,x,y,z\nA,1,2,3\n", 2, "two units above its header, in line 1"),
    "column": ("id,x,y,z,unit\nA,1,2,3,mm\nB,1,2,3,in\n", 3, "another unit (or none) in its column 'unit'"),
    "column_with_a_gap": ("id,x,y,z,unit\nA,1,2,3,in\nB,1,2,3,\n", 3, "another unit (or none)"),
    "column_and_title": ("id,X [mm],Y [mm],Z [mm],unit\nA,1,2,3,in\n", 1, "in inches by its column 'unit'"),
    "lengths_in_degrees": ("id,X [deg],Y [deg],Z [deg]\nA,1,2,3\n", 1, "x, y, z in degrees, where a length is needed"),
    "angles_in_mm": ("id,x,y,z,A [mm],B [mm],C [mm]\nA,1,2,3,4,5,6\n", 1, "a, b, c in mm, where an angle is needed"),
    "one_angle_in_radians": ("id,x,y,z,A [rad],B,C\nA,1,2,3,4,5,6\n", 1, "a in radians, b in no unit"),
}


@pytest.mark.parametrize("name", MIXED)
def test_mixed_units(tmp_path, name):
    text, line, words = MIXED[name]
    (tmp_path / "t.csv").write_text(text)
    with pytest.raises(BadInputError) as error:
        read_table(tmp_path / "t.csv")
    assert (error.value.issue.code, error.value.issue.line) == ("MIXED_UNITS", line)
    assert words in error.value.issue.message


def test_radians_are_said(tmp_path):
    (tmp_path / "t.csv").write_text("Angles in rad\nid,x,y,z,a,b,c\nA,1,2,3,3.141592653589793,0,0\n")
    table = read_table(tmp_path / "t.csv")
    assert np.allclose(table.rotations[0].apply([1, 0, 0]), [-1, 0, 0], atol=1e-12)
    (issue,) = table.issues
    assert (issue.code, issue.line) == ("TABLE_UNITS", 1)
    assert issue.message == ("a, b, c are in radians (a line above its header says so) and were converted to degrees")


def test_an_axis_without_a_unit_stays_in_an_inch_table(tmp_path):
    """It may be a turntable in degrees or a rail in inches; the table does not tell."""
    (tmp_path / "t.csv").write_text("id,x (in),y (in),z (in),e1,e2 [in]\nA,1,2,3,10,10\n")
    table = read_table(tmp_path / "t.csv")
    assert table.external_axes[0, :2].tolist() == [10.0, 254.0]
    assert "e1 have no unit and stay as they are" in " ".join(issue.message for issue in table.issues)


@pytest.mark.parametrize(
    "text",
    [
        "id,x,y,z,unit\nA,1,2,3,ST140\nB,1,2,3,door\n",
        "Unit 5, rear door\nid,x,y,z\nA,1,2,3\nB,1,2,3\n",
        "Length: 12 m\nid,x,y,z\nA,1,2,3\nB,1,2,3\n",
        "Units are in mm\nid,x,y,z\nA,1,2,3\nB,1,2,3\n",
        "Maße in mm / Winkel in Grad\nid,x,y,z\nA,1,2,3\nB,1,2,3\n",
    ],
)
def test_words_that_are_no_units(tmp_path, text):
    (tmp_path / "t.csv").write_text(text, encoding="utf-8")
    table = read_table(tmp_path / "t.csv")
    assert (table.unit, table.positions.tolist(), table.issues) == ("mm", [[1, 2, 3]] * 2, [])
