"""Inline forms of KRL: folds, and the copies of every field in them (facts: krl.md section 6).

A fold is a form if its opening line, and where the profile asks for it a ``;Params`` line, is known to a profile and it
holds code. A fold within it that is no form itself, such as ``;FOLD Parameters ;%{h}`` or VKRC's ``;FOLD {H}``, belongs
to it. Folds are comments: one that is not closed, or closed twice, spoils no other.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import NamedTuple

from respot.languages.forms import Forms
from respot.languages.krl.symbols import Aggregate, Symbol, Symbols, module_key
from respot.languages.krl.syntax import COMMENT, END_FOLD, FOLD
from respot.languages.profile import CopyRule, FormRule, Profile
from respot.program.forms import Contents, Copy, Form, ranked
from respot.program.statement import Statement
from respot.source import SourceText, Span

FORMS = Forms.load(Path(__file__).with_name("profiles"))
#: Most characters of a name (krl.md section 1).
LONGEST_NAME = 24
#: Patterns are searched in no longer text than this.
_LONGEST_TEXT = 4096
#: So many ``;Params`` lines of a fold may tell what form it is.
_MOST_PARAMS = 4
_OPENING = re.compile(r";\s*FOLD\b[ \t]*", re.IGNORECASE)
_TAIL = re.compile(r"%\{|;\s*%")
_PARAMS = re.compile(r";\s*Params\b[ \t]*", re.IGNORECASE)
_NAMES = re.compile(r"[A-Za-z_$][\w$]*", re.ASCII)
_STRING_OR_COMMENT = re.compile(r'"[^"]*"|(;)')
_BORDERS = frozenset(("routine", "function", "data_list", "end_routine", "end_data_list"))


@dataclass(frozen=True)
class Data:
    """Where forms find what they declare.

    Parameters
    ----------
    symbols : Symbols
        Data of the robot.
    sources : mapping of str to SourceText
        Files of the data lists, by path.
    """

    symbols: Symbols
    sources: Mapping[str, SourceText]


def read_forms(source: SourceText, statements: Sequence[Statement], data: Data, forms: Forms = FORMS) -> list[Form]:
    """Read the inline forms of a file, in the order of their first lines.

    Fields are read only when a form is asked for them: finding the forms costs far less than reading the statements.

    Parameters
    ----------
    source : SourceText
        The file.
    statements : sequence of Statement
        Its statements, or those of one of its routines.
    data : Data
        Where names of the forms are declared.
    forms : Forms
        The profiles.
    """
    return _Reader(source, statements, data, forms).run()


@dataclass
class _Fold:
    """An open fold.

    Parameters
    ----------
    start : int
        Index of its opening statement.
    code : bool
        Code stands in it, outside of forms within it.
    params : list of int
        Indices of its ``;Params`` lines.
    inner : int or None
        Index of the first form within it.
    """

    start: int
    code: bool = False
    params: list[int] = field(default_factory=list)
    inner: int | None = None


class _Reader:
    """One pass over the statements of a file."""

    def __init__(self, source: SourceText, statements: Sequence[Statement], data: Data, forms: Forms) -> None:
        self._source = source
        self._statements = statements
        self._data = data
        self._rules = forms.forms
        self._open: list[_Fold] = []
        self._found: dict[int, Form] = {}
        #: First and last statement of each form, for a block that steps over the forms in it.
        self._ends: dict[int, int] = {}

    def run(self) -> list[Form]:
        opened = self._open
        for index, statement in enumerate(self._statements):
            kind = statement.shape.kind
            if kind == FOLD:
                opened.append(_Fold(index))
            elif kind == END_FOLD:
                if opened:
                    self._close(opened.pop(), index)
            elif kind in _BORDERS:
                self._close_all(index - 1)
            elif opened:
                if kind != COMMENT:
                    opened[-1].code = True
                elif _PARAMS.match(statement.text, statement.start, statement.end):
                    opened[-1].params.append(index)
        self._close_all(len(self._statements) - 1)
        return [self._found[start] for start in sorted(self._found)]

    def _close_all(self, last: int) -> None:
        """Close the folds that a routine left open."""
        while self._open:
            self._close(self._open.pop(), last)

    def _close(self, fold: _Fold, last: int) -> None:
        known = self._rule(fold) if fold.code else None
        outer = self._open[-1] if self._open else None
        if known is None:
            if outer is not None:
                outer.code |= fold.code
                outer.params = [*outer.params, *fold.params][:_MOST_PARAMS]
                outer.inner = fold.inner if outer.inner is None else outer.inner
            return
        profile, rule = known
        end = last if rule.block or fold.inner is None else fold.inner - 1
        self._ends[fold.start] = end
        opening, closing = self._statements[fold.start], self._statements[end]
        self._found[fold.start] = Form(
            profile.name,
            self._source.path,
            opening.line,
            (opening.start, closing.end),
            partial(self._contents, rule, fold.start, end),
            rule.fixed,
            LONGEST_NAME,
        )
        if outer is not None and outer.inner is None:
            outer.inner = fold.start

    def _rule(self, fold: _Fold) -> tuple[Profile, FormRule] | None:
        title = _after_mark(self._statements[fold.start])[1]
        params: list[str] | None = None
        for profile, rule in self._rules:
            if rule.title.search(title):
                if rule.params is None:
                    return profile, rule
                if params is None:
                    params = [self._statements[index].source[:_LONGEST_TEXT] for index in fold.params]
                if any(map(rule.params.search, params)):
                    return profile, rule
        return None

    def _contents(self, rule: FormRule, start: int, end: int) -> Contents:
        own = [self._statements[start], *self._inside(start, end)]
        return _FormReader(self._source, own, self._data, rule).contents()

    def _inside(self, start: int, end: int) -> Iterator[Statement]:
        """Statements of a form without those of the forms within it."""
        index = start + 1
        while index <= end:
            if index in self._ends:
                index = self._ends[index] + 1
                continue
            yield self._statements[index]
            index += 1


class _Piece(NamedTuple):
    """A short text in which patterns are searched."""

    path: str
    span: Span
    text: str
    line: int


class _FormReader:
    """Reads the fields of one form."""

    def __init__(self, source: SourceText, statements: Sequence[Statement], data: Data, rule: FormRule) -> None:
        self._source = source
        self._data = data
        self._rule = rule
        self._module = module_key(source.path)
        self._copies: dict[str, list[Copy]] = {}
        self._suggestions: dict[str, list[Copy]] = {}
        self._missing: dict[str, list[str]] = {}
        self._regions: dict[str, list[_Piece]] = {"title": [], "tail": [], "params": [], "body": []}
        self._opening = _after_mark(statements[0])[1]
        self._cut(statements)

    def _cut(self, statements: Sequence[Statement]) -> None:
        """Cut the statements into regions."""
        start, opening = _after_mark(statements[0])
        tail = _TAIL.search(opening)
        title = opening[: tail.start()] if tail else opening
        line = statements[0].line
        self._add("title", start, start + len(title.rstrip(" \t;")), line)
        if tail:
            self._add("tail", start + tail.start(), start + len(opening), line)
        for statement in statements[1:]:
            kind = statement.shape.kind
            if kind == FOLD:
                begin, text = _after_mark(statement)
                self._add("params", begin, begin + len(text), statement.line)
            elif kind == COMMENT:
                mark = _PARAMS.match(statement.text, statement.start, statement.end)
                if mark:
                    end = min(statement.end, mark.end() + _LONGEST_TEXT)
                    self._add("params", mark.end(), end, statement.line)
            elif kind != END_FOLD:
                self._add("body", *_code(statement), statement.line)

    def _add(self, region: str, start: int, end: int, line: int) -> None:
        self._regions[region].append(_Piece(self._source.path, (start, end), self._source.text[start:end], line))

    def contents(self) -> Contents:
        data: list[CopyRule] = []
        for rule in self._rule.copies:
            if rule.when is not None and not rule.when.search(self._opening):
                continue
            if rule.region == "data":
                data.append(rule)
                continue
            search = rule.pattern.search
            for piece in self._regions[rule.region]:
                if search(piece.text):
                    self._search(rule, piece)
        self._read_data(data)
        fields = {name: ranked(copies) for name, copies in self._copies.items()}
        return Contents(fields, self._suggestions, self._missing)

    def _read_data(self, rules: Iterable[CopyRule]) -> None:
        named = {name.upper() for piece in self._regions["body"] for name in _NAMES.findall(piece.text)}
        values = _Values(self._copies)
        for rule in rules:
            name = rule.name.format_map(values)
            if not rule.suggestion and name.upper() not in named:
                continue
            symbol = self._data.symbols.find(name, self._module)
            source = None if symbol is None else self._data.sources.get(symbol.path)
            span = None if symbol is None or source is None else _declaration(source, symbol)
            if symbol is None or source is None or span is None or symbol.type == "AMBIGUOUS":
                if not rule.suggestion:
                    for group in rule.pattern.groupindex:
                        self._missing.setdefault(group, []).append(name)
            elif not rule.suggestion or module_key(symbol.path) == self._module:
                self._search(rule, _Piece(symbol.path, span, source.text[slice(*span)], symbol.line), symbol)

    def _search(self, rule: CopyRule, piece: _Piece, symbol: Symbol | None = None) -> None:
        path, span, text, line = piece
        start = span[0]
        table = self._suggestions if rule.suggestion else self._copies
        datum, visible = (symbol.name, symbol.visible) if symbol is not None else ("", False)
        for match in rule.pattern.finditer(text):
            for name, group in rule.pattern.groupindex.items():
                found = match[group]
                if found is None:
                    continue
                at = start + match.start(group)
                spelling = rule.spelling(name in self._rule.numbers)
                copy = Copy(
                    rule.region,
                    path,
                    (at, at + len(found)),
                    found,
                    line,
                    match[0],
                    span,
                    rule.pattern,
                    name,
                    datum,
                    visible,
                    spelling,
                )
                table.setdefault(name, []).append(copy)


class _Values(dict[str, str]):
    """Values of the fields that are asked for, as they are known before the data are read."""

    def __init__(self, copies: Mapping[str, Sequence[Copy]]) -> None:
        self._copies = copies

    def __missing__(self, name: str) -> str:
        found = (copy.value for copy in ranked(self._copies.get(name, ())))
        self[name] = value = next((value for value in found if value is not None), "")
        return value


def _after_mark(opening: Statement) -> tuple[int, str]:
    """Place and text of an opening line behind its ``;FOLD``."""
    mark = _OPENING.match(opening.text, opening.start, opening.end)
    start = mark.end() if mark else opening.start
    return start, opening.text[start : min(opening.end, start + _LONGEST_TEXT)]


def _code(statement: Statement) -> Span:
    """Span of a statement without the comment behind it."""
    start, end = statement.start, min(statement.end, statement.start + _LONGEST_TEXT)
    source = statement.text[start:end]
    if ";" in source:
        comment = next((match for match in _STRING_OR_COMMENT.finditer(source) if match[1]), None)
        if comment:
            source = source[: comment.start()].rstrip()
    return start, start + len(source)


def _declaration(source: SourceText, symbol: Symbol) -> Span | None:
    """Span of a declared datum, from its name to the end of its value."""
    start = source.line_starts[symbol.line - 1]
    line = source.line_text(symbol.line)
    wanted = symbol.name.upper()
    name = next((name for name in _NAMES.finditer(line) if name[0].upper() == wanted), None)
    if name is None:
        return None
    end = name.end()
    if isinstance(symbol.value, Aggregate):
        end = symbol.value.span[1] - start
    return start + name.start(), start + min(end, name.start() + _LONGEST_TEXT)
