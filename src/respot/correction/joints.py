"""Joints of every motion along the sequences in scope, before and after a correction."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from respot.correction.pose_table import PoseTable
from respot.geometry import IDENTITY, Array, replaced
from respot.kinematics.cell import Reason, RobotCell
from respot.kinematics.configuration import all_solutions, nearest_inside, nearest_solution, taught_joints
from respot.kinematics.motion_chain import Chain, chains_of, standing
from respot.kinematics.opw import OpwRobot
from respot.languages import Language
from respot.program.moves import Motion, Move
from respot.program.poses import goal_poses, target_poses
from respot.program.robot import Routine
from respot.program.targets import Target, TargetKind

#: Fields of a joint position.
JOINTS = {"krl": tuple(f"A{n}" for n in range(1, 7)), "rapid": tuple(f"rax_{n}" for n in range(1, 7))}
_UNKNOWN = np.full(6, np.nan)


#: Motions that are solved at once: the trials of full turns take 5 kB each.
_AT_ONCE = 4096


@dataclass(frozen=True, eq=False)
class Place:
    """A motion whose chain is known.

    Parameters
    ----------
    target : Target
        The target that carries it; of a motion relative to the last position the target before it.
    before, after : Array
        All joint solutions, shape (8, 6), NaN where there is none.
    flange : RigidTransform
        Where the flange comes after the correction, in the robot base.
    """

    target: Target
    before: Array
    after: Array
    flange: RigidTransform


@dataclass(frozen=True, eq=False)
class _Posed:
    """A motion with a known goal: its target, and the motion from whose goal a relative one starts (its row)."""

    move: Move
    target: Target
    start: int | None
    rank: int


@dataclass(frozen=True, eq=False)
class _Solved:
    """n motions whose chains are known.

    Parameters
    ----------
    before, after : (n, 8, 6) arrays
        All joint solutions, NaN where there is none.
    configured : (n,) array of bool
        They carry a configuration.
    settled : (3, n, 6) array
        Joints where the configuration decides: before, and after at the new place and at the old one.
    """

    before: Array
    after: Array
    configured: NDArray[np.bool_]
    settled: Array


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
    printed : PoseTable
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
        printed: PoseTable,
        offset: Callable[[Move], Array],
    ) -> None:
        self._cell, self._model, self._language = cell, model, language
        self._printed, self._offset = printed, offset
        #: Motions to a target without a place, and why.
        self.unknown: list[tuple[Move, Target, Reason]] = []
        self._posed: list[_Posed] = []
        for routine in routines:
            self._follow(routine)
        own, before, after = self._goals()
        self._rows: dict[int, int] = {}
        self._solve(own, before, after)

    def __contains__(self, move: Move) -> bool:
        return id(move) in self._rows

    def target(self, move: Move) -> Target | None:
        """Target that carries a motion; None where it has no place."""
        row = self._rows.get(id(move))
        return None if row is None else self._known[row].target

    def rows(self, moves: Sequence[Move]) -> NDArray[np.intp]:
        """Row (n,) of each motion, -1 where it has no place."""
        return np.array([self._rows.get(id(move), -1) for move in moves], dtype=np.intp)

    @property
    def reached(self) -> NDArray[np.bool_]:
        """Which rows have any joints after the correction."""
        if not self._rows:
            return np.empty(0, dtype=np.bool_)
        return np.asarray(np.asarray(np.isfinite(self._solved.after).all(axis=2)).any(axis=1))

    def place(self, row: int) -> Place:
        """Return the motion of a row."""
        return Place(self._known[row].target, self._solved.before[row], self._solved.after[row], self._flange[row])

    def joints(self, sequence: Sequence[Move], moved: Collection[int]) -> tuple[Array, Array]:
        """Joints (n, 6) before and after along a sequence; ``moved`` holds the `id` of each target that moves.

        Without a configuration of its own a motion ends nearest to where it starts; NaN where that is not known.
        """
        before, after = np.full((len(sequence), 6), np.nan), np.full((len(sequence), 6), np.nan)
        rows = self.rows(sequence)
        carrying = rows >= 0
        configured = np.zeros(len(sequence), dtype=np.bool_)
        if carrying.any():
            known, solved = rows[carrying], self._solved
            moves = np.array([id(self._known[row].target) in moved for row in known.tolist()])
            configured[carrying] = solved.configured[known]
            before[carrying] = solved.settled[0, known]
            after[carrying] = np.where(moves[:, None], solved.settled[1, known], solved.settled[2, known])
        for row in np.flatnonzero(~configured).tolist():
            move = sequence[row]
            if move.target is not None and move.target.kind is TargetKind.JOINTS:
                before[row] = after[row] = _joint_position(self._cell.language, move.target)
            elif carrying[row]:
                place, free = self.place(int(rows[row])), move.motion is Motion.JOINT
                last = (before[row - 1], after[row - 1]) if row else (_UNKNOWN, _UNKNOWN)
                before[row] = self._near(place.before, last[0], free)
                after[row] = self._near(place.after if id(place.target) in moved else place.before, last[1], free)
        return before, after

    def _near(self, branches: Array, near: Array, free: bool) -> Array:
        """Solution nearest to ``near``; a motion that is ``free`` to choose takes one inside the limits."""
        if not np.isfinite(near).all():
            return _UNKNOWN
        limits = self._model.limits_deg if free else None
        return np.asarray(nearest_inside(self._model, branches[None], near[None], limits)[0])

    # --- where motions go

    def _follow(self, routine: Routine) -> None:
        """Add the motions of a routine to poses that the program tells, in order."""
        last: int | None = None
        for step in routine.steps:
            found = self._goal(step, last) if isinstance(step, Move) else None
            last = None
            if found is not None:
                last = len(self._posed)
                self._posed.append(found)

    def _goal(self, move: Move, last: int | None) -> _Posed | None:
        if move.unknown or (move.offset is not None and not move.offset.literal):
            return None
        start = self._start(move, last)
        if start is None:
            return None
        if move.tool_offset is None:
            reason = Reason("NOT_CHECKED", "its shift along the tool is computed at run time")
            self.unknown.append((move, start.target, reason))
            return None
        return None if move.offset is not None and move.base2spots is None else start

    def _start(self, move: Move, last: int | None) -> _Posed | None:
        """A motion to its target; a relative one starts where the last motion went."""
        if move.target is not None:
            return _Posed(move, move.target, None, 0) if move.target.components else None
        if last is None or (move.offset is None and move.tool_offset is IDENTITY):
            return None
        before = self._posed[last]
        if (before.move.tool, before.move.base) != (move.tool, move.base):
            return None
        return _Posed(move, before.target, last, before.rank + 1)

    def _goals(self) -> tuple[Array, Array, Array]:
        """Matrices (n, 4, 4) of the targets themselves, and of the goals before and after the correction."""
        count = len(self._posed)
        own, before, after = (np.empty((count, 4, 4)) for _ in range(3))
        by_rank: dict[int, list[int]] = {}
        for row, posed in enumerate(self._posed):
            by_rank.setdefault(posed.rank, []).append(row)
        for rank in sorted(by_rank):  # a relative motion starts at a goal of the rank below
            rows = by_rank[rank]
            if rank == 0:
                targets = target_poses([self._posed[row].target for row in rows])
                own[rows] = targets.as_matrix()
                starts = targets, self._moved(rows, targets)
            else:
                above = [start for row in rows if (start := self._posed[row].start) is not None]
                own[rows] = own[above]
                starts = _rigid(before[above]), _rigid(after[above])
            moves = [self._posed[row].move for row in rows]
            before[rows] = goal_poses(moves, starts[0]).as_matrix()
            after[rows] = goal_poses(moves, starts[1], self._offset).as_matrix()
        return own, before, after

    def _moved(self, rows: Sequence[int], targets: RigidTransform) -> RigidTransform:
        """Targets where they will be."""
        keys = [id(self._posed[row].target) for row in rows]
        places = [at for at, key in enumerate(keys) if key in self._printed]
        return replaced(targets, places, self._printed.of([keys[at] for at in places])) if places else targets

    # --- joints

    def _solve(self, own: Array, before: Array, after: Array) -> None:
        """Solve all motions."""
        self._known: list[_Posed] = []
        found: list[_Solved] = []
        flange: list[RigidTransform] = []
        for start in range(0, len(self._posed), _AT_ONCE):
            some = slice(start, start + _AT_ONCE)
            posed = self._posed[some]
            poses = [_rigid(each[some]) for each in (own, before, after)]
            targets = [item.target for item in posed]
            reasons, chains = chains_of(self._cell, [item.move for item in posed], targets, poses)
            self.unknown += [
                (item.move, item.target, reason)
                for item, reason in zip(posed, reasons, strict=True)
                if reason is not None
            ]
            if chains:
                known = [item for item, reason in zip(posed, reasons, strict=True) if reason is None]
                self._known += known
                solved, there = self._solved_chains(known, *chains)
                found.append(solved)
                flange.append(there)
        self._rows = {id(item.move): row for row, item in enumerate(self._known)}
        if found:
            self._solved = _Solved(
                np.concatenate([part.before for part in found]),
                np.concatenate([part.after for part in found]),
                np.concatenate([part.configured for part in found]),
                np.concatenate([part.settled for part in found], axis=1),
            )
            self._flange = RigidTransform.concatenate(flange)

    def _solved_chains(
        self, posed: Sequence[_Posed], own: Chain, before: Chain, after: Chain
    ) -> tuple[_Solved, RigidTransform]:
        cell = standing(self._cell, own)
        old, new = (
            all_solutions(cell, self._model, chain.tool2world, chain.tool2flange, len(posed))
            for chain in (before, after)
        )
        flange = cell.flange2base(after.tool2world, after.tool2flange)
        numbers = [self._numbers(item.target) for item in posed]
        carried = np.array([row is not None for row in numbers])
        width = len(self._language.configuration_fields)
        configuration = np.array([row if row is not None else [0] * width for row in numbers])
        taught, _ = taught_joints(cell, own.tool2flange, own.tool2world, configuration)
        taught[~carried] = np.nan
        settled = np.full((3, len(posed), 6), np.nan)
        settled[0] = _nearest(self._model, old, taught)
        settled[1] = _nearest(self._model, new, settled[0])
        settled[2] = _nearest(self._model, old, settled[0])
        return _Solved(old, new, carried, settled), flange

    def _numbers(self, target: Target) -> list[int] | None:
        """Configuration of a target; None where it carries none."""
        numbers = [target.number(name) for name in self._language.configuration_fields]
        found = [int(number) for number in numbers if number is not None]
        return found if len(found) == len(numbers) else None


def _nearest(model: OpwRobot, branches: Array, near: Array) -> Array:
    """Of the solutions (n, 8, 6) those nearest to ``near`` (n, 6), same shape; NaN where that is not known."""
    known = np.isfinite(near).all(axis=1)
    found = np.full_like(near, np.nan)
    if known.any():
        found[known] = nearest_solution(model, branches[known], near[known])
    return found


def _rigid(matrices: Array) -> RigidTransform:
    return RigidTransform.from_matrix(matrices)


def _joint_position(language: str, target: Target) -> Array:
    numbers = [target.number(name) for name in JOINTS[language]]
    return np.array([np.nan if number is None else number for number in numbers])
