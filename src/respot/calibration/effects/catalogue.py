"""The catalogue of effects that discovery tries: one file each, one line each here."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from respot.calibration.effects import (
    backlash,
    covariate,
    deformation,
    drift,
    gear,
    gravity_sag,
    group_shift,
    gun_deflection,
    gun_sag,
    joint_profile,
    joint_zero,
    link_geometry,
    link_length,
    rail,
    readback_lag,
    scale,
    tip_wear,
    tool_shift,
    wrong_frame,
)
from respot.calibration.effects.term import Mechanism, Term
from respot.calibration.observations import Observations

Array = NDArray[np.float64]

MECHANISMS: dict[str, Mechanism] = {
    mechanism.name: mechanism
    for mechanism in (
        tool_shift.MECHANISM,
        scale.MECHANISM,
        joint_zero.MECHANISM,
        joint_profile.MECHANISM,
        gear.MECHANISM,
        link_length.MECHANISM,
        link_geometry.MECHANISM,
        gravity_sag.MECHANISM,
        gun_sag.MECHANISM,
        gun_deflection.MECHANISM,
        backlash.MECHANISM,
        readback_lag.MECHANISM,
        *drift.MECHANISMS,
        tip_wear.MECHANISM,
        wrong_frame.MECHANISM,
        group_shift.MECHANISM,
        rail.MECHANISM,
        covariate.MECHANISM,
        deformation.MECHANISM,
    )
}

OF_THE_ARM = frozenset(
    {"joint_zero", "joint_profile", "gear", "link_length", "link_geometry", "gravity_sag", "backlash", "readback_lag"}
)
"""Effects that an absolute-accuracy controller compensates itself."""


def terms_of(observations: Observations, names: frozenset[str] | None = None) -> list[Term]:
    """Every place and form of every effect (or of some) that the observations allow to try."""
    return [
        term
        for name, mechanism in MECHANISMS.items()
        if (names is None or name in names) and not (observations.absolute_accuracy and name in OF_THE_ARM)
        for term in mechanism.terms(observations)
    ]


def columns_of(observations: Observations, terms: Sequence[Term]) -> Array:
    """Columns (n, 3, all parameters) of terms, in units of their priors [mm]."""
    blocks = [
        MECHANISMS[term.effect].shifts(observations, term) * np.array([each.prior for each in term.parameters])
        for term in terms
    ]
    return np.concatenate([np.empty((len(observations), 3, 0)), *blocks], axis=2)
