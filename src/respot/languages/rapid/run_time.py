"""What RAPID code changes while the robot runs: data that it assigns to, hands to what changes it, or sets by name."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from respot.languages.forms import Forms
from respot.languages.rapid.blocks import Routine as Block
from respot.languages.rapid.calls import Argument, Invocation
from respot.languages.rapid.forms import FORMS, instruction_form
from respot.languages.rapid.records import POSITIONS
from respot.languages.rapid.symbols import Module, Parameter, Symbol, Task
from respot.program.statement import OPAQUE, Node

#: Motions that write where they found something into their second argument.
_SEARCHING = frozenset(("searchl", "searchc"))
#: Instructions of RobotWare that change their first argument.
_COUNTING = frozenset(("add", "incr", "decr", "clear", "bitset", "bitclear"))
#: Instructions and functions of RobotWare that may write into any datum they are given.
_WRITING = frozenset(
    (
        "strtoval", "unpackrawbytes", "readanybin", "readrawbytes", "getsysdata", "getdataval", "readvar", "readblock",
        "readcfgdata", "mtooltcpcalib", "mtoolrotcalib", "stooltcpcalib", "stoolrotcalib", "recalctcp", "getnextsym",
        "alignwobj", "waittestandset", "rmqgetmsgdata",
    )
)  # fmt: skip
#: What a statement that no rule knows assigns to; an argument such as ``\WObj:=`` is none.
_ASSIGNED = re.compile(r"(?<![\w.\\])([A-Za-z]\w*)(?:\s*\{[^}]{0,200}\})?(?:\s*\.\s*\w+){0,9}\s*:=")
#: Makes joints of a position, which move if the position does.
JOINTS_OF_POSE = "calcjointt"
_BY_NAME = frozenset(("setdataval", "setalldataval"))
_BY_REFERENCE = frozenset(("INOUT", "VAR", "PERS"))
#: What a datum that is set by a computed name may be, where the value does not tell its type.
_ANY_POSE = POSITIONS | {"tooldata", "wobjdata", "loaddata", "pose", "pos"}


@dataclass
class RunTime:
    """What the code of a task changes.

    Parameters
    ----------
    written : set of tuple
        Keys of data that code of the task assigns to, or has changed by something it calls.
    by_type : set of (str, str)
        Type and first letters of data that are set by a name that is computed, in lower case.
    changed : dict
        Parameters, in lower case, that each routine changes, by the identity of its block.
    from_poses : set of tuple
        Keys of data that are set to the joints of a position (``jt:=CalcJointT(p10,..)``).
    shared : dict
        Persistent data that several tasks declare, by name and type.
    shared_written : set of (str, str)
        Those of them that any task changes.
    """

    written: set[tuple[str, int, str]] = field(default_factory=set)
    by_type: set[tuple[str, str]] = field(default_factory=set)
    changed: dict[int, frozenset[str]] = field(default_factory=dict)
    from_poses: set[tuple[str, int, str]] = field(default_factory=set)
    shared: Mapping[tuple[str, str], Sequence[Symbol]] = field(default_factory=dict)
    shared_written: set[tuple[str, str]] = field(default_factory=set)

    def changes(self, symbol: Symbol) -> str:
        """Why the value of a datum is not that of its declaration; empty if it is."""
        if symbol.storage == "CONST":
            return ""
        if symbol.key in self.written:
            return "is assigned to while the robot runs"
        name = symbol.name.lower()
        if symbol.shared and (name, symbol.type) in self.shared_written:
            return "is assigned to by another task while the robot runs"
        if any(symbol.type == kind and name.startswith(prefix) for kind, prefix in self.by_type):
            return "may be set while the robot runs by SetDataVal, under a name that is computed"
        return ""

    def is_shared(self, symbol: Symbol) -> bool:
        """Whether several tasks hold one datum."""
        return symbol.shared and (symbol.name.lower(), symbol.type) in self.shared


def read_run_time(tasks: Mapping[str, Sequence[Module]], forms: Forms = FORMS) -> dict[str, RunTime]:
    """Read what the code of each task changes."""
    readers = {name: _Reader(Task(modules), forms) for name, modules in tasks.items()}
    declared: dict[tuple[str, str], dict[str, Symbol]] = {}
    for name, reader in readers.items():
        for module in reader.task.modules:
            for symbol in module.symbols.values():
                if symbol.shared:
                    declared.setdefault((symbol.name.lower(), symbol.type), {})[name] = symbol
    shared = {key: tuple(found.values()) for key, found in declared.items() if len(found) > 1}
    found = {name: reader.read() for name, reader in readers.items()}
    everywhere = {key for run_time in found.values() for key in run_time.written}
    shared_written = {key for key, symbols in shared.items() if any(symbol.key in everywhere for symbol in symbols)}
    for reader in readers.values():
        for name in reader.named_in_all_tasks:
            shared_written |= {key for key in shared if key[0] == name}
            for other in readers.values():
                other.run_time.written |= {symbol.key for symbol in other.task.all_named(name)}
    for run_time in found.values():
        run_time.shared, run_time.shared_written = shared, shared_written
    return found


class _Reader:
    """One pass over the code of a task."""

    def __init__(self, task: Task, forms: Forms) -> None:
        self.task = task
        self._forms = forms
        self.run_time = RunTime()
        #: data that are set by name in whatever task
        self.named_in_all_tasks: set[str] = set()
        self._changed: dict[int, set[str]] = {}
        #: parameters of callees and what is handed to them: (callee, parameter) -> routine and datum
        self._handed: dict[tuple[int, str], list[tuple[Block, Symbol]]] = {}

    def read(self) -> RunTime:
        """Return what the task's code changes."""
        for module in self.task.modules:
            for block in module.routines.values():
                self._read_routine(block, module)
        pending = [(block, name) for block, names in self._changed.items() for name in names]
        while pending:
            callee, name = pending.pop()
            for caller, symbol in self._handed.get((callee, name), ()):
                if self._change(symbol, caller):
                    pending.append((id(caller), symbol.name.lower()))
        self.run_time.changed = {block: frozenset(names) for block, names in self._changed.items()}
        return self.run_time

    def _read_routine(self, block: Block, module: Module) -> None:
        local = self.task.locals(block, module)
        for line in module.lines(block):
            joints = any(call.name.lower() == JOINTS_OF_POSE for call in line.calls)
            for name, _ in line.assigned:
                symbol = self.task.find(name, module, local)
                self._change(symbol, block)
                if joints and symbol is not None:
                    self.run_time.from_poses.add(symbol.key)
            for call in line.calls:
                self._read_call(call, block, module, local)
        for statement in block.body:
            if statement.kind == OPAQUE:
                for match in _ASSIGNED.finditer(statement.source):
                    self._change(self.task.find(match[1], module, local), block)

    def _change(self, symbol: Symbol | None, block: Block) -> bool:
        """Note that a routine changes a datum; whether that is new about a parameter of its own."""
        if symbol is None:
            return False
        if symbol.storage != "parameter":
            self.run_time.written.add(symbol.key)
            return False
        names = self._changed.setdefault(id(block), set())
        new = symbol.name.lower() not in names
        names.add(symbol.name.lower())
        return new

    def _read_call(self, call: Invocation, block: Block, module: Module, local: dict[str, Symbol]) -> None:
        name = call.name.lower()
        if name in _BY_NAME:
            self._set_by_name(name, call, module, local)
            return
        callees = self._callees(call, module)
        for callee in callees:
            for parameter, argument in bound(self.task.parameters(callee), call.arguments()):
                symbol = self._datum(argument, module, local)
                if symbol is not None and parameter.access in _BY_REFERENCE:
                    key = (id(callee), parameter.name.lower())
                    self._handed.setdefault(key, []).append((block, symbol))
        if callees:
            return
        if name in _SEARCHING or name in _COUNTING:
            positional = [item for item in call.arguments() if item.kind == "argument"]
            changed = positional[1:2] if name in _SEARCHING else positional[:1]
            for argument in changed:
                self._change(self._datum(argument, module, local), block)
        elif name in _WRITING:
            for argument in call.arguments():
                for reference in _references(argument.value):
                    self._change(self.task.find(reference, module, local), block)

        elif not call.is_function and instruction_form(name) is None and not self._forms.is_harmless(name):
            self._read_unknown(call, block, module, local)

    def _callees(self, call: Invocation, module: Module) -> list[Block]:
        """Routines that a call may mean; of one that is bound late all whose names begin alike."""
        if call.name:
            found = self.task.routine(call.name, module)
            return [] if found is None else [found[0]]
        name = call.late_name()
        start = "" if name is None else literal_start(name).lower()
        return [
            block
            for other in self.task.modules
            for key, block in other.routines.items()
            if key.startswith(start) and (not block.local or other is module)
        ]

    def _read_unknown(self, call: Invocation, block: Block, module: Module, local: dict[str, Symbol]) -> None:
        """Count a work object as changed that a routine outside of the backup is handed, unless as that of a motion."""
        given = [item for item in call.arguments() if not item.name]
        symbols = [symbol for item in given if (symbol := self._datum(item, module, local)) is not None]
        types = [self.task.type_of(symbol.type, module) for symbol in symbols]
        if not POSITIONS & set(types) and not any(item.value and item.value.kind == "aggregate" for item in given):
            for symbol, kind in zip(symbols, types, strict=True):
                if kind == "wobjdata":
                    self._change(symbol, block)

    def _datum(self, argument: Argument, module: Module, local: dict[str, Symbol]) -> Symbol | None:
        name = argument.given
        if argument.value is not None and argument.value.kind == "reference":
            name = argument.value.nodes[0].text
        return self.task.find(name, module, local) if name else None

    def _set_by_name(self, name: str, call: Invocation, module: Module, local: dict[str, Symbol]) -> None:
        arguments = call.arguments()
        positional = [item.value for item in arguments if item.kind == "argument" and item.value is not None]
        if not positional:
            return
        text = positional[0].text
        if name == "setalldataval":
            self.run_time.by_type |= {(kind, "") for kind in self._types(text.strip('"').lower(), None, module, local)}
        elif positional[0].kind == "string":
            own = text.strip('"').lower()
            if any(item.name in ("taskref", "taskname") for item in arguments):
                self.named_in_all_tasks.add(own)
            self.run_time.written |= {symbol.key for symbol in self.task.all_named(own)}
        else:
            kinds = self._types("", positional[-1], module, local)
            prefix = literal_start(positional[0]).lower()
            self.run_time.by_type |= {(kind, prefix) for kind in kinds}

    def _types(self, name: str, value: Node | None, module: Module, local: dict[str, Symbol]) -> Iterable[str]:
        if name:
            return [name]
        if value is not None and value.kind == "reference" and len(value.nodes) == 1:
            symbol = self.task.find(value.text, module, local)
            return [symbol.type] if symbol is not None else _ANY_POSE
        return [] if value is not None and value.kind in ("number", "string", "boolean") else _ANY_POSE


def bound(found: Sequence[Parameter], arguments: Sequence[Argument]) -> Iterator[tuple[Parameter, Argument]]:
    """Yield each argument of a call with the parameter that it is for; what the head does not have is left out."""
    required = iter([parameter for parameter in found if not parameter.optional])
    by_name = {parameter.name.lower(): parameter for parameter in found}
    for argument in arguments:
        parameter = by_name.get(argument.name) if argument.name else next(required, None)
        if parameter is not None:
            yield parameter, argument


def literal_start(node: Node) -> str:
    """Return the literal text that a computed name begins with: ``"rStyle"`` of ``"rStyle"+NumToStr(n,0)``."""
    while node.kind in ("sum", "group") and node.nodes:
        node = node.nodes[0]
    return node.text.strip('"') if node.kind == "string" else ""


def _references(node: Node | None) -> Iterator[str]:
    """Yield the name of every datum in an expression."""
    for part in () if node is None else node.walk():
        if part.kind == "reference":
            yield part.nodes[0].text
