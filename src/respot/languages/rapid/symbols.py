"""Where a RAPID name lives: routine, module, task; data read as plain values.

Search order: the routine's own data and parameters, the module's data, then the data of the task's other modules that
are not LOCAL (facts: rapid.md 1.4, scope). Names are compared without case.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

from respot.languages.literals import number_of
from respot.languages.rapid.blocks import Layout
from respot.languages.rapid.blocks import Routine as Block
from respot.program.statement import Node, Statement
from respot.program.targets import Number
from respot.source import Span

#: Value of an expression: a number, an aggregate, or the text of anything else.
Value: TypeAlias = "Number | str | Aggregate"


@dataclass(frozen=True)
class Aggregate:
    """``[1,2,[3,4]]`` and its place."""

    items: Sequence[Value]
    span: Span

    def numbers(self) -> list[Number] | None:
        """Return all items if every one is a number, else None."""
        found = [item for item in self.items if isinstance(item, Number)]
        return found if len(found) == len(self.items) else None

    def shape(self) -> tuple[int, ...]:
        """Lengths of the items that are aggregates themselves; 0 for any other item."""
        return tuple(len(item.items) if isinstance(item, Aggregate) else 0 for item in self.items)


@dataclass(frozen=True)
class Symbol:
    """A datum.

    Parameters
    ----------
    name, type : str
        As declared; the type in lower case.
    storage : str
        ``CONST``, ``PERS``, ``VAR``, or ``parameter``.
    value : Value or None
        Its initial value.
    path : str
        File.
    line : int
        Line.
    local : bool
        Known in its module only.
    """

    name: str
    type: str
    storage: str
    value: Value | None
    path: str
    line: int
    local: bool


@dataclass
class Module:
    """Names of one module: its data and its routines."""

    name: str
    path: str
    symbols: dict[str, Symbol] = field(default_factory=dict)
    routines: dict[str, Block] = field(default_factory=dict)


def value_of(node: Node) -> Value:
    """Value of an expression; what is neither number nor aggregate is its text."""
    number = number_of(node)
    if number is not None:
        return number
    if node.kind == "aggregate":
        return Aggregate([value_of(item) for item in node.nodes], node.span)
    return node.text


def data_symbol(path: str, statement: Statement) -> Symbol | None:
    """Symbol of a data declaration."""
    node = statement.node
    names = node.all("name")
    if len(names) < 2:
        return None
    values = [child for child in node.nodes if child.kind not in ("name", "dimensions")]
    storage = node.tokens("STORAGE")[0].text.upper()
    value = value_of(values[0]) if values else None
    local = bool(node.tokens("LOCAL"))
    return Symbol(names[1].text, names[0].text.lower(), storage, value, path, statement.line, local)


def read_module(path: str, name: str, layout: Layout) -> Module:
    """Names of a module."""
    module = Module(name, path)
    for statement in layout.data:
        symbol = data_symbol(path, statement) if statement.kind == "data" else None
        if symbol is not None:
            module.symbols[symbol.name.lower()] = symbol
    for block in layout.routines:
        module.routines.setdefault(block.name.lower(), block)
    return module


def routine_symbols(path: str, block: Block) -> dict[str, Symbol]:
    """Parameters and data of a routine, by name in lower case."""
    found: dict[str, Symbol] = {}
    if block.head.shape.tree is not None:
        for node in block.head.node.walk():
            names = node.all("name")
            if node.kind == "parameter" and len(names) == 2:
                parameter = names[1].text
                found[parameter.lower()] = Symbol(
                    parameter, names[0].text.lower(), "parameter", None, path, block.head.line, local=True
                )
    for statement in block.body:
        symbol = data_symbol(path, statement) if statement.kind == "data" else None
        if symbol is not None:
            found[symbol.name.lower()] = symbol
    return found


class Task:
    """The modules that one task has loaded.

    Parameters
    ----------
    modules : iterable of Module
        Its modules, in order.
    """

    def __init__(self, modules: Iterable[Module]) -> None:
        self.modules = list(modules)
        self._global: dict[str, Symbol] = {}
        for module in self.modules:
            for key, symbol in module.symbols.items():
                if not symbol.local:
                    self._global.setdefault(key, symbol)

    def find(self, name: str, module: Module, local: dict[str, Symbol]) -> Symbol | None:
        """Datum that ``name`` means in a routine with the names ``local``, or None."""
        key = name.lower()
        return local.get(key) or module.symbols.get(key) or self._global.get(key)

    def has_routine(self, name: str, module: Module) -> bool:
        """Whether ``name`` is a routine of the task."""
        key = name.lower()
        if key in module.routines:
            return True
        return any(key in other.routines and not other.routines[key].local for other in self.modules)
