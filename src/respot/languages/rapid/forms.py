"""Instruction forms of RAPID: which argument of a motion is its target, gun, spot data, tool (facts: rapid.md 1.5, 3).

The order of gun and spot data differs between generations and simulators: the declared type of an identifier decides,
its place only where that is not known.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from respot.languages.forms import Forms
from respot.languages.rapid.calls import Argument, Invocation
from respot.program.moves import Motion
from respot.program.statement import Node
from respot.source import Edit, Span

FORMS = Forms.load(Path(__file__).with_name("profiles"))

#: Types of weld data, in the order in which their names tell a spot.
_WELD_DATA = ("spotdata", "forcedata", "gundata")
_GUNS = ("gunnum", "gundata")


@dataclass(frozen=True)
class InstructionForm:
    """A motion instruction of RobotWare.

    Parameters
    ----------
    motion : Motion
        Kind of path.
    targets : tuple of int
        Which of its arguments without a name it goes to, from 0.
    tool : int or None
        Which of them is the tool; negative from the end; None if it has none.
    joints : bool
        It goes to joints.
    """

    motion: Motion
    targets: tuple[int, ...]
    tool: int | None = -1
    joints: bool = False


_FORMS = (
    (r"Move(?P<kind>[LJ])", (0,), -1),
    (r"Move(?P<kind>[LJ])(?:DO|GO|AO|Sync)", (0,), 3),
    (r"Move(?P<kind>C)", (0, 1), -1),
    (r"Move(?P<kind>C)(?:DO|GO|AO|Sync)", (0, 1), 4),
    (r"SpotM?(?P<kind>[LJ])|Calib(?P<kind2>[LJ])|Trigg(?P<kind3>[LJ])(?:IOs)?", (0,), -1),
    (r"Arc(?P<kind>L)(?:Start|End|1|2)?", (0,), -1),
    (r"Trigg(?P<kind>C)|Arc(?P<kind2>C)(?:Start|End|1|2)?", (0, 1), -1),
    (r"Search(?P<kind>L)", (2,), -1),
    (r"Search(?P<kind>C)", (2, 3), -1),
)  # fmt: skip
_COMPILED = [(re.compile(pattern, re.IGNORECASE), targets, tool) for pattern, targets, tool in _FORMS]
_TO_JOINTS = {
    "moveabsj": InstructionForm(Motion.JOINT, (0,), -1, joints=True),
    "triggabsj": InstructionForm(Motion.JOINT, (0,), -1, joints=True),
    "moveextj": InstructionForm(Motion.JOINT, (0,), None, joints=True),
    "arcmoveextj": InstructionForm(Motion.JOINT, (0,), None, joints=True),
}
_KINDS = {"L": Motion.LINEAR, "J": Motion.JOINT, "C": Motion.CIRCULAR}


@lru_cache(maxsize=4096)
def instruction_form(name: str) -> InstructionForm | None:
    """Return the form of a motion instruction of RobotWare, None of anything else."""
    if name.lower() in _TO_JOINTS:
        return _TO_JOINTS[name.lower()]
    for pattern, targets, tool in _COMPILED:
        match = pattern.fullmatch(name)
        if match is not None:
            kind = next(group for group in match.groups() if group)
            return InstructionForm(_KINDS[kind.upper()], targets, tool)
    return None


def weld_data(arguments: Sequence[Argument], types: Sequence[str]) -> tuple[str, ...]:
    """Names of the weld data among the arguments of a call, by their declared types; those of spots first."""
    return tuple(
        item.value.text
        for wanted in _WELD_DATA
        if wanted in types
        for item, kind in zip(arguments, types, strict=True)
        if kind == wanted and item.value is not None
    )


def literal_arguments(arguments: Sequence[Argument]) -> tuple[str, ...]:
    """Texts and numbers that a call is given as literals, without quotes."""
    nodes = [item.value for item in arguments if item.value is not None]
    return tuple(node.text.strip('"') for node in nodes if node.kind in ("string", "number"))


@dataclass(frozen=True)
class SpotField:
    """A field of a spot instruction: its text and its place in the file."""

    text: str
    span: Span

    def edit(self, text: str) -> Edit:
        """Return the change of the field to another text."""
        return Edit(self.span, text, "form")


def read_instruction(call: Invocation, type_of: Callable[[Node], str]) -> dict[str, SpotField]:
    r"""Fields of a spot instruction by name: target, speed, gun, spot, tool, wobj, and each option by its own name.

    Parameters
    ----------
    call : Invocation
        The instruction.
    type_of : callable
        Declared type of the datum that an expression names, in lower case; empty where it is not declared.

    Returns
    -------
    dict of str to SpotField
        ``gun`` and ``spot`` are left out where neither a declared type nor the other one tells them apart. Of
        ``SpotML`` the spot data are ``g1`` to ``g4``. A switch has an empty text.
    """
    arguments = call.arguments()
    positional = [item.value for item in arguments if not item.name and item.value is not None]
    found = {item.name: _field(item.value) for item in arguments if item.name}
    names = ["target", "speed", *([""] * (len(positional) - 3)), "tool"][: len(positional)]
    between = positional[2:-1] if len(positional) > 3 else []
    types = [type_of(node) for node in between]
    spots = [place for place, kind in enumerate(types) if kind == "spotdata"]
    guns = [place for place, kind in enumerate(types) if kind in _GUNS]
    if len(between) == 2 and len(spots) == 1:
        guns = [1 - spots[0]]
    elif len(between) == 2 and len(guns) == 1:
        spots = [1 - guns[0]]
    for places, name in ((spots, "spot"), (guns, "gun")):
        if len(places) == 1:
            names[2 + places[0]] = name
    for name, node in zip(names, positional, strict=True):
        if name:
            found[name] = _field(node)
    return found


def _field(node: Node | None) -> SpotField:
    return SpotField("", (0, 0)) if node is None else SpotField(node.text, node.span)
