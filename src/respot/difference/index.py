"""What a side's files hold, by place: targets, offsets along the base, and the motions that use a target."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from functools import cached_property
from operator import attrgetter

from respot.difference.canonical import NUMBER, TARGET, Mask
from respot.program.frames import Frame
from respot.program.moves import BaseOffset, Move
from respot.program.robot import Robot
from respot.program.statement import Statement
from respot.program.targets import Target
from respot.source import Span


class Index:
    """Targets, offsets and uses of one robot.

    Parameters
    ----------
    robot : Robot
        The robot.
    """

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self._targets: dict[str, list[Target]] = {}
        for target in robot.targets:
            self._targets.setdefault(target.path, []).append(target)
        for found in self._targets.values():
            found.sort(key=attrgetter("span"))
        self._starts = {path: [target.span[0] for target in found] for path, found in self._targets.items()}
        self._signatures: dict[int, tuple[object, ...]] = {}

    @cached_property
    def uses(self) -> dict[int, list[Move]]:
        """Motions by the identity of their target: the first under each base."""
        found: dict[int, list[Move]] = {}
        for move in self.robot.moves():
            if move.target is not None:
                moves = found.setdefault(id(move.target), [])
                if all(other.base is not move.base or other.external_tcp != move.external_tcp for other in moves):
                    moves.append(move)
        return found

    @cached_property
    def _offsets(self) -> dict[str, list[tuple[Span, BaseOffset, Move]]]:
        by_place: dict[tuple[str, Span], tuple[Span, BaseOffset, Move]] = {}
        for move in self.robot.moves():
            if move.offset is not None and move.offset.literal:
                by_place.setdefault((move.offset.path, move.offset.span), (move.offset.span, move.offset, move))
        found: dict[str, list[tuple[Span, BaseOffset, Move]]] = {}
        for (path, _), item in sorted(by_place.items(), key=lambda item: item[0]):
            found.setdefault(path, []).append(item)
        return found

    def targets_of(self, path: str) -> Sequence[Target]:
        """Return the targets of a file, in order."""
        return self._targets.get(path, ())

    def targets_in(self, path: str, statement: Statement) -> Sequence[Target]:
        """Return the targets of a statement, in order."""
        starts = self._starts.get(path)
        if not starts:
            return ()
        return self._targets[path][bisect_left(starts, statement.start) : bisect_left(starts, statement.end)]

    def offsets_in(self, path: str, statement: Statement) -> Sequence[tuple[BaseOffset, Move]]:
        """Return the offsets along the base of a statement, in order, with the motion that each belongs to."""
        found = self._offsets.get(path, [])
        first = bisect_left(found, statement.start, key=lambda item: item[0][0])
        last = bisect_left(found, statement.end, key=lambda item: item[0][0])
        return [(offset, move) for _, offset, move in found[first:last]]

    def masks(self, path: str, statement: Statement) -> list[Mask]:
        """Return the literals of a statement that are compared as positions; names within them stay in its key."""
        masks: list[Mask] = []
        for target in self.targets_in(path, statement):
            if len(target.numbers) == len(target.fields):
                masks.append((target.span, TARGET))
            else:
                masks += [(number.span, NUMBER) for number in target.numbers.values()]
        masks += [(offset.span, TARGET) for offset, _ in self.offsets_in(path, statement)]
        return masks

    def signature(self, frame: Frame | None) -> tuple[object, ...]:
        """Return what tells a frame from others: its name and its pose."""
        if frame is None:
            return ()
        found = self._signatures.get(id(frame))
        if found is None:
            matrix = None if frame.pose is None else tuple(frame.pose.as_matrix().ravel().tolist())
            found = self._signatures[id(frame)] = (frame.name.upper(), matrix)
        return found
