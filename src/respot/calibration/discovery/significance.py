"""How often chance alone explains as much: permutations of residual vectors, the largest over the whole catalogue.

D. Freedman and D. Lane, J. Bus. Econ. Stat. 1 (1983): the residual vectors of the smaller model are laid on other
spots, and every term of the catalogue is fitted again. A term must beat what the *best* of all terms gains by chance,
with all inner scans (time constants, harmonics) counted in.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import special, stats

from respot.calibration.discovery.bank import Bank, Gains

Array = NDArray[np.float64]

ALPHA = 0.01
DRAWS = 1000
_AT_ONCE = 250
_LEAST_LOG = -600.0


def normal_score(squares: Array, ranks: NDArray[np.intp], left: Array | float, free: int) -> Array:
    """Gains as normal scores, comparable over terms of different size: as unlikely a normal number as the F value.

    Parameters
    ----------
    squares, ranks : arrays
        Sum of squares explained [mm^2], and directions used; ranks may have fewer axes at the end.
    left : array or float
        Sum of squares before [mm^2].
    free : int
        Degrees of freedom before.
    """
    score = np.full(np.broadcast_shapes(np.shape(squares), np.shape(ranks)), -np.inf)
    ratio = np.log(np.maximum(squares, 1e-300) / np.maximum(left - squares, 1e-300))
    for rank in np.unique(ranks):
        if rank > 0:
            rows = np.broadcast_to(ranks == rank, score.shape)
            grid, scores = _score_table(int(rank), max(free - int(rank), 1))
            score[rows] = np.interp(ratio[rows], grid, scores)
    return score


@lru_cache(maxsize=4096)
def _score_table(rank: int, rest: int) -> tuple[Array, Array]:
    """Logarithm of explained over unexplained squares, and its normal score; straight on beyond what numbers hold."""
    grid = np.linspace(-12.0, 12.0, 1500)
    values = np.exp(grid) * rest / rank
    tail = stats.f.logsf(values, rank, rest)
    known = tail > _LEAST_LOG
    scores = np.where(known, -special.ndtri_exp(np.where(known, tail, -1.0)), 0.0)
    last = int(np.flatnonzero(known)[-1])
    # a tail of exp(-s^2 / 2): the score goes on as the root of its logarithm does
    beyond = np.sqrt(
        np.maximum(scores[last] ** 2 + rest * (np.logaddexp(0.0, grid) - np.logaddexp(0.0, grid[last])), 0.0)
    )
    return grid, np.where(np.arange(len(grid)) <= last, scores, beyond)


def largest_by_chance(
    bank: Bank, basis: Array, left: Array, gains: Gains, allowed: NDArray[np.bool_], free: int, *, draws: int, seed: int
) -> Array:
    """Largest score over the allowed terms, for each of some permutations of the residual vectors, (draws,).

    Parameters
    ----------
    bank : Bank
    basis : (3m, a) array
        Orthonormal: the smaller model beside its rigid part.
    left : (3m,) array
        Its residual [mm].
    gains : Gains
        As `Bank.gains` for that model.
    allowed : (terms,) bool array
        Terms that take part.
    free : int
        Degrees of freedom of the smaller model's residual.
    draws, seed : int
    """
    rng = np.random.default_rng(seed)
    vectors = left.reshape(-1, 3)
    found = []
    for start in range(0, draws, _AT_ONCE):
        count = min(_AT_ONCE, draws - start)
        order = np.argsort(rng.random((count, len(vectors))), axis=1)
        drawn = bank.project(vectors[order].reshape(count, -1).T)
        inside = basis.T @ drawn
        drawn -= basis @ inside
        totals = np.einsum("ij,ij->j", drawn, drawn)
        products = (bank.rough.T @ drawn.astype(np.float32)).astype(np.float64)
        best = np.full(count, -np.inf)
        for size, members in bank.groups.items():
            use = allowed[members] & (gains.ranks[members] > 0)
            if not use.any():
                continue
            shares = gains.whiteners[size][use] @ products[bank.places[size][use]]
            squares = np.einsum("tkd,tkd->td", shares, shares)
            ranks = gains.ranks[members[use]]
            for rank in np.unique(ranks):  # of terms of one rank the largest gain has the largest score
                largest = squares[ranks == rank].max(axis=0)
                best = np.maximum(best, normal_score(largest, np.array(rank), totals, free))
        found.append(best)
    return np.concatenate(found)


def p_value(score: float, by_chance: Array) -> float:
    """Share of draws whose best term scores as high, ``(1 + as high) / (1 + draws)``."""
    return float((1 + np.count_nonzero(by_chance >= score)) / (1 + len(by_chance)))
