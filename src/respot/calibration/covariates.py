"""Columns of a spot table beside its poses: what each may mean, numbers or levels, dates among them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Rows = NDArray[np.intp]
Role = Literal["time", "counter", "force", "temperature", "group", "approach", "other"]

#: What a column's name says of its meaning, the first that fits.
_ROLES: tuple[tuple[Role, re.Pattern[str]], ...] = (
    ("approach", re.compile(r"approach_a([1-7])")),
    (
        "counter",
        re.compile(r"(welds?|spots?|punkte)_(since|seit|count|on).*|.*(dress|kappe|fr(ae|ä)s|tip).*|caps?(_.*)?"),
    ),
    ("force", re.compile(r".*(force|kraft|squeeze).*|f_n|press(ure)?")),
    ("temperature", re.compile(r".*temp.*")),
    (
        "time",
        re.compile(r"(.*[_ ])?(time|timestamp|zeit|date|datum|datetime|clock|uhrzeit|minutes?)([_ ].*)?|t_(min|s|h)"),
    ),
    (
        "group",
        re.compile(
            r"(.*_)?(station|fixture|vorrichtung|spanner|program|programm|prg|folge|session|messreihe|cell|zelle|tool"
            r"|werkzeug|base|basis|wobj|workobject|gun|zange|robot|roboter|side|seite)(_?(no|id|name|nr))?"
        ),
    ),
)
_FORMATS = (
    "%Y-%m-%d %H:%M:%S",
    "%Y-%m-%dT%H:%M:%S",
    "%Y-%m-%d %H:%M",
    "%Y-%m-%dT%H:%M",
    "%Y-%m-%d",
    "%d.%m.%Y %H:%M:%S",
    "%d.%m.%Y %H:%M",
    "%d.%m.%Y",
    "%m/%d/%Y %H:%M:%S",
    "%m/%d/%Y %H:%M",
    "%m/%d/%Y",
    "%d/%m/%Y %H:%M:%S",
    "%d/%m/%Y %H:%M",
    "%d/%m/%Y",
    "%H:%M:%S",
    "%H:%M",
)
LEAST_OF_A_LEVEL = 3
"""A level with fewer spots than this is no group that could be judged."""
_MOST_LEVELS = 24
_MOST_NUMERIC_LEVELS = 10


@dataclass(frozen=True, eq=False)
class Covariate:
    """One column.

    Attributes
    ----------
    name : str
    role : str
        What its name says that it is.
    values : (n,) array or None
        Numbers, in every row; dates in minutes.
    labels : tuple of n str or None
        Texts, or numbers of few levels, as levels; empty where a cell is.
    """

    name: str
    role: Role
    values: Array | None
    labels: tuple[str, ...] | None

    @cached_property
    def levels(self) -> tuple[str, ...]:
        """Levels with at least `LEAST_OF_A_LEVEL` spots, in order of their names; none if one holds all spots."""
        if self.labels is None:
            return ()
        names, counts = np.unique(np.array(self.labels, dtype=object).astype(str), return_counts=True)
        kept = [str(n) for n, c in zip(names, counts, strict=True) if n and c >= LEAST_OF_A_LEVEL]
        return tuple(kept) if len(names) > 1 else ()

    def of_level(self, level: str) -> Array:
        """1 at the spots of a level, 0 elsewhere, shape (n,)."""
        assert self.labels is not None  # noqa: S101 - asked for a level of it
        return np.array([float(label == level) for label in self.labels])

    def rows(self, rows: Rows) -> Covariate:
        """Return the column of some spots."""
        values = None if self.values is None else self.values[rows]
        return Covariate(
            self.name, self.role, values, None if self.labels is None else tuple(self.labels[r] for r in rows)
        )


def role_of(name: str) -> Role:
    """What a column's name says that it holds."""
    plain = name.strip().casefold()
    return next((role for role, pattern in _ROLES if pattern.fullmatch(plain)), "other")


def covariates_of(
    texts: Mapping[str, Sequence[str]], numbers: Mapping[str, Array], skip: Sequence[str], *, constant: bool = False
) -> tuple[dict[str, Covariate], dict[str, str]]:
    """Columns that can be used, and why others cannot.

    Parameters
    ----------
    texts : mapping of str to sequence of n str
        Every column as text.
    numbers : mapping of str to (n,) array
        Those that are numbers in every filled cell.
    skip : sequence of str
        Columns that are something else: the ID, the pose.
    constant : bool
        Keep columns that are the same everywhere: of no use to find an effect, but to predict by one.

    Returns
    -------
    (dict of str to Covariate, dict of str to str)
        Columns by name; names of those left out, with the reason.
    """
    found: dict[str, Covariate] = {}
    unused: dict[str, str] = {}
    for name, cells in texts.items():
        if not name or name in skip:
            continue
        made = _covariate(name, list(cells), numbers.get(name), constant)
        if isinstance(made, str):
            unused[name] = made
        else:
            found[name] = made
    return found, unused


def _covariate(name: str, cells: Sequence[str], values: Array | None, constant: bool) -> Covariate | str:
    role = role_of(name)
    filled = [cell for cell in cells if cell.strip()]
    if not filled:
        return "is empty"
    if values is not None:
        distinct = np.unique(values[np.isfinite(values)])
        if len(distinct) < 2 and not constant:
            return f"is the same everywhere ({filled[0]})"
        few = len(distinct) <= _MOST_NUMERIC_LEVELS and np.all(distinct == np.round(distinct))
        labels = (
            tuple("" if not np.isfinite(v) else f"{v:.0f}" for v in values)
            if few and role in ("group", "other")
            else None
        )
        if labels is None and np.isnan(values).any():
            return f"lacks {int(np.isnan(values).sum())} of its numbers; fill them in to have it tried"
        return Covariate(name, role, None if np.isnan(values).any() else values, labels)
    if len(set(filled)) < 2 and not constant:
        return f"is the same everywhere ({filled[0]})"
    minutes = _minutes(cells, constant)
    if minutes is not None:
        return Covariate(name, "time", minutes, None)
    distinct_texts = set(filled)
    numeric = sum(_is_number(cell) for cell in filled)
    if 0 < numeric < len(filled) and numeric > len(filled) // 4:
        return "mixes numbers and text; correct the cells that are no number"
    if any(_looks_like_date(cell) for cell in filled):
        return "holds dates that cannot be read in one way; write them all as 2026-11-29 14:05"
    if len(distinct_texts) > min(_MOST_LEVELS, max(2, len(cells) // LEAST_OF_A_LEVEL)):
        return f"has {len(distinct_texts)} different texts at {len(cells)} spots: no groups to compare"
    return Covariate(name, role, None, tuple(cell.strip() for cell in cells))


def _is_number(cell: str) -> bool:
    try:
        float(cell.replace(",", "."))
    except ValueError:
        return False
    return True


def _looks_like_date(cell: str) -> bool:
    return re.fullmatch(r"\d{1,4}[-./]\d{1,2}[-./]\d{2,4}.*|\d{1,2}:\d{2}.*", cell.strip()) is not None


def _minutes(cells: Sequence[str], constant: bool) -> Array | None:
    """Dates as minutes since 1970, times of day since midnight; None unless all are written in one and the same way."""
    stripped = [cell.strip() for cell in cells]
    readings = []
    for pattern in _FORMATS:
        try:
            times = [datetime.strptime(cell, pattern) for cell in stripped]
        except ValueError:
            continue
        start = datetime(1970, 1, 1) if "%d" in pattern else datetime(1900, 1, 1)
        readings.append(np.array([(time - start).total_seconds() / 60.0 for time in times]))
    if not readings or any(not np.array_equal(readings[0], other) for other in readings[1:]):
        return None
    return readings[0] if constant or np.ptp(readings[0]) > 0.0 else None
