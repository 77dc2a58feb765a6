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
    opened: list[Statement] = []
    for statement in statements:
        kind = statement.kind
        if kind in _OPENERS:
            if kind in _HEADS:  # a routine within a routine does not exist: what is open above it stays open
                yield from _unclosed(path, opened)
                opened.clear()
            opened.append(statement)
        elif kind in _CLOSERS:
            yield from _close(path, opened, statement, _CLOSERS[kind])
        elif kind in _INNER and (not opened or opened[-1].kind != _INNER[kind]):
            yield _issue(path, statement, f"{_word(statement)} stands in no {_OPENERS[_INNER[kind]]}")
    yield from _unclosed(path, opened)


def _close(path: str, opened: list[Statement], closer: Statement, kinds: tuple[str, ...]) -> Iterator[Issue]:
    depth = next((i for i in range(len(opened) - 1, -1, -1) if opened[i].kind in kinds), None)
    crosses_routine = depth is not None and any(s.kind in _HEADS for s in opened[depth + 1 :])
    if depth is None or crosses_routine:
        yield _issue(path, closer, f"{_word(closer)} closes no {_OPENERS[kinds[0]]}")
        return
    yield from _unclosed(path, opened[depth + 1 :])
    del opened[depth:]


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
    return Issue("UNBALANCED_BLOCK", message, path, statement.line, 1, statement.source)
