"""Blocks of KRL: routines with their bodies, and blocks that do not balance.

The pass is tolerant: a block that is closed too early or never is reported at its line, and reading goes on.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

from respot.issues import Issue
from respot.languages.krl.syntax import END_FOLD, FOLD
from respot.program.statement import Statement


@dataclass
class Routine:
    """A DEF, DEFFCT or DEFDAT with what stands between it and its end.

    Parameters
    ----------
    name : str
        As written.
    head : Statement
        Its first line.
    body : list of Statement
        Everything up to its end, comments and fold marks too.
    end : Statement or None
        Its last line; None if it has none.
    """

    name: str
    head: Statement
    body: list[Statement] = field(default_factory=list)
    end: Statement | None = None


#: What a block is called in a message, by the kind that opens it.
_OPENERS = {
    "routine": "DEF",
    "function": "DEFFCT",
    "data_list": "DEFDAT",
    "if_": "IF",
    "for_": "FOR",
    "while_": "WHILE",
    "repeat": "REPEAT",
    "loop": "LOOP",
    "switch": "SWITCH",
    "spline": "SPLINE",
}
#: What closes a block -> the kinds it may close.
_CLOSERS = {
    "end_routine": ("routine", "function"),
    "end_data_list": ("data_list",),
    "end_if": ("if_",),
    "end_for": ("for_",),
    "end_while": ("while_",),
    "until": ("repeat",),
    "end_loop": ("loop",),
    "end_switch": ("switch",),
    "end_spline": ("spline",),
}
#: What stands within a block -> the kind of the block.
_INNER = {"else_": "if_", "case": "switch", "default": "switch"}
_HEADS = frozenset(("routine", "function", "data_list"))
_BLOCK_KINDS = frozenset((*_OPENERS, *_CLOSERS, *_INNER))


def routines(statements: Iterable[Statement]) -> list[Routine]:
    """Routines and data lists of a module, in order.

    A head without an end reaches to the next head; statements outside belong to no routine.
    """
    found: list[Routine] = []
    current: Routine | None = None
    for statement in statements:
        kind = statement.kind
        if kind in _HEADS:
            current = Routine(_name(statement), statement)
            found.append(current)
        elif current is None:
            continue
        elif kind in ("end_routine", "end_data_list"):
            current.end = statement
            current = None
        else:
            current.body.append(statement)
    return found


def block_issues(path: str, statements: Iterable[Statement]) -> list[Issue]:
    """Report blocks and folds that are opened and not closed, or closed and not opened.

    Folds are checked apart from blocks: they are comments, and controllers' own files hold unbalanced ones.
    """
    kept = list(statements)
    issues = [*_unbalanced_blocks(path, kept), *_unbalanced_folds(path, kept)]
    return sorted(issues, key=lambda issue: issue.line or 0)


def _unbalanced_blocks(path: str, statements: list[Statement]) -> Iterator[Issue]:
    for run in _runs(statements):
        issues = list(_match(path, run, indented=False))
        # which of several nested blocks lacks its end cannot be told from the words; the indentation often tells
        yield from _match(path, run, indented=True) if issues else issues


def _runs(statements: list[Statement]) -> Iterator[list[Statement]]:
    """Cut before each head: what is open above a DEF stays open."""
    run: list[Statement] = []
    for statement in statements:
        if statement.kind in _HEADS and run:
            yield run
            run = []
        if statement.kind in _BLOCK_KINDS:
            run.append(statement)
    yield run


def _match(path: str, statements: list[Statement], indented: bool) -> Iterator[Issue]:
    opened: list[Statement] = []
    for statement in statements:
        kind = statement.kind
        if kind in _OPENERS:
            opened.append(statement)
        elif kind in _CLOSERS:
            yield from _close(path, opened, statement, indented)
        else:
            yield from _inner(path, opened, statement, indented)
    yield from _unclosed(path, opened)


def _close(path: str, opened: list[Statement], closer: Statement, indented: bool) -> Iterator[Issue]:
    depth = _partner(opened, closer, _CLOSERS[closer.kind], indented)
    if depth is None:
        yield _issue(path, closer, f"{_word(closer)} closes no {_OPENERS[_CLOSERS[closer.kind][0]]}")
        return
    yield from _unclosed(path, opened[depth + 1 :])
    del opened[depth:]


def _inner(path: str, opened: list[Statement], statement: Statement, indented: bool) -> Iterator[Issue]:
    """Check that ELSE, CASE and DEFAULT stand in their block; what is open within it ends there."""
    kind = _INNER[statement.kind]
    depth = _partner(opened, statement, (kind,), indented) if indented else len(opened) - 1
    if depth is None or depth < 0 or opened[depth].kind != kind:
        yield _issue(path, statement, f"{_word(statement)} stands in no {_OPENERS[kind]}")
        return
    yield from _unclosed(path, opened[depth + 1 :])
    del opened[depth + 1 :]


def _partner(opened: list[Statement], closer: Statement, kinds: tuple[str, ...], indented: bool) -> int | None:
    """Position of the block that a statement closes or divides."""
    fitting = [index for index, statement in enumerate(opened) if statement.kind in kinds]
    if not fitting:
        return None
    if indented:
        column = _column(closer)
        same = [index for index in fitting if _column(opened[index]) == column]
        if same:
            return same[-1]
        if closer.kind in _CLOSERS and opened[fitting[-1]].kind not in _HEADS and _column(opened[fitting[-1]]) < column:
            return None  # what it closes stood deeper and is gone
    return fitting[-1]


def _unclosed(path: str, opened: list[Statement]) -> Iterator[Issue]:
    for statement in opened:
        yield _issue(path, statement, f"{_OPENERS[statement.kind]} is not closed")


def _unbalanced_folds(path: str, statements: list[Statement]) -> Iterator[Issue]:
    opened: list[Statement] = []
    for statement in statements:
        if statement.kind == FOLD:
            opened.append(statement)
        elif statement.kind == END_FOLD:
            if opened:
                opened.pop()
            else:
                yield _issue(path, statement, "ENDFOLD closes no FOLD")
    for statement in opened:
        yield _issue(path, statement, "FOLD is not closed")


def _word(statement: Statement) -> str:
    return statement.source.split(None, 1)[0].split(";", 1)[0].upper()


def _name(statement: Statement) -> str:
    names = statement.node.tokens("NAME")
    return names[-1].text


def _issue(path: str, statement: Statement, message: str) -> Issue:
    column = _column(statement)
    excerpt = statement.text[statement.start - column + 1 : statement.end]
    return Issue("UNBALANCED_BLOCK", message, path, statement.line, column, excerpt)


def _column(statement: Statement) -> int:
    """Column of a statement, from 1."""
    text, start = statement.text, statement.start
    return start - max(text.rfind("\n", 0, start), text.rfind("\r", 0, start))
