"""The model to hold the rigid fit against: translation alone (3 parameters)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from respot.registration.rigid import check_pairs

Array = NDArray[np.float64]


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
