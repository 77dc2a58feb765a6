"""Effect ``readback_lag``: joints were read before the robot stood still, so that commanded and real ones differ."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from respot.calibration.effects.effect import Remedy
from respot.calibration.effects.term import Mechanism, Parameter, Term
from respot.calibration.observations import Observations

NAME = "readback_lag"
PLAUSIBLE = 1.5
_LEAST_DEG = 1e-6


def _terms(observations: Observations) -> list[Term]:
    if not observations.has_arm or observations.measured_joints is None or observations.joints is None:
        return []
    if observations.measured_joints.shape != observations.joints.shape:
        return []
    apart = observations.measured_joints - observations.joints
    if not np.isfinite(apart).all():
        return []
    moved = [axis for axis in range(apart.shape[1]) if np.ptp(apart[:, axis]) > _LEAST_DEG]
    if not moved:
        return []
    share = (Parameter("share", "1", PLAUSIBLE),)
    found = [Term(NAME, {}, share)]
    if len(moved) > 1:
        found += [Term(NAME, {"axis": axis + 1}, share) for axis in moved]
        names = tuple(Parameter(f"share_{axis + 1}", "1", PLAUSIBLE) for axis in moved)
        found.append(Term(NAME, {}, names, {"axes": [axis + 1 for axis in moved]}))
    return found


def _columns(observations: Observations, term: Term) -> NDArray[np.float64]:
    assert observations.joints is not None and observations.measured_joints is not None  # noqa: S101
    apart = observations.measured_joints - observations.joints
    if "axes" in term.form:
        axes = [axis - 1 for axis in term.form["axes"]]
        columns = np.zeros((*apart.shape, len(axes)))
        columns[:, axes, range(len(axes))] = apart[:, axes]
        return columns
    columns = np.zeros((*apart.shape, 1))
    axes = [term.where["axis"] - 1] if "axis" in term.where else list(range(apart.shape[1]))
    columns[:, axes, 0] = apart[:, axes]
    return columns


def _remedy(term: Term, values: NDArray[np.float64]) -> Remedy:
    where = f"axis {term.where['axis']}" if "axis" in term.where else "the axes"
    text = (
        f"The spots lie where the measured joints say, not the commanded ones (share {values.mean():.2f} of the "
        f"difference, {where}): the robot had not settled when it was measured, or it does not reach what it is told. "
        "Measure again after a pause at each spot, before anything is corrected."
    )
    return Remedy("process", text)


MECHANISM = Mechanism(
    NAME,
    "joints",
    _terms,
    _columns,
    _remedy,
    needs="commanded joints (j1 ...) and measured ones (jm1 ...)",
    separates="a second measurement after a pause of some seconds at each spot",
)
