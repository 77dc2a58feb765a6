"""Statements of KRL: one a line; comments, folds and headers are lines of their own kinds."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import count

from respot.languages.shapes import LONGEST_STATEMENT, Cache, Shapes
from respot.program.statement import OPAQUE, Shape, Statement
from respot.source import NEWLINE, Span

ENCODINGS = ("cp1252", "latin-1")

TOKEN = re.compile(
    r"""
      (?P<comment>;[^\r\n]*)
    | (?P<name>[A-Za-z_$][A-Za-z0-9_$]*)
    | (?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)
    | (?P<string>"[^"\r\n]*")
    | (?P<bits>'[BbHhDd]?[0-9A-Fa-f]+')
    | (?P<header>&[^\r\n]*)
    | (?P<path>(?:/[\w$]+)+\.\.[\w$]+)
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
    for number, start, end, key in zip(count(1), line_starts, ends, SHAPES.keys(text, line_starts), strict=False):
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


#: A file whose first statement is one of these is KRL, whatever follows.
_HEADS = frozenset(("routine", "function", "data_list"))
#: What other languages' lines read as by chance.
_COMMON = frozenset(
    (OPAQUE, COMMENT, "header", "assignments", "call", "label", "if_", "else_", "while_", "return_", "loop")
)
_DEF = re.compile(r"(?:GLOBAL\s+)?DEF(?:FCT|DAT)?\b", re.IGNORECASE)
_SNIFFED_STATEMENTS = 300
_SNIFFED_LINES = 32
_SNIFFED_TEXT = 100_000


def _sniffed(text: str) -> Iterator[Statement]:
    """Statements of the beginning of a file, read only as far as they are asked for."""
    starts = [0, *(match.end() for match in NEWLINE.finditer(text)), len(text)]
    for first in range(0, len(starts) - 1, _SNIFFED_LINES):
        some = starts[first : first + _SNIFFED_LINES + 1]
        piece = text[some[0] : some[-1]]
        yield from read_statements(piece, [start - some[0] for start in some[:-1]])


def looks_like_krl(text: str) -> bool:
    """Whether a file with a suffix of KRL holds KRL: other systems use ``.src`` and ``.dat`` too.

    A file that begins with a DEF does, after its ``&`` lines; if the DEF itself is damaged, most of the rest must be
    known. A fragment does if nine in ten of its first statements are known, some of them are no common ones, and most
    do not end with a semicolon as in C. An empty file does as well.
    """
    beginning = text[:_SNIFFED_TEXT]
    known = ended = total = 0
    telling, share = False, 0.9
    for statement in _sniffed(beginning):
        telling |= statement.kind not in _COMMON
        if statement.kind in NO_STATEMENT or statement.kind == "header":
            continue
        if total == 0 and statement.kind in _HEADS:
            return True
        if total == 0 and _DEF.match(statement.source):
            share = 0.6
        total += 1
        known += statement.kind != OPAQUE
        ended += statement.source.endswith(";")
        if total == _SNIFFED_STATEMENTS:
            break
    return total == 0 or (telling and known >= share * total and ended <= 0.5 * total)
