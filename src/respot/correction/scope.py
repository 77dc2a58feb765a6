"""Which targets move, which stay, and which cannot be told (DESIGN section 6, scope).

In scope are the routines that hold a matched spot and what they call. A target moves if a routine in scope goes to it
under a base that a matched spot uses. Targets there under other bases (tip dresser, racks) stay. Under the world frame
a routine must be known as a service routine by its name, since the program does not tell whether the target belongs to
the part.
"""

from __future__ import annotations

import fnmatch
from collections.abc import Iterable, Sequence
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
    scope = Scope(routines=_routines(robot, spots, programs))
    bases = {id(move.base) for move in spots}
    uses: dict[int, list[Move]] = {}
    for move in (move for routine in scope.routines for move in routine.moves):
        refusal = _refusal(move, bases, language)
        if refusal is not None:
            scope.refusals.append(refusal)
            continue
        if _is_moving(move, bases, language):
            if move.target is not None:
                uses.setdefault(id(move.target), []).append(move)
            if move.offset is not None:
                scope.offsets.append(move)
    for target in robot.targets:
        _decide(scope, robot, target, uses.get(id(target), []))
    return scope


def _routines(robot: Robot, spots: Sequence[Move], programs: str | None) -> list[Routine]:
    if programs is not None:
        return [r for r in robot.routines if fnmatch.fnmatchcase(r.program.lower(), programs.lower())]
    held = {id(move) for move in spots}
    by_name: dict[str, list[Routine]] = {}
    for routine in robot.routines:
        by_name.setdefault(routine.name.lower(), []).append(routine)
    pending = [routine for routine in robot.routines if any(id(move) in held for move in routine.moves)]
    found: dict[int, Routine] = {}
    while pending:
        routine = pending.pop()
        if id(routine) in found:
            continue
        found[id(routine)] = routine
        for name in routine.calls:
            named = by_name.get(name.lower(), [])
            own = [other for other in named if other.program == routine.program]
            pending += own or named
    return [routine for routine in robot.routines if id(routine) in found]


def _refusal(move: Move, bases: set[int], language: Language) -> Refusal | None:
    name = str(move.target) if move.target is not None else f"{move.instruction}@{move.line}"

    def refuse(code: str, message: str) -> Refusal:
        return Refusal(move.program, name, code, message, move.path, move.line)

    if move.target is not None and move.target.kind is TargetKind.JOINTS:
        return None
    if move.target is None and move.offset is None:
        return refuse("RUN_TIME_POSE", move.unknown) if move.unknown else None
    if move.base is None:
        return refuse("UNKNOWN_FRAME", "the program does not tell the base of this motion")
    if move.base.pose is None:
        return refuse("UNKNOWN_FRAME", f"base {move.base}: {move.base.unknown}")
    if move.base.world and id(move.base) not in bases and not language.forms.is_service(move.routine):
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


def _decide(scope: Scope, robot: Robot, target: Target, moves: list[Move]) -> None:
    if target.kind is TargetKind.JOINTS:
        scope.stays.append(Stay(target, "JOINT_TARGET"))
        return
    everywhere = [move for move in robot.moves() if move.target is target]
    if not moves:
        in_scope = {id(move) for routine in scope.routines for move in routine.moves}
        reached = any(id(move) in in_scope for move in everywhere)
        scope.stays.append(Stay(target, "OUT_OF_SCOPE" if reached or everywhere else "NOT_REACHED"))
        return
    bases = {id(move.base): move.base for move in everywhere}
    base = moves[0].base
    if len(bases) > 1 or base is None:
        names = " and ".join(str(other) for other in bases.values())
        message = f"it is used under {names}: one literal cannot be right in both"
        first = moves[0]
        scope.refusals.append(Refusal(first.program, target.name, "SHARED_TARGET", message, first.path, first.line))
        return
    scope.moving.append(Moving(target, base, everywhere))
