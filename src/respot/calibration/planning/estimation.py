"""Question of a plan: how well a model's parameters are known, and what that makes of intervals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from respot.calibration.ball import ball_radius
from respot.calibration.calibration import Calibration
from respot.calibration.information import RIGID
from respot.calibration.planning.design import Question
from respot.calibration.precision import Precision

Array = NDArray[np.float64]

_NOISE_FLOOR = 1e-3


@dataclass(frozen=True)
class ParameterOutlook:
    """Half of the 95 % interval of a parameter, in its unit."""

    effect: str
    name: str
    unit: str
    before: float
    after: float


@dataclass(frozen=True, eq=False)
class Estimation:
    """A model's parameters before and after further spots.

    Attributes
    ----------
    question : Question
    turn : (p, p) array
        Turns its independent parameters into the model's.
    precision : Precision
    """

    question: Question
    turn: Array
    precision: Precision

    def covariance(self, spots: int) -> tuple[Array, float | None]:
        """Covariance (p, p) of the parameters, and degrees of freedom of the noise, with so many further spots."""
        free = self.precision.degrees_of_freedom
        more = None if free is None else free + 3.0 * spots * self.precision.direction_share
        return np.asarray(self.turn @ self.question.covariance @ self.turn.T), more

    def parameters(self, model: Calibration, spots: int) -> tuple[ParameterOutlook, ...]:
        """Intervals of the effects' parameters before and with so many further spots."""
        after, free = self.covariance(spots)
        one, other = (
            _half(matrix, count)
            for matrix, count in ((self.precision.covariance, self.precision.degrees_of_freedom), (after, free))
        )
        names = [(term.label, each.name, each.unit) for term in model.terms for each in term.parameters]
        if model.tool_offset is not None:
            names = [("tool_offset", axis, "mm") for axis in "xyz"]
        return tuple(
            ParameterOutlook(*name, float(one[place]), float(other[place])) for place, name in enumerate(names, RIGID)
        )

    def balls(self, rows: Array, spots: int) -> tuple[Array, Array]:
        """Radii (n,) of the 95 % balls of spots, before and with so many further spots [mm].

        Parameters
        ----------
        rows : (n, 3, p) array
            As `Precision.rows_of`.
        spots : int
        """
        after, free = self.covariance(spots)
        pairs = ((self.precision.covariance, self.precision.degrees_of_freedom), (after, free))
        one, other = (ball_radius(rows @ matrix @ np.swapaxes(rows, 1, 2), count) for matrix, count in pairs)
        return one, other


def estimation_of(precision: Precision, rows: Array) -> Estimation:
    """Ask how well a model's parameters are known.

    Parameters
    ----------
    precision : Precision
    rows : (n, 3, p) array
        Shift of each candidate per unit of each parameter, as `Precision.rows_of`.
    """
    scale = np.sqrt(np.diag(precision.covariance))
    scale[scale == 0.0] = 1.0
    values, vectors = np.linalg.eigh(precision.covariance / np.outer(scale, scale))
    turn = scale[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
    noise, axes = np.linalg.eigh(precision.noise)
    white = axes / np.sqrt(np.maximum(noise, _NOISE_FLOOR**2)) @ axes.T
    turned = np.einsum("ij,njk->nik", white, rows @ turn)
    return Estimation(Question(turned, np.zeros(rows.shape[:2]), estimation=True), turn, precision)


def _half(covariance: Array, free: float | None) -> Array:
    reach = stats.norm.ppf(0.975) if free is None else stats.t.ppf(0.975, free)
    return np.asarray(reach * np.sqrt(np.maximum(np.diag(covariance), 0.0)))
