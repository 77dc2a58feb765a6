"""One fine Lark grammar a language, parsed once per shape of statement.

Public KRL has 228,000 lines but 9,000 shapes (DESIGN section 4). A piece of text is looked up under two keys: first with
every run of digits replaced by one, which costs a single substitution and finds the rows of a point table; then by its
token kinds, where names that are no keywords, numbers and strings stand for each other. Only a shape that neither key
knows goes through Lark. The tree keeps token positions, so that any statement of the shape can lay it over its own text.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

from lark import Lark, Token, Tree
from lark.exceptions import UnexpectedCharacters, UnexpectedEOF, UnexpectedInput, UnexpectedToken

from respot.program.statement import OPAQUE, Branch, Leaf, Shape
from respot.resources import resource
from respot.source import Span

#: A longer statement is kept as it is: no hand wrote it, and one line may not stall the reader.
LONGEST_STATEMENT = 64 * 1024
#: Entries of each key's cache; a backup of a whole line stays far below.
MOST_SHAPES = 50_000
#: Deeper nesting is kept as it is: trees are walked by recursion.
DEEPEST_NESTING = 100

#: Numbers with a base are one run: ``0b12`` is two tokens, ``0b11`` one.
_DIGITS = re.compile(r"0[xX][0-9A-Fa-f]+|0[oO][0-7]+|0[bB][01]+|[0-9]+")


@dataclass(frozen=True)
class Part:
    """One statement within a unit: its token range and its shape."""

    first: int
    last: int
    shape: Shape


#: A unit is the shortest run of lines that holds whole statements: its parts, or None while it is incomplete.
Unit = tuple[Part, ...] | None

#: Cuts a unit's tokens into statements; gets kinds (see `Shapes.kinds`), returns token ranges or None if incomplete.
Splitter = Callable[[list[str]], list[Span] | None]


class Shapes:
    """The shapes of one language.

    Parameters
    ----------
    grammar : str
        Name of the grammar file, e.g. ``"krl"``.
    start : str
        Start rule of one statement.
    token : re.Pattern
        Finds every token; group 1 (unnamed or ``comment``) is a comment, the groups ``number``, ``name`` and ``string``
        follow; any other match is a literal. A test holds it equal to Lark's own lexer.
    split : Splitter
        Cuts a unit into statements.
    """

    def __init__(self, grammar: str, start: str, token: re.Pattern[str], split: Splitter) -> None:
        self._grammar = grammar
        self._start = start
        self.token = token
        self._split = split
        self._units: dict[str, Unit] = {}
        self._parts: dict[tuple[str, ...], Shape] = {}
        self._spans_only = _comment_only(token)

    @cached_property
    def lark(self) -> Lark:
        """The plain grammar; the reference against which the shapes are tested."""
        text = resource("grammars", f"{self._grammar}.lark").read_text(encoding="utf-8")
        return Lark(text, parser="lalr", start=[self._start, "file"], propagate_positions=True, maybe_placeholders=True)

    @cached_property
    def keywords(self) -> frozenset[str]:
        """Every word, in lower case, that the grammar spells out."""
        words: set[str] = set()
        for terminal in self.lark.terminals:
            if terminal.name not in ("NAME", "NUMBER", "STRING", "COMMENT", "BITS"):
                words.update(word.lower() for word in re.findall(r"(?<![\\\w])[A-Za-z_]\w*", terminal.pattern.value))
        return frozenset(words)

    def unit(self, text: str) -> Unit:
        """Statements of a run of lines without its last line end; None if it ends inside a statement."""
        key = _DIGITS.sub("0", text)
        try:
            return self._units[key]
        except KeyError:
            pass
        unit = self._read(text)
        if len(self._units) >= MOST_SHAPES:
            self._units.clear()
        if len(key) <= LONGEST_STATEMENT:
            self._units[key] = unit
        return unit

    def opaque(self, reason: str) -> Shape:
        """Shape of a statement that is kept as it is."""
        return Shape(OPAQUE, None, reason, self._spans_only)

    def plain(self, kind: str) -> Shape:
        """Shape of a line that has no tree, such as a comment."""
        return Shape(kind, None, "", self._spans_only)

    def _read(self, text: str) -> Unit:
        kinds, spans = self.kinds(text)
        ranges = self._split(kinds)
        if ranges is None:
            return None
        return tuple(Part(first, last, self._shape(text, kinds, spans, first, last)) for first, last in ranges)

    def kinds(self, text: str) -> tuple[list[str], list[Span]]:
        """Kinds and spans of the tokens of a text, comments left out.

        A kind is ``0`` for a number, ``a`` for a name, ``"`` for a string; keywords and literals stand for themselves,
        in upper case.
        """
        kinds: list[str] = []
        spans: list[Span] = []
        keywords = self.keywords
        for match in self.token.finditer(text):
            group = match.lastgroup
            if group == "comment":
                continue
            if group == "name":
                word = match.group()
                kinds.append(word.upper() if word.lower() in keywords else "a")
            elif group == "number":
                kinds.append("0")
            elif group == "string":
                kinds.append('"')
            else:
                kinds.append(match.group().upper())
            spans.append(match.span())
        return kinds, spans

    def _shape(self, text: str, kinds: list[str], spans: list[Span], first: int, last: int) -> Shape:
        key = tuple(kinds[first : last + 1])
        shape = self._parts.get(key)
        if shape is None:
            base = spans[first][0]
            own = [(start - base, end - base) for start, end in spans[first : last + 1]]
            shape = self._parse(text[base : spans[last][1]], own)
            if len(self._parts) >= MOST_SHAPES:
                self._parts.clear()
            self._parts[key] = shape
        return shape

    def _parse(self, text: str, spans: list[Span]) -> Shape:
        if len(text) > LONGEST_STATEMENT:
            return self.opaque(f"longer than {LONGEST_STATEMENT // 1024} kB")
        if _nesting(text) > DEEPEST_NESTING:
            return self.opaque(f"nested deeper than {DEEPEST_NESTING}")
        try:
            tree = self.lark.parse(text, start=self._start)
        except UnexpectedInput as error:
            return self.opaque(_reason(error))
        starts = {start: index for index, (start, _) in enumerate(spans)}
        ends = {end: index for index, (_, end) in enumerate(spans)}
        try:
            branch = _branch(tree, starts, ends)
        except RecursionError:
            return self.opaque("an expression of too many terms")
        return Shape(branch.kind, branch, "", self._spans_only)


def _branch(tree: Tree[Token], starts: dict[int, int], ends: dict[int, int]) -> Branch:
    children: list[Branch | Leaf] = []
    for child in tree.children:
        if isinstance(child, Tree):
            children.append(_branch(child, starts, ends))
        elif child is not None:
            assert child.start_pos is not None
            children.append(Leaf(starts[child.start_pos], child.type))
    if tree.meta.empty:
        return Branch(str(tree.data), tuple(children), -1, -1)
    return Branch(str(tree.data), tuple(children), starts[tree.meta.start_pos], ends[tree.meta.end_pos])


def _nesting(text: str) -> int:
    deepest = depth = 0
    for character in text:
        if character in "([{":
            depth += 1
            deepest = max(deepest, depth)
        elif character in ")]}":
            depth -= 1
    return deepest


def _reason(error: UnexpectedInput) -> str:
    if isinstance(error, UnexpectedCharacters):
        return f"no token begins with {error.char!r}"
    if isinstance(error, UnexpectedToken) and error.token.type != "$END":
        return f"{str(error.token)!r} is not expected here"
    if isinstance(error, UnexpectedEOF | UnexpectedToken):
        return "ends too early"
    return "not understood"


def _comment_only(token: re.Pattern[str]) -> re.Pattern[str]:
    """Token pattern in which only a comment sets a group."""
    pattern = re.sub(r"\(\?P<(?!comment>)\w+>", "(?:", token.pattern)
    return re.compile(pattern, token.flags)
