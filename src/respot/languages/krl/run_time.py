"""What KRL code changes while the robot runs: data it assigns to, and frames it leaves behind."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field

from respot.languages.krl.blocks import Routine as Block
from respot.languages.krl.forms import FORMS
from respot.program.statement import OPAQUE, Node, Statement

MOTIONS = frozenset(("motion", "relative_motion", "circular_motion"))
_INDEXED = re.compile(r"(\w+)\[(\d+)\]")
_FRAME_WORDS = re.compile(r"\$TOOL\b|\$BASE\b|FDAT_ACT|\bBAS\s*\(", re.IGNORECASE)
#: Functions of the system that leave frames alone but write into their arguments.
_WRITING = frozenset(("CREAD", "SREAD", "SWRITE", "CAST_FROM", "CAST_TO", "INVERSE", "FORWARD", "VARSTATE"))
_FRAME_DATA = ("$TOOL", "$BASE", "$IPO_MODE", "FDAT_ACT")


def called(statement: Statement) -> Iterator[Node]:
    """Yield every call of a statement: as a statement, in an expression, after DO."""
    if statement.shape.tree is not None and "(" in statement.source:
        for node in statement.node.walk():
            if node.kind in ("call", "function_call"):
                yield node


def assignments(statement: Statement) -> list[Node]:
    """Return every assignment that a statement makes, also after DO; those of a WITH list hold for one motion only."""
    if statement.kind not in ("assignments", "trigger", "interrupt_declaration"):
        return []
    return statement.node.all("assignment")


def touches_frames(statement: Statement) -> bool:
    """Whether a statement sets tool or base itself, or might: nobody knows what an unread one does."""
    if statement.kind == OPAQUE:
        return bool(_FRAME_WORDS.search(statement.source))
    if statement.kind in MOTIONS:
        return False
    if statement.kind == "spline":
        return statement.node.first("with_") is not None
    if any(_left(node).startswith(_FRAME_DATA) for node in assignments(statement)):
        return True
    return any(node.tokens("NAME")[0].text.upper() == "BAS" for node in called(statement))


def _left(assignment: Node) -> str:
    return "".join(assignment.nodes[0].text.split()).upper()


@dataclass
class RunTime:
    """What the code of a robot changes.

    Parameters
    ----------
    framing : set of str
        Routines, in upper case, that move or set frames, themselves or through what they call.
    routines : set of str
        Every routine of the backup, in upper case.
    """

    framing: set[str] = field(default_factory=set)
    routines: set[str] = field(default_factory=set)
    _written: dict[str, set[str]] = field(default_factory=dict)
    _elements: set[str] = field(default_factory=set)

    def writes(self, name: str, module: str | None = None) -> bool:
        """Whether code of a module, or of any, changes a datum or a part of it."""
        modules = self._written.get(name.partition("[")[0].upper(), set())
        return bool(modules) if module is None else module in modules

    def writes_element(self, name: str) -> bool:
        """Whether any code changes an array element such as ``BASE_DATA[1]``."""
        return name.upper() in self._elements or name.partition("[")[0].upper() in self._elements

    def leaves_frames(self, routine: str) -> bool:
        """Whether tool and base are known after a call; nobody knows what a routine outside the backup does."""
        name = routine.upper()
        return name not in self.framing and (name in self.routines or FORMS.is_harmless(name))

    def add(self, assignment: str, module: str) -> None:
        """Add the left side of an assignment."""
        bare = re.split(r"[.\[]", assignment)[0]
        self._written.setdefault(bare, set()).add(module)
        indexed = _INDEXED.match(assignment)
        self._elements.add(indexed.group() if indexed else bare)


def read_run_time(code: Mapping[str, Iterable[Block]]) -> RunTime:
    """Read what the routines change, by the module they stand in."""
    found = RunTime()
    heads: dict[str, list[list[str]]] = {}
    for block in (block for blocks in code.values() for block in blocks):
        heads.setdefault(block.name.upper(), []).append(_directions(block))
    found.routines = set(heads)
    calls: dict[str, set[str]] = {}
    for module, blocks in code.items():
        for block in blocks:
            own = calls.setdefault(block.name.upper(), set())
            for statement in block.body:
                if statement.kind in MOTIONS or touches_frames(statement):
                    found.framing.add(block.name.upper())
                _read_statement(found, statement, module, heads, own)
    growing = True
    while growing:
        more = {name for name, names in calls.items() if name not in found.framing and names & found.framing}
        found.framing |= more
        growing = bool(more)
    return found


def _read_statement(
    found: RunTime, statement: Statement, module: str, heads: Mapping[str, list[list[str]]], calls: set[str]
) -> None:
    for assignment in assignments(statement):
        found.add(_left(assignment), module)
    for node in called(statement):
        name = node.tokens("NAME")[0].text.upper()
        calls.add(name)
        if FORMS.is_harmless(name) and name not in _WRITING:
            continue
        known = heads.get(name, [])
        for index, argument in enumerate((node.first("arguments") or node).nodes):
            # local routines of several modules may share a name: any of them may be meant
            outward = not known or any(index >= len(directions) or directions[index] != "IN" for directions in known)
            if argument.kind == "reference" and outward:
                found.add("".join(argument.text.split()).upper(), module)


def _directions(block: Block) -> list[str]:
    """Direction of each parameter; one without is passed by reference."""
    if block.head.shape.tree is None:
        return []
    parameters = (block.head.node.first("parameters") or block.head.node).all("parameter")
    return [token[0].text.upper() if (token := node.tokens("DIRECTION")) else "" for node in parameters]
