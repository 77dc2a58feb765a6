"""XLSX files, read with openpyxl: which sheet, numbers as numbers, formulas that hold no result."""

from __future__ import annotations

import datetime
import hashlib
import io
import itertools
import re
import warnings
import zipfile
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from respot.issues import BadInputError
from respot.tables.columns import find_header, nearest_header
from respot.tables.grid import LARGEST_TABLE, Cell, DateText, Formula, Grid, Row, clean

if TYPE_CHECKING:
    from openpyxl.workbook import Workbook

#: Rows of a sheet in Excel itself.
_MOST_ROWS = 1_048_576
#: A sheet that is formatted to its last column has this many cells soon; a spot table has not.
_MOST_CELLS = 20_000_000
_FORMULA = re.compile(rb"<(?:\w+:)?f[\s/>]")


def read_xlsx(path: str, data: bytes, pose_needed: bool, sheet: str | None = None) -> Grid:
    """Read the sheet that holds a table.

    Parameters
    ----------
    path : str
        As the user named it.
    data : bytes
        The file.
    pose_needed : bool
        Whether the table needs positions or joints.
    sheet : str, optional
        Name of the sheet; without it the one that has a header.

    Raises
    ------
    BadInputError
        ``CANNOT_READ`` without openpyxl, ``BAD_TABLE`` if the file is damaged or too large, or if several sheets hold a
        table.
    """
    try:
        import openpyxl  # noqa: F401
    except ImportError as error:
        message = "is an Excel table; to read it: pip install 'respot[excel]', or save it as CSV"
        raise BadInputError("CANNOT_READ", message, path) from error
    formulas = _check_archive(path, data)
    grids, hidden = _sheets(path, data, formulas)
    if sheet is not None:
        named = [grid for grid in grids if grid.sheet == sheet]
        if not named:
            names = ", ".join(str(grid.sheet) for grid in grids)
            raise BadInputError("BAD_TABLE", f"has no sheet {sheet!r}; its sheets are: {names}", path)
        return named[0]
    holding = [grid for grid in grids if find_header(grid.rows, pose_needed)]
    shown = [grid for grid in holding if grid.sheet not in hidden] or holding
    if len(shown) > 1:
        names = ", ".join(str(grid.sheet) for grid in shown)
        message = f"holds a table in several sheets: {names}; name one, as in {path}#{shown[0].sheet}"
        raise BadInputError("BAD_TABLE", message, path)
    near = [grid for grid in grids if nearest_header(grid.rows)]
    filled = [grid for grid in grids if not all(row.empty for row in grid.rows)]
    if not filled:
        raise BadInputError("BAD_TABLE", "is empty: a header row id,x,y,z and one row a spot are needed", path)
    return (shown or near or filled)[0]


def _check_archive(path: str, data: bytes) -> bool:
    """Refuse what unpacks to too much; say whether any sheet has formulas."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            if sum(entry.file_size for entry in archive.infolist()) > LARGEST_TABLE:
                raise BadInputError("BAD_TABLE", "unpacks to more than any spot table", path)
            sheets = [
                name for name in archive.namelist() if name.startswith("xl/worksheets/") and name.endswith(".xml")
            ]
            if not sheets:
                raise BadInputError("BAD_TABLE", "is a zip archive and no Excel table", path)
            return any(_FORMULA.search(archive.read(name)) for name in sheets)
    except BadInputError:
        raise
    except Exception as error:
        raise _damaged(path, error) from error


def _damaged(path: str, error: Exception) -> BadInputError:
    message = f"cannot be read as XLSX ({error or type(error).__name__}); open it in Excel and save it again"
    return BadInputError("BAD_TABLE", message, path)


def _sheets(path: str, data: bytes, formulas: bool) -> tuple[list[Grid], set[str]]:
    sha256 = hashlib.sha256(data).hexdigest()
    try:
        with warnings.catch_warnings():
            # openpyxl warns of styles and validations that it does not keep; nothing is written back
            warnings.simplefilter("ignore")
            values = _rows_of_sheets(path, data, data_only=True)
            sources = _rows_of_sheets(path, data, data_only=False) if formulas else {}
    except BadInputError:
        raise
    except Exception as error:
        raise _damaged(path, error) from error
    grids = []
    for name, (_, rows) in values.items():
        if name in sources:
            rows = [_with_formulas(row, source) for row, source in zip(rows, sources[name][1], strict=True)]
        shown = f"{path}#{name}" if len(values) > 1 else path
        grids.append(Grid(shown, rows, sha256, ragged=True, sheet=name))
    return grids, {name for name, (state, _) in values.items() if state != "visible"}


def _rows_of_sheets(path: str, data: bytes, data_only: bool) -> dict[str, tuple[str, list[Row]]]:
    import openpyxl

    book: Workbook = openpyxl.load_workbook(io.BytesIO(data), read_only=True, data_only=data_only, keep_links=False)
    try:
        return {sheet.title: (sheet.sheet_state, list(_rows(path, sheet))) for sheet in book.worksheets}
    finally:
        book.close()


def _rows(path: str, sheet: Any) -> Iterator[Row]:
    # the size that the file claims for a sheet is often wrong
    sheet.reset_dimensions()
    cells = 0
    for number, row in enumerate(sheet.iter_rows(), start=1):
        cells += len(row)
        if number > _MOST_ROWS or cells > _MOST_CELLS:
            message = f"has more rows or columns than any spot table (sheet {sheet.title}); delete what is empty"
            raise BadInputError("BAD_TABLE", message, path)
        yield Row(number, [_cell(cell) for cell in row])


def _cell(cell: Any) -> Cell:
    value = cell.value
    if value is None:
        return ""
    if cell.data_type == "f":
        return Formula(value)
    if isinstance(value, str):
        return clean(value)
    if isinstance(value, bool):
        return str(value).upper()
    if isinstance(value, int | float):
        zeros = str(cell.number_format or "")
        # a number that Excel shows with zeros before it is a name
        if set(zeros) == {"0"} and len(zeros) > 1 and float(value).is_integer():
            return f"{int(value):0{len(zeros)}d}"
        return float(value)
    return DateText(value.isoformat() if isinstance(value, datetime.date | datetime.time) else value)


def _with_formulas(row: Row, source: Row) -> Row:
    """Put the formula where it has no result: a program wrote the file, and no spreadsheet ever computed it."""
    if not any(isinstance(cell, Formula) for cell in source.cells):
        return row
    pairs = itertools.zip_longest(row.cells, source.cells, fillvalue="")
    return Row(row.line, [source if value == "" and isinstance(source, Formula) else value for value, source in pairs])
