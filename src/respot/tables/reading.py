"""Reads a spot table: CSV or XLSX in, IDs and arrays in mm and degrees out, every doubt said."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from respot.geometry import Array, rotation_from_abc, rotation_from_quaternion
from respot.issues import BadInputError, Issue
from respot.tables.columns import ANGLES, POSITION, QUATERNION, Header, find_header, nearest_header, settle
from respot.tables.csv_file import read_csv
from respot.tables.grid import LARGEST_TABLE, Cell, DateText, Formula, Grid, Quoted, Row, text_of
from respot.tables.process_simulate import fill_names, fill_positions, frame_header, weld_rows
from respot.tables.quantities import JOINT, Quantities, is_quantity
from respot.tables.repeats import merge_repeats, repeat_columns
from respot.tables.table import Table
from respot.tables.units import Said, kind_of, unit_of, units_said
from respot.tables.xlsx_file import read_xlsx

_SHEET = re.compile(r"(.+\.xls[xm])#(.+)", re.IGNORECASE | re.DOTALL)
_DECIMAL = re.compile(r"\W*(?:decimal|dezimal)\w*\s*[=:]?\s*([.,]|dot|point|punkt|comma|komma)\W*", re.IGNORECASE)
_ROUNDED = re.compile(r"[0-9](?:[.,][0-9]+)?E\+[0-9]+", re.IGNORECASE)
#: A spreadsheet keeps fifteen digits of a number.
_MOST_DIGITS = 1e15
#: Two orientations of a row are the same up to rounding, degrees.
_SAME_TURN = 0.1
_MOST_LISTED = 8


def read_table(path: Path, pose_needed: bool = True) -> Table:
    """Read a spot table.

    CSV (``,`` ``;`` tab or ``|``; UTF-8, UTF-16 or Windows-1252) or XLSX with a header row, below any title lines.
    Columns are found by alias in English and German; lengths in other units become mm and angles degrees, and an issue
    says so. Rows of one ID that a column ``repeat`` (``run``, ``shot``, ``Messung`` ...) tells apart are repeats of one
    spot: it gets their mean. Rows that start with ``#`` are comments. Process Simulate's point and frame lists are
    read as they are.

    Parameters
    ----------
    path : Path
        The file; ``file.xlsx#Sheet`` names a sheet.
    pose_needed : bool
        False for a table of covariates: an ID column is enough.

    Returns
    -------
    Table
        mm and degrees.

    Raises
    ------
    BadInputError
        ``CANNOT_READ``, ``BAD_TABLE``, ``MISSING_COLUMN``, ``NOT_A_NUMBER``, ``AMBIGUOUS_NUMBER``, ``MIXED_UNITS`` or
        ``DUPLICATE_ID``, with the line.
    """
    grid = _grid(path, pose_needed)
    header, issues = _header(grid, pose_needed)
    body, found = _body(grid, header)
    issues += found
    body, row_units = _unit_row(header, body)
    spots, found = weld_rows(grid, header, body)
    issues += found
    if not spots:
        raise grid.bad("holds no spots below its header row; add one row a spot", header.line)
    lines = [row.line for row in spots]
    columns = {
        title.name: [row.cells[index] for row in spots] for index, title in enumerate(header.titles) if title.name
    }
    fill_names(columns, header)
    fill_positions(grid, columns, lines)
    said, decimal = _notes(grid, header)
    said += _unit_column(grid, header, columns, lines)
    quantities = Quantities(grid, header, columns, lines, said, row_units, decimal)
    positions = quantities.values(POSITION)[0] if "x" in columns else None
    rotations, oriented = _rotations(grid, header, quantities, columns, lines)
    numbered = repeat_columns(header.titles)
    table = Table(
        path=grid.path,
        ids=_ids(grid, columns["id"], lines, positions, [columns[title.name] for title in numbered]),
        xyz=positions,
        rotations=rotations,
        lines=lines,
        columns={name: [text_of(cell) for cell in cells] for name, cells in columns.items()},
        sha256=grid.sha256,
        oriented=oriented,
        joints=_joints(grid, header, quantities, columns, "j"),
        measured_joints=_joints(grid, header, quantities, columns, "jm"),
        external_axes=quantities.external_axes(),
        numbers=quantities.covariates(),
        unit=quantities.unit,
        issues=[*issues, *quantities.issues],
    )
    return merge_repeats(table, numbered)


def _grid(path: Path, pose_needed: bool) -> Grid:
    named = _SHEET.fullmatch(str(path)) if not path.exists() else None
    file = Path(named[1]) if named else path
    try:
        if file.is_file() and file.stat().st_size > LARGEST_TABLE:
            raise BadInputError("BAD_TABLE", "is larger than any spot table", str(path))
        data = file.read_bytes()
    except OSError as error:
        raise BadInputError("CANNOT_READ", error.strerror or str(error), str(path)) from error
    # people save CSV under .xls and rename XLSX; the first bytes do not lie
    if data.startswith(b"PK\x03\x04"):
        return read_xlsx(str(file), data, pose_needed, named[2] if named else None)
    if data.startswith(b"\xd0\xcf\x11\xe0"):
        message = "is an old Excel file (.xls), or one with a password; save it as XLSX without a password, or as CSV"
        raise BadInputError("BAD_TABLE", message, str(path))
    if re.match(rb"\s*<(?:!doctype|html|\?xml)", data[:200].removeprefix(b"\xef\xbb\xbf"), re.IGNORECASE):
        raise BadInputError("BAD_TABLE", "is a web page or XML; open it in Excel and save it as XLSX or CSV", str(path))
    return read_csv(str(path), data, pose_needed)


def _header(grid: Grid, pose_needed: bool) -> tuple[Header, list[Issue]]:
    header = find_header(grid.rows, pose_needed)
    if header is None:
        frames = frame_header(grid) if pose_needed and nearest_header(grid.rows) is None else None
        if frames is None:
            raise _no_header(grid, pose_needed)
        header, issues = frames
        settled = settle(grid, header)
    else:
        settled, issues = settle(grid, header), []
        if len(header.ids) > 1:
            others = ", ".join(repr(title.text) for title in header.ids[1:])
            message = f"the spot IDs are taken from its column {header.ids[0].text!r}, not from {others}"
            issues.append(Issue("TABLE_COLUMNS", message, grid.path, header.line))
    turns = [title.text for title in settled.titles if title.turn]
    if turns:
        message = f"{', '.join(turns)} are read as turns about the fixed axes x, then y, then z (KUKA C, B, A)"
        issues.append(Issue("TABLE_COLUMNS", message, grid.path, settled.line if header.index >= 0 else None))
    return settled, issues


def _no_header(grid: Grid, pose_needed: bool) -> BadInputError:
    near = nearest_header(grid.rows)
    if near is None:
        line = next((row.line for row in grid.rows if not row.empty), 1)
        wanted = "id,x,y,z" if pose_needed else "id and what the others are"
        return grid.bad(
            f"has no header row; name the columns in a row above the first spot: {wanted}", line, "MISSING_COLUMN"
        )
    missing = ", ".join(name for name in ("id", *POSITION) if name not in near.names)
    shown = ", ".join(title.text for title in near.titles if title.text)
    message = f"has no column {missing}; its header is: {shown}; rename its columns to id, x, y, z"
    return grid.bad(message, near.line, "MISSING_COLUMN")


def _body(grid: Grid, header: Header) -> tuple[list[Row], list[Issue]]:
    """Rows of spots, each as wide as the header."""
    width = len(header.titles)
    titles = [title.text for title in header.titles]
    rows: list[Row] = []
    skipped: list[int] = []
    for row in grid.rows[header.index + 1 :]:
        if row.empty or [text_of(cell) for cell in row.cells[:width]] == titles:
            continue
        if row.comment:
            skipped.append(row.line)
            continue
        cells = list(row.cells)
        if grid.ragged:
            cells += [""] * (width - len(cells))
        elif len(cells) < width or any(cell != "" for cell in cells[width:]):
            message = f"has {len(cells)} cells where the header has {width}"
            if grid.delimiter == "," and len(cells) > width:
                message += "; commas inside numbers need ; between the cells"
            raise grid.bad(message, row.line)
        rows.append(Row(row.line, cells[:width]))
    if not skipped:
        return rows, []
    more = " ..." if len(skipped) > _MOST_LISTED else ""
    message = f"rows that start with # were left out: {', '.join(map(str, skipped[:_MOST_LISTED]))}{more}"
    return rows, [Issue("TABLE_ROWS", message, grid.path, skipped[0])]


def _unit_row(header: Header, body: list[Row]) -> tuple[list[Row], dict[str, Said]]:
    """Units in a row of their own below the header."""
    if not body:
        return body, {}
    cells = dict(zip(header.names, body[0].cells, strict=True))
    units = {name: unit for name, cell in cells.items() if is_quantity(name) and (unit := unit_of(text_of(cell)))}
    others = [name for name in cells if is_quantity(name) and name not in units]
    if not units or any(name in POSITION or cells[name] != "" for name in others):
        return body, {}
    said = {name: Said(unit, "the row below its header says so", body[0].line) for name, unit in units.items()}
    return body[1:], said


def _notes(grid: Grid, header: Header) -> tuple[list[Said], str | None]:
    """What the lines above the header say about units and the decimal sign."""
    said: list[Said] = []
    decimal: str | None = None
    for row in grid.rows[: max(header.index, 0)]:
        note = (grid.delimiter or " ").join(text_of(cell) for cell in row.cells).strip()
        # the blank cells of a spreadsheet's row are no decimal commas
        if match := _DECIMAL.fullmatch(note) or _DECIMAL.fullmatch(note.rstrip(" ;,\t|")):
            decimal = "," if match[1].lower() in (",", "comma", "komma") else "."
        said += [Said(unit, "a line above its header says so", row.line) for unit in units_said(note)]
    for one in said:
        other = next((each for each in said if kind_of(each.unit) == kind_of(one.unit) and each.unit != one.unit), None)
        if other is not None:
            message = f"says two units above its header, in line {one.line} and here; keep one"
            raise grid.bad(message, other.line, "MIXED_UNITS")
    return said, decimal


def _unit_column(grid: Grid, header: Header, columns: Mapping[str, Sequence[Cell]], lines: Sequence[int]) -> list[Said]:
    """Unit of length in a column of its own; a column Unit that holds anything else is a covariate."""
    title = header.title("unit")
    if title is None:
        return []
    units = [unit_of(text_of(cell)) for cell in columns["unit"]]
    lengths = [unit for unit in units if unit is not None and kind_of(unit) == "length"]
    if not lengths:
        return []
    for unit, line in zip(units, lines, strict=True):
        if unit != lengths[0]:
            message = (
                f"has another unit (or none) in its column {title.text!r} here than in other rows; give all one unit"
            )
            raise grid.bad(message, line, "MIXED_UNITS")
    return [Said(lengths[0], f"its column {title.text!r} says so", lines[0])]


def _ids(
    grid: Grid,
    cells: Sequence[Cell],
    lines: Sequence[int],
    positions: Array | None,
    numbered: Sequence[Sequence[Cell]],
) -> list[str]:
    """IDs of all rows; one stands in several only if columns tell the measurements of a spot apart."""
    seen: dict[str, int] = {}
    measured: dict[tuple[str, ...], int] = {}
    ids: list[str] = []
    for row, (cell, line) in enumerate(zip(cells, lines, strict=True)):
        name = text_of(cell)
        if not name:
            raise grid.bad("the spot has no ID; name it, or delete the row", line)
        if isinstance(cell, Formula):
            raise grid.bad("the ID is a formula without a result; open the table in Excel and save it", line)
        if isinstance(cell, DateText):
            message = f"the ID is a date ({name}): the spreadsheet took it for one; format the column as text"
            raise grid.bad(f"{message} and enter the ID again", line)
        written = grid.delimiter and not isinstance(cell, Quoted) and _ROUNDED.fullmatch(name)
        if written or (isinstance(cell, float) and abs(cell) >= _MOST_DIGITS):
            message = f"the ID {name} was rounded by a spreadsheet; format the column as text and enter the ID again"
            raise grid.bad(message, line)
        first = seen.setdefault(name.casefold(), row)
        marks = [text_of(column[row]).casefold() for column in numbered]
        told = any(marks) and any(text_of(column[first]) for column in numbered)
        same = measured.setdefault((name.casefold(), *marks), row) if told else first
        if same != row:
            raise grid.bad(_twice(name, ids[same], same, row, lines, positions), line, "DUPLICATE_ID")
        ids.append(name)
    return ids


def _twice(name: str, other: str, first: int, row: int, lines: Sequence[int], positions: Array | None) -> str:
    spelt = "" if name == other else f" as {other} (upper and lower case are the same)"
    message = f"{name} stands here and in line {lines[first]}{spelt}"
    if positions is None:
        return f"{message}; keep one"
    apart = float(np.linalg.norm(positions[row] - positions[first]))
    if apart == 0.0:
        return f"{message} with the same position; keep one"
    return (
        f"{message} with positions {apart:.2f} mm apart; find out which is right and keep that one (repeats of one "
        "spot are numbered in a column repeat)"
    )


def _rotations(
    grid: Grid, header: Header, quantities: Quantities, columns: Mapping[str, Sequence[Cell]], lines: Sequence[int]
) -> tuple[Rotation | None, Sequence[bool]]:
    rotation: Rotation | None = None
    oriented = np.zeros(len(lines), dtype=bool)
    for names in (ANGLES, QUATERNION):
        present = [name for name in names if name in columns]
        if present and len(present) < len(names):
            missing = ", ".join(name for name in names if name not in present)
            there = ", ".join(title.text for title in header.titles if title.name in present)
            message = f"has {there} but not {missing}; an orientation needs all of {', '.join(names)}"
            raise grid.bad(message, header.line, "MISSING_COLUMN")
        if not present:
            continue
        values, filled = quantities.values(names, optional=True) if names is ANGLES else quantities.quaternions()
        here = np.array(filled, dtype=bool)
        identity = (0.0, 0.0, 0.0) if names is ANGLES else (1.0, 0.0, 0.0, 0.0)
        made = (rotation_from_abc if names is ANGLES else rotation_from_quaternion)(
            np.where(here[:, None], values, identity)
        )
        if rotation is not None:
            turns = np.degrees((rotation.inv() * made).magnitude())
            for row in map(int, np.flatnonzero(oriented & here & (turns > _SAME_TURN))):
                message = f"a, b, c and q1..q4 are {turns[row]:.1f} degrees apart; correct or remove one of them"
                raise grid.bad(message, lines[row])
            quaternions = np.where(here[:, None], made.as_quat(), rotation.as_quat())
            made = Rotation.from_quat(quaternions)
        rotation, oriented = made, oriented | here
    return (rotation if oriented.any() else None), oriented.tolist()


def _joints(
    grid: Grid, header: Header, quantities: Quantities, columns: Mapping[str, Sequence[Cell]], kind: str
) -> Array | None:
    """Joints 1..k as an (n, k) array, NaN in rows without."""
    numbers = sorted(int(match[2]) for name in columns if (match := JOINT.fullmatch(name)) and match[1] == kind)
    if not numbers:
        return None
    for number in range(1, numbers[-1] + 1):
        if number not in numbers:
            message = f"has {kind}{numbers[-1]} but not {kind}{number}; give the joints of every axis"
            raise grid.bad(message, header.line, "MISSING_COLUMN")
    return quantities.values([f"{kind}{number}" for number in numbers], optional="x" in columns or kind == "jm")[0]
