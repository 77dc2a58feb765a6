"""Spot tables from CSV files: columns by alias, decimal point or comma, one message per bad cell."""

from __future__ import annotations

import csv
import hashlib
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from respot.geometry import Array, rotation_from_abc, rotation_from_quaternion
from respot.issues import BadInputError

#: Names that people give to the columns, in lower case without blanks, points, underscores and units.
_ALIASES = {
    "id": ("id", "name", "spot", "spotid", "spotname", "punkt", "punktname", "externalid", "weldname", "weldpoint"),
    "x": ("x", "posx", "xpos", "xcoord"),
    "y": ("y", "posy", "ypos", "ycoord"),
    "z": ("z", "posz", "zpos", "zcoord"),
    "a": ("a", "rz"),
    "b": ("b", "ry"),
    "c": ("c", "rx"),
    "q1": ("q1", "qw"),
    "q2": ("q2", "qx"),
    "q3": ("q3", "qy"),
    "q4": ("q4", "qz"),
}
_CANONICAL = {alias: name for name, aliases in _ALIASES.items() for alias in aliases}
_NEEDED = ("id", "x", "y", "z")
_ANGLES, _QUATERNION = ("a", "b", "c"), ("q1", "q2", "q3", "q4")
_UNIT = re.compile(r"[\[(]?(?:mm|deg|°)[\])]?$")
#: No spot is farther from anything, mm; nan and infinities fail this as well.
_FARTHEST = 1e7
#: No table of spots is larger.
_LARGEST_TABLE = 256 * 1024**2


@dataclass(frozen=True, eq=False)
class Table:
    """A spot table.

    Parameters
    ----------
    path : str
        As the user named it.
    ids : sequence of str
        Spot IDs, each once.
    positions : (n, 3) array
        mm.
    rotations : Rotation or None
        Batch of n, where the table has orientations.
    lines : sequence of int
        Line of each row, from 1.
    columns : mapping of str to sequence of str
        Every column as text, by its header in lower case.
    sha256 : str
        Hash of the table's text.
    """

    path: str
    ids: Sequence[str]
    positions: Array
    rotations: Rotation | None
    lines: Sequence[int]
    columns: Mapping[str, Sequence[str]]
    sha256: str


def read_table(path: Path) -> Table:
    """Read a spot table with a header row, ``;``, ``,`` or tab between cells, dot or comma decimals.

    Raises
    ------
    BadInputError
        ``CANNOT_READ``, ``BAD_TABLE``, ``MISSING_COLUMN``, ``NOT_A_NUMBER`` or ``DUPLICATE_ID``, with the line.
    """
    text = _read_text(path)
    lines = text.splitlines()
    # Excel writes its delimiter into a line of its own
    start = next((n for n, line in enumerate(lines) if line.strip() and not line.startswith("sep=")), None)
    if start is None:
        raise BadInputError("BAD_TABLE", "is empty: a header row id,x,y,z and one row a spot are needed", str(path))
    delimiter = max(";,\t", key=lines[start].count)
    rows = _rows(path, lines, start, delimiter)
    header = [_canonical(cell) for cell in rows[0][1]]
    for name in _NEEDED:
        if name not in header:
            found = ", ".join(cell.strip() for cell in rows[0][1])
            raise BadInputError("MISSING_COLUMN", f"has no column {name}; its header is: {found}", str(path), start + 1)
    for name in _CANONICAL.values():
        if header.count(name) > 1:
            raise BadInputError("BAD_TABLE", f"has two columns for {name}; remove or rename one", str(path), start + 1)
    body = [(line, cells) for line, cells in rows[1:] if any(cell.strip() for cell in cells)]
    if not body:
        raise BadInputError("BAD_TABLE", "holds no spots below its header row", str(path), start + 1)
    for line, cells in body:
        if len(cells) != len(header):
            raise BadInputError(
                "BAD_TABLE", f"has {len(cells)} cells where the header has {len(header)}", str(path), line
            )
    columns = {name: [cells[index].strip() for _, cells in body] for index, name in enumerate(header)}
    numbers = [line for line, _ in body]
    return Table(
        path=str(path),
        ids=_ids(path, columns["id"], numbers),
        positions=np.column_stack([_numbers(path, columns, name, numbers, delimiter) for name in "xyz"]),
        rotations=_rotations(path, columns, numbers, delimiter),
        lines=numbers,
        columns=columns,
        sha256=hashlib.sha256(text.encode()).hexdigest(),
    )


def _read_text(path: Path) -> str:
    try:
        if path.is_file() and path.stat().st_size > _LARGEST_TABLE:
            raise BadInputError("BAD_TABLE", "is larger than any spot table", str(path))
        data = path.read_bytes()
    except OSError as error:
        raise BadInputError("CANNOT_READ", error.strerror or str(error), str(path)) from error
    if b"\0" in data:
        raise BadInputError("BAD_TABLE", "is not a text table; save it as CSV", str(path))
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def _rows(path: Path, lines: list[str], start: int, delimiter: str) -> list[tuple[int, list[str]]]:
    reader = csv.reader(lines[start:], delimiter=delimiter)
    try:
        return [(reader.line_num + start, row) for row in reader if row]
    except csv.Error as error:
        raise BadInputError(
            "BAD_TABLE", f"cannot be read as CSV: {error}", str(path), reader.line_num + start
        ) from error


def _canonical(cell: str) -> str:
    name = cell.strip().lower()
    bare = _UNIT.sub("", re.sub(r"[\s._-]", "", name))
    return _CANONICAL.get(bare, name)


def _ids(path: Path, cells: Sequence[str], lines: Sequence[int]) -> list[str]:
    seen: dict[str, int] = {}
    for cell, line in zip(cells, lines, strict=True):
        if not cell:
            raise BadInputError("BAD_TABLE", "the spot has no ID", str(path), line)
        if cell.casefold() in seen:
            message = f"{cell} stands here and in line {seen[cell.casefold()]}; keep one"
            raise BadInputError("DUPLICATE_ID", message, str(path), line)
        seen[cell.casefold()] = line
    return list(cells)


def _numbers(
    path: Path, columns: Mapping[str, Sequence[str]], name: str, lines: Sequence[int], delimiter: str
) -> list[float]:
    return [_number(path, cell, name, line, delimiter) for cell, line in zip(columns[name], lines, strict=True)]


def _number(path: Path, cell: str, name: str, line: int, delimiter: str) -> float:
    text = cell.replace(",", ".") if delimiter != "," else cell
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not abs(value) < _FARTHEST:
        raise BadInputError(
            "NOT_A_NUMBER", f"{name} is {cell!r}; a finite number in mm or degrees is needed", str(path), line
        )
    return value


def _rotations(
    path: Path, columns: Mapping[str, Sequence[str]], lines: Sequence[int], delimiter: str
) -> Rotation | None:
    for names, make in ((_ANGLES, rotation_from_abc), (_QUATERNION, rotation_from_quaternion)):
        present = [name for name in names if name in columns]
        if present and len(present) < len(names):
            missing = ", ".join(name for name in names if name not in present)
            raise BadInputError("MISSING_COLUMN", f"has {', '.join(present)} but not {missing}", str(path))
        if present:
            values = np.column_stack([_numbers(path, columns, name, lines, delimiter) for name in names])
            if names is _QUATERNION and not (np.linalg.norm(values, axis=1) > 0.0).all():
                row = int(np.argmin(np.linalg.norm(values, axis=1)))
                raise BadInputError("NOT_A_NUMBER", "the quaternion is all zero", str(path), lines[row])
            return make(values)
    return None
