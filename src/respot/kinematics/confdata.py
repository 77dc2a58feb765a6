"""ABB confdata ``[cf1,cf4,cf6,cfx]`` of six-axis serial robots (facts: rapid.md 2.2).

cf1, cf4, cf6: quadrant of axes 1, 4 and 6, floor(angle / 90): 0 is [0, 90), -1 is [-90, 0). cfx = 4 where the wrist
centre lies behind axis 1, plus 2 where it lies behind the lower arm, plus 1 where axis 5 is negative. Robots with a
parallel linkage do not use cfx: it is kept, and their forearm stays in front of the lower arm.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from respot.geometry import Array
from respot.kinematics.opw import OpwRobot
from respot.kinematics.posture import ELBOW, posture
from respot.kinematics.turns import TURNS

Integers = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

#: Names of the fields in a robtarget, columns of the arrays here.
FIELDS = ("cf1", "cf4", "cf6", "cfx")
#: Axes whose quadrants are counted, from 0.
COUNTED = (0, 3, 5)
_WEIGHTS = np.array([4, 2, 1])


def confdata(
    model: OpwRobot, joints: Array, previous: npt.ArrayLike | None = None, tolerance: float = 1e-6
) -> Integers:
    """Confdata of joints, shape (n, 4).

    Parameters
    ----------
    model : OpwRobot
        The robot.
    joints : Array
        Joints with their full turns, shape (n, 6), degrees.
    previous : array_like, optional
        Old confdata, shape (n, 4): within ``tolerance`` of a border (degrees; mm for the wrist centre and axis 1) the
        old value is kept if it is the one on the other side.
    """
    angles = joints[:, COUNTED]
    quadrants = np.floor(angles / 90.0)
    distances = posture(model, joints)
    behind = distances < 0.0
    if previous is None:
        return np.column_stack([quadrants, behind @ _WEIGHTS]).astype(np.int64)
    old = np.asarray(previous, dtype=np.int64)
    quadrants = np.where(_in_quadrant(angles, old[:, :3], tolerance), old[:, :3], quadrants)
    kept = (old[:, 3:] & _WEIGHTS) > 0
    cfx = np.where(np.abs(distances) <= tolerance, kept, behind) @ _WEIGHTS
    return np.column_stack([quadrants, old[:, 3] if model.coupled_23 else cfx]).astype(np.int64)


def posture_matches(model: OpwRobot, joints: Array, old: Integers, tolerance: Array) -> Bools:
    """Whether solutions (n, b, 6) have the cfx of ``old`` (n, 4); shape (n, b)."""
    distances = posture(model, joints)
    if model.coupled_23:
        # the linkage does not let the forearm pass the stretched arm
        return np.asarray(distances[..., ELBOW] >= -tolerance[..., 0])
    bits = (old[:, None, 3:] & _WEIGHTS) > 0
    return np.asarray((((distances < 0.0) == bits) | (np.abs(distances) <= tolerance)).all(axis=-1))


def turn_matches(joints: Array, old: Integers, tolerance: Array) -> Bools:
    """Whether angles (n, b, 6) plus each of `TURNS` lie in the quadrants of ``old`` (n, 4); shape (n, b, 6, turns)."""
    angles = joints[..., None] + TURNS
    matches = np.ones(angles.shape, dtype=bool)
    quadrants = old[:, None, :3, None]
    matches[..., COUNTED, :] = _in_quadrant(angles[..., COUNTED, :], quadrants, tolerance[..., None])
    return matches


def undefined(old: Integers) -> Bools:
    """Whether confdata (n, 4) are no such numbers."""
    wrong = np.column_stack([np.abs(old[:, :3]) > 11, old[:, 3] < 0, old[:, 3] > 7])
    return np.asarray(wrong.any(axis=1), dtype=bool)


def margins(model: OpwRobot, joints: Array) -> Array:
    """Distance of each number from its border, shape (n, 6): front [mm], elbow, axis 5, axes 1, 4, 6 [deg]."""
    angles = joints[:, COUNTED]
    return np.concatenate(
        [np.abs(posture(model, joints)), np.abs(angles - 90.0 * np.round(angles / 90.0))], axis=-1
    )  # fmt: skip


def text(configuration: npt.ArrayLike) -> str:
    """Confdata as it is written."""
    return "[" + ",".join(str(number) for number in np.asarray(configuration).tolist()) + "]"


def _in_quadrant(angles: Array, quadrants: Integers, tolerance: Array | float) -> Bools:
    return np.asarray((angles >= 90.0 * quadrants - tolerance) & (angles < 90.0 * (quadrants + 1) + tolerance))
