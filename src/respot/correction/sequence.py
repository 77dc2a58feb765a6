"""The order in which motions run: routines, and what they call."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import islice

from respot.geometry import IDENTITY
from respot.program.moves import Move
from respot.program.robot import Robot, Routine

#: Calls within calls that are followed.
_DEEPEST_CALL = 8
#: Motions of one sequence that are looked at.
_LONGEST_SEQUENCE = 100_000


def sequences(robot: Robot, routines: Sequence[Routine]) -> Iterator[list[Move]]:
    """Motions of each routine and of what it calls, in order; a routine that calls itself is followed once."""
    calls: dict[tuple[str, str], Routine] = {}
    for routine in robot.routines:
        calls.setdefault((routine.task, routine.name.lower()), routine)
    for routine in routines:
        yield list(islice(_motions(routine, calls, ()), _LONGEST_SEQUENCE))


def goes_somewhere(move: Move) -> bool:
    """Whether a motion goes to a target, away from the last position, or nobody knows where."""
    relative = move.offset is not None or move.tool_offset is not IDENTITY
    return move.target is not None or relative or bool(move.unknown)


def _motions(routine: Routine, calls: Mapping[tuple[str, str], Routine], above: tuple[int, ...]) -> Iterator[Move]:
    seen: set[int] = set()  # a routine called again from here moves the same way again: once is enough
    for step in routine.steps:
        if isinstance(step, Move):
            yield step
            seen.clear()
        else:
            called = calls.get((routine.task, step.name.lower()))
            fresh = called is not None and id(called) not in above and id(called) not in seen
            if called is not None and fresh and len(above) < _DEEPEST_CALL:
                seen.add(id(called))
                yield from _motions(called, calls, (*above, id(routine)))
