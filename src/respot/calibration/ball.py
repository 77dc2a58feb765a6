"""The ball that holds 95 % of a 3-vector's distribution: what one number can say about a position.

1.96 standard deviations are the answer in one dimension; in three, with the scale estimated, they hold far less.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import special, stats

Array = NDArray[np.float64]

SHARE = 0.95
_NODES = 12
_AT_ONCE = 2000
_MOST_STEPS = 50
_CLOSE = 1e-10
#: Standard deviations below this share of the largest one change nothing in a radius.
_NEGLIGIBLE = 1e-12


def ball_radius(covariance: ArrayLike, degrees_of_freedom: float | None, share: float = SHARE) -> Array:
    """Radius of the ball about zero that holds a share of a vector's distribution.

    The vector is ``L z / sqrt(W)`` with ``L L' = covariance``, z of unit normal components and ``W`` a chi-square with
    ``degrees_of_freedom``, over its degrees. For a direction ``u`` on the unit sphere ``|z|^2 / 3 / W`` follows F with
    3 and ``degrees_of_freedom`` whatever ``u`` is, so ``P(length <= r)`` is the mean over the sphere of
    ``F(r^2 / (3 u' covariance u))``: exact, a generalised chi-square where W is 1. The mean is taken over one octant by
    Gauss-Legendre.

    Parameters
    ----------
    covariance : (n, 3, 3) array
        [mm^2]; symmetric, not negative; with an estimated scale: by the estimate.
    degrees_of_freedom : float or None
        Of the estimated scale; None where it is known.
    share : float
        Between 0 and 1.

    Returns
    -------
    (n,) array
        [mm]; 0 for a covariance of zero.
    """
    matrices = np.asarray(covariance, dtype=np.float64).reshape(-1, 3, 3)
    variances = np.clip(np.linalg.eigvalsh(matrices), 0.0, None)
    largest = variances[:, 2]
    radius = np.zeros(len(matrices))
    rows = np.flatnonzero(largest > 0.0)
    for start in range(0, len(rows), _AT_ONCE):
        some = rows[start : start + _AT_ONCE]
        ratios = variances[some] / largest[some, None]
        ratios[ratios < _NEGLIGIBLE] = 0.0
        radius[some] = np.sqrt(largest[some] * _square(ratios, degrees_of_freedom, share))
    return radius


def _square(ratios: Array, degrees_of_freedom: float | None, share: float) -> Array:
    """Squared radius for variances (n, 3), the largest last and 1."""
    # the axis of the largest variance is the pole: along it the integrand stays smooth for any ratios
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    height, turn = (nodes + 1.0) / 2.0, (nodes + 1.0) * np.pi / 4.0
    level = 1.0 - height**2
    squares = np.stack(
        [
            np.outer(level, np.cos(turn) ** 2).ravel(),
            np.outer(level, np.sin(turn) ** 2).ravel(),
            np.outer(height**2, np.ones(_NODES)).ravel(),
        ]
    )
    share_of_node = np.outer(weights, weights).ravel() / 4.0

    spread = ratios @ squares
    # as if all of it were along one axis: too small, and from there on the distribution is concave, so that Newton's
    # steps never pass the answer
    square = np.full(len(ratios), _quantile(share, 1, degrees_of_freedom))
    for _ in range(_MOST_STEPS):
        within, density = _distribution(square[:, None] / spread, degrees_of_freedom)
        step = (share - within @ share_of_node) / ((density / spread) @ share_of_node)
        square += step
        if np.all(np.abs(step) <= _CLOSE * square):
            break
    return square


def _distribution(square: Array, degrees_of_freedom: float | None) -> tuple[Array, Array]:
    """Distribution and density of the squared length of three unit normals, over an estimated variance."""
    if degrees_of_freedom is None:
        density = np.sqrt(square / (2.0 * np.pi)) * np.exp(-square / 2.0)
        return np.asarray(special.chdtr(3.0, square), dtype=np.float64), density
    half = degrees_of_freedom / 2.0
    log = 1.5 * np.log(1.0 / degrees_of_freedom) - special.betaln(1.5, half)
    density = np.sqrt(square) * np.exp(log - (half + 1.5) * np.log1p(square / degrees_of_freedom))
    return np.asarray(special.fdtr(3.0, degrees_of_freedom, square / 3.0), dtype=np.float64), density


def _quantile(share: float, size: int, degrees_of_freedom: float | None) -> float:
    """Squared radius for ``size`` equal variances of 1 and none else."""
    if degrees_of_freedom is None:
        return float(stats.chi2.ppf(share, size))
    return float(size * stats.f.ppf(share, size, degrees_of_freedom))
