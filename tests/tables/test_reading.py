"""Spot tables in the spellings that people send."""

from __future__ import annotations

import numpy as np
import pytest

from respot.tables import read_table

WANTED = [[4324.31, -28.43, 1276.51], [4322.7, 98.41, 1276.5]]
SPELLINGS = {
    "plain": "id,x,y,z\nS1,4324.31,-28.43,1276.51\nS2,4322.7,98.41,1276.5\n",
    "german": "ID;X;Y;Z\r\nS1;4324,31;-28,43;1276,51\r\nS2;4322,7;98,41;1276,5\r\n",
    "german_with_thousands": "ID;X;Y;Z\nS1;4.324,31;-28,43;1.276,51\nS2;4.322,7;98,41;1.276,5\n",
    "english_with_thousands": 'ID,X,Y,Z\nS1,"4,324.31",-28.43,"1,276.51"\nS2,"4,322.7",98.41,"1,276.5"\n',
    "swiss": "ID;X;Y;Z\nS1;4'324.31;-28.43;1'276.51\nS2;4’322.7;98.41;1276.5\n",
    "french": "ID;X;Y;Z\nS1;4 324,31;-28,43;1\u00a0276,51\nS2;4 322,7;98,41;1276,5\n",
    "tabs_and_units": "Name\tPos X [mm]\tPos Y [mm]\tPos Z [mm]\nS1\t4324.31\t-28.43\t1276.51\nS2\t4322.7\t98.41\t1276.5",
    "bars": "WP|X/mm|Y/mm|Z/mm\nS1|4324.31|-28.43|1276.51\nS2|4322.7|98.41|1276.5\n",
    "blanks_and_a_covariate": (
        "\n\nspot_id , x , y , z , station\n S1 , 4324.31 , -28.43 , 1276.51 , 140\nS2,4322.7,98.41,1276.5,\n\n"
    ),
    "quoted": (
        '"Class","ExternalId","X","Y","Z"\n"PmWeldPoint","S1","4324.31","-28.43","1276.51"\n'
        '"PmWeldPoint", "S2", "4322.7", "98.41", "1276.5"\n'
    ),
    "other_order": "z,y,x,Punkt\n1276.51,-28.43,4324.31,S1\n1276.5,98.41,4322.7,S2\n",
    "sep_line": "sep=|\nid|x|y|z\nS1|4324.31|-28.43|1276.51\nS2|4322.7|98.41|1276.5\n",
    "preamble": (
        "Rear door, line 2;;;\nUnits: mm;;;\n;;;\nPunktname;X;Y;Z\nS1;4324,31;-28,43;1276,51\nS2;4322,7;98,41;1276,5\n"
    ),
    "a_preamble_with_other_delimiters": (
        "line 2, station 140, gun 3, part 5, rev 7\nid;x;y;z\nS1;4324,31;-28,43;1276,51\nS2;4322,7;98,41;1276,5\n"
    ),
    "comments": "# made by hand\nid,x,y,z\n# left out\nS1,4324.31,-28.43,1276.51\n\nS2,4322.7,98.41,1276.5\n",
    "a_commented_header": "# id x\n# id,x,y,z\nS1,4324.31,-28.43,1276.51\nS2,4322.7,98.41,1276.5\n",
    "the_header_on_every_page": (
        "id,x,y,z\nS1,4324.31,-28.43,1276.51\nid,x,y,z\nS2,4322.7,98.41,1276.5\n"
    ),
    "empty_columns_at_the_end": "id;x;y;z;;\nS1;4324,31;-28,43;1276,51;;\nS2;4322,7;98,41;1276,5;;;\n",
    "exponents_and_a_real_minus": "id,x,y,z\nS1,4.32431E+03,\u221228.43,1.27651e3\nS2,+4322.7,98.41,1276.5\n",
    "cells_with_units": "id,x,y,z\nS1,4324.31 mm,-28.43 mm,1276.51mm\nS2,4322.7 mm,98.41,1276.5 mm\n",
    "old_mac_line_ends": "id,x,y,z\rS1,4324.31,-28.43,1276.51\rS2,4322.7,98.41,1276.5\r",
    "points_and_zeros": "id,x,y,z\nS1,04324.31,-28.43,1276.51\nS2,4322.700,98.41,1276.50\n",
}  # fmt: skip


@pytest.mark.parametrize("name", SPELLINGS)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "cp1252", "utf-16"])
def test_spellings(tmp_path, name, encoding):
    text = SPELLINGS[name]
    if encoding == "cp1252":
        text = text.replace("\u2212", "-")  # a code page has no such sign
    (tmp_path / "t.csv").write_bytes(text.encode(encoding))
    table = read_table(tmp_path / "t.csv")
    assert list(table.ids) == ["S1", "S2"]
    assert np.array_equal(table.positions, WANTED)


@pytest.mark.parametrize(
    "title",
    [
        *("id", "ID", "Spot", "Spot ID", "spot_name", "Name", "Weld", "Weld Point", "Weld-Point Name", "WP", "Point"),
        *("Location name", "MFG", "Feature", "ExternalId", "External ID", "Nr.", "Frame", "Target"),
        *(
            "Punkt",
            "Punktname",
            "Punkt-Nr.",
            "Schweißpunkt",
            "SCHWEISSPUNKT",
            "SP-Nr",
            "SP Nr.",
            "Nummer",
            "Bezeichnung",
        ),
    ],
)
@pytest.mark.parametrize("encoding", ["utf-8", "cp1252"])
def test_titles_of_the_id(tmp_path, title, encoding):
    (tmp_path / "t.csv").write_text(f"{title};x;y;z\nA;1,5;2;3\n", encoding=encoding)
    assert read_table(tmp_path / "t.csv").ids == ["A"]


@pytest.mark.parametrize(
    "title",
    [
        "x",
        "X",
        "Pos X",
        "X-Pos.",
        "X_Position",
        "Position X",
        "Koordinate X",
        "X-Koordinate",
        "Lage X",
        "x coord",
        "Loc X",
    ],
)
def test_titles_of_positions(tmp_path, title):
    header = ";".join(title.replace("X", axis).replace("x ", f"{axis.lower()} ") for axis in "XYZ")
    header = "x;y;z" if title == "x" else header
    (tmp_path / "t.csv").write_text(f"Punkt;{header}\nA;1,5;2;3\n")
    assert read_table(tmp_path / "t.csv").positions.tolist() == [[1.5, 2.0, 3.0]]


def test_which_of_several_id_columns_is_said(tmp_path):
    """A list with a running number, a part name and the spot: the spot's own column is taken."""
    (tmp_path / "t.csv").write_text("Nr;Bezeichnung;SP-Nr;X;Y;Z\n1;door;P7;1,5;2;3\n2;door;P8;1,5;2;3\n")
    table = read_table(tmp_path / "t.csv")
    assert table.ids == ["P7", "P8"]
    assert table.columns["bezeichnung"] == ["door", "door"]
    (issue,) = table.issues
    assert (issue.code, issue.line) == ("TABLE_COLUMNS", 1)
    assert issue.message == "the spot IDs are taken from its column 'SP-Nr', not from 'Bezeichnung', 'Nr'"


def test_lines_are_lines_of_the_file(tmp_path):
    (tmp_path / "t.csv").write_text('note\n"two\nlines"\nid,x,y,z,remark\nA,1,2,3,"a\nb"\n\nB,1,2,3,\n')
    assert read_table(tmp_path / "t.csv").lines == [5, 8]


def test_rows_left_out_are_said(tmp_path):
    (tmp_path / "t.csv").write_text("id,x,y,z\nA,1,2,3\n#B,4,5,6\nC,7,8,9\n")
    table = read_table(tmp_path / "t.csv")
    assert table.ids == ["A", "C"]
    assert [(issue.code, issue.line, issue.message) for issue in table.issues] == [
        ("TABLE_ROWS", 3, "rows that start with # were left out: 3")
    ]


def test_covariates_are_kept_as_text_and_as_numbers(tmp_path):
    (tmp_path / "t.csv").write_text("id;x;y;z;Station;time_min;gun;gun\nS1;0;0;0,5;140;1,5;a;b\nS2;0;0;0;;2;c;1\n")
    table = read_table(tmp_path / "t.csv")
    assert (table.columns["station"], table.columns["time_min"]) == (["140", ""], ["1,5", "2"])
    assert (table.columns["gun"], table.columns["gun (2)"]) == (["a", "c"], ["b", "1"])
    assert sorted(table.numbers) == ["station", "time_min"]
    assert table.numbers["time_min"].tolist() == [1.5, 2.0]
    assert table.numbers["station"][0] == 140.0
    assert np.isnan(table.numbers["station"][1])


def test_a_table_of_covariates_needs_no_pose(tmp_path):
    (tmp_path / "t.csv").write_text("id,time_min,m\nS1,10,m\nS2,20,in\n")
    table = read_table(tmp_path / "t.csv", pose_needed=False)
    assert (table.ids, table.xyz, table.numbers["time_min"].tolist()) == (["S1", "S2"], None, [10.0, 20.0])


def test_spreadsheet_text_signs_are_no_part_of_an_id(tmp_path):
    (tmp_path / "t.csv").write_text("id,x,y,z\n'=P1,1,2,3\n'#P2,1,2,3\n''P3,1,2,3\n")
    assert read_table(tmp_path / "t.csv").ids == ["=P1", "#P2", "'P3"]


@pytest.mark.parametrize(
    ("header", "cells"),
    [
        ("a,b,c", "90,0,0"),
        ("A [deg],B [deg],C [deg]", "90,0,0"),
        ("Winkel A,Winkel B,Winkel C", "90.0°,0°,0 deg"),
        ("A [rad],B [rad],C [rad]", "1.5707963267948966,0,0"),
        ("q1,q2,q3,q4", "0.7071068,0,0,0.7071068"),
        ("q1,q2,q3,q4", "0.709,0,0,0.709"),
        ("qx,qy,qz,qw", "0,0,0.7071068,0.7071068"),
        ("rz,ry,rx", "90,0,0"),
        ("roll,pitch,yaw", "0,0,90"),
        ("a,b,c,q1,q2,q3,q4", "90,0,0,0.7071068,0,0,0.7071068"),
        ("a,b,c,q1,q2,q3,q4", ",,,0.7071068,0,0,0.7071068"),
    ],
)
def test_orientations(tmp_path, header, cells):
    """A turn of 90 degrees about z takes x to y."""
    (tmp_path / "t.csv").write_text(f"id,x,y,z,{header}\nS1,0,0,0,{cells}\n")
    table = read_table(tmp_path / "t.csv")
    assert table.rotations[0].apply([1, 0, 0]) == pytest.approx([0, 1, 0], abs=1e-6)
    assert table.oriented == [True]


def test_turns_about_named_axes_are_read_as_kuka_angles_and_said(tmp_path):
    """R = Rz(30) Ry(20) Rx(10), multiplied out here."""
    (tmp_path / "t.csv").write_text("id,x,y,z,rx,ry,rz\nS1,0,0,0,10,20,30\n")
    table = read_table(tmp_path / "t.csv")
    (c1, c2, c3), (s1, s2, s3) = np.cos(np.radians([10, 20, 30])), np.sin(np.radians([10, 20, 30]))
    x, y, z = (
        [[1, 0, 0], [0, c1, -s1], [0, s1, c1]],
        [[c2, 0, s2], [0, 1, 0], [-s2, 0, c2]],
        [[c3, -s3, 0], [s3, c3, 0], [0, 0, 1]],
    )
    assert np.allclose(table.rotations[0].as_matrix(), np.array(z) @ np.array(y) @ np.array(x), atol=1e-12)
    (issue,) = table.issues
    assert issue.code == "TABLE_COLUMNS"
    assert "fixed axes x, then y, then z" in issue.message


def test_half_of_the_rows_oriented(tmp_path):
    (tmp_path / "t.csv").write_text("id,x,y,z,a,b,c\nS1,0,0,0,,,\nS2,0,0,0,90,0,0\nS3,0,0,0,-,-,-\n")
    table = read_table(tmp_path / "t.csv")
    assert table.oriented == [False, True, False]
    assert np.allclose(table.rotations.magnitude(), [0, np.pi / 2, 0])


def test_orientation_columns_that_are_all_empty(tmp_path):
    (tmp_path / "t.csv").write_text("id,x,y,z,a,b,c\nS1,0,0,0,,,\n")
    table = read_table(tmp_path / "t.csv")
    assert (table.rotations, table.oriented) == (None, [False])


def test_joints_and_external_axes(tmp_path):
    (tmp_path / "t.csv").write_text(
        "id,x,y,z,j1,j2,j3,jm1,jm2,jm3,e1,e2\nS1,0,0,0,10,20,30,10.5,20.5,30.5,700,9E9\nS2,0,0,0,,,,,,,,0\n"
    )
    table = read_table(tmp_path / "t.csv")
    assert np.array_equal(table.joints, [[10, 20, 30], [np.nan] * 3], equal_nan=True)
    assert np.array_equal(table.measured_joints, [[10.5, 20.5, 30.5], [np.nan] * 3], equal_nan=True)
    assert table.external_axes.shape == (2, 6)
    assert np.array_equal(table.external_axes[:, :2], [[700, np.nan], [np.nan, 0]], equal_nan=True)
    assert np.isnan(table.external_axes[:, 2:]).all()


def test_a_table_of_joints_without_a_pose(tmp_path):
    (tmp_path / "t.csv").write_text("Punkt;A1 [rad];A2 [rad]\nS1;0,5;-1\n")
    table = read_table(tmp_path / "t.csv")
    assert table.xyz is None
    assert table.joints == pytest.approx(np.array([[28.64788975654116, -57.29577951308232]]), abs=1e-12)


@pytest.mark.parametrize("name", ["measured.xls", "measured.xlsx", "measured.txt"])
def test_text_under_any_name(tmp_path, name):
    """Measuring machines write tab-separated text and call it .xls."""
    (tmp_path / name).write_text("id\tx\ty\tz\nA\t1.5\t2\t3\n")
    assert read_table(tmp_path / name).positions.tolist() == [[1.5, 2.0, 3.0]]
