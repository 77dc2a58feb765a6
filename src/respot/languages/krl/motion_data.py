"""What statements do to tool, base, load and interpolation mode: ``BAS``, ``FDAT_ACT``, ``$TOOL=``, WITH lists.

Source: ``bas.src`` (facts: krl.md section 5, binding). ``BAS(#PTP_PARAMS|#CP_PARAMS|#FRAMES)`` takes them from
``FDAT_ACT``; a spline takes them from the functions of its WITH list.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace

from respot.geometry import IDENTITY
from respot.languages.krl.frames import Frames, frame_pose, literal_load
from respot.languages.krl.operands import Operands, Place
from respot.languages.krl.run_time import left_of
from respot.languages.krl.state import State, Why
from respot.languages.krl.symbols import Aggregate, value_of
from respot.program.frames import Frame, Load
from respot.program.statement import Node
from respot.program.targets import Number

#: Commands of BAS that leave frames alone.
_HARMLESS = frozenset(
    [
        "#VEL_PTP",
        "#VEL_CP",
        "#ACC_PTP",
        "#ACC_CP",
        "#ACC_GLUE",
        "#PTP_DAT",
        "#CP_DAT",
        "#OUT_CP",
        "#TRAFO_ON",
        "#OUT_SYNC",
        "#OUT_ASYNC",
        "#GROUP",
    ]
)
_DATA = re.compile(r"(TOOL|BASE)_DATA\[(.*)\]")
_NULL = frozenset(("$NULLFRAME", "$WORLD"))
#: Functions that put a base on a moving kinematic, a conveyor or another robot.
_MOVING = frozenset(("EK", "EB", "EB_ABS", "LK"))
#: What `left_of` may be, and the slot it sets.
_SLOTS = {"$TOOL": "tool", "$BASE": "base", "$LOAD": "load", "$IPO_MODE": "external", "FDAT_ACT": "pending"}


class MotionData:
    """Follows what statements set.

    Parameters
    ----------
    frames : Frames
        Tools, bases and loads of the robot.
    operands : Operands
        Its data.
    mode_at_start : bool or Why
        Whether a robot is in external-TCP mode where nobody says.
    initial_tool : Node or None
        What ``INITMOV`` of this backup's ``bas.src`` sets ``$TOOL`` to.
    """

    def __init__(
        self, frames: Frames, operands: Operands, mode_at_start: bool | Why, initial_tool: Node | None = None
    ) -> None:
        self._frames = frames
        self._operands = operands
        self.mode_at_start = mode_at_start
        self._initial_tool = initial_tool

    @staticmethod
    def slots_of(left: str) -> tuple[str, ...]:
        """Slots that an assignment to a name, in upper case, sets."""
        slot = _SLOTS.get(left.partition(".")[0])
        return (slot,) if slot is not None else ()

    def assign(self, state: State, assignment: Node, place: Place) -> State:
        """Follow an assignment."""
        left, right = left_of(assignment), assignment.nodes[-1]
        if left == "$TOOL":
            return replace(state, tool=self.frame(right, "TOOL", place, state))
        if left == "$BASE":
            return replace(state, base=self.frame(right, "BASE", place, state))
        if left == "$LOAD":
            return replace(state, load=self._load(right, place))
        if left == "$IPO_MODE":
            return replace(state, external=self._mode(right, place))
        if left == "FDAT_ACT":
            return replace(state, pending=self._fdat(right, place))
        if left.startswith("FDAT_ACT."):
            return replace(state, pending=_with_member(state.pending, left.partition(".")[2], right))
        return state.forget(self.slots_of(left), f"{left} is changed by itself")

    def with_list(self, state: State, node: Node, place: Place) -> State:
        """State with what the WITH lists of a motion or spline set."""
        for with_ in node.all("with_"):
            for assignment in with_.all("assignment"):
                state = self.assign(state, assignment, place)
        return state

    def bas(self, state: State, arguments: Sequence[Node], place: Place) -> State:
        """Follow a call of BAS."""
        command = arguments[0].text.strip().upper() if arguments else ""
        if command in ("#PTP_PARAMS", "#CP_PARAMS", "#FRAMES"):
            return self._apply(state)
        if command in ("#TOOL", "#BASE"):
            number = self._operands.whole(arguments[1], place) if len(arguments) > 1 else None
            what = Why(f"BAS({command},{arguments[1].text if len(arguments) > 1 else ''}): the number is not known")
            if command == "#BASE":
                return replace(state, base=what if number is None else self._frames.base(number))
            if number is None:
                return replace(state, tool=what, load=what)
            return replace(state, tool=self._frames.tool(number), load=self._frames.load(number))
        if command == "#INITMOV":
            return replace(state, tool=self._tool_at_start(state), base=self._frames.base(0), external=False)
        if command == "#EX_BASE":
            return replace(state, base=self._frames.moving("EX_BASE"))
        return state if command in _HARMLESS else State.unknown(f"nobody knows what BAS({command}) does")

    def frame(self, node: Node, kind: str, place: Place, state: State) -> Frame | Why:
        """Frame that an expression stands for."""
        text = "".join(node.text.split())
        upper = text.upper()
        if upper in _NULL:
            return self._frames.numbered(kind, 0)
        if upper in ("$TOOL", "$BASE"):
            return state.tool if upper == "$TOOL" else state.base
        if node.kind == "group":
            return self.frame(node.nodes[0], kind, place, state)
        if node.kind == "reference":
            return self._named(node, text, place)
        if node.kind == "function_call":
            return self._function(node, text, kind, place)
        if node.kind == "aggregate":
            value = value_of(node)
            found = frame_pose(value) if isinstance(value, Aggregate) else None
            return Why(f"{text} is not a complete frame") if found is None else self._frames.literal(text, found)
        if node.kind == "geometric":
            return self._composed(node, text, kind, place, state)
        return Why(f"{text} is computed while the robot runs")

    def _named(self, node: Node, text: str, place: Place) -> Frame | Why:
        data = _DATA.fullmatch(text.upper())
        if data:
            name = self._operands.name_of(node, place)
            number = None if name is None else _DATA.fullmatch(name.upper())
            if number is None or not number[2].isdigit():
                return Why(f"{text}: the number is computed while the robot runs")
            return self._frames.numbered(number[1], int(number[2]))
        symbol = self._operands.constant(node, place)
        if symbol is None:
            return Why(f"{text} has its value while the robot runs")
        found = frame_pose(symbol.value) if isinstance(symbol.value, Aggregate) else None
        if found is None:
            return Why(f"{text} has no literal value")
        return self._frames.literal(symbol.name, found, symbol.path, symbol.line)

    def _function(self, node: Node, text: str, kind: str, place: Place) -> Frame | Why:
        name = node.tokens("NAME")[0].text.upper()
        arguments = (node.first("arguments") or node).nodes
        if name in _MOVING and kind == "BASE":
            return self._frames.moving(text)
        if name in ("STOOL", "STOOL2", "SBASE") and arguments:
            number = self._number(arguments[0], f"{kind}_NO", place)
            if number is not None:
                return self._frames.numbered(kind, number)
        return Why(f"{text} is computed while the robot runs")

    def _number(self, node: Node, member: str, place: Place) -> int | None:
        """Return the number in ``Fp2``, ``Fp2.BASE_NO`` or a plain expression."""
        text = "".join(node.text.split())
        bare = text.rpartition(".")[0] if text.upper().endswith(f".{member}") else text
        symbol = self._operands.named(bare, place)
        value = symbol.value if symbol is not None else None
        if isinstance(value, Aggregate):
            number = value.number(member)
            return None if number is None else int(number)
        return self._operands.whole(node, place)

    def _composed(self, node: Node, text: str, kind: str, place: Place, state: State) -> Frame | Why:
        product, first = IDENTITY, None
        for operand in node.nodes:
            frame = self.frame(operand, kind, place, state)
            if isinstance(frame, Why):
                return frame
            if frame.pose is None:
                return Why(f"{frame}: {frame.unknown}")
            product, first = product * frame.pose, first or frame
        return self._frames.literal(text, product) if first is None else self._frames.composed(text, product, first)

    def _load(self, node: Node, place: Place) -> Load | Why:
        text = "".join(node.text.split())
        name = self._operands.name_of(node, place) if node.kind == "reference" else None
        numbered = re.fullmatch(r"LOAD_DATA\[(\d+)\]", name.upper()) if name else None
        if numbered:
            return self._frames.load(int(numbered[1]))
        value = value_of(node)
        if isinstance(value, Aggregate):
            return literal_load(text, value)
        if node.kind == "function_call" and node.tokens("NAME")[0].text.upper() == "SLOAD":
            arguments = (node.first("arguments") or node).nodes
            number = self._number(arguments[0], "TOOL_NO", place) if arguments else None
            if number is not None:
                return self._frames.load(number)
        return Why(f"{text} has its value while the robot runs")

    def _mode(self, node: Node, place: Place) -> bool | Why:
        text = "".join(node.text.split())
        match = re.fullmatch(r"SIPO_MODE\((.*)\)", text, re.IGNORECASE)
        mode = match[1] if match else text
        if not mode.startswith("#"):
            symbol = self._operands.named(mode.upper().removesuffix(".IPO_FRAME"), place)
            if symbol is None or not isinstance(symbol.value, Aggregate):
                return Why(f"$IPO_MODE={text} has its value while the robot runs")
            return self._mode_in(symbol.value.members)
        return mode.upper() == "#TCP"

    def _mode_in(self, members: Mapping[str, object]) -> bool | Why:
        mode = str(members.get("IPO_FRAME", "")).upper()
        if mode in ("#TCP", "#BASE"):
            return mode == "#TCP"
        return self.mode_at_start if not mode or mode == "#NONE" else Why(f"IPO_FRAME {mode} is no mode")

    def _fdat(self, node: Node, place: Place) -> Aggregate | Why:
        value = value_of(node)
        if isinstance(value, Aggregate):
            return value
        symbol = self._operands.constant(node, place)
        if symbol is None or not isinstance(symbol.value, Aggregate):
            return Why(f"FDAT_ACT={node.text.strip()} has its value while the robot runs or is not declared")
        return symbol.value

    def _apply(self, state: State) -> State:
        """Follow FRAMES() of bas.src: take tool, load, base and mode from FDAT_ACT."""
        fdat = state.pending
        if isinstance(fdat, Why):
            return State(fdat, fdat, fdat, fdat, fdat)
        tool, base = fdat.number("TOOL_NO"), fdat.number("BASE_NO")
        return State(
            tool=Why("TOOL_NO of FDAT_ACT is not known") if tool is None else self._frames.tool(int(tool)),
            base=Why("BASE_NO of FDAT_ACT is not known") if base is None else self._frames.base(int(base)),
            load=Why("TOOL_NO of FDAT_ACT is not known") if tool is None else self._frames.load(int(tool)),
            external=self._mode_in(fdat.members),
            pending=fdat,
        )

    def _tool_at_start(self, state: State) -> Frame | Why:
        if self._initial_tool is None:
            return Why("BAS(#INITMOV) sets the tool, and bas.src is not in this backup")
        return self.frame(self._initial_tool, "TOOL", Place("", ""), state)


def _with_member(pending: Aggregate | Why, name: str, right: Node) -> Aggregate:
    """FDAT_ACT with one member set by itself; a member whose value is not known is left out."""
    members = {} if isinstance(pending, Why) else dict(pending.members)
    value = value_of(right)
    if isinstance(value, Number) or str(value).startswith("#"):
        members[name] = value
    else:
        members.pop(name, None)
    span = right.span if isinstance(pending, Why) else pending.span
    return Aggregate(members, "FDAT", span)
