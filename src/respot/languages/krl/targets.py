"""Literal positions of KRL: declared points, array elements, aggregates in the code."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from respot.languages.krl.machine import frame_pose
from respot.languages.krl.symbols import Aggregate, Symbol
from respot.program.targets import Target, TargetKind
from respot.source import SourceText

POSITION_TYPES = frozenset(("POS", "E6POS", "E3POS", "FRAME", "AXIS", "E6AXIS", "E3AXIS"))


class Targets:
    """Every literal position of a robot, one `Target` for each place in a file.

    Parameters
    ----------
    sources : mapping of str to SourceText
        The files, by path.
    """

    def __init__(self, sources: Mapping[str, SourceText]) -> None:
        self._sources = sources
        self._targets: dict[tuple[str, int], Target] = {}

    def __iter__(self) -> Iterator[Target]:
        return iter(self._targets.values())

    def declared(self, symbol: Symbol) -> Target | None:
        """Target of a declared point or array element; None if it is no literal position."""
        if not isinstance(symbol.value, Aggregate):
            return None
        if symbol.type not in POSITION_TYPES:
            return None
        return self.literal(symbol.name, symbol.path, symbol.value, declared=True)

    def literal(self, name: str, path: str, aggregate: Aggregate, declared: bool = False) -> Target | None:
        """Target of an aggregate; None if it is neither pose nor joints."""
        key = (path, aggregate.span[0])
        if key not in self._targets:
            kind = _kind(aggregate)
            if kind is None:
                return None
            found = frame_pose(aggregate) if kind is TargetKind.POSE else None
            line, column = self._sources[path].place(aggregate.span[0])
            self._targets[key] = Target(
                name=name,
                kind=kind,
                path=path,
                line=line,
                column=column,
                span=aggregate.span,
                numbers=aggregate.numbers(),
                pose=found,
                unknown="" if found is not None or kind is TargetKind.JOINTS else "not all of X Y Z A B C are numbers",
                declared=declared,
            )
        return self._targets[key]


def _kind(aggregate: Aggregate) -> TargetKind | None:
    if "X" in aggregate.members or "Y" in aggregate.members or "Z" in aggregate.members:
        return TargetKind.POSE
    return TargetKind.JOINTS if "A1" in aggregate.members else None
