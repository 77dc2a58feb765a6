"""Process Simulate's lists, as its exports and the scripts around it write them."""

from __future__ import annotations

import numpy as np
import pytest

from respot.issues import BadInputError
from respot.tables import read_table

HEADER = "Class,ExternalId,Name,Location,X,Y,Z,Type\n"


def read(tmp_path, text):
    (tmp_path / "t.csv").write_text(text)
    return read_table(tmp_path / "t.csv")


def test_weld_points_among_other_objects(tmp_path):
    table = read(
        tmp_path,
        HEADER + 'PmWeldPoint,PP-1,wp1,"1.500,2.000,3.000",1.500,2.000,3.000,2T\n'
        "PmPartPrototype,PP-2,door,,,,,\n"
        "PmSource,PP-3,src,,n/a,,,\n"
        'PmWeldPoint,PP-4,wp2,"",4.500,5.000,6.000,3T\n'
        "PmWeldPoint,PP-5,,,7.000,8.000,9.000,3T\n",
    )
    assert table.ids == ["wp1", "wp2", "PP-5"]
    assert table.positions.tolist() == [[1.5, 2, 3], [4.5, 5, 6], [7, 8, 9]]
    assert table.lines == [2, 5, 6]
    assert table.columns["type"] == ["2T", "3T", "3T"]
    said = {issue.code: issue.message for issue in table.issues}
    assert (
        said["TABLE_ROWS"] == "rows that are no weld points by their Class were left out: 1 PmPartPrototype, 1 PmSource"
    )
    assert said["TABLE_COLUMNS"] == "the spot IDs are taken from its column 'Name', not from 'ExternalId'"


@pytest.mark.parametrize(
    "location",
    [
        "100.5,200.25,-3.0",
        "100.5, 200.25, -3.0",
        "100.5 200.25 -3",
        "(100.5; 200.25; -3)",
        "[100.5|200.25|-3]",
        "100.5 mm, 200.25 mm, -3 mm",
    ],
)
def test_the_position_in_one_cell(tmp_path, location):
    table = read(tmp_path, f'{HEADER}PmWeldPoint,PP-1,wp1,"{location}",,,,2T\n')
    assert table.positions.tolist() == [[100.5, 200.25, -3.0]]


def test_the_position_in_one_cell_with_decimal_commas(tmp_path):
    table = read(tmp_path, "Class;Name;Location\nWeldPoint;wp1;1,5 2,25 -3\n")
    assert table.positions.tolist() == [[1.5, 2.25, -3.0]]


@pytest.mark.parametrize("location", ["1,2", "1,2,3,4", "here", "1;2"])
def test_a_location_that_is_no_position(tmp_path, location):
    with pytest.raises(BadInputError) as error:
        read(tmp_path, f'{HEADER}PmWeldPoint,PP-1,wp1,"{location}",,,,2T\n')
    assert (error.value.issue.code, error.value.issue.line) == ("NOT_A_NUMBER", 2)
    assert "three numbers x,y,z are needed" in error.value.issue.message


def test_teamcenter_revisions(tmp_path):
    table = read(tmp_path, HEADER + "WeldPointRevision,PP-1,wp1,,1,2,3,\nItemRevision,PP-2,door,,,,,\n")
    assert table.ids == ["wp1"]


def test_a_list_without_weld_points(tmp_path):
    with pytest.raises(BadInputError) as error:
        read(tmp_path, HEADER + "PmSource,PP-1,a,,1,2,3,\nPmSource,PP-2,b,,1,2,3,\n")
    assert (error.value.issue.code, error.value.issue.line) == ("BAD_TABLE", 1)
    assert error.value.issue.message == "holds no weld point; by its column Class it holds 2 PmSource"


def test_a_safety_class_is_no_object_class(tmp_path):
    table = read(tmp_path, "Spot,X,Y,Z,Class\nA,1,2,3,D\nB,4,5,6,S\n")
    assert (table.ids, table.columns["class"]) == (["A", "B"], ["D", "S"])


@pytest.mark.parametrize("reference", ["", ";Cell 5"])
def test_frames_without_a_header(tmp_path, reference):
    """R = Rz(90) takes the frame's x to y."""
    table = read(tmp_path, f"fr1;100.5;2;3;0;0;90{reference}\nfr2;4;5;6;90;0;0{reference}\n")
    assert table.ids == ["fr1", "fr2"]
    assert table.positions.tolist() == [[100.5, 2, 3], [4, 5, 6]]
    assert table.lines == [1, 2]
    assert np.allclose(table.rotations.apply([1, 0, 0]), [[0, 1, 0], [1, 0, 0]], atol=1e-12)
    assert np.allclose(table.rotations.apply([0, 1, 0]), [[-1, 0, 0], [0, 0, 1]], atol=1e-12)
    messages = [issue.message for issue in table.issues]
    assert "has no header; it is read as a frame list: name, x, y, z in mm, rx, ry, rz in degrees" in messages[0]
    assert ("seen from 'Cell 5'" in messages[0]) == bool(reference)
    assert "turns about the fixed axes x, then y, then z" in messages[1]


def test_frames_seen_from_different_frames(tmp_path):
    with pytest.raises(BadInputError) as error:
        read(tmp_path, "fr1;1.5;2;3;0;0;90;Cell 5\nfr2;4;5;6;90;0;0;Cell 6\n")
    assert (error.value.issue.code, error.value.issue.line) == ("BAD_TABLE", 2)
    assert "seen from 'Cell 5' and from 'Cell 6'" in error.value.issue.message


@pytest.mark.parametrize("text", ["fr1;1;2;3;0;0;90\nfr2;4;5;x;90;0;0\n", "1;1;2;3;0;0;90\n", "fr1;1;2;3\n"])
def test_what_is_no_frame_list_needs_a_header(tmp_path, text):
    with pytest.raises(BadInputError) as error:
        read(tmp_path, text)
    assert (error.value.issue.code, error.value.issue.line) == ("MISSING_COLUMN", 1)
