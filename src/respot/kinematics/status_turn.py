"""KUKA status and turn (facts: krl.md section 5).

Status bit 0: the wrist centre lies behind axis 1 ("overhead"). Bit 1: axis 3 is at or above the stretched angle. Bit
2: axis 5 is negative. Bit 3: unused. Bit 4: taught on an absolutely accurate robot; it is kept. Turn bit n: axis n +
1 is negative.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from respot.geometry import Array
from respot.kinematics.opw import OpwRobot
from respot.kinematics.posture import posture
from respot.kinematics.turns import TURNS

Integers = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

#: Names of the fields in a POS or E6POS, columns of the arrays here.
FIELDS = ("S", "T")
#: Bits that joints define; the others are kept.
_STATUS, _TURN = 0b111, 0b111111


def status_turn(
    model: OpwRobot, joints: Array, previous: npt.ArrayLike | None = None, tolerance: float = 1e-6
) -> Integers:
    """Status and turn of joints, shape (n, 2).

    Parameters
    ----------
    model : OpwRobot
        The robot.
    joints : Array
        Joints with their full turns, shape (n, 6), degrees.
    previous : array_like, optional
        Old status and turn, shape (n, 2): bits that joints do not define are kept, and within ``tolerance`` of its
        border (degrees; mm for bit 0) every bit keeps its old value.
    """
    old = np.zeros((len(joints), 2), dtype=np.int64) if previous is None else np.asarray(previous, dtype=np.int64)
    distances = _status_distances(model, joints)
    status = _bits(distances, old[:, 0], tolerance if previous is not None else -1.0)
    turn = _bits(joints, old[:, 1], tolerance if previous is not None else -1.0)
    return np.stack([old[:, 0] & ~_STATUS | status, old[:, 1] & ~_TURN | turn], axis=1)


def posture_matches(model: OpwRobot, joints: Array, old: Integers, tolerance: Array) -> Bools:
    """Whether solutions (n, b, 6) have the status of ``old`` (n, 2); shape (n, b)."""
    distances = _status_distances(model, joints)
    bits = old[:, None, :1] >> np.arange(3) & 1
    return np.asarray((((distances < 0.0) == (bits == 1)) | (np.abs(distances) <= tolerance)).all(axis=-1))


def turn_matches(joints: Array, old: Integers, tolerance: Array) -> Bools:
    """Whether angles (n, b, 6) plus each of `TURNS` have the turn bits of ``old`` (n, 2); shape (n, b, 6, turns)."""
    angles = joints[..., None] + TURNS
    bits = (old[:, 1:] >> np.arange(6) & 1)[:, None, :, None]
    return np.asarray(((angles < 0.0) == (bits == 1)) | (np.abs(angles) <= tolerance[..., None]))


def undefined(old: Integers) -> Bools:
    """Whether status or turn (n, 2) are no such numbers."""
    wrong = np.column_stack([old < 0, old[:, 0] > 0b11111, old[:, 1] > _TURN])
    return np.asarray(wrong.any(axis=1), dtype=bool)


def margins(model: OpwRobot, joints: Array) -> Array:
    """Distance of each bit from its border, shape (n, 9): front [mm], elbow, axis 5, axes 1 to 6 [deg]."""
    return np.asarray(np.abs(np.concatenate([posture(model, joints), joints], axis=-1)))


def text(configuration: npt.ArrayLike) -> str:
    """Status and turn as people say them."""
    status, turn = np.asarray(configuration).tolist()
    return f"S {status}, T {turn}"


def _status_distances(model: OpwRobot, joints: Array) -> Array:
    """Distances (..., 3) that are negative where the status bit is 1."""
    front, elbow, wrist = np.moveaxis(posture(model, joints), -1, 0)
    # bit 1 is 1 at the stretched angle itself, the others are 0 on their border
    return np.stack([front, np.where(elbow == 0.0, -np.finfo(float).tiny, -elbow), wrist], axis=-1)


def _bits(distances: Array, old: npt.NDArray[np.int64], tolerance: float) -> npt.NDArray[np.int64]:
    weights = 1 << np.arange(distances.shape[1])
    kept = (old[:, None] & weights) > 0
    bits = np.where(np.abs(distances) <= tolerance, kept, distances < 0.0)
    return np.asarray(bits @ weights, dtype=np.int64)
