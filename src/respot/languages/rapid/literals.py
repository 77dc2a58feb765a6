"""Aggregates of literals, which need no parser: a table of robtargets is one statement of ten thousand equal rows.

Arrays of data hold most of the tokens of a backup, and hardly two have the same number of rows. A literal aggregate is
therefore taken out of a statement before its shape is looked up: an empty one stands in its place, and the rows are
laid into the tree afterwards, as the grammar would have built them (a test holds both equal).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property

from respot.languages.shapes import MOST_SHAPES, Part, Shapes, Splitter, Unit
from respot.program.statement import OPAQUE, Branch, Leaf, Lexicon, Numbers, Shape
from respot.source import Span

_LITERALS = {"0": ("number", "NUMBER"), '"': ("string", "STRING"), "TRUE": ("boolean", "BOOLEAN")}
_LITERALS["FALSE"] = _LITERALS["TRUE"]
_SIGNS = ("+", "-")
#: Tokens of an aggregate whose rows are built each time they are asked for: they would fill the memory.
_LARGE = 200
#: Tokens of a statement whose shape is worth keeping: none of a longer table is met again.
_LARGEST_KEPT = 20_000
#: Tokens of a statement for which a pattern with a group for each is made, and how often it must be met for it.
_MOST_GROUPS = 200
_RARE = 60
#: Deeper ones are left to the grammar, which refuses them.
_DEEPEST = 50


class Rows(Branch):
    """An aggregate of literals; its tree is built when it is asked for, and kept unless it is large."""

    _kinds: tuple[str, ...]
    _built: tuple[Branch | Leaf, ...] | None

    @classmethod
    def over(cls, kinds: tuple[str, ...], first: int, last: int) -> Rows:
        """Lay it over the tokens ``first`` to ``last``."""
        rows = cls("aggregate", (), first, last)
        rows._kinds = kinds
        rows._built = None
        return rows

    @property
    def children(self) -> tuple[Branch | Leaf, ...]:
        """The rows."""
        if self._built is not None:
            return self._built
        built = _aggregate(self._kinds, self.first)[0].children
        if self.last - self.first <= _LARGE:
            self._built = built
        return built


class Unsigned:
    """What the shapes have in common that differ in the signs of literals only: a pattern for all of them.

    Ten numbers of a target have a thousand combinations of signs, and a pattern takes milliseconds to make.

    Parameters
    ----------
    shape : LaidShape
        Any of them.
    """

    def __init__(self, shape: LaidShape) -> None:
        self.used = 0
        self._shape = shape
        self._literal = [False] * len(shape.kinds)
        for first, last in shape.taken:
            self._literal[first : last + 1] = [True] * (last + 1 - first)

    @cached_property
    def tokens(self) -> re.Pattern[str]:
        """One group for each token; that of a sign may be empty."""
        lexicon = self._shape.lexicon
        pieces = [f"({lexicon.pattern_of(kind)})" for kind in self._shape.kinds]
        return self._pattern(pieces, rf"(?:([-+]){lexicon.gap})?")

    @cached_property
    def numbers(self) -> re.Pattern[str]:
        """One group for each number with its sign."""
        lexicon = self._shape.lexicon
        pieces = [lexicon.pattern_of(kind) for kind in self._shape.kinds]
        for first, last in self._shape.number_places:
            if not self._literal[last]:
                pieces[first] = f"({pieces[first]}"
                pieces[last] = f"{pieces[last]})"
        return self._pattern(pieces, rf"((?:[-+]{lexicon.gap})?", ")")

    def _pattern(self, pieces: list[str], before: str, after: str = "") -> re.Pattern[str]:
        """Join the patterns of the tokens; any number among literals may have a sign."""
        joined: list[str] = []
        for piece, kind, literal in zip(pieces, self._shape.kinds, self._literal, strict=True):
            if not literal or kind not in (*_SIGNS, "0"):
                joined.append(piece)
            elif kind == "0":
                joined.append(f"{before}{piece}{after}")
        return re.compile(self._shape.lexicon.gap.join(joined), self._shape.lexicon.flags)


class LaidShape(Shape):
    """A shape whose literals did not pass the grammar.

    Parameters
    ----------
    tree : Branch
        Its tree, with `Rows` where the literals are.
    taken : list of Span
        First and last tokens of the literals.
    """

    def __init__(self, tree: Branch, lexicon: Lexicon, kinds: tuple[str, ...], taken: list[Span]) -> None:
        super().__init__(tree.kind, tree, "", lexicon, kinds)
        self.taken = taken
        #: None for a statement too large for patterns.
        self.unsigned: Unsigned | None = None

    @cached_property
    def number_places(self) -> list[Span]:
        """First and last token of every number with its sign."""
        kinds = self.kinds
        places = [] if self.tree is None else list(_outside(self.tree))
        for first, last in self.taken:
            found = (position for position in range(first, last) if kinds[position] == "0")
            places += ((position - (kinds[position - 1] in _SIGNS), position) for position in found)
        return sorted(places)

    def spans(self, text: str, start: int, end: int) -> list[Span]:
        """Spans of the tokens of a statement of this shape."""
        unsigned = self._often()
        if unsigned is not None:
            match = unsigned.tokens.match(text, start, end)
            found = [] if match is None else [span for span in match.regs[1:] if span[0] >= 0]
            if len(found) == len(self.kinds):
                return found
        return self._found(text, start, end)

    def numbers(self, text: str, start: int, end: int) -> Numbers:
        """Numbers of a statement of this shape."""
        unsigned = self._often()
        match = None if unsigned is None else unsigned.numbers.match(text, start, end)
        if match is not None:
            return Numbers(("",) * len(match.groups()), match.groups(), match.regs[1:])
        tokens = self._found(text, start, end)
        spans = tuple((tokens[first][0], tokens[last][1]) for first, last in self.number_places)
        return Numbers(("",) * len(spans), tuple(text[first:last] for first, last in spans), spans)

    def _found(self, text: str, start: int, end: int) -> list[Span]:
        tokens = self.lexicon.token.finditer(text, start, end)
        return [match.span() for match in tokens if match.lastindex is None]

    def _often(self) -> Unsigned | None:
        """Return the common patterns if they are worth making."""
        if self.unsigned is None:
            return None
        self.unsigned.used += 1
        return self.unsigned if self.unsigned.used > _RARE else None


def _outside(branch: Branch) -> Iterator[Span]:
    """First and last tokens of the numbers of a tree that are in no literal aggregate."""
    if isinstance(branch, Rows):
        return
    inner = branch
    while inner.kind == "signed" and isinstance(inner.children[-1], Branch):
        inner = inner.children[-1]
    if inner.kind == "number":
        yield branch.first, branch.last
        return
    for child in branch.children:
        if isinstance(child, Branch):
            yield from _outside(child)


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
        self._unsigned: dict[tuple[str, ...], Unsigned] = {}

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
            if not any(last - first > 1 for first, last in taken):
                return None
            shape = self._laid(text, kinds, first, taken)
            if len(kinds) <= _LARGEST_KEPT:
                self._parts[kinds] = shape
        return shape

    def _laid(self, text: str, kinds: tuple[str, ...], first: int, taken: list[Span]) -> Shape:
        """Shape of a statement from that of what is left of it without the literals."""
        kept = _kept(len(kinds), taken)
        short = self._parts.get(tuple(kinds[position] for position in kept)) or self._without(text, first, kept)
        if short.tree is None:
            fault = None if short.fault is None else kept[short.fault]
            return Shape(OPAQUE, None, short.reason, short.lexicon, kinds, fault)
        tree = _lay(short.tree, kept, dict(taken), kinds)
        shape = LaidShape(tree, short.lexicon, kinds, taken)
        if len(kinds) <= _MOST_GROUPS:
            shape.unsigned = self._unsigned_of(shape)
        return shape

    def _unsigned_of(self, shape: LaidShape) -> Unsigned:
        key: list[str] = []
        at = 0
        for first, last in shape.taken:
            key += shape.kinds[at:first]
            key += (kind for kind in shape.kinds[first : last + 1] if kind not in _SIGNS)
            at = last + 1
        key += shape.kinds[at:]
        if len(self._unsigned) >= MOST_SHAPES:
            self._unsigned.clear()
        return self._unsigned.setdefault(tuple(key), Unsigned(shape))

    def _without(self, text: str, first: int, kept: list[int]) -> Shape:
        """Shape of a statement of which only some tokens are kept."""
        wanted = {first + position for position in kept}
        tokens = (token for match in self._words.finditer(text) if self._kinds[token := match.group()])
        words = [token for position, token in enumerate(tokens) if position in wanted]
        return super()._shape(" ".join(words), list(map(self._kinds.__getitem__, words)), 0, len(words) - 1)


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
        return Rows.over(kinds, first, last)
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
