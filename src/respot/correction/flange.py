"""Where motions put the flange: what a correction decides, wherever its numbers are written."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.spatial.transform import RigidTransform

from respot.geometry import Array
from respot.program.moves import Move

_NOWHERE = np.full((4, 4), np.nan)


def flanges(
    moves: Sequence[Move],
    goals: Mapping[int, RigidTransform] | None = None,
    offsets: Mapping[int, Array] | None = None,
) -> Array:
    """Flange poses (n, 4, 4) of motions, ``flange2world`` [mm]; NaN where a frame or goal is not known.

    Parameters
    ----------
    moves : sequence of Move
        n motions.
    goals : mapping of int to RigidTransform, optional
        ``target2base`` in place of what some targets say, by `id` of the target.
    offsets : mapping of int to (3,) array, optional
        Offset along the base in place of what some motions say [mm], by `id` of the motion.
    """
    matrices: dict[int, tuple[RigidTransform, Array]] = {}  # a pose that is kept keeps its `id` to itself

    def matrix(pose: RigidTransform | None) -> Array:
        if pose is None:
            return _NOWHERE
        if id(pose) not in matrices:
            matrices[id(pose)] = pose, pose.as_matrix()
        return matrices[id(pose)][1]

    known = {} if goals is None else goals
    shape = (len(moves), 4, 4)
    part, goal, other = np.empty(shape), np.empty(shape), np.empty(shape)
    for row, move in enumerate(moves):
        holder = move.workpiece
        second = move.tool if holder is move.base else move.base
        target = None if move.target is None else known.get(id(move.target), move.target.pose)
        part[row] = matrix(None if holder is None else holder.pose)
        goal[row] = matrix(target) @ matrix(move.tool_offset)
        goal[row, :3, 3] += _offset(move, {} if offsets is None else offsets)
        other[row] = matrix(None if second is None else second.pose)
    held = np.array([move.external_tcp for move in moves], dtype=bool).reshape(-1, 1, 1)
    there = part @ goal
    return np.asarray(np.where(held, other @ _inverse(there), there @ _inverse(other)))


def _offset(move: Move, offsets: Mapping[int, Array]) -> Array:
    if move.offset is None:
        return np.zeros(3)
    if id(move) in offsets:
        return offsets[id(move)]
    if not move.offset.literal:
        return np.full(3, np.nan)
    return np.array([0.0 if number is None else float(number.value) for number in move.offset.numbers])


def _inverse(matrices: Array) -> Array:
    """Inverses of rigid motions (n, 4, 4)."""
    turned = np.swapaxes(matrices[:, :3, :3], 1, 2)
    found = np.zeros_like(matrices)
    found[:, :3, :3] = turned
    found[:, :3, 3] = -np.einsum("nij,nj->ni", turned, matrices[:, :3, 3])
    found[:, 3, 3] = 1.0
    return found


def apart(one: Array, other: Array) -> tuple[Array, Array]:
    """How far flange poses (n, 4, 4) are from each other: (n,) mm and (n,) degrees; NaN where one is not known."""
    shift = np.linalg.norm(one[:, :3, 3] - other[:, :3, 3], axis=1)
    # the chord between two rotations; for small angles it loses no digits, as the arc of the trace would
    chord = np.linalg.norm(one[:, :3, :3] - other[:, :3, :3], axis=(1, 2)) / np.sqrt(8.0)
    return shift, np.degrees(2.0 * np.arcsin(np.minimum(chord, 1.0)))
