"""Joints of every motion along the sequences in scope, before and after a correction."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import RigidTransform

from respot.geometry import IDENTITY, Array
from respot.kinematics.cell import Reason, RobotCell
from respot.kinematics.configuration import all_solutions, nearest_inside, taught_joints
from respot.kinematics.motion_chain import Chain, chain_of, stacked, standing
from respot.kinematics.opw import OpwRobot
from respot.languages import Language
from respot.program.moves import Motion, Move
from respot.program.robot import Routine
from respot.program.targets import Target, TargetKind

#: Fields of a joint position.
JOINTS = {"krl": tuple(f"A{n}" for n in range(1, 7)), "rapid": tuple(f"rax_{n}" for n in range(1, 7))}
_UNKNOWN = np.full(6, np.nan)


@dataclass(frozen=True, eq=False)
class Place:
    """A motion whose chain is known.

    Parameters
    ----------
    target : Target
        The target that carries it; of a motion relative to the last position the target before it.
    before, after : Array
        All joint solutions, shape (8, 6), NaN where there is none.
    taught : Array
        Joints that its own configuration defines, shape (6,), NaN where none does.
    configured : bool
        It carries a configuration.
    flange : RigidTransform
        Where the flange comes after the correction, in the robot base.
    """

    target: Target
    before: Array
    after: Array
    taught: Array
    configured: bool
    flange: RigidTransform


@dataclass(frozen=True, eq=False)
class _Posed:
    """A motion and its poses in the base: the target itself, and with offsets before and after the correction."""

    move: Move
    target: Target
    own: RigidTransform
    before: RigidTransform
    after: RigidTransform


class Places:
    """Places of all motions of some routines.

    Parameters
    ----------
    cell : RobotCell
        The robot.
    model : OpwRobot
        Its model.
    language : Language
        Its language.
    routines : sequence of Routine
        The routines.
    printed : mapping of int to RigidTransform
        New poses in their base by `id` of the target.
    offset : callable
        New components (3,) of the offset of a motion along its base [mm].
    """

    def __init__(
        self,
        cell: RobotCell,
        model: OpwRobot,
        language: Language,
        routines: Sequence[Routine],
        printed: Mapping[int, RigidTransform],
        offset: Callable[[Move], Array],
    ) -> None:
        self._cell, self._model, self._language = cell, model, language
        self._printed, self._offset = printed, offset
        self.by_move: dict[int, Place] = {}
        #: Motions to a target without a place, and why.
        self.unknown: list[tuple[Move, Target, Reason]] = []
        self._solve([item for routine in routines for item in self._posed(routine)])

    def joints(self, sequence: Sequence[Move], moved: Collection[int]) -> tuple[Array, Array]:
        """Joints (n, 6) before and after along a sequence; ``moved`` holds the `id` of each target that moves.

        Without a configuration of its own a motion ends nearest to where it starts; NaN where that is not known.
        """
        before, after = np.full((len(sequence), 6), np.nan), np.full((len(sequence), 6), np.nan)
        for row, move in enumerate(sequence):
            if move.target is not None and move.target.kind is TargetKind.JOINTS:
                before[row] = after[row] = _joint_position(self._cell.language, move.target)
                continue
            place = self.by_move.get(id(move))
            if place is None:
                continue
            moves = id(place.target) in moved
            last = (before[row - 1], after[row - 1]) if row else (_UNKNOWN, _UNKNOWN)
            free = move.motion is Motion.JOINT and not place.configured
            before[row] = self._near(place.before, place.taught if place.configured else last[0], free)
            start = before[row] if place.configured else last[1]
            after[row] = self._near(place.after if moves else place.before, start, free)
        return before, after

    def _near(self, branches: Array, near: Array, free: bool) -> Array:
        """Solution nearest to ``near``; a motion that is ``free`` to choose takes one inside the limits."""
        if not np.isfinite(near).all():
            return _UNKNOWN
        limits = self._model.limits_deg if free else None
        return np.asarray(nearest_inside(self._model, branches[None], near[None], limits)[0])

    def _posed(self, routine: Routine) -> Iterator[_Posed]:
        """Motions of a routine to poses that the program tells, in order."""
        last: _Posed | None = None
        for step in routine.steps:
            if isinstance(step, Move):
                last = self._pose(step, last)
                if last is not None:
                    yield last
            else:
                last = None

    def _pose(self, move: Move, last: _Posed | None) -> _Posed | None:
        if move.unknown or (move.offset is not None and not move.offset.literal):
            return None
        start = self._start(move, last)
        if start is None:
            return None
        target, own, before, after = start
        if move.tool_offset is None:
            self.unknown.append(
                (move, target, Reason("NOT_CHECKED", "its shift along the tool is computed at run time"))
            )
            return None
        if move.tool_offset is not IDENTITY:  # status and turn or confdata are those of the bare target
            before, after = before * move.tool_offset, after * move.tool_offset
        if move.offset is None:
            return _Posed(move, target, own, before, after)
        if move.base2spots is None:
            return None
        old = np.array([0.0 if number is None else float(number.value) for number in move.offset.numbers])
        return _Posed(move, target, own, _shifted(before, old), _shifted(after, self._offset(move)))

    def _start(
        self, move: Move, last: _Posed | None
    ) -> tuple[Target, RigidTransform, RigidTransform, RigidTransform] | None:
        """Target with its own pose, before and after; of a relative motion where the last motion went."""
        if move.target is not None:
            own = move.target.pose
            return None if own is None else (move.target, own, own, self._printed.get(id(move.target), own))
        if move.offset is None and move.tool_offset is IDENTITY:
            return None
        if last is None or (last.move.tool, last.move.base) != (move.tool, move.base):
            return None
        return last.target, last.own, last.before, last.after

    def _solve(self, posed: Sequence[_Posed]) -> None:
        """Solve all motions at once."""
        solvable: list[tuple[_Posed, Sequence[Chain]]] = []
        for item in posed:
            first = chain_of(self._cell, item.move, item.target, item.own)
            chains = [
                first if pose is item.own else chain_of(self._cell, item.move, item.target, pose)
                for pose in (item.own, item.before, item.after)
            ]
            known = [chain for chain in chains if isinstance(chain, Chain)]
            if len(known) == len(chains):
                solvable.append((item, known))
            else:
                self.unknown.append((item.move, item.target, next(c for c in chains if isinstance(c, Reason))))
        if not solvable:
            return
        own, before, after = (stacked([chains[n] for _, chains in solvable]) for n in range(3))
        cell = standing(self._cell, own)
        solved = [all_solutions(cell, self._model, c.tool2world, c.tool2flange, len(solvable)) for c in (before, after)]
        flange = cell.flange2base(after.tool2world, after.tool2flange)
        numbers = [self._numbers(item.target) for item, _ in solvable]
        width = len(self._language.configuration_fields)
        configuration = np.array([row if row is not None else [0] * width for row in numbers])
        taught, _ = taught_joints(cell, own.tool2flange, own.tool2world, configuration)
        for row, (item, _) in enumerate(solvable):
            carried = numbers[row] is not None
            own_joints = taught[row] if carried else _UNKNOWN
            self.by_move[id(item.move)] = Place(
                item.target, solved[0][row], solved[1][row], own_joints, carried, flange[row]
            )

    def _numbers(self, target: Target) -> list[int] | None:
        """Configuration of a target; None where it carries none."""
        numbers = [target.number(name) for name in self._language.configuration_fields]
        found = [int(number) for number in numbers if number is not None]
        return found if len(found) == len(numbers) else None


def _shifted(pose: RigidTransform, way: Array) -> RigidTransform:
    return RigidTransform.from_components(pose.translation + way, pose.rotation)


def _joint_position(language: str, target: Target) -> Array:
    numbers = [target.number(name) for name in JOINTS[language]]
    return np.array([np.nan if number is None else number for number in numbers])
