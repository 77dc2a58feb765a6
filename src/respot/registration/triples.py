"""Least-squares transforms of three pairs each, in closed form: many trials for the price of a few array operations."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from respot.registration.rigid import transform_of

Array = NDArray[np.float64]

_FLAT = 1e-9  # of a triangle's area over its sides' squares: below, rounding decides how it is turned


def transforms_of_triples(source: Array, reference: Array) -> tuple[Array, Array]:
    """Rotations (b, 3, 3) and translations (b, 3) [mm] of triples of pairs, as `transform_of` has them.

    A triangle is laid in the plane of the other, its way round kept, and turned there by the best angle: what the
    singular values come to for three pairs. Where a triangle is a line the singular values themselves decide.

    Parameters
    ----------
    source, reference : (b, 3, 3) arrays
        Three corners of each triangle [mm].
    """
    corners = np.stack([source, reference])  # (2, b, 3 corners, 3)
    means = corners.mean(axis=2)
    offsets = corners - means[:, :, None, :]
    one, two = corners[:, :, 1] - corners[:, :, 0], corners[:, :, 2] - corners[:, :, 0]
    normals = _cross(one, two)
    size = np.sqrt(np.einsum("sbk,sbk->sb", one, one))
    area = np.sqrt(np.einsum("sbk,sbk->sb", normals, normals))
    if (area <= _FLAT * (size**2 + np.einsum("sbk,sbk->sb", two, two))).any():
        return transform_of(source, reference)
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
