"""Constants inside the forms of terms (time constants, scales, waves): by least squares, between those that were tried.

The search tries a few values of each; the truth lies between two of them, and what the nearest leaves behind looks like
a further effect.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from respot.calibration.discovery.joint_fit import JointFit
from respot.calibration.effects.catalogue import MECHANISMS, columns_of
from respot.calibration.effects.moved import at_tip
from respot.calibration.effects.term import Term
from respot.calibration.observations import Observations

Array = NDArray[np.float64]

_SWEEPS = 2
_CLEARLY = 2.0
"""By as many units of the noise's variance the sum of squares must fall: a constant's own price by Akaike."""
_DIGITS = 5


def refined(fit: JointFit, observations: Observations) -> tuple[Term, ...]:
    """Terms of a fit with the constants of their forms where the inliers have them; the same terms where that is near.

    Linear about the fit's solution; each constant stays between the values beside it that the search tries.

    Parameters
    ----------
    fit : JointFit
    observations : Observations
        Of all n spots of the fit.
    """
    bounds = [_bounds(term) for term in fit.terms]
    if not any(bounds):
        return fit.terms
    rows = np.flatnonzero(fit.inliers)
    seen = at_tip(observations, fit.terms, fit.values).rows(rows)
    design, wanted = fit.columns[rows].copy(), fit.linear[rows].ravel()
    stops = 6 + np.cumsum([0, *(len(term.parameters) for term in fit.terms)])
    terms, first = list(fit.terms), _left(design, wanted, fit.ridge)
    least = first
    for _ in range(_SWEEPS):
        for place, own in enumerate(bounds):
            part = slice(int(stops[place]), int(stops[place + 1]))
            for name, (low, high) in own.items():

                def left(constant: float, place: int = place, part: slice = part, name: str = name) -> float:
                    trial = design.copy()
                    trial[:, :, part] = columns_of(seen, [_with(terms[place], name, constant)])
                    return _left(trial, wanted, fit.ridge)

                found = minimize_scalar(left, bounds=(low, high), method="bounded", options={"xatol": 1e-4 * high})
                if float(found.fun) < least:
                    least, terms[place] = float(found.fun), _with(terms[place], name, float(found.x))
                    design[:, :, part] = columns_of(seen, [terms[place]])
    return tuple(terms) if first - least > _CLEARLY * fit.sigma**2 else fit.terms


def _bounds(term: Term) -> Mapping[str, tuple[float, float]]:
    constants = MECHANISMS[term.effect].constants
    return {} if constants is None else constants(term)


def _with(term: Term, name: str, constant: float) -> Term:
    return replace(term, form={**term.form, name: float(f"{constant:.{_DIGITS}g}")})


def _left(columns: Array, wanted: Array, ridge: Array) -> float:
    """Sum of squares that the columns leave, with what the priors cost."""
    design = columns.reshape(len(wanted), -1)
    gram, products = design.T @ design + np.diag(ridge), design.T @ wanted
    answer = np.linalg.pinv(gram, rcond=1e-13, hermitian=True) @ products
    return float(wanted @ wanted - answer @ products)
