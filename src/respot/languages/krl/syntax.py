"""Statements of KRL: one a line; comments, folds and headers are lines of their own kinds."""

from __future__ import annotations

import re
from itertools import count

from respot.languages.shapes import LONGEST_STATEMENT, Cache, Shapes
from respot.program.statement import Shape, Statement
from respot.source import Span

ENCODINGS = ("cp1252", "latin-1")

TOKEN = re.compile(
    r"""
      (?P<comment>;[^\r\n]*)
    | (?P<name>[A-Za-z_$][A-Za-z0-9_$]*)
    | (?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)
    | (?P<string>"[^"\r\n]*")
    | (?P<bits>'[BbHhDd]?[0-9A-Fa-f]+')
    | (?P<header>&[^\r\n]*)
    | (?P<path>/[\w$/]+\.\.[\w$]+)
    | == | <> | <= | >=
    | [^\ \t\f\r\n\x1a\xa0]
    """,
    re.VERBOSE,
)

COMMENT, FOLD, END_FOLD = "comment", "fold", "end_fold"
_FOLD_MARK = re.compile(r";\s*(?:(FOLD)|(ENDFOLD))\b", re.IGNORECASE)
_BLANK = " \t\f\x1a\xa0"


def _one_statement(kinds: list[str]) -> list[Span]:
    return [(0, len(kinds) - 1)] if kinds else []


SHAPES = Shapes("krl", "line", TOKEN, _one_statement)
_PLAIN = {kind: SHAPES.plain(kind) for kind in (COMMENT, FOLD, END_FOLD)}
_TOO_LONG = SHAPES.opaque(f"longer than {LONGEST_STATEMENT // 1024} kB")

#: Kinds that count as no statement (INTERFACES, `check`).
NO_STATEMENT = frozenset(_PLAIN)

#: A line's shape and the blanks before and after it, its end among these; None for a blank line.
_Line = tuple[Shape, int, int] | None
_BLANK_OR_END = _BLANK + "\r\n"
_LINES: Cache[_Line] = Cache()


def read_statements(text: str, line_starts: list[int]) -> list[Statement]:
    """Statements, comments and fold marks of a file, in order.

    Parameters
    ----------
    text : str
        The file, line ends as they are.
    line_starts : list of int
        `SourceText.line_starts`.
    """
    statements: list[Statement] = []
    add = statements.append
    known = _LINES
    ends = [*line_starts[1:], len(text)]
    for number, start, end, key in zip(count(1), line_starts, ends, SHAPES.keys(text), strict=False):
        try:
            line = known[key]
        except KeyError:
            line = _read_line(text[start:end], key)
        if line is not None:
            add(Statement(text, start + line[1], end - line[2], number, line[0]))
    return statements


def _read_line(raw: str, key: str) -> _Line:
    text = raw.strip(_BLANK_OR_END)
    if not text:
        known: _Line = None
    else:
        before = len(raw) - len(raw.lstrip(_BLANK_OR_END))
        known = (_shape(text), before, len(raw) - before - len(text))
    _LINES.keep(key, known)
    return known


def _shape(text: str) -> Shape:
    if text[0] == ";":
        mark = _FOLD_MARK.match(text)
        return _PLAIN[COMMENT if mark is None else FOLD if mark.group(1) else END_FOLD]
    if len(text) > LONGEST_STATEMENT:
        return _TOO_LONG
    parts = SHAPES.read(text)
    return parts[0].shape if parts else _PLAIN[COMMENT]


_FIRST_WORD = re.compile(r"(?:GLOBAL\s+)?(?:DEF|DEFFCT|DEFDAT)\b", re.IGNORECASE)


def looks_like_krl(text: str) -> bool:
    """Whether a file with the suffix of KRL holds KRL."""
    for line in text.splitlines():
        line = line.strip()
        if not line or line[0] in ";&":
            continue
        return _FIRST_WORD.match(line) is not None
    return False
