"""Effect ``joint_zero``: an axis is mastered wrong, so that it is off by the same angle everywhere."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from respot.calibration.effects.effect import Remedy
from respot.calibration.effects.term import Mechanism, Parameter, Term
from respot.calibration.observations import Observations

NAME = "joint_zero"
PLAUSIBLE_DEG = 1.0


def _terms(observations: Observations) -> list[Term]:
    if not observations.has_arm:
        return []
    assert observations.robot is not None  # noqa: S101 - it has an arm
    unit = ["deg" if turns else "mm" for turns in observations.robot.revolute]
    return [
        Term(NAME, {"axis": axis + 1}, (Parameter("offset", unit[axis], PLAUSIBLE_DEG),))
        for axis in range(observations.robot.axes)
    ]


def _columns(observations: Observations, term: Term) -> NDArray[np.float64]:
    assert observations.joints is not None  # noqa: S101
    columns = np.zeros((*observations.joints.shape, 1))
    columns[:, term.where["axis"] - 1] = 1.0
    return columns


def _remedy(term: Term, values: NDArray[np.float64]) -> Remedy:
    axis, unit = term.where["axis"], term.parameters[0].unit
    text = (
        f"Axis {axis} really stands {values[0]:+.4f} {unit} from what the controller shows. Check its mastering mark "
        "or its fine calibration; was a motor, gear or encoder changed? Re-master the axis, or correct the points: "
        "never both."
    )
    return Remedy("robot", text)


MECHANISM = Mechanism(
    NAME,
    "joints",
    _terms,
    _columns,
    _remedy,
    needs="joints",
    separates="the same points reached with another elbow or wrist configuration, or the mastering marks",
)
