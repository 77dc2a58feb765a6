"""Whether the data support a rotation at all, or a translation says as much."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from respot.registration.alternatives import fit_translation
from respot.registration.leave_one_out import leave_one_out
from respot.registration.rigid import fit_rigid
from respot.registration.statistics import rms

SIGNIFICANCE = 0.05
_ROUNDING_MM = 1e-6  # sums of squares below this length per spot are rounding, not residuals


@dataclass(frozen=True)
class RotationSupport:
    """Rigid fit against translation alone, over the same pairs.

    Attributes
    ----------
    f_value, p_value : float
        F test of the three rotation parameters, for noise that is Gaussian and the same along all axes.
    translation_loo, rigid_loo : float
        Leave-one-out RMS of either model [mm].
    angle : float
        Angle of the fitted rotation [deg].
    supported : bool
        p below 0.05 *and* a smaller leave-one-out error with the rotation.
    verdict : str
        The same in one sentence.
    """

    f_value: float
    p_value: float
    translation_loo: float
    rigid_loo: float
    angle: float
    supported: bool
    verdict: str


def rotation_support(source: ArrayLike, reference: ArrayLike) -> RotationSupport:
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
    supported = p_value < SIGNIFICANCE and rigid_loo < translation_loo
    angle = float(np.degrees(rigid.source2reference.rotation.magnitude()))
    loo = f"leave-one-out {rigid_loo:.3f} mm with it, {translation_loo:.3f} mm without"
    if supported:
        verdict = f"the data support a rotation of {angle:.3f} degrees (p = {p_value:.2g}; {loo})"
    else:
        verdict = f"the data do not support a rotation: translation alone does as well (p = {p_value:.2g}; {loo})"
    return RotationSupport(f_value, p_value, translation_loo, rigid_loo, angle, supported, verdict)
