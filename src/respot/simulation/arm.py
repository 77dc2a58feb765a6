"""The arm's own kinematics: a chain of six turns, forward with any error of its links, and the closed inverse.

The chain is the ortho-parallel arm with a spherical wrist, stretched upright where all its angles are zero:
lift c1, turn 1 about Z, out (a1, b), turn 2 about Y, up c2, turn 3 about Y, out a2 and up c3, turn 4 about Z, turn 5
about Y, turn 6 about Z, up c4 to the flange.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from respot.simulation.robots import LENGTHS, RobotSpec

Floats = NDArray[np.float64]
_TURN_AXES = (2, 1, 1, 2, 1, 2)


@dataclass(frozen=True)
class Frames:
    """Where the parts of the arm stand.

    Parameters
    ----------
    origins : ndarray of shape (n, 6, 3)
        A point on each joint axis [mm].
    axes : ndarray of shape (n, 6, 3)
        Direction of each joint axis, in the maker's sense: turning by a positive joint angle is right-handed about it.
    turns : ndarray of shape (n, 6, 3, 3)
        Orientation of each link, the one after its joint.
    flange : ndarray of shape (n, 3, 3)
        Orientation of the flange.
    flange_at : ndarray of shape (n, 3)
        Centre of the flange [mm].
    """

    origins: Floats
    axes: Floats
    turns: Floats
    flange: Floats
    flange_at: Floats


def turn(axis: int, angles: Floats) -> Floats:
    """Rotation matrices (n, 3, 3) about a coordinate axis by `angles` [rad] of shape (n,)."""
    cos, sin = np.cos(angles), np.sin(angles)
    out = np.zeros((len(angles), 3, 3))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    out[:, axis, axis] = 1.0
    out[:, i, i] = out[:, j, j] = cos
    out[:, i, j], out[:, j, i] = -sin, sin
    return out


def small(turns: Floats) -> Floats:
    """Rotation matrices (n, 3, 3) of rotation vectors (n, 3) [rad]."""
    return np.asarray(Rotation.from_rotvec(turns).as_matrix())


def apply(matrices: Floats, vectors: Floats) -> Floats:
    """Row by row product of (n, 3, 3) with (n, 3) or (3,)."""
    return np.asarray((matrices @ np.broadcast_to(vectors, (len(matrices), 3))[:, :, None])[:, :, 0])


def forward(
    robot: RobotSpec,
    joints: Floats,
    lengths: Mapping[str, float] | None = None,
    twists: Floats | None = None,
    root_at: Floats | None = None,
    root_turn: Floats | None = None,
) -> Frames:
    """Frames of the arm.

    Parameters
    ----------
    robot : RobotSpec
        Nominal arm.
    joints : ndarray of shape (n, 6)
        Joints [deg], the maker's zero and sense.
    lengths : mapping, optional
        Errors of lengths [mm], added to the nominal ones.
    twists : ndarray of shape (6, 6), optional
        Error of each link in the frame behind its joint: three shifts [mm], three small turns [rad].
    root_at : ndarray of shape (n, 3), optional
        Where the robot's foot stands [mm].
    root_turn : ndarray of shape (n, 3), optional
        How its foot is turned: rotation vectors [rad].

    Returns
    -------
    Frames
        In the world frame.
    """
    n = len(joints)
    size = {name: robot.length(name) + (lengths or {}).get(name, 0.0) for name in LENGTHS}
    signs = np.asarray(robot.signs, float)
    angles = np.radians(joints * signs - np.asarray(robot.offsets))
    steps = (
        (0.0, 0.0, size["c1"]),
        (size["a1"], size["b"], 0.0),
        (0.0, 0.0, size["c2"]),
        (size["a2"], 0.0, size["c3"]),
        (0.0, 0.0, 0.0),
        (0.0, 0.0, 0.0),
    )
    at = np.zeros((n, 3)) if root_at is None else np.array(root_at, float)
    here = np.broadcast_to(np.eye(3), (n, 3, 3)) if root_turn is None else small(root_turn)
    origins, axes, turns = np.empty((n, 6, 3)), np.empty((n, 6, 3)), np.empty((n, 6, 3, 3))
    for joint, (step, axis) in enumerate(zip(steps, _TURN_AXES, strict=True)):
        at = at + here @ np.asarray(step)
        origins[:, joint] = at
        axes[:, joint] = here[:, :, axis] * signs[joint]
        here = here @ turn(axis, angles[:, joint])
        if twists is not None:
            at = at + here @ twists[joint, :3]
            here = here @ small(twists[joint, None, 3:])
        turns[:, joint] = here
    return Frames(origins, axes, turns, here, at + here[:, :, 2] * size["c4"])


def inverse(robot: RobotSpec, flange: Floats, at: Floats, flip: NDArray[np.bool_]) -> tuple[Floats, NDArray[np.bool_]]:
    """Joints that bring the flange to a pose: arm forward, elbow up.

    Parameters
    ----------
    robot : RobotSpec
        Nominal arm with b = 0.
    flange : ndarray of shape (n, 3, 3)
        Orientations in the frame of the robot's foot.
    at : ndarray of shape (n, 3)
        Centres of the flange [mm] in that frame.
    flip : ndarray of bool of shape (n,)
        Whether axis 5 of the arm bends to the negative side.

    Returns
    -------
    joints : ndarray of shape (n, 6)
        Degrees, the maker's zero and sense, axes 4 and 6 within +-180.
    reached : ndarray of bool of shape (n,)
        Whether the pose is within reach; the joints mean nothing where it is not.
    """
    a1, a2, _, c1, c2, c3, c4 = robot.lengths
    wrist = at - c4 * flange[:, :, 2]
    first = np.arctan2(wrist[:, 1], wrist[:, 0])
    out, up = np.hypot(wrist[:, 0], wrist[:, 1]) - a1, wrist[:, 2] - c1
    fore, lean = np.hypot(c3, a2), np.arctan2(a2, c3)
    cosine = (out**2 + up**2 - c2**2 - fore**2) / (2 * c2 * fore)
    reached = np.abs(cosine) < 0.999
    bend = np.arccos(np.clip(cosine, -1, 1))
    second = np.arctan2(out, up) - np.arctan2(fore * np.sin(bend), c2 + fore * np.cos(bend))
    third = bend - lean
    before = turn(2, first) @ turn(1, second + third)
    hand = np.swapaxes(before, 1, 2) @ flange
    fifth = np.arccos(np.clip(hand[:, 2, 2], -1, 1)) * np.where(flip, -1, 1)
    side = np.where(flip, -1.0, 1.0)
    fourth = np.arctan2(side * hand[:, 1, 2], side * hand[:, 0, 2])
    sixth = np.arctan2(side * hand[:, 2, 1], -side * hand[:, 2, 0])
    angles = np.degrees(np.column_stack([first, second, third, fourth, fifth, sixth]))
    joints = (angles + np.asarray(robot.offsets)) * np.asarray(robot.signs)
    joints[:, [3, 5]] = (joints[:, [3, 5]] + 180.0) % 360.0 - 180.0
    return joints, reached
