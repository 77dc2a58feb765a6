"""Tool, base, load, mode and target of every KRL motion.

Each routine is followed once (`walk`), with its calls first. What a routine leaves as it found it is decided by its
caller; a subprogram that only its own module can call gets what all its calls agree on. Any other routine may be
started from anywhere, so that what it does not set itself is not known.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial

from respot.geometry import IDENTITY
from respot.issues import Issue
from respot.languages.forms import Forms
from respot.languages.krl.blocks import Routine as Block
from respot.languages.krl.frames import Frames, mode_conflict
from respot.languages.krl.motion_data import MotionData
from respot.languages.krl.operands import Operands
from respot.languages.krl.run_time import RunTime, left_of
from respot.languages.krl.state import ENTRY, SLOTS, State, Why, merged
from respot.languages.krl.symbols import Symbols, is_own, module_key
from respot.languages.krl.targets import Targets
from respot.languages.krl.walk import Draft, Walk
from respot.program.frames import Frame
from respot.program.moves import Doubt, Move
from respot.program.robot import Call, Routine
from respot.program.statement import Node
from respot.program.targets import TargetKind

_DEEPEST = 60
_WORD = re.compile(r"[\w$]+")
_UNSET = "nothing in this backup sets it before"


class _Routine:
    """A routine of a file on its way to being bound."""

    def __init__(self, block: Block, program: str, path: str, is_local: bool) -> None:
        self.block = block
        self.program = program
        self.path = path
        self.is_local = is_local  # only its own module can call it
        self.walk: Walk | None = None
        self.left: State | None = None
        self.found: list[tuple[_Routine, State]] = []  # its callers, with the state at each call
        self.entry: State | None = None


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
    forms : Forms
        Instruction forms.
    """

    def __init__(self, symbols: Symbols, frames: Frames, targets: Targets, run_time: RunTime, forms: Forms) -> None:
        self._forms = forms
        self._frames = frames
        self._run_time = run_time
        self._operands = Operands(symbols, targets, run_time, forms)
        unsaid = Why("something in this backup uses the external TCP, and nothing sets $IPO_MODE before")
        self._mode_at_start: bool | Why = unsaid if run_time.external_tcp else False
        self._data = MotionData(frames, self._operands, self._mode_at_start)
        self._by_module: dict[tuple[str, str], _Routine] = {}
        self._global: dict[str, list[_Routine]] = {}
        self._depth = 0
        self.issues: list[Issue] = []

    def bind(self, code: Mapping[str, tuple[str, Sequence[Block]]]) -> list[Routine]:
        """Bind every routine.

        Parameters
        ----------
        code : mapping of str to (str, sequence of Block)
            Program and routines of each file.
        """
        routines: list[_Routine] = []
        for path, (program, blocks) in code.items():
            for index, block in enumerate(blocks):
                is_global = index == 0 or (block.head.shape.tree is not None and bool(block.head.node.tokens("GLOBAL")))
                routine = _Routine(block, program, path, not is_global)
                routines.append(routine)
                self._by_module.setdefault((module_key(path), block.name.upper()), routine)
                if is_global:
                    self._global.setdefault(block.name.upper(), []).append(routine)
        initial_tool = _initial_tool(routines)
        self._data = MotionData(self._frames, self._operands, self._mode_at_start, initial_tool)
        for routine in routines:
            self._left_by(routine)
        for routine in routines:
            self._calls_not_understood(routine)
        return [self._bound(routine) for routine in routines]

    def _calls_not_understood(self, routine: _Routine) -> None:
        """Count a local subprogram that an unread statement names as called from there."""
        for unread in routine.walk.unread if routine.walk is not None else ():
            for word in _WORD.findall(unread.text):
                found = self._by_module.get((module_key(routine.path), word.upper()))
                if found is not None:
                    state = State.unknown(f"the statement in line {unread.line} is not understood and may call it")
                    found.found.append((routine, state))

    def _left_by(self, routine: _Routine) -> State:
        """Follow a routine once; return what it leaves."""
        if routine.left is None:
            if routine.walk is not None or self._depth >= _DEEPEST:
                return State.unknown(f"{routine.block.name} calls itself or lies too deep")
            routine.walk = Walk(
                routine.block,
                routine.path,
                self._operands,
                self._data,
                self._run_time,
                self._forms,
                partial(self._behind, routine),
                partial(self._touched_by, routine),
            )
            self._depth += 1
            left = routine.walk.run()
            if self._mode_at_start is False and left.external is False:
                left = replace(left, external=ENTRY)  # nothing anywhere sets another mode
            routine.left = left
            self._depth -= 1
        return routine.left

    def _behind(self, caller: _Routine, name: str, state: State, later: bool) -> State:
        """State behind a call."""
        found = self._named(name, caller)
        if isinstance(found, str):
            return State.unknown(found)
        if later:
            found.found.append((caller, State.unknown("a trigger or interrupt calls the routine")))
            return state.forget(self._touched_by(caller, name), f"{name} sets it at a time of its own")
        found.found.append((caller, state))
        return self._left_by(found).within(state)

    def _touched_by(self, caller: _Routine, name: str) -> set[str]:
        """Slots that a call may set."""
        found = self._named(name, caller)
        return set(SLOTS) if isinstance(found, str) else self._left_by(found).touched()

    def _named(self, name: str, caller: _Routine) -> _Routine | str:
        """Routine that a name means, or why that is not known."""
        own = self._by_module.get((module_key(caller.path), name.upper()))
        if own is not None:
            return own
        others = self._global.get(name.upper(), [])
        others = [routine for routine in others if is_own(routine.path)] or others
        if len(others) == 1:
            return others[0]
        return f"{name} is not in this backup and may set it" if not others else f"{name} is defined more than once"

    def _entry(self, routine: _Routine, way: tuple[_Routine, ...] = ()) -> State:
        """What a routine finds when it is called."""
        if routine.entry is None:
            start = State.unknown(_UNSET)
            start = State(start.tool, start.base, start.load, self._mode_at_start, start.pending)
            if not routine.is_local or not routine.found or routine in way or len(way) >= _DEEPEST:
                if routine in way or len(way) >= _DEEPEST:
                    return start
                routine.entry = start
            else:
                routine.entry = merged(
                    state.within(self._entry(caller, (*way, routine))) for caller, state in routine.found
                )
        return routine.entry

    def _bound(self, routine: _Routine) -> Routine:
        assert routine.walk is not None  # noqa: S101 - every routine was followed
        entry = self._entry(routine)
        steps: list[Move | Call] = [
            step if isinstance(step, Call) else self._move(routine, step, step.state.within(entry))
            for step in routine.walk.steps
        ]
        self.issues += _issues(routine, [step for step in steps if isinstance(step, Move)])
        name = routine.block.name
        return Routine(
            name,
            routine.program,
            routine.path,
            routine.block.head.line,
            tuple(steps),
            tuple(routine.walk.unread),
            service=self._forms.is_service(name),
        )

    def _move(self, routine: _Routine, draft: Draft, state: State) -> Move:
        target = draft.operand.target
        joints = target is not None and target.kind is TargetKind.JOINTS
        needs_base = draft.offset is not None if draft.relative else target is not None and not joints
        doubts = [] if draft.operand.doubt is None else [draft.operand.doubt]
        unknown = draft.operand.doubt.text if draft.operand.doubt is not None else ""
        if draft.operand.tool_offset is None:  # the target itself can be corrected all the same
            doubts.append(
                Doubt("RUN_TIME_SHIFT", f"what shifts {target or draft.instruction} is computed while the robot runs")
            )
        if draft.relative and target is None and draft.operand.tool_offset is not IDENTITY:
            unknown = unknown or self._unknown_hands(state)
            doubts += [Doubt("UNKNOWN_MODE", unknown)] if unknown and not doubts else []
        if needs_base:
            doubts += self._doubts(state)
            if isinstance(state.external, Why):
                unknown = unknown or f"whether the robot holds the part is not known: {state.external.reason}"
        ids, named = self._forms.spot_ids(draft.labels)
        return Move(
            motion=draft.motion,
            instruction=draft.instruction,
            target=target,
            program=routine.program,
            routine=routine.block.name,
            path=routine.path,
            line=draft.line,
            tool=_known(state.tool),
            base=_known(state.base),
            offset=draft.offset,
            external_tcp=state.external is True,
            weld=draft.weld,
            labels=tuple(draft.labels),
            spot_ids=ids,
            named_spot=named,
            unknown=unknown,
            load=None if isinstance(state.load, Why) else state.load,
            tool_offset=draft.operand.tool_offset,
            doubts=tuple(doubts),
        )

    @staticmethod
    def _unknown_hands(state: State) -> str:
        """Say why it is not known whether the robot holds the gun or the part; empty where it is."""
        if not isinstance(state.external, Why):
            return ""
        return f"whether the robot holds the gun or the part is not known: {state.external.reason}"

    def _doubts(self, state: State) -> list[Doubt]:
        """What is not known of the frames of a motion to a pose."""
        found: list[Doubt] = []
        for code, what, frame in (("UNKNOWN_FRAME", "base", state.base), ("UNKNOWN_TOOL", "tool", state.tool)):
            if isinstance(frame, Why):
                found.append(Doubt(code, f"the {what} is not known: {frame.reason}"))
            elif frame.pose is None:
                found.append(Doubt(code, f"{what} {frame}: {frame.unknown}"))
        if isinstance(state.external, Why):
            if state.external != state.base:
                found.append(Doubt("UNKNOWN_MODE", self._unknown_hands(state)))
        elif isinstance(state.tool, Frame) and isinstance(state.base, Frame):
            conflict = mode_conflict(self._frames.typed(state.tool), self._frames.typed(state.base), state.external)
            if conflict:
                found.append(Doubt("MODE_CONTRADICTS", conflict))
        return found


def _known(frame: Frame | Why) -> Frame | None:
    return None if isinstance(frame, Why) else frame


def _initial_tool(routines: Iterable[_Routine]) -> Node | None:
    """What ``INITMOV`` of ``bas.src`` sets ``$TOOL`` to: ``TOOL_DATA[1]`` or ``$NULLFRAME``, by version."""
    for routine in routines:
        if routine.block.name.upper() == "INITMOV" and routine.program.upper() == "BAS":
            for statement in routine.block.body:
                if statement.kind == "assignments":
                    for assignment in statement.node.all("assignment"):
                        if left_of(assignment) == "$TOOL":
                            return assignment.nodes[-1]
    return None


def _issues(routine: _Routine, moves: Sequence[Move]) -> list[Issue]:
    """One issue for each cause in a routine, at its first motion, with the count."""
    causes: dict[tuple[str, str], list[tuple[Move, Doubt]]] = {}
    for move in moves:
        for doubt in move.doubts:
            cause = "" if doubt.code == "UNKNOWN_TARGET" else doubt.text
            causes.setdefault((doubt.code, cause), []).append((move, doubt))
    return [_issue(routine.block.name, code, found) for (code, _), found in causes.items()]


def _issue(routine: str, code: str, found: Sequence[tuple[Move, Doubt]]) -> Issue:
    move, doubt = found[0]
    message = f"{routine}: {doubt.text}"
    others = [other for _, other in found[1:] if other.text != doubt.text]
    if others:
        names = list(dict.fromkeys(other.text.split(" ", 1)[0] for other in others))
        message += f"; so are {', '.join(names[:5])}" + (f" and {len(names) - 5} more" if len(names) > 5 else "")
    if len(found) > 1:
        message += f" ({len(found)} motions)"
    return Issue(code, message, move.path, move.line)
