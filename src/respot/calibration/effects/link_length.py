"""Effect ``link_length``: a length of the arm is not what the controller takes it for."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from respot.calibration.effects.effect import Remedy
from respot.calibration.effects.term import Mechanism, Parameter, Term
from respot.calibration.observations import Observations

NAME = "link_length"
PLAUSIBLE_MM = 5.0


def _terms(observations: Observations) -> list[Term]:
    if not observations.has_arm:
        return []
    assert observations.robot is not None  # noqa: S101
    steps = {step.parameter: step for step in observations.robot.steps if step.parameter}
    return [
        Term(NAME, {"parameter": name}, (Parameter(name, "mm", PLAUSIBLE_MM),))
        for name in observations.robot.parameter_names
        if not steps[name].turns
    ]


def _columns(observations: Observations, term: Term) -> NDArray[np.float64]:
    assert observations.robot is not None  # noqa: S101
    index = observations.robot.parameter_names.index(term.where["parameter"])
    return observations.parameter_columns[:, :, index : index + 1]


def _remedy(term: Term, values: NDArray[np.float64]) -> Remedy:
    text = (
        f"The arm's length {term.where['parameter']} is {values[0]:+.3f} mm from what the model has. Is the robot the "
        "type that was taken (generation, arm extension)? If it is, correct the points, or have the maker identify the "
        "arm."
    )
    return Remedy("robot", text)


MECHANISM = Mechanism(
    NAME,
    "arm",
    _terms,
    _columns,
    _remedy,
    needs="joints",
    separates="spots near to and far from the robot, and a scale bar of known length",
)
