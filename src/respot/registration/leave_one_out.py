"""Leave-one-out residuals of the rigid fit: n refits in one batch."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from respot.registration.errors import RegistrationError
from respot.registration.rigid import COLLINEAR_TOLERANCE, check_pairs, fit_rigid, rotations_from_covariance

Array = NDArray[np.float64]


def leave_one_out(source: ArrayLike, reference: ArrayLike, inliers: ArrayLike | None = None) -> Array:
    """Residual of each pair under the rigid fit of all other inliers.

    Taking pair i out of n changes the means and the cross-covariance ``H`` in closed form,
    ``H_i = H - n / (n - 1) * (s_i - mean_s) outer (r_i - mean_r)``; the n rotations are one batched SVD.

    Parameters
    ----------
    source, reference : (n, 3) arrays [mm]
    inliers : (n,) bool array, optional
        Pairs that may take part in a fit (default all). A pair outside is judged by the fit of all inliers.

    Returns
    -------
    (n, 3) array
        Predicted minus reference [mm]. NaN where the others do not determine a rotation.

    Raises
    ------
    RegistrationError
        See `check_pairs`; ``TOO_FEW_PAIRS`` for fewer than 4 pairs.
    """
    first, second = check_pairs(source, reference, minimum=4)
    member = np.ones(len(first), dtype=bool) if inliers is None else np.asarray(inliers, dtype=bool)
    count = int(member.sum())
    if count < 4:
        return np.full_like(first, np.nan)
    source_mean, reference_mean = first[member].mean(axis=0), second[member].mean(axis=0)
    left, right = first - source_mean, second - reference_mean
    covariance = left[member].T @ right[member]

    taken = member.astype(np.float64)[:, None]
    outer = left[:, :, None] * right[:, None, :]
    reduced = covariance - taken[:, :, None] * (count / (count - 1)) * outer
    rotations, values, sign = rotations_from_covariance(reduced)
    source_means = -taken * left / (count - 1)
    reference_means = -taken * right / (count - 1)
    residuals: Array = np.einsum("nij,nj->ni", rotations, left - source_means) + reference_means - right
    undetermined = values[:, 1] + sign * values[:, 2] <= COLLINEAR_TOLERANCE**2 * values[:, 0]
    residuals[undetermined] = np.nan
    return residuals


def without_folds(source: ArrayLike, reference: ArrayLike, labels: ArrayLike) -> Array:
    """Residual of each pair under the rigid least-squares fit of all pairs of other folds.

    Parameters
    ----------
    source, reference : (n, 3) arrays [mm]
    labels : (n,) array
        Fold of each pair.

    Returns
    -------
    (n, 3) array
        Predicted minus reference [mm]. NaN where the others do not determine a transform.
    """
    first, second = check_pairs(source, reference)
    fold = np.asarray(labels)
    residuals = np.full_like(first, np.nan)
    for name in np.unique(fold):
        rest, out = fold != name, fold == name
        try:
            residuals[out] = fit_rigid(first[rest], second[rest]).predict(first[out]) - second[out]
        except RegistrationError:
            continue
    return residuals
