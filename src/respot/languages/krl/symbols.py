"""Where a KRL name lives: declarations, assignments and imports of data lists and routines, read as plain values.

A name is looked up in the routine's own data list, then among its imports, then among the global data: what a
``PUBLIC`` data list declares ``GLOBAL``, and everything in ``$config.dat``. A name that the own data list declares
hides the global one with all its elements. Names are compared without case (facts: krl.md sections 1 and 2).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from decimal import Decimal
from typing import NamedTuple, TypeAlias

from respot.issues import Issue
from respot.languages.literals import number_of
from respot.program.statement import Branch, Leaf, Node, Statement
from respot.program.targets import LiteralNumbers, Number
from respot.source import Span

#: Value of a KRL expression: a number, the text of a string, name or enum constant, or an aggregate by member.
Value: TypeAlias = "Number | str | Aggregate"

#: Members of the system's own structures that are positions.
_BUILT_IN = {"LOAD": {"CM": "FRAME"}}
_MOST_NAMES = 5
#: Base of ``'B0101'``, ``'H1F'``, ``'D10'`` by its letter.
_BASES = {"B": 2, "H": 16, "D": 10}


@dataclass(frozen=True)
class Aggregate:
    """``{X 1.0,Y 2.0}`` with members in upper case, its type if it is written, and its place."""

    members: Mapping[str, Value]
    type: str
    span: Span

    def number(self, name: str) -> float | None:
        """Value of a numeric member, else None."""
        if isinstance(self.members, LiteralNumbers):
            return self.members.value(name)
        value = self.members.get(name)
        return float(value.value) if isinstance(value, Number) else None

    def numbers(self) -> Mapping[str, Number]:
        """Return the numeric members."""
        if isinstance(self.members, LiteralNumbers):
            return self.members
        return {name: value for name, value in self.members.items() if isinstance(value, Number)}

    def __str__(self) -> str:
        return ",".join(f"{name} {getattr(value, 'value', value)}" for name, value in self.members.items())


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
    size : tuple of int
        Sizes of a declared array.
    others : tuple of Symbol
        Further global data of this name: the name is ambiguous and has no value.
    """

    name: str
    type: str
    value: Value | None
    path: str
    line: int
    visible: bool
    size: tuple[int, ...] = ()
    others: tuple[Symbol, ...] = ()


@dataclass(frozen=True)
class Import:
    """``IMPORT E6POS XA IS /R1/MODULE..XB``: ``XA`` here is ``XB`` of that module."""

    name: str
    module: str
    target: str
    path: str
    line: int


@dataclass
class Scope:
    """Symbols of one module, by name in upper case; ``bare`` are their names without index."""

    module: str
    path: str = ""
    public: bool = False
    symbols: dict[str, Symbol] = field(default_factory=dict)
    bare: set[str] = field(default_factory=set)
    structures: dict[str, dict[str, str]] = field(default_factory=dict)
    imports: dict[str, Import] = field(default_factory=dict)

    def add(self, symbol: Symbol) -> None:
        """Add a symbol; an assignment gives a value to its declaration."""
        key = symbol.name.upper()
        bare = bare_name(key)
        if not symbol.type:
            declared = self.symbols.get(key) or self.symbols.get(bare)
            if declared is not None:
                symbol = replace(symbol, type=declared.type, visible=declared.visible)
        self.symbols[key] = symbol
        self.bare.add(bare)


def bare_name(name: str) -> str:
    """Return a name without index and member."""
    return name.partition("[")[0].partition(".")[0]


def value_of(node: Node) -> Value:
    """Value of an expression; what is neither number nor aggregate is its text."""
    number = number_of(node) or _bits(node)
    if number is not None:
        return number
    if node.kind == "aggregate":
        names = node.tokens("NAME")
        numbers = _numbers(node)
        if numbers is not None:
            return Aggregate(numbers, names[0].text.upper() if names else "", node.span)
        members: dict[str, Value] = {}
        for member in node.all("member"):
            name = member.tokens("NAME")[0].text.upper()
            nodes = member.nodes
            if len(nodes) > 1 and nodes[0].nodes:  # an element; the whole of a text has no index
                name += "".join(nodes[0].text.split())
            members[name] = value_of(nodes[-1])
        return Aggregate(members, names[0].text.upper() if names else "", node.span)
    return node.text


class _Flat(NamedTuple):
    """Where names and numbers of an aggregate of plain numbers stand among the tokens of its statement."""

    names: tuple[int, ...]
    numbers: tuple[Span, ...]


#: By `id` of the branch, which is kept so that no other gets its `id`; and the names that members had so far.
_FLAT: dict[int, tuple[Branch, _Flat | None]] = {}
_NAMES: dict[tuple[str, ...], tuple[str, ...]] = {}
_MOST_KEPT = 10_000


def _numbers(node: Node) -> LiteralNumbers | None:
    """Members of an aggregate all of which are plain numbers, as nearly all points are; None for any other."""
    branch = node.branch
    known = _FLAT.get(id(branch))
    if known is None:
        if len(_FLAT) > _MOST_KEPT:
            _FLAT.clear()
        known = _FLAT[id(branch)] = (branch, _flat(branch))
    flat = known[1]
    if flat is None:
        return None
    text, tokens = node.source, node.token_spans
    spans = [(tokens[first][0], tokens[last][1]) for first, last in flat.numbers]
    written = tuple([text[slice(*tokens[name])].upper() for name in flat.names])
    names = _NAMES.get(written)
    if names is None:
        if len(_NAMES) > _MOST_KEPT:
            _NAMES.clear()
        names = _NAMES[written] = written
    try:
        return LiteralNumbers(text, names, spans) if len(set(names)) == len(names) else None
    except ValueError:
        return None


def _flat(branch: Branch) -> _Flat | None:
    names: list[int] = []
    numbers: list[Span] = []
    for member in branch.children:
        if isinstance(member, Leaf):  # the type, if it is written
            continue
        name, value = member.children[0], member.children[-1]
        if len(member.children) != 2 or not isinstance(name, Leaf) or not isinstance(value, Branch):
            return None
        if value.kind not in ("number", "signed"):
            return None
        names.append(name.position)
        numbers.append((value.first, value.last))
    return _Flat(tuple(names), tuple(numbers)) if names else None


def _bits(node: Node) -> Number | None:
    """Return the number of a bit string such as ``'B0101'``, in which status and turn are often written."""
    base = _BASES.get(node.text[1:2].upper()) if node.kind == "bits" else None
    try:
        return None if base is None else Number(Decimal(int(node.text[2:-1], base)), node.span)
    except ValueError:  # 'B2'
        return None


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
    scope = Scope(module, path, everywhere)
    for statement in statements:
        kind = statement.kind
        if kind == "data_list":
            scope.public = everywhere or bool(statement.node.tokens("PUBLIC"))
        elif kind == "declaration":
            for symbol in _declared(path, statement, everywhere, scope.public):
                scope.add(symbol)
        elif kind == "assignments":
            for symbol in _assigned(path, statement, everywhere):
                scope.add(symbol)
        else:
            _read_definition(scope, path, statement)
    return scope


def read_definitions(path: str, statements: Iterable[Statement], module: str) -> Scope:
    """Read the imports and structures of a ``.src``; its data belong to its routines."""
    scope = Scope(module, path)
    for statement in statements:
        _read_definition(scope, path, statement)
    return scope


def _read_definition(scope: Scope, path: str, statement: Statement) -> None:
    if statement.kind == "import_":
        node = statement.node
        name = node.tokens("NAME")[0].text
        place, _, target = node.tokens("IMPORT_PATH")[0].text.rpartition("..")
        scope.imports[name.upper()] = Import(name, place.rpartition("/")[2].upper(), target, path, statement.line)
    elif statement.kind == "structure":
        node = statement.node
        members: dict[str, str] = {}
        kind = ""
        for item in node.all("field"):
            names = [token.text.upper() for token in item.tokens("NAME")]
            kind = names[0] if len(names) > 1 else kind
            members[names[-1]] = kind
        scope.structures[node.tokens("NAME")[0].text.upper()] = members


def _declared(path: str, statement: Statement, everywhere: bool, public: bool) -> Iterator[Symbol]:
    node = statement.node
    visible = everywhere or (public and bool(node.tokens("GLOBAL")))
    kind = node.tokens("NAME")[0].text.upper()
    for variable in node.all("variable"):
        nodes = variable.nodes
        value = value_of(nodes[-1]) if nodes and nodes[-1].kind != "dimensions" else None
        size: tuple[int, ...] = ()
        if nodes and nodes[0].kind == "dimensions":
            numbers = [number_of(child) for child in nodes[0].nodes]
            size = tuple(int(number.value) for number in numbers if number is not None)
        yield Symbol(variable.tokens("NAME")[0].text, kind, value, path, statement.line, visible, size)


def _assigned(path: str, statement: Statement, everywhere: bool) -> Iterator[Symbol]:
    for assignment in statement.node.all("assignment"):
        nodes = assignment.nodes
        name = "".join(nodes[0].text.split())
        yield Symbol(name, "", value_of(nodes[-1]), path, statement.line, everywhere)


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
    definitions : iterable of Scope
        Imports and structures of the routines' files.
    """

    def __init__(self, scopes: Iterable[Scope], definitions: Iterable[Scope] = ()) -> None:
        self.scopes: dict[str, Scope] = {}
        self._global: dict[str, Symbol] = {}
        self._structures: dict[str, dict[str, str]] = dict(_BUILT_IN)
        self._by_stem: dict[str, list[Scope]] = {}
        for scope in scopes:
            if self.scopes.setdefault(scope.module, scope) is scope:
                self._by_stem.setdefault(scope.module.rpartition("/")[2], []).append(scope)
            for key, symbol in scope.symbols.items():
                if symbol.visible:
                    self._add_global(key, symbol)
            self._structures.update(scope.structures)
        for scope in definitions:
            if scope.imports:
                self.scopes.setdefault(scope.module, scope).imports.update(scope.imports)
            self._structures.update(scope.structures)

    def _add_global(self, key: str, symbol: Symbol) -> None:
        other = self._global.setdefault(key, symbol)
        if other is not symbol and is_own(other.path) == is_own(symbol.path):
            self._global[key] = replace(other, type="AMBIGUOUS", value=None, others=(*other.others, symbol))

    def find(self, name: str, module: str) -> Symbol | None:
        """Symbol that ``name`` means in a module, or None; also an element, a member, or what an import leads to."""
        return self._find("".join(name.split()).upper(), module, ())

    def _find(self, key: str, module: str, way: tuple[tuple[str, str], ...]) -> Symbol | None:
        bare = bare_name(key)
        own = self.scopes.get(module)
        if own is not None:
            if bare in own.bare:
                return own.symbols.get(key) or self._member(own.symbols, key)
            if bare in own.imports:
                found = self._imported(own.imports[bare])
                if found is None or (module, bare) in way:
                    return None
                return self._find(found[1] + key[len(bare) :], found[0].module, (*way, (module, bare)))
        return self._global.get(key) or self._member(self._global, key)

    def _member(self, symbols: Mapping[str, Symbol], key: str) -> Symbol | None:
        """Member of a structure: ``S.P``, ``LIST[2].P``."""
        root, dot, rest = key.partition(".")
        symbol = symbols.get(root) if dot else None
        if symbol is None:
            return None
        kind, value, name = symbol.type, symbol.value, symbol.name
        for member in rest.split("."):
            kind = self._structures.get(kind, {}).get(member.partition("[")[0], "")
            value = value.members.get(member) if isinstance(value, Aggregate) else None
            name += f".{member}"
        return replace(symbol, name=name, type=kind, value=value, size=()) if kind else None

    def _imported(self, found: Import) -> tuple[Scope, str] | None:
        """Scope and name that an import leads to, if there is just one."""
        scopes = self._by_stem.get(found.module, [])
        scopes = [scope for scope in scopes if is_own(scope.path)] or scopes
        return (scopes[0], found.target.upper()) if len(scopes) == 1 else None

    def imports(self) -> Iterator[tuple[str, str, str, str]]:
        """Yield every import as module and name, and the module and name it leads to."""
        for module, scope in self.scopes.items():
            for name, imported in scope.imports.items():
                found = self._imported(imported)
                if found is not None:
                    yield module, name, found[0].module, bare_name(found[1])

    def owner(self, bare: str, module: str) -> str | None:
        """File that declares what a bare name means in a module; None where that is not known."""
        own = self.scopes.get(module)
        if own is not None and bare in own.bare:
            return own.path
        if own is not None and bare in own.imports:
            return ""  # counted where the import leads to
        symbol = self._global.get(bare)
        return None if symbol is None or symbol.others else symbol.path

    def config(self, name: str) -> Symbol | None:
        """Symbol of ``$config.dat``, or None."""
        return self._global.get(name.upper())

    def hidden(self, name: str) -> Symbol | None:
        """Return a datum of this name in another module, which only that module can see."""
        key = "".join(name.split()).upper()
        return next((scope.symbols[key] for scope in self.scopes.values() if key in scope.symbols), None)

    def issues(self) -> list[Issue]:
        """Report names declared twice, one issue for each two files, and imports that go round in a circle."""
        found: dict[tuple[str, str], list[tuple[Symbol, Symbol]]] = {}
        for key, symbol in self._global.items():
            if symbol.others and symbol.type == "AMBIGUOUS" and "[" not in key:
                for other in symbol.others:
                    found.setdefault((symbol.path, other.path), []).append((symbol, other))
        return [*map(_twice, found.values()), *self._circles()]

    def _circles(self) -> Iterator[Issue]:
        edges = {(module, name): (there, target) for module, name, there, target in self.imports()}
        seen: set[tuple[str, str]] = set()
        for start in edges:
            way: list[tuple[str, str]] = []
            place = start
            while place in edges and place not in seen:
                seen.add(place)
                way.append(place)
                place = edges[place]
            if place in way:
                imported = self.scopes[place[0]].imports[place[1]]
                circle = [*way[way.index(place) :], place]
                names = " -> ".join(f"{module.rpartition('/')[2]}..{name}" for module, name in circle)
                message = (
                    f"IMPORT of {imported.name} leads back to itself: {names}; import it from where it is declared"
                )
                yield Issue("CYCLIC_IMPORT", message, imported.path, imported.line)


def _twice(pairs: list[tuple[Symbol, Symbol]]) -> Issue:
    first, second = pairs[0]
    names = ", ".join(symbol.name for symbol, _ in pairs[:_MOST_NAMES])
    more = f" and {len(pairs) - _MOST_NAMES} more" if len(pairs) > _MOST_NAMES else ""
    message = (
        f"{names}{more} declared globally here and in {second.path}:{second.line}: "
        "the controller loads only one; take the other out of the backup"
    )
    return Issue("AMBIGUOUS_NAME", message, first.path, first.line)
