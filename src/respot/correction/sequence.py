"""The order in which motions run: routines, and what they call."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from respot.program.moves import Move
from respot.program.robot import Robot, Routine

#: Calls within calls that are followed.
_DEEPEST_CALL = 8


def sequences(robot: Robot, routines: Sequence[Routine]) -> Iterator[list[Move]]:
    """Motions of each routine and of what it calls, in order; a routine that calls itself is followed once."""
    calls: dict[tuple[str, str], Routine] = {}
    for routine in robot.routines:
        calls.setdefault((routine.task, routine.name.lower()), routine)
    for routine in routines:
        yield list(_motions(routine, calls, ()))


def _motions(routine: Routine, calls: Mapping[tuple[str, str], Routine], above: tuple[int, ...]) -> Iterator[Move]:
    for step in routine.steps:
        if isinstance(step, Move):
            yield step
        else:
            called = calls.get((routine.task, step.name.lower()))
            if called is not None and id(called) not in above and len(above) < _DEEPEST_CALL:
                yield from _motions(called, calls, (*above, id(routine)))
