"""Poses of many targets and motions at once: one by one each costs ten times the arithmetic."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.spatial.transform import RigidTransform

from respot.geometry import IDENTITY, Array, batch, pose, replaced, rotation_from_abc, rotation_from_quaternion
from respot.program.moves import BaseOffset, Move
from respot.program.targets import Target


def target_poses(targets: Sequence[Target]) -> RigidTransform:
    """``target2base`` of n > 0 targets of one language, as `Target.pose` says it of each; all must have one."""
    components = np.array([target.components for target in targets])
    turned = rotation_from_quaternion if components.shape[1] == 7 else rotation_from_abc
    return pose(components[:, :3], turned(components[:, 3:]))


def goal_poses(
    moves: Sequence[Move], targets: RigidTransform, offset: Callable[[Move], Array] | None = None
) -> RigidTransform:
    """``goal2base`` of n > 0 motions to targets at ``target2base``: with their shifts along tool and base.

    Parameters
    ----------
    moves : sequence of n Move
        The shift along the tool must be known, and that along the base literal.
    targets : RigidTransform
        A batch of n.
    offset : callable, optional
        Components (3,) of the offset of a motion in place of what the program says [mm].
    """
    goals = targets
    tipped = [row for row, move in enumerate(moves) if move.tool_offset is not IDENTITY]
    if tipped:
        shifts = [shift for row in tipped if (shift := moves[row].tool_offset) is not None]
        goals = replaced(goals, tipped, goals[tipped] * batch(shifts))
    shifted = [row for row, move in enumerate(moves) if move.offset is not None]
    if shifted:
        moved = [moves[row] for row in shifted]
        along = ways(moved) if offset is None else np.array([offset(move) for move in moved])
        goals = replaced(goals, shifted, RigidTransform.from_translation(along) * goals[shifted])
    return goals


def ways(moves: Sequence[Move]) -> Array:
    """Offsets (n, 3) along the base as the program has them, 0 where a motion has none [mm]."""
    return np.array([way_of(move.offset) for move in moves]).reshape(-1, 3)


def way_of(offset: BaseOffset | None) -> list[float]:
    """Components of an offset along the base as written; 0 where the literal leaves one out [mm]."""
    if offset is None:
        return [0.0, 0.0, 0.0]
    return [0.0 if number is None else float(number.value) for number in offset.numbers]


def spot_poses(moves: Sequence[Move]) -> RigidTransform:
    """Poses of n > 0 motions as spots are compared, as `Move.spot_pose` says it of each; all must have one."""
    goals = goal_poses(moves, target_poses([move.target for move in moves if move.target is not None]))
    return batch([base for move in moves if (base := move.base2spots) is not None]) * goals
