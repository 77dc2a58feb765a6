"""Motions: which target they go to, under which frames, and whether they weld."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from scipy.spatial.transform import RigidTransform

from respot.program.frames import Frame
from respot.program.targets import Number, Target
from respot.source import Span


class Motion(StrEnum):
    """How the robot moves."""

    LINEAR = "linear"
    JOINT = "joint"
    CIRCULAR = "circular"


@dataclass(frozen=True, eq=False)
class BaseOffset:
    """A translation along the axes of the base: the arguments of ``Offs``, a ``LIN_REL`` in the base.

    It turns with a correction (facts: rapid.md 2.4, M Offs(p, d) = Offs(M p, R d)). A translation along the tool's axes
    (``RelTool``, ``P:{..}``, ``LIN_REL .. #TOOL``) does not and needs no record.

    Parameters
    ----------
    numbers : tuple of Number or None
        The x, y and z components; None where the literal leaves a component out.
    span : tuple
        Span of the three components in the file.
    path : str
        File of the literal.
    line : int
        Its line.
    literal : bool
        All components are numbers; otherwise they are computed while the robot runs.
    """

    numbers: tuple[Number | None, Number | None, Number | None]
    span: Span
    path: str
    line: int
    literal: bool = True


@dataclass(frozen=True, eq=False)
class Move:
    """One motion of a routine.

    Parameters
    ----------
    motion : Motion
        Kind of path.
    instruction : str
        As written: ``LIN``, ``SpotL``.
    target : Target or None
        Where it goes; None for a motion relative to the last position.
    program, routine : str
        Where the motion stands.
    path : str
        File of the motion.
    line : int
        Its line.
    tool, base : Frame or None
        None where the program does not tell.
    offset : BaseOffset or None
        Translation in base axes on top of the target.
    external_tcp : bool
        The robot holds the part.
    weld : bool
        The motion, or what follows it in its form, welds.
    spot_ids : tuple of str
        What may be the spot's ID, best first.
    unknown : str
        Why the target of the motion cannot be told before the robot runs.
    """

    motion: Motion
    instruction: str
    target: Target | None
    program: str
    routine: str
    path: str
    line: int
    tool: Frame | None = None
    base: Frame | None = None
    offset: BaseOffset | None = None
    external_tcp: bool = False
    weld: bool = False
    spot_ids: tuple[str, ...] = ()
    unknown: str = ""

    @property
    def world(self) -> RigidTransform | None:
        """``target2world`` of the TCP without offsets; None for an external TCP and where a frame is not known."""
        if self.external_tcp or self.target is None or self.target.pose is None:
            return None
        if self.base is None or self.base.pose is None:
            return None
        return self.base.pose * self.target.pose
