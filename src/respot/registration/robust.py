"""The robust rigid fit: which pairs belong together, then least squares over these.

Iteratively reweighted least squares on the *norm* of each residual vector (so that turning the frame changes
nothing): least squares, then Huber weights, then Tukey's biweight (P. J. Huber, *Robust Statistics*, 1981; V. Yohai,
Ann. Statist. 15 (1987)). A consensus start takes over where it finds a far smaller scale. From the core that this finds
the outlier test decides, each pair by the least-squares fit of the others (`respot.registration.outlier_test`); where
the inliers' noise is not the same along all axes, with each direction's own (`respot.registration.direction_test`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

from respot.registration.anisotropy import SIGNIFICANCE, isotropy_p_value, noise_covariance, rough_isotropy_p_value
from respot.registration.consensus import consensus_transform, quota_of
from respot.registration.direction_test import LEAST_WITNESSES, direction_limit, settle_by_direction
from respot.registration.errors import DegenerateError, RegistrationError
from respot.registration.outlier_test import PARAMETERS, SCALE_FLOOR, f_limit, noise_of, settle_inliers
from respot.registration.rigid import (
    BLOCK,
    RigidFit,
    check_pairs,
    fit_rigid,
    rotations_from_covariance,
    transform_of,
)

Array = NDArray[np.float64]
Transform = tuple[Array, Array]

INLIER_CHI = float(stats.chi.ppf(0.999, 3))
_MEDIAN_CHI = float(stats.chi.median(3))
_HUBER = float(stats.chi.ppf(0.90, 3))
_TUKEY = 5.5
_MANY_BAD = 0.6  # the consensus start is taken where its scale is below this share of the other's (large tables)
_SAMPLE = 20_000  # larger tables find their basin on an even sample of this size
_TURNS = 30
_CLEARLY_EVEN = 0.3  # chance of noise that is the same along all axes, beyond which directions are not looked at
_FULL_TURNS = 6  # over all pairs of a large table; the sample leaves little to do


@dataclass(frozen=True, eq=False)
class RobustFit:
    """The least-squares fit over the inliers, and how they were told.

    Attributes
    ----------
    rigid : RigidFit
        Fit over the inliers; its residuals cover all pairs.
    inliers : (n,) bool array
    weights : (n,) array
        Tukey weight of each pair at the solution, 0 to 1: how typical the pair is. The fit itself weighs inliers 1.
    scale : float
        Noise per coordinate that the inliers leave, ``sqrt(SSR / (3 m - 6))`` [mm].
    threshold : float
        How far a pair may lie from where all inliers predict it [mm], before the widening by its leverage: 99.9 % of F
        with 3 and 3 m - 6 degrees of freedom for m inliers.
    start : str
        ``"least-squares"`` or ``"consensus"``: the start that led here.
    by_direction : bool
        Other pairs are inliers than by the length of residuals alone: each direction was judged by its own noise. The
        threshold is then that along the noisiest direction.
    """

    rigid: RigidFit
    inliers: NDArray[np.bool_]
    weights: Array
    scale: float
    threshold: float
    start: str
    by_direction: bool = False


def robust_scale(lengths: Array, parameters: int = PARAMETERS) -> float:
    """Noise per coordinate [mm] from residual lengths (n,), with the small-sample factor sqrt(3n / (3n - parameters)).

    The median of the lengths over the median of chi with 3 degrees of freedom; never below `SCALE_FLOOR`.
    """
    n = len(lengths)
    factor = np.sqrt(3.0 * n / max(3.0 * n - parameters, 1.0))
    return max(float(np.median(lengths)) / _MEDIAN_CHI * float(factor), SCALE_FLOOR)


def fit_robust(source: ArrayLike, reference: ArrayLike, *, seed: int = 0, by_direction: bool = True) -> RobustFit:
    """Rigid fit that wrong pairs do not move.

    Parameters
    ----------
    source, reference : (n, 3) arrays, n >= 4
        Paired points [mm].
    seed : int
        Of the consensus start (more than 1,000 triples) and of the test for even noise, where chance plays a part.
    by_direction : bool
        Judge with each direction's own noise where that is not the same along all axes; see `judged_by_direction`.

    Raises
    ------
    RegistrationError
        See `respot.registration.rigid.check_pairs`; ``TOO_FEW_PAIRS`` for fewer than 4 pairs.
    DegenerateError
        All pairs, or the inliers, lie on a line.
    """
    first, second = check_pairs(source, reference, minimum=4)
    step = _step(len(first))
    sample, target = first[::step], second[::step]
    core, start = _core(sample, target, seed)
    inliers = settle_inliers(sample, target, core)
    if step > 1 and int(inliers.sum()) >= 4:
        inliers = _among_all(first, second, sample[inliers], target[inliers])
    try:
        rigid = fit_rigid(first, second, inliers.astype(np.float64))
    except DegenerateError as error:
        raise DegenerateError(f"of the {int(inliers.sum())} pairs that agree with each other, {error}") from error
    except RegistrationError:
        inliers, rigid, start = np.ones(len(first), dtype=bool), fit_rigid(first, second), "least-squares"
    fit = _robust_fit(rigid, inliers, start)
    return judged_by_direction(fit, first, second, seed=seed) if by_direction else fit


def judged_by_direction(fit: RobustFit, source: Array, reference: Array, *, seed: int = 0) -> RobustFit:
    """Judge anew with each direction's own noise, where that changes a verdict and the noise is not a sphere.

    Spots are spaced by hand along a flange: by the length of residuals good ones along it are put out, so that
    intervals along it come out too narrow, and bad ones across it stay in. The inliers that the directions tell are
    tested for noise that is the same along all axes (`respot.registration.anisotropy.isotropy_p_value`, below 0.01):
    of the widest direction the plain test has cut off what makes it wide.

    Parameters
    ----------
    fit : RobustFit
        By the length of residuals, of the same pairs.
    source, reference : (n, 3) arrays [mm]
    seed : int
        Of the test's draws.
    """
    step = _step(len(source))
    sample, target, core = source[::step], reference[::step], fit.inliers[::step]
    if int(core.sum()) <= LEAST_WITNESSES or rough_isotropy_p_value(fit.rigid.residuals[::step][core]) > _CLEARLY_EVEN:
        return fit
    inliers = settle_by_direction(sample, target, core)
    if np.array_equal(inliers, core) or _alike(sample[inliers], target[inliers], seed):
        return fit
    try:
        near = fit_rigid(sample, target, inliers.astype(np.float64)).residuals[inliers]
        noise = noise_covariance(near)[0]
        if step > 1:
            inliers = _among_all(source, reference, sample[inliers], target[inliers], whiten=_whiten(noise))
        rigid = fit_rigid(source, reference, inliers.astype(np.float64))
    except RegistrationError:
        return fit
    plain = _robust_fit(rigid, inliers, fit.start)
    limit = float(direction_limit(noise[None], np.array([len(near)]))[0])
    return replace(plain, threshold=float(np.sqrt(limit * np.linalg.eigvalsh(noise)[2])), by_direction=True)


def _alike(source: Array, reference: Array, seed: int) -> bool:
    """Whether noise that is the same along all axes explains what a fit of these pairs leaves."""
    try:
        return isotropy_p_value(source, reference, seed=seed) >= SIGNIFICANCE
    except RegistrationError:
        return True


def _step(n: int) -> int:
    """Every which pair of a table is in its sample."""
    return max(1, -(-n // _SAMPLE))


def _robust_fit(rigid: RigidFit, inliers: NDArray[np.bool_], start: str) -> RobustFit:
    lengths = np.sqrt(np.einsum("nk,nk->n", rigid.residuals, rigid.residuals))
    count = int(inliers.sum())
    scale = noise_of(float(np.sum(np.square(lengths[inliers]))), count)
    threshold = scale * float(np.sqrt(f_limit(count)))
    return RobustFit(rigid, inliers, _tukey(lengths / scale), scale, threshold, start)


def _whiten(noise: Array) -> Array:
    """Matrix (3, 3) that makes residual vectors of such noise a sphere of the same mean variance."""
    values, vectors = np.linalg.eigh(noise)
    result: Array = vectors * np.sqrt(np.trace(noise) / 3.0 / values) @ vectors.T
    return result


def _core(source: Array, reference: Array, seed: int) -> tuple[NDArray[np.bool_], str]:
    """Pairs that belong together, and the start that found them."""
    start, transform = "least-squares", _settle(source, reference, transform_of(source, reference))
    scale = robust_scale(_lengths(source, reference, transform))
    agreed = consensus_transform(source, reference, seed=seed)
    agreed_scale = _quota_scale(_lengths(source, reference, agreed))
    clearly = _MANY_BAD * (1.0 - PARAMETERS / (3.0 * quota_of(len(source)))) ** 2  # few agree closely by chance alone
    core, scale = _inliers(source, reference, transform, scale)
    other, other_scale = _inliers(source, reference, agreed, agreed_scale)
    return (other, "consensus") if other_scale < clearly * scale else (core, start)


def _among_all(
    source: Array, reference: Array, sample: Array, target: Array, whiten: Array | None = None
) -> NDArray[np.bool_]:
    """Inliers (n,) among all pairs of a large table, from the inliers of a sample of it.

    The outlier test as it is for very many inliers: the prediction is certain beside the noise. ``whiten`` (3, 3) makes
    residuals with the noise of their direction a sphere.
    """
    rotation, translation = transform_of(sample, target)
    near = sample @ rotation.T + translation - target
    noise = noise_of(float(np.sum(np.square(near if whiten is None else near @ whiten))), len(sample))
    origins = sample.mean(axis=0), target.mean(axis=0)
    inliers = np.zeros(len(source), dtype=bool)
    count = len(sample)
    for _ in range(_FULL_TURNS):
        limit = f_limit(count) * noise**2
        cross, first_sum, second_sum = np.zeros((3, 3)), np.zeros(3), np.zeros(3)
        count, changed, square_sum = 0, 0, 0.0
        for begin in range(0, len(source), BLOCK):
            rows = slice(begin, begin + BLOCK)
            first, second = source[rows] - origins[0], reference[rows] - origins[1]
            residuals = first @ rotation.T + (rotation @ origins[0] + translation - origins[1]) - second
            residuals = residuals if whiten is None else residuals @ whiten
            squares = np.einsum("nk,nk->n", residuals, residuals)
            inside = squares <= limit
            changed += int(np.count_nonzero(inside != inliers[rows]))
            inliers[rows] = inside
            share = inside.astype(np.float64)
            square_sum += float(share @ squares)
            count += int(np.count_nonzero(inside))
            first_sum += share @ first
            second_sum += share @ second
            cross += (first * share[:, None]).T @ second
        if changed == 0:
            break
        rotation = rotations_from_covariance(cross - np.outer(first_sum, second_sum) / count)[0]
        translation = second_sum / count + origins[1] - rotation @ (first_sum / count + origins[0])
        noise = noise_of(square_sum, count)
    return inliers


def _quota_scale(lengths: Array) -> float:
    """Noise per coordinate from the closest 45 % alone, as `robust_scale` from the closest half."""
    n = len(lengths)
    quota = quota_of(n)
    factor = np.sqrt(3.0 * quota / (3.0 * quota - PARAMETERS))
    return max(
        float(np.partition(lengths, quota - 1)[quota - 1] / stats.chi.ppf(quota / (n + 1), 3) * factor), SCALE_FLOOR
    )


def _lengths(source: Array, reference: Array, transform: Transform) -> Array:
    lengths: Array = np.linalg.norm(source @ transform[0].T + transform[1] - reference, axis=1)
    return lengths


def _settle(source: Array, reference: Array, transform: Transform) -> Transform:
    """Huber with a free scale, then Tukey with the scale of the Huber solution, then Tukey with its own."""
    transform, scale = _reweigh(source, reference, transform, huber=True, scale=None)
    transform, scale = _reweigh(source, reference, transform, huber=False, scale=scale)
    transform, _ = _reweigh(source, reference, transform, huber=False, scale=None)
    return transform


def _reweigh(
    source: Array, reference: Array, transform: Transform, *, huber: bool, scale: float | None
) -> tuple[Transform, float]:
    current = scale or 0.0
    lengths = _lengths(source, reference, transform)
    for _ in range(_TURNS):
        current = scale or robust_scale(lengths)
        weights = _huber(lengths / current) if huber else _tukey(lengths / current)
        if np.count_nonzero(weights) < 3:
            break
        transform = transform_of(source, reference, weights)
        before, lengths = lengths, _lengths(source, reference, transform)
        if float(np.max(np.abs(lengths - before))) < 1e-3 * current:
            break
    return transform, scale or robust_scale(lengths)


def _huber(ratio: Array) -> Array:
    return _HUBER / np.maximum(ratio, _HUBER)


def _tukey(ratio: Array) -> Array:
    weights: Array = np.square(np.clip(1.0 - np.square(ratio / _TUKEY), 0.0, None))
    return weights


def _inliers(source: Array, reference: Array, transform: Transform, scale: float) -> tuple[NDArray[np.bool_], float]:
    """Settle the set of inliers: threshold, least squares over them, scale from their median, until the set stays."""
    inliers = np.ones(len(source), dtype=bool)
    seen: set[bytes] = set()
    for _ in range(_TURNS):
        lengths = _lengths(source, reference, transform)
        inliers = lengths <= INLIER_CHI * scale
        key = np.packbits(inliers).tobytes()
        if key in seen or int(inliers.sum()) < 4:
            break
        seen.add(key)
        transform = transform_of(source[inliers], reference[inliers])
        scale = robust_scale(_lengths(source[inliers], reference[inliers], transform))
    return inliers, scale
