"""The joint fit with a tool offset in the shapes that every report of a fit reads."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from respot.calibration.effects.tool_fit import ToolFit
from respot.calibration.uncertainty import TransformUncertainty
from respot.registration.rigid import fit_rigid
from respot.registration.robust import INLIER_CHI, RobustFit, robust_scale

Array = NDArray[np.float64]

_PARAMETERS = 9
_TUKEY = 5.5


def robust_of(tool: ToolFit, reference: Array) -> RobustFit:
    """The rigid part of a joint fit as the robust fit of its moved spots.

    Parameters
    ----------
    tool : ToolFit
    reference : (n, 3) array
        What it was fitted to [mm].
    """
    rigid = fit_rigid(tool.moved, reference, tool.inliers.astype(np.float64))
    lengths = np.linalg.norm(rigid.residuals, axis=1)
    scale = robust_scale(lengths[tool.inliers], _PARAMETERS)
    weights = np.square(np.clip(1.0 - np.square(lengths / (_TUKEY * scale)), 0.0, None))
    threshold = INLIER_CHI * max(tool.sigma, scale)
    return RobustFit(rigid, tool.inliers, weights, scale, threshold, "least-squares")


def uncertainty_of(tool: ToolFit) -> TransformUncertainty:
    """Covariance of all 9 parameters; the offset's [mm] come last, in the tool frame."""
    units = np.array([1.0, 1.0, 1.0, *[180.0 / np.pi] * 3, 1.0, 1.0, 1.0])
    covariance = tool.covariance * np.outer(units, units)
    reach = float(stats.t.ppf(0.975, tool.degrees_of_freedom))
    return TransformUncertainty(
        covariance, tool.centroid, tool.sigma, tool.degrees_of_freedom, reach * np.sqrt(np.diag(covariance))
    )
