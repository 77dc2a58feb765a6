"""Effect ``joint_profile``: the error of an axis changes smoothly with its angle (gain, balancer, low harmonics)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from respot.calibration.effects.effect import Remedy
from respot.calibration.effects.term import Mechanism, Parameter, Term
from respot.calibration.observations import Observations

NAME = "joint_profile"
PLAUSIBLE_DEG, PLAUSIBLE_MM = 0.3, 5.0
MIDDLE, HALF = "middle_deg", "half_range_deg"
_LEAST_RANGE = 10.0
_WIDE = 100.0
"""Harmonics and powers of an angle are alike over less than this [deg]."""


def _terms(observations: Observations) -> list[Term]:
    if not observations.has_arm:
        return []
    assert observations.robot is not None and observations.joints is not None  # noqa: S101
    found = []
    for axis, turns in enumerate(observations.robot.revolute):
        angles = observations.joints[:, axis]
        half = float(np.ptp(angles)) / 2.0
        if half < _LEAST_RANGE / 2.0:
            continue
        place = {"axis": int(axis) + 1}
        unit = ("deg", PLAUSIBLE_DEG) if turns else ("mm", PLAUSIBLE_MM)
        # a constant of the last axis is a tool offset, and no spot tells the two apart
        least = 1 if axis == observations.robot.axes - 1 else 0
        own = {MIDDLE: float(angles.min()) + half, HALF: half}
        for power in (1, 2, 3, 4, 6):
            names = tuple(Parameter(f"power_{n}", *unit) for n in range(least, power + 1))
            found.append(Term(NAME, place, names, {"powers": power, "least": least, **own}))
        if turns and 2.0 * half >= _WIDE:
            for harmonics in (1, 2, 4):
                names = (
                    *(Parameter("power_0", "deg", PLAUSIBLE_DEG) for _ in range(1 - least)),
                    *(
                        Parameter(f"{wave}_{n}", "deg", PLAUSIBLE_DEG)
                        for n in range(1, harmonics + 1)
                        for wave in ("cos", "sin")
                    ),
                )
                found.append(Term(NAME, place, names, {"harmonics": harmonics, "least": least}))
    return found


def _columns(observations: Observations, term: Term) -> NDArray[np.float64]:
    assert observations.joints is not None  # noqa: S101
    axis = term.where["axis"] - 1
    angles = observations.joints[:, axis]
    if "powers" in term.form:
        even = (angles - term.form[MIDDLE]) / term.form[HALF]
        values = [even**n for n in range(term.form["least"], term.form["powers"] + 1)]
    else:
        turns = np.radians(angles)
        waves = [wave(n * turns) for n in range(1, term.form["harmonics"] + 1) for wave in (np.cos, np.sin)]
        values = [np.ones_like(turns)] * (1 - term.form["least"]) + waves
    columns = np.zeros((*observations.joints.shape, len(values)))
    columns[:, axis] = np.stack(values, axis=-1)
    return columns


def _remedy(term: Term, values: NDArray[np.float64]) -> Remedy:
    axis = term.where["axis"]
    change = np.abs(values[1 - term.form["least"] :]).sum()
    text = (
        f"The error of axis {axis} changes with its angle, by up to about "
        f"{change:.3f} degrees over the range of these spots. Look at the gear "
        "ratio and the counterbalance of this axis (gas pressure, spring); if they are in order, correct the points."
    )
    return Remedy("robot", text)


MECHANISM = Mechanism(
    NAME,
    "joints",
    _terms,
    _columns,
    _remedy,
    needs="joints",
    separates="spots over a wider range of this axis, at several angles of the others",
)
