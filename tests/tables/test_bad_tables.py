"""Malformed tables: one message that names the line and what to do."""

from __future__ import annotations

import codecs

import pytest

from respot.issues import BadInputError
from respot.tables import read_table

#: name -> (table, code, line, words of the message)
BAD = {
    "empty": ("", "BAD_TABLE", None, "is empty"),
    "blank_lines": ("\n \n\n", "BAD_TABLE", None, "is empty"),
    "header_only": ("\nid,x,y,z\n\n", "BAD_TABLE", 2, "holds no spots below its header row"),
    "no_header": ("A,1,2,3\nB,1,2,3\n", "MISSING_COLUMN", 1, "has no header row; name the columns"),
    "no_x": ("note\nid,u,y,z\nA,1,2,3\n", "MISSING_COLUMN", 2, "has no column x; its header is: id, u, y, z; rename"),
    "no_id": ("x,y,z\n1,2,3\n", "MISSING_COLUMN", 1, "has no column id; its header is: x, y, z"),
    "two_x": ("id,x,y,z,Pos X\nA,1,2,3,4\n", "BAD_TABLE", 1, "two columns for x"),
    "two_ids": ("Spot,Weld,x,y,z\nA,B,1,2,3\n", "BAD_TABLE", 1, "two columns for id, 'Spot' and 'Weld'"),
    "a_short_row": ("id,x,y,z\nA,1,2,3\nB,1,2\n", "BAD_TABLE", 3, "has 3 cells where the header has 4"),
    "decimal_commas_between_commas": ("id,x,y,z\nA,1,5,2,5,3,5\n", "BAD_TABLE", 2, "commas inside numbers need ;"),
    "an_open_quote": ('id,x,y,z\nA,1,2,3\n"B,1,2,3\nC,1,2,3\n', "BAD_TABLE", 3, "quotation mark that is not closed"),
    "an_empty_cell": ("id,x,y,z\nA,1,2,3\nB,1,,3\n", "NOT_A_NUMBER", 3, "y is empty; fill in a number"),
    "two_empty_cells": ("id,x,y,z\nA,1,2,3\nB,1,,\n", "NOT_A_NUMBER", 3, "y and z are empty"),
    "a_dash": ("id,x,y,z\nA,1,2,-\n", "NOT_A_NUMBER", 2, "z is '-'; a finite number in mm or degrees is needed"),
    "nan": ("id,x,y,z\nA,nan,2,3\n", "NOT_A_NUMBER", 2, "x is 'nan'"),
    "inf": ("id,x,y,z\nA,1,-inf,3\n", "NOT_A_NUMBER", 2, "y is '-inf'"),
    "1e400": ("id,x,y,z\nA,1,2,1e400\n", "NOT_A_NUMBER", 2, "z is '1e400'; it is too large"),
    "1e8": ("id,x,y,z\nA,1,2,100000000\n", "NOT_A_NUMBER", 2, "z is '100000000'; it is too large"),
    "ref": ("id,x,y,z\nA,#REF!,2,3\n", "NOT_A_NUMBER", 2, "x is the error value #REF!; repair its formula"),
    "na": ("id,x,y,z\nA,1,#N/A,3\n", "NOT_A_NUMBER", 2, "y is the error value #N/A"),
    "bezug": ("id;x;y;z\nA;1,5;2;#BEZUG!\n", "NOT_A_NUMBER", 2, "z is the error value #BEZUG!"),
    "underscores": ("id,x,y,z\nA,1_000,2,3\n", "NOT_A_NUMBER", 2, "x is '1_000'"),
    "arabic_digits": ("id,x,y,z\nA,٣,2,3\n", "NOT_A_NUMBER", 2, "x is '٣'"),
    "hexadecimal": ("id,x,y,z\nA,0x10,2,3\n", "NOT_A_NUMBER", 2, "x is '0x10'"),
    "two_numbers_in_a_cell": ("id,x,y,z\nA,1 2,2,3\n", "NOT_A_NUMBER", 2, "x is '1 2'"),
    "a_minus_behind": ("id,x,y,z\nA,12-,2,3\n", "NOT_A_NUMBER", 2, "x is '12-'"),
    "another_unit": ("id,x,y,z\nA,12 kg,2,3\n", "NOT_A_NUMBER", 2, "x is '12 kg'"),
    "groups_of_two": ('id,x,y,z\nA,"12,34,567",2,3\n', "NOT_A_NUMBER", 2, "x is '12,34,567'"),
    "only_a_sign": ("id,x,y,z\nA,.,2,3\n", "NOT_A_NUMBER", 2, "x is '.'"),
    "no_name": ("id,x,y,z\n,1,2,3\n", "BAD_TABLE", 2, "the spot has no ID"),
    "twice_the_same": ("id,x,y,z\nA,1,2,3\nB,1,2,3\nA,1,2,3\n", "DUPLICATE_ID", 4,
                       "A stands here and in line 2 with the same position; keep one"),
    "twice_elsewhere": ("id,x,y,z\nA,0,0,0\nA,3,4,0\n", "DUPLICATE_ID", 3,
                        "A stands here and in line 2 with positions 5.00 mm apart; find out which is right"),
    "twice_but_for_case": ("id,x,y,z\nwp1,0,0,0\nWP1,0,0,0\n", "DUPLICATE_ID", 3, "line 2 as wp1 (upper and lower case"),
    "rounded_id": ("id,x,y,z\n1.61544E+06,1,2,3\n", "BAD_TABLE", 2, "ID 1.61544E+06 was rounded by a spreadsheet"),
    "half_an_orientation": ("id,x,y,z,A,B\nA,1,2,3,4,5\n", "MISSING_COLUMN", 1, "has A, B but not c"),
    "half_a_quaternion": ("id,x,y,z,q0,q1,q2,q3\nA,1,2,3,1,0,0,0\n", "MISSING_COLUMN", 1, "q1, q2, q3 but not q4"),
    "half_oriented_row": ("id,x,y,z,a,b,c\nA,1,2,3,4,5,6\nB,1,2,3,4,,6\n", "NOT_A_NUMBER", 3, "has a, c but b is empty"),
    "no_quaternion": ("id,x,y,z,q1,q2,q3,q4\nA,1,2,3,1,0,0,0\nB,1,2,3,1,1,0,0\n", "NOT_A_NUMBER", 3, "length 1.414"),
    "a_quaternion_of_zeros": ("id,x,y,z,q1,q2,q3,q4\nA,1,2,3,0,0,0,0\n", "NOT_A_NUMBER", 2, "length 0 instead of 1"),
    "two_orientations": ("id,x,y,z,a,b,c,q1,q2,q3,q4\nA,1,2,3,90,0,0,1,0,0,0\n", "BAD_TABLE", 2, "90.0 degrees apart"),
    "a_missing_joint": ("id,x,y,z,j1,j3\nA,1,2,3,4,5\n", "MISSING_COLUMN", 1, "has j3 but not j2"),
    "half_a_row_of_joints": ("id,x,y,z,j1,j2\nA,1,2,3,4,\n", "NOT_A_NUMBER", 2, "has j1 but j2 is empty"),
    "a_declared_point": ("decimal=.\nid;x;y;z\nA;1,5;2;3\n", "NOT_A_NUMBER", 3, "the table says decimal=."),
    "xml": ("<?xml version='1.0'?><Workbook/>", "BAD_TABLE", None, "is a web page or XML"),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_bad_table(tmp_path, name):
    text, code, line, words = BAD[name]
    path = tmp_path / "t.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(BadInputError) as error:
        read_table(path)
    issue = error.value.issue
    assert (issue.code, issue.line, issue.path) == (code, line, str(path))
    assert words in issue.message
    assert "\n" not in str(issue)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"id,x,y,z\nA,1,\0,3\n", "is not a text table"),
        (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(600), "old Excel file (.xls)"),
        (b"PK\x03\x04 no archive", "cannot be read as XLSX"),
        (codecs.BOM_UTF16_LE + "id,x,y,z".encode("utf-16-le") + b"\x00", "cut off in the middle of a character"),
        (b"\xef\xbb\xbf", "is empty"),
    ],
    ids=["a_zero_byte", "old_excel", "broken_xlsx", "half_a_utf_16_character", "a_byte_order_mark_only"],
)
def test_bad_bytes(tmp_path, data, words):
    (tmp_path / "t.csv").write_bytes(data)
    with pytest.raises(BadInputError) as error:
        read_table(tmp_path / "t.csv")
    assert error.value.issue.code == "BAD_TABLE"
    assert words in error.value.issue.message


def test_no_file(tmp_path):
    with pytest.raises(BadInputError) as error:
        read_table(tmp_path / "t.xlsx#Sheet1")
    assert error.value.issue.code == "CANNOT_READ"
    assert error.value.issue.path == str(tmp_path / "t.xlsx#Sheet1")
