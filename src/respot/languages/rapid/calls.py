"""Calls and assignments within statements: instructions, functions in expressions, what stands left of ``:=``.

Where they stand is found once for each shape of statement; thousands of motions share one.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import islice
from typing import NamedTuple
from weakref import WeakKeyDictionary

from respot.program.statement import Branch, Leaf, Node, Shape, Statement
from respot.source import Span

#: Statements without code of their own.
_DECLARING = frozenset(("data", "alias", "record", "module", "procedure", "function", "trap"))
#: So many tokens are found faster one by one than all tokens of the statement at once.
_FEW = 6
_ARGUMENTS = frozenset(("argument", "named_argument", "optional_argument", "conditional_argument"))


class Argument(NamedTuple):
    r"""An argument of a call.

    Parameters
    ----------
    kind : str
        ``argument``, ``named_argument`` (``x:=1``), ``optional_argument`` (``\X:=1``, ``\X``), or
        ``conditional_argument`` (``\X?Y``: handed on if ``Y`` was given).
    name : str
        In lower case; empty for a positional argument.
    value : Node or None
        None for a switch and for a conditional argument.
    given : str
        Parameter, in lower case, that a conditional argument hands on.
    """

    kind: str
    name: str
    value: Node | None
    given: str = ""


class _ArgumentPlace(NamedTuple):
    kind: str
    name: int
    given: int
    value: Branch | None


class _CallPlace(NamedTuple):
    branch: Branch
    name: int
    late: Branch | None
    arguments: tuple[_ArgumentPlace, ...]


class _Places(NamedTuple):
    calls: tuple[_CallPlace, ...]
    assigned: tuple[Branch, ...]
    #: last token that names one of them
    last: int


@dataclass(frozen=True, slots=True)
class Invocation:
    """A call of an instruction, procedure or function.

    Parameters
    ----------
    statement : Statement
        Statement it stands in.
    name : str
        What is called; empty where it is bound late.
    place : object
        Where its parts stand in the statement's shape.
    """

    statement: Statement
    name: str
    place: _CallPlace

    @property
    def is_function(self) -> bool:
        """Whether it gives a value."""
        return self.place.branch.kind == "function_call"

    @property
    def line(self) -> int:
        """Line of its statement."""
        return self.statement.line

    def arguments(self) -> list[Argument]:
        """Return its arguments, in order."""
        statement = self.statement
        text, spans = statement.text, statement.tokens()

        def word(position: int) -> str:
            return text[slice(*spans[position])].lower() if position >= 0 else ""

        return [
            Argument(
                place.kind,
                word(place.name),
                None if place.value is None else Node(text, spans, place.value),
                word(place.given),
            )
            for place in self.place.arguments
        ]

    def late_name(self) -> Node | None:
        """Return the expression of a name that is bound late, None of any other call."""
        if self.place.late is None:
            return None
        return Node(self.statement.text, self.statement.tokens(), self.place.late)

    def span(self) -> Span:
        """Return the place of the call in its file."""
        spans = self.statement.tokens()
        return spans[self.place.branch.first][0], spans[self.place.branch.last][1]


class Line(NamedTuple):
    """A statement of a routine with its calls, and the data that it assigns to.

    Parameters
    ----------
    statement : Statement
        The statement.
    calls : tuple of Invocation
        Its calls, from the left, outer before inner.
    assigned : tuple of (str, bool)
        Name of each datum that stands left of ``:=``, in lower case, and whether all of it is assigned.
    """

    statement: Statement
    calls: tuple[Invocation, ...] = ()
    assigned: tuple[tuple[str, bool], ...] = ()


def read_lines(statements: Iterable[Statement]) -> list[Line]:
    """Return the statements of a routine's body that are no comments, with their calls and assignments."""
    return [_line(statement) for statement in statements if statement.kind != "comment"]


def _line(statement: Statement) -> Line:
    shape = statement.shape
    if shape.tree is None or shape.kind in _DECLARING:
        return Line(statement)
    places = _KNOWN.get(shape)
    if places is None:
        places = _KNOWN[shape] = _find(shape.tree)
    if not places.calls and not places.assigned:
        return Line(statement)
    text, spans = statement.text, first_spans(statement, places.last + 1)
    calls = tuple(
        Invocation(statement, text[slice(*spans[place.name])] if place.name >= 0 else "", place)
        for place in places.calls
    )
    assigned = tuple((text[slice(*spans[left.first])].lower(), left.first == left.last) for left in places.assigned)
    return Line(statement, calls, assigned)


_KNOWN: WeakKeyDictionary[Shape, _Places] = WeakKeyDictionary()


def _find(tree: Branch) -> _Places:
    calls: list[_CallPlace] = []
    assigned: list[Branch] = []
    for branch in _walk(tree):
        if branch.kind in ("call", "function_call"):
            calls.append(_call_place(branch))
        elif branch.kind == "assignment":
            assigned.append(_first_branch(branch.children))
    last = max((*(place.name for place in calls), *(left.first for left in assigned)), default=-1)
    return _Places(tuple(calls), tuple(assigned), last)


def first_spans(statement: Statement, count: int) -> list[Span]:
    """Spans of the first tokens of a statement: its words, where a long literal need not be looked at."""
    if count > _FEW:
        return statement.tokens()
    found = statement.shape.lexicon.token.finditer(statement.text, statement.start, statement.end)
    return [match.span() for match in islice((match for match in found if match.lastindex is None), count)]


def _walk(tree: Branch) -> Iterator[Branch]:
    """Yield a branch and all below it, from the left; without recursion, since sums may be long."""
    pending = [tree]
    while pending:
        branch = pending.pop()
        yield branch
        pending += [child for child in reversed(branch.children) if isinstance(child, Branch)]


def _call_place(branch: Branch) -> _CallPlace:
    name, late = -1, None
    arguments: tuple[_ArgumentPlace, ...] = ()
    for child in branch.children:
        if isinstance(child, Leaf):
            name = child.position if child.type == "NAME" else name
        elif child.kind == "late_binding":
            late = _first_branch(child.children)
        elif child.kind == "arguments":
            arguments = tuple(
                _argument_place(part) for part in child.children if isinstance(part, Branch) and part.kind in _ARGUMENTS
            )
    return _CallPlace(branch, name, late, arguments)


def _argument_place(branch: Branch) -> _ArgumentPlace:
    names = [child.position for child in branch.children if isinstance(child, Leaf) and child.type == "NAME"]
    value = next((child for child in branch.children if isinstance(child, Branch)), None)
    given = names[1] if branch.kind == "conditional_argument" and len(names) > 1 else -1
    if branch.kind == "argument":
        return _ArgumentPlace(branch.kind, -1, -1, value)
    return _ArgumentPlace(branch.kind, names[0] if names else -1, given, value)


def _first_branch(children: tuple[Branch | Leaf, ...]) -> Branch:
    return next(child for child in children if isinstance(child, Branch))
