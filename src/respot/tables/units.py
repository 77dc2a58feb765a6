"""Units of lengths and angles, as people write them in titles, cells and notes."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass

#: unit -> (kind, size in mm or degrees, how it is called in a message)
UNITS: dict[str, tuple[str, float, str]] = {
    "mm": ("length", 1.0, "mm"),
    "cm": ("length", 10.0, "cm"),
    "m": ("length", 1000.0, "metres"),
    "um": ("length", 0.001, "micrometres"),
    "inch": ("length", 25.4, "inches"),
    "foot": ("length", 304.8, "feet"),
    "deg": ("angle", 1.0, "degrees"),
    "rad": ("angle", math.degrees(1.0), "radians"),
    "gon": ("angle", 0.9, "gon"),
}
_SPELLINGS = {
    "mm": "mm millimeter millimeters millimetre millimetres",
    "cm": "cm centimeter centimeters centimetre centimetres zentimeter",
    "m": "m meter meters metre metres",
    "um": "um µm μm micrometer micrometers mikrometer",
    "inch": "in inch inches zoll \" '' ″",
    "foot": "ft foot feet fuss",
    # a German sheet says Grad for degrees; who means gon writes gon
    "deg": "° deg degs degree degrees grad altgrad",
    "rad": "rad rads radian radians radiant bogenmass",
    "gon": "gon neugrad",
}
_UNIT_OF = {spelling.casefold(): unit for unit, spellings in _SPELLINGS.items() for spelling in spellings.split()}
#: After a blank or underscore these may be anything: x_m is measured as often as it is metres.
_SHORT = frozenset(("m", "in", '"', "''", "″", "gon", "ft"))
_BRACKETED = re.compile(r"(.*?\S)[\s_]*[\[({<]\s*([^\[\](){}<>]+?)\s*[\])}>]", re.DOTALL)
_AFTER_A_WORD = re.compile(r"(.*?\S)(?:\s*/\s*|\s*,\s*|\s+in\s+)([^\s/,]+)", re.DOTALL)
_AFTER_A_BLANK = re.compile(r"(.*?\S)(?:[\s_.]+|(?=°))([^\s_.]+)", re.DOTALL)
_CELL = re.compile(r"(.*[0-9.,])\s*([^0-9.,\s][^0-9]*)", re.DOTALL)
_ENDS_A_NUMBER = frozenset("0123456789.,")
_SAID = re.compile(
    r"\b(?:units?|uom|(?:maß|mass)?einheit(?:en)?"
    r"|(?:dimensions|lengths?|coordinates|positions|values|angles?|maße|masse|längen|koordinaten|positionen|werte|angaben"
    r"|winkel)(?:\s+(?:are|sind))?\s*(?:\bin\b|[:=]))(?!\w)(.*)",
    re.IGNORECASE | re.DOTALL,
)
_FILLERS = frozenset(
    ("and", "und", "are", "is", "sind", "of", "length", "lengths", "angle", "angles", "längen", "winkel")
)


@dataclass(frozen=True)
class Said:
    """A unit and who says so.

    Parameters
    ----------
    unit : str
        A key of `UNITS`.
    by : str
        For a message: "its header", "its cells" ...
    line : int
        Where.
    """

    unit: str
    by: str
    line: int


def unit_of(text: str) -> str | None:
    """Return the unit that a text is, brackets allowed around it; None if it is no unit."""
    return _UNIT_OF.get(text.strip().strip("[](){}<>").strip().casefold().replace("ß", "ss"))


def split_title(title: str) -> tuple[str, str | None]:
    """Split a column's title into name and unit: ``X [mm]``, ``Pos X/mm``, ``x (in)``, ``X_inch``, ``A°``.

    A single letter or ``in`` is a unit only in brackets, after a slash, a comma or the word "in".
    """
    for pattern, short in ((_BRACKETED, True), (_AFTER_A_WORD, True), (_AFTER_A_BLANK, False)):
        match = pattern.fullmatch(title)
        if match and (unit := unit_of(match[2])) and (short or match[2].casefold() not in _SHORT):
            return match[1], unit
    return title, None


def split_cell(text: str) -> tuple[str, str | None]:
    """Split ``12.5 mm`` into number and unit; a text that does not end in a unit comes back whole."""
    match = _CELL.fullmatch(text) if text and text[-1] not in _ENDS_A_NUMBER else None
    if match and (unit := unit_of(match[2])):
        return match[1].rstrip(), unit
    return text, None


def units_said(note: str) -> Iterator[str]:
    """Units that a note above the table states: ``Units: inch, deg``, ``Alle Maße in mm``."""
    match = _SAID.search(note)
    if match is None:
        return
    # "in" is a word before a word, and a unit before anything else
    rest = re.sub(r"\bin\s+(?=\w)", "", match[1].strip(" \t:;,=."), flags=re.IGNORECASE)
    for word in re.split(r"[\s,;:=/|()\[\]]+", rest):
        if unit := unit_of(word.rstrip(".")):
            yield unit
        elif word.casefold() not in _FILLERS:
            return


def kind_of(unit: str) -> str:
    """Return ``"length"`` or ``"angle"``."""
    return UNITS[unit][0]


def size_of(unit: str) -> float:
    """Size of a unit in mm or degrees."""
    return UNITS[unit][1]


def called(unit: str) -> str:
    """How a unit is called in a message."""
    return UNITS[unit][2]
