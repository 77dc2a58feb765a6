"""Effect ``gravity_sag``: axes give way under the weight of arm, gun and cables.

Masses are rarely known. The torque of a weight is linear in it and in its first moments, so levers are columns: from
one (the whole load at the wrist) to all moments of upper arm, forearm and hand (facts: calibration.md section 6).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from respot.calibration.effects.effect import Remedy
from respot.calibration.effects.term import Mechanism, Parameter, Term
from respot.calibration.observations import Observations

NAME = "gravity_sag"
PLAUSIBLE_DEG = 0.1
"""Degrees per metre of lever: 2 mm at a reach of 2.5 m are 0.03."""
_AXES = ((2,), (3,), (5,), (2, 3), (2, 3, 5))
_MASS, _MOMENTS = 0, (1, 2, 3)


def _terms(observations: Observations) -> list[Term]:
    if not observations.has_arm:
        return []
    assert observations.robot is not None  # noqa: S101
    axes = observations.robot.axes
    found = []
    for some in _AXES:
        if max(some) > axes:
            continue
        for form in ("wrist", "arm", "load"):
            levers = _levers(some, axes, form)
            if not levers:
                continue
            names = tuple(
                Parameter(f"axis_{j + 1}_link_{k + 1}_{'mxyz'[c]}", "deg/m", PLAUSIBLE_DEG) for j, k, c in levers
            )
            found.append(Term(NAME, {"axes": list(some)}, names, {"weights": form}))
    return found


def _levers(some: tuple[int, ...], axes: int, form: str) -> list[tuple[int, int, int]]:
    """Axis, link (both from 0) and column of `gravity_basis` of each parameter."""
    hand = axes - 1
    found: list[tuple[int, int, int]] = []
    for axis in some:
        j = axis - 1
        if form == "wrist":
            if j < axes - 3:
                found.append((j, axes - 3, _MASS))
            continue
        if j < axes - 3:
            found.append((j, axes - 3, _MASS))
            found += [(j, k, c) for k in range(j, min(axes - 3, 3)) for c in _MOMENTS]
        if form == "load":
            found += [(j, hand, c) for c in _MOMENTS]
    return found


def _columns(observations: Observations, term: Term) -> NDArray[np.float64]:
    assert observations.joints is not None and observations.robot is not None  # noqa: S101
    basis = observations.gravity_levers
    levers = _levers(tuple(term.where["axes"]), observations.robot.axes, term.form["weights"])
    columns = np.zeros((*observations.joints.shape, len(levers)))
    for number, (j, k, c) in enumerate(levers):
        columns[:, j, number] = basis[:, j, k, c]
    return columns


def _remedy(term: Term, values: NDArray[np.float64]) -> Remedy:  # noqa: ARG001 - a basis, no stiffness
    axes = " and ".join(str(axis) for axis in term.where["axes"])
    text = (
        f"The arm gives way under its load at axis {axes}. Check the load data of the tool (mass, centre of mass) in "
        "the controller, and the counterbalance; if they are right, correct the points. The columns are a basis of "
        "levers: the single coefficients are no stiffness."
    )
    return Remedy("robot", text)


MECHANISM = Mechanism(
    NAME,
    "joints",
    _terms,
    _columns,
    _remedy,
    needs="joints",
    separates="the same spots with another load (gun off), near and far from the robot",
)
