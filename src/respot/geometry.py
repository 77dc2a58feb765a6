"""Poses as batches of scipy `RigidTransform`, and the two makers' ways to write an orientation.

Lengths are mm and angles degrees at every border. A transform is named by its direction: ``base2world * target`` is the
target in the world. KUKA writes A, B, C with R = Rz(A) Ry(B) Rx(C) (facts: krl.md section 5); ABB writes a unit
quaternion, scalar first (facts: rapid.md section 2.1).
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import RigidTransform, Rotation

from respot.tolerance import LOCK_TURN_DEG

Array = npt.NDArray[np.float64]

IDENTITY = RigidTransform.identity()

_HALF_TURN = 180.0
#: B up to here is far from the lock, and no other triple is nearer than one whose angles all differ by less than this.
_NO_LOCK, _NO_OTHER = 89.0, 60.0


def rotation_from_abc(abc: npt.ArrayLike) -> Rotation:
    """Rotation of KUKA angles, shape (3,) or (n, 3), degrees."""
    return Rotation.from_euler("ZYX", np.asarray(abc, dtype=float), degrees=True)


def abc_from_rotation(rotation: Rotation, near: npt.ArrayLike | None = None) -> Array:
    """KUKA angles of a rotation, shape (3,) or (n, 3), degrees.

    Parameters
    ----------
    rotation : Rotation
        One rotation or a batch.
    near : array_like, optional
        Old angles of the same shape. (A, B, C) and (A + 180, 180 - B, C + 180) are the same rotation, and at B = +-90
        only A -+ C counts: of all such triples the one nearest to the old one is taken. An angle stays in
        [-180, 180], unless the old one was outside: then it may be as well.

    Returns
    -------
    ndarray
        Without ``near`` A and C in [-180, 180], B in [-90, 90], and C is 0 at B = +-90.
    """
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Gimbal lock detected", category=UserWarning)
        abc = np.asarray(rotation.as_euler("ZYX", degrees=True))
    if near is None:
        return abc
    old = np.asarray(near, dtype=float)
    found = _turned_near(abc, old)
    unsure = (np.abs(abc[..., 1]) > _NO_LOCK) | (np.abs(found - old) > _NO_OTHER).any(axis=-1)
    if unsure.any():
        found = _nearest_abc(rotation, old) if rotation.single else _replaced_rows(found, rotation, old, unsure)
    return np.where((np.abs(found) > _HALF_TURN) & (np.abs(old) <= _HALF_TURN), _turned_near(found, 0.0), found)


def _replaced_rows(abc: Array, rotation: Rotation, near: Array, rows: npt.NDArray[np.bool_]) -> Array:
    abc[rows] = _nearest_abc(rotation[rows], near[rows])
    return abc


def _turned_near(angles: Array, near: Array | float) -> Array:
    """Angles, each as many whole turns on as bring it nearest to another."""
    return np.asarray(angles + 2.0 * _HALF_TURN * np.rint((near - angles) / (2.0 * _HALF_TURN)))


def _nearest_abc(rotation: Rotation, near: Array) -> Array:
    """Of all triples (..., 3) of a rotation the one nearest to ``near``."""
    matrix = rotation.as_matrix()
    first = np.degrees(np.arctan2(matrix[..., 1, 0], matrix[..., 0, 0]))
    candidates = np.stack([_abc_with(matrix, a, near) for a in (first, first + _HALF_TURN)])
    away = np.sum((candidates - near) ** 2, axis=-1, keepdims=True)
    found = np.where(away[0] <= away[1], candidates[0], candidates[1])
    # at the lock A may be any angle, and C follows: both share the way to the old ones
    followed = _abc_with(matrix, near[..., 0], near)
    half = 0.5 * np.sign(followed[..., 1]) * (near[..., 2] - followed[..., 2])
    shared = _abc_with(matrix, near[..., 0] + half, near)
    lost = np.degrees((rotation.inv() * rotation_from_abc(shared)).magnitude())
    return np.where((lost <= LOCK_TURN_DEG)[..., None], shared, found)


def _abc_with(matrix: Array, a: Array, near: Array) -> Array:
    """Angles (..., 3) of rotation matrices for a given A, each as many whole turns on as brings it nearest to ``near``.

    B and C make good what A leaves of the rotation: for an A of the rotation exactly, at the lock for any A.
    """
    sine, cosine = np.sin(np.radians(a)), np.cos(np.radians(a))
    column = [matrix[..., row, 0] for row in range(3)]
    b = np.arctan2(-column[2], cosine * column[0] + sine * column[1])
    c = np.arctan2(
        sine * matrix[..., 0, 2] - cosine * matrix[..., 1, 2], cosine * matrix[..., 1, 1] - sine * matrix[..., 0, 1]
    )
    return _turned_near(np.stack([a, np.degrees(b), np.degrees(c)], axis=-1), near)


def rotation_from_quaternion(quaternion: npt.ArrayLike) -> Rotation:
    """Rotation of ABB quaternions q1..q4, scalar first, shape (4,) or (n, 4); they are normalised."""
    return Rotation.from_quat(np.asarray(quaternion, dtype=float), scalar_first=True)


def quaternion_from_rotation(rotation: Rotation, near: npt.ArrayLike | None = None) -> Array:
    """ABB quaternion of a rotation, scalar first, shape (4,) or (n, 4).

    Parameters
    ----------
    rotation : Rotation
        One rotation or a batch.
    near : array_like, optional
        Old quaternions of the same shape, none all zero: q and -q are the same rotation, the sign that is nearer to
        the old one is taken. The length stays what it was too, so that turning back gives the old numbers. Without
        it q1 >= 0 and the length is 1.
    """
    quaternion = np.asarray(rotation.as_quat(canonical=True, scalar_first=True))
    if near is None:
        return quaternion
    old = np.asarray(near, dtype=float)
    sign = np.where(np.sum(quaternion * old, axis=-1, keepdims=True) < 0.0, -1.0, 1.0)
    return np.asarray(quaternion * sign * np.linalg.norm(old, axis=-1, keepdims=True))


def pose(position: npt.ArrayLike, rotation: Rotation) -> RigidTransform:
    """Pose of a position (3,) or (n, 3) in mm and a rotation of the same count."""
    return RigidTransform.from_components(np.asarray(position, dtype=float), rotation)


def batch(poses: Sequence[RigidTransform]) -> RigidTransform:
    """Return n > 0 poses as one batch, bit by bit as they are; many may be the same few objects, such as bases."""
    rows: dict[int, int] = {}
    index = [rows.setdefault(id(item), len(rows)) for item in poses]
    each = {id(item): item for item in poses}
    return RigidTransform.concatenate([each[key] for key in rows])[np.array(index)]


def orthogonal(poses: RigidTransform) -> RigidTransform:
    """Return poses whose rotations have lost what rounding left in products."""
    return RigidTransform.from_matrix(poses.as_matrix())


def replaced(poses: RigidTransform, rows: Sequence[int], others: RigidTransform) -> RigidTransform:
    """Return a batch with others in some of its rows."""
    index = np.arange(len(poses))
    index[rows] = len(poses) + np.arange(len(rows))
    return RigidTransform.concatenate([poses, others])[index]


def distance_mm(first: RigidTransform, second: RigidTransform) -> Array:
    """Distance of the origins of two poses (or batches), mm."""
    return np.asarray(np.linalg.norm(first.translation - second.translation, axis=-1))


def turn_deg(first: RigidTransform, second: RigidTransform) -> Array:
    """Angle of the rotation between two poses (or batches), degrees."""
    return np.asarray(np.degrees((first.rotation.inv() * second.rotation).magnitude()))
