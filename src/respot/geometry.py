"""Poses as batches of scipy `RigidTransform`, and the two makers' ways to write an orientation.

Lengths are mm and angles degrees at every border. A transform is named by its direction: ``base2world * target`` is the
target in the world. KUKA writes A, B, C with R = Rz(A) Ry(B) Rx(C) (facts: krl.md section 5); ABB writes a unit
quaternion, scalar first (facts: rapid.md section 2.1).
"""

from __future__ import annotations

import warnings

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import RigidTransform, Rotation

Array = npt.NDArray[np.float64]

IDENTITY = RigidTransform.identity()


def rotation_from_abc(abc: npt.ArrayLike) -> Rotation:
    """Rotation of KUKA angles, shape (3,) or (n, 3), degrees."""
    return Rotation.from_euler("ZYX", np.asarray(abc, dtype=float), degrees=True)


def abc_from_rotation(rotation: Rotation) -> Array:
    """KUKA angles of a rotation, shape (3,) or (n, 3), degrees, A and C in [-180, 180], B in [-90, 90].

    At B = +-90 only A -+ C is defined; C is 0 then.
    """
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Gimbal lock detected", category=UserWarning)
        return np.asarray(rotation.as_euler("ZYX", degrees=True))


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
        Old quaternions of the same shape: q and -q are the same rotation, the sign that is nearer to the old one is
        taken. Without it q1 >= 0.
    """
    quaternion = np.asarray(rotation.as_quat(canonical=True, scalar_first=True))
    if near is None:
        return quaternion
    sign = np.where(np.sum(quaternion * np.asarray(near, dtype=float), axis=-1, keepdims=True) < 0.0, -1.0, 1.0)
    return np.asarray(quaternion * sign)


def pose(position: npt.ArrayLike, rotation: Rotation) -> RigidTransform:
    """Pose of a position (3,) or (n, 3) in mm and a rotation of the same count."""
    return RigidTransform.from_components(np.asarray(position, dtype=float), rotation)


def distance_mm(first: RigidTransform, second: RigidTransform) -> Array:
    """Distance of the origins of two poses (or batches), mm."""
    return np.asarray(np.linalg.norm(first.translation - second.translation, axis=-1))


def turn_deg(first: RigidTransform, second: RigidTransform) -> Array:
    """Angle of the rotation between two poses (or batches), degrees."""
    return np.asarray(np.degrees((first.rotation.inv() * second.rotation).magnitude()))
