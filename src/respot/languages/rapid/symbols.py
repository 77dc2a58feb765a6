"""Where a RAPID name lives: routine, module, task; data, their types and their values.

Search order: the routine's own data and parameters, the module's data, then the data of the task's other modules that
are not LOCAL (facts: rapid.md 1.4, scope). Names are compared without case. A plain PERS of several tasks, of one name
and type, is one datum; a TASK PERS is the task's own.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple, TypeAlias
from weakref import WeakKeyDictionary

from respot.issues import Issue
from respot.languages.literals import number_of
from respot.languages.rapid.blocks import Layout
from respot.languages.rapid.blocks import Routine as Block
from respot.languages.rapid.calls import Line, first_spans, read_lines
from respot.languages.rapid.records import BUILT_IN, Fields
from respot.program.statement import Branch, Leaf, Node, Shape, Statement
from respot.program.targets import Number
from respot.source import Span

#: Value of an expression: a number, an aggregate, or the text of anything else.
Value: TypeAlias = "Number | str | Aggregate"

#: Of every two modules that declare the same names so many names are told.
_MOST_NAMES = 5


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


@dataclass(frozen=True, eq=False)
class Symbol:
    """A datum.

    Parameters
    ----------
    name, type : str
        As declared; the type in lower case.
    storage : str
        ``CONST``, ``PERS``, ``VAR``, ``parameter``, or ``counter`` of a FOR loop.
    path : str
        File.
    line : int
        Line.
    local : bool
        Known in its module, or routine, only.
    own_task : bool
        Declared TASK: no other task shares it.
    dimensions : int
        How many indices an element needs; 0 for a single datum.
    statement : Statement or None
        Its declaration; None of a parameter.
    initial : Branch or None
        Its initial value in the tree of the declaration.
    """

    name: str
    type: str
    storage: str
    path: str
    line: int
    local: bool
    own_task: bool = False
    dimensions: int = 0
    statement: Statement | None = None
    initial: Branch | None = None

    @property
    def key(self) -> tuple[str, int, str]:
        """What tells it from every other datum of the backup."""
        return self.path, self.line, self.name.lower()

    @property
    def node(self) -> Node | None:
        """Its initial value."""
        if self.statement is None or self.initial is None:
            return None
        return Node(self.statement.text, self.statement.tokens(), self.initial)

    @cached_property
    def value(self) -> Value | None:
        """Its initial value as plain values."""
        node = self.node
        return None if node is None else value_of(node)

    @property
    def shared(self) -> bool:
        """Whether other tasks that declare it hold the same datum."""
        return self.storage == "PERS" and not self.local and not self.own_task

    @property
    def place(self) -> str:
        """File and line, for messages."""
        return f"{self.path}:{self.line}"


class Parameter(NamedTuple):
    """A parameter of a routine; ``access`` is empty where it gets a copy of the value."""

    name: str
    type: str
    access: str
    optional: bool
    dimensions: int


@dataclass
class Module:
    """Names of one module: its data, its record types and its routines."""

    name: str
    path: str
    symbols: dict[str, Symbol] = field(default_factory=dict)
    routines: dict[str, Block] = field(default_factory=dict)
    records: dict[str, Fields] = field(default_factory=dict)
    aliases: dict[str, str] = field(default_factory=dict)
    issues: list[Issue] = field(default_factory=list)
    _lines: dict[int, list[Line]] = field(default_factory=dict)

    def lines(self, block: Block) -> list[Line]:
        """Return the statements of a routine with their calls; read once."""
        found = self._lines.get(id(block))
        if found is None:
            found = self._lines[id(block)] = read_lines(block.body)
        return found


def value_of(node: Node) -> Value:
    """Value of an expression; what is neither number nor aggregate is its text."""
    number = number_of(node)
    if number is not None:
        return number
    if node.kind == "aggregate":
        return Aggregate([value_of(item) for item in node.nodes], node.span)
    return node.text


class _DataPlace(NamedTuple):
    storage: int
    type: int
    name: int
    local: bool
    own_task: bool
    dimensions: int
    value: Branch | None


_KNOWN: WeakKeyDictionary[Shape, _DataPlace] = WeakKeyDictionary()


def data_symbol(path: str, statement: Statement) -> Symbol | None:
    """Symbol of a data declaration."""
    shape = statement.shape
    if shape.tree is None:
        return None
    place = _KNOWN.get(shape)
    if place is None:
        place = _KNOWN[shape] = _data_place(shape.tree)
    text, spans = statement.text, first_spans(statement, place.name + 1)
    return Symbol(
        name=text[slice(*spans[place.name])],
        type=text[slice(*spans[place.type])].lower(),
        storage=text[slice(*spans[place.storage])].upper(),
        path=path,
        line=statement.line,
        local=place.local,
        own_task=place.own_task,
        dimensions=place.dimensions,
        statement=statement,
        initial=place.value,
    )


def _data_place(tree: Branch) -> _DataPlace:
    leaves = {child.type: child.position for child in tree.children if isinstance(child, Leaf)}
    branches = [child for child in tree.children if isinstance(child, Branch)]
    names = [branch for branch in branches if branch.kind == "name"]
    dimensions = next((branch for branch in branches if branch.kind == "dimensions"), None)
    values = [branch for branch in branches[2:] if branch.kind != "dimensions"]
    return _DataPlace(
        leaves["STORAGE"],
        names[0].first,
        names[1].first,
        "LOCAL" in leaves,
        "TASK" in leaves,
        0 if dimensions is None else sum(isinstance(child, Branch) for child in dimensions.children),
        values[0] if values else None,
    )


def read_module(path: str, name: str, layout: Layout) -> Module:
    """Names of a module."""
    module = Module(name, path)
    for statement in layout.data:
        if statement.kind == "data":
            symbol = data_symbol(path, statement)
            if symbol is not None:
                module.symbols[symbol.name.lower()] = symbol
        elif statement.kind == "alias":
            names = [node.text.lower() for node in statement.node.all("name")]
            module.aliases[names[1]] = names[0]
    for record in layout.records:
        module.records[record.name.lower()] = tuple((part.type.lower(), part.name.lower()) for part in record.fields)
    for block in layout.routines:
        first = module.routines.setdefault(block.name.lower(), block)
        if first is not block:
            message = f"{block.name} is a routine at line {first.head.line} already: its second body is not followed"
            module.issues.append(Issue("AMBIGUOUS_NAME", message, path, block.head.line))
    return module


def parameters(block: Block) -> list[Parameter]:
    """Parameters of a routine, in order; switches are among them."""
    if block.head.shape.tree is None:
        return []
    found = block.head.node.first("parameters")
    result: list[Parameter] = []
    for node in [] if found is None else found.nodes:
        optional = node.kind == "optional_parameter"
        result += (
            _parameter(part, optional) for part in (node.nodes if optional else [node]) if part.kind == "parameter"
        )
    return result


def _parameter(node: Node, optional: bool) -> Parameter:
    names = [name.text for name in node.all("name")]
    access = [token.text.upper() for token in node.tokens("ACCESS")]
    return Parameter(names[-1], names[0].lower(), access[0] if access else "", optional, node.text.count("*"))


def routine_symbols(path: str, block: Block) -> dict[str, Symbol]:
    """Parameters and data of a routine, by name in lower case."""
    found = {
        item.name.lower(): Symbol(
            item.name, item.type, "parameter", path, block.head.line, local=True, dimensions=item.dimensions
        )
        for item in parameters(block)
    }
    for statement in block.body:
        symbol = data_symbol(path, statement) if statement.kind == "data" else None
        if symbol is not None:
            found[symbol.name.lower()] = replace(symbol, local=True)
    for statement in block.body:
        if statement.kind == "for_":
            counter = statement.node.nodes[0].text  # hides a constant of its name while the loop runs
            if counter.lower() not in found or found[counter.lower()].storage == "CONST":
                found[counter.lower()] = Symbol(counter, "num", "counter", path, statement.line, local=True)
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
        self._global: dict[str, list[Symbol]] = {}
        self._routines: dict[str, list[tuple[Block, Module]]] = {}
        self._records: dict[str, Fields] = {}
        self._aliases: dict[str, str] = {}
        self._locals: dict[int, dict[str, Symbol]] = {}
        self._parameters: dict[int, list[Parameter]] = {}
        for module in self.modules:
            for key, symbol in module.symbols.items():
                if not symbol.local:
                    self._global.setdefault(key, []).append(symbol)
            for key, block in module.routines.items():
                if not block.local:
                    self._routines.setdefault(key, []).append((block, module))
            for key, fields in module.records.items():
                self._records.setdefault(key, fields)
            for key, original in module.aliases.items():
                self._aliases.setdefault(key, original)

    def locals(self, block: Block, module: Module) -> dict[str, Symbol]:
        """Return parameters and data of a routine, by name in lower case; read once."""
        found = self._locals.get(id(block))
        if found is None:
            found = self._locals[id(block)] = routine_symbols(module.path, block)
        return found

    def parameters(self, block: Block) -> list[Parameter]:
        """Return the parameters of a routine; read once."""
        found = self._parameters.get(id(block))
        if found is None:
            found = self._parameters[id(block)] = parameters(block)
        return found

    def find(self, name: str, module: Module, local: Mapping[str, Symbol]) -> Symbol | None:
        """Datum that ``name`` means in a routine with the names ``local``, or None."""
        key = name.lower()
        found = local.get(key) or module.symbols.get(key)
        if found is not None:
            return found
        others = self._global.get(key)
        return others[0] if others else None

    def rivals(self, symbol: Symbol, module: Module) -> Sequence[Symbol]:
        """Return all that a name may mean seen from a module, if it is declared globally in several others."""
        found = self._global.get(symbol.name.lower(), ())
        return found if len(found) > 1 and not symbol.local and symbol.path != module.path else ()

    def all_named(self, name: str) -> list[Symbol]:
        """Return every datum of a name that a module of the task declares, LOCAL ones too."""
        key = name.lower()
        return [module.symbols[key] for module in self.modules if key in module.symbols]

    def routine(self, name: str, module: Module) -> tuple[Block, Module] | None:
        """Return the routine that ``name`` calls from a module with the module it stands in; None if there is none."""
        key = name.lower()
        own = module.routines.get(key)
        if own is not None:
            return own, module
        others = self._routines.get(key)
        return others[0] if others else None

    def type_of(self, name: str, module: Module) -> str:
        """Type that a name of a type stands for: aliases are followed."""
        for _ in range(10):
            if name in BUILT_IN or name in module.records:
                return name
            original = module.aliases.get(name) or self._aliases.get(name)
            if original is None:
                return name
            name = original
        return name

    def fields(self, kind: str, module: Module) -> Fields | None:
        """Return type and name of each field of a record type; None of any other type."""
        return BUILT_IN.get(kind) or module.records.get(kind) or self._records.get(kind)

    def ambiguities(self) -> list[Issue]:
        """Report globals of one name in several modules, once for each two modules."""
        pairs: dict[tuple[str, str], list[tuple[Symbol, Symbol]]] = {}
        for symbols in self._global.values():
            for other in symbols[1:]:
                pairs.setdefault((symbols[0].path, other.path), []).append((symbols[0], other))
        routines: dict[tuple[str, str], list[str]] = {}
        issues = []
        for found in pairs.values():
            first, other = found[0]
            names = ", ".join(symbol.name for symbol, _ in found[:_MOST_NAMES])
            more = f" and {len(found) - _MOST_NAMES} more" if len(found) > _MOST_NAMES else ""
            message = (
                f"{names}{more}: declared globally at {first.place} and {other.place}; "
                "a controller cannot load both: leave out the module that is not in use"
            )
            issues.append(Issue("AMBIGUOUS_NAME", message, other.path, other.line))
        for blocks in self._routines.values():
            for block, module in blocks[1:]:
                routines.setdefault((blocks[0][1].path, module.path), []).append(block.name)
        for (path, other_path), names_of in routines.items():
            shown = ", ".join(names_of[:_MOST_NAMES])
            more = f" and {len(names_of) - _MOST_NAMES} more" if len(names_of) > _MOST_NAMES else ""
            message = f"{shown}{more}: routines of {path} and of {other_path} have the same global name"
            issues.append(Issue("AMBIGUOUS_NAME", message, other_path))
        return issues
