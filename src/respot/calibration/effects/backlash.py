"""Effect ``backlash``: where an axis stops depends on the direction of its last motion."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from respot.calibration.effects.effect import Remedy
from respot.calibration.effects.term import Mechanism, Parameter, Term
from respot.calibration.observations import Observations

NAME = "backlash"
PLAUSIBLE_DEG = 0.1


def _terms(observations: Observations) -> list[Term]:
    signs = observations.approach if observations.has_arm else None
    if signs is None:
        return []
    both = [axis for axis in range(signs.shape[1]) if np.any(signs[:, axis] > 0.0) and np.any(signs[:, axis] < 0.0)]
    found = []
    for axis in both:
        # what is alike from both sides is a mastering error; of the last axis a tool offset, which cannot be told apart
        ways = ("half_play",) if axis == signs.shape[1] - 1 else ("up", "down")
        names = tuple(Parameter(f"axis_{axis + 1}_{way}", "deg", PLAUSIBLE_DEG) for way in ways)
        found.append(Term(NAME, {"axis": axis + 1}, names, own=f"approach_a{axis + 1}"))
    return found


def _columns(observations: Observations, term: Term) -> NDArray[np.float64]:
    assert observations.joints is not None  # noqa: S101
    signs = observations.approach
    columns = np.zeros((*observations.joints.shape, len(term.parameters)))
    if signs is None:
        return columns
    axis = term.where["axis"] - 1
    if len(term.parameters) == 1:
        columns[:, axis, 0] = np.sign(signs[:, axis])
        return columns
    columns[:, axis, 0] = signs[:, axis] > 0.0
    columns[:, axis, 1] = signs[:, axis] < 0.0
    return columns


def _remedy(term: Term, values: NDArray[np.float64]) -> Remedy:
    axis = term.where["axis"]
    play = 2.0 * abs(float(values[0])) if len(values) == 1 else abs(float(values[0] - values[1]))
    text = (
        f"Axis {axis} stops {play:.4f} degrees apart when it comes from one side or from the other: play in its gear. "
        "Have the gear checked; until then approach the spots from the same side, or correct the points for the side "
        "that their program comes from."
    )
    return Remedy("robot", text)


MECHANISM = Mechanism(
    NAME,
    "joints",
    _terms,
    _columns,
    _remedy,
    needs="joints and the side that each axis comes from (approach_a1 ...)",
    separates="the same spots approached from both sides",
)
