"""What is written comes back as it was, and runs in no spreadsheet."""

from __future__ import annotations

import csv
import string

import numpy as np
import openpyxl
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from respot.issues import BadInputError
from respot.tables import read_table, write_table

NAMES = st.one_of(
    st.text(st.characters(codec="utf-8", exclude_categories=("Cc", "Cs", "Cn")), min_size=1, max_size=12),
    st.text(string.ascii_letters + string.digits + "=+-@#'\";,|. \t\n_", min_size=1, max_size=12),
    st.from_regex(r"[0-9](\.[0-9]{1,5})?E\+[0-9]{2}", fullmatch=True),
).filter(lambda name: name == name.strip())


@pytest.mark.parametrize("suffix", [".csv", ".xlsx"])
@given(
    ids=st.lists(NAMES, min_size=1, max_size=6, unique_by=str.casefold),
    coordinates=st.lists(st.integers(-(10**9), 10**9), min_size=18, max_size=18),
    decimals=st.integers(0, 4),
)
@example(ids=["=1+1", "+1", "-1", "@a", "#b", "'c", "''=d", "1E+05"], coordinates=[1234] * 24, decimals=3)
@example(ids=["id", "x", "1.5", "00017", "1615438.0", "a\nb", 'a"b', "sep=;"], coordinates=[1234] * 24, decimals=0)
def test_round_trip(tmp_path_factory, suffix, ids, coordinates, decimals):
    path = tmp_path_factory.mktemp("t") / f"t{suffix}"
    positions = np.array(coordinates[: 3 * len(ids)]).reshape(-1, 3) / 1000.0
    write_table(path, ids, positions, decimals=decimals)
    table = read_table(path)
    assert list(table.ids) == ids
    assert table.positions.tolist() == [[round(value, decimals) for value in row] for row in positions.tolist()]


@pytest.mark.parametrize("suffix", [".csv", ".xlsx"])
@pytest.mark.parametrize("quaternions", [False, True])
def test_orientations_and_further_columns(tmp_path, suffix, quaternions):
    path = tmp_path / f"t{suffix}"
    rotations = Rotation.from_euler("ZYX", [[10, 20, 30], [0, 0, 0], [-170, 89, 5]], degrees=True)
    columns = {
        "j1": [1.5, None, 3.25],
        "e1": [None, 700, 0.1],
        "ci95": [0.1 + 0.2, float("nan"), 2],
        "remark": ["=x", "-5", ""],
    }
    write_table(
        path,
        ["A", "B", "C"],
        np.zeros((3, 3)),
        rotations,
        oriented=[True, False, True],
        quaternions=quaternions,
        columns=columns,
    )
    table = read_table(path)
    assert table.oriented == [True, False, True]
    assert np.degrees((table.rotations[[0, 2]] * rotations[[0, 2]].inv()).magnitude()) == pytest.approx(
        [0, 0], abs=1e-5
    )
    assert np.array_equal(table.joints[:, 0], [1.5, np.nan, 3.25], equal_nan=True)
    assert np.array_equal(table.external_axes[:, 0], [np.nan, 700, 0.1], equal_nan=True)
    # openpyxl writes sixteen digits
    assert table.numbers["ci95"] == pytest.approx(
        [0.1 + 0.2, np.nan, 2], rel=0 if suffix == ".csv" else 1e-15, nan_ok=True
    )
    assert table.columns["remark"] == ["=x", "-5", ""]


def test_the_text_of_a_csv(tmp_path):
    """Decimal points, LF, no negative zero, and an apostrophe before what a spreadsheet would run."""
    path = tmp_path / "t.csv"
    write_table(
        path, ["A", "=B", "Ü;1"], [[1, -0.0001, 2.5], [1234.5678, 0, -3], [1e6, 0, 0]], columns={"n": [1, 0.5, None]}
    )
    assert path.read_bytes().decode() == (
        "id,x,y,z,n\nA,1.000,0.000,2.500,1\n'=B,1234.568,0.000,-3.000,0.5\nÜ;1,1000000.000,0.000,0.000,\n"
    )


@pytest.mark.parametrize("name", ["=1+1", "+1", "-A1", "@SUM(A1)", "=cmd|' /C calc'!A0"])
def test_nothing_runs_in_a_spreadsheet(tmp_path, name):
    write_table(tmp_path / "t.csv", [name], [[1, 2, 3]])
    with (tmp_path / "t.csv").open(newline="", encoding="utf-8") as file:
        assert list(csv.reader(file))[1][0] == f"'{name}"
    write_table(tmp_path / "t.xlsx", [name], [[1, 2, 3]])
    cell = openpyxl.load_workbook(tmp_path / "t.xlsx").active["A2"]
    assert (cell.value, cell.data_type) == (name, "s")


@pytest.mark.parametrize("name", ["", " A", "A\t", "A\0B", "A\rB", "A\ud800", "a"])
@pytest.mark.parametrize("suffix", [".csv", ".xlsx"])
def test_ids_that_would_not_come_back(tmp_path, name, suffix):
    with pytest.raises(BadInputError) as error:
        write_table(tmp_path / f"t{suffix}", ["A", name], np.zeros((2, 3)))
    assert error.value.issue.code == "VERIFY_FAILED"
    assert list(tmp_path.iterdir()) == []


def test_positions_that_are_no_numbers(tmp_path):
    with pytest.raises(BadInputError) as error:
        write_table(tmp_path / "t.csv", ["A"], [[1, np.nan, 3]])
    assert "the position of 'A' is not finite" in error.value.issue.message


@pytest.mark.parametrize("columns", [{"x": [1]}, {"Pos X": [1]}, {"n": [1, 2]}, {"spot_id": ["B"]}])
def test_columns_that_cannot_stand_in_the_table(tmp_path, columns):
    with pytest.raises(ValueError, match="column"):
        write_table(tmp_path / "t.csv", ["A"], [[1, 2, 3]], columns=columns)
