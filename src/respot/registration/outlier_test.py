"""Which pairs belong to a rigid fit, judged with regard to how little a few pairs say about the noise.

The mean-shift outlier test (R. D. Cook and S. Weisberg, *Residuals and Influence in Regression*, 1982, section 2.2):
each pair is judged by the least-squares fit of the *other* inliers. Its residual vector r scatters with
``s^2 (I + H)``, where s is the noise that m others leave and ``H`` the covariance of the prediction for unit noise, so
that ``r' (I + H)^-1 r / (3 s^2)`` follows F with 3 and 3 m - 6 degrees of freedom. A threshold on a robust scale takes
that scale for known; of 8 good spots it throws one out in every tenth table, and intervals come out too narrow.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from respot.registration.covariance import jacobian, unit_covariance, unit_leverage
from respot.registration.errors import RegistrationError
from respot.registration.rigid import fit_rigid

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

LEVEL = 0.999
PARAMETERS = 6
SCALE_FLOOR = 1e-3  # mm; a finer scale than a micrometre is printing, not noise
_WITNESSES = 4  # fewer pairs judge nobody
_TURNS = 60
_SHARE = 20


def f_limit(witnesses: int) -> float:
    """Largest ``r' (I + H)^-1 r / s^2`` of a good pair that ``witnesses`` others judge: 3 times 99.9 % of F."""
    return 3.0 * float(stats.f.ppf(LEVEL, 3, 3 * witnesses - PARAMETERS))


def noise_of(square_sum: float, pairs: int) -> float:
    """Noise per coordinate of a least-squares fit, ``sqrt(SSR / (3 n - 6))``, never below `SCALE_FLOOR` [mm]."""
    return max(float(np.sqrt(max(square_sum, 0.0) / max(3 * pairs - PARAMETERS, 1))), SCALE_FLOOR)


def settle_inliers(source: Array, reference: Array, inliers: Mask) -> Mask:
    """Let pairs in that pass the outlier test and put those out that fail it, until none is left to move.

    Parameters
    ----------
    source, reference : (n, 3) arrays [mm]
    inliers : (n,) bool array
        Where to start: a core of pairs that belong together.

    Returns
    -------
    (n,) bool array
        As given where the core is too small, or lies on a line, and can judge nobody.
    """
    return settle(source, reference, inliers, outlier_excess)


def settle(
    source: Array, reference: Array, inliers: Mask, test: Callable[[Array, Array, Mask], Array], share: int = _SHARE
) -> Mask:
    """As `settle_inliers`, for any test of pairs: `outlier_excess`, or one with its arguments and answer.

    No more than one in ``share`` comes or goes in one turn, the clearest first.
    """
    inliers = inliers.copy()
    seen: set[bytes] = set()
    for _ in range(_TURNS):
        key = np.packbits(inliers).tobytes()
        if key in seen:
            break
        seen.add(key)
        try:
            excess = test(source, reference, inliers)
        except RegistrationError:
            break
        some = max(1, int(inliers.sum()) // share)
        passing = np.flatnonzero(~inliers & (excess <= 1.0))
        failing = np.flatnonzero(inliers & (excess > 1.0))
        if len(passing):
            inliers[passing[np.argsort(excess[passing])[:some]]] = True
        elif len(failing):
            inliers[failing[np.argsort(-excess[failing])[:some]]] = False
    return inliers


def outlier_excess(source: Array, reference: Array, inliers: Mask) -> Array:
    """Test value of each pair over its limit, (n,): above 1 the pair is an outlier to all other inliers.

    Inliers are judged in closed form without themselves; 0 where fewer than 4 others are left to judge. Pairs that no
    bound on ``H`` can change the verdict of have a bound of the value instead of the value.

    Parameters
    ----------
    source, reference : (n, 3) arrays [mm]
    inliers : (n,) bool array

    Raises
    ------
    RegistrationError
        ``TOO_FEW_PAIRS`` for fewer than 4 inliers.
    DegenerateError
        The inliers lie on a line.
    """
    pairs = int(inliers.sum())
    if pairs < _WITNESSES:
        raise RegistrationError("TOO_FEW_PAIRS", f"{pairs} inliers, at least {_WITNESSES} are needed to judge")
    rigid = fit_rigid(source[inliers], reference[inliers])
    predicted = rigid.predict(source)
    residuals = predicted - reference
    covariance, centroid = unit_covariance(predicted[inliers])
    offsets = predicted - centroid
    squares = np.einsum("nk,nk->n", residuals, residuals)
    total = float(np.sum(squares[inliers]))
    sign = np.where(inliers, -1.0, 1.0)
    # the eigenvalues of H lie between 0 and its trace
    widest = 1.0 + sign * 3.0 * unit_leverage(offsets, covariance)
    bounds = np.stack([squares, squares / np.maximum(widest, 1e-9)])
    excess = _over_limit(bounds, inliers, total, pairs)
    doubtful = np.flatnonzero((excess > 1.0).any(axis=0) & (excess <= 1.0).any(axis=0)) if pairs > 100 else slice(None)
    rows = jacobian(offsets[doubtful])
    spread = np.eye(3) + sign[doubtful, None, None] * np.einsum("nik,kl,njl->nij", rows, covariance, rows)
    # a direction in which only this pair speaks (eigenvalue 0) says nothing about it
    inverse = np.linalg.pinv(spread, rcond=1e-6, hermitian=True)
    exact = np.einsum("ni,nij,nj->n", residuals[doubtful], inverse, residuals[doubtful])
    result: Array = excess[1]
    result[doubtful] = _over_limit(exact, inliers[doubtful], total, pairs)
    return result


def _over_limit(values: Array, inliers: Mask, total: float, pairs: int) -> Array:
    """Test values of pairs over their limits; ``total`` is the sum of squares of all ``pairs`` inliers [mm^2]."""
    floor = SCALE_FLOOR**2
    outside = values / (max(total / (3 * pairs - PARAMETERS), floor) * f_limit(pairs))
    if pairs <= _WITNESSES:
        inside = np.zeros_like(values)
    else:
        without = np.maximum((total - values) / (3 * (pairs - 1) - PARAMETERS), floor)
        inside = values / (without * f_limit(pairs - 1))
    result: Array = np.where(inliers, inside, outside)
    return result
