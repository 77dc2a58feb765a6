"""Cells become numbers in mm and degrees: one decimal sign and one unit for what belongs together."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np

from respot.geometry import Array
from respot.issues import Issue
from respot.tables.columns import ANGLES, EXTERNAL, POSITION, QUATERNION, Header, Title
from respot.tables.grid import SPREADSHEET_ERRORS, Cell, Formula, Grid, text_of
from respot.tables.numerals import Found, Numeral, decimal_sign, numbers_or_none, read_numeral
from respot.tables.units import Said, called, kind_of, size_of

#: No spot is farther from anything, mm.
_FARTHEST = 1e7
#: Orientations are not written with more than two turns, degrees.
_MOST_ANGLE = 720.0
#: Controllers write 9E9 for an external axis that is not there (facts: rapid.md, extax).
_NOT_CONNECTED = 9e8
_QUATERNION_TOLERANCE = 1e-2
#: What people put into a cell that is meant to be empty.
_PLACEHOLDERS = frozenset(("-", "--", "–", "—", "n/a"))
JOINT = re.compile(r"(jm?)([1-7])")


def is_quantity(name: str) -> bool:
    """Whether a column holds numbers that this room understands."""
    return name in (*POSITION, *ANGLES, *QUATERNION, *EXTERNAL) or JOINT.fullmatch(name) is not None


def groups_of(names: Sequence[str]) -> list[tuple[str, ...]]:
    """Quantities that share one unit: positions, angles, each kind of joints; external axes each for itself."""
    joints = [tuple(n for n in names if (m := JOINT.fullmatch(n)) and m[1] == kind) for kind in ("j", "jm")]
    every = [POSITION, ANGLES, QUATERNION, *joints, *((name,) for name in EXTERNAL)]
    return [group for group in (tuple(n for n in each if n in names) for each in every) if group]


class Quantities:
    """The numbers of a table.

    Parameters
    ----------
    grid : Grid
        For messages.
    header : Header
        The titles.
    columns : mapping of str to sequence of Cell
        Cells by column.
    lines : sequence of int
        Line of each row.
    said : sequence of Said
        Units that stand above the table or in a column of their own.
    row_units : mapping of str to Said
        Units in a row below the header, by column.
    decimal : str or None
        Decimal sign where the table itself says it.

    Raises
    ------
    BadInputError
        ``NOT_A_NUMBER``, ``AMBIGUOUS_NUMBER`` or ``MIXED_UNITS``, with the line.
    """

    def __init__(
        self,
        grid: Grid,
        header: Header,
        columns: Mapping[str, Sequence[Cell]],
        lines: Sequence[int],
        said: Sequence[Said] = (),
        row_units: Mapping[str, Said] | None = None,
        decimal: str | None = None,
    ) -> None:
        self._grid, self._header, self._lines, self._said = grid, header, lines, said
        self._row_units = row_units or {}
        self._cells = {name: self._read(name, cells) for name, cells in columns.items() if is_quantity(name)}
        found = [
            Found(cell, name, line, _MOST_ANGLE if name in ANGLES else 1.5 if name in QUATERNION else float("inf"))
            for name, cells in self._cells.items()
            for cell, line in zip(cells, lines, strict=True)
            if isinstance(cell, Numeral)
        ]
        self.decimal = decimal_sign(grid, found, decimal)
        self.unit = "mm"
        self.issues: list[Issue] = []
        self._sizes: dict[str, float] = {}
        for group in groups_of(list(self._cells)):
            self._settle_unit(group)
        stay = [name for name in EXTERNAL if name in self._cells and self._stated(name) is None]
        if self.unit != "mm" and stay:
            message = f"{', '.join(stay)} have no unit and stay as they are"
            self.issues.append(Issue("TABLE_UNITS", message, grid.path, header.line))
        self._covariates = {name: cells for name, cells in columns.items() if name and not is_quantity(name)}

    def values(self, names: Sequence[str], optional: bool = False) -> tuple[Array, Sequence[bool]]:
        """Return the numbers of columns in mm and degrees, and which rows are filled.

        Parameters
        ----------
        names : sequence of str
            Columns that belong together.
        optional : bool
            Whether a row may be empty in all of them; NaN then.

        Returns
        -------
        values : (n, k) array
            mm, degrees, or as the table has them.
        filled : (n,) sequence of bool
            Whether the row has them.

        Raises
        ------
        BadInputError
            ``NOT_A_NUMBER`` for a cell that is empty, or too large for anything.
        """
        values = np.full((len(self._lines), len(names)), np.nan)
        for index, name in enumerate(names):
            size = self._sizes.get(name, 1.0)
            for row, cell in enumerate(self._cells[name]):
                if cell is not None:
                    values[row, index] = (cell if isinstance(cell, float) else cell.value(self.decimal)) * size
        for row, index in np.argwhere(~np.isnan(values) & ~(np.abs(values) < _FARTHEST)):
            self._refuse(names[index], int(row), "is too large; a finite number in mm or degrees is needed")
        filled = ~np.isnan(values).any(axis=1)
        for row in map(int, np.flatnonzero(~filled)):
            empty = [name for name, value in zip(names, values[row], strict=True) if np.isnan(value)]
            if not optional:
                message = f"{' and '.join(empty)} {'is' if len(empty) == 1 else 'are'} empty"
                advice = "fill in a number, or delete the row if the spot has none"
                raise self._grid.bad(f"{message}; {advice}", self._lines[row], "NOT_A_NUMBER")
            if len(empty) < len(names):
                there = ", ".join(name for name in names if name not in empty)
                message = f"has {there} but {', '.join(empty)} is empty; fill in all {len(names)} or none"
                raise self._grid.bad(message, self._lines[row], "NOT_A_NUMBER")
        return values, filled.tolist()

    def external_axes(self) -> Array | None:
        """Return e1..e6, (n, 6), NaN where empty or not connected; None for a table without."""
        present = [name for name in EXTERNAL if name in self._cells]
        if not present:
            return None
        values = np.full((len(self._lines), len(EXTERNAL)), np.nan)
        for name in present:
            for row, cell in enumerate(self._cells[name]):
                number = np.nan if cell is None else cell if isinstance(cell, float) else cell.value(self.decimal)
                if abs(number) < _NOT_CONNECTED:
                    values[row, EXTERNAL.index(name)] = number * self._sizes.get(name, 1.0)
        return values

    def quaternions(self) -> tuple[Array, Sequence[bool]]:
        """Return q1..q4 of unit length, and which rows have them.

        Raises
        ------
        BadInputError
            ``NOT_A_NUMBER`` for a length that is off by more than rounding: then these are no quaternions.
        """
        values, filled = self.values(QUATERNION, optional=True)
        norms = np.linalg.norm(values, axis=1)
        off = np.array(filled, dtype=bool) & ~(np.abs(norms - 1.0) <= _QUATERNION_TOLERANCE)
        for row in map(int, np.flatnonzero(off)):
            message = f"the quaternion q1..q4 has length {norms[row]:.4g} instead of 1; correct it or clear it"
            raise self._grid.bad(message, self._lines[row], "NOT_A_NUMBER")
        return values / norms[:, None], filled

    def covariates(self) -> dict[str, Array]:
        """Return every other column that holds numbers only, NaN where a cell is empty."""
        found: dict[str, Array] = {}
        for name, cells in self._covariates.items():
            texts = [cell for cell in cells if isinstance(cell, str)]
            numbers = numbers_or_none(texts, self.decimal)
            if numbers is not None and any(cell != "" for cell in cells):
                rest = iter(numbers)
                found[name] = np.array([next(rest) if isinstance(cell, str) else cell for cell in cells])
        return found

    def _read(self, name: str, cells: Sequence[Cell]) -> list[Numeral | float | None]:
        return [self._cell(name, cell, row) for row, cell in enumerate(cells)]

    def _cell(self, name: str, cell: Cell, row: int) -> Numeral | float | None:
        if isinstance(cell, float):
            return cell
        if not cell or (name not in POSITION and cell.lower() in _PLACEHOLDERS):
            return None
        numeral = read_numeral(cell)
        if numeral is not None:
            return numeral
        line = self._lines[row]
        if isinstance(cell, Formula):
            message = f"{name} is a formula without a result; open the table in Excel, save it and try again"
        elif cell.upper() in SPREADSHEET_ERRORS:
            message = f"{name} is the error value {cell!s}; repair its formula in the spreadsheet"
        else:
            message = f"{name} is {str(cell)!r}; a finite number in mm or degrees is needed"
        raise self._grid.bad(message, line, "NOT_A_NUMBER")

    def _refuse(self, name: str, row: int, what: str) -> None:
        cell = self._cells[name][row]
        shown = cell.text if isinstance(cell, Numeral) else text_of(cell or 0.0)
        raise self._grid.bad(f"{name} is {shown!r}; it {what}", self._lines[row], "NOT_A_NUMBER")

    def _settle_unit(self, group: Sequence[str]) -> None:
        """Find the unit of columns that belong together, from titles, cells and what stands above the table."""
        first = group[0]
        kind = "length" if first in POSITION else "none" if first in QUATERNION else "angle"
        default = {"length": "mm", "angle": "deg"}.get(kind)
        any_kind = first in EXTERNAL or JOINT.fullmatch(first) is not None
        stated = {name: self._stated(name) for name in group}
        units = {said.unit for said in stated.values() if said is not None}
        said = next((one for one in stated.values() if one is not None), None)
        if len(units) > 1 or (units and None in stated.values() and units != {default}):
            each = ", ".join(f"{name} in {called(one.unit) if one else 'no unit'}" for name, one in stated.items())
            line = said.line if said else self._header.line
            raise self._grid.bad(f"mixes units: {each}; give all of them one unit", line, "MIXED_UNITS")
        if first not in EXTERNAL:
            for general in self._said:
                if kind_of(general.unit) != kind:
                    continue
                if said is not None and said.unit != general.unit:
                    message = f"is in {called(general.unit)} by {general.by} and in {called(said.unit)} by {said.by}"
                    raise self._grid.bad(f"{message} for {', '.join(group)}; correct one", said.line, "MIXED_UNITS")
                said = said or general
        if said is None:
            return
        if kind_of(said.unit) != kind and not any_kind:
            what = "a length" if kind == "length" else "an angle" if kind == "angle" else "a number without a unit"
            raise self._grid.bad(
                f"has {', '.join(group)} in {called(said.unit)}, where {what} is needed; correct the unit",
                said.line,
                "MIXED_UNITS",
            )
        if group[0] in POSITION:
            self.unit = said.unit
        size = size_of(said.unit)
        if size != 1.0:
            self._sizes.update(dict.fromkeys(group, size))
            into = "mm" if kind_of(said.unit) == "length" else "degrees"
            message = f"{', '.join(group)} are in {called(said.unit)} ({said.by}) and were converted to {into}"
            self.issues.append(Issue("TABLE_UNITS", message, self._grid.path, said.line))

    def _stated(self, name: str) -> Said | None:
        """Unit of one column, by its title, the row below the title, and its cells."""
        title: Title | None = self._header.title(name)
        said = [Said(title.unit, "its header says so", self._header.line)] if title and title.unit else []
        if name in self._row_units:
            said.append(self._row_units[name])
        with_unit = [
            Said(cell.unit, "its cells say so", line)
            for cell, line in zip(self._cells[name], self._lines, strict=True)
            if isinstance(cell, Numeral) and cell.unit is not None
        ]
        said += with_unit
        units = {one.unit for one in said}
        if len(units) > 1:
            first, other = said[0], next(one for one in said if one.unit != said[0].unit)
            message = f"has {name} in {called(first.unit)} (line {first.line}) and in {called(other.unit)}"
            raise self._grid.bad(f"{message}; give the column one unit", other.line, "MIXED_UNITS")
        bare = [
            line
            for cell, line in zip(self._cells[name], self._lines, strict=True)
            if cell is not None and not (isinstance(cell, Numeral) and cell.unit)
        ]
        if len(said) == len(with_unit) and with_unit and bare and size_of(with_unit[0].unit) != 1.0:
            message = f"has {name} in {called(with_unit[0].unit)} in line {with_unit[0].line} and without a unit here"
            raise self._grid.bad(f"{message}; give every cell its unit, or the header", bare[0], "MIXED_UNITS")
        return said[0] if said else None
