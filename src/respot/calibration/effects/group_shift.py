"""Effect ``group_shift``: one station, fixture, program, tool, base or session moved as a body."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from respot.calibration.effects.effect import Remedy
from respot.calibration.effects.term import Mechanism, Parameter, Term, body_turns, motion_about, vector
from respot.calibration.observations import Observations

NAME = "group_shift"
PLAUSIBLE_MM, PLAUSIBLE_DEG = 10.0, 0.5
LEAST_FOR_TURN = 5
_MOST_TOGETHER = 6


def level_terms(observations: Observations, effect: str, name: str) -> list[Term]:
    """Terms of each level of a column, as a shift and as a rigid motion, and of all levels at once."""
    column = observations.columns[name]
    levels = column.levels
    seen = {"known": sorted({label for label in column.labels or () if label})}
    shift = vector("", "mm", PLAUSIBLE_MM)
    turn = tuple(Parameter(f"r{axis}", "deg", PLAUSIBLE_DEG) for axis in "xyz")
    found = []
    for level in levels:
        share = column.of_level(level)
        centre = observations.positions[share > 0.0].mean(axis=0).tolist()
        place = {"column": name, "level": level}
        found.append(Term(effect, place, shift, {"moves": "shift", "centre": centre, **seen}, own=name))
        if share.sum() >= LEAST_FOR_TURN:
            found.append(Term(effect, place, (*shift, *turn), {"moves": "body", "centre": centre, **seen}, own=name))
    if 2 < len(levels) <= _MOST_TOGETHER:
        names = tuple(p for level in levels[1:] for p in vector(f"{level}_", "mm", PLAUSIBLE_MM))
        found.append(Term(effect, {"column": name}, names, {"levels": list(levels[1:]), **seen}, own=name))
    return found


def level_columns(observations: Observations, term: Term) -> NDArray[np.float64]:
    """Columns of a term that `level_terms` made."""
    column = observations.columns[term.where["column"]]
    if "level" not in term.where:
        shares = np.stack([column.of_level(level) for level in term.form["levels"]], axis=-1)
        return np.asarray((shares[:, None, :, None] * np.eye(3)[None, :, None, :]).reshape(len(shares), 3, -1))
    share = column.of_level(term.where["level"])
    columns = motion_about(observations.positions, share, np.array(term.form["centre"]))
    return columns[:, :, :3] if term.form["moves"] == "shift" else columns


def _terms(observations: Observations) -> list[Term]:
    return [
        term
        for name, column in observations.columns.items()
        if column.role == "group"
        for term in level_terms(observations, NAME, name)
    ]


def _remedy(term: Term, values: NDArray[np.float64]) -> Remedy:
    if "level" not in term.where:
        text = f"The groups of column {term.where['column']} moved against each other. Measure their frames again."
        return Remedy("base", text)
    x, y, z = values[:3].tolist()
    turned = "" if len(values) == 3 else f", and turned by {float(np.linalg.norm(values[3:])):.3f} degrees"
    text = (
        f"{term.where['column']} {term.where['level']} stands {x:+.2f} {y:+.2f} {z:+.2f} mm from the others{turned}. "
        "Was its fixture moved, or its base or work object measured anew? Measure that frame again and correct it "
        "there; without a frame of its own correct its points."
    )
    return Remedy("base", text)


def level_turns(observations: Observations, term: Term) -> NDArray[np.float64]:
    """Rotation vectors of the tools of a level that turns as a body (n, 3, k) [deg per unit]."""
    if "level" not in term.where:
        return np.zeros((len(observations), 3, len(term.parameters)))
    return body_turns(observations.columns[term.where["column"]].of_level(term.where["level"]), len(term.parameters))


MECHANISM = Mechanism(
    NAME,
    "part",
    _terms,
    level_columns,
    _remedy,
    turns=level_turns,
    needs="a column that names the group",
    separates="points of the group's own fixture, measured by themselves",
)
