"""Literal positions of RAPID: robtargets and jointtargets, declared, in arrays and records, or in the code.

A declaration tells by its type what is a position: an aggregate of a robtarget's shape that is declared as something
else is none (facts: rapid.md 1.4, 1.5).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from decimal import Decimal, InvalidOperation
from math import isfinite, sqrt
from typing import NamedTuple, TypeAlias

from respot.languages.literals import TargetTable
from respot.languages.rapid.records import BUILT_IN, JOINTS, POSES, POSITIONS, Fields
from respot.languages.rapid.symbols import Symbol
from respot.program.statement import Branch, Leaf, Node
from respot.program.targets import LiteralNumbers, Number, Target, TargetKind
from respot.source import SourceText, Span
from respot.tolerance import QUATERNION_NORM

#: Where an element stands in a datum: an index from 0 for each dimension, then for each field of a record.
Keys: TypeAlias = tuple[int, ...]

_GROUPS = {
    kind: tuple(tuple(name for _, name in BUILT_IN[group]) for group, _ in BUILT_IN[record])
    for kind, record in ((TargetKind.POSE, "robtarget"), (TargetKind.JOINTS, "jointtarget"))
}
_FIELDS = {kind: frozenset(name for group in groups for name in group) for kind, groups in _GROUPS.items()}
_COMPONENTS = ("x", "y", "z", "q1", "q2", "q3", "q4")
_DEEPEST = 12


class _Place(NamedTuple):
    """Where the numbers of a literal stand among the tokens of its statement: first and last token of each field."""

    kind: TargetKind
    fields: tuple[str, ...]
    tokens: tuple[Span, ...]


#: What keeps the original of a touched-up target, and how its name begins (facts: rapid.md 2.4).
_ORIGINAL, _PREFIX = "o_robtarget", "o_"


class Targets(TargetTable):
    """Every literal position of a robot."""

    def __init__(self, sources: Mapping[str, SourceText]) -> None:
        super().__init__(sources)
        self.sources = sources
        self._places: dict[tuple[int, str], tuple[Branch, _Place | None]] = {}
        self._declared: dict[tuple[str, int, str], dict[Keys, Target]] = {}

    def declared(self, symbol: Symbol, fields_of: Callable[[str], Fields | None]) -> Mapping[Keys, Target]:
        """Targets within a datum; ``()`` is the datum itself.

        Parameters
        ----------
        symbol : Symbol
            The datum, its type with aliases followed.
        fields_of : callable
            Fields of a record type, None of any other type.
        """
        found = self._declared.get(symbol.key)
        if found is None:
            found = self._declared[symbol.key] = {}
            if holds_positions(symbol.type, fields_of):
                node = symbol.node
                if node is not None:
                    self._within(found, symbol, node, symbol.type, symbol.dimensions, (), symbol.name, fields_of)
        return found

    def _within(
        self,
        found: dict[Keys, Target],
        symbol: Symbol,
        node: Node,
        kind: str,
        dimensions: int,
        keys: Keys,
        name: str,
        fields_of: Callable[[str], Fields | None],
    ) -> None:
        if dimensions:
            for index, item in enumerate(node.nodes if node.kind == "aggregate" else ()):
                inner = f"{name[:-1]},{index + 1}}}" if keys else f"{name}{{{index + 1}}}"
                self._within(found, symbol, item, kind, dimensions - 1, (*keys, index), inner, fields_of)
            return
        if kind in POSITIONS:
            target = self.literal(name, symbol.path, node, declared=True, kind=kind)
            if target is not None:
                found[keys] = target
            return
        fields = fields_of(kind)
        items = node.nodes if node.kind == "aggregate" else []
        if fields is None or len(items) != len(fields) or len(keys) > _DEEPEST:
            return
        for index, ((inner, field), item) in enumerate(zip(fields, items, strict=True)):
            if holds_positions(inner, fields_of):
                self._within(found, symbol, item, inner, 0, (*keys, index), f"{name}.{field}", fields_of)

    def literal(self, name: str, path: str, node: Node, declared: bool = False, kind: str = "") -> Target | None:
        """Target of an aggregate.

        Parameters
        ----------
        name : str
            Name to give it.
        path : str
            Its file.
        node : Node
            The aggregate.
        declared : bool
            It has a name of its own.
        kind : str
            Type that it is known to have; its shape decides where it is not known.

        Returns
        -------
        Target or None
            None for anything that is no position.
        """
        branch = node.branch
        known = self._places.get((id(branch), kind))
        if known is None:
            known = self._places[id(branch), kind] = (branch, _place(branch, kind))
        place = known[1]
        if place is None:
            return None
        span = node.span
        key = (path, span[0])
        found = self._targets.get(key)
        if found is None:
            found = self._make(name, path, node, span, place, declared)
            if kind == _ORIGINAL and name.lower().startswith(_PREFIX):
                found = replace(found, original_of=name[len(_PREFIX) :])
            self._targets[key] = found
        return found

    def _make(self, name: str, path: str, node: Node, span: Span, place: _Place, declared: bool) -> Target:
        tokens, text = node.token_spans, node.source
        spans = [(tokens[first][0], tokens[last][1]) for first, last in place.tokens]
        numbers = _numbers(text, place.fields, spans)
        components: tuple[float, ...] = ()
        unknown = ""
        if place.kind is TargetKind.POSE:
            components = _components(numbers)
            unknown = _doubt(components)
        line, column = self.place(path, span[0])
        return Target(
            name=name,
            kind=place.kind,
            path=path,
            line=line,
            column=column,
            span=span,
            numbers=numbers,
            fields=_FIELDS[place.kind],
            components=() if unknown else components,
            unknown=unknown,
            declared=declared,
        )


def holds_positions(kind: str, fields_of: Callable[[str], Fields | None], depth: int = 0) -> bool:
    """Whether a datum of a type is a position or a record that holds one."""
    if kind in POSITIONS:
        return True
    if kind in BUILT_IN or depth > _DEEPEST:
        return False
    fields = fields_of(kind)
    return fields is not None and any(holds_positions(inner, fields_of, depth + 1) for inner, _ in fields)


def _place(branch: Branch, kind: str) -> _Place | None:
    """Where the numbers of a literal stand; None if it cannot be one of its type, or of the shape of a position."""
    if branch.kind != "aggregate":
        return None
    items = [child for child in branch.children if isinstance(child, Branch)]
    kinds = (
        [TargetKind.POSE] if kind in POSES else [TargetKind.JOINTS] if kind in JOINTS else [*_GROUPS]
    )  # fmt: skip
    for found in kinds:
        groups = _GROUPS[found]
        if len(items) == len(groups) and all(map(_fits, items, groups, [bool(kind)] * len(groups))):
            numbers = [
                (name, (part.first, part.last))
                for group, item in zip(groups, items, strict=True)
                if item.kind == "aggregate"
                for name, part in zip(group, _branches(item), strict=True)
                if _is_number(part)
            ]
            return _Place(found, tuple(name for name, _ in numbers), tuple(tokens for _, tokens in numbers))
    return None


def _fits(item: Branch, group: tuple[str, ...], typed: bool) -> bool:
    """Whether an item may be this group of fields: an aggregate of as many, or the name of such a datum."""
    if item.kind == "aggregate":
        return len(_branches(item)) == len(group)
    return item.kind in ("reference", "function_call") and (typed or group[0] not in ("x", "rax_1"))


def _branches(branch: Branch) -> list[Branch]:
    return [child for child in branch.children if isinstance(child, Branch)]


def _is_number(branch: Branch) -> bool:
    if branch.kind == "signed":
        inner = branch.children[-1]
        return isinstance(inner, Branch) and inner.kind == "number" and isinstance(branch.children[0], Leaf)
    return branch.kind == "number"


def _numbers(text: str, fields: tuple[str, ...], spans: Sequence[Span]) -> Mapping[str, Number]:
    """Numbers of a literal; what no controller holds as a number, such as 1E400, is left out."""
    try:
        return LiteralNumbers(text, fields, spans)
    except ValueError:
        found = ((name, _number(text, span)) for name, span in zip(fields, spans, strict=True))
        return {name: number for name, number in found if number is not None}


def _components(numbers: Mapping[str, Number]) -> tuple[float, ...]:
    """Position and orientation as the literal says them."""
    if isinstance(numbers, LiteralNumbers):
        found = map(numbers.value, _COMPONENTS)
        return tuple([value for value in found if value is not None])
    return tuple(float(numbers[field].value) for field in _COMPONENTS if field in numbers)


def _number(text: str, span: Span) -> Number | None:
    try:
        value = Decimal("".join(text[slice(*span)].split()))
    except InvalidOperation:
        return None
    return Number(value, span) if isfinite(float(value)) else None


def _doubt(values: tuple[float, ...]) -> str:
    if len(values) != len(_COMPONENTS):
        return "not every component of position and orientation is a number"
    norm = sqrt(sum(value * value for value in values[3:]))
    if norm == 0.0:
        return "the quaternion is all zero: the target was never taught"
    if abs(norm - 1.0) > QUATERNION_NORM:
        return f"the quaternion has length {norm:.4f}, not 1"
    return ""
