"""What the columns of a table are: names by alias in English and German, and which column holds the ID."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from respot.tables.grid import Cell, Grid, Row, text_of
from respot.tables.units import split_title

#: Titles of ID columns, the likeliest first; a table may have several (name, part number, running number).
_IDS = (
    "id spotid",
    "spot spotname spotnumber spotno spotnr weld weldid weldname weldno weldnr weldnumber weldspot weldspotid "
    "weldspotname weldpoint weldpointid weldpointname weldpointno weldpointnr weldpointnumber wp wpid wpname wpno wpnr "
    "wpnumber point pointid pointname pointno pointnumber locationname punkt punktid punktname punktnr punktnummer "
    "punktbezeichnung schweisspunkt schweisspunktid schweisspunktname schweisspunktnr schweisspunktnummer "
    "schweisspunktbezeichnung sp spid spname spnr spnummer messpunkt messpunktname messpunktnr",
    "name bezeichnung",
    "mfg mfgid mfgname feature featureid featurename target targetname label frame framename",
    "externalid extid",
    "nr no num number nummer lfdnr",
)
_POSITION_WORDS = "pos position coord coordinate koord koordinate lage loc location"
_ANGLE_WORDS = "angle winkel drehung orientation orientierung"


def _position_names(axis: str) -> str:
    words = [f"{word}{axis} {axis}{word}" for word in _POSITION_WORDS.split()]
    return " ".join([axis, f"{axis}wert {axis}value t{axis} trans{axis} translation{axis}", *words])


_NAMES = {
    **{axis: _position_names(axis) for axis in "xyz"},
    **{angle: " ".join([angle, *(f"{word}{angle}" for word in _ANGLE_WORDS.split())]) for angle in "abc"},
    "q1": "q1 qw quatw quaternionw",
    "q2": "q2 qx quatx quaternionx",
    "q3": "q3 qy quaty quaterniony",
    "q4": "q4 qz quatz quaternionz",
    **{f"j{n}": f"j{n} joint{n} axis{n} achse{n} a{n} rax{n}" for n in range(1, 8)},
    **{f"jm{n}": f"jm{n} jointmeasured{n} measuredj{n} measuredjoint{n}" for n in range(1, 8)},
    **{f"e{n}": f"e{n} externalaxis{n} extaxis{n} zusatzachse{n} eax{'abcdef'[n - 1]}" for n in range(1, 7)},
    "unit": "unit units einheit einheiten masseinheit uom",
    "class": "class classname objectclass",
    "location": "location",
}
#: Turns about named axes: read as KUKA's A, B, C, and said.
_TURNS = {
    "a": "rz rotz rotationz anglez winkelz drehungz yaw",
    "b": "ry roty rotationy angley winkely drehungy pitch",
    "c": "rx rotx rotationx anglex winkelx drehungx roll",
}
_CANONICAL = {alias: name for names in (_NAMES, _TURNS) for name, aliases in names.items() for alias in aliases.split()}
_TURN_WORDS = frozenset(alias for aliases in _TURNS.values() for alias in aliases.split())
_RANK = {alias: rank for rank, aliases in enumerate(_IDS) for alias in aliases.split()}

POSITION, ANGLES, QUATERNION = ("x", "y", "z"), ("a", "b", "c"), ("q1", "q2", "q3", "q4")
EXTERNAL = tuple(f"e{n}" for n in range(1, 7))
#: Names that stand for one column only; others are numbered where they share a title.
_ONCE = frozenset(("id", *_NAMES)) - {"unit", "class", "location"}
#: A header stands within this many rows that hold anything.
_PREAMBLE = 200


@dataclass(frozen=True)
class Title:
    """A column's title.

    Parameters
    ----------
    name : str
        Canonical name, or the title in lower case.
    text : str
        As it stands in the table.
    unit : str or None
        Unit that it names.
    rank : int or None
        How likely an ID column it is, 0 the likeliest; None for the others.
    turn : bool
        Whether it is a turn about a named axis, whose convention it does not say.
    """

    name: str
    text: str
    unit: str | None = None
    rank: int | None = None
    turn: bool = False


def plain_word(title: str) -> str:
    """Return a title without case, blanks and separators, as aliases are written."""
    return re.sub(r"[\s._\-/:#'°]", "", title.casefold().replace("ß", "ss"))


def read_title(cell: Cell) -> Title:
    """Return what a header cell means."""
    text = " ".join(text_of(cell).split())
    plain, unit = split_title(text)
    word = plain_word(plain)
    if word in _RANK and unit is None:
        return Title("id", text, rank=_RANK[word])
    if word in _CANONICAL:
        return Title(_CANONICAL[word], text, unit, turn=word in _TURN_WORDS)
    return Title(text.lower(), text)


@dataclass(frozen=True)
class Header:
    """The header row.

    Parameters
    ----------
    index : int
        Which of the grid's rows.
    line : int
        Its line.
    titles : sequence of Title
        One a column; each name once, but for the names of covariates.
    ids : sequence of Title
        Every column that could hold the ID, the one that is taken first.
    """

    index: int
    line: int
    titles: Sequence[Title]
    ids: Sequence[Title] = ()

    def title(self, name: str) -> Title | None:
        """Title of a column, by its name."""
        return next((title for title in self.titles if title.name == name), None)

    @property
    def names(self) -> list[str]:
        """Name of every column."""
        return [title.name for title in self.titles]


def find_header(rows: Sequence[Row], pose_needed: bool = True) -> Header | None:
    """Find the first row that names an ID and a position (or joints, or Process Simulate's Class and Location)."""
    candidates = [_header(index, row) for index, row in _first(rows)]
    for commented in (False, True):
        for header in candidates:
            if rows[header.index].comment is commented and _is_header(header, pose_needed):
                return header
    return None


def nearest_header(rows: Sequence[Row]) -> Header | None:
    """Return the row that names most of id, x, y, z, at least two of them: what the user took for the header."""
    candidates = [_header(index, row) for index, row in _first(rows)]
    best = max(candidates, key=lambda header: len(_needed(header)), default=None)
    return best if best is not None and len(_needed(best)) > 1 else None


def _first(rows: Sequence[Row]) -> list[tuple[int, Row]]:
    return [(index, row) for index, row in enumerate(rows) if not row.empty][:_PREAMBLE]


def _header(index: int, row: Row) -> Header:
    cells = list(row.cells)
    if row.comment:
        cells[0] = text_of(cells[0])[1:].strip()
    titles = [read_title(cell) for cell in cells]
    return Header(index, row.line, titles, sorted((t for t in titles if t.rank is not None), key=lambda t: t.rank or 0))


def _needed(header: Header) -> set[str]:
    return {"id", *POSITION} & set(header.names)


def _is_header(header: Header, pose_needed: bool) -> bool:
    names = set(header.names)
    if "id" not in names:
        return False
    if not pose_needed:
        return len(header.titles) > 1
    return names.issuperset(POSITION) or names.issuperset(("j1", "j2")) or names.issuperset(("class", "location"))


def settle(grid: Grid, header: Header) -> Header:
    """Give every column its own name: one ID, one of each quantity, covariates numbered where they share a title.

    Raises
    ------
    BadInputError
        ``BAD_TABLE`` if two columns are for one quantity.
    """
    first = next((t for t in header.ids), None)
    if first is not None and sum(t.rank == first.rank for t in header.ids) > 1:
        both = " and ".join(repr(t.text) for t in header.ids if t.rank == first.rank)
        raise grid.bad(f"has two columns for id, {both}; remove or rename one", header.line)
    titles: list[Title] = []
    seen: dict[str, int] = {}
    for title in header.titles:
        name = title.text.lower() if title.rank is not None and title is not first else title.name
        if name in _ONCE and name in seen:
            raise grid.bad(f"has two columns for {name}; remove or rename one", header.line)
        seen[name] = seen.get(name, 0) + 1
        unique = name if seen[name] == 1 or not name else f"{name} ({seen[name]})"
        titles.append(Title(unique, title.text, title.unit, title.rank, title.turn))
    return Header(header.index, header.line, titles, header.ids)
