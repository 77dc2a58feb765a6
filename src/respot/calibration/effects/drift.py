"""Effects ``drift`` and ``warmup``: everything moves with time, evenly or towards an end: one family."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from respot.calibration.effects.effect import Remedy
from respot.calibration.effects.term import Mechanism, Parameter, Term, body_turns, motion_about, vector
from respot.calibration.observations import Observations

DRIFT, WARMUP = "drift", "warmup"
FAMILY = "time"
PLAUSIBLE_MM, PLAUSIBLE_DEG = 3.0, 0.2
_SHARES = (0.03, 0.05, 0.08, 0.12, 0.18, 0.27, 0.4, 0.6)
"""Time constants that are tried, as shares of the measuring time."""
_NEXT = 1.5
"""From one of them to the next."""
_SECOND = (3.0, 8.0)
"""A motor warms faster than the arm: a second time constant is so many times the first."""


def _terms(observations: Observations, name: str) -> list[Term]:
    found = []
    centre = observations.positions.mean(axis=0).tolist()
    shift = vector("", "mm", PLAUSIBLE_MM)
    turn = tuple(Parameter(f"r{axis}", "deg", PLAUSIBLE_DEG) for axis in "xyz")
    for column, covariate in observations.columns.items():
        if covariate.role != "time" or covariate.values is None:
            continue
        start, span = float(covariate.values.min()), float(np.ptp(covariate.values))
        if span <= 0.0:
            continue
        forms: list[dict[str, float]] = [{}]
        if name == WARMUP:
            forms = [{"time_constant": round(span * share, 4)} for share in _SHARES]
        for form in forms:
            own = {"start": start, "span": span, "centre": centre, **form}
            found.append(Term(name, {"column": column}, shift, {**own, "moves": "shift"}, own=column, family=FAMILY))
            found.append(
                Term(name, {"column": column}, (*shift, *turn), {**own, "moves": "body"}, own=column, family=FAMILY)
            )
            if name == DRIFT:
                bend = tuple(Parameter(f"{each.name}_bend", each.unit, each.prior) for each in (*shift, *turn))
                bent = {**own, "power": 2, "moves": "body"}
                found.append(Term(name, {"column": column}, (*shift, *turn, *bend), bent, own=column, family=FAMILY))
            if form:
                slow = tuple(Parameter(f"{each.name}_slow", each.unit, each.prior) for each in (*shift, *turn))
                for times in _SECOND:
                    two = {**own, "second_time_constant": times * form["time_constant"], "moves": "body"}
                    found.append(Term(name, {"column": column}, (*shift, *turn, *slow), two, own=column, family=FAMILY))
    return found


def _share(observations: Observations, term: Term) -> NDArray[np.float64]:
    """How far the motion has come at each spot (n,): 1 at its end."""
    values = observations.columns[term.where["column"]].values
    assert values is not None  # noqa: S101 - the term was made of it
    elapsed = values - term.form["start"]
    if "time_constant" in term.form:
        share = 1.0 - np.exp(-elapsed / term.form["time_constant"])
    else:
        share = elapsed / term.form["span"]
    return np.asarray(share)


def _slow(observations: Observations, term: Term) -> NDArray[np.float64]:
    values = observations.columns[term.where["column"]].values
    assert values is not None  # noqa: S101 - the term was made of it
    return np.asarray(1.0 - np.exp(-(values - term.form["start"]) / term.form["second_time_constant"]))


def _shares(observations: Observations, term: Term) -> list[NDArray[np.float64]]:
    """What each half of the parameters follows, (n,) each."""
    share = _share(observations, term)
    if "second_time_constant" in term.form:
        return [share, _slow(observations, term)]
    return [share, share ** term.form["power"]] if "power" in term.form else [share]


def _constants(term: Term) -> dict[str, tuple[float, float]]:
    names = [name for name in ("time_constant", "second_time_constant") if name in term.form]
    return {name: (term.form[name] / _NEXT, term.form[name] * _NEXT) for name in names}


def _columns(observations: Observations, term: Term) -> NDArray[np.float64]:
    centre = np.array(term.form["centre"])
    columns = [motion_about(observations.positions, share, centre) for share in _shares(observations, term)]
    return columns[0][:, :, :3] if term.form["moves"] == "shift" else np.concatenate(columns, axis=2)


def _turns(observations: Observations, term: Term) -> NDArray[np.float64]:
    shares = _shares(observations, term)
    size = len(term.parameters) // len(shares)
    return np.concatenate([body_turns(share, size) for share in shares], axis=2)


def _remedy(term: Term, values: NDArray[np.float64]) -> Remedy:
    size = float(np.linalg.norm(values[:3]))
    if "time_constant" in term.form:
        slow = f"a time constant of about {term.form['time_constant']:.0f}"
        how = f"towards an end, {size:.2f} mm away, with {slow} (column {term.where['column']})"
    else:
        how = f"by {size:.2f} mm over the measurement (column {term.where['column']})"
    text = (
        f"Spots move with time, {how}: robot, fixture or tracker were not yet warm, or one of them slipped. Measure "
        "again after a warm-up run, with a fixed point measured in between; correct nothing before."
    )
    return Remedy("process", text)


_SEPARATES = "some spots measured at the start and again at the end; spots in a random order"

MECHANISMS = tuple(
    Mechanism(
        name,
        "part",
        lambda observations, name=name: _terms(observations, name),  # type: ignore[misc]
        _columns,
        _remedy,
        needs="a column with the time",
        separates=_SEPARATES,
        turns=_turns,
        constants=_constants,
    )
    for name in (DRIFT, WARMUP)
)
