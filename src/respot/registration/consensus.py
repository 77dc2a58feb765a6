"""A start for the robust fit that survives half of the pairs being wrong.

Least quantile of squares over three-point fits (P. J. Rousseeuw, JASA 79 (1984)), sharpened by concentration
steps (Rousseeuw and Van Driessen, Technometrics 41 (1999)).
"""

from __future__ import annotations

from itertools import combinations
from math import ceil, comb

import numpy as np
from numpy.typing import NDArray

from respot.registration.rigid import rotations_from_covariance
from respot.registration.row_order import own_order
from respot.registration.triples import transforms_of_triples

Array = NDArray[np.float64]

TRIALS = 1000  # half of the pairs wrong: the chance to miss three good ones 1000 times is below 1e-57
_KEPT, _STEPS, _SCORED_ROWS = 5, 3, 2000
_FIRST_LOOK = 250  # rows that choose which trials are sharpened: enough to tell a good triple from a wild one
_BLOCK = 250_000  # multiplications of one product: more, and linear algebra libraries spread it over threads, at a loss


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
    n = len(order)
    source, reference = source[order], reference[order]
    # about a typical spot, not the mean: one a kilometre off would cost the others their digits
    origins = np.partition(source, n // 2, axis=0)[n // 2], np.partition(reference, n // 2, axis=0)[n // 2]
    source, reference = source - origins[0], reference - origins[1]
    products = _Products(source, reference)
    quota = quota_of(n)
    if comb(n, 3) <= trials:
        triples = np.array(list(combinations(range(n), 3)))
    else:
        triples = np.argsort(rng.random((trials, n)), axis=1)[:, :3] if n <= 50 else _distinct(rng, n, trials)
    rotations, translations = transforms_of_triples(source[triples], reference[triples])
    first = products if n <= _FIRST_LOOK else products.some(rng.choice(n, _FIRST_LOOK, replace=False))
    enough = quota_of(min(n, _FIRST_LOOK)) - 1
    best = np.argsort(np.partition(first.squares(rotations, translations), enough, axis=1)[:, enough], kind="stable")
    squares = products.squares(rotations[best[:_KEPT]], translations[best[:_KEPT]])
    for _ in range(_STEPS):
        farthest = np.partition(squares, quota - 1, axis=1)[:, quota - 1 : quota]
        rotations, translations = products.fit(squares <= farthest)
        squares = products.squares(rotations, translations)
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


class _Products:
    """What pairs bring to squared residuals and to sums, so that many transforms are one matrix product.

    ``|R s + t - r|^2 = |s|^2 + |r|^2 + |t|^2 - 2 R:(r s') + 2 (R' t).s - 2 t.r`` is linear in what a pair brings.
    """

    def __init__(self, source: Array, reference: Array) -> None:
        n = len(source)
        self.pairs = np.empty((n, 17))
        np.multiply(reference[:, :, None], source[:, None, :], out=self.pairs[:, :9].reshape(n, 3, 3))
        self.pairs[:, 9:12], self.pairs[:, 12:15] = source, reference
        self.pairs[:, 15] = np.einsum("nk,nk->n", source, source) + np.einsum("nk,nk->n", reference, reference)
        self.pairs[:, 16] = 1.0

    def some(self, rows: NDArray[np.intp]) -> _Products:
        """Return the same of some pairs."""
        chosen = object.__new__(_Products)
        chosen.pairs = self.pairs[rows]
        return chosen

    def squares(self, rotations: Array, translations: Array) -> Array:
        """Squares (b, n) [mm^2] for rotations (b, 3, 3) and translations (b, 3)."""
        count, n = len(rotations), len(self.pairs)
        transforms = np.empty((count, 17))
        transforms[:, :9] = -2.0 * rotations.reshape(count, 9)
        transforms[:, 9:12] = 2.0 * np.einsum("bij,bi->bj", rotations, translations)
        transforms[:, 12:15] = -2.0 * translations
        transforms[:, 15] = 1.0
        transforms[:, 16] = np.einsum("bi,bi->b", translations, translations)
        squares = np.empty((count, n))
        step = max(1, _BLOCK // (17 * n))
        for begin in range(0, count, step):
            np.matmul(transforms[begin : begin + step], self.pairs.T, out=squares[begin : begin + step])
        return np.maximum(squares, 0.0, out=squares)

    def fit(self, members: NDArray[np.bool_]) -> tuple[Array, Array]:
        """Least-squares transforms (b, 3, 3) and (b, 3) over the ``members`` (b, n)."""
        sums = members.astype(np.float64) @ self.pairs
        sums /= sums[:, 16:]
        source, reference = sums[:, 9:12], sums[:, 12:15]
        across = np.swapaxes(sums[:, :9].reshape(-1, 3, 3), 1, 2) - source[:, :, None] * reference[:, None, :]
        rotations, _, _ = rotations_from_covariance(across)
        return rotations, reference - np.einsum("bij,bj->bi", rotations, source)
