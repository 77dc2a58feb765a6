"""Statements of RAPID: they end with ``;`` or a block word, and may share or span lines."""

from __future__ import annotations

import re

from respot.languages.shapes import LONGEST_STATEMENT, Shapes
from respot.program.statement import Statement
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

COMMENT, AFTER_MODULE = "comment", "after_module"

#: Block words that are whole statements.
_WORDS = frozenset(
    [
        "ENDMODULE",
        "ENDPROC",
        "ENDFUNC",
        "ENDTRAP",
        "ENDRECORD",
        "ENDIF",
        "ENDFOR",
        "ENDWHILE",
        "ENDTEST",
        "ELSE",
        "UNDO",
        "BACKWARD",
        "<SMT>",
        "<DDN>",
        "<TDN>",
        "<RDN>",
    ]
)
_ENDS_WITH = {"ELSEIF": "THEN", "FOR": "DO", "WHILE": "DO", "CASE": ":", "DEFAULT": ":"}
_MODIFIERS = frozenset(("LOCAL", "TASK"))
_TEST_ENDS = frozenset(("CASE", "DEFAULT", "ENDTEST", "<CSE>"))
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


def _end(kinds: list[str], first: int) -> int | None:
    word = kinds[first]
    if word in _MODIFIERS and first + 1 < len(kinds) and kinds[first + 1] in ("PROC", "FUNC", "TRAP", "RECORD"):
        first += 1
        word = kinds[first]
    following = kinds[first + 1] if first + 1 < len(kinds) else ""
    if word in _WORDS or word.startswith("%%%"):
        return first
    if word == "ERROR":
        return _closing(kinds, first + 1) if following == "(" else first
    if word in ("PROC", "FUNC"):
        return _routine_head(kinds, first, 2 if word == "PROC" else 3)
    if word == "MODULE":
        if len(kinds) > first + 2 and kinds[first + 2] == "(":
            return _closing(kinds, first + 2)
        return first + 1 if following else None
    if word in ("TRAP", "RECORD"):
        return first + 1 if following else None
    if word == "IF":
        return _find(kinds, first, ("THEN", ";"))
    if word == "TEST":
        end = next((index for index in range(first, len(kinds)) if kinds[index] in _TEST_ENDS), None)
        return None if end is None else end - 1
    if word in _ENDS_WITH:
        return _find(kinds, first, (_ENDS_WITH[word],))
    if following == ":" and word not in ("<EXP>",):
        return first + 1
    return _find(kinds, first, (";",))


def _routine_head(kinds: list[str], first: int, opening: int) -> int | None:
    if len(kinds) <= first + opening:
        return None
    if kinds[first + opening] != "(":
        return first + opening - 1
    return _closing(kinds, first + opening)


def _find(kinds: list[str], first: int, ends: tuple[str, ...]) -> int | None:
    return next((index for index in range(first, len(kinds)) if kinds[index] in ends), None)


def _closing(kinds: list[str], opening: int) -> int | None:
    depth = 0
    for index in range(opening, len(kinds)):
        if kinds[index] in _OPEN:
            depth += 1
        elif kinds[index] in _CLOSE:
            depth -= 1
            if depth == 0:
                return index
    return None


SHAPES = Shapes("rapid", "piece", TOKEN, _split)
_COMMENT = SHAPES.plain(COMMENT)
_AFTER_MODULE = SHAPES.plain(AFTER_MODULE)
_TOO_LONG = SHAPES.opaque(f"longer than {LONGEST_STATEMENT // 1024} kB")
_UNFINISHED = SHAPES.opaque("ends too early")

#: Kinds that count as no statement (INTERFACES, `check`).
NO_STATEMENT = frozenset((COMMENT, AFTER_MODULE))

_BLANK = " \t\f\x1a\xa0"
_MAY_END = re.compile(
    r";|:(?!=)|\)|%%%|\b(?:THEN|DO|ELSE|ERROR|UNDO|BACKWARD|CASE|DEFAULT|END\w+|MODULE|TRAP|RECORD)\b|<\w+>",
    re.IGNORECASE,
)


def read_statements(text: str, line_starts: list[int]) -> list[Statement]:
    """Statements and comment lines of a module, in order.

    Parameters
    ----------
    text : str
        The file, line ends as they are.
    line_starts : list of int
        `SourceText.line_starts`.
    """
    statements: list[Statement] = []
    ends = [*line_starts[1:], len(text)]
    begun: tuple[int, int] | None = None  # offset and line of a statement that goes on
    finished = False
    for number, (start, end) in enumerate(zip(line_starts, ends, strict=True), 1):
        raw = text[start:end]
        line = raw.lstrip(_BLANK)
        start += len(raw) - len(line)
        line = line.rstrip("\r\n \t\f\x1a\xa0")
        if not line:
            continue
        stop = start + len(line)
        if finished:
            statements.append(Statement(text, start, stop, number, _AFTER_MODULE))
            continue
        if line[0] == "!":
            if begun is None:
                statements.append(Statement(text, start, stop, number, _COMMENT))
            continue
        if begun is None:
            begun = (start, number)
        elif not _MAY_END.search(line):
            continue
        if stop - begun[0] > LONGEST_STATEMENT:
            if ";" not in line:
                continue
            statements.append(Statement(text, begun[0], stop, begun[1], _TOO_LONG))
            begun = None
            continue
        read = _unit(text, begun[0], stop, begun[1])
        if read is None:
            continue
        statements += read
        begun = None
        finished = bool(read) and read[-1].kind == "end_module"
    if begun is not None:
        statements.append(Statement(text, begun[0], len(text.rstrip()), begun[1], _UNFINISHED))
    return statements


def _unit(text: str, start: int, stop: int, line: int) -> list[Statement] | None:
    piece = text[start:stop]
    parts = SHAPES.unit(piece)
    if parts is None:
        return None
    if len(parts) == 1:
        return [Statement(text, start, stop, line, parts[0].shape)]
    _, spans = SHAPES.kinds(piece)
    statements = []
    for part in parts:
        begin, end = spans[part.first][0], spans[part.last][1]
        above = piece.count("\n", 0, begin)
        statements.append(Statement(text, start + begin, start + end, line + above, part.shape))
    return statements
