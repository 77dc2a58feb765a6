"""The final model of a fit: the rigid part over the inliers, by plain least squares or as asked, and how sure it is.

Names, inliers and effects are settled by then, by positions alone. What may still differ is how the rigid part weighs
what it is fitted to: each direction by its own noise (`respot.registration.anisotropy.fit_weighted`), or orientations
with positions (`respot.registration.oriented.fit_rigid_oriented`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import stats
from scipy.spatial.transform import Rotation

from respot.calibration import effects_model
from respot.calibration.calibration import Calibration
from respot.calibration.causes import Causes
from respot.calibration.effects import tool_model, tool_offset
from respot.calibration.information import information_of
from respot.calibration.precision import direction_share, with_precision
from respot.calibration.spot_fit import Orientations, SpotFit, Weights
from respot.calibration.uncertainty import (
    LEAST_FOR_DIRECTIONS,
    TransformUncertainty,
    transform_uncertainty,
    uncertainty_by_direction,
)
from respot.registration.anisotropy import WeightedFit, fit_weighted, isotropy_p_value
from respot.registration.covariance import jacobian
from respot.registration.errors import RegistrationError
from respot.registration.leave_one_out import leave_one_out
from respot.registration.oriented import OrientedFit, fit_rigid_oriented
from respot.registration.robust import RobustFit

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

LEAST_WEIGHED = 7
"""Inliers for weights by direction: what is left without one of them must still tell the noise."""
MOST_REFITTED = 200
"""Of more inliers each one's absence is computed to first order, with the noise of all."""
_UNITS = np.array([1.0, 1.0, 1.0, *[180.0 / np.pi] * 3])
"""Of a perturbation (t [mm], w [rad]), to mm and degrees."""


@dataclass(frozen=True, eq=False)
class FinalModel:
    """The final model of a fit, whatever effects are in it.

    Attributes
    ----------
    robust : RobustFit
        Of the moved spots; ``rigid`` is the final rigid part.
    moved : (n, 3) array
        Source spots with the effects, source frame [mm].
    rotations : Rotation of n, or None
        Tool orientations of the source.
    uncertainty : TransformUncertainty
    left_out : (n, 3) array
        Leave-one-out residuals, reference frame [mm]; an outlier is judged by the fit of the inliers.
    has_tool : bool
        A tool offset is one of its effects.
    weighted : WeightedFit or None
        Of weights by direction.
    oriented : OrientedFit or None
        Of the inliers, where orientations were fitted with positions.
    """

    robust: RobustFit
    moved: Array
    rotations: Rotation | None
    uncertainty: TransformUncertainty
    left_out: Array
    has_tool: bool = False
    weighted: WeightedFit | None = None
    oriented: OrientedFit | None = None


def final_model(
    causes: Causes,
    source: Array,
    repaired: Array,
    reference_rotations: Rotation | None = None,
    *,
    weights: Weights = "even",
    orientations: Orientations = "compare",
    seed: int = 0,
) -> FinalModel:
    """Fit the final model. With effects it is plain least squares, whatever is asked for.

    Parameters
    ----------
    causes : Causes
        Names, inliers, effects.
    source, repaired : (n, 3) arrays
        Source spots; the reference spots that they belong to [mm].
    reference_rotations : Rotation of n, optional
        Tool orientations of the latter.
    weights, orientations
        How the rigid part weighs what it is fitted to.
    seed : int
        Of the test for noise that is the same along all axes.

    Raises
    ------
    RegistrationError
        ``TOO_FEW_PAIRS`` for weights by direction and fewer than 7 inliers.
    """
    trial, joint = causes.trial, causes.in_model
    if joint is not None:
        robust = effects_model.robust_of(joint.fit, repaired)
        calibrated = robust.rigid.predict(joint.fit.moved)
        sure = effects_model.uncertainty_of(joint.fit, calibrated)
        has_tool = any(term.effect == tool_offset.NAME for term in joint.fit.terms)
        left_out = effects_model.left_out_of(joint.fit)
        return FinalModel(robust, joint.fit.moved, joint.fit.rotations, sure, left_out, has_tool)
    rotations = causes.rotations
    if trial is not None and trial.accepted and trial.fit is not None:
        left = trial.fit.residuals if trial.left_out is None else trial.left_out
        robust = tool_model.robust_of(trial.fit, repaired)
        return FinalModel(robust, trial.fit.moved, rotations, tool_model.uncertainty_of(trial.fit), left, True)
    plain = _plain(causes.exchanged.robust, source, repaired, rotations, seed)
    if weights == "direction":
        return _by_direction(plain, repaired)
    if orientations == "fit" and rotations is not None and reference_rotations is not None:
        return _with_orientations(plain, repaired, rotations, reference_rotations)
    return plain


def _plain(robust: RobustFit, source: Array, repaired: Array, rotations: Rotation | None, seed: int) -> FinalModel:
    inliers = robust.inliers
    points, left = robust.rigid.predict(source)[inliers], robust.rigid.residuals[inliers]
    uncertainty = transform_uncertainty(points, left)
    if len(points) >= LEAST_FOR_DIRECTIONS:
        alike = isotropy_p_value(source[inliers], repaired[inliers], seed=seed)
        uncertainty = uncertainty_by_direction(uncertainty, points, left, alike)
    return FinalModel(robust, source, rotations, uncertainty, leave_one_out(source, repaired, inliers))


def _by_direction(plain: FinalModel, repaired: Array) -> FinalModel:
    """Weigh each direction by its own noise."""
    source, inliers = plain.moved, plain.robust.inliers
    if int(inliers.sum()) < LEAST_WEIGHED:
        message = (
            f"only {int(inliers.sum())} spots follow the model, and weights by direction need {LEAST_WEIGHED}: fewer "
            "residuals do not tell the noise of three directions"
        )
        raise RegistrationError("TOO_FEW_PAIRS", message)
    weighted = fit_weighted(source, repaired, inliers)
    sigma = float(np.sqrt(np.mean(np.sum(weighted.residuals[inliers] ** 2, axis=1)) / 3.0))
    sure = TransformUncertainty(
        covariance=weighted.covariance * np.outer(_UNITS, _UNITS),
        centroid=weighted.centroid,
        sigma=sigma * float(np.sqrt(inliers.sum() / weighted.degrees_of_freedom)),
        degrees_of_freedom=weighted.degrees_of_freedom,
        half_width=weighted.half_width,
        isotropy_p=plain.uncertainty.isotropy_p,
        by_direction=plain.uncertainty.by_direction,
    )

    def refit(others: Mask) -> tuple[Array, Array]:
        fit = fit_weighted(source[others], repaired[others])
        return fit.rotation, fit.translation

    weight: Array = np.asarray(np.linalg.inv(weighted.noise), dtype=np.float64)
    pull = _Pull(jacobian(weighted.rigid.predict(source) - weighted.centroid), weight)
    left = _left_out(source, repaired, inliers, weighted.residuals, refit, pull)
    return replace(
        plain, robust=replace(plain.robust, rigid=weighted.rigid), uncertainty=sure, left_out=left, weighted=weighted
    )


def _with_orientations(plain: FinalModel, repaired: Array, own: Rotation, other: Rotation) -> FinalModel:
    """Fit orientations with positions."""
    source, inliers = plain.moved, plain.robust.inliers
    chosen = np.flatnonzero(inliers)
    oriented = fit_rigid_oriented(source[chosen], repaired[chosen], own[chosen], other[chosen])
    rigid = replace(oriented.rigid, residuals=oriented.rigid.predict(source) - repaired)
    weight = np.eye(3) / oriented.sigma_mm**2
    rows = jacobian(rigid.predict(source) - oriented.centroid)
    turning = np.zeros((len(source), 6, 6))
    turning[chosen[oriented.agree], 3:, 3:] = np.eye(3) / np.radians(oriented.sigma_deg) ** 2
    pulls = np.zeros((len(source), 6))
    pulls[chosen, 3:] = np.radians(oriented.turns)
    pulls = np.einsum("nkl,nl->nk", turning, pulls)

    def refit(others: Mask) -> tuple[Array, Array]:
        kept = np.flatnonzero(others)
        rigid = fit_rigid_oriented(source[kept], repaired[kept], own[kept], other[kept]).rigid
        return rigid.rotation, rigid.translation

    left = _left_out(source, repaired, inliers, rigid.residuals, refit, _Pull(rows, weight, turning, pulls))
    sure = _oriented_uncertainty(oriented, rows[chosen], rigid.residuals[chosen], plain.uncertainty)
    robust = replace(plain.robust, rigid=rigid)
    return replace(plain, robust=robust, uncertainty=sure, left_out=left, oriented=oriented)


def _oriented_uncertainty(
    fit: OrientedFit, rows: Array, residuals: Array, plain: TransformUncertainty
) -> TransformUncertainty:
    """As `uncertainty_by_direction`, with the orientations' own share."""
    sure = TransformUncertainty(
        covariance=fit.covariance * np.outer(_UNITS, _UNITS),
        centroid=fit.centroid,
        sigma=fit.sigma_mm,
        degrees_of_freedom=fit.degrees_of_freedom,
        half_width=fit.half_width,
        isotropy_p=plain.isotropy_p,
    )
    if len(residuals) < LEAST_FOR_DIRECTIONS or not residuals.any():
        return sure
    # the positions' part of the normal matrix, for their noise as it is; the orientations' part as it was
    noise = residuals.T @ residuals
    noise *= 3.0 * fit.sigma_mm**2 / np.trace(noise)
    positions = np.einsum("nik,nil->kl", rows, rows) / fit.sigma_mm**2
    turns = np.linalg.inv(fit.covariance) - positions
    spread = np.einsum("nik,ij,njl->kl", rows, noise, rows) / fit.sigma_mm**4 + turns
    covariance = fit.covariance @ spread @ fit.covariance * np.outer(_UNITS, _UNITS)
    free = len(residuals) - 2
    half = float(stats.t.ppf(0.975, free)) * np.sqrt(np.diag(covariance))
    return replace(
        sure, covariance=covariance, degrees_of_freedom=free, half_width=half, by_direction=plain.by_direction
    )


@dataclass(frozen=True, eq=False)
class _Pull:
    """What each pair pulls a perturbation (t [mm], w [rad]) by, at the solution.

    Attributes
    ----------
    rows : (n, 3, 6) array
        `jacobian` of the predicted spots.
    weight : (3, 3) array
        Of a residual [1/mm^2].
    turning : (n, 6, 6) array or None
        Of its orientation: normal matrix.
    turns : (n, 6) array or None
        And gradient.
    """

    rows: Array
    weight: Array
    turning: Array | None = None
    turns: Array | None = None

    def steps(self, residuals: Array, inliers: Mask) -> Array:
        """What the fit moves by (m, 6) without each of the m inliers, to first order."""
        rows, left = self.rows[inliers], residuals[inliers]
        each = np.einsum("nik,ij,njl->nkl", rows, self.weight, rows)
        pull = np.einsum("nik,ij,nj->nk", rows, self.weight, left)
        if self.turning is not None and self.turns is not None:
            each, pull = each + self.turning[inliers], pull + self.turns[inliers]
        result: Array = np.linalg.solve(each.sum(axis=0) - each, pull[:, :, None])[:, :, 0]
        return result


def _left_out(
    source: Array,
    repaired: Array,
    inliers: Mask,
    residuals: Array,
    refit: Callable[[Mask], tuple[Array, Array]],
    pull: _Pull,
) -> Array:
    """Leave-one-out residuals (n, 3): refitted without each inlier, of many to first order; outliers as they are."""
    left, chosen = residuals.copy(), np.flatnonzero(inliers)
    if len(chosen) > MOST_REFITTED:
        left[chosen] += np.einsum("nik,nk->ni", pull.rows[chosen], pull.steps(residuals, inliers))
        return left
    for row in chosen:
        others = inliers.copy()
        others[row] = False
        rotation, translation = refit(others)
        left[row] = rotation @ source[row] + translation - repaired[row]
    return left


def precise(fit: SpotFit) -> Calibration:
    """Return the calibration of a fit with its precision: `with_precision`, and as the rigid part was fitted.

    Where effects were accepted it keeps what its spots tell of them and their rivals as well.

    A bootstrap refits by plain least squares and is refused for other weights: the residuals are not kept.

    Raises
    ------
    CalibrationError
        As `SpotFit.calibration`.
    """
    model = replace(with_precision(fit), information=information_of(fit))
    if model.precision is None or (fit.weighted is None and fit.oriented is None):
        return model
    noise, free = model.precision.noise, model.precision.degrees_of_freedom
    if fit.oriented is not None and np.trace(noise) > 0.0:
        noise = noise * (3.0 * fit.oriented.sigma_mm**2 / np.trace(noise))
        rows = jacobian(fit.calibrated[fit.robust.inliers] - fit.oriented.centroid)
        normal = np.einsum("nik,nil->kl", rows, rows) / fit.oriented.sigma_mm**2
        # what is left of the positions' squares beside what they say of the six parameters
        left = rows.shape[0] * 3.0 - float(np.trace(fit.oriented.covariance @ normal))
        free = left * direction_share(noise)
    sure = replace(
        model.precision, covariance=fit.uncertainty.covariance, noise=noise, degrees_of_freedom=free, residuals=None
    )
    return replace(model, precision=sure)
