"""Literal positions of KRL: declared points, array elements, aggregates in the code."""

from __future__ import annotations

from functools import lru_cache

from respot.languages.krl.symbols import Aggregate, Symbol
from respot.languages.literals import TargetTable
from respot.program.targets import Target, TargetKind

POSITION_TYPES = frozenset(("POS", "E6POS", "E3POS", "FRAME", "AXIS", "E6AXIS", "E3AXIS"))


class Targets(TargetTable):
    """Every literal position of a robot."""

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
            found = _components(aggregate) if kind is TargetKind.POSE else ()
            line, column = self.place(path, aggregate.span[0])
            self._targets[key] = Target(
                name=name,
                kind=kind,
                path=path,
                line=line,
                column=column,
                span=aggregate.span,
                numbers=aggregate.numbers(),
                fields=_fields(tuple(aggregate.members)),
                components=found,
                unknown="" if found or kind is TargetKind.JOINTS else "not all of X Y Z A B C are numbers",
                declared=declared,
            )
        return self._targets[key]


@lru_cache
def _fields(names: tuple[str, ...]) -> frozenset[str]:
    """Return the names as a set, one for all the points that have the same."""
    return frozenset(names)


def _kind(aggregate: Aggregate) -> TargetKind | None:
    if not aggregate.members.keys().isdisjoint("XYZABC"):
        return TargetKind.POSE
    return TargetKind.JOINTS if "A1" in aggregate.members else None


def _components(aggregate: Aggregate) -> tuple[float, ...]:
    values = tuple(value for name in "XYZABC" if (value := aggregate.number(name)) is not None)
    return values if len(values) == 6 else ()
