"""Where a program displacement may be active: ``PDispSet``, ``PDispOn``, ``PDispOff`` followed along the calls.

A displacement is modal: it lies between object frame and target of every later motion of the task, whatever routine
that stands in, until ``PDispOff`` or the program is started anew (facts: rapid.md 2.4). One bit is followed: whether a
displacement may be active. Behind a label, in an error handler and at the head of a loop it may be whatever it may be
anywhere in the routine or loop.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from respot.issues import Issue
from respot.languages.rapid.blocks import BLOCKS, SECTIONS
from respot.languages.rapid.blocks import Routine as Block
from respot.languages.rapid.calls import Invocation, Line
from respot.languages.rapid.symbols import Module, Task

_ON = frozenset(("pdispset", "pdispon"))
_OFF = "pdispoff"
_AXES = frozenset(("eoffsset", "eoffson"))
_LOOPS = {"for_": "end_for", "while_": "end_while"}
_BRANCHES = frozenset(("if_", "test"))
_BLOCK_ENDS = frozenset(BLOCKS.values())
_BLIND = frozenset(("callbyvar",))


@dataclass
class _Node:
    """A routine with what happens to the displacement in it."""

    block: Block
    module: Module
    lines: list[Line]
    #: routines it calls, by the calls of its lines that are followed: (line, callees)
    calls: list[tuple[int, Sequence[int]]] = field(default_factory=list)
    switches: dict[int, list[Invocation]] = field(default_factory=dict)
    #: some displacement is set in it or in what it calls
    touches: bool = False
    #: state behind it, by the state before it
    leaves: tuple[bool, bool] = (False, True)
    entry: bool = False


class Displacements:
    """Where in a task a displacement may be active.

    Parameters
    ----------
    task : Task
        The task.
    """

    def __init__(self, task: Task) -> None:
        self._task = task
        self._displaced: dict[int, set[int]] = {}
        self._cause = ""
        self.issues: list[Issue] = []
        setting = list(self._setting())
        if setting:
            module, call = setting[0]
            self._cause = f"{call.name} at {module.path}:{call.line} may displace this position"
            self._follow()

    def at(self, block: Block, line: Line) -> str:
        """Why a position may be displaced where a motion stands; empty if it is not."""
        return self._cause if line.statement.start in self._displaced.get(id(block), ()) else ""

    def _setting(self) -> Iterator[tuple[Module, Invocation]]:
        """Yield every call that sets a displacement; note what moves external axes."""
        offsets: list[tuple[Module, Invocation]] = []
        for module in self._task.modules:
            for block in module.routines.values():
                for line in module.lines(block):
                    for call in line.calls:
                        name = call.name.lower()
                        if name in _ON:
                            yield module, call
                        elif name in _AXES:
                            offsets.append((module, call))
        if offsets:
            module, call = offsets[0]
            message = (
                f"{call.name} shifts external axes ({len(offsets)} such in this task): of a servo gun that changes its "
                "opening, but of a track it changes where the robot stands, and respot does not follow it"
            )
            self.issues.append(Issue("EXTERNAL_OFFSET", message, module.path, call.line))

    def _follow(self) -> None:
        nodes = self._nodes()
        self._find_touching(nodes)
        touching = [node for node in nodes.values() if node.touches]
        for node in touching:
            node.leaves = (False, False)
        changed = True
        while changed:
            changed = False
            late = any(node.leaves[0] for node in touching)
            for node in touching:
                leaves = (self._run(node, nodes, False, late)[0], self._run(node, nodes, True, late)[0])
                changed |= leaves != node.leaves
                node.leaves = leaves
        self._enter(nodes, touching)

    def _nodes(self) -> dict[int, _Node]:
        nodes: dict[int, _Node] = {}
        for module in self._task.modules:
            for block in module.routines.values():
                nodes[id(block)] = _Node(block, module, module.lines(block))
        everything = tuple(nodes)
        for node in nodes.values():
            for index, line in enumerate(node.lines):
                callees: list[int] = []
                for call in line.calls:
                    name = call.name.lower()
                    if name in _ON or name == _OFF:
                        node.switches.setdefault(index, []).append(call)
                    elif not name or name in _BLIND:
                        callees += everything
                    elif (found := self._task.routine(name, node.module)) is not None:
                        callees.append(id(found[0]))
                if callees:
                    node.calls.append((index, callees))
        return nodes

    @staticmethod
    def _find_touching(nodes: dict[int, _Node]) -> None:
        callers: dict[int, list[int]] = {}
        for key, node in nodes.items():
            for _, callees in node.calls:
                for callee in callees:
                    callers.setdefault(callee, []).append(key)
        pending = [key for key, node in nodes.items() if node.switches]
        while pending:
            node = nodes[pending.pop()]
            if not node.touches:
                node.touches = True
                pending += callers.get(id(node.block), ())

    def _run(self, node: _Node, nodes: dict[int, _Node], entry: bool, late: bool) -> tuple[bool, list[bool]]:
        """State behind a routine, and before each of its lines."""
        calls = dict(node.calls)
        turning_on = [
            index in node.switches or any(nodes[callee].touches for callee in calls.get(index, ()))
            for index in range(len(node.lines))
        ]
        anywhere = entry or any(turning_on)
        state, exits, states = entry, False, []
        opened: list[tuple[str, bool, list[bool]]] = []
        for index, line in enumerate(node.lines):
            kind = line.statement.kind
            if kind == "label" or kind in SECTIONS:
                exits |= state if kind in SECTIONS else False
                state = anywhere
                opened = [] if kind in SECTIONS else opened
            elif kind in _LOOPS:
                state |= any(turning_on[index : _end_of(node.lines, index)])
            states.append(state)
            after = self._behind(node, nodes, index, calls.get(index, ()), state, late)
            state = state or after if kind == "compact_if" else after
            if kind == "return_":
                exits |= state
            elif kind in _BRANCHES or kind in _LOOPS:
                opened.append((kind, state, [state]))
            elif kind in ("elseif", "else_", "case", "default") and opened:
                opened[-1][2].append(state)
                state = opened[-1][1]
            elif kind in _BLOCK_ENDS and opened:
                state |= any(opened.pop()[2])
        return exits or state, states

    @staticmethod
    def _behind(
        node: _Node, nodes: dict[int, _Node], index: int, callees: Sequence[int], state: bool, late: bool
    ) -> bool:
        for call in node.switches.get(index, ()):
            state = call.name.lower() in _ON
        if len(callees) == len(nodes) > 1:
            return state or late
        for callee in callees:
            state = nodes[callee].leaves[state]
        return state

    def _enter(self, nodes: dict[int, _Node], touching: Sequence[_Node]) -> None:
        """Carry the states to where routines are called; what nobody calls may be called at any time."""
        late = any(node.leaves[0] for node in touching)
        called = {callee for node in nodes.values() for _, callees in node.calls for callee in callees}
        pending = []
        for key, node in nodes.items():
            is_main = node.block.name.lower() == "main"
            if node.block.kind == "trap":
                node.entry = True
            elif is_main:
                node.entry = node.leaves[0]
            elif key not in called:
                node.entry = late
            pending.append(key)
        states: dict[int, list[bool]] = {}
        while pending:
            key = pending.pop()
            node = nodes[key]
            if node.touches:
                before = states[key] = self._run(node, nodes, node.entry, late)[1]
            elif node.entry:
                before = states[key] = [True] * len(node.lines)
            else:
                states[key] = []
                continue
            for index, callees in node.calls:
                if before[index]:
                    for callee in callees:
                        if not nodes[callee].entry:
                            nodes[callee].entry = True
                            pending.append(callee)
        for key, before in states.items():
            lines = nodes[key].lines
            self._displaced[key] = {lines[index].statement.start for index, state in enumerate(before) if state}


def _end_of(lines: Sequence[Line], index: int) -> int:
    """Index behind the loop that begins at a line."""
    depth = 0
    for end in range(index, len(lines)):
        kind = lines[end].statement.kind
        depth += (kind in _LOOPS) - (kind in _LOOPS.values())
        if depth == 0:
            return end + 1
    return len(lines)
