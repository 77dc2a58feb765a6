"""Statements as they stand in a file: spans of the text and, on demand, a tree over them.

Thousands of statements of a program differ only in numbers, names and strings. They share one `Shape`, which holds the
tree once with token positions in place of text; a `Node` is that tree laid over one statement's own tokens. A shape
also makes one pattern from its tokens, so that a single match finds the place of every token, or of every number.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from operator import itemgetter
from typing import Any, NamedTuple

from respot.source import Span

#: Kind of a statement that no rule of the grammar knows.
OPAQUE = "opaque"
#: A statement of more tokens is searched token by token, and so are the first few statements of a shape: making a
#: pattern costs as much as some hundred searches.
_MOST_GROUPS = 500
_RARE = 20


class Leaf(NamedTuple):
    """A token of a tree: its position among the statement's tokens and its terminal's name."""

    position: int
    type: str


class Branch(NamedTuple):
    """A rule of a tree over the tokens ``first`` to ``last`` (-1 where it covers none)."""

    kind: str
    children: tuple[Branch | Leaf, ...]
    first: int
    last: int


class Numbers(NamedTuple):
    """Every number literal of a statement, in the order of the text, with the sign that stands before it.

    Parameters
    ----------
    names : tuple of str
        Name of the member it is the value of, in upper case, within nested aggregates with dots: ``CM.X``; empty for a
        number that is no member's value.
    texts : tuple of str
        As written; blanks may stand after a sign.
    spans : tuple of Span
        Places in the file.
    """

    names: tuple[str, ...]
    texts: tuple[str, ...]
    spans: tuple[Span, ...]

    @property
    def values(self) -> list[float]:
        """The numbers themselves."""
        try:
            return list(map(float, self.texts))
        except ValueError:
            return [number(text) for text in self.texts]


def number(text: str) -> float:
    """Value of a number as programs write it: several signs, blanks after them, a base as in ``0x1F``."""
    kept = "".join(text.split()).replace("\x1a", "")
    digits = kept.lstrip("+-")
    try:
        value = float(digits)
    except ValueError:
        value = float(int(digits, 0))
    return -value if kept.count("-", 0, len(kept) - len(digits)) % 2 else value


@dataclass(frozen=True)
class Lexicon:
    """How the tokens of a language look.

    Parameters
    ----------
    token : re.Pattern
        Finds every token; group 1 is a comment and the only group that is ever set.
    gap : str
        Pattern of what may stand between two tokens of a statement.
    classes : mapping of str to str
        Kind of a token, such as ``0`` for a number, and the pattern of its tokens.
    words : str
        Pattern of a token whose kind is a word.
    flags : int
        Flags of all these patterns.
    """

    token: re.Pattern[str]
    gap: str
    classes: dict[str, str]
    words: str
    flags: int

    def pattern_of(self, kind: str) -> str:
        """Pattern of the tokens of a kind."""
        found = self.classes.get(kind)
        if found is not None:
            return found
        return self.words if kind[0].isalpha() or kind[0] in "_$" else re.escape(kind)


class Shape:
    """What all statements of one shape share.

    Parameters
    ----------
    kind : str
        Rule of the grammar, or `OPAQUE`.
    tree : Branch or None
        None for an opaque statement and for a line without a tree, such as a comment.
    reason : str
        Why the statement is opaque.
    lexicon : Lexicon
        Tokens of the language.
    kinds : tuple of str
        Kinds of the tokens; empty where they are not known.
    fault : int or None
        Position of the token that the grammar does not expect; None if it is the end that comes too early.
    """

    def __init__(
        self,
        kind: str,
        tree: Branch | None,
        reason: str,
        lexicon: Lexicon,
        kinds: tuple[str, ...] = (),
        fault: int | None = None,
    ) -> None:
        self.kind = kind
        self.tree = tree
        self.reason = reason
        self.lexicon = lexicon
        self.kinds = kinds
        self.fault = fault
        self._used = 0
        self._names: dict[tuple[str, ...], tuple[str, ...]] = {}
        self._branches_of: dict[tuple[str, ...], tuple[Branch, ...]] = {}

    def branches(self, kinds: tuple[str, ...]) -> tuple[Branch, ...]:
        """Every rule of these kinds in the tree, from the left; looked for once for all statements of the shape."""
        found = self._branches_of.get(kinds)
        if found is None:
            found = tuple(branch for branch in _walk(self.tree) if branch.kind in kinds)
            self._branches_of[kinds] = found
        return found

    def spans(self, text: str, start: int, end: int) -> list[Span]:
        """Spans of the tokens of a statement of this shape."""
        if self._used > _RARE:
            match = None if self._pattern is None else self._pattern.match(text, start, end)
            if match is not None:
                return list(match.regs[1:])
        self._used += 1
        found = self.lexicon.token.finditer(text, start, end)
        return [match.span() for match in found if match.lastindex is None]

    def numbers(self, text: str, start: int, end: int) -> Numbers:
        """Numbers of a statement of this shape."""
        places = self._places
        if not places.numbers:
            return _NO_NUMBERS
        pattern = self._number_pattern if self._used > _RARE else None
        match = None if pattern is None else pattern.match(text, start, end)
        if match is None:
            return self._numbers_by_token(text, start, end)
        groups = match.groups()
        return Numbers(
            self._keys(places.pick_names(groups)), places.pick_numbers(groups), places.pick_spans(match.regs)
        )

    @cached_property
    def _pattern(self) -> re.Pattern[str] | None:
        """One group for each token."""
        if not 0 < len(self.kinds) <= _MOST_GROUPS:
            return None
        tokens = (f"({self.lexicon.pattern_of(kind)})" for kind in self.kinds)
        return re.compile(self.lexicon.gap.join(tokens), self.lexicon.flags)

    @cached_property
    def _places(self) -> _Places:
        return _Places(self.tree)

    @cached_property
    def _number_pattern(self) -> re.Pattern[str] | None:
        """One group for each number with its sign and for each name of a member."""
        if not 0 < len(self.kinds) <= _MOST_GROUPS:
            return None
        tokens = [self.lexicon.pattern_of(kind) for kind in self.kinds]
        for name in self._places.names:
            tokens[name] = f"({tokens[name]})"
        for _, first, last in self._places.numbers:
            tokens[first] = f"({tokens[first]}"
            tokens[last] = f"{tokens[last]})"
        return re.compile(self.lexicon.gap.join(tokens), self.lexicon.flags)

    def _keys(self, names: tuple[str, ...]) -> tuple[str, ...]:
        """Names of the numbers, from the names of the members as they are written."""
        try:
            return self._names[names]
        except KeyError:
            pass
        upper = dict(zip(self._places.names, (name.upper() for name in names), strict=True))
        keys = tuple(".".join(upper[name] for name in path) for path, _, _ in self._places.numbers)
        if len(self._names) < _MOST_GROUPS:
            self._names[names] = keys
        return keys

    def _numbers_by_token(self, text: str, start: int, end: int) -> Numbers:
        tokens = self.spans(text, start, end)
        names = tuple(text[slice(*tokens[name])] for name in self._places.names)
        spans = tuple((tokens[first][0], tokens[last][1]) for _, first, last in self._places.numbers)
        return Numbers(self._keys(names), tuple(text[slice(*span)] for span in spans), spans)


def _walk(branch: Branch | None) -> Iterator[Branch]:
    """Yield a rule and every rule below it, from the left."""
    waiting = [] if branch is None else [branch]
    while waiting:
        found = waiting.pop()
        yield found
        waiting += [child for child in reversed(found.children) if isinstance(child, Branch)]


class _Places:
    """Where the numbers of a tree are, and the names of the members they belong to."""

    def __init__(self, tree: Branch | None) -> None:
        #: For each number: the positions of its members' names, outermost first, and its first and last token.
        self.numbers: list[tuple[tuple[int, ...], int, int]] = []
        if tree is not None:
            self._find(tree, ())
        #: Positions of the names, in order.
        self.names = sorted({name for path, _, _ in self.numbers for name in path})
        order = sorted([*self.names, *(first for _, first, _ in self.numbers)])
        group = {position: index for index, position in enumerate(order)}
        numbers = [group[first] for _, first, _ in self.numbers]
        self.pick_names: Callable[[tuple[str, ...]], tuple[str, ...]] = _picker([group[name] for name in self.names])
        self.pick_numbers: Callable[[tuple[str, ...]], tuple[str, ...]] = _picker(numbers)
        self.pick_spans: Callable[[tuple[Span, ...]], tuple[Span, ...]] = _picker([index + 1 for index in numbers])

    def _find(self, branch: Branch, path: tuple[int, ...]) -> None:
        if branch.kind == "number" or (branch.kind == "signed" and _is_number(branch)):
            self.numbers.append((path, branch.first, branch.last))
            return
        for child in branch.children:
            if not isinstance(child, Branch):
                continue
            if branch.kind == "member":
                value = child is branch.children[-1] and child.kind in ("number", "signed", "aggregate")
                name = branch.children[0]
                self._find(child, (*path, name.position) if value and isinstance(name, Leaf) else ())
            else:
                self._find(child, path if branch.kind == "aggregate" and child.kind == "member" else ())


def _is_number(branch: Branch) -> bool:
    """Whether nothing but signs stands around a number."""
    last = branch.children[-1]
    return isinstance(last, Branch) and (last.kind == "number" or (last.kind == "signed" and _is_number(last)))


def _picker(positions: list[int]) -> Callable[[tuple[Any, ...]], tuple[Any, ...]]:
    """Return a function that takes the items at these positions of a tuple, at C speed."""
    if not positions:
        return lambda _: ()
    step = positions[1] - positions[0] if len(positions) > 1 else 1
    if positions == list(range(positions[0], positions[-1] + 1, step)):
        return itemgetter(slice(positions[0], positions[-1] + 1, step))
    return itemgetter(*positions)


_NO_NUMBERS = Numbers((), (), ())


class Statement:
    """One statement of a file.

    Parameters
    ----------
    text : str
        Text of the whole file.
    start, end : int
        Span of the statement without its line end; a trailing comment may lie within.
    line : int
        Line it begins on, from 1.
    shape : Shape
        Its shape.
    """

    __slots__ = ("end", "line", "shape", "start", "text")

    def __init__(self, text: str, start: int, end: int, line: int, shape: Shape) -> None:
        self.text = text
        self.start = start
        self.end = end
        self.line = line
        self.shape = shape

    @property
    def kind(self) -> str:
        """Rule of the grammar, or `OPAQUE`."""
        return self.shape.kind

    @property
    def source(self) -> str:
        """The statement as written."""
        return self.text[self.start : self.end]

    def tokens(self) -> list[Span]:
        """Spans of the tokens in the file; comments are left out."""
        return self.shape.spans(self.text, self.start, self.end)

    def numbers(self) -> Numbers:
        """Every number literal with its place; none for an opaque statement.

        This is the quick way to the fields of a point: one match, no tree.
        """
        return self.shape.numbers(self.text, self.start, self.end)

    @property
    def fault(self) -> Span:
        """Place of the token that makes the statement opaque; the whole statement where it is not known."""
        if self.shape.fault is None:
            return (self.start, self.end)
        tokens = self.tokens()
        return tokens[self.shape.fault] if self.shape.fault < len(tokens) else (self.start, self.end)

    @property
    def node(self) -> Node:
        """The statement's tree.

        Raises
        ------
        ValueError
            The statement is opaque.
        """
        if self.shape.tree is None:
            raise ValueError(f"line {self.line} is {self.kind}: {self.shape.reason or 'it has no tree'}")
        return Node(self.text, self.tokens(), self.shape.tree)

    def find(self, *kinds: str) -> list[Node]:
        """Every rule of these kinds in the statement's tree, from the left; none for an opaque statement.

        A statement of a shape that has none costs a look into a table: no token of it is searched.
        """
        branches = self.shape.branches(kinds)
        if not branches:
            return []
        spans = self.tokens()
        return [Node(self.text, spans, branch) for branch in branches]

    def __repr__(self) -> str:
        return f"<{self.kind} line {self.line}: {self.source!r}>"


class Token(NamedTuple):
    """A named token of a tree."""

    type: str
    text: str
    span: Span


class Node:
    """A rule of the grammar laid over the text."""

    __slots__ = ("_branch", "_spans", "_text")

    def __init__(self, text: str, spans: list[Span], branch: Branch) -> None:
        self._text = text
        self._spans = spans
        self._branch = branch

    @property
    def kind(self) -> str:
        """Name of the rule."""
        return self._branch.kind

    @property
    def branch(self) -> Branch:
        """The rule in the tree that all statements of its shape share."""
        return self._branch

    @property
    def source(self) -> str:
        """Text of the whole file."""
        return self._text

    @property
    def token_spans(self) -> list[Span]:
        """Spans of the tokens of the whole statement: what the positions in `branch` count."""
        return self._spans

    @property
    def span(self) -> Span:
        """Place in the file, from the first to the last token; (0, 0) where the rule is empty."""
        if self._branch.first < 0:
            return (0, 0)
        return self._spans[self._branch.first][0], self._spans[self._branch.last][1]

    @property
    def text(self) -> str:
        """The text under the rule, gaps included."""
        start, end = self.span
        return self._text[start:end]

    @property
    def children(self) -> list[Node | Token]:
        """Rules and named tokens below, in order."""
        return [self._child(child) for child in self._branch.children]

    @property
    def nodes(self) -> list[Node]:
        """The rules below, in order."""
        return [Node(self._text, self._spans, child) for child in self._branch.children if isinstance(child, Branch)]

    def tokens(self, kind: str | None = None) -> list[Token]:
        """Return the named tokens directly below, of one terminal if given."""
        leaves = (child for child in self._branch.children if isinstance(child, Leaf))
        return [self._token(leaf) for leaf in leaves if kind is None or leaf.type == kind]

    def all(self, *kinds: str) -> list[Node]:
        """Rules of these kinds directly below."""
        return [
            Node(self._text, self._spans, child)
            for child in self._branch.children
            if isinstance(child, Branch) and child.kind in kinds
        ]

    def first(self, *kinds: str) -> Node | None:
        """First rule of these kinds directly below, or None."""
        for child in self._branch.children:
            if isinstance(child, Branch) and child.kind in kinds:
                return Node(self._text, self._spans, child)
        return None

    def walk(self) -> Iterator[Node]:
        """Yield this rule and every rule below it, from the left."""
        for branch in _walk(self._branch):
            yield Node(self._text, self._spans, branch)

    def _child(self, child: Branch | Leaf) -> Node | Token:
        return Node(self._text, self._spans, child) if isinstance(child, Branch) else self._token(child)

    def _token(self, leaf: Leaf) -> Token:
        start, end = self._spans[leaf.position]
        return Token(leaf.type, self._text[start:end], (start, end))

    def __repr__(self) -> str:
        return f"<{self.kind} {self.text!r}>"
