"""Which targets move, which stay, and which cannot be told (DESIGN section 6, scope).

In scope are the routines that hold a matched spot, what they call, and what calls them: an approach that stands in the
caller belongs to the part as much as the spot. A target moves if a routine in scope goes to it under a base that a
matched spot uses. Targets there under other bases (tip dresser, racks) stay. Under the world frame a routine must be
known as a service routine by its name, or only call the others, since the program does not tell whether the target
belongs to the part.
"""

from __future__ import annotations

import fnmatch
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from respot.languages import Language
from respot.program.frames import Frame
from respot.program.moves import Move
from respot.program.robot import Robot, Routine
from respot.program.targets import Target, TargetKind


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
    """A target that moves, with the base it is programmed in and all motions to it."""

    target: Target
    base: Frame
    moves: Sequence[Move]

    @property
    def programs(self) -> set[str]:
        """Programs that go to the target."""
        return {move.program for move in self.moves}


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


def find_scope(robot: Robot, language: Language, spot_moves: Iterable[Move], programs: str | None = None) -> Scope:
    """Decide about every target of a robot.

    Parameters
    ----------
    robot : Robot
        The robot.
    language : Language
        Its language.
    spot_moves : iterable of Move
        Motions of the matched spots.
    programs : str, optional
        Glob of programs to take in place of the routines with matched spots.
    """
    spots = list(spot_moves)
    routines, core = _routines(robot, spots, programs)
    scope = Scope(routines=routines)
    bases = {id(move.base) for move in spots}
    uses: dict[int, list[Move]] = {}
    for routine in routines:
        for move in routine.moves:
            refusal = _refusal(move, bases, language, calls_only=id(routine) not in core)
            if refusal is not None:
                scope.refusals.append(refusal)
            elif _is_moving(move, bases, language):
                if move.target is not None:
                    uses.setdefault(id(move.target), []).append(move)
                if move.offset is not None:
                    scope.offsets.append(move)
    everywhere: dict[int, list[Move]] = {}
    for move in robot.moves():
        if move.target is not None:
            everywhere.setdefault(id(move.target), []).append(move)
    for target in robot.targets:
        _decide(scope, target, uses.get(id(target), []), everywhere.get(id(target), []), bases)
    return scope


def _routines(robot: Robot, spots: Sequence[Move], programs: str | None) -> tuple[list[Routine], set[int]]:
    """Routines in scope, and which of them weld or are called by one that does."""
    if programs is not None:
        found = [r for r in robot.routines if fnmatch.fnmatchcase(r.program.lower(), programs.lower())]
        return found, {id(routine) for routine in found}
    held = {id(move) for move in spots}
    calls = _calls(robot)
    holding = [routine for routine in robot.routines if any(id(move) in held for move in routine.moves)]
    core = _reach(holding, calls)
    callers: dict[int, list[Routine]] = {}
    for routine in robot.routines:
        for called in calls[id(routine)]:
            callers.setdefault(id(called), []).append(routine)
    wide = _reach(holding, callers) | core
    return [routine for routine in robot.routines if id(routine) in wide], core


def _calls(robot: Robot) -> dict[int, list[Routine]]:
    """Routines that each routine calls; a routine of the same program hides others of its name."""
    by_name: dict[str, list[Routine]] = {}
    for routine in robot.routines:
        by_name.setdefault(routine.name.lower(), []).append(routine)
    calls: dict[int, list[Routine]] = {}
    for routine in robot.routines:
        called = calls.setdefault(id(routine), [])
        for name in routine.calls:
            named = by_name.get(name.lower(), [])
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


def _refusal(move: Move, bases: set[int], language: Language, calls_only: bool) -> Refusal | None:
    name = str(move.target) if move.target is not None else f"{move.instruction}@{move.line}"

    def refuse(code: str, message: str) -> Refusal:
        return Refusal(move.program, name, code, message, move.path, move.line)

    if move.target is not None and move.target.kind is TargetKind.JOINTS:
        return None
    if move.target is None and move.offset is None:
        return refuse("RUN_TIME_POSE", move.unknown) if move.unknown else None
    if move.base is None:
        return refuse("UNKNOWN_FRAME", move.unknown or "the program does not tell the base of this motion")
    if move.base.pose is None:
        return refuse("UNKNOWN_FRAME", f"base {move.base}: {move.base.unknown}")
    elsewhere = calls_only or language.forms.is_service(move.routine)
    if move.base.world and id(move.base) not in bases and not elsewhere:
        message = (
            f"{move.routine} welds under other bases but goes to this target in the world frame: "
            "respot cannot tell whether it belongs to the part"
        )
        return refuse("WORLD_BASE", message)
    if not _is_moving(move, bases, language):
        return None
    if move.external_tcp:
        return refuse("EXTERNAL_TCP", "the robot holds the part; correcting such targets is not supported yet")
    if move.unknown:
        return refuse("RUN_TIME_POSE", move.unknown)
    if move.target is not None and move.target.pose is None:
        return refuse("RUN_TIME_POSE", move.target.unknown)
    if move.offset is not None and not move.offset.literal:
        return refuse("RUN_TIME_POSE", "the offset along the base is computed while the robot runs, or turns the tool")
    return None


def _is_moving(move: Move, bases: set[int], language: Language) -> bool:
    if move.target is not None and move.target.kind is TargetKind.JOINTS:
        return False
    if move.base is None or id(move.base) not in bases:
        return False
    return not (move.base.world and language.forms.is_service(move.routine))


def _decide(scope: Scope, target: Target, moves: list[Move], everywhere: list[Move], bases: set[int]) -> None:
    if target.kind is TargetKind.JOINTS:
        scope.stays.append(Stay(target, "JOINT_TARGET"))
        return
    if not moves:
        same_base = any(id(move.base) in bases for move in everywhere)
        code = "SAME_BASE_STAYS" if same_base else "OUT_OF_SCOPE" if everywhere else "NOT_REACHED"
        scope.stays.append(Stay(target, code))
        return
    used = {id(move.base): move.base for move in everywhere}
    base = moves[0].base
    if len(used) > 1 or base is None:
        names = " and ".join("an unknown base" if other is None else str(other) for other in used.values())
        message = f"it is used under {names}: one literal cannot be right in both"
        first = moves[0]
        scope.refusals.append(Refusal(first.program, target.name, "SHARED_TARGET", message, first.path, first.line))
        return
    scope.moving.append(Moving(target, base, everywhere))
