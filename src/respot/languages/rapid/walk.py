"""One pass over a routine: its motions as far as the routine itself tells, and its calls.

A motion of RobotWare is known by its name, any other by the declared types of its arguments. A call of a routine that
moves to what it is handed gives that routine's motions with what this call hands over.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from respot.issues import Issue
from respot.languages.forms import Forms
from respot.languages.profile import WrapperRule
from respot.languages.rapid.blocks import Routine as Block
from respot.languages.rapid.calls import Argument, Invocation, Line
from respot.languages.rapid.displacement import Displacements
from respot.languages.rapid.drafts import Draft, Guard, allowed, with_weld
from respot.languages.rapid.forms import InstructionForm, instruction_form, literal_arguments, weld_data
from respot.languages.rapid.frames import NO_FRAME, WORLD, Frames, FrameUse
from respot.languages.rapid.guards import Guards
from respot.languages.rapid.operands import Operand, Operands, Place
from respot.languages.rapid.records import BUILT_IN, POSITIONS
from respot.languages.rapid.references import first_word
from respot.languages.rapid.run_time import bound, literal_start
from respot.languages.rapid.symbols import Module, Parameter, Symbol, Task
from respot.program.frames import Frame
from respot.program.moves import Motion
from respot.program.robot import Call, Unread
from respot.program.statement import OPAQUE, Node
from respot.program.targets import TargetKind

#: A wrapper with more motions is not followed.
_MOST_MOTIONS = 400
_BY_VARIABLE = "callbyvar"


@dataclass
class Summary:
    """A routine: its motions and calls, in order; what it does not tell."""

    steps: list[Draft | Call] = field(default_factory=list)
    unread: list[Unread] = field(default_factory=list)
    issues: list[Issue] = field(default_factory=list)


@dataclass(frozen=True)
class Context:
    """What the routines of a task have in common.

    Parameters
    ----------
    task : Task
        Names of the task.
    forms : Forms
        Instruction forms.
    frames : Frames
        Tools and work objects.
    operands : Operands
        Positions.
    displacements : Displacements
        Where a program displacement may be active.
    motions_of : callable
        Motions and calls of another routine; None if it calls itself, or goes too deep.
    """

    task: Task
    forms: Forms
    frames: Frames
    operands: Operands
    displacements: Displacements
    motions_of: Callable[[Block, Module], list[Draft | Call] | None]


class Walk:
    """One pass over a routine.

    Parameters
    ----------
    context : Context
        What the routines of a task have in common.
    block, module :
        The routine.
    """

    def __init__(self, context: Context, block: Block, module: Module) -> None:
        self._context = context
        self._task = context.task
        self._forms = context.forms
        self._block = block
        self._module = module
        self._local = self._task.locals(block, module)
        self._guards = Guards(self._local)
        self._found = Summary()
        self._types: dict[str, str] = {}

    def run(self) -> Summary:
        """Return what the routine does."""
        for line in self._module.lines(self._block):
            statement = line.statement
            if statement.kind == OPAQUE:
                self._found.unread.append(Unread(statement.line, statement.source[:200], statement.shape.reason))
            elif statement.kind == "connect":
                self._found.steps.append(Call(statement.node.all("name")[-1].text, statement.line))
            guards = self._guards.at(line)
            for call in line.calls:
                self._call(call, line, guards)
        return self._found

    def _call(self, call: Invocation, line: Line, guards: tuple[Guard, ...]) -> None:
        steps = self._found.steps
        if not call.name:
            self._late(call, line, call.late_name())
            return
        callee = self._task.routine(call.name, self._module)
        arguments = call.arguments() if callee is not None or not call.is_function else []
        if callee is not None:
            drafts, ends = self._expand(call, line, callee, arguments, guards)
            steps += drafts if not ends else [Call(call.name, call.line)]
            steps += drafts if ends else [Call(call.name, call.line)]
        elif call.is_function:
            return
        else:
            drafts = self._instruction(call, line, arguments, guards)
            steps += drafts
            if call.name.lower() == _BY_VARIABLE and arguments:
                self._late(call, line, arguments[0].value)
        if not drafts:
            self._weld(call, arguments)

    def _weld(self, call: Invocation, arguments: Sequence[Argument]) -> None:
        """A call that welds belongs to the motion before it, unless another routine may have moved in between."""
        texts = [item.value.text for item in arguments if item.kind == "argument" and item.value is not None]
        if not self._forms.welds(call.name, texts):
            return
        steps = self._found.steps
        for index in range(len(steps) - 1, -1, -1):
            step = steps[index]
            if isinstance(step, Draft):
                steps[index] = with_weld(step, literal_arguments(arguments))
                return
            if step.name.lower() != call.name.lower():
                return

    def _late(self, call: Invocation, line: Line, name: Node | None) -> None:
        """A name that is bound late: what it may stand for is called; what it is handed may move or change."""
        start = "" if name is None else literal_start(name).lower()
        steps = self._found.steps
        found = {
            key: block.name
            for module in self._task.modules
            for key, block in module.routines.items()
            if start and key.startswith(start) and (not block.local or module is self._module)
        }
        steps += [Call(routine, call.line) for routine in found.values()]
        text = "" if name is None else name.text
        may = f"it may be any of {len(found)} whose names begin with {start}" if found else "nobody knows which"
        message = f"calls a routine by the name {text}, which is chosen while the robot runs: {may}"
        self._found.issues.append(Issue("LATE_BINDING", message, self._module.path, call.line))
        if call.name:
            return
        for argument in call.arguments():
            operand = None if argument.value is None else self._read(argument.value, call)
            if operand is not None:
                operand = operand.doubted(f"the position is handed to the routine that {text} stands for")
                steps.append(self._draft(call, line, operand))

    # ------------------------------------------------------------------------------------------------------ wrappers

    def _expand(
        self,
        call: Invocation,
        line: Line,
        callee: tuple[Block, Module],
        arguments: Sequence[Argument],
        guards: tuple[Guard, ...],
    ) -> tuple[list[Draft], bool]:
        """Motions of a routine that its caller decides about, and whether the last motion of it is one of them."""
        parameters = self._task.parameters(callee[0])
        if not parameters:
            return [], False
        inner = self._context.motions_of(*callee)
        pairs = list(bound(parameters, arguments))
        if inner is None:
            return self._handed(call, line, pairs), False
        moving = [step for step in inner if isinstance(step, Draft)]
        opened = [draft for draft in moving if draft.is_open]
        if not opened:
            return [], False
        if len(opened) > _MOST_MOTIONS:
            return self._handed(call, line, pairs), False
        given = {parameter.name.lower(): argument for parameter, argument in pairs}
        texts = {name: argument.given or None for name, argument in given.items()}
        types = [self._type_of(item.value) for item in arguments]
        data = weld_data(arguments, types)
        found = []
        for draft in opened:
            left = allowed(draft.guards, texts)
            if left is not None:
                found.append(self._filled(draft, call, line, given, (*guards, *left), data, arguments))
        if data and found and not any(draft.weld for draft in found):
            found[-1] = replace(found[-1], weld="spotdata" in types)
        return found, bool(found) and opened[-1] is moving[-1]

    def _filled(
        self,
        draft: Draft,
        call: Invocation,
        line: Line,
        given: Mapping[str, Argument],
        guards: tuple[Guard, ...],
        data: tuple[str, ...],
        arguments: Sequence[Argument],
    ) -> Draft:
        """Return a wrapper's motion with what one call of it hands over."""
        operand = draft.operand
        if operand.parameter:
            argument = given.get(operand.parameter)
            read = None
            if argument is not None and argument.value is not None:
                read = self._context.operands.read(argument.value, self._place(call), "robtarget", operand.keys)
            if read is None:
                read = Operand(None, f"{call.name} goes to {operand.parameter}, which this call computes")
            if operand.offset is not None:
                read = replace(read, offset=operand.offset)
            if operand.tool_offset is None or read.tool_offset is None:
                read = replace(read, tool_offset=None)
            else:
                read = replace(read, tool_offset=read.tool_offset * operand.tool_offset)
            operand = read.doubted(operand.unknown, operand.code) if operand.unknown else read
        elif operand.offset is not None:
            # one literal, but as many motions as there are calls
            operand = operand.doubted(f"{call.name} adds an offset along the work object that all its callers share")
        return replace(
            draft,
            instruction=call.name,
            line=call.line,
            last=self._last_line(line),
            operand=operand,
            tool=self._passed(draft.tool, "tooldata", given),
            base=self._passed(draft.base, "wobjdata", given),
            data=(*data, *(name for name in draft.data if name not in given and not data)),
            arguments=(*draft.arguments, *literal_arguments(arguments)),
            guards=guards,
            displaced=draft.displaced or self._displaced(line),
        )

    def _passed(self, use: FrameUse, kind: str, given: Mapping[str, Argument]) -> FrameUse:
        if not use.parameter:
            return use
        argument = given.get(use.parameter)
        if argument is None:
            absent = use.absent or Frame(use.parameter, pose=None, unknown="is not handed to the routine")
            return FrameUse(absent)
        if argument.given:
            symbol = self._local.get(argument.given)
            if symbol is not None and symbol.storage == "parameter":
                return FrameUse(None, argument.given, use.absent)
            return FrameUse(Frame(argument.given, pose=None, unknown="is no parameter of this routine"))
        if argument.value is None:
            return FrameUse(Frame(use.parameter, pose=None, unknown="is handed on as a switch"))
        found = self._context.frames.named(argument.value, kind, self._module, self._local)
        return replace(found, absent=use.absent) if found.parameter else found

    def _handed(self, call: Invocation, line: Line, pairs: Sequence[tuple[Parameter, Argument]]) -> list[Draft]:
        """Positions that go to a routine which cannot be followed."""
        found = []
        for _, argument in pairs:
            operand = None if argument.value is None else self._read(argument.value, call)
            if operand is not None:
                operand = operand.doubted(f"{call.name} calls itself, or goes too deep to be followed")
                found.append(self._draft(call, line, operand))
        return found

    # ---------------------------------------------------------------------------------------------------- instructions

    def _instruction(
        self, call: Invocation, line: Line, arguments: Sequence[Argument], guards: tuple[Guard, ...]
    ) -> list[Draft]:
        if not arguments or (self._forms.is_harmless(call.name) and not self._forms.welds(call.name)):
            return []
        form = instruction_form(call.name)
        rule = self._forms.wrapper(call.name) if form is None else None
        known = form is not None or rule is not None
        types = [self._type_of(item.value) for item in arguments]
        if not known and not any(map(self._may_be_position, arguments, types)):
            return []
        places = [
            place
            for place, item in enumerate(arguments)
            if item.value is not None and item.kind in ("argument", "named_argument")
        ]
        positional = [node for place in places if (node := arguments[place].value) is not None]
        own_types = [types[place] for place in places]
        operands: Sequence[Operand | None]
        if form is not None:
            operands = self._targets_of(form, positional, call)
        elif rule is not None and isinstance(rule.target, int) and 0 < rule.target <= len(positional):
            operands = [self._read(positional[rule.target - 1], call, "robtarget")]
        else:
            operands = [operand for node in positional if (operand := self._read(node, call)) is not None]
        if not operands:
            return []
        tool = self._tool(form, rule, positional, own_types)
        base = self._base(arguments, rule, positional, own_types)
        if tool is None and not known:
            reason = f"the position is handed to {call.name}, which respot does not know as a motion"
            operands = [operand.doubted(reason) for operand in operands if operand is not None]
            base = NO_FRAME
        motion = form.motion if form is not None else rule.motion if rule is not None else Motion.LINEAR
        load = next((item.value for item in arguments if item.name == "tload" and item.value is not None), None)
        draft = Draft(
            motion=motion,
            instruction=call.name,
            line=call.line,
            last=self._last_line(line),
            operand=Operand(),
            tool=tool or NO_FRAME,
            base=base,
            weld="spotdata" in types or (rule is not None and rule.weld) or self._forms.is_weld_instruction(call.name),
            data=weld_data(arguments, types),
            arguments=self._texts(arguments, types, known=form is not None),
            guards=guards,
            displaced=self._displaced(line),
            load=None if load is None else self._context.frames.load(load, self._module, self._local),
        )
        computed = f"{call.name} goes to a position that is computed while the robot runs"
        return [replace(draft, operand=operand or Operand(None, computed)) for operand in operands]

    def _may_be_position(self, item: Argument, kind: str) -> bool:
        if kind:
            return kind not in BUILT_IN or kind in POSITIONS
        return item.value is not None and item.value.kind in ("aggregate", "function_call", "group")

    def _texts(self, arguments: Sequence[Argument], types: Sequence[str], known: bool) -> tuple[str, ...]:
        """Literals among the arguments of a wrapper, and the first field of spot data; of RobotWare's own only that."""
        first = []
        for item, kind in zip(arguments, types, strict=True):
            symbol = self._symbol(item.value) if item.value is not None and kind == "spotdata" else None
            node = None if symbol is None else symbol.node
            if node is not None and node.kind == "aggregate" and node.nodes:
                first.append(node.nodes[0].text.strip('"'))
        return (*first, *(() if known else literal_arguments(arguments)))

    def _targets_of(
        self, form: InstructionForm, positional: Sequence[Node], call: Invocation
    ) -> Sequence[Operand | None]:
        kind = "jointtarget" if form.joints else "robtarget"
        nodes = [positional[index] for index in form.targets if index < len(positional)]
        operands = [self._read(node, call, kind) for node in nodes] or [None]
        if not form.joints:
            return operands
        reasons = [self._context.operands.joints_from_pose(node, self._place(call)) for node in nodes]
        told = [Operand(None, reason, "RUN_TIME_POSE") for reason in reasons if reason]
        return told or [_of_joints(operand) for operand in operands]

    def _tool(
        self,
        form: InstructionForm | None,
        rule: WrapperRule | None,
        positional: Sequence[Node],
        types: Sequence[str],
    ) -> FrameUse | None:
        """Tool among the arguments: by its declared type, else by its place."""
        frames, module, local = self._context.frames, self._module, self._local
        for node, kind in zip(positional, types, strict=True):
            if kind == "tooldata" or (not kind and node.kind == "reference" and node.text.lower() == "tool0"):
                return frames.named(node, "tooldata", module, local)
        if rule is not None and isinstance(rule.tool, str):
            symbol = self._task.find(rule.tool, module, local)
            found = frames.of(symbol, module) if symbol is not None and symbol.type == "tooldata" else None
            return found or FrameUse(Frame(rule.tool, pose=None, unknown="not declared in this backup"))
        place = rule.tool - 1 if rule is not None and isinstance(rule.tool, int) else -1
        if form is not None and form.tool is not None:
            place = form.tool if form.tool >= 0 else len(positional) + form.tool
            place = place if place > max(form.targets, default=0) else -1
        if 0 <= place < len(positional):
            return frames.named(positional[place], "tooldata", module, local)
        return None

    def _base(
        self,
        arguments: Sequence[Argument],
        rule: WrapperRule | None,
        positional: Sequence[Node],
        types: Sequence[str],
    ) -> FrameUse:
        frames, module, local = self._context.frames, self._module, self._local
        for item in arguments:
            if item.name != "wobj":
                continue
            if item.given:
                symbol = local.get(item.given)
                if symbol is not None and symbol.storage == "parameter":
                    return FrameUse(None, item.given, WORLD.frame)
                return NO_FRAME
            return NO_FRAME if item.value is None else frames.named(item.value, "wobjdata", module, local)
        if rule is not None and isinstance(rule.base, str):
            symbol = self._task.find(rule.base, module, local)
            found = frames.of(symbol, module) if symbol is not None and symbol.type == "wobjdata" else None
            return found or FrameUse(Frame(rule.base, pose=None, unknown="not declared in this backup"))
        if rule is not None and not isinstance(rule.base, str) and 0 < rule.base <= len(positional):
            return frames.named(positional[rule.base - 1], "wobjdata", module, local)
        for node, kind in zip(positional, types, strict=True):
            if kind == "wobjdata" or (not kind and node.kind == "reference" and node.text.lower() == "wobj0"):
                return frames.named(node, "wobjdata", module, local)
        return WORLD

    # ----------------------------------------------------------------------------------------------------------- parts

    def _draft(self, call: Invocation, line: Line, operand: Operand) -> Draft:
        """Motion of a routine that nobody knows, as a draft."""
        return Draft(
            motion=Motion.LINEAR,
            instruction=call.name or call.statement.source.split(None, 1)[0],
            line=call.line,
            last=self._last_line(line),
            operand=operand,
            tool=NO_FRAME,
            base=NO_FRAME,
            displaced=self._displaced(line),
        )

    def _displaced(self, line: Line) -> str:
        return self._context.displacements.at(self._block, line)

    @staticmethod
    def _last_line(line: Line) -> int:
        statement = line.statement
        return statement.line + statement.source.count("\n")

    def _place(self, call: Invocation) -> Place:
        return Place(self._module, self._block, self._local, call.line, f"{call.name}@{call.line}")

    def _read(self, node: Node, call: Invocation, kind: str = "") -> Operand | None:
        return self._context.operands.read(node, self._place(call), kind)

    def _symbol(self, node: Node) -> Symbol | None:
        return self._task.find(first_word(node), self._module, self._local) if node.kind == "reference" else None

    def _type_of(self, node: Node | None) -> str:
        """Declared type of the datum that an argument names, or is part of; empty for anything else."""
        if node is None or node.kind != "reference":
            return ""
        name = first_word(node).lower()
        found = self._types.get(name)
        if found is None:
            symbol = self._task.find(name, self._module, self._local)
            found = "" if symbol is None else self._task.type_of(symbol.type, self._module)
            self._types[name] = found
        return found


def _of_joints(operand: Operand | None) -> Operand:
    """Position of a motion to joints: wherever they come from, they never move."""
    if operand is None or (operand.target is not None and operand.target.kind is not TargetKind.JOINTS):
        return Operand()
    return replace(operand, unknown="", code="UNKNOWN_TARGET" if operand.code == "UNKNOWN_TARGET" else "")
