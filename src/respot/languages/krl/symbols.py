"""Where a KRL name lives: declarations and assignments of data lists and routines, read as plain values.

A name is looked up in the routine's own data list, then among the global data: what a ``PUBLIC`` data list declares
``GLOBAL``, and everything in ``$config.dat``. Names are compared without case (facts: krl.md section 1).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import TypeAlias

from respot.languages.literals import number_of
from respot.program.statement import Node, Statement
from respot.program.targets import Number
from respot.source import Span

#: Value of a KRL expression: a number, the text of a string, name or enum constant, or an aggregate by member.
Value: TypeAlias = "Number | str | Aggregate"


@dataclass(frozen=True)
class Aggregate:
    """``{X 1.0,Y 2.0}`` with members in upper case, its type if it is written, and its place."""

    members: Mapping[str, Value]
    type: str
    span: Span

    def number(self, name: str) -> float | None:
        """Value of a numeric member, else None."""
        value = self.members.get(name)
        return float(value.value) if isinstance(value, Number) else None

    def numbers(self) -> dict[str, Number]:
        """Return the numeric members."""
        return {name: value for name, value in self.members.items() if isinstance(value, Number)}


@dataclass(frozen=True)
class Symbol:
    """A declared or assigned datum.

    Parameters
    ----------
    name : str
        As written, with its index if it is an array element: ``BASE_DATA[1]``.
    type : str
        Declared type in upper case; empty for an assignment.
    value : Value or None
        Its initial value.
    path : str
        File.
    line : int
        Line.
    visible : bool
        Other modules can see it.
    """

    name: str
    type: str
    value: Value | None
    path: str
    line: int
    visible: bool


@dataclass
class Scope:
    """Symbols of one module, by name in upper case."""

    module: str
    symbols: dict[str, Symbol] = field(default_factory=dict)

    def add(self, symbol: Symbol) -> None:
        """Add a symbol; an assignment gives a value to its declaration."""
        key = symbol.name.upper()
        declared = self.symbols.get(key) or self.symbols.get(key.partition("[")[0])
        if declared is not None and not symbol.type:
            symbol = Symbol(symbol.name, declared.type, symbol.value, symbol.path, symbol.line, declared.visible)
        self.symbols[key] = symbol


def value_of(node: Node) -> Value:
    """Value of an expression; what is neither number nor aggregate is its text."""
    number = number_of(node)
    if number is not None:
        return number
    if node.kind == "aggregate":
        names = node.tokens("NAME")
        members = {member.tokens("NAME")[0].text.upper(): value_of(member.nodes[-1]) for member in node.all("member")}
        return Aggregate(members, names[0].text.upper() if names else "", node.span)
    return node.text


def read_symbols(path: str, statements: Iterable[Statement], module: str, everywhere: bool = False) -> Scope:
    """Symbols of a data list.

    Parameters
    ----------
    path : str
        File of the statements.
    statements : iterable of Statement
        The data list.
    module : str
        Name of its module.
    everywhere : bool
        All of them are global, as in ``$config.dat``.
    """
    scope = Scope(module)
    public = everywhere
    for statement in statements:
        if statement.kind == "data_list":
            public = everywhere or bool(statement.node.tokens("PUBLIC"))
        elif statement.kind == "declaration":
            for symbol in _declared(path, statement, everywhere, public):
                scope.add(symbol)
        elif statement.kind == "assignments":
            for symbol in _assigned(path, statement, everywhere):
                scope.add(symbol)
    return scope


def _declared(path: str, statement: Statement, everywhere: bool, public: bool) -> Iterator[Symbol]:
    node = statement.node
    visible = everywhere or (public and bool(node.tokens("GLOBAL")))
    kind = node.tokens("NAME")[0].text.upper()
    for variable in node.all("variable"):
        values = [child for child in variable.nodes if child.kind != "dimensions"]
        value = value_of(values[-1]) if values else None
        yield Symbol(variable.tokens("NAME")[0].text, kind, value, path, statement.line, visible)


def _assigned(path: str, statement: Statement, everywhere: bool) -> Iterator[Symbol]:
    for assignment in statement.node.all("assignment"):
        reference, expression = assignment.nodes[0], assignment.nodes[-1]
        name = "".join(reference.text.split())
        yield Symbol(name, "", value_of(expression), path, statement.line, everywhere)


def module_key(path: str) -> str:
    """Key of the module that a file belongs to: a ``.src`` and the ``.dat`` beside it."""
    return path.rpartition(".")[0].upper()


def is_own(path: str) -> bool:
    """Whether a file lies in the folder of the robot itself, not in a copy or in the controller's (``STEU``)."""
    return "/r1/" in f"/{path.lower()}"


class Symbols:
    """All data of one robot.

    Two global data of one name cannot both be loaded: where the robot's own folder does not decide, the name is
    ambiguous and has no value.

    Parameters
    ----------
    scopes : iterable of Scope
        One for each data list, by the path of its file without suffix; those of the robot's own folder come first.
    """

    def __init__(self, scopes: Iterable[Scope]) -> None:
        self.scopes: dict[str, Scope] = {}
        self._global: dict[str, Symbol] = {}
        for scope in scopes:
            self.scopes.setdefault(scope.module, scope)
            for key, symbol in scope.symbols.items():
                if symbol.visible:
                    self._add_global(key, symbol)

    def _add_global(self, key: str, symbol: Symbol) -> None:
        other = self._global.setdefault(key, symbol)
        if other is not symbol and is_own(other.path) == is_own(symbol.path):
            self._global[key] = Symbol(other.name, "AMBIGUOUS", None, other.path, other.line, visible=True)

    def find(self, name: str, module: str) -> Symbol | None:
        """Symbol that ``name`` means in a module, or None."""
        key = "".join(name.split()).upper()
        own = self.scopes.get(module)
        if own is not None and key in own.symbols:
            return own.symbols[key]
        return self._global.get(key)

    def config(self, name: str) -> Symbol | None:
        """Symbol of ``$config.dat``, or None."""
        return self._global.get(name.upper())
