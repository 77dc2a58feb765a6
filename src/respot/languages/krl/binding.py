"""Tool, base and target of every KRL motion, followed statement by statement.

An inline form sets ``FDAT_ACT`` and calls ``BAS(#PTP_PARAMS|#CP_PARAMS, ..)``, which takes tool, base and interpolation
mode from it; hand-written code sets ``$TOOL`` and ``$BASE``; a spline names both in its ``WITH`` list (facts: krl.md
section 5, binding). What two branches of an IF or SWITCH set differently is not known after them.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

from respot.languages.krl.blocks import Routine as Block
from respot.languages.krl.forms import FORMS
from respot.languages.krl.machine import Frames, frame_pose
from respot.languages.krl.symbols import Aggregate, Symbols, value_of
from respot.languages.krl.targets import Targets
from respot.program.frames import Frame
from respot.program.moves import BaseOffset, Motion, Move
from respot.program.robot import Routine
from respot.program.statement import Node, Statement
from respot.program.targets import Number, Target, TargetKind

_MOTIONS = {"PTP": Motion.JOINT, "SPTP": Motion.JOINT, "PTP_REL": Motion.JOINT, "SPTP_REL": Motion.JOINT}
_OPENING = frozenset(("if_", "switch"))
_BRANCHING = frozenset(("else_", "case", "default"))
_CLOSING = frozenset(("end_if", "end_switch"))
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
class _Branches:
    """An open IF or SWITCH: the state before it and at the end of each branch so far."""

    before: _State
    ends: list[_State] = field(default_factory=list)
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
    written : set of str
        Points, in upper case, that some routine assigns to.
    framing : set of str
        Routines, in upper case, after which tool and base are not known.
    """

    def __init__(
        self, symbols: Symbols, frames: Frames, targets: Targets, written: Mapping[str, set[str]], framing: set[str]
    ) -> None:
        self._symbols = symbols
        self._frames = frames
        self._targets = targets
        self._written = written
        self._framing = framing

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
            aggregate = value_of(node)
            found = frame_pose(aggregate) if isinstance(aggregate, Aggregate) else None
            return Frame(text, pose=found, unknown="" if found is not None else "not a complete frame")
        return None

    def _from_fdat(self, name: str, kind: str, module: str) -> Frame | None:
        symbol = self._symbols.find(name, module)
        if symbol is None or not isinstance(symbol.value, Aggregate):
            return None
        number = symbol.value.number(f"{kind}_NO")
        return None if number is None else self._number(kind, int(number))

    def _number(self, kind: str, number: int) -> Frame:
        return self._frames.tool(number) if kind == "TOOL" else self._frames.base(number)

    def apply_fdat(self, state: _State) -> _State:
        """Apply BAS(#PTP_PARAMS) or BAS(#CP_PARAMS): take the frames from FDAT_ACT."""
        fdat = state.pending
        if fdat is None:
            return _State()
        tool, base = fdat.number("TOOL_NO"), fdat.number("BASE_NO")
        return replace(
            state,
            tool=None if tool is None else self._frames.tool(int(tool)),
            base=None if base is None else self._frames.base(int(base)),
            external_tcp=str(fdat.members.get("IPO_FRAME", "")).upper() == "#TCP",
        )

    def target_of(self, node: Node, module: str, place: str, path: str) -> tuple[Target | None, str]:
        """Literal that a motion's operand stands for, and why there is none."""
        while node.kind in ("geometric", "group"):
            # base * (P : F): whatever the operands mean, moving the first moves the product (DESIGN section 5)
            node = node.nodes[0]
        if node.kind == "aggregate":
            value = value_of(node)
            assert isinstance(value, Aggregate)  # noqa: S101
            return self._targets.literal(place, path, value), ""
        name = "".join(node.text.split())
        if node.kind != "reference":
            return None, f"{node.text} is computed while the robot runs"
        if name.startswith("$"):
            return None, ""
        symbol = self._symbols.find(name, module)
        if symbol is None:
            return None, f"{name} is not declared with a position in this backup"
        target = self._targets.declared(symbol)
        if target is None:
            return None, f"{name} has no literal position"
        if module.upper() in self._written.get(name.upper(), ()) and target.kind is TargetKind.POSE:
            return target, f"{name} is assigned to while the robot runs"
        return target, ""


class _Walk:
    """One pass over a routine."""

    def __init__(self, binder: Binder, block: Block, module: str, path: str) -> None:
        self._binder = binder
        self._block = block
        self._module = module
        self._path = path
        self._state = _State()
        self._open: list[_Branches] = []
        self._moves: list[Move] = []
        self._calls: list[str] = []

    def run(self) -> Routine:
        for statement in self._block.body:
            self._step(statement)
        name, line = self._block.name, self._block.head.line
        return Routine(name, self._module, self._path, line, tuple(self._moves), tuple(self._calls))

    def _step(self, statement: Statement) -> None:
        kind = statement.kind
        if kind == "assignments":
            for assignment in statement.node.all("assignment"):
                self._assign(assignment)
        elif kind == "call":
            self._call(statement.node)
        elif kind in ("motion", "relative_motion", "circular_motion"):
            self._moves += self._motion(statement)
        elif kind == "interrupt_declaration":
            self._calls += [call.tokens("NAME")[0].text for call in statement.node.all("call")]
        elif kind in _OPENING:
            self._open.append(_Branches(self._state))
        elif kind in _BRANCHING and self._open:
            self._branch(kind)
        elif kind in _CLOSING and self._open:
            self._close()

    def _branch(self, kind: str) -> None:
        branches = self._open[-1]
        if kind != "case" or branches.ends or self._state is not branches.before:
            branches.ends.append(self._state)
        branches.complete |= kind in ("else_", "default")
        self._state = branches.before

    def _close(self) -> None:
        branches = self._open.pop()
        ends = [*branches.ends, self._state]
        if not branches.complete:
            ends.append(branches.before)
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
        if isinstance(value, Aggregate):
            return value
        symbol = self._binder._symbols.find(node.text, self._module)
        return symbol.value if symbol is not None and isinstance(symbol.value, Aggregate) else None

    def _call(self, node: Node) -> None:
        name = node.tokens("NAME")[0].text
        arguments = [argument.text.strip() for argument in (node.first("arguments") or node).nodes]
        if name.upper() == "BAS":
            self._bas([argument.upper() for argument in arguments])
            return
        if FORMS.welds(name, arguments):
            self._weld()
            return
        self._calls.append(name)
        if name.upper() in self._binder._framing:
            self._state = _State()

    def _bas(self, arguments: list[str]) -> None:
        command = arguments[0] if arguments else ""
        number = int(arguments[1]) if len(arguments) > 1 and arguments[1].isdigit() else None
        frames = self._binder._frames
        if command in ("#PTP_PARAMS", "#CP_PARAMS", "#FRAMES"):
            self._state = self._binder.apply_fdat(self._state)
        elif command == "#TOOL":
            self._state = replace(self._state, tool=None if number is None else frames.tool(number))
        elif command == "#BASE":
            self._state = replace(self._state, base=None if number is None else frames.base(number))
        elif command == "#INITMOV":
            self._state = _State(frames.tool(0), frames.base(0))

    def _weld(self) -> None:
        if not self._moves:
            return
        move = self._moves[-1]
        name = move.target.name if move.target is not None else ""
        self._moves[-1] = replace(move, weld=True, spot_ids=FORMS.spot_ids(name))

    def _motion(self, statement: Statement) -> Iterator[Move]:
        node = statement.node
        word = next(token.text for token in node.tokens() if token.type.startswith("MOVE"))
        tool, base, external = self._frames_of(node)
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
                program=self._module,
                routine=self._block.name,
                path=self._path,
                line=statement.line,
                tool=tool,
                base=base,
                external_tcp=external,
            )
            if relative:
                yield self._relative(move, node, operand)
            else:
                place = f"{word}@{statement.line}"
                target, unknown = self._binder.target_of(operand, self._module, place, self._path)
                ids = FORMS.spot_ids(target.name) if target is not None and target.declared else ()
                yield replace(move, target=target, unknown=unknown, spot_ids=ids)

    def _frames_of(self, node: Node) -> tuple[Frame | None, Frame | None, bool]:
        tool, base, external = self._state.tool, self._state.base, self._state.external_tcp
        for assignment in (item for with_ in node.all("with_") for item in with_.all("assignment")):
            left, right = assignment.nodes[0].text.strip().upper(), assignment.nodes[-1]
            if left == "$TOOL":
                tool = self._binder.frame_of(right, "TOOL", self._module)
            elif left == "$BASE":
                base = self._binder.frame_of(right, "BASE", self._module)
            elif left == "$IPO_MODE":
                external = self._external(right)
        return tool, base, external

    def _external(self, node: Node) -> bool:
        text = "".join(node.text.split())
        name = re.match(r"SIPO_MODE\((\w+)", text, re.IGNORECASE)
        symbol = self._binder._symbols.find(name[1], self._module) if name else None
        if symbol is not None and isinstance(symbol.value, Aggregate):
            return str(symbol.value.members.get("IPO_FRAME", "")).upper() == "#TCP"
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
