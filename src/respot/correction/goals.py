"""Where programs go: every target with each motion to it, as a pose in the coordinates in which spots are compared."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial.transform import RigidTransform

from respot.correction.scope import Moving, Scope
from respot.geometry import IDENTITY, Array, batch, replaced
from respot.program.moves import Move
from respot.program.poses import target_poses
from respot.program.targets import Number, Target


@dataclass(frozen=True, eq=False)
class Goal:
    """A target as one motion goes to it.

    Parameters
    ----------
    moving : Moving or None
        What of the scope it is; None where only the motion's offset is looked for.
    target : Target
        Its target: the motion's own, or the original of a touched-up one.
    move : Move
        The motion.
    base2spots : RigidTransform
        As `Move.base2spots` [mm].
    spot : str
        ID of the spot that it is, empty where it is none.
    """

    moving: Moving | None
    target: Target
    move: Move
    base2spots: RigidTransform
    spot: str

    @property
    def welds(self) -> bool:
        """Whether the gun closes there."""
        return bool(self.spot) or self.move.weld

    @property
    def shifted(self) -> bool:
        """Whether the motion adds a shift to its target."""
        return self.move.offset is not None or self.tool_shift is not None

    @property
    def tool_shift(self) -> RigidTransform | None:
        """Shift along the tool that the motion adds; None where there is none, or it is not known."""
        shift = self.move.tool_offset
        if shift is IDENTITY:
            return None
        return None if shift is None or not np.any(np.abs(shift.as_matrix() - np.eye(4)) > 0.0) else shift

    @property
    def way(self) -> Array:
        """Offset (3,) along the base that the motion adds [mm]."""
        offset = self.move.offset
        return np.zeros(3) if offset is None else literal(offset.numbers)

    @cached_property
    def pose(self) -> RigidTransform:
        """Where the motion goes, ``goal2base``."""
        assert self.target.pose is not None  # noqa: S101 - scope refuses it
        shift = self.tool_shift
        goal = self.target.pose if shift is None else self.target.pose * shift
        return goal if self.move.offset is None else RigidTransform.from_translation(self.way) * goal

    def offset_to(self, goal: RigidTransform, target: RigidTransform) -> Array:
        """Offset (3,) along the base that leads from ``target2base`` to ``goal2base`` [mm]; it cannot turn."""
        shift = self.tool_shift
        start = target if shift is None else target * shift
        return np.asarray(goal.translation - start.translation)


def poses_of(goals: Sequence[Goal]) -> RigidTransform:
    """Where n > 0 motions go, ``goal2base``, as `Goal.pose` says it of each."""
    poses = target_poses([goal.target for goal in goals])
    shifts = _tool_shifts(goals)
    if shifts:
        poses = replaced(poses, [*shifts], poses[[*shifts]] * batch([*shifts.values()]))
    along = _along(goals)
    if along:
        ways = np.array([goals[row].way for row in along])
        poses = replaced(poses, along, RigidTransform.from_translation(ways) * poses[along])
    return poses


def targets_of(goals: Sequence[Goal], poses: RigidTransform) -> RigidTransform:
    """``target2base`` of the targets from which the own shifts of n > 0 motions lead to ``goal2base``."""
    along = _along(goals)
    if along:
        ways = np.array([goals[row].way for row in along])
        poses = replaced(poses, along, RigidTransform.from_translation(-ways) * poses[along])
    shifts = _tool_shifts(goals)
    if shifts:
        poses = replaced(poses, [*shifts], poses[[*shifts]] * batch([*shifts.values()]).inv())
    return poses


def _along(goals: Sequence[Goal]) -> list[int]:
    """Rows of motions with an offset along the base."""
    return [row for row, goal in enumerate(goals) if goal.move.offset is not None]


def _tool_shifts(goals: Sequence[Goal]) -> dict[int, RigidTransform]:
    """Shifts along the tool, by row."""
    return {row: shift for row, goal in enumerate(goals) if (shift := goal.tool_shift) is not None}


def literal(numbers: Iterable[Number | None]) -> Array:
    """Components (3,) of an offset as written; 0 where the literal leaves one out [mm]."""
    return np.array([0.0 if number is None else float(number.value) for number in numbers])


def goals_of(scope: Scope, spots: Mapping[int, str]) -> tuple[list[Goal], list[Goal]]:
    """Goals that decide where targets go, and those of offsets that motions add to one.

    A target follows the motion that welds at it; one without follows those that go to itself, and last those that go to
    a place beside it.

    Parameters
    ----------
    scope : Scope
    spots : mapping of int to str
        ID of the spot by `id` of the target.

    Returns
    -------
    (list of Goal, list of Goal)
        Of a target with several motions of the first rank there are several.
    """
    found: list[Goal] = []
    for moving in scope.moving:
        found += _decisive(moving, spots)
    offsets = [
        Goal(None, move.target, move, move.base2spots, "")
        for move in scope.offsets
        if move.target is not None and move.target.pose is not None and move.base2spots is not None
    ]
    return found, offsets


def _decisive(moving: Moving, spots: Mapping[int, str]) -> Iterator[Goal]:
    # of a touched-up target the motions go to its twin
    names = [spots.get(id(moving.target)) or spots.get(id(move.target), "") for move in moving.moves]
    spot = next(filter(None, names), "")
    goals = [
        Goal(moving, moving.target, move, moving.base2spots, name if move.weld else "")
        for move, name in zip(moving.moves, names, strict=True)
    ]
    if spot and not any(goal.spot for goal in goals):  # nothing is known to weld at it
        goals = [Goal(moving, goal.target, goal.move, goal.base2spots, spot) for goal in goals]
    ranks = [_rank(goal) for goal in goals]
    yield from (goal for goal, rank in zip(goals, ranks, strict=True) if rank == min(ranks))


def _rank(goal: Goal) -> int:
    return (0 if goal.welds else 2) + (1 if goal.shifted else 0)
