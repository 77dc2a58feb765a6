"""Tools, work objects and loads as the motions of a task name them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

from respot.languages.rapid import machine
from respot.languages.rapid.references import Datum, resolve, whole
from respot.languages.rapid.run_time import RunTime
from respot.languages.rapid.symbols import Module, Symbol, Task, Value, value_of
from respot.languages.rapid.targets import Keys
from respot.program.frames import Frame, Load, Role
from respot.program.statement import Node

_READERS: dict[str, Callable[[str, Value | None, str, int], Frame]] = {
    "tooldata": machine.read_tool,
    "wobjdata": machine.read_work_object,
}
_WHAT = {"tooldata": "tool", "wobjdata": "work object"}
_ROLES: Mapping[str, Role] = {"tooldata": "tool", "wobjdata": "base"}


@dataclass(frozen=True)
class FrameUse:
    """The tool or work object of a motion.

    Parameters
    ----------
    frame : Frame or None
        None where the routine's caller decides, and where nothing tells.
    parameter : str
        Parameter, in lower case, that the routine gets it as.
    absent : Frame or None
        What holds if that parameter is not given.
    load : Load or None
        Of a tool: what the robot carries.
    """

    frame: Frame | None = None
    parameter: str = ""
    absent: Frame | None = None
    load: Load | None = None


NO_FRAME = FrameUse()
FLANGE = FrameUse(machine.TOOL0)
WORLD = FrameUse(machine.WOBJ0)


class Frames:
    """Tools and work objects of a task; one `Frame` for each datum.

    Parameters
    ----------
    task : Task
        Names of the task.
    run_time : RunTime
        What its code changes.
    """

    def __init__(self, task: Task, run_time: RunTime) -> None:
        self._task = task
        self._run_time = run_time
        self._undeclared: dict[str, FrameUse] = {}
        self._declared: dict[tuple[tuple[str, int, str], Keys], tuple[FrameUse, Role]] = {}
        #: offsets, by file, at which a motion names a known frame as its own, or a parameter of its routine that is one
        self.used: dict[str, set[int]] = {}

    def all(self) -> Iterator[tuple[Frame, Role]]:
        """Yield the known frames and what motions use them as."""
        for use, role in self._declared.values():
            if use.frame is not None:
                yield use.frame, role

    def of_symbol(self, symbol: Symbol) -> Iterator[tuple[Keys, Frame, Role]]:
        """Yield the known frames within a datum, with where they stand in it."""
        for (key, keys), (use, role) in self._declared.items():
            if key == symbol.key and use.frame is not None:
                yield keys, use.frame, role

    def of(self, symbol: Symbol, module: Module) -> FrameUse:
        """Tool or work object of a datum."""
        return self._use(whole(symbol, self._task, module), symbol.name, module)

    def named(self, node: Node, kind: str, module: Module, local: Mapping[str, Symbol]) -> FrameUse:
        """Return the tool or work object that an expression names.

        Parameters
        ----------
        node : Node
            The expression.
        kind : str
            ``tooldata`` or ``wobjdata``.
        module, local :
            Where it stands.
        """
        if node.kind == "aggregate":
            return FrameUse(_without_literals(_READERS[kind](node.text, value_of(node), module.path, 0)))
        if node.kind != "reference":
            return FrameUse(_unknown(node.text, "is computed while the robot runs"))
        datum = resolve(node, self._task, module, local)
        if datum is None:
            world = {"tool0": FLANGE, "wobj0": WORLD}.get(node.text.lower())
            if world is not None and (kind == "tooldata") == (world is FLANGE):
                return world
            key = node.text.lower()
            if key not in self._undeclared:
                self._undeclared[key] = FrameUse(_unknown(node.text, "not declared in this backup"))
            return self._undeclared[key]
        if datum.unknown:
            return FrameUse(_unknown(node.text, datum.unknown))
        if datum.type != kind:
            return FrameUse(_unknown(node.text, f"has the type {datum.type}, not {kind}"))
        self.used.setdefault(module.path, set()).add(node.span[0])
        return self._use(datum, node.text, module)

    def load(self, node: Node, module: Module, local: Mapping[str, Symbol]) -> Load:
        r"""Return the load that ``\TLoad`` names."""
        datum = resolve(node, self._task, module, local) if node.kind == "reference" else None
        if datum is None or datum.unknown or datum.type != "loaddata":
            return Load(node.text, unknown="not declared in this backup")
        changed = self._run_time.changes(datum.symbol)
        value = datum.value()
        if datum.symbol.storage == "parameter" or changed or value is None:
            return Load(node.text, unknown=changed or "it has no literal value")
        return machine.read_load(node.text, value_of(value), datum.symbol.path, datum.symbol.line)

    def _use(self, datum: Datum, name: str, module: Module) -> FrameUse:
        symbol = datum.symbol
        if symbol.storage == "parameter":
            if not datum.keys and not datum.dimensions:
                return FrameUse(None, parameter=symbol.name.lower())
            return FrameUse(_unknown(name, "is part of a parameter of the routine"))
        key = (symbol.key, datum.keys)
        if key not in self._declared:
            self._declared[key] = (self._read(datum, name, module), _ROLES[datum.type])
        return self._declared[key][0]

    def _read(self, datum: Datum, name: str, module: Module) -> FrameUse:
        symbol = datum.symbol
        if datum.dimensions:
            return FrameUse(_unknown(name, "is an array", symbol))
        read = _READERS[datum.type]
        origin, doubt, alone = self._origin(datum, module)
        node = origin.value()
        value = None if node is None else value_of(node)
        frame = read(name, value, symbol.path, symbol.line)
        if not alone:
            frame = _without_literals(frame)
        reason = doubt or self._run_time.changes(symbol)
        if reason:
            frame = replace(frame, pose=None, unknown=reason)
        load = machine.read_tool_load(name, value, symbol.path, symbol.line) if datum.type == "tooldata" else None
        if load is not None and reason:
            load = Load(load.name, unknown=reason, path=load.path, line=load.line)
        return FrameUse(frame, load=load)

    def _origin(self, datum: Datum, module: Module) -> tuple[Datum, str, bool]:
        """Return the declaration that gives the value, why none does, and whether it is the only one.

        Persistent data of several tasks are one: a task that declares it without a value gets that of another. Globals
        of one name in several modules cannot be loaded together: equal values leave no doubt.
        """
        symbol = datum.symbol
        shared = self._run_time.shared.get((symbol.name.lower(), symbol.type), ()) if symbol.shared else ()
        others = [other for other in (*shared, *self._task.rivals(symbol, module)) if other.initial is not None]
        candidates = [replace(datum, symbol=other) for other in others if other.key != symbol.key]
        if symbol.initial is not None:
            candidates.insert(0, datum)
        texts: dict[str, Datum] = {}
        for candidate in candidates:
            node = candidate.value()
            if node is not None:
                texts.setdefault("".join(node.text.split()).lower(), candidate)
        if len(texts) > 1:
            first, second = list(texts.values())[:2]
            what = _WHAT[datum.type]
            reason = f"the {what} has different values at {first.symbol.place} and {second.symbol.place}"
            return first, reason, False
        origin = next(iter(texts.values())) if texts else datum
        return origin, "", len(candidates) == 1 and origin is datum and not self._run_time.is_shared(symbol)


def _without_literals(frame: Frame) -> Frame:
    """Return a frame that is written in several places, or in the middle of code: none is the place to change it."""
    return replace(frame, literal=None, user_literal=None)


def _unknown(name: str, reason: str, symbol: Symbol | None = None) -> Frame:
    if symbol is None:
        return Frame(name, pose=None, unknown=reason)
    return Frame(name, pose=None, unknown=reason, path=symbol.path, line=symbol.line)
