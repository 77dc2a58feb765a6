"""Writes spot tables that `read_table` and Excel read back as they were: the header of INTERFACES, decimal points."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from respot.geometry import abc_from_rotation, quaternion_from_rotation
from respot.issues import BadInputError
from respot.tables.columns import read_title

if TYPE_CHECKING:
    from openpyxl.worksheet._write_only import WriteOnlyWorksheet

#: Text that a spreadsheet would run as a formula or round as a number, and what a reader of tables would skip.
_MARKED = re.compile(r"['=+\-@#\t\r]|[0-9](?:[.,][0-9]+)?E\+[0-9]+\Z", re.IGNORECASE)
_NUMBER = re.compile(r"-?[0-9]+(?:\.[0-9]+)?")
_UNPRINTABLE = re.compile(r"[\x00-\x08\x0b-\x1f\x7f\ud800-\udfff\ufffe\uffff]")
_ANGLE_DECIMALS, _QUATERNION_DECIMALS = 6, 9

#: What a column of a table to be written may hold; None is an empty cell.
Value = str | float | int | None


def write_table(
    path: Path,
    ids: Sequence[str],
    positions: npt.ArrayLike,
    rotations: Rotation | None = None,
    *,
    oriented: Sequence[bool] | None = None,
    quaternions: bool = False,
    columns: Mapping[str, Sequence[Value]] | None = None,
    decimals: int = 3,
) -> None:
    """Write a spot table: CSV with ``,`` between cells, decimal points and LF, or XLSX by the file's name.

    IDs that a spreadsheet would run as a formula (``=`` ``+`` ``-`` ``@``) stand in a CSV behind its own sign for text,
    an apostrophe; `read_table` takes it off.

    Parameters
    ----------
    path : Path
        ``.csv`` or ``.xlsx``; an existing file is replaced.
    ids : sequence of str
        Spot IDs, each once.
    positions : (n, 3) array_like
        mm.
    rotations : Rotation, optional
        Batch of n, written as KUKA a, b, c in degrees.
    oriented : (n,) sequence of bool, optional
        Rows whose orientation is written; all by default.
    quaternions : bool
        Write q1..q4 instead, scalar first.
    columns : mapping of str to (n,) sequence, optional
        Further columns in their order: joints ``j1`` (degrees), external axes ``e1``, ``ci95``, any covariate. Numbers
        are written with all their digits (XLSX: sixteen).
    decimals : int
        Of positions.

    Raises
    ------
    BadInputError
        ``VERIFY_FAILED`` for an ID that would not come back as it was, or a position that is not finite;
        ``CANNOT_READ`` for XLSX without openpyxl.
    ValueError
        Columns of other lengths, or with a title of the table's own.
    """
    rows = np.asarray(positions, dtype=float).reshape(-1, 3)
    _check(path, ids, rows)
    table: dict[str, tuple[Sequence[Value], int | None]] = {"id": (list(ids), None)}
    table |= {axis: (rows[:, index].tolist(), decimals) for index, axis in enumerate("xyz")}
    if rotations is not None:
        names = ("q1", "q2", "q3", "q4") if quaternions else ("a", "b", "c")
        values = quaternion_from_rotation(rotations) if quaternions else abc_from_rotation(rotations)
        places = _QUATERNION_DECIMALS if quaternions else _ANGLE_DECIMALS
        shown = [True] * len(ids) if oriented is None else oriented
        for name, column in zip(names, values.reshape(-1, len(names)).T.tolist(), strict=True):
            table[name] = ([v if has else None for v, has in zip(column, shown, strict=True)], places)
    for name, cells in (columns or {}).items():
        title = read_title(name)
        if (title.name in table and not title.rank) or _UNPRINTABLE.search(name):
            raise ValueError(f"a column {name!r} cannot stand beside the table's own")
        table[name] = (cells, None)
    if any(len(cells) != len(ids) for cells, _ in table.values()):
        raise ValueError("every column needs one value a spot")
    (_write_xlsx if path.suffix.lower() == ".xlsx" else _write_csv)(path, table)


def _check(path: Path, ids: Sequence[str], positions: np.typing.NDArray[np.float64]) -> None:
    seen: set[str] = set()
    for name, position in zip(ids, positions, strict=True):
        if not name or name != name.strip() or _UNPRINTABLE.search(name):
            message = f"the ID {name!r} is empty, has blanks around it or signs that no table can hold; rename the spot"
            raise BadInputError("VERIFY_FAILED", message, str(path))
        if name.casefold() in seen:
            raise BadInputError("VERIFY_FAILED", f"the ID {name!r} would stand twice in the table", str(path))
        if not np.isfinite(position).all():
            raise BadInputError("VERIFY_FAILED", f"the position of {name!r} is not finite", str(path))
        seen.add(name.casefold())


def _rows(table: Mapping[str, tuple[Sequence[Value], int | None]]) -> Iterator[list[Value]]:
    """Cells of each row; numbers rounded as they are written, without a negative zero, NaN as an empty cell."""
    for cells in zip(*(column for column, _ in table.values()), strict=True):
        row: list[Value] = []
        for cell, (_, places) in zip(cells, table.values(), strict=True):
            if cell is None or isinstance(cell, str | int):
                row.append(cell)
            else:
                number = float(cell) if places is None else round(float(cell), places)
                row.append(None if np.isnan(number) else number + 0.0)
        yield row


def _write_csv(path: Path, table: Mapping[str, tuple[Sequence[Value], int | None]]) -> None:
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    places = [number for _, number in table.values()]
    writer.writerow([_marked(name) for name in table])
    for row in _rows(table):
        writer.writerow([_text(cell, number) for cell, number in zip(row, places, strict=True)])
    path.write_text(text.getvalue(), encoding="utf-8", newline="\n")


def _text(cell: Value, places: int | None) -> str:
    if cell is None:
        return ""
    if isinstance(cell, str):
        return _marked(cell)
    return str(cell) if places is None else f"{cell:.{places}f}"


def _marked(text: str) -> str:
    return f"'{text}" if _MARKED.match(text) and not _NUMBER.fullmatch(text) else text


def _write_xlsx(path: Path, table: Mapping[str, tuple[Sequence[Value], int | None]]) -> None:
    try:
        import openpyxl
        from openpyxl.cell import WriteOnlyCell
    except ImportError as error:
        message = "is an Excel table; to write it: pip install 'respot[excel]', or write CSV"
        raise BadInputError("CANNOT_READ", message, str(path)) from error
    book = openpyxl.Workbook(write_only=True)
    sheet: WriteOnlyWorksheet = book.create_sheet("spots")
    header: list[Value] = list(table)
    for row in (header, *_rows(table)):
        cells = []
        for value in row:
            # no formula runs from a text cell; only what a reader would take for a comment is marked
            marked = isinstance(value, str) and value.startswith(("'", "#"))
            cell = WriteOnlyCell(sheet, f"'{value}" if marked else value)
            if isinstance(value, str):
                # openpyxl takes a text that starts with = for a formula, and #N/A for an error
                cell.data_type = "s"
            cells.append(cell)
        sheet.append(cells)
    book.save(path)
