"""Whether the data support a rotation at all, or a translation says as much."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

from respot.registration.alternatives import fit_translation
from respot.registration.covariance import jacobian
from respot.registration.leave_one_out import leave_one_out
from respot.registration.rigid import check_pairs, fit_rigid
from respot.registration.row_order import own_order
from respot.registration.statistics import rms

Array = NDArray[np.float64]

SIGNIFICANCE = 0.05
DRAWS = 999
_MANY = 5000  # spots; beyond, the permutation distribution is chi-square with 3 degrees of freedom
_ROUNDING_MM = 1e-6  # sums of squares below this length per spot are rounding, not residuals


@dataclass(frozen=True)
class RotationSupport:
    """Rigid fit against translation alone, over the same pairs.

    Attributes
    ----------
    f_value, p_value : float
        F test of the three rotation parameters, for noise that is Gaussian and the same along all axes.
    p_value_by_axis : float
        Permutation test of the same that lets the noise differ by direction; see `rotation_p_value_by_axis`.
    translation_loo, rigid_loo : float
        Leave-one-out RMS of either model [mm].
    angle : float
        Angle of the fitted rotation [deg].
    supported : bool
        ``p_value`` below 0.05 *and* a smaller leave-one-out error with the rotation: it pays in millimetres.
    verdict : str
        The same in words; says where a rotation does not pay in millimetres and still shows in the quiet directions.
    """

    f_value: float
    p_value: float
    p_value_by_axis: float
    translation_loo: float
    rigid_loo: float
    angle: float
    supported: bool
    verdict: str


def rotation_support(source: ArrayLike, reference: ArrayLike, *, seed: int = 0) -> RotationSupport:
    """Test the rotation of the rigid fit (nested F test with 3 and 3n - 6 degrees of freedom, and leave-one-out).

    Raises
    ------
    RegistrationError
        As `fit_rigid`, and for fewer than 4 pairs.
    """
    translation, rigid = fit_translation(source, reference), fit_rigid(source, reference)
    n = len(rigid.residuals)
    free = 3 * n - 6
    floor = n * _ROUNDING_MM**2
    without = float(np.sum(translation.residuals**2))
    with_rotation = float(np.sum(rigid.residuals**2))
    f_value = max(without - with_rotation, 0.0) / 3.0 / (max(with_rotation, floor) / free)
    p_value = float(stats.f.sf(f_value, 3, free))
    translation_loo = rms(translation.leave_one_out)
    rigid_loo = rms(leave_one_out(source, reference))
    by_axis = rotation_p_value_by_axis(source, reference, seed=seed)
    supported = p_value < SIGNIFICANCE and rigid_loo < translation_loo
    angle = float(np.degrees(rigid.source2reference.rotation.magnitude()))
    loo = f"leave-one-out {rigid_loo:.3f} mm with it, {translation_loo:.3f} mm without"
    if supported:
        verdict = f"the data support a rotation of {angle:.3f} degrees (p = {p_value:.2g}; {loo})"
    else:
        verdict = f"the data do not support a rotation: translation alone does as well (p = {p_value:.2g}; {loo})"
        if by_axis < SIGNIFICANCE:
            verdict += (
                f"; but weighed by the noise of each direction a rotation shows (p = {by_axis:.2g}): small beside "
                "the scatter in the widest direction"
            )
    return RotationSupport(f_value, p_value, by_axis, translation_loo, rigid_loo, angle, supported, verdict)


def rotation_p_value_by_axis(source: ArrayLike, reference: ArrayLike, *, seed: int = 0) -> float:
    """Permutation p value of a small rotation, for noise that may differ by direction.

    Under the null hypothesis the residual vectors of the translation alone might as well stand at any other spots. They
    are whitened by their own scatter matrix and regressed on the rotation's columns (`jacobian`, first order); the
    statistic is the sum of squares that these explain, over 999 shuffles: ``p = (1 + as large) / (1 + shuffles)``.
    1 where the residuals are rounding. The order of the rows plays no part. Of more than 5000 spots the shuffles' own
    limit is taken, chi-square with 3 degrees of freedom.

    Parameters
    ----------
    source, reference : (n, 3) arrays [mm]
    seed : int
        Of the shuffles.
    """
    points, target = check_pairs(source, reference)
    rows = own_order(points, target)
    points, target = points[rows], target[rows]
    residuals = fit_translation(points, target).residuals
    scatter = residuals.T @ residuals / len(residuals)
    values, vectors = np.linalg.eigh(scatter)
    if values[2] <= _ROUNDING_MM**2:
        return 1.0
    whiten = vectors / np.sqrt(np.maximum(values, 1e-9 * values[2])) @ vectors.T
    columns = np.einsum("ij,njk->nik", whiten, jacobian(points - points.mean(axis=0))[:, :, 3:])
    basis = np.linalg.qr(columns.reshape(-1, 3))[0].reshape(columns.shape)
    white = residuals @ whiten

    def explained(order: NDArray[np.intp]) -> float:
        return float(np.sum(np.einsum("nik,ni->k", basis, white[order]) ** 2))

    observed = explained(np.arange(len(white)))
    if len(white) > _MANY:
        return float(stats.chi2.sf(observed, 3))
    rng = np.random.default_rng(seed)
    as_large = sum(explained(rng.permutation(len(white))) >= observed * (1.0 - 1e-9) for _ in range(DRAWS))
    return (1 + as_large) / (1 + DRAWS)
