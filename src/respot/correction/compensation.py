"""Programs that make the real robot land where the old ones said, and the way back.

A calibration says where a told pose P comes to: ``registration * E(P)``, with E its effects. Compensated programs tell
P' with ``E(P') = G P`` in position and orientation: the registration R of a free frame is the tracker's own, and G is
the rigid motion of the base that it swallows (`respot.correction.gauge`), or one where bases are measured anew. Where
both frames claim to be the same, R is a deviation, and G its inverse: ``R E(P') = P``. The way back (``--inverse`` of a
measured calibration) applies the effects: ``P = G^-1 E(P')``, with the G that the told poses define in the same way.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from respot.calibration.calibration import Calibration
from respot.calibration.effects.catalogue import MECHANISMS
from respot.calibration.effects.moved import beyond
from respot.calibration.effects.term import Term
from respot.correction.changeable import Changeable
from respot.correction.columns import SpotColumns
from respot.correction.gauge import best_motion, same_motion, size_of
from respot.correction.goals import Goal, goals_of, poses_of, targets_of
from respot.correction.image import Direction
from respot.correction.landing import Errors, Seats, landed, solve
from respot.correction.points import moves_at_all, new_offset
from respot.correction.pose_table import PoseTable
from respot.correction.scope import Moving, Refusal, Scope
from respot.correction.seats import Seated, Seating
from respot.correction.tool_data import said_of_tool, tool_data
from respot.correction.written import Split
from respot.geometry import IDENTITY, Array, batch, distance_mm, orthogonal, replaced, turn_deg
from respot.issues import Issue
from respot.kinematics.cell import Reason, RobotCell
from respot.languages import Language
from respot.program.frames import Frame
from respot.program.moves import Move
from respot.program.poses import target_poses
from respot.program.robot import Robot

Bases = Literal["kept", "remeasured"]
Rows = NDArray[np.intp]

#: One literal is right for several motions to it where their poses agree to this.
_AGREE_MM, _AGREE_DEG = 1e-3, 1e-4
_GAUGE_STEPS = 30
_MOST_LISTED = 8


@dataclass(frozen=True, eq=False)
class Cell:
    """What the programs are of, and what is known of their spots.

    Parameters
    ----------
    robot : Robot
    language : Language
    kinematics : RobotCell or Reason
        With the arm that the effects were fitted with.
    spots : mapping of int to str
        ID of the spot by `id` of the target.
    columns : SpotColumns
        What tables say of spots.
    """

    robot: Robot
    language: Language
    kinematics: RobotCell | Reason
    spots: Mapping[int, str]
    columns: SpotColumns


@dataclass(frozen=True)
class Choice:
    """What a person decided.

    Parameters
    ----------
    inverse : bool
        The other way round.
    bases : str
        ``kept`` or ``remeasured``: whether a rigid motion of all points under a base is left out of them.
    max_residual : float
        No target departs from the rigid motion of its path by more [mm].
    in_tool : bool or None
        On the way back, whether the tool offset stands in the tool's data; None where nothing says.
    """

    inverse: bool
    bases: Bases
    max_residual: float
    in_tool: bool | None = None


class Compensation:
    """The image of targets under the effects of a calibration: solved for, or applied.

    Parameters
    ----------
    cell : Cell
    calibration : Calibration
    split : Split
        Its effects.
    choice : Choice
    """

    def __init__(self, cell: Cell, calibration: Calibration, split: Split, choice: Choice) -> None:
        self._cell, self._split, self._choice = cell, split, choice
        self._matched = frozenset(calibration.ids)
        # of a theory the rigid part is never the place of a tracker
        self._gauged = calibration.kind == "measured" and calibration.frame == "free"
        # theory: the rigid part is what the simulation lacks; the floor is found by solving
        self._solving = choice.inverse == (calibration.kind == "theory")
        self._kind = calibration.kind
        self._tools: Mapping[int, RigidTransform] = {}
        self._taught: dict[Hashable, RigidTransform] = {}
        self._fixed = IDENTITY if self._gauged else calibration.source2reference.inv()
        self._poses = PoseTable()
        self._places = _Places()
        self._offsets: dict[int, Array] = {}
        self._bases: list[dict[str, Any]] = []
        self.issues: list[Issue] = list(split.issues)

    @property
    def direction(self) -> Direction:
        """For the real cell where poses are solved for; back to what the simulation shows otherwise."""
        return "compensate" if self._solving else "align"

    def deviation(self, base2spots: RigidTransform) -> RigidTransform | None:
        """The rigid part; in a free frame what all points of a base need where their tool's data change.

        A base that was taught with a wrong tool holds the error that all its points have in common.
        """
        if self._gauged:
            return self._taught.get(self._places.of(base2spots))
        rigid = self._fixed if self._solving else self._fixed.inv()
        return rigid if moves_at_all(IDENTITY, rigid) else None

    def tool_change(self, tool: Frame) -> RigidTransform | None:
        """What the data of a tool get on the right: the fitted offset, or on the way back its inverse."""
        return self._tools.get(id(tool))

    def poses(self, moving: Sequence[Moving]) -> RigidTransform:
        """New ``target2base`` of n > 0 targets."""
        old = target_poses([item.target for item in moving])
        rows = [row for row, item in enumerate(moving) if id(item) in self._poses]
        return replaced(old, rows, self._poses.of([id(moving[row]) for row in rows])) if rows else old

    def offset(self, move: Move) -> Array:
        """New components (3,) of an offset along the base [mm]."""
        assert move.offset is not None and move.base2spots is not None  # noqa: S101 - asked before
        rigid = self._fixed if self._solving else self._fixed.inv()
        found = self._offsets.get(id(move))
        return new_offset(move.offset, move.base2spots, rigid) if found is None else found

    def record(self) -> dict[str, Any]:
        """What is written, what is not, and what of the bases was left to the registration."""
        return {
            "effects_written": list(self._split.written),
            "effects_not_written": list(self._split.left),
            "bases": self._choice.bases if self._gauged else None,
            "left_to_registration": self._bases,
        }

    def see(self, scope: Scope, changeable: Changeable | None = None) -> Sequence[Refusal]:
        """Solve for all targets at once."""
        goals, offsets = goals_of(scope, self._cell.spots)
        self._see_tools(goals, offsets, scope, changeable)
        with_rail = any(term.effect == "rail" for term in self._split.errors.terms)
        cell = self._cell
        seating = Seating(
            cell.robot,
            cell.language,
            cell.kinematics,
            scope,
            cell.spots,
            cell.columns,
            self._split.of_the_arm,
            with_rail,
        )
        errors = self._errors
        closed, others = self._states(errors, goals, offsets)
        first = seating.seat(closed, errors.terms)
        motions = self._motions(errors, first)
        seated = [(errors, first), *((some, seating.seat(of, some.terms)) for some, of in others)]
        keys: list[int] = []
        images: list[RigidTransform] = []
        objections: dict[int, tuple[str, str]] = {}
        for some, places in seated:
            objections |= places.objections
            self._apply(some, places, motions, keys, images, objections)
            self.issues += _beyond(some, places)
        found = PoseTable(keys, RigidTransform.concatenate(images)) if keys else PoseTable()
        refusals = self._take(goals, offsets, found, objections)
        self._taught = self._motions_of_bases(first) if self._gauged and self._tools else {}
        return [*refusals, *self._departures(goals, found)]

    # --- the tool

    @property
    def _errors(self) -> Errors:
        """What is solved for, or applied: on the way back tool data that were corrected have no error."""
        errors = self._split.errors
        return replace(errors, tool_offset=None) if self._tools and self._choice.inverse else errors

    def _see_tools(
        self, goals: Sequence[Goal], offsets: Sequence[Goal], scope: Scope, changeable: Changeable | None
    ) -> None:
        """Decide where the fitted offset goes, and say so."""
        offset, choice = self._split.errors.tool_offset, self._choice
        if offset is None:
            return
        fitted = {self._places.of_tool(goal) for goal in goals if goal.spot in self._matched}
        using = [goal for goal in (*goals, *offsets) if self._places.of_tool(goal) in fitted]
        tools = [*{id(tool): tool for goal in using if (tool := goal.move.tool) is not None}.values()]
        data = tool_data(offset, tools, scope, changeable, inverse=choice.inverse, in_tool=choice.in_tool)
        self._tools = data.changes
        self.issues += [*data.issues, said_of_tool(offset, tools, data, self.direction, self._kind)]

    def _states(
        self, errors: Errors, goals: Sequence[Goal], offsets: Sequence[Goal]
    ) -> tuple[list[Goal], list[tuple[Errors, list[Goal]]]]:
        """Goals with the fitted tool closed; and all others, with the errors that are left there."""
        tools = {self._places.of_tool(goal) for goal in goals if goal.spot in self._matched}
        fitted = [goal for goal in (*goals, *offsets) if self._places.of_tool(goal) in tools]
        closed = [goal for goal in fitted if goal.welds]
        opened = [goal for goal in fitted if not goal.welds]
        foreign = [goal for goal in (*goals, *offsets) if self._places.of_tool(goal) not in tools]
        if foreign and (errors.tool_offset is not None or any(_of_tool(term) for term in errors.terms)):
            names = list(dict.fromkeys(str(goal.move.tool) for goal in foreign))
            message = f"errors of the tool are those of the fitted spots' own: targets of {', '.join(names)} go without"
            self.issues.append(Issue("NOT_CHECKED", message))
        return closed, [(errors.of_an_open_gun(), opened), (errors.of_another_tool(), foreign)]

    # --- the gauge

    def _motions(self, errors: Errors, closed: Seated) -> dict[Hashable, RigidTransform]:
        """G of each base; of a base without matched spots the first one's."""
        if not self._gauged or self._choice.bases == "remeasured":
            return {}
        motions: dict[Hashable, RigidTransform] = {}
        for key, rows in self._bodies(closed).items():
            seats = closed.seats.rows(rows)
            motion = self._gauge(errors, seats)
            motions[key] = motion
            shift, turn = size_of(motion, seats.observations.positions)
            base = str(closed.goals[rows[0]].move.base)
            self._bases.append({"base": base, "spots": len(rows), "shift_mm": shift, "turn_deg": turn})
            message = (
                f"of {base} a rigid motion of {shift:.3f} mm and {turn:.4f} degrees of all {len(rows)} spots is not "
                "written: a tracker that stands anywhere cannot tell it from its own place. Where the base is measured "
                "anew by the tracker, --bases remeasured writes it"
            )
            self.issues.append(Issue("RIGID_PART_KEPT", message))
        return motions

    def _bodies(self, closed: Seated) -> dict[Hashable, Rows]:
        """Rows of the fitted spots of each base, each target once."""
        found: dict[Hashable, list[int]] = {}
        seen: set[int] = set()
        for row, goal in enumerate(closed.goals):
            if goal.spot in self._matched and goal.target is goal.move.target and id(goal.target) not in seen:
                seen.add(id(goal.target))
                found.setdefault(self._places.of(goal.base2spots), []).append(row)
        return {key: np.array(rows, dtype=np.intp) for key, rows in found.items()}

    def _motions_of_bases(self, closed: Seated) -> dict[Hashable, RigidTransform]:
        """Best motion of the fitted spots of each base from what they say to what they would say of the new tool."""
        found: dict[Hashable, RigidTransform] = {}
        for key, rows in self._bodies(closed).items():
            old, new = [], []
            for goal in (closed.goals[row] for row in rows):
                pose = self._poses.get(id(goal.moving))
                if pose is not None and goal.target.pose is not None:
                    old.append((goal.base2spots * goal.target.pose).translation)
                    new.append((goal.base2spots * pose * self._tool_of(goal)).translation)
            found[key] = best_motion(np.array(old).reshape(-1, 3), np.array(new).reshape(-1, 3))
        return found

    def _tool_of(self, goal: Goal) -> RigidTransform:
        return self._tools.get(id(goal.move.tool), IDENTITY)

    def _gauge(self, errors: Errors, seats: Seats) -> RigidTransform:
        """G of a body of spots: the best motion from told poses, of the tool that they end with, to where they land."""
        told = seats.observations.positions
        if not self._solving:
            now, _ = seats.at(seats.poses)
            if self._tools:
                told = np.asarray((seats.poses * next(iter(self._tools.values()))).translation)
            return best_motion(told, np.asarray(landed(errors, now).translation))
        motion, start = IDENTITY, None
        for _ in range(_GAUGE_STEPS):
            solution = solve(errors, seats, motion * seats.poses, start)
            start = solution.seats.poses
            rows = solution.found
            there = np.asarray(motion.apply(told))
            better = best_motion(solution.seats.observations.positions[rows], there[rows])
            still = same_motion(motion, better, told)
            motion = better
            if still:
                break
        return motion

    # --- images

    def _apply(
        self,
        errors: Errors,
        seated: Seated,
        motions: Mapping[Hashable, RigidTransform],
        keys: list[int],
        images: list[RigidTransform],
        objections: dict[int, tuple[str, str]],
    ) -> None:
        """Add images of goals in the source frame, with their `id`; goals that have none go to the objections."""
        if not seated.goals:
            return
        each = [motions.get(self._places.of(goal.base2spots), self._fixed) for goal in seated.goals]
        motion = orthogonal(batch(each))
        if self._solving:
            solution = solve(errors, seated.seats, motion * seated.seats.poses)
            solved, good, reached = solution.seats.poses, solution.found, solution.reached
            left = solution.left_mm
        else:
            now, reached = seated.seats.at(seated.seats.poses)
            tools = orthogonal(batch([self._tool_of(goal) for goal in seated.goals]))
            # what the tool's data will say is no matter of the pose: the flange stays where it is
            solved, good, left = motion.inv() * landed(errors, now) * tools.inv(), reached, np.zeros(len(now))
        if good.any():
            keys += [id(seated.goals[row]) for row in np.flatnonzero(good).tolist()]
            images.append(solved[good])
        for row in np.flatnonzero(~good).tolist():
            goal = seated.goals[row]
            if not reached[row]:
                objections[id(goal)] = ("OUT_OF_REACH", "out of reach: the robot cannot go where it would land right")
            else:
                message = f"no pose lands it where it should: {left[row]:.3g} mm are left. The effects are too large"
                objections[id(goal)] = ("EFFECTS_TOO_LARGE", message)

    def _take(
        self,
        goals: Sequence[Goal],
        offsets: Sequence[Goal],
        found: PoseTable,
        objections: Mapping[int, tuple[str, str]],
    ) -> list[Refusal]:
        """Keep new poses and offsets; refuse what has none, or several."""
        refusals: list[Refusal] = []
        by_target: dict[int, list[Goal]] = {}
        for goal in goals:
            by_target.setdefault(id(goal.moving), []).append(goal)
        rows = {id(goal): row for row, goal in enumerate(goal for goal in goals if id(goal) in found)}
        own = _targets([goal for goal in goals if id(goal) in rows], found)
        kept: dict[int, int] = {}
        for some in by_target.values():
            moving = some[0].moving
            assert moving is not None  # noqa: S101 - goals of targets have one
            objection = next((objections[id(goal)] for goal in some if id(goal) in objections), None)
            if objection is not None:
                refusals += moving.refusals(*objection)
                continue
            first, *others = [rows[id(goal)] for goal in some]
            kept[id(moving)] = first
            if not others:
                continue
            apart, turned = distance_mm(own[first], own[others]), turn_deg(own[first], own[others])
            if apart.max() <= _AGREE_MM and turned.max() <= _AGREE_DEG:
                continue
            del kept[id(moving)]
            message = (
                f"its motions need poses {apart.max():.3f} mm apart (tool, or side of play): one literal cannot be both"
            )
            refusals += moving.refusals("SHARED_TARGET", message)
        self._poses = PoseTable([*kept], own[[*kept.values()]]) if kept else PoseTable()
        by_literal = {id(goal.target): goal.moving for goal in goals if goal.moving is not None}
        for goal in offsets:
            anchor = by_literal.get(id(goal.target))
            if anchor is None or id(anchor) not in self._poses:
                continue
            if id(goal) in objections:
                code, message = objections[id(goal)]
                move = goal.move
                refusals.append(Refusal(move.program, goal.target.name, code, message, move.path, move.line))
                continue
            there = goal.base2spots.inv() * found[id(goal)]
            self._offsets[id(goal.move)] = goal.offset_to(there, self._poses[id(anchor)])
        return refusals

    def _departures(self, goals: Sequence[Goal], found: PoseTable) -> list[Refusal]:
        """Targets that leave the rigid motion of their program's path by more than a person allows."""
        solved = [goal for goal in goals if id(goal) in found]
        if not solved:
            return []
        programs: dict[str, list[int]] = {}
        for row, goal in enumerate(solved):
            programs.setdefault(goal.move.program, []).append(row)
        before = np.asarray((batch([goal.base2spots for goal in solved]) * poses_of(solved)).translation)
        after = np.asarray(found.of([id(goal) for goal in solved]).translation)
        refusals: list[Refusal] = []
        for rows in programs.values():
            some, old, new = [solved[row] for row in rows], before[rows], after[rows]
            apart = np.linalg.norm(new - np.asarray(best_motion(old, new).apply(old)), axis=1)
            for row in np.flatnonzero(apart > self._choice.max_residual).tolist():
                message = (
                    f"would leave the rigid motion of its path by {apart[row]:.1f} mm; --max-residual allows "
                    f"{self._choice.max_residual:g}"
                )
                moving = some[row].moving
                refusals += [] if moving is None else moving.refusals("RESIDUAL_TOO_LARGE", message)
        return refusals


class _Places:
    """What bases, and tools, have in common that lie in the same place."""

    def __init__(self) -> None:
        self._known: dict[int, tuple[RigidTransform, Hashable]] = {}  # a pose that is kept keeps its `id` to itself

    def of(self, pose: RigidTransform) -> Hashable:
        """Return what tells the place from others."""
        if id(pose) not in self._known:
            self._known[id(pose)] = pose, tuple((np.round(pose.as_matrix(), 6) + 0.0).ravel().tolist())
        return self._known[id(pose)][1]

    def of_tool(self, goal: Goal) -> Hashable:
        """Return what tells the tool of a goal from others."""
        tool = goal.move.tool
        return None if tool is None or tool.pose is None else self.of(tool.pose)


def _targets(goals: Sequence[Goal], found: PoseTable) -> RigidTransform:
    """``target2base`` of the targets from which n goals get to their images."""
    if not goals:
        return batch([IDENTITY])[:0]
    return targets_of(goals, batch([goal.base2spots for goal in goals]).inv() * found.of([id(goal) for goal in goals]))


def _of_tool(term: Term) -> bool:
    return MECHANISMS[term.effect].acts == "tool"


def _beyond(errors: Errors, seated: Seated) -> list[Issue]:
    """One issue for each effect that is used outside the range that it was fitted to."""
    issues = []
    for term in errors.terms if len(seated.seats) else ():
        rows = np.flatnonzero(beyond(seated.seats.observations, term)).tolist()
        if rows:
            names = list(dict.fromkeys(seated.goals[row].target.name for row in rows))
            more = f" and {len(names) - _MOST_LISTED} more" if len(names) > _MOST_LISTED else ""
            message = (
                f"{term.label} is written into {len(names)} targets outside the range of {term.own or 'angles'} that "
                f"it was fitted to, where it is a guess: {', '.join(names[:_MOST_LISTED])}{more}"
            )
            issues.append(Issue("EXTRAPOLATED", message))
    return issues
