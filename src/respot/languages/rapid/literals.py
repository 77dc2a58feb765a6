"""Aggregates of literals, which need no parser: a table of robtargets is one statement of ten thousand equal rows.

Arrays of data hold most of the tokens of a backup, and hardly two have the same number of rows. A literal aggregate is
therefore taken out of a statement before its shape is looked up: an empty one stands in its place, and the rows are
laid into the tree afterwards, as the grammar would have built them (a test holds both equal).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence

from respot.languages.shapes import Part, Shapes, Splitter, Unit
from respot.program.statement import OPAQUE, Branch, Leaf, Shape
from respot.source import Span

_LITERALS = {"0": ("number", "NUMBER"), '"': ("string", "STRING"), "TRUE": ("boolean", "BOOLEAN")}
_LITERALS["FALSE"] = _LITERALS["TRUE"]
_SIGNS = ("+", "-")
#: Tokens of an aggregate whose rows are built each time they are asked for: they would fill the memory.
_LARGE = 200
#: Tokens of a statement whose shape is worth keeping: none of a longer table is met again.
_LARGEST_KEPT = 20_000
#: Deeper ones are left to the grammar, which refuses them.
_DEEPEST = 50


class Rows(Branch):
    """A large aggregate of literals; its tree is built when it is asked for."""

    _kinds: tuple[str, ...]

    @classmethod
    def over(cls, kinds: tuple[str, ...], first: int, last: int) -> Rows:
        """Lay it over the tokens ``first`` to ``last``."""
        rows = cls("aggregate", (), first, last)
        rows._kinds = kinds
        return rows

    @property
    def children(self) -> tuple[Branch | Leaf, ...]:
        """The rows."""
        return _aggregate(self._kinds, self.first)[0].children


class RapidShapes(Shapes):
    """The shapes of RAPID: literals are taken out first, and a statement need not have an end.

    Parameters
    ----------
    grammar, start, token, split
        As for `Shapes`.
    end : callable
        Position of the last token of the statement that begins at a token; None if it goes on in the next line.
    """

    def __init__(
        self,
        grammar: str,
        start: str,
        token: re.Pattern[str],
        split: Splitter,
        end: Callable[[Sequence[str], int], int | None],
    ) -> None:
        super().__init__(grammar, start, token, split)
        self._end = end

    def last(self, text: str) -> tuple[Part, ...]:
        """Statements of a run of lines that ends with the statement it began, whole or not."""
        kinds, _ = self.kinds(text)
        first, parts = 0, []
        while first < len(kinds):
            end = self._end(kinds, first)
            last = len(kinds) - 1 if end is None else end
            parts.append(Part(first, last, self._shape(text, kinds, first, last)))
            first = last + 1
        return tuple(parts)

    def read_table(self, text: str) -> Unit:
        """Read one long statement as `read` does, without a list of all its words."""
        kinds = tuple(kind for match in self._words.finditer(text) if (kind := self._kinds[match.group()]))
        if self._end(kinds, 0) != len(kinds) - 1:
            return None
        shape = self._shape_of(text, kinds, 0)
        return None if shape is None else (Part(0, len(kinds) - 1, shape),)

    def _shape(self, text: str, kinds: list[str], first: int, last: int) -> Shape:
        shape = self._shape_of(text, tuple(kinds[first : last + 1]), first)
        return super()._shape(text, kinds, first, last) if shape is None else shape

    def _shape_of(self, text: str, kinds: tuple[str, ...], first: int) -> Shape | None:
        """Shape of a statement that begins at a token of a text; None if it has to be parsed as it is."""
        shape = self._parts.get(kinds)
        if shape is None:
            taken = literal_aggregates(kinds)
            kept = _kept(len(kinds), taken)
            if len(kept) == len(kinds):
                return None
            shape = self._laid(self._without(text, first, kept), kinds, kept, dict(taken))
            if len(kinds) <= _LARGEST_KEPT:
                self._parts[kinds] = shape
        return shape

    def _without(self, text: str, first: int, kept: list[int]) -> Shape:
        """Shape of a statement of which only some tokens are kept."""
        wanted = {first + position for position in kept}
        tokens = (token for match in self._words.finditer(text) if self._kinds[token := match.group()])
        words = [token for position, token in enumerate(tokens) if position in wanted]
        return super()._shape(" ".join(words), list(map(self._kinds.__getitem__, words)), 0, len(words) - 1)

    def _laid(self, short: Shape, kinds: tuple[str, ...], kept: list[int], taken: dict[int, int]) -> Shape:
        """Shape of a statement from that of what is kept of it."""
        if short.tree is None:
            fault = None if short.fault is None else kept[short.fault]
            return Shape(OPAQUE, None, short.reason, short.lexicon, kinds, fault)
        tree = _lay(short.tree, kept, taken, kinds)
        return Shape(tree.kind, tree, "", short.lexicon, kinds)


def literal_aggregates(kinds: Sequence[str]) -> list[Span]:
    """First and last tokens of all aggregates that hold nothing but literals and are within no other such."""
    found: list[Span] = []
    at = 0
    while at < len(kinds):
        last = _literal_end(kinds, at) if kinds[at] == "[" else None
        if last is not None:
            found.append((at, last))
            at = last
        at += 1
    return found


def _literal_end(kinds: Sequence[str], first: int) -> int | None:
    """Index of the bracket that closes an aggregate, None if it holds anything but literals."""
    depth = 0
    before = ","
    for position in range(first, len(kinds)):
        kind = kinds[position]
        if kind == "[":
            depth += 1
            fits = before in (",", "[") and depth <= _DEEPEST
        elif kind in _LITERALS:
            fits = before in (",", "[") or (before in _SIGNS and kind == "0")
        elif kind in _SIGNS:
            fits = before in (",", "[")
        elif kind == ",":
            fits = before in _LITERALS or before == "]"
        elif kind == "]":
            fits = before in _LITERALS or before in ("[", "]")
            depth -= 1
            if fits and depth == 0:
                return position
        else:
            fits = False
        if not fits:
            return None
        before = kind
    return None


def _kept(count: int, taken: list[Span]) -> list[int]:
    """Positions of the tokens that are left when only the brackets of these aggregates are."""
    kept: list[int] = []
    at = 0
    for first, last in taken:
        kept += [*range(at, first + 1), last]
        at = last + 1
    return [*kept, *range(at, count)]


def _lay(tree: Branch, kept: list[int], taken: dict[int, int], kinds: tuple[str, ...]) -> Branch:
    """Lay the tree of the short statement over the tokens of the whole one."""
    if tree.first < 0:
        return tree
    first, last = kept[tree.first], kept[tree.last]
    if tree.kind == "aggregate" and taken.get(first) == last:
        return Rows.over(kinds, first, last) if last - first > _LARGE else _aggregate(kinds, first)[0]
    children = tuple(
        _lay(child, kept, taken, kinds) if isinstance(child, Branch) else Leaf(kept[child.position], child.type)
        for child in tree.children
    )
    return Branch(tree.kind, children, first, last)


def _aggregate(kinds: Sequence[str], first: int) -> tuple[Branch, int]:
    """Tree of a literal aggregate, and the position after it."""
    children: list[Branch | Leaf] = []
    at = first + 1
    while kinds[at] != "]":
        if kinds[at] == ",":
            at += 1
        child, at = _value(kinds, at)
        children.append(child)
    return Branch("aggregate", tuple(children), first, at), at + 1


def _value(kinds: Sequence[str], at: int) -> tuple[Branch, int]:
    kind = kinds[at]
    if kind == "[":
        return _aggregate(kinds, at)
    if kind in _SIGNS:
        inner, after = _value(kinds, at + 1)
        return Branch("signed", (Leaf(at, "SIGN"), inner), at, inner.last), after
    rule, terminal = _LITERALS[kind]
    return Branch(rule, (Leaf(at, terminal),), at, at), at + 1
