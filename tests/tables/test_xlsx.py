"""Excel workbooks as people keep them."""

from __future__ import annotations

import datetime
import re
import sys
import zipfile

import numpy as np
import openpyxl
import pytest

from respot.issues import BadInputError
from respot.tables import read_table

GOOD = [["id", "x", "y", "z"], ["S1", 4324.31, -28.43, 1276.51], ["S2", 4322.7, 98.41, 1276.5]]


def book(tmp_path, *sheets, name="t.xlsx"):
    """Write sheets given as (title, rows)."""
    workbook = openpyxl.Workbook()
    workbook.remove(workbook.active)
    for title, rows in sheets:
        sheet = workbook.create_sheet(title)
        for row in rows:
            sheet.append(row)
    workbook.save(tmp_path / name)
    return tmp_path / name


def refusal(path):
    with pytest.raises(BadInputError) as error:
        read_table(path)
    return error.value.issue


def test_numbers_are_numbers(tmp_path):
    table = read_table(book(tmp_path, ("Spots", GOOD)))
    assert table.ids == ["S1", "S2"]
    assert table.positions.tolist() == [[4324.31, -28.43, 1276.51], [4322.7, 98.41, 1276.5]]
    assert (table.lines, table.unit, table.issues) == ([2, 3], "mm", [])


def test_a_workbook_under_another_name(tmp_path):
    assert read_table(book(tmp_path, ("Spots", GOOD), name="spots.csv")).ids == ["S1", "S2"]


def test_numbers_never_need_a_decimal_sign(tmp_path):
    """1.234 as a number of Excel is 1.234; the same as text could be 1234 and is refused."""
    rows = [["id", "x", "y", "z"], ["A", 1.234, 2.345, 3.456]]
    assert read_table(book(tmp_path, ("Spots", rows))).positions.tolist() == [[1.234, 2.345, 3.456]]
    issue = refusal(book(tmp_path, ("Spots", [rows[0], ["A", "1.234", "2.345", 3.456]])))
    assert (issue.code, issue.line) == ("AMBIGUOUS_NUMBER", 2)


def test_numbers_as_german_text(tmp_path):
    rows = [["Punkt", "X", "Y", "Z", "Zeit"], ["A", "4.324,31", "-28,43", 12.5, 3], ["B", "1,5", 2, 3, 4]]
    table = read_table(book(tmp_path, ("Punkte", rows)))
    assert table.positions.tolist() == [[4324.31, -28.43, 12.5], [1.5, 2.0, 3.0]]
    assert table.numbers["zeit"].tolist() == [3.0, 4.0]
    assert table.columns["zeit"] == ["3", "4"]


def test_title_rows_notes_and_gaps(tmp_path):
    rows = [["Rear door, line 2"], [], ["Alle Maße in Zoll"], [], [None, "Schweißpunkt", "X", "Y", "Z", None, "Gun"],
            [None, "A", 1, 2, 3, "a note", "G1"], [], [None, "B", 4, 5, 6]]  # fmt: skip
    path = book(tmp_path, ("Spots", rows))
    workbook = openpyxl.load_workbook(path)
    workbook.active.merge_cells("A1:G1")
    workbook.save(path)
    table = read_table(path)
    assert (table.ids, table.lines, table.unit) == (["A", "B"], [6, 8], "inch")
    assert np.allclose(table.positions, [[25.4, 50.8, 76.2], [101.6, 127.0, 152.4]], rtol=1e-15)
    assert table.columns["gun"] == ["G1", ""]


def test_ids_that_became_numbers(tmp_path):
    path = book(
        tmp_path, ("Spots", [GOOD[0], [1615438, 1, 2, 3], [1615439.0, 1, 2, 3], [17, 1, 2, 3], [12.5, 1, 2, 3]])
    )
    workbook = openpyxl.load_workbook(path)
    workbook.active["A4"].number_format = "00000"
    workbook.save(path)
    assert read_table(path).ids == ["1615438", "1615439", "00017", "12.5"]


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (datetime.datetime(2024, 3, 1), "the ID is a date (2024-03-01"),
        (12345678901234567890, "was rounded by a spreadsheet"),
        ("=B2", "the ID is a formula without a result"),
    ],
)
def test_ids_that_a_spreadsheet_spoiled(tmp_path, value, words):
    issue = refusal(book(tmp_path, ("Spots", [GOOD[0], [value, 1, 2, 3]])))
    assert (issue.code, issue.line) == ("BAD_TABLE", 2)
    assert words in issue.message


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ("=1+1", "y is a formula without a result; open the table in Excel"),
        ("#REF!", "y is the error value #REF!"),
        (None, "y is empty"),
        (True, "y is 'TRUE'"),
        (datetime.date(2024, 3, 1), "y is '2024-03-01"),
        (1e300, "y is '1e+300'; it is too large"),
    ],
)
def test_cells_that_are_no_numbers(tmp_path, value, words):
    issue = refusal(book(tmp_path, ("Spots", [*GOOD, ["S3", 1, value, 3]])))
    assert (issue.code, issue.line) == ("NOT_A_NUMBER", 4)
    assert words in issue.message


def test_formulas_with_their_results(tmp_path):
    """What Excel itself saves: formula and result. Put together by hand, for no library computes."""
    path = book(tmp_path, ("Spots", [GOOD[0], ["S1", "=1+1", 2, 3]]))
    with zipfile.ZipFile(path) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    sheet = files["xl/worksheets/sheet1.xml"].decode()
    changed = re.sub(r"<f>1\+1</f><v ?/?>(</v>)?", "<f>1+1</f><v>2.5</v>", sheet)
    assert changed != sheet
    files["xl/worksheets/sheet1.xml"] = changed.encode()
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    assert read_table(path).positions.tolist() == [[2.5, 2.0, 3.0]]


def test_the_sheet_that_holds_the_table(tmp_path):
    path = book(tmp_path, ("Cover", [["Rear door"]]), ("Empty", []), ("Spots", GOOD))
    table = read_table(path)
    assert (table.ids, table.path) == (["S1", "S2"], f"{path}#Spots")


def test_several_tables(tmp_path):
    other = [GOOD[0], ["T1", 1, 2, 3]]
    path = book(tmp_path, ("Left", GOOD), ("Notes", [["x"]]), ("Right", other))
    issue = refusal(path)
    assert issue.code == "BAD_TABLE"
    assert issue.message == f"holds a table in several sheets: Left, Right; name one, as in {path}#Left"
    assert read_table(path.with_name("t.xlsx#Right")).ids == ["T1"]
    issue = refusal(path.with_name("t.xlsx#Middle"))
    assert issue.message == "has no sheet 'Middle'; its sheets are: Left, Notes, Right"


def test_a_hidden_sheet_is_not_taken_where_another_shows(tmp_path):
    path = book(tmp_path, ("Old", [GOOD[0], ["T1", 1, 2, 3]]), ("New", GOOD))
    workbook = openpyxl.load_workbook(path)
    workbook["Old"].sheet_state = "hidden"
    workbook.active = 1
    workbook.save(path)
    assert read_table(path).ids == ["S1", "S2"]


@pytest.mark.parametrize(
    ("sheets", "code", "words"),
    [
        ([("Spots", [])], "BAD_TABLE", "is empty"),
        ([("Spots", GOOD[:1])], "BAD_TABLE", "holds no spots"),
        ([("A", [["hello"]]), ("B", [["id", "x", "y"], ["S1", 1, 2]])], "MISSING_COLUMN", "has no column z"),
        ([("Spots", [["S1", 1, 2, 3]])], "MISSING_COLUMN", "has no header row"),
    ],
)
def test_workbooks_without_a_table(tmp_path, sheets, code, words):
    issue = refusal(book(tmp_path, *sheets))
    assert issue.code == code
    assert words in issue.message


def test_without_openpyxl(tmp_path, monkeypatch):
    path = book(tmp_path, ("Spots", GOOD))
    monkeypatch.setitem(sys.modules, "openpyxl", None)
    issue = refusal(path)
    assert issue.code == "CANNOT_READ"
    assert "pip install 'respot[excel]'" in issue.message


def archive_with(path, sheet):
    """The workbook with another sheet inside."""
    with zipfile.ZipFile(path) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(name, sheet if name == "xl/worksheets/sheet1.xml" else data)
    return path


SHEET = (
    '<worksheet xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"><sheetData>{}</sheetData></worksheet>'
)


def test_a_zip_bomb(tmp_path):
    path = book(tmp_path, ("Spots", GOOD))
    with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED) as archive, archive.open("xl/media/zeros.bin", "w") as file:
        for _ in range(257):
            file.write(bytes(1024**2))
    assert "unpacks to more than any spot table" in refusal(path).message


@pytest.mark.parametrize(
    "rows",
    [
        '<row r="999999999"><c r="A999999999"><v>1</v></c></row>',
        "".join(f'<row r="{n}"><c r="XFD{n}"><v>1</v></c></row>' for n in range(1, 1500)),
    ],
    ids=["a_row_far_below", "columns_to_the_end"],
)
def test_a_sheet_that_claims_to_be_huge(tmp_path, rows):
    path = archive_with(book(tmp_path, ("Spots", GOOD)), SHEET.format(rows))
    assert "more rows or columns than any spot table" in refusal(path).message


@pytest.mark.parametrize("sheet", ["<worksheet><sheetData><row", SHEET.format('<row r="x"/>'), "\0"])
def test_a_damaged_sheet(tmp_path, sheet):
    issue = refusal(archive_with(book(tmp_path, ("Spots", GOOD)), sheet))
    assert issue.code == "BAD_TABLE"
    assert "open it in Excel and save it again" in issue.message


def test_a_zip_of_something_else(tmp_path):
    with zipfile.ZipFile(tmp_path / "t.xlsx", "w") as archive:
        archive.writestr("readme.txt", "no workbook")
    assert "is a zip archive and no Excel table" in refusal(tmp_path / "t.xlsx").message
