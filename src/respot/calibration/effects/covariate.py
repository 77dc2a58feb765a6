"""Effect ``covariate``: the residual follows any other column of the table, whatever the cause behind it is."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from respot.calibration.covariates import Covariate
from respot.calibration.effects.effect import Remedy
from respot.calibration.effects.group_shift import level_columns, level_terms
from respot.calibration.effects.term import Mechanism, Parameter, Term, along, vector
from respot.calibration.observations import Observations

NAME = "covariate"
PLAUSIBLE_MM = 5.0
_SATURATING, _NEXT = (0.08, 0.2, 0.5), 1.6
_WAVES = tuple(0.5 * halves for halves in range(3, 17))
_WAVES_IN_TIME = tuple(0.25 * quarters for quarters in range(6, 97))
"""Waves over the range of a column; what repeats in time (air conditioning, shifts) is told more finely."""
_LEAST_DISTINCT = 5


def _terms(observations: Observations) -> list[Term]:
    found: list[Term] = []
    for name, column in observations.columns.items():
        if column.role == "approach":
            continue
        if column.values is not None:
            found += _numeric(observations, name, column)
        if column.role == "other" and column.labels is not None:
            found += level_terms(observations, NAME, name)
    return found


def _numeric(observations: Observations, name: str, column: Covariate) -> list[Term]:
    assert column.values is not None  # noqa: S101 - asked for a number
    distinct = np.unique(column.values)
    if len(distinct) < 2:  # of the pairs: the rest of the table may have others
        return []
    start, span = float(distinct[0]), float(distinct[-1] - distinct[0])
    place = {"column": name}
    # an error that is alike everywhere is a tool offset's or the rigid part's, not the column's
    middle = float(np.mean((column.values - start) / span))
    own = {"start": start, "span": span, "middle": middle}
    shift = vector("", "mm", PLAUSIBLE_MM)
    frames = ["part"] if observations.rotations is None else ["part", "tool"]
    # time's own straight and saturating forms are drift and warm-up, a counter's in the tool is wear
    known = {"time": ("part",), "counter": ("tool",)}.get(column.role, ())
    found = [
        Term(NAME, place, shift, {**own, "shape": "linear", "frame": frame}, own=name)
        for frame in frames
        if frame not in known
    ]
    if len(distinct) < _LEAST_DISTINCT:
        return found
    if column.role != "time":
        found += [
            Term(NAME, place, shift, {**own, "shape": "saturating", "scale": span * share, "frame": frame}, own=name)
            for share in _SATURATING
            for frame in frames
        ]
    waves = tuple(Parameter(f"{wave}_{axis}", "mm", PLAUSIBLE_MM) for wave in ("cos", "sin") for axis in "xyz")
    found += [
        Term(NAME, place, waves, {**own, "shape": "periodic", "waves": count, "frame": "part"}, own=name)
        for count in (_WAVES_IN_TIME if column.role == "time" else _WAVES)
        if 2.5 * count <= len(distinct)
    ]
    return found


def _columns(observations: Observations, term: Term) -> NDArray[np.float64]:
    if "shape" not in term.form:
        return level_columns(observations, term)
    values = observations.columns[term.where["column"]].values
    assert values is not None  # noqa: S101 - the term was made of it
    even = (values - term.form["start"]) / term.form["span"]
    if term.form["shape"] == "periodic":
        angle = 2.0 * np.pi * term.form["waves"] * even
        return np.concatenate([along(np.cos(angle)), along(np.sin(angle))], axis=2)
    if term.form["shape"] == "saturating":
        even = 1.0 - np.exp(-even * term.form["span"] / term.form["scale"])
    even = even - _at_middle(term)
    if term.form["frame"] == "tool":
        return np.asarray(observations.tools * even[:, None, None])
    return along(even)


def _constants(term: Term) -> dict[str, tuple[float, float]]:
    shape = term.form.get("shape")
    if shape == "saturating":
        return {"scale": (term.form["scale"] / _NEXT, term.form["scale"] * _NEXT)}
    if shape == "periodic":
        return {"waves": (term.form["waves"] - 0.25, term.form["waves"] + 0.25)}
    return {}


def _at_middle(term: Term) -> float:
    middle = float(term.form["middle"])
    if term.form["shape"] == "saturating":
        return 1.0 - float(np.exp(-middle * term.form["span"] / term.form["scale"]))
    return middle


def _remedy(term: Term, values: NDArray[np.float64]) -> Remedy:
    size = float(np.linalg.norm(values[:3]))
    if "level" in term.where:
        what = f"Spots with {term.where['column']} = {term.where['level']} lie {size:.2f} mm from the others"
    else:
        what = f"Spots move by up to about {size:.2f} mm with column {term.where['column']}"
    text = (
        f"{what}. The column tells where to look, not the cause: find out what changes with it, and measure both ways."
    )
    return Remedy("process", text)


MECHANISM = Mechanism(
    NAME,
    "part",
    _terms,
    _columns,
    _remedy,
    needs="a further column",
    separates="the same spots measured at both ends of the column",
    points=True,
    constants=_constants,
)
