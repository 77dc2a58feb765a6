"""One fine Lark grammar a language, parsed once per shape of statement.

Public KRL has 228,000 lines but 9,000 shapes (DESIGN section 4). A piece of text is looked up under two keys: first
with every run of digits replaced by one, which a single substitution does for a whole file and which finds the rows of
a point table; then by its token kinds, where names that are no keywords, numbers and strings stand for each other. Only
a shape that neither key knows goes through Lark. The tree keeps token positions, so that any statement of the shape can
lay it over its own text.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from operator import itemgetter, sub
from typing import Generic, TypeVar

from lark import Lark, Token, Tree
from lark.exceptions import UnexpectedCharacters, UnexpectedInput, UnexpectedToken

from respot.program.statement import OPAQUE, Branch, Leaf, Lexicon, Shape
from respot.resources import resource
from respot.source import Span

#: A longer statement is kept as it is: no hand wrote it, and one line may not stall the reader.
LONGEST_STATEMENT = 64 * 1024
#: Entries of each cache, and characters of their keys; a backup of a whole line stays far below.
MOST_SHAPES = 50_000
MOST_CHARACTERS = 16_000_000
#: Deeper nesting is kept as it is: trees are walked by recursion.
DEEPEST_NESTING = 100
DEEPEST_TREE = 250
#: Longer tokens are strings, whose kind is not worth keeping.
_LONGEST_WORD = 40

#: Numbers with a base are one run: ``0b12`` is two tokens, ``0b11`` one.
_DIGITS = re.compile(r"0[xX][0-9A-Fa-f]+|0[oO][0-7]+|0[bB][01]+|[0-9]+")
_PLAIN_DIGITS = re.compile(r"[0-9]+")
#: Characters of a text whose digits are replaced at once.
_PIECE = 256 * 1024
#: A line with its end, as `respot.source.NEWLINE` cuts them.
_LINE = re.compile(r"[^\r\n]*(?:\r*\n|\r)|[^\r\n]+\Z")

#: Terminals that hold no word of the language's own.
_NO_WORDS = frozenset(("NAME", "COMMENT", "STRING"))
#: Names of the groups of a token pattern whose tokens stand for each other, and their kinds.
_CLASSES = {"name": "a", "number": "0", "string": '"'}
#: Kind of a quote that no other closes: it must not pass for a string.
_OPEN_STRING = '"?'
_QUOTE = '"'


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

_T = TypeVar("_T")


class Cache(dict[str, _T], Generic[_T]):
    """A dictionary that is emptied before it grows too large."""

    def __init__(self) -> None:
        super().__init__()
        self._characters = 0

    def keep(self, key: str, value: _T) -> None:
        """Store a value unless its key is very long."""
        if len(key) > LONGEST_STATEMENT // 8:
            return
        if len(self) >= MOST_SHAPES or self._characters > MOST_CHARACTERS:
            self.clear()
            self._characters = 0
        self._characters += len(key)
        self[key] = value


class _Kinds(dict[str, str]):
    """Kind of every token met so far: most tokens of a program are met again and again."""

    def __init__(self, kind: Callable[[str], str]) -> None:
        super().__init__()
        self._kind = kind

    def __missing__(self, token: str) -> str:
        kind = self._kind(token)
        if kind and len(token) <= _LONGEST_WORD:
            if len(self) >= MOST_SHAPES:
                self.clear()
            self[token] = kind
        return kind


class Shapes:
    """The shapes of one language.

    Parameters
    ----------
    grammar : str
        Name of the grammar file, e.g. ``"krl"``.
    start : str
        Start rule of one statement.
    token : re.Pattern
        Finds every token. The group ``comment``, which comes first, is a comment; the groups ``number``, ``name`` and
        ``string`` and any further named group hold tokens that stand for each other; any other match is a literal. A
        test holds it equal to Lark's own lexer.
    split : Splitter
        Cuts a unit into statements.
    """

    def __init__(self, grammar: str, start: str, token: re.Pattern[str], split: Splitter) -> None:
        self._grammar = grammar
        self._start = start
        self.token = token
        self._split = split
        self._digits = _DIGITS if re.search(r"0\[xX\]", token.pattern) else _PLAIN_DIGITS
        self._units: Cache[Unit] = Cache()
        self._parts: dict[tuple[str, ...], Shape] = {}
        self._lexicon = _lexicon(token)
        self._words = re.compile(_without_groups(token.pattern), token.flags)
        self._kinds = _Kinds(self._kind)

    @cached_property
    def lark(self) -> Lark:
        """The plain grammar; the reference against which the shapes are tested."""
        return Lark(self._text, parser="lalr", start=[self._start, "file"], propagate_positions=True)

    @cached_property
    def _text(self) -> str:
        return resource("grammars", f"{self._grammar}.lark").read_text(encoding="utf-8")

    @cached_property
    def _parser(self) -> _Parser:
        return _Parser(self._text, self._start)

    @cached_property
    def _keyword(self) -> re.Pattern[str]:
        """Finds the names that are a terminal of their own somewhere in the grammar."""
        patterns = [term.pattern.to_regexp() for term in self._parser.lark.terminals if term.name not in _NO_WORDS]
        return re.compile("|".join(patterns))

    def keys(self, text: str, line_starts: list[int] | None = None) -> list[str]:
        """Every line of a file, with its end, every run of digits replaced by one.

        Lines with the same key have the same tokens at the same place from either end, apart from the digits. A line
        that is too long to be a statement is its own key.
        """
        if line_starts is None:
            longest = max(map(len, _LINE.findall(text)), default=0)
        else:
            longest = max(map(sub, [*line_starts[1:], len(text)], line_starts))
        if longest > LONGEST_STATEMENT:
            lines = _LINE.findall(text)
            return [line if len(line) > LONGEST_STATEMENT else self._digits.sub("0", line) for line in lines]
        keys: list[str] = []
        start = 0
        while start < len(text):  # in pieces: a substitution holds all that it has found until its end
            end = text.find("\n", start + _PIECE) + 1 or len(text)
            keys += _LINE.findall(self._digits.sub("0", text[start:end]))
            start = end
        return keys

    def unit(self, text: str, key: str | None = None) -> Unit:
        """Statements of a run of lines without its last line end; None if it ends inside a statement.

        Parameters
        ----------
        text : str
            The lines.
        key : str, optional
            Their key, where it is known from `keys`.
        """
        if key is None:
            key = self._digits.sub("0", text)
        try:
            return self._units[key]
        except KeyError:
            pass
        unit = self.read(text)
        self._units.keep(key, unit)
        return unit

    def read(self, text: str) -> Unit:
        """Statements of a run of lines, looked up by their kinds alone."""
        kinds = list(map(self._kinds.__getitem__, self._words.findall(text)))
        if "" in kinds:
            kinds = [kind for kind in kinds if kind]
        ranges = self._split(kinds)
        if ranges is None:
            return None
        return tuple(Part(first, last, self._shape(text, kinds, first, last)) for first, last in ranges)

    def opaque(self, reason: str) -> Shape:
        """Shape of a statement that is kept as it is."""
        return Shape(OPAQUE, None, reason, self._lexicon)

    def plain(self, kind: str) -> Shape:
        """Shape of a line that has no tree, such as a comment."""
        return Shape(kind, None, "", self._lexicon)

    def kinds(self, text: str) -> tuple[list[str], list[Span]]:
        """Kinds and spans of the tokens of a text, comments left out.

        A kind is ``0`` for a number, ``a`` for a name, ``"`` for a string, and the name of the group for any other
        named group of the token pattern; keywords and literals stand for themselves, in upper case.
        """
        kinds: list[str] = []
        spans: list[Span] = []
        for match in self._words.finditer(text):
            kind = self._kinds[match.group()]
            if kind:
                kinds.append(kind)
                spans.append(match.span())
        return kinds, spans

    def _kind(self, token: str) -> str:
        """Kind of a token, empty for a comment."""
        match = self.token.fullmatch(token)
        group = None if match is None else match.lastgroup
        if group == "comment":
            return ""
        if group is None and token == _QUOTE:
            return _OPEN_STRING
        if group is None or (group == "name" and self._keyword.fullmatch(token)):
            return token.upper()
        return _CLASSES.get(group, group)

    def _shape(self, text: str, kinds: list[str], first: int, last: int) -> Shape:
        key = tuple(kinds[first : last + 1])
        shape = self._parts.get(key)
        if shape is None:
            _, spans = self.kinds(text)
            base = spans[first][0]
            own = [(start - base, end - base) for start, end in spans[first : last + 1]]
            shape = self._parse(text[base : spans[last][1]], own, key)
            if len(self._parts) >= MOST_SHAPES:
                self._parts.clear()
            self._parts[key] = shape
        return shape

    def _parse(self, text: str, spans: list[Span], kinds: tuple[str, ...]) -> Shape:
        if len(text) > LONGEST_STATEMENT:
            return self.opaque(f"longer than {LONGEST_STATEMENT // 1024} kB")
        if _nesting(kinds) > DEEPEST_NESTING:
            return self.opaque(f"nested deeper than {DEEPEST_NESTING}")
        try:
            branch = self._parser.parse(text, spans)
        except UnexpectedInput as error:
            fault = None if _at_end(error) else _covering(spans, error.pos_in_stream or 0)
            reason = "ends too early" if fault is None else f"{_described(kinds, fault)} is not expected here"
            return Shape(OPAQUE, None, reason, self._lexicon, kinds, fault)
        except KeyError:  # a grammar whose words may run together, as in STEP5
            return Shape(OPAQUE, None, "two words run together", self._lexicon, kinds)
        if branch is None:
            return self.opaque(f"a tree deeper than {DEEPEST_TREE}")
        return Shape(branch.kind, branch, "", self._lexicon, kinds)


class _Parser:
    """The grammar, made to give trees over token positions quickly.

    Lark's own propagation of positions costs more than the parsing. Here the tree keeps every token, so that first and
    last of a rule are known, and those that the plain tree leaves out are dropped afterwards.
    """

    def __init__(self, grammar: str, start: str) -> None:
        self.lark = Lark(grammar, parser="lalr", start=start, propagate_positions=False, keep_all_tokens=True)
        self._kept = frozenset(re.findall(r"^([A-Z]\w*)(?:\.\d+)?:", grammar, re.MULTILINE))

    def parse(self, text: str, spans: list[Span]) -> Branch | None:
        """Tree of a statement; None if it is too deep to be walked by recursion.

        Raises
        ------
        UnexpectedInput
            The grammar does not know the statement.
        KeyError
            The grammar cuts the text into other tokens.
        """
        positions = {start: position for position, (start, _) in enumerate(spans)}
        return self._branch(self.lark.parse(text), positions, 0)

    def _branch(self, tree: Tree[Token], positions: dict[int, int], depth: int) -> Branch | None:
        if depth > DEEPEST_TREE:
            return None
        children: list[Branch | Leaf] = []
        first = last = -1
        for child in tree.children:
            if isinstance(child, Tree):
                below = self._branch(child, positions, depth + 1)
                if below is None:
                    return None
                children.append(below)
                begin, end = below.first, below.last
            elif child is None:
                continue
            else:
                begin = end = positions[child.start_pos or 0]
                if child.type in self._kept:
                    # a terminal X_NAME is a name that the grammar must know where it stands
                    children.append(Leaf(begin, "NAME" if child.type.endswith("_NAME") else child.type))
            first = begin if first < 0 else first
            last = max(last, end)
        return Branch(str(tree.data), tuple(children), first, last)


def _nesting(kinds: tuple[str, ...]) -> int:
    deepest = depth = 0
    for kind in kinds:
        if kind in "([{":
            depth += 1
            deepest = max(deepest, depth)
        elif kind in ")]}":
            depth -= 1
    return deepest


def _at_end(error: UnexpectedInput) -> bool:
    if isinstance(error, UnexpectedCharacters):
        return False
    return not isinstance(error, UnexpectedToken) or error.token.type == "$END"


def _covering(spans: list[Span], offset: int) -> int:
    """Position of the token at an offset, or before it."""
    return max(0, bisect_right(spans, offset, key=itemgetter(0)) - 1)


def _described(kinds: tuple[str, ...], position: int | None) -> str:
    """Name a token that all statements of a shape share: a reason must fit each of them."""
    if position is None:
        return "a character"
    kind = kinds[position]
    described = {"a": "a name", "0": "a number", '"': "a string", _OPEN_STRING: "a string without an end"}
    return described.get(kind, kind if kind.islower() else repr(kind))


def _lexicon(token: re.Pattern[str]) -> Lexicon:
    groups = {name: _group(token.pattern, name) for name in token.groupindex}
    comment = groups.pop("comment")
    classes = {_CLASSES.get(name, name): f"(?:{pattern})" for name, pattern in groups.items()}
    gap = rf"[\s\x1a\xa0\ufeff]*(?:{comment}[\s\x1a\xa0\ufeff]*)*"
    return Lexicon(
        re.compile(_without_groups(token.pattern, "comment"), token.flags),
        gap,
        classes,
        f"(?:{groups['name']})",
        token.flags,
    )


def _without_groups(pattern: str, kept: str = " ") -> str:
    return re.sub(rf"\(\?P<(?!{kept}>)\w+>", "(?:", pattern)


def _group(pattern: str, name: str) -> str:
    """Text of a named group of a verbose pattern."""
    start = pattern.index(f"(?P<{name}>") + len(f"(?P<{name}>")
    depth, position, in_set = 1, start, False
    while depth:
        character = pattern[position]
        if character == "\\":
            position += 1
        elif in_set:
            in_set = character != "]"
        elif character == "[":
            in_set = True
        else:
            depth += {"(": 1, ")": -1}.get(character, 0)
        position += 1
    return pattern[start : position - 1]
