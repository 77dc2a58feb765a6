"""The robust rigid fit: which pairs belong together, then least squares over these.

Iteratively reweighted least squares on the *norm* of each residual vector (so that turning the frame changes
nothing): least squares, then Huber weights, then Tukey's biweight (P. J. Huber, *Robust Statistics*, 1981; V. Yohai,
Ann. Statist. 15 (1987)). A consensus start takes over where it finds a far smaller scale.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

from respot.registration.consensus import consensus_transform, quota_of
from respot.registration.errors import DegenerateError, RegistrationError
from respot.registration.rigid import RigidFit, check_pairs, fit_rigid, transform_of

Array = NDArray[np.float64]
Transform = tuple[Array, Array]

RIGID_PARAMETERS = 6
INLIER_CHI = float(stats.chi.ppf(0.999, 3))
SCALE_FLOOR = 1e-3  # mm; a finer scale than a micrometre is printing, not noise
_MEDIAN_CHI = float(stats.chi.median(3))
_HUBER = float(stats.chi.ppf(0.90, 3))
_TUKEY = 5.5
_MANY_BAD = 0.6  # the consensus start is taken where its scale is below this share of the other's (large tables)
_SAMPLE = 20_000  # larger tables find their basin on an even sample of this size
_TURNS = 30


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
        Noise per coordinate, from the median residual of the inliers [mm].
    threshold : float
        Largest residual length of an inlier [mm]: 99.9 % of chi with 3 degrees of freedom times ``scale``.
    start : str
        ``"least-squares"`` or ``"consensus"``: the start that led here.
    """

    rigid: RigidFit
    inliers: NDArray[np.bool_]
    weights: Array
    scale: float
    threshold: float
    start: str


def robust_scale(lengths: Array, parameters: int = RIGID_PARAMETERS) -> float:
    """Noise per coordinate [mm] from residual lengths (n,), with the small-sample factor sqrt(3n / (3n - parameters)).

    The median of the lengths over the median of chi with 3 degrees of freedom; never below `SCALE_FLOOR`.
    """
    n = len(lengths)
    factor = np.sqrt(3.0 * n / max(3.0 * n - parameters, 1.0))
    return max(float(np.median(lengths)) / _MEDIAN_CHI * float(factor), SCALE_FLOOR)


def fit_robust(source: ArrayLike, reference: ArrayLike, *, seed: int = 0) -> RobustFit:
    """Rigid fit that wrong pairs do not move.

    Parameters
    ----------
    source, reference : (n, 3) arrays, n >= 4
        Paired points [mm].
    seed : int
        Of the consensus start, the one place where chance plays a part (more than 1,000 triples).

    Raises
    ------
    RegistrationError
        See `respot.registration.rigid.check_pairs`; ``TOO_FEW_PAIRS`` for fewer than 4 pairs.
    DegenerateError
        All pairs, or the inliers, lie on a line.
    """
    first, second = check_pairs(source, reference, minimum=4)
    plain = fit_rigid(first, second, checked=False)
    step = max(1, -(-len(first) // _SAMPLE))
    sample, target = first[::step], second[::step]

    start, transform = "least-squares", _settle(sample, target, (plain.rotation, plain.translation))
    scale = robust_scale(_lengths(sample, target, transform))
    agreed = consensus_transform(sample, target, seed=seed)
    agreed_scale = _quota_scale(_lengths(sample, target, agreed))
    quota = quota_of(len(sample))
    clearly = _MANY_BAD * (1.0 - RIGID_PARAMETERS / (3.0 * quota)) ** 2  # few pairs agree closely by chance alone
    if _inliers(sample, target, agreed, agreed_scale)[1] < clearly * _inliers(sample, target, transform, scale)[1]:
        start, transform, scale = "consensus", agreed, agreed_scale
    inliers, scale = _inliers(first, second, transform, scale)
    try:
        rigid = fit_rigid(first, second, inliers.astype(np.float64))
    except DegenerateError as error:
        raise DegenerateError(f"of the {int(inliers.sum())} pairs that agree with each other, {error}") from error
    except RegistrationError:
        inliers, rigid, start = np.ones(len(first), dtype=bool), fit_rigid(first, second), "least-squares"
    lengths = np.linalg.norm(rigid.residuals, axis=1)
    return RobustFit(rigid, inliers, _tukey(lengths / scale), scale, INLIER_CHI * scale, start)


def _quota_scale(lengths: Array) -> float:
    """Noise per coordinate from the closest 45 % alone, as `robust_scale` from the closest half."""
    n = len(lengths)
    quota = quota_of(n)
    factor = np.sqrt(3.0 * quota / (3.0 * quota - RIGID_PARAMETERS))
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
