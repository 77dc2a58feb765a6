"""Process Simulate's lists: weld points among other objects, and frames without a header.

Point lists have the header ``Class, ExternalId, Name, Location, X, Y, Z, Type``, class ``PmWeldPoint`` (in Teamcenter
``WeldPointRevision``) and positions in mm; ``Location`` holds ``x,y,z`` in one cell. Frame lists have ``;`` between
cells and no header: name;X;Y;Z;Rx;Ry;Rz in mm and degrees, and a reference frame (facts: craft.md D4).
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence

from respot.issues import Issue
from respot.tables.columns import POSITION, Header, Title
from respot.tables.grid import Cell, Grid, Row, text_of
from respot.tables.numerals import read_numeral

_WELD = re.compile(r"weld(?:point|spot)|spotweld", re.IGNORECASE)
_PLANNING = re.compile(r"pm[a-z]|tx[a-z]|.*revision$", re.IGNORECASE)
_FRAME_TITLES = ("name", "x", "y", "z", "rx", "ry", "rz", "frame")


def weld_rows(grid: Grid, header: Header, rows: Sequence[Row]) -> tuple[Sequence[Row], list[Issue]]:
    """Keep the rows of weld points where the column Class tells weld points from other objects.

    A Class column that knows no weld points and no classes of Process Simulate is a covariate (a safety class, say).

    Raises
    ------
    BadInputError
        ``BAD_TABLE`` if the classes are Process Simulate's and none is a weld point.
    """
    if "class" not in header.names:
        return rows, []
    column = header.names.index("class")
    classes = [text_of(row.cells[column]) if column < len(row.cells) else "" for row in rows]
    others = Counter(name or "no class" for name in classes if not _WELD.search(name))
    shown = ", ".join(f"{count} {name}" for name, count in sorted(others.items()))
    if len(classes) == sum(others.values()):
        if any(_PLANNING.match(name) for name in classes):
            raise grid.bad(f"holds no weld point; by its column Class it holds {shown}", header.line)
        return rows, []
    kept = [row for row, name in zip(rows, classes, strict=True) if _WELD.search(name)]
    message = f"rows that are no weld points by their Class were left out: {shown}"
    return kept, [Issue("TABLE_ROWS", message, grid.path)] if others else []


def fill_names(columns: dict[str, list[Cell]], header: Header) -> None:
    """Take the external ID where a spot has no name."""
    external = next((t for t in header.titles if t.rank is not None and t.name != "id" and _external(t)), None)
    named = header.title("id")
    if external is not None and named is not None and named.text.casefold() == "name":
        pairs = zip(columns["id"], columns[external.name], strict=True)
        columns["id"] = [other if cell == "" else cell for cell, other in pairs]


def _external(title: Title) -> bool:
    return title.name.replace(" ", "").replace("_", "") in ("externalid", "extid")


def fill_positions(grid: Grid, columns: dict[str, list[Cell]], lines: Sequence[int]) -> None:
    """Take x, y, z from ``Location`` in rows where the three cells are empty.

    Raises
    ------
    BadInputError
        ``NOT_A_NUMBER`` if a Location that is needed does not hold three numbers.
    """
    if "location" not in columns or "class" not in columns:
        return
    for name in POSITION:
        columns.setdefault(name, [""] * len(lines))
    for row, line in enumerate(lines):
        location = text_of(columns["location"][row])
        if location and all(columns[name][row] == "" for name in POSITION):
            parts = _three(location)
            if parts is None:
                message = f"Location is {location!r}; three numbers x,y,z are needed, or fill X, Y and Z"
                raise grid.bad(message, line, "NOT_A_NUMBER")
            for name, part in zip(POSITION, parts, strict=True):
                columns[name][row] = part


def _three(text: str) -> list[str] | None:
    inner = text.strip().strip("()[]{}")
    for separator in (r"\s*[;|]\s*", r",\s+", r"\s+", r","):
        parts = re.split(separator, inner.strip())
        if len(parts) == 3 and all(read_numeral(part) for part in parts):
            return parts
    return None


def frame_header(grid: Grid) -> tuple[Header, list[Issue]] | None:
    """Header of a frame list, which has none: seven or eight cells in each row, the second to seventh numbers.

    Raises
    ------
    BadInputError
        ``BAD_TABLE`` if the frames are seen from different reference frames.
    """
    rows = [(index, row) for index, row in enumerate(grid.rows) if not row.empty and not row.comment]
    if not rows or any(len(row.cells) not in (7, 8) for _, row in rows):
        return None
    for _, row in rows:
        cells = [text_of(cell) for cell in row.cells[:7]]
        if read_numeral(cells[0]) is not None or any(read_numeral(cell) is None for cell in cells[1:]):
            return None
    references = {text_of(row.cells[7]): row.line for _, row in rows if len(row.cells) == 8}
    if len(references) > 1:
        (first, _), (second, line) = list(references.items())[:2]
        message = (
            f"has frames seen from {first or 'no frame'!r} and from {second or 'no frame'!r}; export them from one"
        )
        raise grid.bad(message, line)
    seen_from = f", seen from {next(iter(references))!r}" if any(references) else ""
    message = f"has no header; it is read as a frame list: name, x, y, z in mm, rx, ry, rz in degrees{seen_from}"
    index, row = rows[0]
    width = max(len(row.cells) for _, row in rows)
    titles = [Title("id", "name", rank=2), *(Title(name, name) for name in POSITION)]
    titles += [Title(name, text, turn=True) for name, text in (("c", "rx"), ("b", "ry"), ("a", "rz"))]
    titles += [Title("reference frame", "reference frame")] * (width - 7)
    return Header(index - 1, row.line, titles, titles[:1]), [Issue("TABLE_COLUMNS", message, grid.path)]
