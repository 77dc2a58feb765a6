"""What every place of the programs comes with, so that effects can be computed there: joints, sides, rail, columns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from respot.calibration.covariates import Covariate
from respot.calibration.effects.moved import missing
from respot.calibration.effects.term import Term
from respot.calibration.observations import DOWN, Observations
from respot.calibration.spot_frames import spot_frames
from respot.correction.approach import Runs, runs_of
from respot.correction.columns import SpotColumns, names_at, spots_ahead
from respot.correction.goals import Goal, poses_of
from respot.correction.landing import Seats
from respot.correction.scope import Scope
from respot.geometry import IDENTITY, batch, orthogonal
from respot.kinematics.cell import Reason, RobotCell
from respot.kinematics.gravity import gravity_in_base
from respot.kinematics.motion_chain import Chain, chains_of, standing
from respot.kinematics.opw import OpwRobot
from respot.languages import Language
from respot.program.robot import Robot

#: No place at all.
_NOWHERE = Seats(Observations(np.empty((0, 3))))


@dataclass(frozen=True, eq=False)
class Seated:
    """Goals that can be computed, and why others cannot.

    Parameters
    ----------
    goals : sequence of n Goal
    seats : Seats
        Of the n goals.
    objections : mapping of int to (str, str)
        Code and message by `id` of each other goal.
    """

    goals: Sequence[Goal]
    seats: Seats
    objections: Mapping[int, tuple[str, str]]


@dataclass(frozen=True, eq=False)
class Seating:
    """Puts goals on their seats.

    Parameters
    ----------
    robot : Robot
    language : Language
    cell : RobotCell or Reason
        With the arm that effects were fitted with, or why there is none.
    scope : Scope
    spots : mapping of int to str
        ID of the spot by `id` of the target.
    columns : SpotColumns
        What tables say of spots.
    with_arm, with_rail : bool
        The joints matter; where the robot's foot stands matters.
    """

    robot: Robot
    language: Language
    cell: RobotCell | Reason
    scope: Scope
    spots: Mapping[int, str]
    columns: SpotColumns
    with_arm: bool
    with_rail: bool = False
    _runs: Runs = field(init=False)
    _ahead: Mapping[int, str] = field(init=False)

    def __post_init__(self) -> None:
        runs = Runs({}, {}, {}, {})
        if self.with_arm and isinstance(self.cell, RobotCell) and isinstance(self.cell.model, OpwRobot):
            runs = runs_of(self.cell, self.cell.model, self.robot, self.language, self.scope.routines)
        object.__setattr__(self, "_runs", runs)
        object.__setattr__(self, "_ahead", spots_ahead(self.scope.routines, self.spots))

    def seat(self, goals: Sequence[Goal], terms: Sequence[Term]) -> Seated:
        """Seat goals for some terms; a goal that one of them cannot be computed at is left out, with the reason."""
        objections: dict[int, tuple[str, str]] = {}
        told: list[Goal] = []
        for goal in goals:
            reason = _not_told(goal)
            if reason is None:
                told.append(goal)
            else:
                objections[id(goal)] = (reason.code, reason.message)
        reasons, chain = self._chains(told)
        objections |= {
            id(goal): (reason.code, reason.message)
            for goal, reason in zip(told, reasons, strict=True)
            if reason is not None
        }
        kept = [goal for goal, reason in zip(told, reasons, strict=True) if reason is None]
        if not kept:
            return Seated([], _NOWHERE, objections)
        seats = self._seats(kept, chain)
        good = np.ones(len(kept), dtype=np.bool_)
        for term in terms:
            unknown = _unknown(seats.observations, term, self.columns, kept)
            for row in np.flatnonzero(unknown & good):
                objections[id(kept[row])] = ("EFFECT_NOT_KNOWN", _why(term))
            good &= ~unknown
        rows = np.flatnonzero(good)
        if not len(rows):
            return Seated([], _NOWHERE, objections)
        return Seated([kept[row] for row in rows], seats.rows(rows), objections)

    def _chains(self, goals: Sequence[Goal]) -> tuple[list[Reason | None], Chain | None]:
        """Why the joints of n goals are not known, where they matter; and the chain of those that are seated.

        There is no chain where joints do not matter and one of the goals has none.
        """
        none: list[Reason | None] = [None] * len(goals)
        if isinstance(self.cell, Reason) or not goals:
            return none, None
        reasons, chains = chains_of(
            self.cell, [goal.move for goal in goals], [goal.target for goal in goals], [poses_of(goals)]
        )
        chain = chains[0] if chains else None
        if not self.with_arm:
            complete = all(reason is None for reason in reasons)
            return (reasons if self.with_rail else none), chain if complete or self.with_rail else None
        rows = [row for row, reason in enumerate(reasons) if reason is None]
        for row in rows:
            reasons[row] = self._not_seated(goals[row])
        seated = [at for at, row in enumerate(rows) if reasons[row] is None]
        return reasons, chain.rows(seated) if chain is not None and seated else None

    def _not_seated(self, goal: Goal) -> Reason | None:
        """Why the joints of a goal are not known, or not to be trusted."""
        status = goal.target.number("S") if self.language.name == "krl" else None
        if status is not None and int(status) & 16:
            message = "its status says that the controller compensates the arm itself (bit 4)"
            return Reason("ABSOLUTE_ACCURACY", message)
        if id(goal.move) not in self._runs.joints:
            why = self._runs.unknown.get(id(goal.move), "no status and turn, or confdata, that fits its pose")
            return Reason("EFFECT_NOT_KNOWN", f"effects of the arm need its joints, which are not known: {why}")
        return None

    def _seats(self, goals: Sequence[Goal], chained: Chain | None) -> Seats:
        worlds = orthogonal(batch([goal.base2spots for goal in goals]) * poses_of(goals))
        base, gravity, external = IDENTITY, DOWN.copy(), None
        if isinstance(self.cell, RobotCell) and chained is not None:
            placed = standing(self.cell, chained)
            first = placed.robroot if placed.robroot.single else placed.robroot[0]
            base = placed.robroot
            gravity = np.asarray(first.rotation.apply(np.atleast_2d(gravity_in_base(placed))[0]))
            external = chained.external
        arm = self.with_arm and isinstance(self.cell, RobotCell) and chained is not None
        joints = np.array([self._runs.joints[id(goal.move)] for goal in goals]) if arm else None
        seen = Observations(
            np.asarray(worlds.translation).reshape(-1, 3),
            worlds.rotation,
            joints,
            robot=self.cell.model if isinstance(self.cell, RobotCell) else None,
            base2source=base,
            gravity=gravity,
            external_axes=external,
            columns=self._columns_at(goals),
            frames=spot_frames(self.robot, [goal.move for goal in goals]),
        )
        seen = replace(seen, columns={**_frame_columns(seen), **seen.columns})
        return Seats(seen, chained.tool2flange if arm and chained is not None else None)

    def _columns_at(self, goals: Sequence[Goal]) -> dict[str, Covariate]:
        found = self.columns.of(self.columns.rows_of(names_at(goals, self._ahead)))
        if not self.with_arm:
            return found
        strict, likely = self._runs.sides, self._runs.likely
        nothing = np.full(6, np.nan)
        sides = np.array([(strict if goal.welds else likely).get(id(goal.move), nothing) for goal in goals]).reshape(
            len(goals), -1
        )
        for axis in range(sides.shape[1]):
            name = f"approach_a{axis + 1}"
            found[name] = Covariate(name, "approach", sides[:, axis], None)
        return found


def _not_told(goal: Goal) -> Reason | None:
    """Why no effect can be written into a goal, whatever it is."""
    if goal.move.external_tcp:
        return Reason("EXTERNAL_TCP", "the robot holds the part: effects are not written into its points")
    if goal.move.tool_offset is None:
        return Reason("RUN_TIME_POSE", "its shift along the tool is computed at run time")
    return None


def _frame_columns(seen: Observations) -> dict[str, Covariate]:
    """Program, base and tool of each place as groups."""
    frames = seen.frames
    named = {} if frames is None else frames.columns
    return {name: Covariate(name, "group", None, labels) for name, labels in named.items()}


def _unknown(seen: Observations, term: Term, columns: SpotColumns, goals: Sequence[Goal]) -> np.ndarray:
    """Which places (n,) lack what a term follows."""
    every = np.ones(len(seen), dtype=np.bool_)
    if term.effect == "backlash":
        sides = seen.columns.get(term.own)
        return every if sides is None or sides.values is None else np.isnan(sides.values)
    if term.effect == "rail":
        travel = seen.external_axes
        return every if travel is None else np.isnan(travel[:, term.where["external_axis"] - 1])
    if missing(seen, term):
        return every
    column = seen.columns.get(str(term.where.get("column", "")))
    if column is None:
        return ~every
    if column.values is not None and "level" not in term.where and "levels" not in term.form:
        own = columns.rows_of(goal.spot for goal in goals) >= 0  # nobody else's force is a spot's own
        return ~own | ~np.isfinite(column.values)
    return np.array([not label for label in column.labels or ()], dtype=np.bool_)


def _why(term: Term) -> str:
    if term.effect == "backlash":
        axis = term.where["axis"]
        return f"{term.label}: the program does not tell from which side axis {axis} comes to this spot"
    if term.effect == "rail":
        return f"{term.label}: its external axis, or where it carries the robot, is not known"
    column = term.where.get("column")
    if column is None:
        return f"{term.label}: what it follows is not known here"
    return f"{term.label}: column {column} is not known here; give it with --covariates TABLE"
