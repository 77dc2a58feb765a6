"""Which tools and bases a correction may change: those that nothing uses but what the correction moves."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from respot.correction.scope import Moving, Scope, may_go, positions_of
from respot.geometry import IDENTITY
from respot.issues import Issue
from respot.program.frames import Frame, FrameReading, Role
from respot.program.moves import Move
from respot.program.robot import Robot
from respot.program.targets import TargetKind

#: A turn (largest part of R - 1) that counts as one.
_TURNED = 1e-12


class Changeable:
    """Tells of each tool and base why it must stay as it is.

    Parameters
    ----------
    robot : Robot
    scope : Scope
        What moves.
    """

    def __init__(self, robot: Robot, scope: Scope) -> None:
        self._moved = {id(move) for item in scope.moving for move in item.moves} | {id(move) for move in scope.offsets}
        self._declared = {
            (frame.path, frame.line) for frame in (*robot.tools, *robot.bases)
        }  # an array has one for all
        self._using: dict[int, list[Move]] = {}
        self._homeless: dict[Role, Move] = {}
        for move in robot.moves():
            for frame, role in _frames_of(move):
                if frame is not None:
                    self._using.setdefault(id(frame), []).append(move)
                elif _feels(move) and (not _goes_on(move) or (role == "tool" and _way(move))):
                    self._homeless.setdefault(role, move)
        self._readings: dict[int | Role, FrameReading] = {}
        for reading in robot.readings:
            self._readings.setdefault(reading.role if reading.frame is None else id(reading.frame), reading)
        self._unread = _unread(robot)
        self._encoded = [issue.path for issue in robot.issues if issue.code == "BINARY_MODULE" and issue.path]

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
        if (frame.path, frame.line) not in self._declared:
            return "it stands in a routine or within other data, where nobody looks for a change"
        if self._unread:
            return self._unread
        homeless = self._homeless.get(role)
        if homeless is not None:
            return f"the program does not tell which {role} {_name(homeless)} uses ({homeless.path}:{homeless.line})"
        reading = self._readings.get(id(frame)) or self._readings.get(role)
        return self._users(frame) or (str(reading) if reading else "") or self._turns(frame)

    def unseen(self, frames: Iterable[Frame]) -> list[Issue]:
        """Say what nobody can look into, for frames that change."""
        names = ", ".join(map(str, frames))
        if not self._encoded or not names:
            return []
        message = f"{len(self._encoded)} encoded modules cannot be read: whether they use {names} is not known"
        return [Issue("NOT_CHECKED", message, self._encoded[0])]

    def programs(self, frame: Frame) -> set[str]:
        """Programs that move with a frame."""
        return {move.program for move in self._using.get(id(frame), ()) if _feels(move)}

    def _users(self, frame: Frame) -> str:
        """Say which motion that stays uses a frame."""
        for move in self._using.get(id(frame), ()):
            if _feels(move) and id(move) not in self._moved and not _goes_on(move):
                return f"{_name(move)} in {move.program} uses it too and stays where it is ({move.path}:{move.line})"
        return ""

    def _turns(self, frame: Frame) -> str:
        """Say which motion goes along a tool's axes or turns about its tip: with another tool it ends elsewhere."""
        for move in self._using.get(id(frame), ()):
            if move.tool is not frame:
                continue
            shift, place = move.tool_offset, f"({move.path}:{move.line})"
            if move.workpiece is frame:  # a target on the part comes along, a way along its axes does not
                if _way(move):
                    return f"{_name(move)} goes along its axes {place}"
            elif shift is None:
                return f"{_name(move)} may turn about its tip {place}"
            elif float(np.abs(shift.rotation.as_matrix() - np.eye(3)).max()) > _TURNED:
                return f"{_name(move)} turns about its tip {place}"
        return ""


def _unread(robot: Robot) -> str:
    """Say which statement nobody knows, but for that it may go to a position: under whatever frames."""
    positions = positions_of(robot)
    for routine in robot.routines:
        for unread in routine.unread:
            if may_go(unread, positions):
                return f"nobody knows what {unread.text.strip()!r} does ({routine.path}:{unread.line})"
    return ""


def _feels(move: Move) -> bool:
    """Whether it matters to a motion where its frames are: to joint positions it does not."""
    return move.target is None or move.target.kind is TargetKind.POSE


def _goes_on(move: Move) -> bool:
    """Whether a motion goes on from the last position along the tool's axes: it follows what it starts from."""
    return move.target is None and move.offset is None and not move.unknown


def _way(move: Move) -> bool:
    """Whether a motion goes on by a way along the tool's axes, or turns about its tip."""
    return _goes_on(move) and move.tool_offset is not IDENTITY


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
