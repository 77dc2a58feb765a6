"""Constant turns between two lists of orientations, for many readings at once; wrong spots do not move them.

``reference = left * source * right``: ``left`` turns between the coordinate systems (known where positions gave it),
``right`` between the tool frames. Quaternions are arrays (..., 4), scalar first. A batch has the axes reading, one of
two foldings (`respot.calibration.effects.readings`), row.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Rows = NDArray[np.intp]

SHARE = 0.8
"""The spread of a batch is the angle within which this share of the spots stays: a tenth of wrong spots plays no part,
and a fifth of the spots that alone tell two readings apart is not overlooked."""

_CANDIDATES = 40
_ANCHORS = 8
_JUDGES = 200
_WITNESSES = 60
_TURNS = 12
_FINEST = 1e-9  # radians


@dataclass(frozen=True, eq=False)
class Turns:
    """The best constant turn(s) of every reading.

    Attributes
    ----------
    left, right : (k, 4) arrays
        Quaternions.
    angles : (k, n) array
        What is left at each spot; NaN where its numbers are not known [deg].
    chosen : (k, n) int array
        Which of the two foldings fits.
    spread : (k,) array
        Angle within which `SHARE` of the known spots stays; infinite where fewer than half are known [deg].
    """

    left: Array
    right: Array
    angles: Array
    chosen: Rows
    spread: Array


def product(first: Array, second: Array) -> Array:
    """First rotation after the second."""
    a, u = first[..., :1], first[..., 1:]
    b, v = second[..., :1], second[..., 1:]
    real = a * b - np.sum(u * v, axis=-1, keepdims=True)
    return np.concatenate([real, a * v + b * u + np.cross(u, v)], axis=-1)


def inverse(quaternion: Array) -> Array:
    """Inverse rotation."""
    return np.asarray(quaternion * np.array([1.0, -1.0, -1.0, -1.0]), dtype=np.float64)


def _angle(first: Array, second: Array) -> Array:
    """Angle between rotations, exact for small ones [rad]."""
    apart = np.minimum(np.linalg.norm(first - second, axis=-1), np.linalg.norm(first + second, axis=-1))
    return np.asarray(4.0 * np.arcsin(np.clip(apart / 2.0, 0.0, 1.0)), dtype=np.float64)


def _even(n: int, most: int) -> Rows:
    return np.unique(np.linspace(0, n - 1, min(n, most)).round().astype(np.intp))


def spread_of(angles: Array) -> Array:
    """Angle within which `SHARE` of the known spots stays, of (k, n) angles; infinite where too few are known."""
    known = np.isfinite(angles)
    count = known.sum(axis=1)
    ordered = np.sort(np.where(known, angles, np.inf), axis=1)
    place = np.floor(SHARE * np.maximum(count - 1, 0)).astype(np.intp)
    taken = np.take_along_axis(ordered, place[:, None], axis=1)[:, 0]
    return np.where((count >= 4) & (2 * count >= angles.shape[1]), taken, np.inf)


def one_sided(source: Array, reference: Array, known: Mask, left: Array) -> Turns:
    """Find ``right`` where ``left`` is known.

    Parameters
    ----------
    source, reference : (k or 1, 2, n, 4) arrays
    known : (k, n) bool array
    left : (4,) array
    """
    between = product(inverse(product(left, source)), reference)
    right = _most_agreed(between, known)
    for _ in range(_TURNS):
        chosen, angle = _nearest(between, right)
        taken = np.take_along_axis(between, chosen[:, None, :, None], axis=1)[:, 0]
        right = _mean(taken, _weights(angle, known))
    chosen, angle = _nearest(between, right)
    angles = np.where(known, np.degrees(angle), np.nan)
    return Turns(np.broadcast_to(left, right.shape), right, angles, chosen, spread_of(angles))


def _most_agreed(between: Array, known: Mask) -> Array:
    """The turn of that spot from which the median of the others is least away, (k, 4)."""
    n = between.shape[2]
    rows, judges = _even(n, _CANDIDATES), _even(n, _JUDGES)
    candidates = between[:, :, rows].reshape(len(between), -1, 4)
    near = np.abs(np.einsum("kcq,kfnq->kcfn", candidates, between[:, :, judges])).max(axis=2)
    near = np.where(known[:, None, judges], near, np.nan)
    with np.errstate(invalid="ignore"):
        middle = _median(near)
    allowed = np.tile(known[:, rows], (1, 2))
    best = np.argmax(np.where(allowed, middle, -1.0), axis=1)
    return np.take_along_axis(candidates, best[:, None, None], axis=1)[:, 0]


def _median(values: Array) -> Array:
    """Median over the last axis of what is known; -1 where nothing is."""
    known = np.isfinite(values)
    count = known.sum(axis=-1, keepdims=True)
    ordered = np.sort(np.where(known, values, np.inf), axis=-1)
    middle = np.take_along_axis(ordered, np.maximum((count - 1) // 2, 0), axis=-1)[..., 0]
    return np.where(count[..., 0] > 0, middle, -1.0)


def _nearest(between: Array, right: Array) -> tuple[Rows, Array]:
    """Which folding is nearer to the constant turn, and how near [rad]."""
    angles = _angle(between, right[:, None, None, :])
    chosen = np.argmin(angles, axis=1)
    return chosen, np.take_along_axis(angles, chosen[:, None], axis=1)[:, 0]


def _weights(angle: Array, known: Mask) -> Array:
    """Geman and McClure's weights, at twice the median."""
    scale = 2.0 * np.maximum(_median(np.where(known, angle, np.nan)), _FINEST)[:, None]
    return np.asarray(np.where(known, 1.0 / np.square(1.0 + np.square(angle / scale)), 0.0), dtype=np.float64)


def _mean(quaternions: Array, weights: Array) -> Array:
    return np.asarray(
        np.linalg.eigh(np.einsum("kn,knp,knq->kpq", weights, quaternions, quaternions))[1][..., -1], dtype=np.float64
    )


def two_sided(source: Array, reference: Array, known: Mask) -> Turns:
    """Find ``left`` and ``right`` together.

    A start for each of several spots: seen from it, the turns of the others in both lists are conjugate by ``left``,
    so that their axial vectors are turned by it. From the best start, ``left`` and ``right`` are one rotation of
    quaternions in four dimensions, which has a closed form.

    Parameters
    ----------
    source, reference : (k or 1, 2, n, 4) arrays
    known : (k, n) bool array
    """
    k = len(known)
    source, reference = (np.broadcast_to(each, (k, *each.shape[1:])) for each in (source, reference))
    left = _best_start(source, reference, known)
    between = product(inverse(product(left[:, None, None, :], source)), reference)
    right = _most_agreed(between, known)
    whole = np.zeros((k, 4, 4))
    for axis in range(4):
        unit = np.eye(4)[axis]
        whole[:, :, axis] = product(product(left, unit), right)
    for _ in range(_TURNS):
        chosen, angle, first, second = _chosen(whole, source, reference)
        weights = _weights(angle, known)
        u, _, v = np.linalg.svd(np.einsum("kn,knp,knq->kpq", weights, second, first))
        u[:, :, 3] *= np.sign(np.linalg.det(u @ v))[:, None]
        whole = u @ v
    chosen, angle, _, _ = _chosen(whole, source, reference)
    both = whole[:, :, 0]
    axes = np.stack([product(whole[:, :, axis], inverse(both))[:, 1:] for axis in (1, 2, 3)], axis=-1)
    left = _quaternion_of(axes)
    angles = np.where(known, np.degrees(angle), np.nan)
    return Turns(left, product(inverse(left), both), angles, chosen, spread_of(angles))


def _chosen(whole: Array, source: Array, reference: Array) -> tuple[Rows, Array, Array, Array]:
    """The folding that fits, the angle that is left, and both quaternions with one sign."""
    turned = np.einsum("kpq,kfnq->kfnp", whole, source)
    angles = _angle(turned, reference)
    chosen = np.argmin(angles, axis=1)
    at = chosen[:, None, :, None]
    first, image, second = (np.take_along_axis(each, at, axis=1)[:, 0] for each in (source, turned, reference))
    sign = np.where(np.sum(image * second, axis=-1, keepdims=True) < 0.0, -1.0, 1.0)
    return chosen, np.take_along_axis(angles, chosen[:, None], axis=1)[:, 0], first, second * sign


def _best_start(source: Array, reference: Array, known: Mask) -> Array:
    """Left turns (k, 4) from the spot as seen from which the lists agree best."""
    n = source.shape[2]
    rows, judges = _even(n, _ANCHORS), _even(n, _WITNESSES)
    lefts: list[Array] = []
    costs: list[Array] = []
    folded = not (np.array_equal(source[:, 0], source[:, 1]) and np.array_equal(reference[:, 0], reference[:, 1]))
    for row in rows:
        for folding in (0, 1) if folded else (0,):
            one = product(source[:, :, judges], inverse(source[:, folding, row])[:, None, None, :])
            two = product(reference[:, :, judges], inverse(reference[:, folding, row])[:, None, None, :])
            fits = np.argmin(np.abs(np.abs(one[..., 0]) - np.abs(two[..., 0])), axis=1)[:, None, :, None]
            first, second = (np.take_along_axis(each, fits, axis=1)[:, 0] for each in (one, two))
            left = _conjugating(first, second, known[:, judges])
            turned = product(product(left[:, None, :], first), inverse(left)[:, None, :])
            angle = np.where(known[:, judges], _angle(turned, second), np.nan)
            cost = _median(angle)
            lefts.append(left)
            costs.append(np.where(known[:, row] & (cost >= 0.0), cost, np.inf))
    best = np.argmin(np.array(costs), axis=0)
    return np.asarray(np.array(lefts)[best, np.arange(len(best))], dtype=np.float64)


def _conjugating(first: Array, second: Array, known: Mask) -> Array:
    """Rotation (k, 4) with ``second = left first left^-1`` for rows (k, n, 4), by the axial vectors of the turns."""
    one, two = 2.0 * first[..., :1] * first[..., 1:], 2.0 * second[..., :1] * second[..., 1:]
    weights = np.where(known, 1.0, 0.0)
    turn = np.broadcast_to(np.eye(3), (len(first), 3, 3))
    for _ in range(6):
        u, _, v = np.linalg.svd(np.einsum("kn,kni,knj->kij", weights, two, one))
        u[:, :, 2] *= np.sign(np.linalg.det(u @ v))[:, None]
        turn = u @ v
        apart = np.linalg.norm(two - np.einsum("kij,knj->kni", turn, one), axis=-1)
        weights = np.where(known, 1.0 / np.maximum(apart, 1e-6), 0.0)
    return _quaternion_of(turn)


def _quaternion_of(matrices: Array) -> Array:
    """Quaternions of rotation matrices (k, 3, 3), near enough to rotations."""
    m = matrices
    squares = np.empty((len(m), 4, 4))
    vector = np.stack([m[:, 2, 1] - m[:, 1, 2], m[:, 0, 2] - m[:, 2, 0], m[:, 1, 0] - m[:, 0, 1]], axis=1)
    trace = np.trace(m, axis1=1, axis2=2)
    squares[:, 0, 0] = 1.0 + trace
    squares[:, 0, 1:] = squares[:, 1:, 0] = vector
    squares[:, 1:, 1:] = m + np.swapaxes(m, 1, 2) + (1.0 - trace)[:, None, None] * np.eye(3)
    return np.asarray(np.linalg.eigh(squares)[1][..., -1], dtype=np.float64)
