"""Tool, base and target of every KRL motion, followed statement by statement.

An inline form sets ``FDAT_ACT`` and calls ``BAS(#PTP_PARAMS|#CP_PARAMS, ..)``, which takes tool, base and interpolation
mode from it; hand-written code sets ``$TOOL`` and ``$BASE``; a spline names both in its ``WITH`` list (facts: krl.md
section 5, binding). What two branches of an IF or SWITCH set differently is not known after them; what a loop sets is
not known where it begins; nothing is known behind a label or behind a call that may set frames.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field, replace

from respot.languages.krl.blocks import Routine as Block
from respot.languages.krl.forms import FORMS
from respot.languages.krl.machine import Frames, frame_pose
from respot.languages.krl.run_time import MOTIONS, RunTime, assignments, called, touches_frames
from respot.languages.krl.symbols import Aggregate, Symbol, Symbols, module_key, value_of
from respot.languages.krl.targets import POSITION_TYPES, Targets
from respot.program.frames import Frame
from respot.program.moves import BaseOffset, Motion, Move
from respot.program.robot import Call, Routine, Unread
from respot.program.statement import OPAQUE, Node, Statement
from respot.program.targets import Number, Target, TargetKind

_MOTIONS = {"PTP": Motion.JOINT, "SPTP": Motion.JOINT, "PTP_REL": Motion.JOINT, "SPTP_REL": Motion.JOINT}
_BRANCHES = frozenset(("if_", "switch"))
_INNER = frozenset(("else_", "case", "default"))
_LOOPS = frozenset(("loop", "while_", "for_", "repeat"))
_CLOSING = frozenset(("end_if", "end_switch", "end_loop", "end_while", "end_for", "until"))
_HARMLESS_BAS = frozenset(("#VEL_PTP", "#VEL_CP", "#ACC_PTP", "#ACC_CP", "#PTP_DAT", "#CP_DAT", "#OUT_CP", "#TRAFO_ON"))
_FRAME_INDEX = re.compile(r"(TOOL|BASE)_DATA\[(\d+)\]")
_FROM_FDAT = re.compile(r"S(?:TOOL2?|BASE)\((\w+)", re.IGNORECASE)


@dataclass(frozen=True)
class _State:
    """What holds before a statement."""

    tool: Frame | None = None
    base: Frame | None = None
    external_tcp: bool = False
    pending: Aggregate | None = None

    def merge(self, other: _State) -> _State:
        """State after two branches: only what both agree on."""
        return _State(
            self.tool if self.tool is other.tool else None,
            self.base if self.base is other.base else None,
            self.external_tcp or other.external_tcp,
        )


@dataclass
class _Block:
    """An open block: the state before it and at the end of each branch so far."""

    kind: str
    before: _State
    ends: list[_State] = field(default_factory=list)
    branches: int = 0
    complete: bool = False  # an ELSE or DEFAULT: one of the branches is taken for sure


class Binder:
    """Binds the motions of one robot.

    Parameters
    ----------
    symbols : Symbols
        Data of the robot.
    frames : Frames
        Its tools and bases.
    targets : Targets
        Its literal positions.
    run_time : RunTime
        What its code changes.
    """

    def __init__(self, symbols: Symbols, frames: Frames, targets: Targets, run_time: RunTime) -> None:
        self.symbols = symbols
        self.frames = frames
        self.run_time = run_time
        self._targets = targets
        self._literal: dict[str, Frame] = {}

    def routine(self, block: Block, module: str, path: str) -> Routine:
        """Motions and calls of a routine."""
        return _Walk(self, block, module, path).run()

    def frame_of(self, node: Node, kind: str, module: str) -> Frame | None:
        """Frame that an expression stands for; None where that is not known before the robot runs."""
        text = "".join(node.text.split()).upper()
        if text in ("$NULLFRAME", "$WORLD"):
            return self._number(kind, 0)
        indexed = _FRAME_INDEX.fullmatch(text)
        if indexed and indexed[1] == kind:
            return self._number(kind, int(indexed[2]))
        from_fdat = _FROM_FDAT.match(text)
        if from_fdat:
            return self._from_fdat(from_fdat[1], kind, module)
        if node.kind == "aggregate":
            return self._literal.setdefault(text, _literal_frame(text, node))
        return None

    def _from_fdat(self, name: str, kind: str, module: str) -> Frame | None:
        fdat = self.fdat(name, module)
        number = None if fdat is None else fdat.number(f"{kind}_NO")
        return None if number is None else self._number(kind, int(number))

    def fdat(self, name: str, module: str) -> Aggregate | None:
        """Frame data of a name; None where there is none or the code changes it."""
        symbol = self.symbols.find(name, module)
        if symbol is None or not isinstance(symbol.value, Aggregate) or self.changed(symbol, module):
            return None
        return symbol.value

    def changed(self, symbol: Symbol, module: str) -> bool:
        """Whether code changes a datum: the code of its own module if it is local, else any."""
        local = module_key(symbol.path) == module and not symbol.visible
        return self.run_time.writes(symbol.name, module if local else None)

    def _number(self, kind: str, number: int) -> Frame:
        return self.frames.tool(number) if kind == "TOOL" else self.frames.base(number)

    def apply_fdat(self, state: _State) -> _State:
        """Apply BAS(#PTP_PARAMS) or BAS(#CP_PARAMS): take the frames from FDAT_ACT."""
        fdat = state.pending
        if fdat is None:
            return _State()
        tool, base = fdat.number("TOOL_NO"), fdat.number("BASE_NO")
        return replace(
            state,
            tool=None if tool is None else self.frames.tool(int(tool)),
            base=None if base is None else self.frames.base(int(base)),
            external_tcp=str(fdat.members.get("IPO_FRAME", "")).upper() == "#TCP",
        )

    def target_of(
        self, node: Node, module: str, place: str, path: str, local: Collection[str]
    ) -> tuple[Target | None, str]:
        """Literal that a motion's operand stands for, and why there is none.

        Parameters
        ----------
        node : Node
            The operand.
        module : str
            Key of the module.
        place : str
            Name for a literal in the code.
        path : str
            File of the motion.
        local : collection of str
            Names, in upper case, that the routine declares itself.
        """
        operands = list(_operands(node))
        if len(operands) > 1 and self._is_composed(operands, module):
            return None, f"{node.text} is composed of several positions"
        # base * (P : F): whatever the operands mean, moving the first moves the product (DESIGN section 5)
        node = operands[0]
        if node.kind == "aggregate":
            value = value_of(node)
            assert isinstance(value, Aggregate)  # noqa: S101
            return self._targets.literal(place, path, value), ""
        name = "".join(node.text.split())
        if node.kind != "reference":
            return None, f"{node.text} is computed while the robot runs"
        if name.partition("[")[0].upper() in local:
            return None, f"{name} is declared in the routine and has its position while the robot runs"
        symbol = self.symbols.find(name, module)
        if symbol is None:
            return None, "" if FORMS.is_home(name) else f"{name} is not declared with a position in this backup"
        if symbol.type == "AMBIGUOUS":
            return None, f"{name} is declared globally in more than one data list"
        target = self._targets.declared(symbol)
        if target is None:
            return None, f"{name} has no literal position"
        if self.changed(symbol, module) and target.kind is TargetKind.POSE:
            return target, f"{name} is assigned to while the robot runs"
        return target, ""

    def _is_composed(self, operands: Sequence[Node], module: str) -> bool:
        """Whether any operand but the first is a position of its own, or the first is none."""
        if operands[0].text.startswith("$"):
            return True
        for operand in operands[1:]:
            symbol = self.symbols.find(operand.text, module) if operand.kind == "reference" else None
            if symbol is not None and symbol.type in POSITION_TYPES and symbol.type != "FRAME":
                return True
        return False


def _operands(node: Node) -> Iterator[Node]:
    """Operands of a frame product, from the left."""
    if node.kind in ("geometric", "group"):
        for child in node.nodes:
            yield from _operands(child)
    else:
        yield node


def _literal_frame(text: str, node: Node) -> Frame:
    aggregate = value_of(node)
    found = frame_pose(aggregate) if isinstance(aggregate, Aggregate) else None
    return Frame(text, pose=found, unknown="" if found is not None else "not a complete frame")


class _Walk:
    """One pass over a routine."""

    def __init__(self, binder: Binder, block: Block, program: str, path: str) -> None:
        self._binder = binder
        self._block = block
        self._program = program
        self._module = module_key(path)
        self._path = path
        self._local = _declared_in(block)
        self._state = _State()
        self._open: list[_Block] = []
        self._steps: list[Move | Call] = []
        self._unread: list[Unread] = []

    def run(self) -> Routine:
        """Return the routine."""
        statements = self._block.body
        for index, statement in enumerate(statements):
            if statement.kind in _LOOPS and any(map(self._may_set_frames, _body(statements, index))):
                self._state = _State()
            self._step(statement)
        name, line = self._block.name, self._block.head.line
        return Routine(name, self._program, self._path, line, tuple(self._steps), tuple(self._unread))

    def _step(self, statement: Statement) -> None:
        kind = statement.kind
        if assignments(statement):
            self._run_calls(statement)
            for assignment in assignments(statement):
                self._assign(assignment)
        elif kind == "call":
            self._call(statement.node, statement.line)
        elif kind in MOTIONS:
            self._steps += self._motion(statement)
        elif kind == "spline":
            self._state = self._with_frames(statement.node)
        elif kind == OPAQUE:
            self._unread.append(Unread(statement.line, statement.source[:200], statement.shape.reason))
            self._state = _State() if touches_frames(statement) else self._state
        elif kind == "label":
            self._state = _State()
        else:
            self._run_calls(statement)
        self._follow_blocks(kind)

    def _run_calls(self, statement: Statement) -> None:
        """Follow the calls within a statement: functions, triggers, interrupts."""
        for node in called(statement):
            name = node.tokens("NAME")[0].text
            if not FORMS.is_harmless(name):
                self._steps.append(Call(name, statement.line))
                if not self._binder.run_time.leaves_frames(name):
                    self._state = _State()

    def _may_set_frames(self, statement: Statement) -> bool:
        if touches_frames(statement):
            return True
        names = (node.tokens("NAME")[0].text for node in called(statement))
        return any(name.upper() != "BAS" and not self._binder.run_time.leaves_frames(name) for name in names)

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
        state = ends[0]
        for other in ends[1:]:
            state = state if state == other else state.merge(other)
        self._state = state

    def _assign(self, assignment: Node) -> None:
        left, right = assignment.nodes[0], assignment.nodes[-1]
        name = "".join(left.text.split()).upper()
        if name == "FDAT_ACT":
            self._state = replace(self._state, pending=self._fdat(right))
        elif name.startswith("FDAT_ACT."):
            self._state = replace(self._state, pending=None)
        elif name == "$TOOL":
            self._state = replace(self._state, tool=self._binder.frame_of(right, "TOOL", self._module))
        elif name == "$BASE":
            self._state = replace(self._state, base=self._binder.frame_of(right, "BASE", self._module))
        elif name.startswith("$TOOL."):
            self._state = replace(self._state, tool=None)
        elif name.startswith("$BASE."):
            self._state = replace(self._state, base=None)
        elif name == "$IPO_MODE":
            self._state = replace(self._state, external_tcp=right.text.strip().upper() == "#TCP")

    def _fdat(self, node: Node) -> Aggregate | None:
        value = value_of(node)
        return value if isinstance(value, Aggregate) else self._binder.fdat(node.text, self._module)

    def _call(self, node: Node, line: int) -> None:
        name = node.tokens("NAME")[0].text
        arguments = [argument.text.strip() for argument in (node.first("arguments") or node).nodes]
        if name.upper() == "BAS":
            self._bas([argument.upper() for argument in arguments])
            return
        if FORMS.welds(name, arguments):
            self._weld()
            return
        if FORMS.is_harmless(name):
            return
        self._steps.append(Call(name, line))
        if not self._binder.run_time.leaves_frames(name):
            self._state = _State()

    def _bas(self, arguments: list[str]) -> None:
        command = arguments[0] if arguments else ""
        number = int(arguments[1]) if len(arguments) > 1 and arguments[1].isdigit() else None
        frames = self._binder.frames
        if command in ("#PTP_PARAMS", "#CP_PARAMS", "#FRAMES"):
            self._state = self._binder.apply_fdat(self._state)
        elif command == "#TOOL":
            self._state = replace(self._state, tool=None if number is None else frames.tool(number))
        elif command == "#BASE":
            self._state = replace(self._state, base=None if number is None else frames.base(number))
        elif command == "#INITMOV":
            self._state = _State(frames.tool(0), frames.base(0))
        elif command not in _HARMLESS_BAS:
            self._state = _State()

    def _weld(self) -> None:
        """Mark the last motion, if no other routine was called since, as one that welds."""
        for index in range(len(self._steps) - 1, -1, -1):
            step = self._steps[index]
            if isinstance(step, Call) and not self._binder.run_time.leaves_frames(step.name):
                return  # that routine may have moved: where the gun welds is not known
            if isinstance(step, Move):
                name = step.target.name if step.target is not None else ""
                self._steps[index] = replace(step, weld=True, spot_ids=FORMS.spot_ids(name))
                return

    def _motion(self, statement: Statement) -> Iterator[Move]:
        node = statement.node
        word = next(token.text for token in node.tokens() if token.type.startswith("MOVE"))
        state = self._with_frames(node)
        relative = word.upper().endswith("_REL")
        motion = Motion.CIRCULAR if "CIRC" in word.upper() else _MOTIONS.get(word.upper(), Motion.LINEAR)
        operands = [child for child in node.nodes if child.kind not in ("approximation", "with_")]
        if motion is Motion.CIRCULAR:
            operands = operands[:2]
        for operand in operands[: 2 if motion is Motion.CIRCULAR else 1]:
            move = Move(
                motion=motion,
                instruction=word,
                target=None,
                program=self._program,
                routine=self._block.name,
                path=self._path,
                line=statement.line,
                tool=state.tool,
                base=state.base,
                external_tcp=state.external_tcp,
            )
            if relative:
                yield self._relative(move, node, operand)
            else:
                place = f"{word}@{statement.line}"
                target, unknown = self._target(operand, place)
                ids = FORMS.spot_ids(target.name) if target is not None and target.declared else ()
                yield replace(move, target=target, unknown=unknown, spot_ids=ids)

    def _target(self, operand: Node, place: str) -> tuple[Target | None, str]:
        if operand.kind == "reference" and operand.text.startswith("$"):
            return None, ""  # the position the robot is at
        return self._binder.target_of(operand, self._module, place, self._path, self._local)

    def _with_frames(self, node: Node) -> _State:
        """State with what a WITH list sets."""
        state = self._state
        for assignment in (item for with_ in node.all("with_") for item in with_.all("assignment")):
            left, right = assignment.nodes[0].text.strip().upper(), assignment.nodes[-1]
            if left == "$TOOL":
                state = replace(state, tool=self._binder.frame_of(right, "TOOL", self._module))
            elif left == "$BASE":
                state = replace(state, base=self._binder.frame_of(right, "BASE", self._module))
            elif left == "$IPO_MODE":
                state = replace(state, external_tcp=self._external(right))
        return state

    def _external(self, node: Node) -> bool:
        text = "".join(node.text.split())
        name = re.match(r"SIPO_MODE\((\w+)", text, re.IGNORECASE)
        fdat = self._binder.fdat(name[1], self._module) if name else None
        if fdat is not None:
            return str(fdat.members.get("IPO_FRAME", "")).upper() == "#TCP"
        return text.upper() == "#TCP"

    def _relative(self, move: Move, node: Node, operand: Node) -> Move:
        """LIN_REL and the like: a translation in the base turns with a correction, one in the tool or axes does not."""
        in_tool = any(token.text.upper() == "TOOL" for token in node.tokens("RELATIVE_TO"))
        value = value_of(operand)
        if not isinstance(value, Aggregate):
            return replace(move, unknown=f"{operand.text} is computed while the robot runs")
        if in_tool or "A1" in value.members:
            return move
        numbers: list[Number | None] = []
        for name in "XYZ":
            member = value.members.get(name)
            numbers.append(member if isinstance(member, Number) else None)
        turns = any((value.number(name) or 0.0) != 0.0 for name in "ABC")
        literal = not turns and all(isinstance(member, Number) for member in value.members.values())
        offset = BaseOffset((numbers[0], numbers[1], numbers[2]), value.span, move.path, move.line, literal)
        return replace(move, offset=offset)


def _declared_in(block: Block) -> set[str]:
    """Names, in upper case, that a routine declares itself: parameters, data, imports."""
    names: set[str] = set()
    for statement in (block.head, *block.body):
        if statement.kind in ("routine", "function", "declaration", "import_"):
            for node in statement.node.walk():
                if node.kind in ("parameter", "variable", "import_"):
                    names.update(token.text.upper() for token in node.tokens("NAME"))
    return names


def _body(statements: Sequence[Statement], start: int) -> Iterator[Statement]:
    """Statements of the loop that begins at ``start``."""
    depth = 0
    for statement in statements[start + 1 :]:
        if statement.kind in _LOOPS or statement.kind in _BRANCHES:
            depth += 1
        elif statement.kind in _CLOSING:
            depth -= 1
        if depth < 0:
            return
        yield statement
