"""How often chance alone explains as much: permutations of residual vectors, the largest over the whole catalogue.

D. Freedman and D. Lane, J. Bus. Econ. Stat. 1 (1983): the residual vectors of the smaller model are laid on other
spots, and every term of the catalogue is fitted again. A term must beat what the *best* of all terms gains by chance,
with all inner scans (time constants, harmonics) counted in.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from respot.calibration.discovery.bank import Bank, Gains

Array = NDArray[np.float64]

ALPHA = 0.01
DRAWS = 1000
_AT_ONCE = 250


def normal_score(squares: Array, ranks: NDArray[np.intp], left: Array | float, free: int) -> Array:
    """Gains as normal scores, comparable over terms of different size: the F value by Wilson and Hilferty (1931).

    Parameters
    ----------
    squares, ranks : arrays
        Sum of squares explained [mm^2], and directions used.
    left : array or float
        Sum of squares before [mm^2].
    free : int
        Degrees of freedom before.
    """
    rest = np.maximum(free - ranks, 1.0)
    used = np.maximum(ranks, 1.0)
    ratio = (squares / used) / np.maximum((left - squares) / rest, 1e-300)
    root = np.cbrt(ratio)
    first, second = 2.0 / (9.0 * used), 2.0 / (9.0 * rest)
    score = ((1.0 - second) * root - (1.0 - first)) / np.sqrt(second * root**2 + first)
    return np.where(ranks > 0, score, -np.inf)


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
            each = normal_score(squares, gains.ranks[members[use]][:, None], totals, free)
            best = np.maximum(best, each.max(axis=0))
        found.append(best)
    return np.concatenate(found)


def p_value(score: float, by_chance: Array) -> float:
    """Share of draws whose best term scores as high, ``(1 + as high) / (1 + draws)``."""
    return float((1 + np.count_nonzero(by_chance >= score)) / (1 + len(by_chance)))
