"""Tables as sources: what was noticed reaches the user, and only whole orientations are used."""

from __future__ import annotations

import numpy as np
import openpyxl
import pytest

from respot.issues import BadInputError
from respot.spots import read_source
from tests.cli.conftest import SAMPLES, respot  # noqa: F401


def test_an_inch_table_is_said(tmp_path):
    (tmp_path / "t.csv").write_text("id,x (in),y (in),z (in)\nA,1,2,3\n")
    source = read_source(tmp_path / "t.csv")
    assert np.allclose(source.spots.positions, [[25.4, 50.8, 76.2]])
    assert [issue.code for issue in source.issues] == ["TABLE_UNITS"]


def test_orientations_only_where_every_row_has_one(tmp_path):
    (tmp_path / "t.csv").write_text("id,x,y,z,a,b,c\nA,1,2,3,4,5,6\nB,1,2,3,,,\n")
    source = read_source(tmp_path / "t.csv")
    assert source.spots.rotations is None
    (issue,) = source.issues
    assert (issue.code, issue.message) == (
        "PARTLY_ORIENTED",
        "1 of 2 rows have no orientation; only the positions are used",
    )
    (tmp_path / "t.csv").write_text("id,x,y,z,a,b,c\nA,1,2,3,4,5,6\nB,1,2,3,7,8,9\n")
    source = read_source(tmp_path / "t.csv")
    assert len(source.spots.rotations) == 2
    assert source.issues == []


def test_empty_orientation_columns_are_nothing_to_say(tmp_path):
    (tmp_path / "t.csv").write_text("id,x,y,z,a,b,c\nA,1,2,3,,,\n")
    source = read_source(tmp_path / "t.csv")
    assert (source.spots.rotations, source.issues) == (None, [])


def test_joints_without_positions_are_no_spots(tmp_path):
    (tmp_path / "t.csv").write_text("id,j1,j2\nA,1,2\n")
    with pytest.raises(BadInputError) as error:
        read_source(tmp_path / "t.csv")
    assert error.value.issue.code == "MISSING_COLUMN"
    assert "no columns x, y, z" in error.value.issue.message


def test_the_rear_door_in_inches_in_excel_fits_as_it_does_in_mm(tmp_path, respot):  # noqa: F811
    header, *rows = [line.split(",") for line in (SAMPLES / "theory.csv").read_text().splitlines()]
    workbook = openpyxl.Workbook()
    workbook.active.append(["Schweißpunkt", "X [in]", "Y [in]", "Z [in]"])
    for name, *position in rows:
        workbook.active.append([name, *(float(value) / 25.4 for value in position)])
    workbook.save(tmp_path / "theory.xlsx")
    assert header == ["id", "x", "y", "z"]
    plain = respot("fit", SAMPLES / "kuka", "--theory", SAMPLES / "theory.csv", "--json")
    inches = respot("fit", SAMPLES / "kuka", "--theory", "theory.xlsx", "--json")
    assert inches.code == plain.code == 0
    assert inches.json["after"]["rms"] == pytest.approx(plain.json["after"]["rms"], abs=1e-6)
    assert "TABLE_UNITS" in [issue["code"] for issue in inches.json["issues"]]
