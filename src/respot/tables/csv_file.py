"""CSV files: encoding, the sign between the cells, and where the header is."""

from __future__ import annotations

import codecs
import csv
import hashlib
import io
import itertools
import re

from respot.issues import BadInputError
from respot.tables.columns import find_header, nearest_header
from respot.tables.grid import Grid, Row, clean

_DELIMITERS = "\t;|,"
#: Rows from which the delimiter is found.
_BEGINNING = 400
_SEP = re.compile(r'\s*"?sep=(.)"?[;,\t]*\s*', re.IGNORECASE)


def read_csv(path: str, data: bytes, pose_needed: bool) -> Grid:
    """Read the rows of a CSV file: ``,`` ``;`` tab or ``|`` between cells, whichever yields a header.

    Raises
    ------
    BadInputError
        ``BAD_TABLE`` if the file is empty, no text, or has an open quote.
    """
    text = _decode(path, data)
    sha256 = hashlib.sha256(text.encode()).hexdigest()
    first = next((line for line in text.splitlines() if line.strip()), None)
    if first is None:
        raise BadInputError("BAD_TABLE", "is empty: a header row id,x,y,z and one row a spot are needed", path)
    # Excel writes its delimiter into a line of its own
    said = _SEP.fullmatch(first)
    grids: list[Grid] = []
    failed: list[BadInputError] = []
    for delimiter in said[1] if said else _DELIMITERS:
        try:
            grids.append(Grid(path, _rows(path, text, delimiter, _BEGINNING), sha256, delimiter))
        except BadInputError as error:
            failed.append(error)
    if not grids:
        raise max(failed, key=lambda error: error.issue.line or 0)
    delimiter = max(grids, key=lambda grid: _fit(grid, pose_needed)).delimiter
    return Grid(path, _rows(path, text, delimiter), sha256, delimiter)


def _fit(grid: Grid, pose_needed: bool) -> tuple[bool, int, int, int]:
    """How well a delimiter fits: a header, then what comes near one, then cells that follow from it."""
    header = find_header(grid.rows, pose_needed)
    near = header or nearest_header(grid.rows)
    known = len(near.titles) if near else 0
    return header is not None, known, -near.line if near else 0, max(len(row.cells) for row in grid.rows)


def _decode(path: str, data: bytes) -> str:
    try:
        if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
            return data.decode("utf-16")
        if b"\0" in data:
            raise BadInputError("BAD_TABLE", "is not a text table; save it as CSV (UTF-8) or XLSX", path)
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
            raise BadInputError("BAD_TABLE", "is cut off in the middle of a character; save it again", path) from None
    try:
        return data.decode("cp1252")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def _rows(path: str, text: str, delimiter: str, most: int | None = None) -> list[Row]:
    rows: list[Row] = []
    before = 0
    try:
        # an open quote would swallow every row below it without a word
        reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=True, skipinitialspace=True)
        for cells in itertools.islice(reader, most):
            rows.append(Row(before + 1, [clean(cell) for cell in cells]))
            before = reader.line_num
    except csv.Error as error:
        message = f"cannot be read as CSV from here on: {error}; look for a quotation mark that is not closed"
        raise BadInputError("BAD_TABLE", message, path, before + 1) from error
    return rows
