"""Effect ``gun_deflection``: the gun bends when it squeezes, so that the weld moves along the tool with the force."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from respot.calibration.effects.effect import Remedy
from respot.calibration.effects.term import Mechanism, Parameter, Term, vector
from respot.calibration.observations import Observations

NAME = "gun_deflection"
PLAUSIBLE_MM = 5.0
_Z = 2


def _terms(observations: Observations) -> list[Term]:
    if observations.rotations is None:
        return []
    found = []
    for name, column in observations.columns.items():
        if column.role == "force" and column.values is not None and np.ptp(column.values) > 0.0:
            form = {"full": float(np.abs(column.values).max())}
            one = (Parameter("z", "mm", PLAUSIBLE_MM),)
            found.append(Term(NAME, {"column": name}, one, {**form, "along": "z", "power": 1}, own=name))
            two = (*one, Parameter("bend_z", "mm", PLAUSIBLE_MM))
            found.append(Term(NAME, {"column": name}, two, {**form, "along": "z", "power": 2}, own=name))
            even, bent = vector("", "mm", PLAUSIBLE_MM), vector("bend_", "mm", PLAUSIBLE_MM)
            found.append(Term(NAME, {"column": name}, even, {**form, "along": "any", "power": 1}, own=name))
            found.append(Term(NAME, {"column": name}, (*even, *bent), {**form, "along": "any", "power": 2}, own=name))
            # closed already without force: a constant goes with it
            closed = {**form, "power": 1, "preload": True}
            start = vector("closed_", "mm", PLAUSIBLE_MM)
            found.append(Term(NAME, {"column": name}, (start[_Z], *one), {**closed, "along": "z"}, own=name))
            found.append(Term(NAME, {"column": name}, (*start, *even), {**closed, "along": "any"}, own=name))
    return found


def _columns(observations: Observations, term: Term) -> NDArray[np.float64]:
    force = observations.columns[term.where["column"]].values
    assert force is not None  # noqa: S101 - the term was made of it
    share = (force / term.form["full"])[:, None, None]
    # play in the gun is taken up first: it need not be proportional
    lowest = 0 if term.form.get("preload") else 1
    powers = [observations.tools * share**power for power in range(lowest, term.form["power"] + 1)]
    columns = np.concatenate(powers, axis=2)
    if term.form["along"] == "z":
        columns = columns[:, :, _Z::3]
    return np.asarray(columns, dtype=np.float64)


def _at_full(term: Term, values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Deflection at the highest force, along the tool's axes [mm]."""
    return np.asarray(values.reshape(-1, 1 if term.form["along"] == "z" else 3).sum(axis=0))


def _remedy(term: Term, values: NDArray[np.float64]) -> Remedy:
    text = (
        f"The weld moves by {float(np.linalg.norm(_at_full(term, values))):.2f} mm in the tool at the highest force of "
        f"column {term.where['column']}: the gun bends as it squeezes. Enter the gun's deflection in its data (KUKA: "
        "ServoGun compensation, ABB: the tool's force calibration), or correct the points; never both."
    )
    return Remedy("tool", text)


MECHANISM = Mechanism(
    NAME,
    "tool",
    _terms,
    _columns,
    _remedy,
    needs="orientation and a column with the squeeze force",
    separates="the same spots with the gun open, and at two forces",
)
