"""Welds exactly onto their theoretical positions, and the path between them blended (`convert --snap`).

A rigid motion G leaves a residual r at each weld. Its target is shifted by it, ``T' = B^-1 Trans(r) G B T``; all other
points of the path by what `respot.correction.blend` makes of the welds before and behind them. Orientations stay those
of the rigid image. A path is what a routine runs through, from one point that stays to the next; points of a routine
without welds take part in the paths of those that call it. A point that several ways lead to, such as the one where a
program begins and ends, gets the mean of what each way asks; right before or behind a weld it moves as the weld.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from respot.calibration.source_fit import SourceFit
from respot.correction.blend import BESIDE, PLATEAU_MM, BlendedPath
from respot.correction.changeable import Changeable
from respot.correction.goals import Goal, goals_of
from respot.correction.image import Direction, RigidImage
from respot.correction.scope import Moving, Refusal, Scope
from respot.correction.sequence import sequences
from respot.geometry import IDENTITY, Array, batch
from respot.issues import BadInputError, Issue
from respot.program.frames import Frame
from respot.program.moves import Move
from respot.program.robot import Robot
from respot.source import Span

Rows = NDArray[np.intp]

_AGREE_MM = 1e-3
_MOST_LISTED = 12
#: What a fit says of names that are not settled.
_UNSETTLED = ("PROBABLY_RENAMED", "DOUBTFUL_PAIR", "NAMES_DISAGREE", "OUTLIER")


@dataclass(eq=False)
class SnappedImage:
    """A rigid image with each weld put where it should be.

    Parameters
    ----------
    rigid : RigidImage
    robot : Robot
    spots : mapping of int to str
        ID of the spot by `id` of the target.
    wanted : mapping of str to (3,) array
        Theoretical position of each spot, in the coordinates in which spots are compared [mm].
    max_residual : float
        No target departs from the rigid image further [mm].

    Attributes
    ----------
    parts : mapping of (path, span) to float
        By how much the literal there departs from the rigid image [mm].
    """

    rigid: RigidImage
    robot: Robot
    spots: Mapping[int, str]
    wanted: Mapping[str, Array]
    max_residual: float
    direction: Direction = field(init=False)
    issues: list[Issue] = field(init=False, default_factory=list)
    parts: dict[tuple[str, Span], float] = field(init=False, default_factory=dict)
    _shifts: dict[int, Array] = field(init=False, default_factory=dict)
    _ways: dict[int, Array] = field(init=False, default_factory=dict)
    _record: dict[str, Any] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        self.direction = self.rigid.direction

    def deviation(self, base2spots: RigidTransform) -> None:
        """Targets do not move alike."""

    def tool_change(self, tool: Frame) -> None:
        """No tool is wrong."""

    def poses(self, moving: Sequence[Moving]) -> RigidTransform:
        """New ``target2base`` of n > 0 targets."""
        shifts = RigidTransform.from_translation(np.array([self._shifts.get(id(item), np.zeros(3)) for item in moving]))
        bases = batch([item.base2spots for item in moving])
        return bases.inv() * shifts * bases * self.rigid.poses(moving)

    def offset(self, move: Move) -> Array:
        """New components (3,) of an offset along the base [mm]."""
        assert move.base2spots is not None  # noqa: S101 - asked before
        beside = self._ways.get(id(move), np.zeros(3))
        return np.asarray(self.rigid.offset(move) + move.base2spots.rotation.inv().apply(beside))

    def record(self) -> dict[str, Any]:
        """How many welds were snapped, and by how much at most."""
        return {"snap": self._record}

    def see(self, scope: Scope, changeable: Changeable | None = None) -> Sequence[Refusal]:  # noqa: ARG002 - points only
        """Find the shift of every target; refuse welds without a theoretical position, and points of several welds."""
        goals, offsets = goals_of(scope, self.spots)
        residuals = self._residuals(goals)
        refusals = self._nameless(scope, residuals)
        shifts = self._along_paths(scope, residuals)
        refusals += self._take_targets(goals, shifts)
        refusals += self._take_offsets(goals, offsets, shifts)
        self._say(goals, residuals, shifts.met)
        return refusals

    def _residuals(self, goals: Sequence[Goal]) -> dict[int, Array]:
        """What the rigid image leaves at each weld, by `id` of the motion [mm]."""
        found = {}
        for goal in goals:
            place = goal.move.spot_pose
            if goal.spot in self.wanted and place is not None:
                found[id(goal.move)] = self.wanted[goal.spot] - self.rigid.motion.apply(place.translation)
        return found

    def _nameless(self, scope: Scope, residuals: Mapping[int, Array]) -> list[Refusal]:
        """Welds whose position nobody planned: no program with one of them is snapped."""
        found = []
        for moving in scope.moving:
            move = next((move for move in moving.moves if move.weld and id(move) not in residuals), None)
            if move is not None:
                message = (
                    f"{move.instruction} at line {move.line} welds here, and where it should be is not known: the list "
                    "lacks it, or several spots are offsets of one target. --snap runs with every weld of a program"
                )
                found += moving.refusals("SNAP_UNRESOLVED", message)
        return found

    # --- paths

    def _along_paths(self, scope: Scope, residuals: Mapping[int, Array]) -> _Shifts:
        """Shifts of all targets and motions."""
        paths = [*self._paths(scope, residuals)]
        visits: dict[int, list[_Visit]] = {}
        for path in paths:
            alone = path.blend.shifts(path.blend.welds, path.residuals(residuals))
            ranks = path.blend.ranks
            for row, move in enumerate(path.moves):
                if path.counts[row] and _plain(move):
                    visit = _Visit(alone[row], int(ranks[row]))
                    visits.setdefault(id(move.target), []).append(visit)
        shared = {target: some for target, some in visits.items() if len(some) > 1}
        fixed = {target: np.mean([each.shift for each in _deciding(some)], axis=0) for target, some in shared.items()}
        torn = {
            target
            for target, some in shared.items()
            if not _agree(_deciding(some)) and min(visit.rank for visit in some) <= BESIDE
        }
        shifts = _Shifts({}, torn, sum(not _agree(some) for some in shared.values()) - len(torn))
        for path in paths:
            known = {
                row: fixed[id(move.target)]
                for row, move in enumerate(path.moves)
                if id(move.target) in fixed and _plain(move)
            }
            known |= {row: residuals[id(path.moves[row])] for row in path.blend.welds.tolist()}
            rows = np.array(sorted(known), dtype=np.intp)
            found = path.blend.shifts(rows, np.array([known[row] for row in rows.tolist()]))
            for row, (move, shift) in enumerate(zip(path.moves, found, strict=True)):
                if path.counts[row]:
                    shifts.add(move, shift)
        return shifts

    def _paths(self, scope: Scope, residuals: Mapping[int, Array]) -> Iterator[_Path]:
        """Paths with welds of each routine and what it calls; motions of the latter count where no own path tells."""
        moved = {id(item.target) for item in scope.moving}
        found: list[tuple[list[Move], Rows, list[bool]]] = []
        for routine in scope.routines:
            (sequence,) = sequences(self.robot, [routine])
            held = {id(move) for move in routine.moves}
            for piece in _pieces(sequence, moved):
                welds = np.array([row for row, move in enumerate(piece) if id(move) in residuals], dtype=np.intp)
                if len(welds):
                    found.append((piece, welds, [id(move) in held for move in piece]))
        told = {id(move) for piece, _, own in found for move, is_own in zip(piece, own, strict=True) if is_own}
        for piece, welds, own in found:
            counts = [is_own or id(move) not in told for move, is_own in zip(piece, own, strict=True)]
            yield _Path(piece, BlendedPath(np.array([_place(move) for move in piece]), welds), counts)

    def _take_targets(self, goals: Sequence[Goal], shifts: _Shifts) -> list[Refusal]:
        """Keep the shift of each target; refuse what would need several, or a long one."""
        refusals: list[Refusal] = []
        by_target: dict[int, list[Goal]] = {}
        for goal in goals:
            by_target.setdefault(id(goal.moving), []).append(goal)
        for some in by_target.values():
            moving = some[0].moving
            assert moving is not None  # noqa: S101 - goals of targets have one
            each = [shifts.of(goal.move) for goal in some]
            if any(id(goal.move.target) in shifts.torn for goal in some) or any(_apart(each[0], one) for one in each):
                message = "it is the way to or from several welds, and --snap shifts each of them by its own"
                refusals += moving.refusals("SHARED_TARGET", message)
                continue
            size = float(np.linalg.norm(each[0]))
            if size > self.max_residual:
                message = (
                    f"would depart from the rigid motion by {size:.2f} mm; --max-residual allows {self.max_residual:g}"
                )
                refusals += moving.refusals("RESIDUAL_TOO_LARGE", message)
            self._shifts[id(moving)] = each[0]
            self.parts[(moving.target.path, moving.target.span)] = size
        return refusals

    def _take_offsets(self, goals: Sequence[Goal], offsets: Sequence[Goal], shifts: _Shifts) -> list[Refusal]:
        """Give offsets what their motions are shifted by beyond the targets they start from."""
        refusals: list[Refusal] = []
        anchors = {id(goal.target): self._shifts.get(id(goal.moving), np.zeros(3)) for goal in goals}
        literals: dict[tuple[str, Span], Array] = {}
        for goal in offsets:
            offset, anchor = goal.move.offset, anchors.get(id(goal.target))
            if offset is None or anchor is None or not shifts.knows(goal.move):
                continue
            way = shifts.of(goal.move) - anchor
            known = literals.setdefault((offset.path, offset.span), way)
            if _apart(known, way):
                message = "its offset serves several motions of the path: --snap shifts each by its own"
                move = goal.move
                refusals.append(Refusal(move.program, goal.target.name, "SHARED_TARGET", message, move.path, move.line))
                continue
            self._ways[id(goal.move)] = way
            self.parts[(offset.path, offset.span)] = float(np.linalg.norm(way))
        return refusals

    def _say(self, goals: Sequence[Goal], residuals: Mapping[int, Array], met: int) -> None:
        sizes = {
            goal.spot: float(np.linalg.norm(residuals[id(goal.move)])) for goal in goals if id(goal.move) in residuals
        }
        if not sizes:
            return
        worst = max(sizes, key=lambda name: sizes[name])
        self._record = {
            "spots": len(sizes),
            "largest_mm": sizes[worst],
            "at": worst,
            "plateau_mm": PLATEAU_MM,
            "met_by_several_ways": met,
        }
        message = (
            f"{len(sizes)} welds are put onto their theoretical positions, {worst} by {sizes[worst]:.2f} mm beyond the "
            "rigid motion: the programs no longer move as one body, and distances between spots become those of the "
            "list. Points between welds are shifted by what lies between; step through them"
        )
        self.issues.append(Issue("SNAPPED", message))


@dataclass(frozen=True)
class _Visit:
    """What a path makes of a target each time that it comes by, and how much that counts (`BlendedPath.ranks`)."""

    shift: Array
    rank: int


def _deciding(visits: Sequence[_Visit]) -> list[_Visit]:
    """Visits that say what a target is shifted by: welds, else those right beside one, near one, and last all."""
    best = min(visit.rank for visit in visits)
    return [visit for visit in visits if visit.rank == best]


def _agree(visits: Sequence[_Visit]) -> bool:
    return not any(_apart(visits[0].shift, visit.shift) for visit in visits)


@dataclass(frozen=True, eq=False)
class _Path:
    """Motions of a path, and which of them count."""

    moves: list[Move]
    blend: BlendedPath
    counts: list[bool]

    def residuals(self, by_move: Mapping[int, Array]) -> Array:
        """Residuals (m, 3) of its welds [mm]."""
        return np.array([by_move[id(self.moves[row])] for row in self.blend.welds.tolist()])


@dataclass(eq=False)
class _Shifts:
    """Shift of each motion, targets that would need several, and how many targets got the mean of several ways."""

    by_move: dict[int, Array]
    torn: set[int]
    met: int

    def add(self, move: Move, shift: Array) -> None:
        """Keep a shift; a motion with one along the base that several ways lead to has to have the same on each."""
        known = self.by_move.setdefault(id(move), shift)
        if _apart(known, shift):
            self.torn.add(id(move.target))

    def knows(self, move: Move) -> bool:
        """Whether a path with welds comes by."""
        return id(move) in self.by_move

    def of(self, move: Move) -> Array:
        """Shift (3,) of a motion; none where no path with welds comes by [mm]."""
        return self.by_move.get(id(move), np.zeros(3))


def _plain(move: Move) -> bool:
    """Whether a motion goes to its target itself."""
    return move.offset is None and move.tool_offset is IDENTITY


def _pieces(sequence: Sequence[Move], moved: set[int]) -> Iterator[list[Move]]:
    """Motions to targets that move, cut where one stays; motions without a target ride along."""
    piece: list[Move] = []
    for move in sequence:
        if move.target is None:
            continue
        if id(move.target) in moved:
            piece.append(move)
        elif piece:
            yield piece
            piece = []
    if piece:
        yield piece


def _place(move: Move) -> Array:
    """Where a motion goes, as spots are compared; of one with a shift along the tool that is not known, its target."""
    pose = move.spot_pose
    if pose is None:
        assert move.target is not None and move.target.pose is not None and move.base2spots is not None  # noqa: S101
        pose = move.base2spots * move.target.pose
    return np.asarray(pose.translation)


def _apart(one: Array, other: Array) -> bool:
    return float(np.linalg.norm(one - other)) > _AGREE_MM


def snapped(rigid: RigidImage, fitted: SourceFit, max_residual: float) -> SnappedImage:
    """Image of programs with their welds where the theory of a fit has them.

    Parameters
    ----------
    rigid : RigidImage
        Of the same fit.
    fitted : SourceFit
    max_residual : float
        [mm]

    Raises
    ------
    BadInputError
        ``SNAP_UNRESOLVED`` where names are not settled.
    """
    source, fit = fitted.source, fitted.fit
    unsettled = [issue for issue in fitted.issues if issue.code in _UNSETTLED]
    doubtful = [effect for effect in fit.effects if effect.name == "swapped_ids" and not effect.named]
    if unsettled or doubtful:
        said = [f"{issue.code}: {issue.message}" for issue in unsettled]
        said += [f"EXCHANGED_NAMES: {', '.join(map(str, effect.where['ids']))}, not proved" for effect in doubtful]
        more = f"; and {len(said) - _MOST_LISTED} more" if len(said) > _MOST_LISTED else ""
        message = (
            "--snap puts each weld where the list says, so every name must be settled: "
            f"{'; '.join(said[:_MOST_LISTED])}{more}. Correct the lists, or convert without --snap"
        )
        raise BadInputError("SNAP_UNRESOLVED", message, str(fitted.reference.path))
    assert source.robot is not None  # noqa: S101 - asked before
    held = Counter(id(move.target) for move in source.spots.moves)
    named = {
        id(move.target): name
        for name, move in zip(source.spots.ids, source.spots.moves, strict=True)
        if move.target is not None and held[id(move.target)] == 1  # of several spots beside one target none is its own
    }
    return SnappedImage(rigid, source.robot, named, dict(zip(fit.ids, fit.reference, strict=True)), max_residual)
