"""Which targets move, which stay, and which cannot be told (DESIGN section 6, scope).

In scope are the routines that hold a matched spot, what they call, and what calls them: an approach that stands in the
caller belongs to the part as much as the spot. A target moves if a routine in scope goes to it under a base that a
matched spot uses, or one that is composed on the same. Targets there under other bases (tip dresser, racks) stay. Under
the world frame a routine must be known as a service routine by its name, or only call the others, since the program
does not tell whether the target belongs to the part. Every other routine that goes to a moved target comes into scope
with it.
"""

from __future__ import annotations

import fnmatch
import re
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from scipy.spatial.transform import RigidTransform

from respot.geometry import IDENTITY, distance_mm, turn_deg
from respot.program.frames import Frame
from respot.program.moves import Move
from respot.program.robot import Robot, Routine, Unread
from respot.program.targets import Target, TargetKind
from respot.tolerance import SAME_POSITION_MM, SAME_ROTATION_DEG

#: A literal position within a statement that no rule knows: ``[[1,2,3],..``, ``{X 1,..``, ``{E6POS: X 1,..``.
_POSE = re.compile(r"\[\s*\[|\{\s*(?:\w+\s*:)?\s*[XYZ]\s", re.IGNORECASE)
_WAY_OF_PART = "a shift of the part along a fixed gun: it is not documented along which axes it goes"
#: Doubts that tell why it is not known what carries the part.
_OF_FRAMES = ("UNKNOWN_FRAME", "UNKNOWN_MODE", "UNKNOWN_TOOL")
_NAME = re.compile(r"[^\W\d][\w$]*(?:\[[\d,]+\])?(?:\.\w+)*")


@dataclass(frozen=True, eq=False)
class Refusal:
    """A motion that cannot be corrected, and so its whole program."""

    program: str
    target: str
    code: str
    message: str
    path: str
    line: int


@dataclass(frozen=True, eq=False)
class Stay:
    """A target that stays where it is."""

    target: Target
    code: str


@dataclass(frozen=True, eq=False)
class Moving:
    """A target that moves, with its base as spots are compared (`Move.base2spots`) and all motions to it."""

    target: Target
    base2spots: RigidTransform
    moves: Sequence[Move]

    @property
    def programs(self) -> set[str]:
        """Programs that go to the target."""
        return {move.program for move in self.moves}

    def refusals(self, code: str, message: str) -> list[Refusal]:
        """One refusal for each program that goes to the target."""
        first = {move.program: move for move in reversed(self.moves)}
        return [Refusal(name, self.target.name, code, message, move.path, move.line) for name, move in first.items()]


@dataclass
class Scope:
    """What moves and what does not.

    Parameters
    ----------
    routines : list of Routine
        Routines in scope.
    moving : list of Moving
        Targets that move.
    offsets : list of Move
        Motions in scope whose base offset turns.
    stays : list of Stay
        Targets that stay.
    refusals : list of Refusal
        Motions in scope that cannot be corrected.
    """

    routines: list[Routine] = field(default_factory=list)
    moving: list[Moving] = field(default_factory=list)
    offsets: list[Move] = field(default_factory=list)
    stays: list[Stay] = field(default_factory=list)
    refusals: list[Refusal] = field(default_factory=list)


def find_scope(robot: Robot, spot_moves: Iterable[Move], programs: str | None = None) -> Scope:
    """Decide about every target of a robot.

    Parameters
    ----------
    robot : Robot
        The robot.
    spot_moves : iterable of Move
        Motions of the matched spots.
    programs : str, optional
        Glob of programs to take in place of the routines with matched spots.
    """
    spots = list(spot_moves)
    return _Finder(robot, spots, programs).find()


class _Finder:
    """Decides, and takes in every routine that shares a target with those in scope."""

    def __init__(self, robot: Robot, spots: Sequence[Move], programs: str | None) -> None:
        self._robot = robot
        held = {id(move) for move in spots}
        self._task_of = {id(move): routine.task for routine in robot.routines for move in routine.moves}
        parts: dict[tuple[object, ...], _Part] = {}  # a part has many spots
        for move in spots:
            if move.workpiece is not None:
                part = _Part(self._task_of[id(move)], move)
                parts.setdefault(part.key, part)
        self._parts = list(parts.values())
        self._several_parts = _held_frames(self._parts)
        self._welding = {id(r) for r in robot.routines if any(id(move) in held for move in r.moves)}
        self._core, self._wide = _routines(robot, self._welding, programs)
        self._everywhere: dict[int, list[Move]] = {}
        for move in robot.moves():
            if move.target is not None:
                self._everywhere.setdefault(id(move.target), []).append(move)
        self._found: dict[tuple[str, int, bool], bool] = {}
        self._mixed: dict[tuple[str, int, int, bool], bool] = {}
        self._worlds: dict[int, bool] = {}
        self._positions = positions_of(robot)
        self._frame_names = _frame_names(self._everywhere.values())

    def find(self) -> Scope:
        """Return the decision."""
        routine_of = {id(move): routine for routine in self._robot.routines for move in routine.moves}
        while True:
            scope, uses = self._decide_moves()
            sharing = {
                id(routine_of[id(move)]) for target in uses for move in self._everywhere[target]
            } - self._core - self._wide  # fmt: skip
            if not sharing:
                break
            self._wide |= sharing
        for target in self._robot.targets:
            self._decide_target(scope, target, uses.get(id(target), []))
        _take_originals(scope)
        return scope

    def _decide_moves(self) -> tuple[Scope, dict[int, list[Move]]]:
        scope = Scope(routines=[r for r in self._robot.routines if id(r) in self._core | self._wide])
        uses: dict[int, list[Move]] = {}
        for routine in scope.routines:
            for unread in routine.unread:
                if id(routine) not in self._core and not may_go(unread, self._positions):
                    continue
                message = f"nobody knows what {unread.text.strip()!r} does: {unread.reason}"
                name = f"line {unread.line}"
                refusal = Refusal(routine.program, name, "OPAQUE_STATEMENT", message, routine.path, unread.line)
                scope.refusals.append(refusal)
            for move in routine.moves:
                refused = self._refusal(move, routine)
                if refused is not None:
                    scope.refusals.append(refused)
                elif self._moves(move, routine):
                    if move.target is not None:
                        uses.setdefault(id(move.target), []).append(move)
                    if move.offset is not None:
                        scope.offsets.append(move)
        return scope, uses

    def _is_service(self, routine: Routine) -> bool:
        return id(routine) not in self._welding and routine.service

    def _moves(self, move: Move, routine: Routine) -> bool:
        if move.target is not None and move.target.kind is TargetKind.JOINTS:
            return False
        if not self._is_matched(move, routine.task):
            return False
        return move.external_tcp or not (self._in_world(move) and self._is_service(routine))

    def _is_matched(self, move: Move, task: str) -> bool:
        """Whether a matched spot of the task uses the base, or is on the held part, under this or another name."""
        frame = move.workpiece
        if frame is None:
            return False
        key = (task, id(frame), move.external_tcp)
        if key not in self._found:
            self._found[key] = any(part.carries(task, frame, move.external_tcp) for part in self._parts)
        return self._found[key]

    def _is_mixed(self, move: Move, task: str) -> bool:
        """Whether a motion takes the frames of a matched spot the other way round (facts: krl.md 5, mixed modes)."""
        key = (task, id(move.base), id(move.tool), move.external_tcp)
        if key not in self._mixed:
            self._mixed[key] = any(
                spot.external_tcp != move.external_tcp
                and (_shared(spot.base, move.base) or _shared(spot.tool, move.tool))
                for spot in (part.move for part in self._parts if part.task == task)
            )
        return self._mixed[key]

    def _in_world(self, move: Move) -> bool:
        """Whether the base of a motion is the world."""
        key = id(move.base)
        if key not in self._worlds:
            self._worlds[key] = _is_world(move.base)
        return self._worlds[key]

    def _refusal(self, move: Move, routine: Routine) -> Refusal | None:
        name = str(move.target) if move.target is not None else f"{move.instruction}@{move.line}"

        def refuse(code: str, message: str) -> Refusal:
            return Refusal(move.program, name, code, message, move.path, move.line)

        if move.target is not None and move.target.kind is TargetKind.JOINTS:
            return None
        if move.target is None and move.offset is None:
            if move.unknown:
                return refuse(_code_of(move), move.unknown)
            in_tool = move.external_tcp and move.tool_offset is not IDENTITY and self._robot.language == "krl"
            return refuse("EXTERNAL_TCP", _WAY_OF_PART) if in_tool and self._is_matched(move, routine.task) else None
        if move.workpiece is None:
            what = "what the robot holds" if move.external_tcp else "the base of this motion"
            told = [doubt.text for doubt in move.doubts if doubt.code in _OF_FRAMES]
            return refuse("UNKNOWN_FRAME", told[0] if told else f"the program does not tell {what}")
        if move.base2spots is None:
            assert move.base is not None  # noqa: S101 - the base is what carries the part
            return refuse("UNKNOWN_FRAME", f"base {move.base}: {move.base.unknown}")
        elsewhere = id(routine) not in self._core or self._is_service(routine)
        in_world = not move.external_tcp and self._in_world(move)
        if in_world and not self._is_matched(move, routine.task) and not elsewhere:
            message = (
                f"{move.routine} welds under other bases but goes to this target in the world frame: "
                "respot cannot tell whether it belongs to the part"
            )
            return refuse("WORLD_BASE", message)
        if move.external_tcp and self._several_parts and self._is_matched(move, routine.task):
            message = (
                f"spots are matched in several frames of the held part, {' and '.join(self._several_parts)}: "
                "the calibration can be that of one only; correct the spots of one frame at a time"
            )
            return refuse("EXTERNAL_TCP", message)
        if self._is_mixed(move, routine.task):
            message = (
                "the matched spots use the same frames, but one of them with the gun and the other with the part on "
                "the robot: both would have to move, each in its own way"
            )
            return refuse("EXTERNAL_TCP", message)
        if not self._moves(move, routine):
            return None
        if move.offset is not None and move.external_tcp and self._robot.language == "krl":
            return refuse("EXTERNAL_TCP", _WAY_OF_PART)
        if move.unknown:
            return refuse(_code_of(move), move.unknown)
        if move.target is not None and not move.target.components:
            return refuse("RUN_TIME_POSE", move.target.unknown)
        if move.offset is not None and not move.offset.literal:
            return refuse(
                "RUN_TIME_POSE", "the offset along the base is computed while the robot runs, or turns the tool"
            )
        return None

    def _decide_target(self, scope: Scope, target: Target, moves: list[Move]) -> None:
        everywhere = self._everywhere.get(id(target), [])
        if target.kind is TargetKind.JOINTS:
            scope.stays.append(Stay(target, "JOINT_TARGET"))
            return
        if not moves:
            same_base = any(self._is_matched(move, self._task_of[id(move)]) for move in everywhere)
            code = "SAME_BASE_STAYS" if same_base else "OUT_OF_SCOPE" if everywhere else "NOT_REACHED"
            scope.stays.append(Stay(target, code))
            return
        first = moves[0]
        if not all(_same_use(first, other) for other in everywhere):
            used = dict.fromkeys("an unknown base" if other.base is None else str(other.base) for other in everywhere)
            kinds = {other.external_tcp for other in everywhere}
            names = "held and external TCP" if len(kinds) > 1 else " and ".join(used)
            message = f"it is used under {names}: one literal cannot be right in both"
            refusal = Refusal(first.program, target.name, "SHARED_TARGET", message, first.path, first.line)
            scope.refusals.append(refusal)
            return
        if self._is_frame(target):
            message = "it is also a base or tool: what is programmed in it would move with it, and once more by itself"
            scope.refusals.append(Refusal(first.program, target.name, "SHARED_TARGET", message, first.path, first.line))
            return
        assert first.base2spots is not None  # noqa: S101 - refused above
        scope.moving.append(Moving(target, first.base2spots, everywhere))

    def _is_frame(self, target: Target) -> bool:
        """Whether code takes a target for a base or tool, or makes one of it."""
        return bool({target.path, ""} & self._frame_names.get(target.name.lower(), set()))


def positions_of(robot: Robot) -> set[str]:
    """Names of a robot's positions other than joints, in lower case."""
    return {target.name.lower() for target in robot.targets if target.kind is not TargetKind.JOINTS}


def may_go(unread: Unread, positions: Collection[str]) -> bool:
    """Whether a statement that no rule knows names a position, or holds one: it may go there."""
    names = {name.lower() for name in _NAME.findall(unread.text)}
    return not names.isdisjoint(positions) or bool(_POSE.search(unread.text))


def _frame_names(moves: Iterable[Sequence[Move]]) -> dict[str, set[str]]:
    """Names in the expressions of all bases and tools, in lower case, with the file that declares each, if known."""
    found: dict[str, set[str]] = {}
    frames = {id(frame): frame for group in moves for move in group for frame in (move.base, move.tool) if frame}
    for frame in frames.values():
        for name in _NAME.findall(frame.name):
            found.setdefault(name.lower(), set()).add(frame.path or "")
    return found


def _take_originals(scope: Scope) -> None:
    """Move the original of a touched-up target with it: a controller that limits touch-ups compares the two."""
    targets = [*(item.target for item in scope.moving), *(stay.target for stay in scope.stays)]
    named = Counter((target.path, target.name.lower()) for target in targets)
    moving = {(item.target.path, item.target.name.lower()): item for item in scope.moving}
    moving = {key: item for key, item in moving.items() if named[key] == 1}  # another is declared in a routine
    for stay in [stay for stay in scope.stays if stay.target.original_of]:
        twin = moving.get((stay.target.path, stay.target.original_of.lower()))
        if twin is not None and stay.code == "NOT_REACHED" and stay.target.components:
            scope.stays.remove(stay)
            scope.moving.append(Moving(stay.target, twin.base2spots, twin.moves))


@dataclass(frozen=True, eq=False)
class _Part:
    """The frame that carries the part of a matched spot."""

    task: str
    move: Move

    @property
    def key(self) -> tuple[object, ...]:
        """What is alike of spots that are the same part in the same hands."""
        return self.task, id(self.move.base), id(self.move.tool), self.move.external_tcp

    def carries(self, task: str, frame: Frame, external_tcp: bool) -> bool:
        own = self.move.workpiece
        if own is None or self.task != task or external_tcp != self.move.external_tcp:
            return False
        return _same(frame, own) or (not frame.foot.world and _same(frame.foot, own.foot))


def _held_frames(parts: Iterable[_Part]) -> list[str]:
    """Names of the frames of held parts in which spots are matched; empty for one."""
    frames: list[Frame] = []
    for part in parts:
        own = part.move.workpiece
        if part.move.external_tcp and own is not None and not any(_same(own, frame) for frame in frames):
            frames.append(own)
    return [str(frame) for frame in frames] if len(frames) > 1 else []


def _shared(first: Frame | None, second: Frame | None) -> bool:
    """Whether two motions name the same frame, other than the world or the bare flange."""
    return first is not None and second is not None and not first.world and _same(first, second)


def _same_use(first: Move, second: Move) -> bool:
    """Whether two motions mean the same place by one literal."""
    if first is second:
        return True
    frames = first.workpiece, second.workpiece
    if first.external_tcp != second.external_tcp or frames[0] is None or frames[1] is None:
        return False
    return _same(frames[0], frames[1])


def _code_of(move: Move) -> str:
    """Code of why the goal of a motion is not known."""
    return next((doubt.code for doubt in move.doubts if doubt.text == move.unknown), "RUN_TIME_POSE")


def _is_world(base: Frame | None) -> bool:
    """Whether a base is the world, by number or because nobody ever set it."""
    return base is not None and (base.world or (not base.held and _same(base, Frame("world", world=True))))


def _same(first: Frame, second: Frame) -> bool:
    """Whether two frames are one, or lie in the same place."""
    if first is second:
        return True
    if first.pose is None or second.pose is None or first.held != second.held:
        return False
    near = float(distance_mm(first.pose, second.pose)) <= SAME_POSITION_MM
    return near and float(turn_deg(first.pose, second.pose)) <= SAME_ROTATION_DEG


def _routines(robot: Robot, welding: set[int], programs: str | None) -> tuple[set[int], set[int]]:
    """Routines that weld or are called by one that does, and routines that call them."""
    if programs is not None:
        return {id(r) for r in robot.routines if fnmatch.fnmatchcase(r.program.lower(), programs.lower())}, set()
    calls = _calls(robot)
    holding = [routine for routine in robot.routines if id(routine) in welding]
    callers: dict[int, list[Routine]] = {}
    for routine in robot.routines:
        for called in calls[id(routine)]:
            callers.setdefault(id(called), []).append(routine)
    return _reach(holding, calls), _reach(holding, callers)


def _calls(robot: Robot) -> dict[int, list[Routine]]:
    """Routines of its task that each routine calls; one of the same program hides others of its name."""
    by_name: dict[tuple[str, str], list[Routine]] = {}
    for routine in robot.routines:
        by_name.setdefault((routine.task, routine.name.lower()), []).append(routine)
    calls: dict[int, list[Routine]] = {}
    for routine in robot.routines:
        called = calls.setdefault(id(routine), [])
        for name in routine.calls:
            named = by_name.get((routine.task, name.lower()), [])
            called += [other for other in named if other.program == routine.program] or named
    return calls


def _reach(start: Iterable[Routine], edges: Mapping[int, Sequence[Routine]]) -> set[int]:
    pending, found = list(start), set[int]()
    while pending:
        routine = pending.pop()
        if id(routine) not in found:
            found.add(id(routine))
            pending += edges.get(id(routine), ())
    return found
