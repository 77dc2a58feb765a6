"""Cells as they come out of a CSV or XLSX file, before anybody knows what they mean."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from respot.issues import BadInputError

#: No table of spots is larger, bytes (of an XLSX: unpacked).
LARGEST_TABLE = 256 * 1024**2


class Formula(str):
    """A formula without a stored result."""

    __slots__ = ()


class DateText(str):
    """A cell that a spreadsheet took for a date."""

    __slots__ = ()


class Quoted(str):
    """Text behind a spreadsheet's sign for text, an apostrophe: no formula, no comment, no number in disguise."""

    __slots__ = ()


#: A number only where the file itself holds a number (XLSX); everything else is text, without blanks around it.
Cell = str | float


@dataclass(frozen=True)
class Row:
    """One row.

    Parameters
    ----------
    line : int
        Line in the file, from 1.
    cells : sequence of Cell
        Its cells.
    """

    line: int
    cells: Sequence[Cell]

    @property
    def empty(self) -> bool:
        """Whether no cell holds anything."""
        return all(cell == "" for cell in self.cells)

    @property
    def comment(self) -> bool:
        """Whether the row is a comment: its first cell starts with ``#`` (and is no error value of a spreadsheet)."""
        first = self.cells[0] if self.cells else ""
        if isinstance(first, float | Quoted):
            return False
        return first.startswith("#") and first.upper() not in SPREADSHEET_ERRORS


SPREADSHEET_ERRORS = frozenset(
    ("#REF!", "#N/A", "#NV", "#VALUE!", "#WERT!", "#DIV/0!", "#NAME?", "#NUM!", "#ZAHL!", "#BEZUG!")
)


@dataclass(frozen=True)
class Grid:
    """The rows of one sheet.

    Parameters
    ----------
    path : str
        As the user named it, with the sheet where there are several.
    rows : sequence of Row
        Every row, the blank ones too.
    sha256 : str
        Hash of what was read.
    delimiter : str
        Between the cells of a CSV; empty for XLSX.
    ragged : bool
        Whether a row may have fewer or more cells than the header (XLSX).
    sheet : str or None
        Name of the sheet (XLSX).
    """

    path: str
    rows: Sequence[Row]
    sha256: str
    delimiter: str = ""
    ragged: bool = False
    sheet: str | None = None

    def bad(self, message: str, line: int | None = None, code: str = "BAD_TABLE") -> BadInputError:
        """Return the error with the place filled in."""
        return BadInputError(code, message, self.path, line)


def clean(text: str) -> str:
    """Text of a cell without blanks around it, and without the apostrophe that marks it as text."""
    text = text.strip()
    return Quoted(text[1:]) if text.startswith("'") else text


def text_of(cell: Cell) -> str:
    """Text of a cell; whole numbers without the ``.0`` that a spreadsheet's arithmetic adds."""
    if isinstance(cell, str):
        return str(cell)
    return str(int(cell)) if cell.is_integer() and abs(cell) < 1e15 else repr(cell)
