"""Positions among the arguments of a motion: literals, data, parts of records and arrays, ``Offs`` and ``RelTool``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from scipy.spatial.transform import RigidTransform, Rotation

from respot.geometry import IDENTITY, pose
from respot.languages.literals import number_of
from respot.languages.rapid.blocks import Routine as Block
from respot.languages.rapid.calls import Argument
from respot.languages.rapid.records import BUILT_IN, POSITIONS
from respot.languages.rapid.references import Datum, resolve
from respot.languages.rapid.run_time import JOINTS_OF_POSE, RunTime
from respot.languages.rapid.symbols import Module, Symbol, Task
from respot.languages.rapid.targets import Keys, Targets, holds_positions
from respot.program.moves import BaseOffset
from respot.program.statement import Branch, Node
from respot.program.targets import Number, Target, TargetKind

_TURNS = ("rx", "ry", "rz")
_DEEPEST = 8


@dataclass(frozen=True)
class Place:
    """Where an expression stands: its routine with the names it sees, its line, and a name for a literal in it."""

    module: Module
    block: Block
    local: Mapping[str, Symbol]
    line: int
    name: str


@dataclass(frozen=True)
class Operand:
    """A position among the arguments of a call.

    Parameters
    ----------
    target : Target or None
        Its literal.
    unknown, code : str
        Why the position cannot be told before the robot runs, and the code of that.
    offset : BaseOffset or None
        Translation along the work object.
    tool_offset : RigidTransform or None
        Shift along the tool; None where it is computed.
    parameter : str
        Parameter of the routine, in lower case, that the position is, or is part ``keys`` of.
    """

    target: Target | None = None
    unknown: str = ""
    code: str = ""
    offset: BaseOffset | None = None
    tool_offset: RigidTransform | None = IDENTITY
    parameter: str = ""
    keys: Keys = ()

    def doubted(self, reason: str, code: str = "RUN_TIME_POSE") -> Operand:
        """Return it with a doubt, unless there is one already."""
        return self if self.unknown else replace(self, unknown=reason, code=code)


class Operands:
    """Positions of a task.

    Parameters
    ----------
    task : Task
        Names of the task.
    targets : Targets
        Literal positions of the robot.
    run_time : RunTime
        What its code changes.
    """

    def __init__(self, task: Task, targets: Targets, run_time: RunTime) -> None:
        self._task = task
        self._targets = targets
        self._run_time = run_time

    def declare(self, symbol: Symbol, module: Module) -> Mapping[Keys, Target]:
        """Targets within a datum, by where they stand in it."""
        kind = self._task.type_of(symbol.type, module)
        if kind in BUILT_IN and kind not in POSITIONS:
            return {}
        typed = symbol if kind == symbol.type else replace(symbol, type=kind)
        return self._targets.declared(typed, lambda name: self._task.fields(self._task.type_of(name, module), module))

    def read(self, node: Node, place: Place, kind: str = "", keys: Keys = (), depth: int = 0) -> Operand | None:
        """Return the position that an expression is.

        Parameters
        ----------
        node : Node
            The expression.
        place : Place
            Where it stands.
        kind : str
            Type that it must have there; empty where it may be anything.
        keys : tuple of int
            Part of it that is meant, where it is a record.

        Returns
        -------
        Operand or None
            None for anything that is no position.
        """
        if node.kind == "group":
            return self.read(node.nodes[0], place, kind, keys, depth)
        if node.kind == "aggregate":
            part = _part(node, keys)
            target = None if part is None else self._targets.literal(place.name, place.module.path, part, kind=kind)
            return None if target is None else Operand(target)
        if node.kind == "reference":
            return self._named(node, place, kind, keys)
        if node.kind == "function_call" and depth < _DEEPEST:
            return self._function(node, place, kind, depth)
        return None

    def joints_from_pose(self, node: Node, place: Place) -> str:
        """Say which joints are those of a position, and go elsewhere if it moves; empty of all others."""
        names = node.tokens("NAME")
        if node.kind == "function_call" and names and names[0].text.lower() == JOINTS_OF_POSE:
            return f"{node.text} goes to joints that are computed from a position"
        datum = resolve(node, self._task, place.module, place.local) if node.kind == "reference" else None
        if datum is not None and datum.symbol.key in self._run_time.from_poses:
            return f"{node.text} is set to joints that are computed from a position"
        return ""

    def _named(self, node: Node, place: Place, kind: str, keys: Keys) -> Operand | None:
        datum = resolve(node, self._task, place.module, place.local)
        if datum is None:
            return Operand(None, f"{node.text} is not declared in this backup", "UNKNOWN_TARGET") if kind else None
        datum = self._inner(datum, keys, place.module)
        fits = datum.type in POSITIONS
        if not fits and not (kind and datum.unknown):
            return None
        symbol = datum.symbol
        if symbol.storage == "parameter":
            return self._parameter(datum, node, place)
        if datum.unknown or datum.dimensions:
            return Operand(None, f"{node.text} {datum.unknown or 'is a whole array'}", "RUN_TIME_POSE")
        target = self.declare(symbol, place.module).get(datum.keys)
        if target is None:
            return self._constant(datum, node, place, kind)
        operand = Operand(target)
        if target.kind is not TargetKind.POSE:
            return operand
        changed = self._run_time.changes(symbol)
        if changed:
            return operand.doubted(f"{symbol.name} {changed}")
        if self._run_time.is_shared(symbol):
            return operand.doubted(f"{symbol.name} is persistent data of several tasks: each holds a copy")
        rivals = self._task.rivals(symbol, place.module)
        if rivals:
            where = " and ".join(rival.place for rival in rivals[:2])
            return operand.doubted(f"{symbol.name} is declared globally at {where}", "AMBIGUOUS_NAME")
        return operand

    def _constant(self, datum: Datum, node: Node, place: Place, kind: str) -> Operand:
        """Part of a record whose literal names a constant in that place, or has nothing there."""
        value = datum.value()
        if value is not None and value.kind == "reference" and not self._run_time.changes(datum.symbol):
            inner = resolve(value, self._task, place.module, {})
            if inner is not None and inner.symbol is not datum.symbol and inner.symbol.storage == "CONST":
                return self._named(value, replace(place, local={}), kind, ()) or Operand()
        reason = self._run_time.changes(datum.symbol) or "has no literal position"
        return Operand(None, f"{node.text} {reason}", "RUN_TIME_POSE")

    def _inner(self, datum: Datum, keys: Keys, module: Module) -> Datum:
        for key in keys:
            fields = self._task.fields(datum.type, module)
            if fields is None or key >= len(fields):
                return replace(datum, type="")
            datum = replace(datum, type=self._task.type_of(fields[key][0], module), keys=(*datum.keys, key))
        return datum

    def _parameter(self, datum: Datum, node: Node, place: Place) -> Operand:
        name = datum.symbol.name.lower()
        if datum.symbol.dimensions or datum.unknown:
            return Operand(None, f"{node.text} {datum.unknown or 'is an array that the routine gets'}", "RUN_TIME_POSE")
        operand = Operand(parameter=name, keys=datum.keys)
        if name in self._run_time.changed.get(id(place.block), ()):
            return operand.doubted(f"{place.block.name} changes {datum.symbol.name} before it goes there")
        return operand

    def _function(self, node: Node, place: Place, kind: str, depth: int) -> Operand | None:
        """Offs and RelTool of a position; any other function that takes one computes a new one."""
        name = node.tokens("NAME")[0].text.lower()
        found = node.first("arguments")
        arguments = [] if found is None else [_argument(item) for item in found.nodes]
        values = [item.value for item in arguments if item.kind != "optional_argument" and item.value is not None]
        builtin = name in ("offs", "reltool") and self._task.routine(name, place.module) is None
        inner = self.read(values[0], place, "robtarget" if builtin else "", (), depth + 1) if values else None
        computed = Operand(None, f"{node.text} is computed while the robot runs", "RUN_TIME_POSE")
        if not builtin:
            return computed if inner is not None or kind else None
        if inner is None:
            return computed
        if name == "reltool":
            return self._shifted(inner, values[1:], arguments)
        return self._offset(inner, node, values, place)

    def _shifted(self, inner: Operand, values: list[Node], arguments: list[Argument]) -> Operand:
        numbers = [number_of(value) for value in values]
        turns = {item.name: None if item.value is None else number_of(item.value) for item in arguments if item.name}
        if len(numbers) != 3 or any(number is None for number in (*numbers, *turns.values())):
            return replace(inner, tool_offset=None)
        if inner.tool_offset is None:
            return inner
        angles = [float(turn.value) if (turn := turns.get(name)) is not None else 0.0 for name in _TURNS]
        shift = pose(
            [float(number.value) for number in numbers if number is not None],
            Rotation.from_euler("XYZ", angles, degrees=True),
        )
        return replace(inner, tool_offset=inner.tool_offset * shift)

    def _offset(self, inner: Operand, node: Node, values: list[Node], place: Place) -> Operand:
        if inner.offset is not None:
            return inner.doubted(f"{node.text}: an Offs within an Offs is not understood")
        if len(values) != 4:
            return inner.doubted(f"{node.text}: Offs takes three distances")
        if inner.parameter:
            # it would have to turn with the base of each caller, and it is written only once
            inner = inner.doubted(f"{place.block.name} adds an offset along the work object to what it is handed")
        numbers: list[Number | None] = [number_of(value) for value in values[1:]]
        span = (values[1].span[0], values[3].span[1])
        literal = all(number is not None for number in numbers)
        path = place.module.path
        offset = BaseOffset((numbers[0], numbers[1], numbers[2]), span, path, place.line, literal)
        return replace(inner, offset=offset)


def holds(task: Task, kind: str, module: Module) -> bool:
    """Whether a datum of a type is a position or a record that holds one."""
    return holds_positions(task.type_of(kind, module), lambda name: task.fields(task.type_of(name, module), module))


def _part(node: Node, keys: Keys) -> Node | None:
    for key in keys:
        items = node.nodes if node.kind == "aggregate" else []
        if key >= len(items):
            return None
        node = items[key]
    return node


def _argument(node: Node) -> Argument:
    names = node.tokens("NAME")
    branches = [child for child in node.branch.children if isinstance(child, Branch)]
    value = node.nodes[0] if branches else None
    if node.kind == "argument":
        return Argument(node.kind, "", value)
    return Argument(node.kind, names[0].text.lower() if names else "", value)
