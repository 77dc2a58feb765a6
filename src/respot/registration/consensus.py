"""A start for the robust fit that survives half of the pairs being wrong.

Least quantile of squares over three-point fits (P. J. Rousseeuw, JASA 79 (1984)), sharpened by concentration
steps (Rousseeuw and Van Driessen, Technometrics 41 (1999)).
"""

from __future__ import annotations

from itertools import combinations
from math import ceil, comb

import numpy as np
from numpy.typing import NDArray

from respot.registration.rigid import transform_of
from respot.registration.row_order import own_order

Array = NDArray[np.float64]

TRIALS = 1000  # half of the pairs wrong: the chance to miss three good ones 1000 times is below 1e-57
_KEPT, _STEPS, _SCORED_ROWS = 5, 3, 2000


def quota_of(n: int) -> int:
    """Return how many of n pairs have to agree: 45 %, at least 4."""
    return min(max(ceil(0.45 * n), 4), n)


def consensus_transform(source: Array, reference: Array, *, seed: int, trials: int = TRIALS) -> tuple[Array, Array]:
    """Rotation and translation that the closest 45 % of the pairs agree on best.

    All triples are tried where they are no more than ``trials``, else ``trials`` random ones drawn with ``seed``.
    Rows are put into an order of their own first, so that the order of the table plays no part.

    Parameters
    ----------
    source, reference : (n, 3) arrays, n >= 4 [mm]
    """
    order = own_order(source, reference)
    rng = np.random.default_rng(seed)
    if len(order) > _SCORED_ROWS:
        order = rng.choice(order, _SCORED_ROWS, replace=False)
    origins = np.median(source[order], axis=0), np.median(reference[order], axis=0)
    source, reference = source[order] - origins[0], reference[order] - origins[1]
    squares_of = _Squares(source, reference).of
    n = len(source)
    quota = quota_of(n)
    if comb(n, 3) <= trials:
        triples = np.array(list(combinations(range(n), 3)))
    else:
        triples = np.argsort(rng.random((trials, n)), axis=1)[:, :3] if n <= 50 else _distinct(rng, n, trials)
    rotations, translations = transform_of(source[triples], reference[triples])
    squares = squares_of(rotations, translations)
    best = np.argsort(np.partition(squares, quota - 1, axis=1)[:, quota - 1], kind="stable")[:_KEPT]
    squares = squares[best]
    for _ in range(_STEPS):
        nearest = np.argpartition(squares, quota - 1, axis=1)[:, :quota]
        rotations, translations = transform_of(source[nearest], reference[nearest])
        squares = squares_of(rotations, translations)
    winner = int(np.argmin(np.partition(squares, quota - 1, axis=1)[:, :quota].sum(axis=1)))
    rotation: Array = rotations[winner]
    return rotation, translations[winner] + origins[1] - rotation @ origins[0]


def _distinct(rng: np.random.Generator, n: int, trials: int) -> NDArray[np.intp]:
    """Triples (trials, 3) of three different rows each."""
    first = rng.integers(0, n, trials)
    second = (first + rng.integers(1, n, trials)) % n
    third = rng.integers(0, n - 2, trials)
    third += third >= np.minimum(first, second)
    third += third >= np.maximum(first, second)
    return np.stack([first, second, third], axis=1)


class _Squares:
    """Squared residual lengths of many transforms as one matrix product.

    ``|R s + t - r|^2 = |s|^2 + |r|^2 + |t|^2 - 2 R:(r s') + 2 (R' t).s - 2 t.r`` is linear in what a pair brings.
    """

    def __init__(self, source: Array, reference: Array) -> None:
        products = (reference[:, :, None] * source[:, None, :]).reshape(-1, 9)
        own = np.einsum("nk,nk->n", source, source) + np.einsum("nk,nk->n", reference, reference)
        self.pairs = np.hstack([products, source, reference, own[:, None], np.ones((len(source), 1))]).T

    def of(self, rotations: Array, translations: Array) -> Array:
        """Squares (b, n) [mm^2] for rotations (b, 3, 3) and translations (b, 3)."""
        count = len(rotations)
        turned = np.einsum("bij,bi->bj", rotations, translations)
        constant = np.einsum("bi,bi->b", translations, translations)[:, None]
        transforms = np.hstack(
            [-2.0 * rotations.reshape(count, 9), 2.0 * turned, -2.0 * translations, np.ones((count, 1)), constant]
        )
        squares: Array = transforms @ self.pairs
        return np.maximum(squares, 0.0, out=squares)
