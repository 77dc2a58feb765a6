"""The unconstrained linear solution with 12 parameters, for comparison; never for correcting.

Equation (6) of the paper ("Reverse Calibration Method for Welding Spots Based on PD/PS Simulation System") solves for
the entries of rotation and translation as if they were free. Nine numbers stand where a rotation has three: scale,
shear and even a reflection swallow what measuring noise and wrong names leave.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from respot.registration.rigid import COLLINEAR_TOLERANCE, check_pairs, rotations_from_covariance

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class AffineFit:
    """``reference = matrix[:3, :3] @ source + matrix[:3, 3]`` with nothing constrained; never for correcting.

    Attributes
    ----------
    matrix : (4, 4) array
        Source to reference; translation in mm.
    residuals : (n, 3) array
        Predicted minus reference [mm].
    leave_one_out : (n, 3) array
        The same for each pair, predicted by the fit of all others; NaN where these are coplanar [mm].
    spread : (3,) array
        Singular values of the centred source over the root of n, largest first: its RMS extent along its principal
        axes [mm]. The smallest says how well the 12 parameters are determined.
    stretches : (3,) array
        Singular values of the 3 x 3 part, largest first; a rotation has 1, 1, 1.
    nearest_rotation : (3, 3) array
        The proper rotation nearest to the 3 x 3 part.
    departure : float
        Largest entry of the 3 x 3 part minus ``nearest_rotation``, without sign.
    shear : float
        How far the angles between the images of the axes are from 90 degrees, the largest [deg].
    reflects : bool
        The 3 x 3 part turns a right hand into a left one.
    """

    matrix: Array
    residuals: Array
    leave_one_out: Array
    spread: Array
    stretches: Array
    nearest_rotation: Array
    departure: float
    shear: float
    reflects: bool


def fit_affine(source: ArrayLike, reference: ArrayLike) -> AffineFit | None:
    """Unconstrained linear least squares with 12 parameters: equation (6) of the paper, on the mean-centred spots.

    Parameters
    ----------
    source, reference : (n, 3) arrays
        Paired points [mm].

    Returns
    -------
    AffineFit or None
        None where the spots are coplanar to one thousandth of their extent, or fewer than 4: the 12 parameters are then
        not determined.

    Raises
    ------
    RegistrationError
        See `respot.registration.rigid.check_pairs`.
    """
    first, second = check_pairs(source, reference)
    source_mean, reference_mean = first.mean(axis=0), second.mean(axis=0)
    centred = first - source_mean
    left, values, right = np.linalg.svd(centred, full_matrices=False)
    if len(values) < 3 or values[2] <= COLLINEAR_TOLERANCE * values[0]:
        return None
    linear = (second - reference_mean).T @ (left / values) @ right
    residuals = centred @ linear.T - (second - reference_mean)
    # Each row of the hat matrix on its diagonal: a pair of weight 1 in its own prediction leaves nothing to test.
    own = 1.0 / len(first) + np.sum(left**2, axis=1)
    free = 1.0 - own > COLLINEAR_TOLERANCE**2
    held_out = np.where(free[:, None], residuals / np.where(free, 1.0 - own, 1.0)[:, None], np.nan)
    matrix = np.eye(4)
    matrix[:3, :3] = linear
    matrix[:3, 3] = reference_mean - linear @ source_mean
    nearest, stretches, _ = rotations_from_covariance(linear.T)
    return AffineFit(
        matrix=matrix,
        residuals=residuals,
        leave_one_out=held_out,
        spread=values / np.sqrt(len(first)),
        stretches=stretches,
        nearest_rotation=nearest,
        departure=float(np.abs(linear - nearest).max()),
        shear=_shear(linear),
        reflects=bool(np.linalg.det(linear) < 0.0),
    )


def _shear(linear: Array) -> float:
    lengths = np.linalg.norm(linear, axis=0)
    if not (lengths > 0.0).all():
        return 90.0
    cosines = (linear.T @ linear / np.outer(lengths, lengths))[np.triu_indices(3, 1)]
    return float(np.degrees(np.abs(np.arcsin(np.clip(cosines, -1.0, 1.0))).max()))
