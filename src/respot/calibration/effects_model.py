"""A joint fit with effects in the shapes that every report of a fit reads."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from respot.calibration.discovery.joint_fit import JointFit
from respot.calibration.discovery.outliers import LEVEL, judged
from respot.calibration.uncertainty import TransformUncertainty
from respot.registration.rigid import fit_rigid
from respot.registration.robust import RobustFit

Array = NDArray[np.float64]

_TUKEY = 5.5


def robust_of(fit: JointFit, reference: Array) -> RobustFit:
    """The rigid part of a joint fit as the robust fit of its moved spots.

    Parameters
    ----------
    fit : JointFit
    reference : (n, 3) array
        What it was fitted to [mm].
    """
    rigid = fit_rigid(fit.moved, reference, fit.inliers.astype(np.float64))
    lengths = np.linalg.norm(rigid.residuals, axis=1)
    weights = np.square(np.clip(1.0 - np.square(lengths / (_TUKEY * fit.sigma)), 0.0, None))
    threshold = fit.sigma * float(np.sqrt(3.0 * stats.f.ppf(LEVEL, 3, max(fit.free, 1.0))))
    return RobustFit(rigid, fit.inliers, weights, fit.sigma, threshold, "least-squares")


def uncertainty_of(fit: JointFit, calibrated: Array) -> TransformUncertainty:
    """Covariance of the rigid part [mm, deg] and of the effects' parameters [their units], and 95 % intervals.

    Parameters
    ----------
    fit : JointFit
    calibrated : (n, 3) array
        Reference frame [mm].
    """
    covariance = fit.covariance
    reach = float(stats.t.ppf(0.975, max(fit.free, 1.0)))
    half = reach * np.sqrt(np.maximum(np.diag(covariance), 0.0))
    centroid = calibrated[fit.inliers].mean(axis=0)
    return TransformUncertainty(covariance, centroid, fit.sigma, max(int(fit.free), 1), half)


def left_out_of(fit: JointFit) -> Array:
    """Leave-one-out residuals (n, 3) of the final structure, reference frame [mm]; outliers under all inliers' fit."""
    return np.asarray(judged(fit)[0] @ fit.rotation.T)
