"""Statements as they stand in a file: spans of the text and, on demand, a tree over them.

Thousands of statements of a program differ only in numbers, names and strings. They share one `Shape`, which holds the
tree once with token positions in place of text; a `Node` is that tree laid over one statement's own tokens.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

from respot.source import Span

#: Kind of a statement that no rule of the grammar knows.
OPAQUE = "opaque"


class Leaf(NamedTuple):
    """A token of a tree: its position among the statement's tokens and its terminal's name."""

    index: int
    type: str


class Branch(NamedTuple):
    """A rule of a tree over the tokens ``first`` to ``last`` (-1 where it covers none)."""

    kind: str
    children: tuple[Branch | Leaf, ...]
    first: int
    last: int


@dataclass(frozen=True)
class Shape:
    """What all statements of one shape share.

    Parameters
    ----------
    kind : str
        Rule of the grammar, or `OPAQUE`.
    tree : Branch or None
        None for an opaque statement.
    reason : str
        Why the statement is opaque.
    token : re.Pattern
        Token pattern of the language; group 1 is a comment.
    """

    kind: str
    tree: Branch | None
    reason: str
    token: re.Pattern[str]


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
        found = self.shape.token.finditer(self.text, self.start, self.end)
        return [match.span() for match in found if match.lastindex is None]

    @property
    def node(self) -> Node:
        """The statement's tree.

        Raises
        ------
        ValueError
            The statement is opaque.
        """
        if self.shape.tree is None:
            raise ValueError(f"line {self.line} is opaque: {self.shape.reason}")
        return Node(self.text, self.tokens(), self.shape.tree)

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
        return [node for node in self.nodes if node.kind in kinds]

    def first(self, *kinds: str) -> Node | None:
        """First rule of these kinds directly below, or None."""
        return next((node for node in self.nodes if node.kind in kinds), None)

    def walk(self) -> Iterator[Node]:
        """Yield this rule and every rule below it, from the left."""
        yield self
        for node in self.nodes:
            yield from node.walk()

    def _child(self, child: Branch | Leaf) -> Node | Token:
        return Node(self._text, self._spans, child) if isinstance(child, Branch) else self._token(child)

    def _token(self, leaf: Leaf) -> Token:
        start, end = self._spans[leaf.index]
        return Token(leaf.type, self._text[start:end], (start, end))

    def __repr__(self) -> str:
        return f"<{self.kind} {self.text!r}>"
