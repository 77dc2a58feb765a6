"""Noise that is not the same along all axes: what makes it so, that every direction is believed as far as it tells."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import stats

Array = NDArray[np.float64]

UNEVEN = 0.01
"""Below this chance the noise is taken not to be the same along all axes."""
_LEAST_SPOTS = 20


def uneven_noise(left: Array, free: float) -> Array | None:
    """Covariance (3, 3) of the noise of residuals that is not the same along all axes; None where it is [mm^2].

    Mauchly's test of sphericity (J. W. Mauchly, Ann. Math. Statist. 11 (1940)) says whether there is a difference.

    Parameters
    ----------
    left : (m, 3) array
        Residuals of a fit [mm].
    free : float
        Degrees of freedom of their sum of squares.
    """
    if len(left) < _LEAST_SPOTS:
        return None
    covariance: Array = 3.0 * left.T @ left / free
    values = np.linalg.eigvalsh(covariance)
    mean = float(values.mean())
    if values[0] <= 1e-12 * mean:
        return None
    statistic = -(free / 3.0 - 1.0 - 17.0 / 18.0) * float(np.sum(np.log(values / mean)))
    return None if float(stats.chi2.sf(statistic, 5)) >= UNEVEN else covariance


def evening(covariance: Array | None) -> Array | None:
    """Matrix (3, 3) under which noise of a covariance is alike along all axes, its mean square kept; None for None."""
    if covariance is None:
        return None
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray((vectors * np.sqrt(values.mean() / values)) @ vectors.T)
