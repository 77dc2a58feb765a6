"""How often chance alone explains as much: permutations of residual vectors, the largest over the whole catalogue.

D. Freedman and D. Lane, J. Bus. Econ. Stat. 1 (1983): the residual vectors of the smaller model are laid on other
spots, and every term of the catalogue is fitted again. A term must beat what the *best* of all terms gains by chance,
with all inner scans (time constants, harmonics) counted in.

P. H. Westfall and S. S. Young, Resampling-Based Multiple Testing (1993), section 2: an effect that may be at hundreds
of places gains more by chance than one that has a single form, so each is judged by what its own terms gain, and the
smallest of these chances is what the draws must beat.
"""

from __future__ import annotations

from dataclasses import dataclass
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
_RARE = -15.0


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


@dataclass(frozen=True, eq=False)
class Chance:
    """What permutations gain.

    Attributes
    ----------
    tries : (effects,) array
        As many independent terms as each effect seems to have, by what its best term gains.
    largest : (draws,) array
        Largest score over all effects, each less what its own number of tries explains.
    """

    tries: Array
    largest: Array

    def scores(self, scores: Array, effects: NDArray[np.intp]) -> Array:
        """Scores (terms,) less what the tries of each one's effect explain."""
        return _less_tries(scores, self.tries[effects])

    def limit(self, alpha: float) -> float:
        """Score that chance reaches with this probability."""
        return float(np.quantile(self.largest, 1.0 - alpha))


def _less_tries(scores: Array, tries: Array) -> Array:
    """Normal score of the largest of so many independent ones being as large."""
    finite = np.isfinite(scores)
    safe = np.where(finite, scores, 0.0)
    tail = special.log_ndtr(-safe)
    # of rare events as many tries make as many times the probability
    chance = np.where(tail < _RARE, np.log(tries) + tail, np.log(-np.expm1(tries * special.log_ndtr(safe)) + 1e-300))
    return np.where(finite, -special.ndtri_exp(np.minimum(chance, -1e-16)), scores)


def by_chance(
    bank: Bank,
    basis: Array,
    left: Array,
    gains: Gains,
    allowed: NDArray[np.bool_],
    effects: NDArray[np.intp],
    free: int,
    *,
    draws: int,
    seed: int,
) -> Chance:
    """What the allowed terms gain over permutations of the residual vectors.

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
    effects : (terms,) int array
        Number of each term's effect, from 0.
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
        best = np.full((int(effects.max()) + 1, count), -np.inf)
        for size, members in bank.groups.items():
            use = allowed[members] & (gains.ranks[members] > 0)
            if not use.any():
                continue
            shares = gains.whiteners[size][use] @ products[bank.places[size][use]]
            squares = np.einsum("tkd,tkd->td", shares, shares)
            kinds = np.stack([effects[members[use]], gains.ranks[members[use]]], axis=1)
            for effect, rank in np.unique(kinds, axis=0):  # of terms of one rank the largest gain has the largest score
                largest = squares[np.all(kinds == (effect, rank), axis=1)].max(axis=0)
                best[effect] = np.maximum(best[effect], normal_score(largest, rank, totals, free))
        found.append(best)
    scores = np.concatenate(found, axis=1)
    tried = np.isfinite(scores).all(axis=1)
    tries = np.ones(len(scores))
    # the largest of k independent normal numbers has the distribution Phi^k: k by maximum likelihood
    tries[tried] = np.maximum(1.0 / np.mean(-special.log_ndtr(scores[tried]), axis=1), 1.0)
    evened = _less_tries(scores[tried], tries[tried, None])
    return Chance(tries, evened.max(axis=0, initial=-np.inf))


def p_value(score: float, chance: Chance) -> float:
    """Share of draws whose best term scores as high, ``(1 + as high) / (1 + draws)``."""
    return float((1 + np.count_nonzero(chance.largest >= score)) / (1 + len(chance.largest)))
