"""Checks along the programs before anything is written (DESIGN section 10).

Every moved target must be reachable and inside the software limits, and no axis may unwind: these refuse a program.
What a correction brings nearer to a singularity or a limit, or onto another branch, is said.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from respot.correction.joints import Place, Places
from respot.correction.pose_table import PoseTable
from respot.correction.scope import Refusal, Scope
from respot.correction.sequence import goes_somewhere, sequences
from respot.geometry import Array
from respot.issues import Issue
from respot.kinematics.cell import Reason, RobotCell
from respot.kinematics.opw import OpwRobot
from respot.kinematics.path import Finding, check_path, check_travel, made_worse
from respot.kinematics.turns import TURNS, chosen_turn, outside
from respot.languages import Language
from respot.program.moves import Move
from respot.program.robot import Robot
from respot.program.targets import Target, TargetKind

_WHAT = {
    "NEAR_SINGULARITY": "nearer to a singularity than before the correction",
    "BRANCH_CHANGE": "the branch of the arm changes, which it did not before the correction",
    "NEAR_LIMIT": "nearer to a software limit than before the correction",
}


@dataclass(frozen=True)
class Checked:
    """What the checks found: refusals of moved targets, and what a person should know."""

    refusals: Sequence[Refusal] = ()
    issues: Sequence[Issue] = ()


class Preflight:
    """The checks of one correction.

    Parameters
    ----------
    cell : RobotCell or Reason
        The robot, or why it has no model: then nothing is checked, and the report says so.
    robot : Robot
        Its programs.
    language : Language
        Its language.
    scope : Scope
        What moves.
    printed : PoseTable
        New poses in their base as they will be printed, by `id` of the target.
    offset : callable
        New components (3,) of the offset of a motion along its base [mm].
    """

    def __init__(
        self,
        cell: RobotCell | Reason,
        robot: Robot,
        language: Language,
        scope: Scope,
        printed: PoseTable,
        offset: Callable[[Move], Array],
    ) -> None:
        self._cell: RobotCell | None = None
        if isinstance(cell, RobotCell) and isinstance(cell.model, OpwRobot):
            self._cell, self._model = cell, cell.model
            self._sequences = [
                [move for move in sequence if goes_somewhere(move)] for sequence in sequences(robot, scope.routines)
            ]
            called = {id(move) for sequence in self._sequences for move in sequence}
            routines = [r for r in robot.routines if any(id(move) in called for move in r.moves)]
            self._places = Places(cell, cell.model, language, routines, printed, offset)
            # the last row is that of motions without a place
            self._reached = np.append(self._places.reached, False)

    def check(self, moved: Collection[int]) -> Checked:
        """Check with the targets ``moved``, by `id`, at their new place and all others at their old one."""
        if self._cell is None:
            return Checked()
        refusals: dict[tuple[str, str, str], Refusal] = {}
        worse: dict[tuple[str, int, str], tuple[Move, Finding]] = {}
        for sequence in self._sequences:
            before, after = self._places.joints(sequence, moved)
            for refusal in self._refusals(self._cell, sequence, before, after, moved):
                refusals.setdefault((refusal.program, refusal.target, refusal.code), refusal)
            found = made_worse(check_path(self._cell, before), check_path(self._cell, after))
            for finding in found:
                move = sequence[finding.row]
                worse.setdefault((finding.code, id(move), finding.subject), (move, finding))
        return Checked(list(refusals.values()), [*_grouped(list(worse.values())), *self._unknown(moved)])

    def _refusals(
        self, cell: RobotCell, sequence: Sequence[Move], before: Array, after: Array, moved: Collection[int]
    ) -> Iterator[Refusal]:
        rows = self._places.rows(sequence)
        doubtful = (rows >= 0) & ~(self._reached[rows] & self._allowed(cell, after))
        for at in np.flatnonzero(doubtful).tolist():
            place = self._places.place(int(rows[at]))
            if id(place.target) in moved:
                reason = self._objection(cell, place, before[at], after[at])
                if reason is not None:
                    yield _refusal(sequence[at], place.target, reason)
        for finding in check_travel(before, after):
            for move in sequence[finding.row - 1 : finding.row + 1]:
                target = self._places.target(move)
                if target is not None and id(target) in moved:
                    message = f"on the way to {sequence[finding.row].target or 'the next position'}: {finding.message}"
                    yield _refusal(move, target, Reason(finding.code, message))

    def _allowed(self, cell: RobotCell, joints: Array) -> NDArray[np.bool_]:
        """Which rows of joints (n, 6) are known and inside the limits."""
        if cell.limits is None:
            return np.ones(len(joints), dtype=np.bool_)
        return np.asarray(np.isfinite(joints).all(axis=1) & ~(outside(joints, cell.limits) > 0.0).any(axis=1))

    def _objection(self, cell: RobotCell, place: Place, before: Array, after: Array) -> Reason | None:
        """Say why the arm must not go to a moved target."""
        solutions = place.after[np.isfinite(place.after).all(axis=1)]
        if not len(solutions):
            if not np.isfinite(place.before).all(axis=1).any():
                message = "the taught pose itself is out of reach: tool, base or robot model differ"
                return Reason("CONFIG_INCONSISTENT", message)
            return Reason("OUT_OF_REACH", f"out of reach: {self._model.reach_text(place.flange)}")
        if cell.limits is None:
            return None
        if not np.isfinite(after).all():
            turned, _ = chosen_turn(
                solutions[..., None] + TURNS, np.ones((*solutions.shape, len(TURNS)), dtype=bool), cell.limits
            )
            after = turned[np.argmin(outside(turned, cell.limits).max(axis=1))]
        beyond = outside(after, cell.limits)
        if beyond.max() <= 0.0:
            return None
        axis = int(np.argmax(beyond))
        low, high = cell.limits[axis]
        old = f" (before: {before[axis]:.3f})" if np.isfinite(before[axis]) else ""
        text = f"axis {axis + 1} would stand at {after[axis]:.3f} deg, outside its limits {low:g} .. {high:g}{old}"
        return Reason("OUT_OF_LIMITS", text)

    def _unknown(self, moved: Collection[int]) -> list[Issue]:
        """One issue for all motions to moved targets that were not checked."""
        left = [(move, reason) for move, target, reason in self._places.unknown if id(target) in moved]
        if not left:
            return []
        move, reason = left[0]
        count = "the motion" if len(left) == 1 else f"{len(left)} motions, the first"
        message = f"reach, limits and joint travel of {count} to {move.target}: {reason}"
        return [Issue("NOT_CHECKED", message, move.path, move.line)]


def _refusal(move: Move, target: Target, reason: Reason) -> Refusal:
    return Refusal(move.program, target.name, reason.code, reason.message, move.path, move.line)


def _grouped(findings: Sequence[tuple[Move, Finding]]) -> list[Issue]:
    """One issue for each code and program, with the worst of its findings."""
    groups: dict[tuple[str, str], list[tuple[Move, Finding]]] = {}
    for move, finding in findings:
        if finding.code in _WHAT:
            groups.setdefault((finding.code, move.program), []).append((move, finding))
    issues = []
    for (code, program), group in groups.items():
        move, finding = min(group, key=lambda item: item[1].room)
        goal = move.target or f"{move.instruction}@{move.line}"
        joints = move.target is not None and move.target.kind is TargetKind.JOINTS
        count = "1 motion" if len(group) == 1 else f"{len(group)} motions, the worst"
        text = f"{program}: {_WHAT[code]}: {count} to {goal}{' (joints)' if joints else ''}: {finding.message}"
        issues.append(Issue(code, text, move.path, move.line))
    return issues
