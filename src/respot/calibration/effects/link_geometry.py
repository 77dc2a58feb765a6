"""Effect ``link_geometry``: every link is a little off, in place and in angle, as absolute-accuracy calibrations find.

Six numbers a link, most of which the spots do not determine: a prior keeps them small (facts: calibration.md section 1:
without one the fit diverged on two of four series; 2 mm and 10 mrad were used).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from respot.calibration.effects.effect import Remedy
from respot.calibration.effects.term import Mechanism, Parameter, Term
from respot.calibration.observations import Observations

NAME = "link_geometry"
PRIOR_MM, PRIOR_DEG = 2.0, 0.573
_FORMS = ((60, 1.0), (16, 0.3), (8, 0.1), (4, 0.1))
"""Directions that are used, those first that the prior lets move the spots most, and the share of the prior."""


def _terms(observations: Observations) -> list[Term]:
    if not observations.has_arm:
        return []
    assert observations.robot is not None  # noqa: S101
    names = tuple(
        Parameter(
            f"link_{axis + 1}_{kind}", "mm" if kind[0] == "d" else "deg", PRIOR_MM if kind[0] == "d" else PRIOR_DEG
        )
        for axis in range(observations.robot.axes - 1)  # the last link's errors are a tool offset
        for kind in ("dx", "dy", "dz", "rx", "ry", "rz")
    )
    return [
        Term(
            NAME,
            {},
            tuple(Parameter(each.name, each.unit, each.prior * share) for each in names),
            {"leading": leading, "prior_share": share},
        )
        for leading, share in _FORMS
    ]


def _columns(observations: Observations, term: Term) -> NDArray[np.float64]:  # noqa: ARG001 - one place only
    return observations.link_columns[:, :, :-6]


def _turns(observations: Observations, term: Term) -> NDArray[np.float64]:
    assert observations.robot is not None  # noqa: S101 - the term was made of it
    frames, _ = observations.link_frames
    found = np.zeros((len(observations), 3, len(term.parameters)))
    for axis in range(observations.robot.axes - 1):
        found[:, :, 6 * axis + 3 : 6 * axis + 6] = observations.in_source(frames[:, axis])
    return found


def _remedy(term: Term, values: NDArray[np.float64]) -> Remedy:  # noqa: ARG001
    text = (
        "Small errors all over the arm, as every robot has that is not calibrated for absolute accuracy. Correct the "
        "points, or have the maker calibrate the arm; the single numbers lean on a prior and are no drawing."
    )
    return Remedy("robot", text)


MECHANISM = Mechanism(
    NAME,
    "arm",
    _terms,
    _columns,
    _remedy,
    needs="joints",
    turns=_turns,
    many=True,
    separates="many more spots, in several configurations of the arm",
)
