"""The fit with a tool offset that wrong pairs do not move: which pairs belong together, then least squares."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from respot.calibration.effects.tool_fit import (
    LEAST_SPOTS,
    SCALE_FLOOR,
    ToolFit,
    blocks_of,
    determined_basis,
    distance_start,
    fit_tool,
    moved_by,
    solve,
)
from respot.registration.errors import RegistrationError
from respot.registration.rigid import transform_of
from respot.registration.robust import robust_scale

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

LEVEL = 0.999
_SUBSETS, _SUBSET = 200, 6
_ROUGH_MM = 0.1  # a subset only says where to begin
_CLEARLY = 0.5
_TURNS = 20
_TUKEY = 5.5
_SAMPLE = 2000


def fit_tool_robust(source: Array, tools: Array, reference: Array, *, seed: int = 0) -> ToolFit:
    """Fit that wrong pairs do not move.

    Two starts: all pairs; and a core, from the best of 200 subsets of 6 spots by Tukey weights on the norm of each
    residual. From each, pairs come in and go out by the mean-shift test (R. D. Cook and S. Weisberg, 1982, section
    2.2): each is judged by the fit of the others, with all 9 parameters and the degrees of freedom that are left. The
    core's set is taken where its noise is below half of the other's: few spots and 9 parameters always find a core that
    agrees better. The subsets are drawn from the spots in the order of their coordinates: sorting changes nothing.

    Parameters
    ----------
    source, reference : (n, 3) arrays [mm]
    tools : (n, 3, 3) array
    seed : int

    Raises
    ------
    RegistrationError
        As `fit_tool`.
    """
    basis = determined_basis(source, tools)
    order = canonical_order(source, reference)
    step = max(1, -(-len(source) // _SAMPLE))
    sample = order[::step]
    plain = _settle(source, tools, reference, np.ones(len(source), dtype=np.bool_))
    offset, weights = _core(source[sample], tools[sample], reference[sample], basis, seed)
    moved = moved_by(source, tools, offset)
    rotation, translation = transform_of(moved[sample], reference[sample], weights)
    lengths = np.linalg.norm(moved @ rotation.T + translation - reference, axis=1)
    core = lengths <= max(float(np.median(lengths)), SCALE_FLOOR)
    try:
        settled = _settle(source, tools, reference, np.asarray(core, dtype=np.bool_))
    except RegistrationError:
        return plain
    enough = 2 * int(settled.inliers.sum()) >= len(source)
    return settled if enough and settled.sigma < _CLEARLY * plain.sigma else plain


def _settle(source: Array, tools: Array, reference: Array, inliers: Mask) -> ToolFit:
    """Let pairs in that pass the test and put out the worst that fail it, until none is left to move."""
    fit = fit_tool(source, tools, reference, inliers)
    seen: set[bytes] = set()
    for _ in range(len(source)):
        key = np.packbits(fit.inliers).tobytes()
        if key in seen:
            break
        seen.add(key)
        excess = outlier_excess(fit, tools)
        some = max(1, int(fit.inliers.sum()) // 20)
        passing = np.flatnonzero(~fit.inliers & (excess <= 1.0))
        failing = np.flatnonzero(fit.inliers & (excess > 1.0))
        changed = fit.inliers.copy()
        if len(passing):
            changed[passing[np.argsort(excess[passing], kind="stable")[:some]]] = True
        elif len(failing):
            changed[failing[np.argsort(-excess[failing], kind="stable")[:some]]] = False
        else:
            break
        try:
            fit = fit_tool(source, tools, reference, changed, fit.offset)
        except RegistrationError:
            break
    return fit


def outlier_excess(fit: ToolFit, tools: Array) -> Array:
    """Test value of each pair over its limit, (n,): above 1 it is an outlier to all other inliers.

    With e the residual and ``H`` the variance of the prediction for unit noise, ``e' (I -+ H)^-1 e / (3 s^2)`` follows
    F with 3 and the others' degrees of freedom, where s is the noise that the others leave.
    """
    blocks = blocks_of(fit, tools)
    own = np.einsum("ji,nj->ni", fit.rotation, fit.residuals)
    spread = np.eye(3) + np.where(fit.inliers, -1.0, 1.0)[:, None, None] * (blocks @ np.swapaxes(blocks, 1, 2))
    inverse = np.linalg.pinv(spread, rcond=1e-6, hermitian=True)
    squares = np.einsum("ni,nij,nj->n", own, inverse, own)
    total, free = fit.sigma**2 * fit.degrees_of_freedom, fit.degrees_of_freedom
    outside = squares / (3.0 * max(total / free, SCALE_FLOOR**2) * stats.f.ppf(LEVEL, 3, free))
    if free <= 3:
        return np.asarray(np.where(fit.inliers, 0.0, outside), dtype=np.float64)
    without = np.maximum((total - squares) / (free - 3), SCALE_FLOOR**2)
    inside = squares / (3.0 * without * stats.f.ppf(LEVEL, 3, free - 3))
    return np.asarray(np.where(fit.inliers, inside, outside), dtype=np.float64)


def canonical_order(source: Array, reference: Array) -> NDArray[np.intp]:
    """Order of rows by their own coordinates, so that chance does not depend on how a table is sorted."""
    keys = np.concatenate([source, reference], axis=1)
    return np.lexsort(keys.T[::-1])


def _core(source: Array, tools: Array, reference: Array, basis: Array, seed: int) -> tuple[Array, Array]:
    """Offset and weights of pairs that agree closely: the best of many subsets, then Tukey weights."""

    def lengths(offset: Array, weights: Array) -> Array:
        moved = moved_by(source, tools, offset)
        rotation, translation = transform_of(moved, reference, weights)
        return np.asarray(np.linalg.norm(moved @ rotation.T + translation - reference, axis=1), dtype=np.float64)

    even = np.ones(len(source))
    starts = [np.zeros(3), distance_start(source, tools, reference, basis)]
    ends = [solve(source, tools, reference, even, start, basis) for start in starts]
    plain = min(ends, key=lambda offset: float(np.median(lengths(offset, even))))
    offset, weights = _consensus(source, tools, reference, plain, basis, seed)
    for _ in range(_TURNS):
        left = lengths(offset, weights)
        tried = np.square(np.clip(1.0 - np.square(left / (_TUKEY * robust_scale(left, 9))), 0.0, None))
        if np.count_nonzero(tried > 1e-3) < LEAST_SPOTS:
            break
        before, weights = offset, tried
        offset = solve(source, tools, reference, weights, offset, basis)
        if float(np.max(np.abs(offset - before))) < 1e-3:
            break
    return offset, weights


def _consensus(
    source: Array, tools: Array, reference: Array, start: Array, basis: Array, seed: int
) -> tuple[Array, Array]:
    """The subset whose fit leaves the smallest median residual: its offset, and weights that are 1 on the subset."""
    rng = np.random.default_rng(seed)
    n = len(source)
    rows = np.stack([rng.choice(n, min(_SUBSET, n), replace=False) for _ in range(_SUBSETS)])
    first, turned, second = source[rows], tools[rows], reference[rows]
    starts = np.broadcast_to(start, (len(rows), 3))
    offsets = solve(first, turned, second, np.ones(rows.shape), starts, basis, _ROUGH_MM)
    moved = first + np.einsum("bnij,bj->bni", turned, offsets)
    rotations, translations = transform_of(moved, second)
    costs = []
    for offset, rotation, translation in zip(offsets, rotations, translations, strict=True):
        left = moved_by(source, tools, offset) @ rotation.T + translation - reference
        costs.append(float(np.median(np.einsum("nk,nk->n", left, left))))
    best = int(np.argmin(costs))
    weights = np.zeros(n)
    weights[rows[best]] = 1.0
    return offsets[best], weights
