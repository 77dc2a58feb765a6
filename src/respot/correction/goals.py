"""Where programs go: every target with each motion to it, as a pose in the coordinates in which spots are compared."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial.transform import RigidTransform

from respot.correction.scope import Moving, Scope
from respot.geometry import Array
from respot.program.moves import Move
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
        return self.move.offset is not None or self._tool_shift is not None

    @property
    def _tool_shift(self) -> RigidTransform | None:
        shift = self.move.tool_offset
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
        shift = self._tool_shift
        goal = self.target.pose if shift is None else self.target.pose * shift
        return goal if self.move.offset is None else RigidTransform.from_translation(self.way) * goal

    def target_of(self, goal: RigidTransform) -> RigidTransform:
        """``target2base`` of the target from which the motion's own shifts lead to ``goal2base``."""
        shift = self._tool_shift
        own = goal if self.move.offset is None else RigidTransform.from_translation(-self.way) * goal
        return own if shift is None else own * shift.inv()

    def offset_to(self, goal: RigidTransform, target: RigidTransform) -> Array:
        """Offset (3,) along the base that leads from ``target2base`` to ``goal2base`` [mm]; it cannot turn."""
        shift = self._tool_shift
        start = target if shift is None else target * shift
        return np.asarray(goal.translation - start.translation)


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


def stacked(poses: Iterable[RigidTransform]) -> RigidTransform:
    """Return n > 0 poses as one batch."""
    return RigidTransform.from_matrix(np.stack([pose.as_matrix() for pose in poses]))
