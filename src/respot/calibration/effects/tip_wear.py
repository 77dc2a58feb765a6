"""Effect ``tip_wear``: the electrode wears with every weld, along an axis of the tool that need not be Z."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from respot.calibration.effects.effect import Remedy
from respot.calibration.effects.term import Mechanism, Term, vector
from respot.calibration.observations import Observations

NAME = "tip_wear"
PLAUSIBLE_MM = 5.0


def _terms(observations: Observations) -> list[Term]:
    if observations.rotations is None:
        return []
    found = []
    for name, column in observations.columns.items():
        if column.role == "counter" and column.values is not None and np.ptp(column.values) > 0.0:
            form = {"full": float(np.abs(column.values).max())}
            even, bent = vector("", "mm", PLAUSIBLE_MM), vector("bend_", "mm", PLAUSIBLE_MM)
            found.append(Term(NAME, {"column": name}, even, {**form, "power": 1}, own=name))
            found.append(Term(NAME, {"column": name}, (*even, *bent), {**form, "power": 2}, own=name))
    return found


def _columns(observations: Observations, term: Term) -> NDArray[np.float64]:
    count = observations.columns[term.where["column"]].values
    assert count is not None  # noqa: S101 - the term was made of it
    share = (count / term.form["full"])[:, None, None]
    # tips mushroom: they wear fast at first and slower later on
    return np.concatenate([observations.tools * share**power for power in range(1, term.form["power"] + 1)], axis=2)


def _remedy(term: Term, values: NDArray[np.float64]) -> Remedy:
    x, y, z = values.reshape(-1, 3).sum(axis=0).tolist()
    text = (
        f"The point of contact moves by {x:+.2f} {y:+.2f} {z:+.2f} mm in the tool until {term.form['full']:g} of "
        f"column {term.where['column']}: tips wear and are dressed shorter; only a new cap resets it. Switch on the "
        "controller's wear compensation, or change caps earlier. Do not correct points for it: a new cap would undo "
        "that."
    )
    return Remedy("process", text)


MECHANISM = Mechanism(
    NAME,
    "tool",
    _terms,
    _columns,
    _remedy,
    needs="orientation and a column that counts welds or dressings since the last cap",
    separates="the same spots right before and right after a change of caps",
)
