"""Statements of RAPID: they end with ``;`` or a block word, and may share or span lines.

A line is looked up first as it stands: nearly all hold whole statements. One that does not is joined with the lines
below it until its end is found. The end may be missing, so every line below is first asked whether it can only begin a
statement of its own; then what was joined so far is read as it is, and one broken line costs one statement.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Sequence

from respot.languages.rapid.literals import RapidShapes
from respot.languages.shapes import LONGEST_STATEMENT, Cache, Part, Unit
from respot.program.statement import OPAQUE, Shape, Statement
from respot.source import Span

ENCODINGS = ("latin-1",)

TOKEN = re.compile(
    r"""
      (?P<comment>![^\r\n]*)
    | (?P<name>[^\W\d]\w*)
    | (?P<number>0[xX][0-9A-Fa-f]+|0[oO][0-7]+|0[bB][01]+|(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)
    | (?P<string>"(?:[^"\r\n]|"")*")
    | %%%[^%]*%%%
    | <(?:TDN|DDN|RDN|PAR|ALT|DIM|SMT|VAR|EIT|CSE|EXP|ARG|ID)>
    | := | <> | <= | >=
    | [^\s\x1a\ufeff]
    """,
    re.VERBOSE | re.IGNORECASE,
)

#: A declaration is read up to this length: a program generator may write ten thousand targets in one.
LONGEST_TABLE = 4 * 1024 * 1024

COMMENT, AFTER_MODULE = "comment", "after_module"
#: Kinds that count as no statement (INTERFACES, `check`).
NO_STATEMENT = frozenset((COMMENT, AFTER_MODULE))


def _words(words: str) -> frozenset[str]:
    return frozenset(words.split())


def _any_of(words: frozenset[str]) -> str:
    """Pattern of any of these words; placeholders are none."""
    return "|".join(sorted(word for word in words if word.isalpha()))


#: Words that are whole statements.
_WHOLE = _words(
    "ENDMODULE ENDPROC ENDFUNC ENDTRAP ENDRECORD ENDIF ENDFOR ENDWHILE ENDTEST ELSE UNDO BACKWARD"
    " <TDN> <DDN> <RDN> <SMT> <EIT> <CSE>"
)
#: Statements that end with a word of their own.
_ENDS_WITH = {"IF": "THEN", "ELSEIF": "THEN", "FOR": "DO", "WHILE": "DO", "CASE": ":", "DEFAULT": ":"}
_MODIFIERS = _words("LOCAL TASK")
_STORAGE = _words("VAR PERS CONST")
_HEADS = _words("PROC FUNC")
#: Words that begin a simple statement; a compact IF may stand before them.
_JUMPS = _words("RETURN GOTO RAISE EXIT RETRY TRYNEXT CONNECT")
_WHOLE_JUMPS = _words("EXIT RETRY TRYNEXT")
_MAYBE_WHOLE = _WHOLE_JUMPS | {"RETURN", "RAISE"}
#: Words that stand nowhere but at the beginning of a statement.
_FIRST = (
    _WHOLE
    | _JUMPS
    | _words("MODULE PROC FUNC TRAP RECORD ALIAS IF ELSEIF FOR WHILE TEST CASE DEFAULT ERROR CONST LOCAL TASK")
)
_FIRST_IN_SIMPLE = _FIRST | _STORAGE
#: Two names may follow these: a type and what is of it.
_BEFORE_TYPE = _STORAGE | {"ALIAS"}
_BEFORE_NAME = frozenset((".", "TRAP", "RECORD", "MODULE", "GOTO", "FOR"))
_BEFORE_PARAMETER = _STORAGE | {"(", ",", "\\", "|", "INOUT"}
#: Reserved words within a statement: the next line goes on with it.
_WITHIN = _words("AND OR XOR NOT DIV MOD THEN DO FROM TO STEP WITH INOUT")
_OPEN, _CLOSE = "([{", ")]}"


def _split(kinds: list[str]) -> list[Span] | None:
    """Token ranges of the statements; None if the last one goes on in the next line."""
    ranges: list[Span] = []
    first = 0
    while first < len(kinds):
        last = _end(kinds, first)
        if last is None:
            return None
        ranges.append((first, last))
        first = last + 1
    return ranges


def _end(kinds: Sequence[str], first: int) -> int | None:
    """Index of the last token of a statement; it ends before a word that can only begin the next one."""
    at = first
    while at < len(kinds) - 1 and kinds[at] in _MODIFIERS:
        at += 1
    word = kinds[at]
    following = kinds[at + 1] if at + 1 < len(kinds) else ""
    if word in _WHOLE or word == ";" or word.startswith("%%%"):
        return at
    if word == "ERROR":
        return _closing(kinds, at + 1) if following == "(" else at
    if word in _HEADS:
        return _routine_head(kinds, at, 2 if word == "PROC" else 3)
    if word == "MODULE":
        if len(kinds) > at + 2 and kinds[at + 2] == "(":
            return _closing(kinds, at + 2)
        return _name_after(kinds, at)
    if word in ("TRAP", "RECORD"):
        return _name_after(kinds, at)
    if following == ":" and word not in _FIRST_IN_SIMPLE:
        return at + 1
    own = _ENDS_WITH.get(word, ";")
    stops = _FIRST_IN_SIMPLE - _JUMPS if word == "IF" else _FIRST_IN_SIMPLE
    for index in range(at + 1, len(kinds)):
        kind = kinds[index]
        if kind == ";" or kind == own:
            return index
        if kind in stops:
            return index - 1
    return None


def _name_after(kinds: Sequence[str], at: int) -> int | None:
    if at + 1 == len(kinds):
        return None
    return at if kinds[at + 1] in _FIRST_IN_SIMPLE else at + 1


def _routine_head(kinds: Sequence[str], at: int, opening: int) -> int | None:
    for index in range(at + 1, min(at + opening, len(kinds))):
        if kinds[index] in _FIRST_IN_SIMPLE or kinds[index] == ";":
            return index - 1
    if len(kinds) <= at + opening:
        return None
    if kinds[at + opening] != "(":
        return at + opening - 1
    return _closing(kinds, at + opening)


def _closing(kinds: Sequence[str], opening: int) -> int | None:
    """Index of the bracket that closes another; before it is found a head ends at ``;`` or at the next statement."""
    depth = 0
    for index in range(opening, len(kinds)):
        kind = kinds[index]
        if kind in _OPEN:
            depth += 1
        elif kind in _CLOSE:
            depth -= 1
            if depth == 0:
                return index
        elif kind == ";":
            return index
        elif kind in _FIRST:
            return index - 1
    return None


SHAPES = RapidShapes("rapid", "piece", TOKEN, _split, _end)
_COMMENT = SHAPES.plain(COMMENT)
_AFTER_MODULE = SHAPES.plain(AFTER_MODULE)
_TOO_LONG = SHAPES.opaque(f"longer than {LONGEST_STATEMENT // 1024} kB")
#: Lines that are one statement each, by their keys: the shape, and the lengths of what stands before and after it.
_LINES: Cache[tuple[Shape, int, int]] = Cache()

_BLANK = "".join(filter(str.isspace, map(chr, range(0x3001)))) + "\x1a\ufeff"
_HEADER = re.compile(r"%%%[^%]*%%%")
_MODULE = re.compile(r"%%%|MODULE\s+[^\W\d]\w*\s*(?:[(!]|\Z)", re.IGNORECASE)
_WORD = re.compile(r"[^\W\d]\w*|<(?:TDN|DDN|RDN|PAR|ALT|DIM|SMT|VAR|EIT|CSE|EXP|ARG|ID)>|%", re.IGNORECASE)
#: What can hold the end of a statement; cheaper than the tokens of the line.
_MAY_END = re.compile(rf"[;:)]|\b(?:THEN|DO|END\w+|{_any_of(_FIRST_IN_SIMPLE)})\b|<\w+>", re.IGNORECASE)
#: Ends of a statement in a text too long for tokens: strings and comments are skipped.
_SEMICOLON = re.compile(r'"[^"\r\n]*"|![^\r\n]*|;')
#: A line that begins a statement whatever stands before it: no expression holds two operands in a row.
_TWO_OPERANDS = re.compile(
    rf"""[^\W\d]\w*(?:\s+(?!(?:{_any_of(_FIRST_IN_SIMPLE | _WITHIN)})\b)[^\W\d]|\s+\.?[0-9]|\s*["\[])""",
    re.IGNORECASE,
)
_ASSIGNS = re.compile(r"[^\W\d]\w*(?:\s*\{[^}]*\}|\s*\.\s*[^\W\d]\w*)*\s*:=", re.IGNORECASE)
#: Characters that hold the type and the name of a parameter.
_LONGEST_PARAMETER = 400
#: So many tokens tell what a statement is.
_FIRST_WORDS = 3
#: Tries at closing one head; more are only met in a file made to stall the reader.
_MOST_TRIES = 50


class _Begun:
    """A statement that goes on in the next line."""

    __slots__ = ("comments", "joined", "last", "line", "start", "stop", "tries", "words")

    def __init__(self, start: int, stop: int, line: int, words: tuple[str, ...]) -> None:
        self.start = start
        self.line = line
        #: begin and end of its last line with code
        self.last = start
        self.stop = stop
        #: its first words in upper case, modifiers left out
        self.words = words
        #: begin of the line with the statement of a compact IF
        self.joined: int | None = None
        self.tries = 0
        #: comment lines since its last line with code
        self.comments: list[Statement] = []


def read_statements(text: str, line_starts: list[int]) -> list[Statement]:
    """Statements and comment lines of a module, in order.

    Parameters
    ----------
    text : str
        The file, line ends as they are.
    line_starts : list of int
        `SourceText.line_starts`.
    """
    return _Reader(text, line_starts).read()


class _Reader:
    """Reads one file, line by line."""

    def __init__(self, text: str, line_starts: list[int]) -> None:
        self._text = text
        self._line_starts = line_starts
        self._statements: list[Statement] = []
        self._begun: _Begun | None = None
        #: ENDMODULE was read
        self._finished = False
        #: end of the file header, which spans lines
        self._header_end = 0

    def read(self) -> list[Statement]:
        """Read all lines."""
        text, add, known = self._text, self._statements.append, _LINES
        ends = [*self._line_starts[1:], len(text)]
        number = 0
        for start, end, key in zip(self._line_starts, ends, SHAPES.keys(text, self._line_starts), strict=False):
            number += 1
            if self._begun is None and not self._finished:
                try:
                    shape, before, after = known[key]
                except KeyError:
                    pass
                else:
                    add(Statement(text, start + before, end - after, number, shape))
                    self._finished = shape.kind == "end_module"
                    continue
            self._take(start, end, number, key)
        self._cut()
        return self._statements

    def _take(self, start: int, end: int, number: int, key: str) -> None:
        """Take a line that is not known as one statement that stands alone."""
        raw = self._text[start:end]
        line = raw.strip(_BLANK)
        if not line or start < self._header_end:
            return
        before = len(raw) - len(raw.lstrip(_BLANK))
        start += before
        stop = start + len(line)
        if line[0] == "!":
            self._comment(start, stop, number)
        elif self._begun is None and not self._finished and len(line) <= LONGEST_STATEMENT and line[0] not in "%(":
            parts = SHAPES.read(line)
            if parts is not None and len(parts) == 1:
                _LINES.keep(key, (parts[0].shape, before, end - stop))
                self._append(start, stop, parts[0].shape)
            else:
                self._join(line, start, stop, number, parts)
        else:
            self._join(line, start, stop, number, None)

    def _comment(self, start: int, stop: int, number: int) -> None:
        shape = _AFTER_MODULE if self._finished else _COMMENT
        comments = self._statements if self._begun is None else self._begun.comments
        comments.append(Statement(self._text, start, stop, number, shape))

    def _join(self, line: str, start: int, stop: int, number: int, parts: Unit) -> None:
        """Take a line that goes on with another, lets another go on with it, or holds several statements."""
        if self._finished:
            if not _MODULE.match(line):
                self._statements.append(Statement(self._text, start, stop, number, _AFTER_MODULE))
                return
            self._finished = False
        if self._begun is not None:
            if not self._begins(self._begun, line, start):
                self._go_on(self._begun, line, start, stop)
                return
            self._cut()
        if line.startswith("%%%"):
            self._header(start, stop, number)
            return
        if line[0] == "(":
            head = self._head_without_list()
            if head is not None:
                start, number = head.start, head.line
                line = self._text[start:stop]
                parts = None
        if parts is None and len(line) <= LONGEST_STATEMENT:
            parts = SHAPES.read(line)
        if parts is not None:
            self._add(parts, start, stop)
            return
        begun = self._begin(start, stop)
        if len(line) > LONGEST_STATEMENT and _has_semicolon(line):
            self._add_long(begun)

    def _head_without_list(self) -> Statement | None:
        """Take back the MODULE or ERROR whose list stands in a line of its own."""
        index = len(self._statements) - 1
        while index >= 0 and self._statements[index].kind == COMMENT:
            index -= 1
        if index < 0 or self._statements[index].kind not in ("module", "error"):
            return None
        head = self._statements[index]
        if self._text[head.start : head.end].endswith(")"):
            return None
        del self._statements[index:]
        return head

    def _begin(self, start: int, stop: int) -> _Begun:
        """Begin the last statement of a run of lines, which goes on; those before it are whole."""
        text = self._text[start:stop]
        if len(text) <= LONGEST_STATEMENT:
            kinds, spans = SHAPES.kinds(text)
            first = 0
            while (last := _end(kinds, first)) is not None and last + 1 < len(kinds):
                first = last + 1
            if first:
                self._add(SHAPES.last(text[: spans[first][0]]), start, start + spans[first - 1][1])
                start += spans[first][0]
                text = self._text[start:stop]
        self._begun = _Begun(start, stop, bisect_right(self._line_starts, start), _first_words(text))
        return self._begun

    def _header(self, start: int, stop: int, number: int) -> None:
        """Take the lines of a file header, or its first line where it is not closed."""
        header = _HEADER.match(self._text, start)
        if header is not None:
            stop = self._header_end = self._line_end(header.end())
        self._begun = _Begun(start, stop, number, ())
        self._cut()

    def _line_end(self, offset: int) -> int:
        index = bisect_right(self._line_starts, offset)
        end = self._line_starts[index] if index < len(self._line_starts) else len(self._text)
        return offset + len(self._text[offset:end].rstrip(_BLANK))

    def _go_on(self, begun: _Begun, line: str, start: int, stop: int) -> None:
        """Take a line that goes on with a statement; end it if its end stands there."""
        begun.last, begun.stop = start, stop
        begun.comments.clear()
        if stop - begun.start > LONGEST_STATEMENT:
            if _has_semicolon(line):
                self._add_long(begun)
            return
        if _MAY_END.search(line) and _holds_end(begun, SHAPES.kinds(line)[0]):
            begun.tries += 1
            parts = SHAPES.read(self._text[begun.start : stop])
            if parts is not None:
                self._begun = None
                self._add(parts, begun.start, stop)
                return
            if begun.tries > _MOST_TRIES:
                self._cut()
                return
            if self._begin(begun.start, stop).start != begun.start:
                return
            self._begun = begun
        if len(begun.words) < _FIRST_WORDS:
            begun.words = (*begun.words, *_first_words(line))[:_FIRST_WORDS]

    def _begins(self, begun: _Begun, line: str, start: int) -> bool:
        """Whether a line begins a statement although the one before it has not ended."""
        found = _WORD.match(line)
        if found is None or not begun.words:
            return False
        word = found.group().upper()
        compact = begun.words[0] == "IF" and begun.joined is None
        if word in _WITHIN or (word == "%" and "%" in self._text[begun.start : begun.stop]):
            return False
        if begun.words[0] in _HEADS and word not in _FIRST:
            return self._leaves_head(begun)
        if word in _FIRST_IN_SIMPLE:
            if compact and word in _JUMPS:
                begun.joined = start
                return False
            return True
        kinds = self._last_kinds(begun)
        before = kinds[-1]
        alone = begun.last in (begun.start, begun.joined) and len(kinds) == 1
        if alone and before in _MAYBE_WHOLE:
            return before in _WHOLE_JUMPS or self._is_left(start, begun)
        if not _is_operand(before):
            return not compact and before not in _BEFORE_TYPE and _begins_anyway(line, before)
        if compact:
            begun.joined = start
            return False
        if begun.words[0] in _BEFORE_TYPE and len(begun.words) == 2:
            return False
        if alone:
            # a procedure without arguments and no `;`, or one whose arguments stand in the next line: further right
            return self._is_left(start, begun)
        return True

    def _leaves_head(self, begun: _Begun) -> bool:
        """Whether a word after the lines of a routine head that was begun is none of its parameters."""
        text = self._text[max(begun.start, begun.stop - _LONGEST_PARAMETER) : begun.stop]
        kinds = SHAPES.kinds(text)[0]
        if len(kinds) < 2 or not _is_operand(kinds[-1]) or self._text.find("(", begun.start, begun.stop) < 0:
            return False
        return kinds[-2] not in _BEFORE_PARAMETER

    def _last_kinds(self, begun: _Begun) -> list[str]:
        """Kinds of the tokens of the last line of a statement that goes on."""
        begin = max(begun.last, begun.stop - LONGEST_STATEMENT)
        return SHAPES.kinds(self._text[begin : begun.stop])[0]

    def _is_left(self, start: int, begun: _Begun) -> bool:
        """Whether a line is not further right than the one on which a statement begins, first of all on it."""
        begin = self._line_starts[bisect_right(self._line_starts, begun.last) - 1]
        first = not self._text[begin : begun.last].strip(_BLANK)
        return first and self._indentation(start) <= self._indentation(begun.start)

    def _indentation(self, offset: int) -> int:
        begin = self._line_starts[bisect_right(self._line_starts, offset) - 1]
        line = self._text[begin : offset + 1]
        return len(line) - len(line.lstrip(_BLANK))

    def _cut(self) -> None:
        """End the statement that was begun, whole or not."""
        begun, self._begun = self._begun, None
        if begun is None:
            return
        if begun.stop - begun.start > LONGEST_STATEMENT:
            self._statements.append(Statement(self._text, begun.start, begun.stop, begun.line, _TOO_LONG))
        else:
            self._add(SHAPES.last(self._text[begun.start : begun.stop]), begun.start, begun.stop)
        self._statements += begun.comments

    def _add(self, parts: tuple[Part, ...], start: int, stop: int) -> None:
        if len(parts) == 1:
            self._append(start, stop, parts[0].shape)
            return
        _, spans = SHAPES.kinds(self._text[start:stop])
        for part in parts:
            self._append(start + spans[part.first][0], start + spans[part.last][1], part.shape)

    def _add_long(self, begun: _Begun) -> None:
        """Take a statement that only a table of data may be: rows of literals are read in no time."""
        self._begun = None
        table = begun.words[:1] and begun.words[0] in _STORAGE and begun.stop - begun.start <= LONGEST_TABLE
        parts = SHAPES.read_table(self._text[begun.start : begun.stop]) if table else None
        if parts is None:
            self._append(begun.start, begun.stop, _TOO_LONG)
        else:
            self._add(parts, begun.start, begun.stop)

    def _append(self, start: int, stop: int, shape: Shape) -> None:
        line = bisect_right(self._line_starts, start)
        if shape.kind == OPAQUE and self._statements and self._statements[-1].line == line:
            # what is left of a broken line is no statement of its own
            before = self._statements[-1]
            if before.kind == OPAQUE:
                start, shape = before.start, SHAPES.opaque(before.shape.reason)
                self._statements.pop()
        self._statements.append(Statement(self._text, start, stop, line, shape))
        self._finished = shape.kind == "end_module"


def _first_words(line: str) -> tuple[str, ...]:
    """First tokens of a line, in upper case, modifiers left out."""
    words: list[str] = []
    for match in TOKEN.finditer(line, 0, LONGEST_STATEMENT):
        word = match.group().upper()
        if match.lastgroup != "comment" and (words or word not in _MODIFIERS):
            words.append(word)
            if len(words) == _FIRST_WORDS:
                break
    return tuple(words)


def _is_operand(kind: str) -> bool:
    """Whether an expression can end with a token; a name of the author is ``a``."""
    if kind[0].isalpha():
        return kind not in _FIRST_IN_SIMPLE and kind not in _WITHIN
    return kind in ("0", '"', ")", "]", "}") or (kind[0] == "<" and len(kind) > 2)


def _begins_anyway(line: str, before: str) -> bool:
    """Whether a line begins a statement although an operand is missing in the one before it."""
    if before in _BEFORE_NAME:
        return False
    if _TWO_OPERANDS.match(line):
        return True
    return before not in (",", "(", "\\", "%") and _ASSIGNS.match(line) is not None


def _holds_end(begun: _Begun, kinds: list[str]) -> bool:
    """Whether a line that goes on with a statement can hold its end."""
    word = begun.words[0] if begun.words else ""
    if ";" in kinds or _ENDS_WITH.get(word) in kinds or (kinds[0] == ":" and len(begun.words) == 1):
        return True
    if word in _HEADS or word in ("MODULE", "ERROR"):
        return ")" in kinds
    if word in ("TRAP", "RECORD"):
        return True
    return not _FIRST_IN_SIMPLE.isdisjoint(kinds)


def _has_semicolon(text: str) -> bool:
    return any(match.group() == ";" for match in _SEMICOLON.finditer(text))
