"""Motions before all is known of them: a wrapper's target, tool and work object come from where it is called."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from respot.languages.forms import Forms
from respot.languages.rapid.frames import FrameUse
from respot.languages.rapid.operands import Operand
from respot.languages.rapid.symbols import Module
from respot.program.frames import Load
from respot.program.moves import Doubt, Label, LabelKind, Motion, Move
from respot.program.targets import TargetKind
from respot.source import SourceText

#: Whether a parameter must have been given for the motion to run, by its name in lower case.
Guard = tuple[str, bool]

_TEXT = re.compile(r'"(?:[^"]|"")*"')
_DISABLED = re.compile(r"!+\s*(?:Move|Spot|Arc|Trigg|Search|Calib)\w*[\s\\].*[;,]", re.IGNORECASE)
#: A comment above a motion belongs to it if no more such lines stand between.
_MOST_COMMENTS = 3


@dataclass(frozen=True)
class Draft:
    """A motion.

    Parameters
    ----------
    motion : Motion
        Kind of path.
    instruction : str
        As written.
    line, last : int
        First and last line of its statement.
    operand : Operand
        Where it goes.
    tool, base : FrameUse
        Its frames.
    weld : bool
        It welds.
    data, arguments : tuple of str
        Names of weld data; literals among the arguments.
    guards : tuple of Guard
        Parameters that must have been given, or not, for the motion to run.
    displaced : str
        Why the position may be displaced.
    load : Load or None
        What the robot carries, where the motion says so itself.
    """

    motion: Motion
    instruction: str
    line: int
    last: int
    operand: Operand
    tool: FrameUse
    base: FrameUse
    weld: bool = False
    data: tuple[str, ...] = ()
    arguments: tuple[str, ...] = ()
    guards: tuple[Guard, ...] = ()
    displaced: str = ""
    load: Load | None = None

    @property
    def is_open(self) -> bool:
        """Whether the caller decides where the motion goes, or under which frames."""
        return bool(self.operand.parameter or self.tool.parameter or self.base.parameter)


def allowed(guards: Sequence[Guard], given: Mapping[str, str | None]) -> tuple[Guard, ...] | None:
    """Return what is still to be given for a motion to run; None if it does not run in this call.

    Parameters
    ----------
    guards : sequence of Guard
        What the motion needs.
    given : mapping of str to str or None
        Parameters that the call gives, and for a conditional argument the caller's own parameter.
    """
    left: list[Guard] = []
    for name, wanted in guards:
        if name in given and given[name] is not None:
            left.append((str(given[name]), wanted))
        elif (name in given) != wanted:
            return None
    return tuple(left)


class Finisher:
    """Makes motions of drafts: doubts, labels, spot IDs.

    Parameters
    ----------
    forms : Forms
        Instruction forms.
    sources : mapping of str to SourceText
        Files by path, for the comments beside welds.
    """

    def __init__(self, forms: Forms, sources: Mapping[str, SourceText]) -> None:
        self._forms = forms
        self._sources = sources

    def move(self, draft: Draft, module: Module, routine: str, motion_lines: frozenset[int]) -> Move:
        """Return the motion that a draft has become."""
        operand, target = draft.operand, draft.operand.target
        tool, base = draft.tool.frame, draft.base.frame
        external = base is not None and base.held
        doubts: list[Doubt] = []
        joints = target is not None and target.kind is TargetKind.JOINTS
        unknown = operand.unknown
        if operand.unknown:
            doubts.append(Doubt(operand.code or "RUN_TIME_POSE", operand.unknown))
        elif operand.code:
            doubts.append(Doubt(operand.code, f"{draft.instruction} goes to joints that this backup does not declare"))
        if not joints:
            if target is not None and target.unknown:
                doubts.append(Doubt("RUN_TIME_POSE", f"{target.name}: {target.unknown}"))
            text = f"what shifts {target or draft.instruction} is computed while the robot runs"
            if operand.offset is not None and not operand.offset.literal:
                doubts.append(Doubt("RUN_TIME_POSE", text))
            elif operand.tool_offset is None:
                doubts.append(Doubt("RUN_TIME_SHIFT", text))
            if draft.displaced:
                doubts.append(Doubt("DISPLACED", draft.displaced))
                unknown = unknown or draft.displaced
            if base is not None and base.unknown:
                doubts.append(Doubt("UNKNOWN_FRAME", f"work object {base}: {base.unknown}"))
                if external:
                    unknown = unknown or f"work object {base}: {base.unknown}"
            if tool is not None and tool.unknown:
                doubts.append(Doubt("UNKNOWN_TOOL", f"tool {tool}: {tool.unknown}"))
            elif tool is not None and base is not None and not base.unknown and tool.held == base.held:
                text = f"{tool} and {base} are both held by the robot, or neither is"
                doubts.append(Doubt("CONTRADICTING_FRAMES", text))
                unknown = unknown or text
            if external and (tool is None or (tool.unknown and tool.path is None)):
                # only a gun that stands still goes with a held part, and nobody knows whether this one does
                unknown = unknown or f"the robot holds {base}, but whether the gun stands still is not known"
        labels = self._labels(draft, module, routine, motion_lines)
        ids, named = self._forms.spot_ids(labels)
        return Move(
            motion=draft.motion,
            instruction=draft.instruction,
            target=target,
            program=module.name,
            routine=routine,
            path=module.path,
            line=draft.line,
            tool=tool,
            base=base,
            offset=operand.offset,
            external_tcp=external,
            weld=draft.weld,
            labels=labels,
            spot_ids=ids,
            named_spot=named,
            unknown=unknown,
            load=draft.load or draft.tool.load,
            tool_offset=operand.tool_offset,
            doubts=tuple(doubts),
        )

    def _labels(self, draft: Draft, module: Module, routine: str, motion_lines: frozenset[int]) -> tuple[Label, ...]:
        """Texts about a motion; what does not weld is judged by its own name only, not by what stands around it."""
        labels = []
        target = draft.operand.target
        if target is not None and target.declared:
            labels.append(Label(LabelKind.NAME, target.name))
        labels += [Label(LabelKind.DATA, name) for name in draft.data]
        labels += [Label(LabelKind.ARGUMENT, text) for text in draft.arguments]
        if draft.weld:
            labels += [Label(LabelKind.COMMENT, text) for text in self._comments(draft, module, motion_lines)]
            labels.append(Label(LabelKind.ROUTINE, routine))
        return tuple(labels)

    def _comments(self, draft: Draft, module: Module, motion_lines: frozenset[int]) -> list[str]:
        source = self._sources[module.path]
        found = [_comment(source.line_text(draft.last))]
        line = draft.line - 1
        while line > 0 and len(found) <= _MOST_COMMENTS:
            text = source.line_text(line)
            alone = text.lstrip().startswith("!")
            if line in motion_lines or not (alone or line == draft.line - 1):
                break
            found.append(_comment(text))
            line -= 1
            if not alone:
                break
        return [text for text in found if text]


def _comment(line: str) -> str:
    """Comment of a line without its mark; empty for none, and for a motion that is switched off."""
    at = _TEXT.sub(lambda match: "x" * len(match[0]), line).find("!")
    if at < 0 or _DISABLED.match(line, at):
        return ""
    return line[at:].lstrip("!").strip()


def with_weld(draft: Draft, arguments: Sequence[str] = ()) -> Draft:
    """Return a motion that the call behind it welds at."""
    return replace(draft, weld=True, arguments=(*draft.arguments, *arguments))
