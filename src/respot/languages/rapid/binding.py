"""Tool, work object and target of every RAPID motion, routine by routine.

A motion is told by the types of its arguments, not by its name: plants wrap ``MoveL`` and ``SpotL`` in procedures of
their own, and the order of gun and spot data differs between generations (facts: rapid.md 1.5, 3.1). What a wrapper
does with the target, tool and work object that it is handed is read from its own body, and judged where it is called.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from respot.issues import Issue
from respot.languages.forms import Forms
from respot.languages.rapid.blocks import Routine as Block
from respot.languages.rapid.displacement import Displacements
from respot.languages.rapid.drafts import Draft, Finisher
from respot.languages.rapid.frames import Frames, FrameUse
from respot.languages.rapid.operands import Operands
from respot.languages.rapid.readings import TaskReadings
from respot.languages.rapid.run_time import RunTime
from respot.languages.rapid.symbols import Module, Symbol, Task
from respot.languages.rapid.targets import Targets
from respot.languages.rapid.walk import Context, Summary, Walk
from respot.program.frames import Frame, FrameReading
from respot.program.moves import Move
from respot.program.robot import Call, ProgramFile, Routine

#: Wrappers within wrappers are followed so deep.
_DEEPEST = 40


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
    forms : Forms
        Instruction forms.
    """

    def __init__(self, name: str, task: Task, targets: Targets, run_time: RunTime, forms: Forms) -> None:
        self._name = name
        self._forms = forms
        self._task = task
        self._frames = Frames(task, run_time)
        self._operands = Operands(task, targets, run_time)
        self._displacements = Displacements(task)
        self._context = Context(task, forms, self._frames, self._operands, self._displacements, self._motions_of)
        self._finisher = Finisher(forms, targets.sources)
        self._summaries: dict[int, Summary] = {}
        self._reading: set[int] = set()
        self._called = self._called_routines()
        self.issues = [*task.ambiguities(), *self._displacements.issues]
        for module in task.modules:
            self.issues += module.issues
            for symbol in module.symbols.values():
                self._operands.declare(symbol, module)
            for block in module.routines.values():
                for symbol in task.locals(block, module).values():
                    self._operands.declare(symbol, module)

    def frame(self, symbol: Symbol, module: Module) -> Frame | None:
        """Tool or work object of a datum; one `Frame` for each datum."""
        return self._frames.of(symbol, module).frame

    def readings(
        self, files: Mapping[str, ProgramFile], unread: Mapping[str, bytes], loadable: Mapping[str, bytes]
    ) -> list[FrameReading]:
        """Where code reads tools and work objects; as `TaskReadings.find`, once all routines are bound."""
        return TaskReadings(self._task, self._frames, files).find(unread, loadable)

    def routine(self, block: Block, module: Module) -> Routine:
        """Motions and calls of a routine; what is not known of them goes to `issues`."""
        summary = self._summary(block, module)
        lines = frozenset(step.line for step in summary.steps if isinstance(step, Draft))
        steps: list[Move | Call] = []
        doubts: dict[tuple[str, str], list[int]] = {}
        for step in summary.steps:
            if isinstance(step, Call):
                steps.append(step)
            elif not step.is_open or self._is_left_open(step, block):
                move = self._finisher.move(_closed(step), module, block.name, lines)
                steps.append(move)
                for doubt in move.doubts:
                    doubts.setdefault((doubt.code, doubt.text), []).append(move.line)
        self.issues += summary.issues
        for (code, text), found in doubts.items():
            more = f" ({len(found)} motions of {block.name}, the first here)" if len(found) > 1 else ""
            self.issues.append(Issue(code, f"{text}{more}", module.path, found[0]))
        return Routine(
            block.name,
            module.name,
            module.path,
            block.head.line,
            tuple(steps),
            tuple(summary.unread),
            self._name,
            self._forms.is_service(block.name),
        )

    def _is_left_open(self, draft: Draft, block: Block) -> bool:
        """Whether a motion of a wrapper that nobody calls goes to a target of its own."""
        return draft.operand.target is not None and id(block) not in self._called

    def _called_routines(self) -> set[int]:
        found = set()
        for module in self._task.modules:
            for block in module.routines.values():
                for line in module.lines(block):
                    for call in line.calls:
                        callee = self._task.routine(call.name, module) if call.name else None
                        if callee is not None:
                            found.add(id(callee[0]))
        return found

    def _summary(self, block: Block, module: Module) -> Summary:
        key = id(block)
        found = self._summaries.get(key)
        if found is None:
            self._reading.add(key)
            found = self._summaries[key] = Walk(self._context, block, module).run()
            self._reading.discard(key)
        return found

    def _motions_of(self, block: Block, module: Module) -> list[Draft | Call] | None:
        """Motions and calls of a routine that is called; None if it calls itself, or goes too deep."""
        if id(block) in self._reading or (len(self._reading) > _DEEPEST and id(block) not in self._summaries):
            return None
        return self._summary(block, module).steps


def _closed(draft: Draft) -> Draft:
    """Return a motion of a wrapper that nobody calls: what its caller would decide is not known."""
    if not draft.is_open:
        return draft
    reason = "is a parameter of the routine, and nobody calls it"
    tool, base = (
        FrameUse(Frame(use.parameter, pose=None, unknown=reason)) if use.parameter else use
        for use in (draft.tool, draft.base)
    )
    return replace(draft, tool=tool, base=base)
