"""Numbers in tables: decimal dot or comma, thousands, and when a table must be refused.

``1,234`` is 1.234 in Germany and 1234 in England: a mistake by a thousand. So one table has one decimal sign, and it is
taken from the cells that can be read in one way only. Groups of three digits that could also be decimals are thousands
only where another cell proves that the table groups its thousands. Where no cell decides, the table is refused.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from respot.issues import BadInputError
from respot.tables.grid import Grid
from respot.tables.units import split_cell

_BLANKS = " \u00a0\u2009\u202f'’"
_SPLIT = re.compile(r"([+\-\u2212]?)\s*([0-9.,][0-9.,\u00a0\u2009\u202f '’]*?)([eE][+\-]?[0-9]+)?")
_SPACED = re.compile(rf"([0-9]{{1,3}})([{_BLANKS}])([0-9]{{3}}(?:\2[0-9]{{3}})*)(?:([.,])([0-9]*))?")
_ONE_SIGN = re.compile(r"([0-9]*)(?:([.,])([0-9]*))?")
_GROUPED = re.compile(r"([1-9][0-9]{0,2})(?:((?:,[0-9]{3})+)(\.)([0-9]*)|((?:\.[0-9]{3})+)(,)([0-9]*))")
_MILLIONS = re.compile(r"([1-9][0-9]{0,2})((?:,[0-9]{3}){2,}|(?:\.[0-9]{3}){2,})")
_MINUS = "\u2212"
_NAMES = {".": "a decimal point", ",": "a decimal comma"}


class Numeral(NamedTuple):
    """A number as it is written.

    Parameters
    ----------
    text : str
        The cell.
    sign, whole, fraction, exponent : str
        Its digits; of an ambiguous one, the digits before and after its sign.
    mark : str
        ``"."``, ``","`` or nothing: the sign that stands in it; of a grouped one, the decimal sign that this proves.
    ambiguous : bool
        The mark may be the decimal sign or group three digits.
    grouped : bool
        Its thousands are grouped with a point or comma.
    spaced : bool
        Its thousands are grouped with a blank or apostrophe.
    unit : str or None
        Unit behind the number.
    """

    text: str
    sign: str
    whole: str
    fraction: str
    exponent: str
    mark: str
    ambiguous: bool = False
    grouped: bool = False
    spaced: bool = False
    unit: str | None = None

    def value(self, decimal: str) -> float:
        """Value with a decimal sign."""
        joined = self.ambiguous and self.mark != decimal
        digits = f"{self.whole}{self.fraction}" if joined else f"{self.whole or '0'}.{self.fraction or '0'}"
        return float(f"{'-' if self.sign in ('-', _MINUS) else ''}{digits}{self.exponent}")


def read_numeral(cell: str) -> Numeral | None:
    """Return the number that a cell holds, with a unit behind it or without; None if it holds none."""
    text, unit = split_cell(cell)
    match = _SPLIT.fullmatch(text)
    if match is None:
        return None
    sign, mantissa, exponent = match[1], match[2], match[3] or ""
    if one := _ONE_SIGN.fullmatch(mantissa):
        whole, mark, fraction = one[1], one[2] or "", one[3] or ""
        if not whole and not fraction:
            return None
        # no one groups the thousands of a number with an exponent, or puts a zero before them
        looks_grouped = len(fraction) == 3 and 1 <= len(whole) <= 3 and whole[0] != "0" and not exponent
        return Numeral(cell, sign, whole, fraction, exponent, mark, ambiguous=bool(mark) and looks_grouped, unit=unit)
    if spaced := _SPACED.fullmatch(mantissa):
        whole = spaced[1] + re.sub(rf"[{_BLANKS}]", "", spaced[3])
        return Numeral(cell, sign, whole, spaced[5] or "", exponent, spaced[4] or "", spaced=True, unit=unit)
    if grouped := _GROUPED.fullmatch(mantissa):
        groups, mark, fraction = (grouped[2], grouped[3], grouped[4]) if grouped[2] else grouped.group(5, 6, 7)
        return Numeral(cell, sign, grouped[1] + _digits(groups), fraction, exponent, mark, grouped=True, unit=unit)
    if millions := _MILLIONS.fullmatch(mantissa):
        mark = "." if millions[2][0] == "," else ","
        return Numeral(cell, sign, millions[1] + _digits(millions[2]), "", exponent, mark, grouped=True, unit=unit)
    return None


def _digits(groups: str) -> str:
    return groups.replace(",", "").replace(".", "")


class Found(NamedTuple):
    """A numeral in its place.

    Parameters
    ----------
    numeral : Numeral
        The number.
    column : str
        Name of its column.
    line : int
        Its line.
    most : float
        Larger values make no sense in its column (angles, quaternions).
    """

    numeral: Numeral
    column: str
    line: int
    most: float = float("inf")

    @property
    def where(self) -> str:
        """For a message."""
        return f"{self.numeral.text!r} in line {self.line}"


def decimal_sign(grid: Grid, found: Sequence[Found], declared: str | None = None) -> str:
    """Find the one decimal sign of a table.

    Parameters
    ----------
    grid : Grid
        The table, for its delimiter and messages.
    found : sequence of Found
        Every number that is written as text.
    declared : str, optional
        ``"."`` or ``","`` where the table itself says it.

    Returns
    -------
    str
        ``"."`` or ``","``; every numeral has one value with it.

    Raises
    ------
    BadInputError
        ``NOT_A_NUMBER`` if two cells contradict each other, ``AMBIGUOUS_NUMBER`` if a cell can be read in two ways and
        nothing in the table tells which is meant.
    """
    certain = [one for one in found if one.numeral.mark and not one.numeral.ambiguous]
    doubtful = [one for one in found if one.numeral.ambiguous]
    sign = _agreed(grid, certain, declared)
    if sign is None:
        return _without_proof(grid, found, doubtful)
    grouping = [one for one in doubtful if one.numeral.mark != sign]
    if grouping and declared is None:
        proven = any(one.numeral.grouped for one in certain)
        bare = next((one for one in found if _bare_thousands(one.numeral, sign)), None)
        if not proven or bare is not None:
            raise _ambiguous(grid, grouping[0], f"the other numbers have {_NAMES[sign]} and no such thousands")
    return sign


def _agreed(grid: Grid, certain: Sequence[Found], declared: str | None) -> str | None:
    dots = [one for one in certain if one.numeral.mark == "."]
    commas = [one for one in certain if one.numeral.mark == ","]
    if declared is not None:
        wrong = next((one for one in certain if one.numeral.mark != declared), None)
        if wrong is not None:
            message = f"{wrong.column} is {wrong.numeral.text!r}, but the table says decimal={declared}"
            raise grid.bad(f"{message}; correct one of them", wrong.line, "NOT_A_NUMBER")
        return declared
    if dots and commas:
        few, many = sorted((dots, commas), key=len)
        message = f"{few[0].column} is {few[0].numeral.text!r}, but {many[0].where} has {_NAMES[many[0].numeral.mark]}"
        raise grid.bad(f"{message}; write every number of the table alike", few[0].line, "NOT_A_NUMBER")
    return dots[0].numeral.mark if dots else commas[0].numeral.mark if commas else None


def _without_proof(grid: Grid, found: Sequence[Found], doubtful: Sequence[Found]) -> str:
    """No cell has a certain decimal sign: the whole table is of whole numbers and of cells like ``1,234``."""
    if not doubtful:
        return "."
    marks = {one.numeral.mark for one in doubtful}
    if len(marks) == 1:
        (mark,) = marks
        other = "," if mark == "." else "."
        # cells of a CSV with , between them hold commas only in quotes
        if mark == "." and grid.delimiter == ",":
            return mark
        too_large = any(abs(one.numeral.value(other)) > one.most for one in doubtful)
        if too_large or any(_bare_thousands(one.numeral, other) for one in found):
            return mark
    raise _ambiguous(grid, doubtful[0], "no other number of the table tells which")


def _bare_thousands(numeral: Numeral, decimal: str) -> bool:
    """Whether a number of four digits and more stands there ungrouped: such a table does not group thousands."""
    if numeral.ambiguous or numeral.grouped or numeral.spaced:
        return False
    return len(numeral.whole.lstrip("0")) >= 4 and not numeral.exponent and numeral.mark in ("", decimal)


def _ambiguous(grid: Grid, one: Found, why: str) -> BadInputError:
    numeral = one.numeral
    mark, other = numeral.mark, "," if numeral.mark == "." else "."
    small, large = f"{numeral.value(mark):g}", f"{numeral.value(other):.0f}"
    message = (
        f"{one.column} is {numeral.text!r}, which can be {small} or {large}: {why}; "
        f"add a line decimal={mark} (for {small}) or decimal={other} (for {large}) above the header"
    )
    return grid.bad(message, one.line, "AMBIGUOUS_NUMBER")


def numbers_or_none(cells: Iterable[str], decimal: str) -> list[float] | None:
    """Values of a column that may hold text: None if a filled cell is no number, NaN for an empty cell.

    A number that could be grouped under the table's decimal sign makes the column text.
    """
    values: list[float] = []
    for cell in cells:
        numeral = read_numeral(cell) if cell else None
        if cell and (numeral is None or numeral.unit or (numeral.mark and numeral.mark != decimal)):
            return None
        values.append(numeral.value(decimal) if numeral else float("nan"))
    return values
