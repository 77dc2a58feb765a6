"""The rigid motion in a field of shifts, base by base: what a free frame cannot tell from its own registration.

A tracker that stands anywhere does not see whether a body of spots lies a little elsewhere as a whole: the registration
swallows it, and of an effect so much as a rigid motion imitates. Points of one base are therefore written so that their
shifts, taken together, hold no rigid motion: they land where the old ones said up to one motion G of their base, with G
the best motion from the told poses P' to where they land. (In a base that is measured anew G is one.)
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from respot.geometry import IDENTITY, Array, distance_mm, turn_deg
from respot.registration.rigid import transform_of

#: A rotation is told by so many spots at least, and by those that do not lie on a line: thinner than this is one [mm].
_LEAST, _THIN_MM = 4, 10.0
_STILL_MM, _STILL_DEG = 1e-10, 1e-11


def best_motion(source: Array, there: Array) -> RigidTransform:
    """Best rigid motion of points (n, 3) to others, least squares [mm]; a shift alone where they tell no rotation."""
    if not len(source):
        return IDENTITY
    around = source - source.mean(axis=0)
    extent = np.linalg.svd(around, compute_uv=False) / np.sqrt(len(source))
    if len(source) < _LEAST or extent[1] < _THIN_MM:
        return RigidTransform.from_translation(there.mean(axis=0) - source.mean(axis=0))
    rotation, translation = transform_of(source, there)
    return RigidTransform.from_components(translation, Rotation.from_matrix(rotation))


def same_motion(one: RigidTransform, other: RigidTransform, points: Array) -> bool:
    """Whether two motions are the same to the last digit, at the middle of points (n, 3)."""
    middle = points.mean(axis=0)
    apart = float(np.linalg.norm(np.asarray(one.apply(middle)) - np.asarray(other.apply(middle))))
    return apart < _STILL_MM and float(turn_deg(one, other)) < _STILL_DEG


def size_of(motion: RigidTransform, points: Array) -> tuple[float, float]:
    """How far a motion takes the middle of points (n, 3) [mm], and by how much it turns [deg]."""
    middle = RigidTransform.from_translation(points.mean(axis=0)) if len(points) else IDENTITY
    return float(distance_mm(motion * middle, middle)), float(turn_deg(motion, IDENTITY))
