"""Which tools and bases a correction may change: those that nothing uses but what the correction moves."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np

from respot.correction.scope import Moving, Scope
from respot.program.frames import Frame
from respot.program.moves import Move
from respot.program.robot import ProgramFile, Robot
from respot.program.statement import Statement
from respot.program.targets import TargetKind

#: What a motion uses a frame as.
Role = Literal["base", "tool"]

#: A turn (largest part of R - 1) that counts as one.
_TURNED = 1e-12
#: ``BASE_DATA[`` of a number that is computed.
_ARRAY = re.compile(r"(.*\[)\d+\]")


class _Place(NamedTuple):
    path: str
    line: int

    def __str__(self) -> str:
        return f"{self.path}:{self.line}"


class Changeable:
    """Tells of each tool and base why it must stay as it is.

    Parameters
    ----------
    robot : Robot
    scope : Scope
        What moves.
    """

    def __init__(self, robot: Robot, scope: Scope) -> None:
        self._robot = robot
        moved = {id(move) for item in scope.moving for move in item.moves} | {id(move) for move in scope.offsets}
        self._moved = moved
        self._using: dict[int, list[Move]] = {}
        self._homeless: dict[Role, Move] = {}
        self._names: dict[int, Frame] = {}
        for move in robot.moves():
            for frame, role in _frames_of(move):
                if frame is None:
                    if _has_pose(move):
                        self._homeless.setdefault(role, move)
                    continue
                self._names[id(frame)] = frame
                self._using.setdefault(id(frame), []).append(move)

    def objection(self, frame: Frame, role: Role) -> str:
        """Why a frame stays as it is; empty where nothing speaks against a change.

        Parameters
        ----------
        frame : Frame
        role : str
            What the moved targets use it as.
        """
        if frame.world:
            return "it is the world" if role == "base" else "it is the flange"
        if frame.pose is None or frame.literal is None:
            return "its numbers stand in no single place of the backup"
        homeless = self._homeless.get(role)
        if homeless is not None:
            return f"the program does not tell which {role} {_name(homeless)} uses ({homeless.path}:{homeless.line})"
        return self._users(frame) or self._readers(frame) or (self._turns(frame) if role == "tool" else "")

    def programs(self, frame: Frame) -> set[str]:
        """Programs that move with a frame."""
        return {move.program for move in self._using.get(id(frame), ()) if _feels(move)}

    def _users(self, frame: Frame) -> str:
        """Say which motion that stays uses a frame."""
        for move in self._using.get(id(frame), ()):
            if _feels(move) and id(move) not in self._moved and not _along_tool(move):
                return f"{_name(move)} in {move.program} uses it too and stays where it is ({move.path}:{move.line})"
        return ""

    def _turns(self, frame: Frame) -> str:
        """Say which motion turns about the TCP: about another TCP it would end elsewhere."""
        for move in self._using.get(id(frame), ()):
            shift = move.tool_offset
            if shift is None or float(np.abs(shift.rotation.as_matrix() - np.eye(3)).max()) > _TURNED:
                return f"{_name(move)} turns about its tip ({move.path}:{move.line})"
        return ""

    def _readers(self, frame: Frame) -> str:
        """Say which code or other frame is made of a frame."""
        wanted = _plain(frame.name)
        for other in self._names.values():
            if other is not frame and wanted in _words(other.name):
                return f"{other.name} is made of it"
        place = self._mentions.get(wanted) or self._mentions.get(_ARRAY.sub(r"\1", wanted))
        return "" if place is None else f"code reads it ({place})"

    @cached_property
    def _mentions(self) -> dict[str, _Place]:
        """First place where code other than a motion names each frame, or an array of frames with a computed number."""
        names = {_plain(frame.name) for frame in self._names.values() if not frame.world}
        heads = {match[1] for name in names if (match := _ARRAY.fullmatch(name))}
        first_words = {re.split(r"[^\w$]", name)[0] for name in names}
        quick = re.compile("|".join(map(re.escape, sorted(first_words))) or r"(?!)", re.IGNORECASE)
        bound = {(move.path, move.line) for move in self._robot.moves()}
        found: dict[str, _Place] = {}
        for path, file in self._robot.files.items():
            for statement in _code(file):
                if not quick.search(file.source.text, statement.start, statement.end):
                    continue
                if (path, statement.line) in bound or self._declares(path, statement):
                    continue
                for name in _words(_SETS.sub("", _plain(_written(statement)))):
                    head = next((head for head in heads if name.startswith(head)), None)
                    known = name if name in names else head
                    if known is not None:
                        found.setdefault(known, _Place(path, statement.line))
        return found

    def _declares(self, path: str, statement: Statement) -> bool:
        """Whether a statement is the declaration of a frame."""
        return (path, statement.start) in self._declarations

    @cached_property
    def _declarations(self) -> set[tuple[str, int]]:
        spans: dict[str, list[int]] = {}
        for frame in (*self._names.values(), *self._robot.tools, *self._robot.bases):
            for literal in (frame.literal, frame.user_literal):
                if literal is not None:
                    spans.setdefault(literal.path, []).append(literal.span[0])
        found: set[tuple[str, int]] = set()
        for path, starts in spans.items():
            statements = self._robot.files[path].statements
            firsts = np.array([statement.start for statement in statements])
            rows = np.searchsorted(firsts, starts, side="right") - 1
            found |= {(path, statements[row].start) for row in rows.tolist()}
        return found


#: ``$BASE=BASE_DATA[1]`` and the like: taking a frame is what it is there for.
_SETS = re.compile(r"\$(?:base|tool)=(?:base|tool)_data\[[^\]]*\](?![:.])")
#: Words with an index: ``base_data[1]``, ``wobj_door``.
_WORD = re.compile(r"[^\W\d][\w$]*(?:\[[^\]]*\])?")


def _code(file: ProgramFile) -> Iterator[Statement]:
    """Statements of a file; the system's own frame handling is known."""
    return iter(()) if file.program.lower() in _SYSTEM else iter(file.statements)


#: ``bas.src`` hands tools and bases to motions; its ways are those of the reader.
_SYSTEM = frozenset(("bas",))


def _written(statement: Statement) -> str:
    """Text of a statement without its comments."""
    return " ".join(statement.text[start:end] for start, end in statement.tokens())


def _plain(text: str) -> str:
    return "".join(text.split()).lower()


def _words(text: str) -> set[str]:
    return set(_WORD.findall(_plain(text)))


def _has_pose(move: Move) -> bool:
    return move.target is not None and move.target.kind is TargetKind.POSE


def _feels(move: Move) -> bool:
    """Whether it matters to a motion where its frames are: to joint positions it does not."""
    return move.target is None or move.target.kind is TargetKind.POSE


def _along_tool(move: Move) -> bool:
    """Whether a motion goes on from the last position along the tool's axes: it follows what it starts from."""
    return move.target is None and move.offset is None and not move.unknown


def _name(move: Move) -> str:
    return str(move.target) if move.target is not None else f"{move.instruction}@{move.line}"


def roles(items: Iterable[Moving]) -> list[tuple[Frame, Role, Sequence[Moving]]]:
    """Frames of moved targets, what they are used as, and the targets."""
    found: dict[tuple[int, Role], tuple[Frame, list[Moving]]] = {}
    for item in items:
        pairs = [pair for move in item.moves for pair in _frames_of(move)]
        used = {(id(frame), role): frame for frame, role in pairs if frame is not None}
        for key, frame in used.items():
            found.setdefault(key, (frame, []))[1].append(item)
    return [(frame, role, users) for (_, role), (frame, users) in found.items()]


def _frames_of(move: Move) -> tuple[tuple[Frame | None, Role], ...]:
    return (move.base, "base"), (move.tool, "tool")
