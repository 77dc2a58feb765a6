"""The methods beside our own: the paper's, and its unconstrained solution. Both keep our fit beside them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from respot.calibration.spot_fit import SpotFit
from respot.calibration.uncertainty import transform_uncertainty
from respot.registration.alternatives import fit_translation
from respot.registration.errors import RegistrationError
from respot.registration.exchanged import ExchangeResult
from respot.registration.leave_one_out import leave_one_out
from respot.registration.paper import TAU, PaperFit, fit_paper
from respot.registration.rigid import fit_rigid
from respot.registration.robust import RobustFit, robust_scale
from respot.registration.statistics import residual_directions
from respot.registration.support import rotation_support


def paper_fit(ours: SpotFit, *, tau: float | None, n_min: int | None, seed: int) -> SpotFit:
    """Fit by the paper's own method, with our fit beside it.

    The transform is that of the chosen subset, to the letter. Names stay as given: the method knows of no exchanged
    names. Pairs within tau count as inliers in all figures, the subset's own members too. The covariance is that of a
    transform fitted to the subset alone, with the noise that the least-squares fit of all inliers leaves.

    Parameters
    ----------
    ours : SpotFit
        Our fit of the same pairs.
    tau : float, optional
        Largest residual of an inlier by its largest coordinate; default `respot.registration.paper.TAU` [mm].
    n_min : int, optional
        A subset qualifies with more inliers than this outside of it; default half of them.
    seed : int
        Of the random subsets.

    Raises
    ------
    RegistrationError
        As `respot.registration.paper.fit_paper`; ``NO_SUBSET`` also where fewer than 4 pairs come within tau.
    """
    first, second = ours.source, ours.reference_as_named
    reach = TAU if tau is None else tau
    chosen = fit_paper(first, second, tau=reach, n_min=n_min, seed=seed)
    within = chosen.delta <= chosen.tau
    if int(within.sum()) < 4:
        raise RegistrationError(
            "NO_SUBSET", f"only {int(within.sum())} spots come within {reach:g} mm; at least 4 are needed"
        )
    rigid = replace(
        fit_rigid(first, second, checked=False),
        rotation=chosen.rotation,
        translation=chosen.translation,
        residuals=chosen.residuals,
    )
    in_subset = np.zeros(len(first), dtype=bool)
    in_subset[list(chosen.subset)] = True
    calibrated = rigid.predict(first)
    spread = fit_rigid(first[within], second[within]).residuals
    keep_names = np.arange(len(first), dtype=np.intp)
    lengths = np.linalg.norm(chosen.residuals[within], axis=1)
    robust = RobustFit(rigid, within, within.astype(np.float64), robust_scale(lengths), chosen.tau, "paper")
    options = {"tau": chosen.tau, "n_min": chosen.n_min, "subset_size": chosen.subset_size, "seed": seed}
    return replace(
        ours,
        model=replace(
            ours.model,
            rotation=chosen.rotation,
            translation=chosen.translation,
            provenance={**ours.model.provenance, "paper": options},
            method="paper",
            tool_offset=None,
            terms=(),
            values=(),
            robot=None,
        ),
        reference_ids=ours.reference_ids_as_named,
        reference=second,
        after_loo=leave_one_out(first, second, in_subset),
        exchanged=ExchangeResult((), keep_names, robust),
        robust=robust,
        translation=fit_translation(first[within], second[within]),
        directions=residual_directions(chosen.residuals[within]),
        support=rotation_support(first[within], second[within]),
        uncertainty=transform_uncertainty(calibrated[within], spread, calibrated[in_subset]),
        effects=(),
        tool=None,
        orientations=None,
        discovery=None,
        method="paper",
        paper=chosen,
        paper_mean_square=_other_reading(ours, chosen, seed),
        beside=ours,
    )


def _other_reading(ours: SpotFit, chosen: PaperFit, seed: int) -> PaperFit:
    return fit_paper(
        ours.source, ours.reference_as_named, tau=chosen.tau, n_min=chosen.n_min, seed=seed, score="mean-square"
    )


def affine_fit(ours: SpotFit) -> SpotFit:
    """Our fit, marked as standing beside the unconstrained solution that was asked for.

    Raises
    ------
    RegistrationError
        ``COPLANAR_SPOTS``: the 12 parameters are not determined.
    """
    if ours.affine is None:
        raise RegistrationError(
            "COPLANAR_SPOTS",
            "the spots lie in one plane (or are fewer than 4): the 12 free parameters of the unconstrained solution "
            "are not determined; the rigid fit is (--method robust)",
        )
    return replace(ours, method="affine", beside=ours)
