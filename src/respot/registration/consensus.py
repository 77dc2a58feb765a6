"""A start for the robust fit that survives half of the pairs being wrong.

Least quantile of squares over three-point fits (P. J. Rousseeuw, JASA 79 (1984)), sharpened by concentration
steps (Rousseeuw and Van Driessen, Technometrics 41 (1999)).
"""

from __future__ import annotations

from itertools import combinations
from math import ceil, comb

import numpy as np
from numpy.typing import NDArray

from respot.registration.rigid import rotations_from_covariance, transform_of
from respot.registration.row_order import own_order

Array = NDArray[np.float64]

TRIALS = 1000  # half of the pairs wrong: the chance to miss three good ones 1000 times is below 1e-57
_KEPT, _STEPS, _SCORED_ROWS = 5, 3, 2000
_FIRST_LOOK = 250  # rows that choose which trials are sharpened: enough to tell a good triple from a wild one
_BLOCK = 250_000  # multiplications of one product: more, and linear algebra libraries spread it over threads, at a loss
_FLAT = 1e-9  # of a triangle's area over its sides' squares: below, rounding decides how it is turned


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
    rotations, translations = _lay_triples(source, reference, triples)
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


def _lay_triples(source: Array, reference: Array, triples: NDArray[np.intp]) -> tuple[Array, Array]:
    """Least-squares transforms (b, 3, 3) and (b, 3) of triples of rows (b, 3), as `transform_of` has them.

    A triangle is laid in the plane of the other, its way round kept, and turned there by the best angle: what the
    singular values come to for three pairs, in closed form. Where a triangle is a line the singular values decide.
    """
    corners = np.stack([source[triples], reference[triples]])  # (2, b, 3, 3)
    means = corners.mean(axis=2)
    offsets = corners - means[:, :, None, :]
    one, two = corners[:, :, 1] - corners[:, :, 0], corners[:, :, 2] - corners[:, :, 0]
    normals = _cross(one, two)
    size = np.sqrt(np.einsum("sbk,sbk->sb", one, one))
    area = np.sqrt(np.einsum("sbk,sbk->sb", normals, normals))
    if (area <= _FLAT * (size**2 + np.einsum("sbk,sbk->sb", two, two))).any():
        return transform_of(corners[0], corners[1])
    normals /= area[:, :, None]
    along = one / size[:, :, None]
    across = _cross(normals, along)
    frames = np.stack([along, across, normals], axis=2)  # rows: the axes of either triangle
    plane = offsets @ np.swapaxes(frames[:, :, :2], 2, 3)  # (2, b, 3 corners, 2)
    products = np.einsum("bci,bcj->bij", plane[0], plane[1])
    angle = np.arctan2(products[:, 0, 1] - products[:, 1, 0], products[:, 0, 0] + products[:, 1, 1])
    cosine, sine = np.cos(angle)[:, None], np.sin(angle)[:, None]
    turned = frames[1].copy()
    turned[:, 0] = cosine * frames[1][:, 0] + sine * frames[1][:, 1]
    turned[:, 1] = cosine * frames[1][:, 1] - sine * frames[1][:, 0]
    rotations = np.swapaxes(turned, 1, 2) @ frames[0]
    return rotations, means[1] - np.einsum("bij,bj->bi", rotations, means[0])


def _cross(one: Array, two: Array) -> Array:
    """Cross products of vectors (..., 3); `numpy.cross` takes several times as long for few."""
    x, y, z = np.moveaxis(one, -1, 0)
    u, v, w = np.moveaxis(two, -1, 0)
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u], axis=-1)


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
