"""The paper's own method: random subsets, inliers counted outside the subset, least variance.

"Reverse Calibration Method for Welding Spots Based on PD/PS Simulation System" (Innovation Series: Advanced Science 2
(2025)), for comparison with `respot.registration.robust`. In our own words:

- **Equation (5)**: every theoretical spot is the image of its actual spot under one rotation and one translation,
  ``q_i = R p_i + t``.
- **Equation (6)**: R and t of some spots by least squares over their coordinates. Unconstrained, its 12 unknowns need
  N >= 4 spots (`respot.registration.affine`); here the orthogonality of R is enforced, as the paper asks of its result:
  the least-squares *rotation* (`respot.registration.rigid`).
- **Equation (7)**: the residual of a spot outside the subset is the largest of its three coordinate differences,
  ``delta_i = max(abs(q_i - (R p_i + t)))``. The spot is an inlier if ``delta_i <= tau``; I is the set of inliers.
- **Equation (8)**: a subset with ``|I| > N_min`` is scored by ``D_n``, the variance of the ``delta_i`` over I; the
  subset with the least D_n gives the answer, and R and t are those of its N spots.

What the paper leaves unsaid, and what is done here:

- tau: `TAU`, the tolerance that the paper promises for every coordinate, 10 mm.
- N_min: half of the spots outside the subset, rounded down, so that a majority of them has to agree.
- how many subsets: `TRIALS`; all of them where there are no more than that (14 spots: all 1,001).
- the variance is about the mean of the delta_i, over their number. A variance about the mean does not see a shift that
  all inliers share; ``score="mean-square"`` takes it about zero instead, the other way to read the word.
- equal D_n: more inliers first, then the subset that comes first.

Two properties follow from the letter and are not repaired here. The residuals of the subset's own N spots are never
tested: a wrong spot inside the subset goes unseen (`PaperFit.beyond` names it). The largest coordinate difference
depends on the directions of the axes: turning the reference frame may change the answer.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from math import ceil, comb
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from respot.registration.errors import DegenerateError, RegistrationError
from respot.registration.rigid import COLLINEAR_TOLERANCE, check_pairs, rotations_from_covariance

Array = NDArray[np.float64]
Rows = NDArray[np.intp]
Score = Literal["variance", "mean-square"]

TAU = 10.0
TRIALS = 5000
SUBSET_SIZE = 4
_CELLS = 400_000  # subsets times spots in one batch: some 10 MB of residuals


@dataclass(frozen=True)
class RunnerUp:
    """The best subset that drops other spots than the chosen one.

    Attributes
    ----------
    rank : int
        Its place among the subsets that qualified, counted from 1 (the chosen subset).
    subset, dropped : tuple of int
        Rows (0-based).
    d_n : float
        Its score [mm^2].
    """

    rank: int
    subset: tuple[int, ...]
    dropped: tuple[int, ...]
    d_n: float


@dataclass(frozen=True, eq=False)
class PaperFit:
    """What the paper's method chose. Rows count from 0, in the order of the pairs.

    Attributes
    ----------
    rotation : (3, 3) array
        R of equation (5), proper, source to reference.
    translation : (3,) array
        t of equation (5) [mm].
    residuals : (n, 3) array
        Predicted minus reference of every pair [mm].
    delta : (n,) array
        Equation (7) for every pair, members of the subset included [mm].
    subset : tuple of int
        The chosen N pairs.
    inliers : tuple of int
        I: pairs outside the subset with ``delta <= tau``.
    dropped : tuple of int
        Pairs outside the subset with ``delta > tau``.
    beyond : tuple of int
        Members of the subset with ``delta > tau``: the method itself never looks at them.
    d_n : float
        Equation (8) [mm^2].
    score : "variance" or "mean-square"
        How equation (8) is read.
    tau : float
        [mm]
    n_min, subset_size : int
    n_subsets : int
        Subsets tried: all there are, or random ones.
    exhaustive : bool
        Whether all subsets were tried.
    n_degenerate : int
        Subsets left out because their spots lie on a line.
    n_qualified : int
        Subsets with ``|I| > n_min``.
    runner_up : RunnerUp or None
        None where every subset that qualified drops the same spots.
    """

    rotation: Array
    translation: Array
    residuals: Array
    delta: Array
    subset: tuple[int, ...]
    inliers: tuple[int, ...]
    dropped: tuple[int, ...]
    beyond: tuple[int, ...]
    d_n: float
    score: Score
    tau: float
    n_min: int
    subset_size: int
    n_subsets: int
    exhaustive: bool
    n_degenerate: int
    n_qualified: int
    runner_up: RunnerUp | None


def default_n_min(n: int, subset_size: int = SUBSET_SIZE) -> int:
    """Half of the spots outside the subset, rounded down: more than half have to be inliers."""
    return (n - subset_size) // 2


def fit_paper(
    source: ArrayLike,
    reference: ArrayLike,
    *,
    tau: float = TAU,
    n_min: int | None = None,
    trials: int = TRIALS,
    seed: int = 0,
    subset_size: int = SUBSET_SIZE,
    score: Score = "variance",
) -> PaperFit:
    """Rigid transform by equations (5) to (8) of the paper; the module's head says them in words.

    Parameters
    ----------
    source, reference : (n, 3) arrays
        Actual and theoretical spots, paired [mm]; n greater than ``subset_size``.
    tau : float
        Largest residual of an inlier, by its largest coordinate [mm].
    n_min : int, optional
        A subset qualifies with more inliers than this outside of it; default `default_n_min`.
    trials : int
        At most this many subsets; all of them where there are no more.
    seed : int
        Of the random subsets.
    subset_size : int
        N, 4 or more.
    score : "variance" or "mean-square"
        D_n about the mean of the residuals, or about zero.

    Raises
    ------
    RegistrationError
        See `respot.registration.rigid.check_pairs`. ``TOO_FEW_PAIRS``: no spot is left outside a subset.
        ``BAD_OPTION``: tau, n_min, trials or subset_size out of range. ``NO_SUBSET``: no subset qualifies; the message
        names the smallest tau that would do.
    DegenerateError
        Every subset lies on a line.
    """
    first, second = check_pairs(source, reference, minimum=subset_size + 1)
    n = len(first)
    least = default_n_min(n, subset_size) if n_min is None else n_min
    _check_options(n, tau, least, trials, subset_size)
    subsets = _subsets(n, subset_size, trials, seed)
    scores, counts, needed, usable = _score(first, second, subsets, tau, least, score)
    if not usable.any():
        raise DegenerateError("the spots of every subset lie on a line: no rotation can be found; add spots beside it")
    qualified = np.flatnonzero(usable & (counts > least))
    if not len(qualified):
        would_do = ceil(float(needed[usable].min()) * 1000.0) / 1000.0
        raise RegistrationError(
            "NO_SUBSET",
            f"none of the {len(subsets)} subsets of {subset_size} spots leaves more than {least} others within "
            f"{tau:g} mm; the smallest --tau that would do is {would_do:.3f} mm, or ask for fewer with --n-min",
        )
    ranked = qualified[np.lexsort((qualified, -counts[qualified], scores[qualified]))]
    rotations, translations, residuals, _ = _residuals(first, second, subsets[ranked[:1]])
    delta = np.abs(residuals[0]).max(axis=1)
    member = np.zeros(n, dtype=bool)
    member[subsets[ranked[0]]] = True
    return PaperFit(
        rotation=rotations[0],
        translation=translations[0],
        residuals=residuals[0],
        delta=delta,
        subset=_rows(member),
        inliers=_rows(~member & (delta <= tau)),
        dropped=_rows(~member & (delta > tau)),
        beyond=_rows(member & (delta > tau)),
        d_n=float(scores[ranked[0]]),
        score=score,
        tau=float(tau),
        n_min=least,
        subset_size=subset_size,
        n_subsets=len(subsets),
        exhaustive=comb(n, subset_size) <= trials,
        n_degenerate=int((~usable).sum()),
        n_qualified=len(qualified),
        runner_up=_runner_up(first, second, subsets, ranked, scores, tau),
    )


def _check_options(n: int, tau: float, n_min: int, trials: int, subset_size: int) -> None:
    if not (np.isfinite(tau) and tau > 0.0):
        raise RegistrationError("BAD_OPTION", f"--tau must be a length above 0 mm, not {tau:g}")
    if subset_size < 4 or trials < 1:
        raise RegistrationError("BAD_OPTION", "a subset needs 4 spots or more, and at least one subset must be tried")
    if not 0 <= n_min < n - subset_size:
        raise RegistrationError(
            "BAD_OPTION",
            f"--n-min must lie between 0 and {n - subset_size - 1}, not {n_min}: "
            f"of {n} spots {n - subset_size} are left outside a subset of {subset_size}",
        )


def _subsets(n: int, size: int, trials: int, seed: int) -> Rows:
    """All subsets in order of their rows, or ``trials`` random ones (each without repetition); (b, size)."""
    if comb(n, size) <= trials:
        return np.array(list(combinations(range(n), size)), dtype=np.intp)
    rng = np.random.default_rng(seed)
    batch = max(1, _CELLS // n)
    drawn = [
        np.argpartition(rng.random((min(batch, trials - start), n)), size, axis=1)[:, :size]
        for start in range(0, trials, batch)
    ]
    return np.sort(np.concatenate(drawn), axis=1)


def _residuals(source: Array, reference: Array, subsets: Rows) -> tuple[Array, Array, Array, NDArray[np.bool_]]:
    """Equation (6) with R kept orthogonal, for a batch: R (b, 3, 3), t (b, 3), residuals (b, n, 3), determined (b,)."""
    chosen, wanted = source[subsets], reference[subsets]
    source_mean, reference_mean = chosen.mean(axis=1), wanted.mean(axis=1)
    left, right = chosen - source_mean[:, None], wanted - reference_mean[:, None]
    rotations, values, sign = rotations_from_covariance(np.swapaxes(left, -1, -2) @ right)
    determined = values[:, 1] + sign * values[:, 2] > COLLINEAR_TOLERANCE**2 * values[:, 0]
    translations = reference_mean - np.einsum("bij,bj->bi", rotations, source_mean)
    residuals = np.einsum("bij,nj->bni", rotations, source) + translations[:, None] - reference
    return rotations, translations, residuals, determined


def _batches(subsets: Rows, n: int) -> Iterator[slice]:
    size = max(1, _CELLS // n)
    return (slice(start, start + size) for start in range(0, len(subsets), size))


def _outside(source: Array, reference: Array, subsets: Rows) -> tuple[Array, NDArray[np.bool_]]:
    """Equation (7) (b, n), infinite for the subset's own spots; and which subsets determine a rotation (b,)."""
    _, _, residuals, determined = _residuals(source, reference, subsets)
    delta = np.abs(residuals).max(axis=-1)
    np.put_along_axis(delta, subsets, np.inf, axis=1)
    return delta, determined


def _score(
    source: Array, reference: Array, subsets: Rows, tau: float, n_min: int, score: Score
) -> tuple[Array, Rows, Array, NDArray[np.bool_]]:
    """D_n of equation (8), |I|, the tau at which a subset would qualify, and whether it determines a rotation; (b,)."""
    scores, counts, needed, usable = [], [], [], []
    for batch in _batches(subsets, len(source)):
        delta, determined = _outside(source, reference, subsets[batch])
        inside = delta <= tau
        count = inside.sum(axis=1)
        divisor = np.maximum(count, 1)
        kept = np.where(inside, delta, 0.0)
        about = kept.sum(axis=1) / divisor if score == "variance" else np.zeros(len(delta))
        squares = np.where(inside, np.square(kept - about[:, None]), 0.0)
        scores.append(squares.sum(axis=1) / divisor)
        counts.append(count)
        needed.append(np.partition(delta, n_min, axis=1)[:, n_min])
        usable.append(determined)
    return np.concatenate(scores), np.concatenate(counts), np.concatenate(needed), np.concatenate(usable)


def _runner_up(
    source: Array, reference: Array, subsets: Rows, ranked: Rows, scores: Array, tau: float
) -> RunnerUp | None:
    chosen: NDArray[np.bool_] | None = None
    place = 0
    for batch in _batches(ranked, len(source)):
        rows = ranked[batch]
        delta, _ = _outside(source, reference, subsets[rows])
        dropped = (delta > tau) & np.isfinite(delta)
        chosen = dropped[0] if chosen is None else chosen
        other = np.flatnonzero((dropped != chosen).any(axis=1))
        if len(other):
            row = int(rows[other[0]])
            subset = tuple(int(value) for value in subsets[row])
            return RunnerUp(place + int(other[0]) + 1, subset, _rows(dropped[other[0]]), float(scores[row]))
        place += len(rows)
    return None


def _rows(mask: NDArray[np.bool_]) -> tuple[int, ...]:
    return tuple(int(row) for row in np.flatnonzero(mask))
