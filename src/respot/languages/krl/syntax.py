"""Statements of KRL: one a line; comments, folds and headers are lines of their own kinds."""

from __future__ import annotations

import re

from respot.languages.shapes import LONGEST_STATEMENT, Shapes
from respot.program.statement import Statement
from respot.source import Span

ENCODINGS = ("cp1252", "latin-1")

TOKEN = re.compile(
    r"""
      (?P<comment>;[^\r\n]*)
    | (?P<name>[A-Za-z_$][A-Za-z0-9_$]*)
    | (?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)
    | (?P<string>"[^"\r\n]*")
    | '[BbHhDd]?[0-9A-Fa-f]+'
    | &[^\r\n]*
    | /[\w$/]+\.\.[\w$]+
    | == | <> | <= | >=
    | [^\s\x1a]
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
    ends = [*line_starts[1:], len(text)]
    unit = SHAPES.unit
    for number, (start, end) in enumerate(zip(line_starts, ends, strict=True), 1):
        raw = text[start:end]
        line = raw.lstrip(_BLANK)
        start += len(raw) - len(line)
        line = line.rstrip("\r\n \t\f\x1a\xa0")
        if not line:
            continue
        if line[0] == ";":
            mark = _FOLD_MARK.match(line)
            kind = COMMENT if mark is None else FOLD if mark.group(1) else END_FOLD
            shape = _PLAIN[kind]
        elif len(line) > LONGEST_STATEMENT:
            shape = _TOO_LONG
        else:
            parts = unit(line)
            if not parts:
                continue
            shape = parts[0].shape
        statements.append(Statement(text, start, start + len(line), number, shape))
    return statements


_FIRST_WORD = re.compile(r"(?:GLOBAL\s+)?(?:DEF|DEFFCT|DEFDAT)\b", re.IGNORECASE)


def looks_like_krl(text: str) -> bool:
    """Whether a file with the suffix of KRL holds KRL."""
    for line in text.splitlines():
        line = line.strip()
        if not line or line[0] in ";&":
            continue
        return _FIRST_WORD.match(line) is not None
    return False
