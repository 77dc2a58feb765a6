"""Tool, work object and target of every RAPID motion.

A motion is told by the types of its arguments, not by its name: plants wrap ``MoveL`` and ``SpotL`` in procedures of
their own, and the order of gun and spot data differs between generations (facts: rapid.md 1.5, 3.1).
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

from respot.languages.literals import number_of
from respot.languages.rapid import machine
from respot.languages.rapid.blocks import Routine as Block
from respot.languages.rapid.forms import FORMS
from respot.languages.rapid.run_time import RunTime, called, name_of
from respot.languages.rapid.symbols import Aggregate, Module, Symbol, Task, routine_symbols, value_of
from respot.languages.rapid.targets import Targets
from respot.program.frames import Frame
from respot.program.moves import BaseOffset, Motion, Move
from respot.program.robot import Call, Routine, Unread
from respot.program.statement import OPAQUE, Node, Statement
from respot.program.targets import Target, TargetKind

#: Instructions of RobotWare that move to their first positions (facts: rapid.md 1.5).
_INSTRUCTION = re.compile(
    r"Move(?:L|J|C|AbsJ)(?:DO|GO|AO|Sync)?|SpotM?[LJ]|Trigg[LJC]|Search[LC]|Calib[LJ]|Arc[LC](?:Start|End)?",
    re.IGNORECASE,
)
_JOINT = re.compile(r"(?:Move(?:Abs)?|SpotM?|Trigg|Calib)J", re.IGNORECASE)
_JOINTS = re.compile(r"Move(?:AbsJ|ExtJ)", re.IGNORECASE)
_CIRCULAR = re.compile(r"(?:Move|Trigg|Search|Arc)C", re.IGNORECASE)


@dataclass(frozen=True)
class _Operand:
    """A position among the arguments of a call."""

    target: Target | None
    unknown: str = ""
    offset: BaseOffset | None = None
    parameter: bool = False


class Binder:
    """Binds the motions of one task.

    Parameters
    ----------
    name : str
        The task.
    task : Task
        Names of the task.
    targets : Targets
        Literal positions of the robot.
    run_time : RunTime
        What its code changes.
    """

    def __init__(self, name: str, task: Task, targets: Targets, run_time: RunTime) -> None:
        self._name = name
        self._task = task
        self._targets = targets
        self._run_time = run_time
        self._frames: dict[tuple[str, int, str], Frame] = {}

    def routine(self, block: Block, module: Module) -> Routine:
        """Motions and calls of a routine."""
        local = routine_symbols(module.path, block)
        steps: list[Move | Call] = []
        unread: list[Unread] = []
        for statement in block.body:
            if statement.kind == OPAQUE:
                unread.append(Unread(statement.line, statement.source[:200], statement.shape.reason))
            elif statement.kind == "connect":
                steps.append(Call(statement.node.all("name")[-1].text, statement.line))
            for call in called(statement):
                self._follow(steps, call, statement, block, module, local)
        line = block.head.line
        return Routine(block.name, module.name, module.path, line, tuple(steps), tuple(unread), self._name)

    def _follow(
        self,
        steps: list[Move | Call],
        call: Node,
        statement: Statement,
        block: Block,
        module: Module,
        local: dict[str, Symbol],
    ) -> None:
        name = name_of(call)
        found = self._bind(call, statement, block, module, local) if call.kind == "call" else []
        steps += found
        if self._task.has_routine(name, module):
            steps.append(Call(name, statement.line))
        if not found and FORMS.welds(name, []):
            for index in range(len(steps) - 1, -1, -1):
                step = steps[index]
                if isinstance(step, Call) and step.name.lower() != name.lower():
                    return  # that routine may have moved: where the gun welds is not known
                if isinstance(step, Move):
                    steps[index] = replace(step, weld=True)
                    return

    def frame(self, symbol: Symbol) -> Frame:
        """Tool or work object of a datum; one `Frame` for each datum."""
        key = (symbol.path, symbol.line, symbol.name.lower())
        if key not in self._frames:
            read = machine.read_tool if symbol.type == "tooldata" else machine.read_work_object
            frame = read(symbol)
            if symbol.storage == "parameter":
                frame = Frame(symbol.name, pose=None, unknown="it is a parameter of the routine")
            elif symbol.storage != "CONST" and symbol.name.lower() in self._run_time.written:
                frame = replace(frame, pose=None, unknown="it is assigned to while the robot runs")
            self._frames[key] = frame
        return self._frames[key]

    def _bind(
        self, call: Node, statement: Statement, block: Block, module: Module, local: dict[str, Symbol]
    ) -> list[Move]:
        name = name_of(call)
        arguments = call.first("arguments")
        positional = [] if arguments is None else [node.nodes[0] for node in arguments.all("argument") if node.nodes]
        symbols = [self._symbol(node, module, local) for node in positional]
        operands = [operand for node in positional if (operand := self._operand(node, name, module, local, statement))]
        tool = next((symbol for symbol in symbols if symbol is not None and symbol.type == "tooldata"), None)
        flange = any(node.text.lower() == "tool0" for node in positional)
        handed = False
        instruction = _INSTRUCTION.fullmatch(name) is not None and not self._task.has_routine(name, module)
        if not operands and not instruction:
            return []
        if self._hands_through(arguments, operands, tool, module, local):
            return []
        if not operands:
            joints = _JOINTS.fullmatch(name) is not None  # wherever they come from, joints never move
            reason = "" if joints else f"{call.text} goes to a position that is computed while the robot runs"
            operands = [_Operand(None, reason)]
        elif tool is None and not flange and not instruction:
            reason = f"the position is handed to {name}, which respot does not know as a motion"
            operands = [replace(operand, unknown=operand.unknown or reason) for operand in operands]
            handed = True
        spot_data = [symbol.name for symbol in symbols if symbol is not None and symbol.type == "spotdata"]
        motion = _motion(name)
        first = Move(
            motion=motion,
            instruction=name,
            target=None,
            program=module.name,
            routine=block.name,
            path=module.path,
            line=statement.line,
            tool=machine.TOOL0 if flange else None if tool is None else self.frame(tool),
            base=None if handed else self._work_object(arguments, module, local),
            weld=bool(spot_data) or bool(FORMS.weld_instructions and FORMS.weld_instructions.match(name)),
        )
        return [self._move(first, operand, spot_data) for operand in operands]

    def _hands_through(
        self,
        arguments: Node | None,
        operands: list[_Operand],
        tool: Symbol | None,
        module: Module,
        local: dict[str, Symbol],
    ) -> bool:
        """Whether a motion within a wrapper goes to the wrapper's own parameters and nothing else.

        Such a motion is judged where the wrapper is called.
        """
        if not operands or not all(operand.parameter for operand in operands) or arguments is None:
            return False
        if tool is None or tool.storage != "parameter":
            return False
        for option in arguments.all("optional_argument", "conditional_argument"):
            if option.tokens("NAME")[0].text.lower() == "wobj":
                given = option.nodes[0].text if option.nodes else option.tokens("NAME")[-1].text
                symbol = self._task.find(given, module, local)
                return symbol is not None and symbol.storage == "parameter"
        return False

    def _move(self, move: Move, operand: _Operand, spot_data: list[str]) -> Move:
        external = move.base is not None and move.base.held
        unknown = operand.unknown or self._run_time.displaced
        if move.tool is not None and move.base is not None and move.tool.held == move.base.held and not unknown:
            unknown = f"{move.tool} and {move.base} are both held by the robot, or neither is"
        move = replace(move, target=operand.target, offset=operand.offset, unknown=unknown, external_tcp=external)
        name = operand.target.name if operand.target is not None and operand.target.declared else ""
        return replace(move, spot_ids=FORMS.spot_ids(name, spot_data))

    def _symbol(self, node: Node, module: Module, local: dict[str, Symbol]) -> Symbol | None:
        if node.kind != "reference":
            return None
        return self._task.find(node.nodes[0].text, module, local)

    def _work_object(self, arguments: Node | None, module: Module, local: dict[str, Symbol]) -> Frame | None:
        for option in [] if arguments is None else arguments.all("optional_argument"):
            if option.tokens("NAME")[0].text.lower() == "wobj":
                if not option.nodes:
                    return None
                if option.nodes[0].text.lower() == "wobj0":
                    return machine.WOBJ0
                symbol = self._symbol(option.nodes[0], module, local)
                if symbol is None or symbol.type != "wobjdata" or option.nodes[0].all("component", "index"):
                    return Frame(option.nodes[0].text, pose=None, unknown="not declared in this backup")
                return self.frame(symbol)
        if arguments is not None and arguments.all("conditional_argument"):
            return None
        return machine.WOBJ0

    def _operand(
        self, node: Node, instruction: str, module: Module, local: dict[str, Symbol], statement: Statement
    ) -> _Operand | None:
        if node.kind == "group":
            return self._operand(node.nodes[0], instruction, module, local, statement)
        if node.kind == "aggregate":
            value = value_of(node)
            place = f"{instruction}@{statement.line}"
            target = self._targets.literal(place, module.path, value) if isinstance(value, Aggregate) else None
            return None if target is None else _Operand(target)
        if node.kind == "reference":
            return self._named(node, module, local)
        if node.kind == "function_call":
            return self._function(node, instruction, module, local, statement)
        return None

    def _named(self, node: Node, module: Module, local: dict[str, Symbol]) -> _Operand | None:
        symbol = self._symbol(node, module, local)
        if symbol is None:
            return None
        targets = self._targets.declared(symbol)
        is_target = symbol.type in ("robtarget", "jointtarget")
        if not targets:
            reason = "is a parameter of the routine" if symbol.storage == "parameter" else "has no literal position"
            bare = symbol.storage == "parameter" and not node.all("index", "component")
            return _Operand(None, f"{symbol.name} {reason}", parameter=bare) if is_target else None
        if node.all("component"):
            return None
        numbers = [number_of(child) for index in node.all("index") for child in index.nodes]
        if any(number is None for number in numbers):
            return _Operand(None, f"{node.text} is chosen while the robot runs")
        key = tuple(int(number.value) for number in numbers if number is not None)
        target = targets.get(key)
        if target is None:
            return _Operand(None, f"{node.text} has no literal position") if is_target else None
        key_name = symbol.name.lower()
        if target.kind is TargetKind.POSE and symbol.storage != "CONST":
            if key_name in self._run_time.written:
                return _Operand(target, f"{symbol.name} is assigned to while the robot runs")
            if symbol.storage == "PERS" and not symbol.local and key_name in self._run_time.twins:
                return _Operand(target, f"{symbol.name} is persistent data of several tasks: each holds a copy")
        return _Operand(target)

    def _function(
        self, node: Node, instruction: str, module: Module, local: dict[str, Symbol], statement: Statement
    ) -> _Operand | None:
        """Offs and RelTool of a position; any other function that takes one computes a new one."""
        name = node.tokens("NAME")[0].text.lower()
        arguments = node.first("arguments")
        values = [] if arguments is None else [item.nodes[0] for item in arguments.all("argument") if item.nodes]
        inner = self._operand(values[0], instruction, module, local, statement) if values else None
        if name not in ("offs", "reltool"):
            return None if inner is None else _Operand(None, f"{node.text} is computed while the robot runs")
        if inner is None:
            return _Operand(None, f"{node.text} is computed while the robot runs")
        if name == "reltool":
            return inner
        inner = replace(inner, parameter=False)  # the wrapper's base is needed to turn the offset
        if inner.offset is not None:
            return replace(inner, unknown=inner.unknown or f"{node.text}: an Offs within an Offs is not understood")
        if len(values) != 4:
            return replace(inner, unknown=inner.unknown or f"{node.text}: Offs takes three distances")
        numbers = [number_of(value) for value in values[1:]]
        span = (values[1].span[0], values[3].span[1])
        literal = all(number is not None for number in numbers)
        offset = BaseOffset((numbers[0], numbers[1], numbers[2]), span, module.path, statement.line, literal)
        return replace(inner, offset=offset)


def _motion(name: str) -> Motion:
    if _CIRCULAR.match(name):
        return Motion.CIRCULAR
    return Motion.JOINT if _JOINT.match(name) else Motion.LINEAR
