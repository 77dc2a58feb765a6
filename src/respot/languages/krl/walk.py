"""One pass over a KRL routine: its motions and calls, in order, with the state that each finds.

What two branches of an IF or SWITCH set differently is not known behind them; what a loop sets is not known where it
begins; nothing is known behind a label or an unread statement. A call leaves what its routine leaves.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, field

from respot.languages.forms import Forms
from respot.languages.krl.blocks import Routine as Block
from respot.languages.krl.frames import shift_of
from respot.languages.krl.labels import Fold, Folds
from respot.languages.krl.motion_data import MotionData
from respot.languages.krl.operands import Operand, Operands, Place
from respot.languages.krl.run_time import (
    MOTIONS,
    RunTime,
    arguments_of,
    assignments,
    called,
    declared_in,
    left_of,
    may_touch_frames,
)
from respot.languages.krl.state import SLOTS, State, merged
from respot.languages.krl.symbols import Aggregate, module_key, value_of
from respot.program.moves import BaseOffset, Doubt, Label, LabelKind, Motion
from respot.program.robot import Call, Unread
from respot.program.statement import OPAQUE, Node, Statement
from respot.program.targets import Number

_JOINT = frozenset(("PTP", "SPTP", "PTP_REL", "SPTP_REL"))
_BRANCHES = frozenset(("if_", "switch"))
_INNER = frozenset(("else_", "case", "default"))
_LOOPS = frozenset(("loop", "while_", "for_", "repeat"))
_CLOSING = frozenset(("end_if", "end_switch", "end_loop", "end_while", "end_for", "until"))
_TRIVIA = frozenset(("comment", "fold", "end_fold"))
#: State behind a call, from the routine's name and the state before it; the flag says that an interrupt calls it.
Follow = Callable[[str, State, bool], State]
#: Slots that a call may set.
Touch = Callable[[str], Collection[str]]


@dataclass
class Draft:
    """A motion with the state it finds, before it is known what the callers of its routine set."""

    motion: Motion
    instruction: str
    line: int
    state: State
    operand: Operand
    labels: list[Label]
    form: Fold
    offset: BaseOffset | None = None
    relative: bool = False
    weld: bool = False


@dataclass
class _Block:
    """An open block: the state before it and at the end of each branch so far."""

    kind: str
    before: State
    ends: list[State] = field(default_factory=list)
    branches: int = 0
    complete: bool = False  # an ELSE or DEFAULT: one of the branches is taken for sure


class Walk:
    """One pass over a routine.

    Parameters
    ----------
    block : Block
        The routine.
    path : str
        Its file.
    operands : Operands
        Data of the robot.
    data : MotionData
        What statements set.
    run_time : RunTime
        What the code changes.
    forms : Forms
        Instruction forms.
    follow, touch : callable
        What the calls of the routine do.
    """

    def __init__(
        self,
        block: Block,
        path: str,
        operands: Operands,
        data: MotionData,
        run_time: RunTime,
        forms: Forms,
        follow: Follow,
        touch: Touch,
    ) -> None:
        self._block = block
        self._path = path
        self._operands = operands
        self._data = data
        self._run_time = run_time
        self._forms = forms
        self._follow = follow
        self._touch = touch
        local, parameters = declared_in(block)
        passed = run_time.passed.get(block.name.upper(), ()) if parameters else ()
        self._place = Place(module_key(path), path, "", local, [name for name, _ in parameters], passed)
        self._folds = Folds()
        self._open: list[_Block] = []
        self._splines: list[State] = []
        self._ends: list[State] = []
        self._state = State() if data.mode_at_start is not False else State(external=False)
        self.steps: list[Draft | Call] = []
        self.unread: list[Unread] = []

    def run(self) -> State:
        """Follow the routine; return what it leaves."""
        loops = self._loops()
        for index, statement in enumerate(self._block.body):
            if statement.kind in _TRIVIA:
                self._folds.step(statement)
                continue
            if statement.kind in _LOOPS:
                self._state = self._state.forget(loops[index], "a loop may have set it otherwise")
            self._step(statement)
        return merged([self._state, *self._ends])

    def _step(self, statement: Statement) -> None:
        kind = statement.kind
        if kind == "assignments":
            self._run_calls(statement)
            for assignment in statement.node.all("assignment"):
                self._assign(assignment)
        elif kind == "call":
            self._run_calls(statement)
            self._call(statement.node, statement.line)
        elif kind in MOTIONS:
            self._run_calls(statement)
            self._motion(statement)
        elif kind == "spline":
            self._splines.append(self._state)
            self._state = self._data.with_list(self._state, statement.node, self._place)
        elif kind == "end_spline":
            self._state = self._splines.pop() if self._splines else self._state
        elif kind == OPAQUE:
            self.unread.append(Unread(statement.line, statement.source[:200], statement.shape.reason))
            if may_touch_frames(statement):
                self._state = State.unknown(f"the statement in line {statement.line} is not understood")
        elif kind == "label":
            self._state = State.unknown("a GOTO may lead here from elsewhere")
        elif kind == "return_":
            self._run_calls(statement)
            self._ends.append(self._state)
        else:
            self._run_calls(statement)
            if kind in ("trigger", "interrupt_declaration"):
                self._later(statement)
        self._follow_blocks(kind)

    def _later(self, statement: Statement) -> None:
        """Forget what a trigger or interrupt assigns: nobody knows when."""
        for assignment in assignments(statement):
            self._state = self._state.forget(self._data.slots_of(left_of(assignment)), "a trigger or interrupt sets it")

    def _run_calls(self, statement: Statement) -> None:
        """Follow the calls within a statement: functions, triggers, interrupts."""
        later = statement.kind in ("trigger", "interrupt_declaration")
        for node in called(statement):
            if node.kind == "call" and not later:
                continue  # the statement itself
            name = node.tokens("NAME")[0].text if node.tokens("NAME") else ""
            if later and name.upper() == "BAS":
                self._state = self._state.forget(SLOTS, "a trigger or interrupt calls BAS")
            elif name and not self._run_time.is_harmless(name):
                self.steps.append(Call(name, statement.line))
                self._state = self._follow(name, self._state, later)
                self._state = self._state.forget(self._handed(node, name), f"{name} gets it and may change it")

    def _loops(self) -> dict[int, set[str]]:
        """Slots that each loop may set, by the place of its head; its condition runs with every turn."""
        found: dict[int, set[str]] = {}
        opened: list[set[str]] = []
        for index, statement in enumerate(self._block.body):
            kind = statement.kind
            if kind in _LOOPS or (opened and kind in _BRANCHES):
                opened.append(found.setdefault(index, set()))
            if opened and kind not in _TRIVIA:
                opened[-1].update(self._touched(statement))
            if opened and kind in _CLOSING:
                _close_within(opened)
        while opened:
            _close_within(opened)
        return found

    def _touched(self, statement: Statement) -> set[str]:
        """Slots that a statement of a loop may set."""
        if may_touch_frames(statement) or statement.kind == "label":
            return set(SLOTS)
        touched: set[str] = set()
        for assignment in assignments(statement):
            touched.update(self._data.slots_of(left_of(assignment)))
        for node in called(statement):
            name = "".join(token.text for token in node.tokens("NAME")[:1])
            if name.upper() == "BAS":
                touched |= self._data.bas(State(), arguments_of(node), self._place).touched()
                touched |= {"tool", "base", "load", "external"} if "PARAMS" in node.text.upper() else set()
            elif name and not self._run_time.is_harmless(name):
                touched.update(self._touch(name), self._handed(node, name))
        return touched

    def _handed(self, call: Node, name: str) -> set[str]:
        """Slots that a call gets as arguments and may change."""
        found: set[str] = set()
        for index, argument in enumerate(arguments_of(call)):
            slots = self._data.slots_of("".join(argument.text.split()).upper())
            if slots and self._run_time.hands_back(name, index):
                found.update(slots)
        return found

    def _follow_blocks(self, kind: str) -> None:
        if kind in _BRANCHES or kind in _LOOPS:
            self._open.append(_Block(kind, self._state))
        elif kind in _INNER and self._open and self._open[-1].kind in _BRANCHES:
            self._branch(kind)
        elif kind in _CLOSING and self._open:
            self._close()

    def _branch(self, kind: str) -> None:
        block = self._open[-1]
        if block.kind == "if_" or block.branches:
            block.ends.append(self._state)
        block.branches += 1
        block.complete |= kind in ("else_", "default")
        self._state = block.before

    def _close(self) -> None:
        block = self._open.pop()
        ends = [*block.ends, self._state]
        if not block.complete:
            ends.append(block.before)
        self._state = merged(ends)

    def _assign(self, assignment: Node) -> None:
        left = left_of(assignment)
        right = assignment.nodes[-1]
        if self._data.slots_of(left):
            self._state = self._data.assign(self._state, assignment, self._place)
        if right.kind == "reference":
            self._folds.assign(left, right.text.strip())

    def _call(self, node: Node, line: int) -> None:
        names = node.tokens("NAME")
        name = names[0].text if names else ""
        arguments = arguments_of(node)
        if name.upper() == "BAS":
            self._state = self._data.bas(self._state, arguments, self._place)
            return
        texts = [argument.text.strip() for argument in arguments]
        if self._forms.welds(name, texts):
            self._weld(texts)
        if not name or self._run_time.is_harmless(name):
            return
        if name.upper() not in self._run_time.routines:
            self._hand_over(name, arguments, line)
        self.steps.append(Call(name, line))
        self._state = self._follow(name, self._state, False)
        self._state = self._state.forget(self._handed(node, name), f"{name} gets it and may change it")

    def _hand_over(self, name: str, arguments: Sequence[Node], line: int) -> None:
        """Add the positions that a routine outside of the backup is handed: it may go there, and nobody knows how."""
        reason = f"the position is handed to {name}, which is not in this backup"
        place = self._place.at(f"{name}@{line}")
        for argument in arguments:
            if self._operands.is_pose(argument, place):
                target = self._operands.read(argument, place).target
                operand = Operand(target, Doubt("RUN_TIME_POSE", f"{argument.text.strip()}: {reason}"))
                labels = [Label(LabelKind.ROUTINE, self._block.name)]
                draft = Draft(Motion.LINEAR, name, line, State.unknown(reason), operand, labels, self._folds.form)
                self.steps.append(draft)

    def _weld(self, arguments: Sequence[str]) -> None:
        """Mark the last motion, if no other routine moved since, as one that welds.

        A call above the motion of its own form prepares the weld of that motion and is no weld of the one before.
        """
        form = self._folds.form
        for step in reversed(self.steps):
            if isinstance(step, Call):
                if self._run_time.may_move(step.name):
                    return  # where the gun welds is not known
                continue
            if form.title and form is not step.form and self._is_inline(form):
                return
            step.weld = True
            if form is not step.form and form.title:  # VKRC: a fold within the point's own names the spot
                step.labels.append(Label(LabelKind.PARAMS, form.title))
            step.labels += self._weld_labels(form, arguments)
            return

    def _is_inline(self, form: Fold) -> bool:
        """Whether an open fold without a motion so far is a form with one: it prepared one."""
        return form.motions == 0 and any(name in ("FDAT_ACT", "PDAT_ACT", "LDAT_ACT") for name in form.assigned)

    def _weld_labels(self, form: Fold, arguments: Sequence[str]) -> Iterator[Label]:
        yield Label(LabelKind.ARGUMENT, ",".join(arguments))
        for argument in arguments:
            name = form.assigned.get(argument.upper(), argument)
            symbol = self._operands.named(name, self._place) if name[:1].isalpha() else None
            if symbol is not None and isinstance(symbol.value, Aggregate):
                yield Label(LabelKind.DATA, symbol.name)
                yield Label(LabelKind.ARGUMENT, str(symbol.value))
            elif name is not argument:
                yield Label(LabelKind.DATA, name)

    def _motion(self, statement: Statement) -> None:
        node = statement.node
        word = next(token.text for token in node.tokens() if token.type.startswith("MOVE"))
        kind = word.upper()
        state = self._data.with_list(self._state, node, self._place)
        circular = "CIRC" in kind
        motion = Motion.CIRCULAR if circular else Motion.JOINT if kind in _JOINT else Motion.LINEAR
        operands = [child for child in node.nodes if child.kind not in ("approximation", "with_")]
        labels = self._folds.labels(statement)
        labels.append(Label(LabelKind.ROUTINE, self._block.name))
        form = self._folds.form
        place = self._place.at(f"{word}@{statement.line}")
        for operand in operands[: 2 if circular else 1]:
            relative = kind.endswith("_REL")
            found = Operand() if relative else self._operands.read(operand, place)
            draft = Draft(motion, word, statement.line, state, found, list(labels), form, relative=relative)
            if relative:
                self._relative(draft, node, operand)
            elif found.target is not None and found.target.declared:
                draft.labels.insert(0, Label(LabelKind.NAME, found.target.name))
            self.steps.append(draft)

    def _relative(self, draft: Draft, node: Node, operand: Node) -> None:
        """LIN_REL and the like: a translation in the base turns with a correction, one in the tool or axes does not."""
        in_tool = any(token.text.upper() == "TOOL" for token in node.tokens("RELATIVE_TO"))
        value = value_of(operand)
        if not isinstance(value, Aggregate):
            draft.operand = Operand(doubt=Doubt("RUN_TIME_POSE", f"{operand.text} is computed while the robot runs"))
            return
        if "A1" in value.members:
            return
        if in_tool:
            draft.operand = Operand(tool_offset=shift_of(value))
            return
        numbers: list[Number | None] = []
        for name in "XYZ":
            member = value.members.get(name)
            numbers.append(member if isinstance(member, Number) else None)
        turns = any((value.number(name) or 0.0) != 0.0 for name in "ABC")
        literal = not turns and all(isinstance(member, Number) for member in value.members.values())
        draft.offset = BaseOffset((numbers[0], numbers[1], numbers[2]), value.span, self._path, draft.line, literal)


def _close_within(opened: list[set[str]]) -> None:
    """What a block may set, the block around it may."""
    touched = opened.pop()
    if opened:
        opened[-1].update(touched)
