"""Which tool and base each spot of a backup names, and what other tools and bases the backup lists."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from respot.geometry import IDENTITY
from respot.program.frames import Frame
from respot.program.moves import Move
from respot.program.robot import Robot

Rows = NDArray[np.intp]
FrameKind = Literal["tool", "base"]

FRAME_KINDS: tuple[FrameKind, ...] = ("base", "tool")
_WORLD: Mapping[str, Mapping[FrameKind, str]] = {
    "krl": {"tool": "$NULLFRAME", "base": "$WORLD"},
    "rapid": {"tool": "tool0", "base": "wobj0"},
}


@dataclass(frozen=True, eq=False)
class ListedFrame:
    """A tool or base of a backup.

    Attributes
    ----------
    name, label : str
        As programs refer to it, and as people call it; the label may be empty.
    pose : RigidTransform
        ``base2world`` or ``tool2flange``.
    user : RigidTransform or None
        Of a work object its user frame, ``uframe2world``; the object frame is the rest of the pose.
    """

    name: str
    label: str
    pose: RigidTransform
    user: RigidTransform | None = None

    @property
    def text(self) -> str:
        """Name and label for people."""
        return f"{self.name} ({self.label})" if self.label else self.name


@dataclass(frozen=True, eq=False)
class SpotFrames:
    """Frames that n spots name, all welded with a tool on the robot.

    Attributes
    ----------
    programs, tools, bases : tuples of n str
        Names; an empty text where a tool or base is not known.
    listed : mapping of "tool" and "base" to a mapping of name to ListedFrame
        All of the backup whose poses are known, with the flange and the world.
    """

    programs: tuple[str, ...]
    tools: tuple[str, ...]
    bases: tuple[str, ...]
    listed: Mapping[FrameKind, Mapping[str, ListedFrame]]

    @cached_property
    def columns(self) -> dict[str, tuple[str, ...]]:
        """The same as columns of groups."""
        return {"program": self.programs, "base": self.bases, "tool": self.tools}

    def rows(self, rows: Rows) -> SpotFrames:
        """Return those of some spots."""
        programs, tools, bases = (
            tuple(names[row] for row in rows) for names in (self.programs, self.tools, self.bases)
        )
        return SpotFrames(programs, tools, bases, self.listed)


def spot_frames(robot: Robot, moves: Sequence[Move]) -> SpotFrames | None:
    """Frames of the motions that weld the spots; None where the robot holds the part or nothing is known."""
    if not moves or any(move.external_tcp for move in moves):
        return None
    own: dict[FrameKind, list[Frame | None]] = {
        "tool": [move.tool for move in moves],
        "base": [move.base for move in moves],
    }
    declared: dict[FrameKind, Sequence[Frame]] = {"tool": robot.tools, "base": robot.bases}
    listed: dict[FrameKind, Mapping[str, ListedFrame]] = {}
    for kind in FRAME_KINDS:
        used = [frame for frame in own[kind] if frame is not None]
        carried = [frame for frame in declared[kind] if frame.held == (kind == "tool") or robot.language == "krl"]
        listed[kind] = _listed([*used, *carried], _WORLD[robot.language][kind])
    names = {
        kind: tuple("" if frame is None or frame.name not in listed[kind] else frame.name for frame in own[kind])
        for kind in FRAME_KINDS
    }
    return SpotFrames(tuple(move.program for move in moves), names["tool"], names["base"], listed)


def _listed(frames: Iterable[Frame], world: str) -> dict[str, ListedFrame]:
    """Frames by name, the first of a name; those that were never set are the world (or flange) itself."""
    found = {world: ListedFrame(world, "", IDENTITY)}
    seen: dict[str, Frame] = {}
    for frame in frames:
        if frame.pose is not None and frame.name not in seen:
            seen[frame.name] = frame
            found.setdefault(frame.name, ListedFrame(frame.name, frame.label, frame.pose, frame.user))
    return found
