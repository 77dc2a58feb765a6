"""Effect ``scale``: everything is larger or smaller by the same factor, as by thermal growth."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from respot.calibration.effects.effect import Remedy
from respot.calibration.effects.term import Mechanism, Parameter, Term
from respot.calibration.observations import Observations

NAME = "scale"
PLAUSIBLE = 2.0
STEEL = 0.0115
"""Growth of steel [mm per m and K]."""


def _terms(observations: Observations) -> list[Term]:
    centre = observations.positions.mean(axis=0).tolist()
    return [Term(NAME, {}, (Parameter("growth", "mm/m", PLAUSIBLE),), {"centre": centre})]


def _columns(observations: Observations, term: Term) -> NDArray[np.float64]:
    return np.asarray((observations.positions - np.array(term.form["centre"]))[:, :, None] / 1000.0)


def _remedy(term: Term, values: NDArray[np.float64]) -> Remedy:  # noqa: ARG001 - one place only
    text = (
        f"The measured body is {values[0]:+.3f} mm per metre larger than the programmed one, as steel is that is "
        f"{values[0] / STEEL:+.0f} K warmer. Were part, robot and measuring system at the same temperature, and is the "
        "unit's scale bar in order? Measure it again at 20 degrees before anything is corrected."
    )
    return Remedy("process", text)


MECHANISM = Mechanism(
    NAME,
    "part",
    _terms,
    _columns,
    _remedy,
    needs="positions",
    separates="a scale bar of known length measured with the spots, or their temperature",
)
