"""Noise that is not the same along all axes: what makes it so, that every direction is believed as far as it tells."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from respot.calibration.discovery.joint_fit import JointFit

Array = NDArray[np.float64]

UNEVEN = 0.01
"""Below this chance the noise is taken not to be the same along all axes."""
_LEAST_SPOTS = 20


def evening(fit: JointFit) -> Array | None:
    """Matrix (3, 3) of the source frame under which what a fit leaves is alike along all axes; None where it is.

    The root of the inverse covariance of the residuals, scaled so that their mean square stays. Mauchly's test of
    sphericity (J. W. Mauchly, Ann. Math. Statist. 11 (1940)) says whether there is a difference.

    Parameters
    ----------
    fit : JointFit
    """
    left = fit.in_source[fit.inliers]
    count = len(left) * fit.free / (3.0 * len(left))
    if len(left) < _LEAST_SPOTS:
        return None
    covariance = left.T @ left / len(left)
    values, vectors = np.linalg.eigh(covariance)
    mean = float(values.mean())
    if values[0] <= 1e-12 * mean:
        return None
    statistic = -(count - 1.0 - 17.0 / 18.0) * float(np.sum(np.log(values / mean)))
    if float(stats.chi2.sf(statistic, 5)) >= UNEVEN:
        return None
    return np.asarray((vectors * np.sqrt(mean / values)) @ vectors.T)
