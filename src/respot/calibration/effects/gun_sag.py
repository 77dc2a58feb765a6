"""Effect ``gun_sag``: the gun, or the docking that holds it, bends under the gun's own weight: R M R' g."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from respot.calibration.effects.effect import Remedy
from respot.calibration.effects.term import Mechanism, Parameter, Term
from respot.calibration.observations import Observations

NAME = "gun_sag"
PLAUSIBLE_MM = 5.0
_PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


def _terms(observations: Observations) -> list[Term]:
    if observations.rotations is None:
        return []
    even = tuple(Parameter(f"{'xyz'[i]}{'xyz'[j]}", "mm", PLAUSIBLE_MM) for i, j in _PAIRS)
    every = tuple(Parameter(f"{i}{j}", "mm", PLAUSIBLE_MM) for i in "xyz" for j in "xyz")
    return [Term(NAME, {}, even, {"compliance": "bending"}), Term(NAME, {}, every, {"compliance": "docking"})]


def _columns(observations: Observations, term: Term) -> NDArray[np.float64]:
    tools = observations.tools
    weight = np.einsum("nij,i->nj", tools, observations.gravity)  # gravity along the tool's axes
    if term.form["compliance"] == "docking":
        return np.asarray(np.einsum("nij,nk->nijk", tools, weight).reshape(len(tools), 3, 9))
    columns = [
        tools[:, :, i] * weight[:, j, None] + (tools[:, :, j] * weight[:, i, None] if i != j else 0.0)
        for i, j in _PAIRS
    ]
    return np.stack(columns, axis=-1)


def _remedy(term: Term, values: NDArray[np.float64]) -> Remedy:  # noqa: ARG001 - one place only
    text = (
        f"The gun hangs: its tip gives way by about {np.abs(values).max():.2f} mm as the gun is turned against "
        "gravity. Check the bolts of gun and tool changer and the gun's balancing; then correct the points."
    )
    return Remedy("tool", text)


MECHANISM = Mechanism(
    NAME,
    "tool",
    _terms,
    _columns,
    _remedy,
    needs="orientation",
    separates="one point measured with the gun turned about its axis in steps of 30 degrees",
)
