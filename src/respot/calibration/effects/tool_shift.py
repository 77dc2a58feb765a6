"""Effect ``tool_offset`` as a term among others: the TCP is wrong by a constant in the tool frame."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from respot.calibration.effects.effect import Remedy
from respot.calibration.effects.term import Mechanism, Term, vector
from respot.calibration.observations import Observations

NAME = "tool_offset"
PLAUSIBLE_MM = 300.0
"""Guns are this long; poses may be those of the flange."""


def _terms(observations: Observations) -> list[Term]:
    if observations.rotations is None:
        return []
    return [Term(NAME, {"frame": "tool"}, vector("", "mm", PLAUSIBLE_MM))]


def _columns(observations: Observations, term: Term) -> NDArray[np.float64]:  # noqa: ARG001 - one place only
    return observations.tools


def _remedy(term: Term, values: NDArray[np.float64]) -> Remedy:  # noqa: ARG001
    x, y, z = values.tolist()
    text = (
        f"The TCP is {x:+.2f} {y:+.2f} {z:+.2f} mm from where the tool data have it, along the tool's axes. Measure "
        "the TCP again; if it is confirmed, add the offset to the tool (KUKA: TOOL_DATA, ABB: tframe.trans of the "
        "tooldata) and fit again. Correct the tool or the points, never both."
    )
    return Remedy("tool", text)


MECHANISM = Mechanism(
    NAME,
    "tool",
    _terms,
    _columns,
    _remedy,
    needs="orientation",
    separates="spots with the tool turned by 20 degrees and more, or the TCP measured at a fixed tip",
)
