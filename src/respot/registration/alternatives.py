"""Models to hold the rigid fit against: translation alone (3 parameters) and the affine solution (12)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from respot.registration.rigid import COLLINEAR_TOLERANCE, check_pairs

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class AffineFit:
    """``reference = matrix[:3, :3] @ source + matrix[:3, 3]`` with nothing constrained; never for correcting."""

    matrix: Array
    residuals: Array


@dataclass(frozen=True, eq=False)
class TranslationFit:
    """``reference = source + translation``.

    Attributes
    ----------
    translation : (3,) array [mm]
    residuals : (n, 3) array
        Predicted minus reference [mm].
    leave_one_out : (n, 3) array
        The same for each pair, predicted by the translation of all others [mm].
    """

    translation: Array
    residuals: Array
    leave_one_out: Array


def fit_affine(source: ArrayLike, reference: ArrayLike) -> AffineFit | None:
    """Unconstrained linear least squares with 12 parameters: equation (6) of the paper.

    "Reverse Calibration Method for Welding Spots Based on PD/PS Simulation System", whose eq. (6) solves for the
    entries of rotation and translation without the orthogonality of the rotation.

    Returns
    -------
    AffineFit or None
        None where the spots are coplanar, or fewer than 4: the 12 parameters are then not determined.

    Raises
    ------
    RegistrationError
        See `respot.registration.rigid.check_pairs`.
    """
    first, second = check_pairs(source, reference)
    source_mean, reference_mean = first.mean(axis=0), second.mean(axis=0)
    centred = first - source_mean
    solution, _, rank, _ = np.linalg.lstsq(centred, second - reference_mean, rcond=COLLINEAR_TOLERANCE)
    if rank < 3:
        return None
    matrix = np.eye(4)
    matrix[:3, :3] = solution.T
    matrix[:3, 3] = reference_mean - solution.T @ source_mean
    return AffineFit(matrix, first @ matrix[:3, :3].T + matrix[:3, 3] - second)


def fit_translation(source: ArrayLike, reference: ArrayLike) -> TranslationFit:
    """Least-squares translation, orientation kept.

    Raises
    ------
    RegistrationError
        See `respot.registration.rigid.check_pairs`.
    """
    first, second = check_pairs(source, reference, minimum=2)
    translation = (second - first).mean(axis=0)
    residuals = first + translation - second
    return TranslationFit(translation, residuals, residuals * (len(first) / (len(first) - 1)))
