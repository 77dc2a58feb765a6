"""Tools and bases as a program names them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from scipy.spatial.transform import RigidTransform

from respot.geometry import IDENTITY
from respot.program.targets import Number
from respot.source import Span

#: What a motion uses a frame as.
Role = Literal["base", "tool"]


@dataclass(frozen=True, eq=False)
class PoseLiteral:
    """A pose that a declaration holds as numbers.

    Parameters
    ----------
    pose : RigidTransform
        What it says [mm].
    numbers : mapping of str to Number
        By field of its language, as of a target: ``X`` .. ``C``, or ``x`` .. ``q4``.
    span : tuple
        Its place in the file.
    path, line :
        File and line.
    """

    pose: RigidTransform
    numbers: Mapping[str, Number]
    span: Span
    path: str
    line: int


@dataclass(frozen=True, eq=False)
class Frame:
    """A tool (TCP seen from the flange) or a base, work object (seen from the world).

    Parameters
    ----------
    name : str
        As the program refers to it: ``BASE_DATA[1]``, ``wobj_door``.
    label : str
        The name people gave it: ``BASE_NAME[1,]``; empty where there is none.
    pose : RigidTransform or None
        ``base2world`` or ``tool2flange``; None where it is not known before the robot runs.
    unknown : str
        Why the pose is not known.
    path, line :
        Where it is declared.
    world : bool
        It is the world itself (base 0, wobj0) or the flange (tool 0, tool0).
    held : bool
        The robot carries it. A held base and a fixed tool make an external TCP.
    user : RigidTransform or None
        Of a work object: its user frame, ``uframe2world``; the rest of the pose is its object frame.
    literal : PoseLiteral or None
        The one place where the pose is written, of a work object its object frame; None where it is computed, or
        written in several places.
    user_literal : PoseLiteral or None
        Of a work object: the one place of its user frame.
    stands_on : Frame or None
        What it is composed of first: ``BASE_DATA[1]:SHIFT`` stands on ``BASE_DATA[1]``, and goes where that goes.
    """

    name: str
    label: str = ""
    pose: RigidTransform | None = IDENTITY
    unknown: str = ""
    path: str | None = None
    line: int | None = None
    world: bool = False
    held: bool = False
    user: RigidTransform | None = None
    literal: PoseLiteral | None = None
    user_literal: PoseLiteral | None = None
    stands_on: Frame | None = None

    @property
    def foot(self) -> Frame:
        """What it stands on in the end; itself if it is not composed."""
        return self if self.stands_on is None else self.stands_on.foot

    def __str__(self) -> str:
        return f"{self.name} {self.label}".rstrip()


@dataclass(frozen=True, slots=True)
class FrameReading:
    """Code that takes the value of a tool or base, other than to move under it.

    Parameters
    ----------
    frame : Frame or None
        What it reads; None where it may be any: what is in force there, or one whose number or name is computed.
    role : str
        ``base`` or ``tool``.
    what : str
        What it does, for messages.
    path, line :
        Where.
    """

    frame: Frame | None
    role: Role
    what: str
    path: str
    line: int

    def __str__(self) -> str:
        return f"{self.what} ({self.path}:{self.line})"


@dataclass(frozen=True, eq=False)
class Load:
    """What a robot carries at its flange.

    Parameters
    ----------
    name : str
        As the program refers to it: ``LOAD_DATA[1]``.
    mass : float or None
        Mass in kg; None where it is not known before the robot runs.
    centre : tuple of float or None
        Centre of mass in flange coordinates, mm.
    unknown : str
        Why the mass is not known.
    path, line :
        Where it is declared.
    """

    name: str
    mass: float | None = None
    centre: tuple[float, float, float] | None = None
    unknown: str = ""
    path: str | None = None
    line: int | None = None

    def __str__(self) -> str:
        return self.name
