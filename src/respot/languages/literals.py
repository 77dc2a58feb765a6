"""What the literals of all languages share: signed numbers, and one `Target` for each place in a file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from decimal import Decimal, InvalidOperation
from math import isfinite

from respot.program.statement import Node
from respot.program.targets import Number, Target
from respot.source import SourceText


def number_of(node: Node) -> Number | None:
    """Return the number of a decimal literal with its sign, None for any other expression."""
    inner, negative = node, False
    if inner.kind == "signed":
        negative = inner.tokens("SIGN")[0].text == "-"
        inner = inner.nodes[-1]
    if inner.kind != "number":
        return None
    try:
        value = Decimal(inner.text)
    except InvalidOperation:
        return None
    if not isfinite(float(value)):  # no controller holds 1E400
        return None
    return Number(value.copy_negate() if negative else value, node.span)


class TargetTable:
    """The targets of a robot, by file and place.

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

    def place(self, path: str, offset: int) -> tuple[int, int]:
        """Line and column of a place, from 1."""
        return self._sources[path].place(offset)
