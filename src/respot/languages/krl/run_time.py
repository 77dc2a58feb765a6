"""What KRL code changes while the robot runs: data it assigns to, and routines that move or set frames."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from respot.languages.forms import Forms
from respot.languages.krl.blocks import Routine as Block
from respot.languages.krl.symbols import Aggregate, Symbol, Symbols, bare_name
from respot.program.statement import OPAQUE, Node, Statement
from respot.program.targets import Number

MOTIONS = frozenset(("motion", "relative_motion", "circular_motion", "touch_up_motion"))
_ELEMENT = re.compile(r"[\w$]+\[([\w$,]+)\]")
#: Left side of an assignment within a statement that no rule knows.
_ASSIGNED = re.compile(r"(?<![\w$.])([\w$]+)(?:\s*\[[^\]]{0,200}\])?(?:\s*\.\s*\w+){0,9}\s*:?=(?!=)")
#: Members of FDAT that are neither frame nor position: torque monitoring and a second point's name (bas.src).
_NO_FRAME = ("TQ_STATE", "POINT2")
#: What an unread statement holds if it might set a frame: its name, or any call.
_FRAME_WORDS = re.compile(r"\$TOOL\b|\$BASE\b|\$LOAD\b|\$IPO_MODE\b|FDAT_ACT|[\w$]\s*\(", re.IGNORECASE)
#: Functions of the system that leave frames alone but write into their arguments.
_WRITING = frozenset(
    [
        "CREAD",
        "SREAD",
        "SWRITE",
        "CAST_FROM",
        "CAST_TO",
        "INVERSE",
        "FORWARD",
        "VARSTATE",
        "STRTOBOOL",
        "STRTOINT",
        "STRTOREAL",
        "MBX_REC",
        "MD_GETSTATE",
    ]
)
#: Functions of KSS itself that change neither frames nor positions; those of frames only make values of frames.
_SYSTEM = frozenset(
    [
        "EK",
        "EB",
        "EB_ABS",
        "EB_TEST",
        "LK",
        "EO",
        "ERR_CLEAR",
        "ERR_RAISE",
        "EXISTS_KRLDLG",
        "GETSYSSTATE",
        "MBX_REC",
        "MD_CMD",
        "MD_GETSTATE",
        "MD_SETSTATE",
    ]
)
_FRAMES = frozenset(("$TOOL", "$BASE", "$LOAD", "$IPO_MODE", "FDAT_ACT"))
_ASSIGNING = frozenset(("assignments", "trigger", "interrupt_declaration"))


def called(statement: Statement) -> Iterator[Node]:
    """Yield every call of a statement: as a statement, in an expression, after DO."""
    yield from statement.find("call", "function_call")


def assignments(statement: Statement) -> list[Node]:
    """Return every assignment that a statement makes, also after DO; those of a WITH list hold for one motion only."""
    return statement.node.all("assignment") if statement.kind in _ASSIGNING else []


def may_touch_frames(statement: Statement) -> bool:
    """Whether an unread statement might set a frame: nobody knows what it does."""
    return statement.kind == OPAQUE and bool(_FRAME_WORDS.search(statement.source))


def left_of(assignment: Node) -> str:
    """Return the left side of an assignment, in upper case without blanks."""
    return "".join(assignment.nodes[0].text.split()).upper()


def arguments_of(call: Node) -> list[Node]:
    """Return the arguments of a call; one that is left out keeps its place."""
    return (call.first("arguments") or call).nodes


def declared_in(block: Block) -> tuple[dict[str, str], list[tuple[str, str]]]:
    """Names, in upper case, that a routine declares itself with their types, and its parameters with their direction.

    A parameter without a direction is passed by reference.
    """
    names: dict[str, str] = {}
    parameters: list[tuple[str, str]] = []
    if block.head.shape.tree is not None:
        for node in (block.head.node.first("parameters") or block.head.node).all("parameter"):
            direction = node.tokens("DIRECTION")
            parameters.append((node.tokens("NAME")[0].text.upper(), direction[0].text.upper() if direction else ""))
    for statement in block.body:
        if statement.kind == "declaration":
            node = statement.node
            kind = node.tokens("NAME")[0].text.upper()
            for variable in node.all("variable"):
                names[variable.tokens("NAME")[0].text.upper()] = kind
    for name, _ in parameters:
        names.setdefault(name, "")
    return names, parameters


@dataclass(frozen=True)
class Passed:
    """The arguments of one call of a routine."""

    module: str
    path: str
    line: int
    arguments: Sequence[str]


class _Elements(set[str]):
    """Indices of the elements that a module writes; empty for the whole datum and for an index that is computed."""

    def __init__(self) -> None:
        super().__init__()
        self.named: set[str] = set()  # those in which a name stands, which may be a constant

    def add(self, element: str) -> None:
        """Add an index."""
        if element.replace(",", "").isdecimal() or not element:
            super().add(element)
        else:
            self.named.add(element)


@dataclass
class RunTime:
    """What the code of a robot changes.

    Parameters
    ----------
    forms : Forms
        Instruction forms.
    symbols : Symbols
        Data of the robot.
    moving : set of str
        Routines, in upper case, that move, themselves or through what they call.
    routines : set of str
        Every routine of the backup, in upper case.
    passed : mapping of str to list of Passed
        Calls of each routine with parameters.
    heads : mapping of str to list
        Directions of the parameters of every routine of a name, in upper case; empty for by reference.
    framing : set of str
        Routines, in upper case, with a harmless name whose code in this backup sets frames all the same.
    from_poses : set of (str, str)
        Module and name, in upper case, of data that are set to the joints of a position (``XJ=INVERSE(XP1,..)``).
    external_tcp : bool
        Something in the backup asks for the external TCP.
    """

    forms: Forms
    symbols: Symbols
    moving: set[str] = field(default_factory=set)
    routines: set[str] = field(default_factory=set)
    passed: dict[str, list[Passed]] = field(default_factory=dict)
    heads: dict[str, list[list[str]]] = field(default_factory=dict)
    framing: set[str] = field(default_factory=set)
    from_poses: set[tuple[str, str]] = field(default_factory=set)
    external_tcp: bool = False
    _written: dict[str, dict[str, _Elements]] = field(default_factory=dict)
    _switched: set[str] = field(default_factory=set)

    def writes(self, symbol: Symbol) -> bool:
        """Whether any code changes a datum or a part of it, itself or through an import."""
        bare = bare_name(symbol.name.upper())
        element = _element(symbol.name.upper())
        if not element.replace(",", "").isdecimal():
            element = ""
        return any(
            (not element or "" in elements or element in elements or self._may_be(element, elements, module))
            and self.symbols.owner(bare, module) in (symbol.path, None)
            for module, elements in self._written.get(bare, {}).items()
        )

    def _may_be(self, element: str, elements: _Elements, module: str) -> bool:
        """Whether one of the elements whose index is a name may be this one."""
        return any(self._number(named, module) in ("", element) for named in elements.named)

    def _number(self, element: str, module: str) -> str:
        """Return the index of an element in numbers; empty where a name in it may have any value."""
        numbers = [part if part.isdecimal() else self._constant(part, module) for part in element.split(",")]
        return ",".join(numbers) if all(numbers) else ""

    def _constant(self, name: str, module: str) -> str:
        """Whole number that a name stands for, if no code writes it; else empty."""
        symbol = self.symbols.find(name, module)
        if symbol is None or symbol.others or not isinstance(symbol.value, Number):
            return ""
        if any(self.symbols.owner(name, other) in (symbol.path, None) for other in self._written.get(name, {})):
            return ""
        value = symbol.value.value
        return str(int(value)) if value == int(value) else ""

    def is_from_pose(self, name: str, module: str) -> bool:
        """Whether code sets what a module knows by a name to the joints of a position, which moves if that does."""
        owner = self.symbols.owner(name, module)
        return any(
            other == name and (there == module or (owner is not None and self.symbols.owner(name, there) == owner))
            for there, other in self.from_poses
        )

    def switches_on(self, name: str) -> bool:
        """Whether any code sets a switch to something other than FALSE."""
        return name.upper() in self._switched

    def is_harmless(self, routine: str) -> bool:
        """Whether a call is known to change neither frames nor positions."""
        name = routine.upper()
        return name not in self.framing and (name in _SYSTEM or self.forms.is_harmless(name))

    def hands_back(self, routine: str, index: int) -> bool:
        """Whether a call may change what it is handed; local routines of several modules may share a name."""
        name = routine.upper()
        if self.is_harmless(name) and name not in _WRITING:
            return False
        known = self.heads.get(name, [])
        return not known or any(index >= len(directions) or directions[index] != "IN" for directions in known)

    def may_move(self, routine: str) -> bool:
        """Whether a call may move the robot; nobody knows what a routine outside the backup does."""
        name = routine.upper()
        return name in self.moving or not (name in self.routines or self.is_harmless(name))

    def add(self, name: str, module: str) -> None:
        """Add a write to a name, with its index and member."""
        self._written.setdefault(bare_name(name), {}).setdefault(module, _Elements()).add(_element(name))

    def add_value(self, name: str, value: str) -> None:
        """Add what is assigned to a name: a switch that is only ever set to FALSE stays off."""
        if value.strip().upper() != "FALSE":
            self._switched.add(name)

    def follow_imports(self) -> None:
        """Count a write to an imported name as one to the datum itself."""
        imports = list(self.symbols.imports())
        growing = True
        while growing:
            growing = False
            for module, name, there, target in imports:
                found = self._written.get(name, {}).get(module)
                if found is not None:
                    elements = self._written.setdefault(target, {}).setdefault(there, _Elements())
                    before = len(elements)
                    elements.update(found)
                    if found.named:
                        elements.add("")  # names mean others over there
                    growing |= len(elements) != before


def _element(name: str) -> str:
    """Return the index of an element, of numbers and names; empty for a whole datum and for one that is computed."""
    match = _ELEMENT.match(name)
    return match[1] if match else ""


def read_run_time(code: Mapping[str, tuple[str, Iterable[Block]]], forms: Forms, symbols: Symbols) -> RunTime:
    """Read what the routines change.

    Parameters
    ----------
    code : mapping of str to (str, iterable of Block)
        Module and routines of each file.
    forms : Forms
        Instruction forms.
    symbols : Symbols
        Data of the robot.
    """
    found = RunTime(forms, symbols)
    found.external_tcp = any(
        str(symbol.value.members.get("IPO_FRAME", "")).upper() == "#TCP"
        for scope in symbols.scopes.values()
        for symbol in scope.symbols.values()
        if symbol.type == "FDAT" and isinstance(symbol.value, Aggregate)
    )
    locals_of: dict[int, dict[str, str]] = {}
    for _, blocks in code.values():
        for block in blocks:
            locals_of[id(block)], parameters = declared_in(block)
            if found.is_harmless(block.name) and _sets_frames(block):
                found.framing.add(block.name.upper())
            found.heads.setdefault(block.name.upper(), []).append([direction for _, direction in parameters])
    found.routines = set(found.heads)
    calls: dict[str, set[str]] = {}
    for path, (module, blocks) in code.items():
        for block in blocks:
            reader = _Reader(found, module, path, locals_of[id(block)])
            for statement in block.body:
                reader.read(statement)
            calls.setdefault(block.name.upper(), set()).update(reader.calls)
            if reader.moves:
                found.moving.add(block.name.upper())
    found.follow_imports()
    _spread(found.moving, calls)
    return found


def _sets_frames(block: Block) -> bool:
    """Whether a routine itself sets a tool, base or mode."""
    for statement in block.body:
        if any(left_of(assignment).partition(".")[0] in _FRAMES for assignment in assignments(statement)):
            return True
        if any("".join(token.text for token in node.tokens("NAME")[:1]).upper() == "BAS" for node in called(statement)):
            return True
    return False


def _spread(names: set[str], calls: Mapping[str, set[str]]) -> None:
    """Add every routine that calls one of these, directly or not."""
    callers: dict[str, set[str]] = {}
    for caller, called_names in calls.items():
        for name in called_names:
            callers.setdefault(name, set()).add(caller)
    pending = list(names)
    while pending:
        for caller in callers.get(pending.pop(), ()):
            if caller not in names:
                names.add(caller)
                pending.append(caller)


class _Reader:
    """Reads the statements of one routine."""

    def __init__(self, found: RunTime, module: str, path: str, local: Mapping[str, str]) -> None:
        self.calls: set[str] = set()
        self.moves = False
        self._found = found
        self._module = module
        self._path = path
        self._local = local

    def read(self, statement: Statement) -> None:
        """Read one statement."""
        kind = statement.kind
        if kind in MOTIONS:
            self.moves = True
        elif kind in _ASSIGNING:
            for assignment in statement.node.all("assignment"):
                self._assignment(assignment)
        elif kind == "for_":
            self._write("".join(statement.node.nodes[0].text.split()).upper())  # the counter
        elif kind == OPAQUE:
            for match in _ASSIGNED.finditer(statement.source.upper()):
                self._write(match[1])
        if "#" in statement.source:
            self._found.external_tcp |= kind != "comment" and "#TCP" in statement.source.upper()
        for node in called(statement):
            self._call(node, statement.line)

    def _assignment(self, assignment: Node) -> None:
        name = left_of(assignment)
        self._write(name)
        if any(called.tokens("NAME")[0].text.upper() == "INVERSE" for called in assignment.all("function_call")):
            self._found.from_poses.add((self._module, bare_name(name)))
        if name.endswith("_ON"):
            self._found.add_value(name, assignment.nodes[-1].text)

    def _write(self, name: str) -> None:
        bare, _, member = name.partition(".")
        if bare_name(name) in self._local or member.partition("[")[0] in _NO_FRAME:
            return
        local = any(part in self._local for part in _element(bare).split(","))
        self._found.add(bare_name(name) if local else name, self._module)

    def _call(self, node: Node, line: int) -> None:
        name = node.tokens("NAME")[0].text.upper()
        self.calls.add(name)
        if self._found.is_harmless(name) and name not in _WRITING:
            return
        arguments = arguments_of(node)
        if name in self._found.heads and arguments:
            texts = [argument.text.strip() for argument in arguments]
            self._found.passed.setdefault(name, []).append(Passed(self._module, self._path, line, texts))
        for index, argument in enumerate(arguments):
            if argument.kind == "reference" and self._found.hands_back(name, index):
                text = "".join(argument.text.split()).upper()
                self._write(text)
                if bare_name(text).endswith("_ON"):
                    self._found.add_value(text, "")
