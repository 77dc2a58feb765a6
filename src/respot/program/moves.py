"""Motions: which target they go to, under which frames, and whether they weld."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from scipy.spatial.transform import RigidTransform

from respot.geometry import IDENTITY
from respot.program.frames import Frame, Load
from respot.program.targets import Number, Target
from respot.source import Span


class Motion(StrEnum):
    """How the robot moves."""

    LINEAR = "linear"
    JOINT = "joint"
    CIRCULAR = "circular"


class LabelKind(StrEnum):
    """Where the text about a motion stands."""

    NAME = "name"  # of the target
    DATA = "data"  # name of weld data: spotdata
    TITLE = "title"  # of the inline form
    PARAMS = "params"  # line of an inline form
    ARGUMENT = "argument"  # of the motion's wrapper or of the call that welds
    COMMENT = "comment"  # behind the motion or right above it
    ROUTINE = "routine"  # name of the routine


@dataclass(frozen=True, slots=True)
class Label:
    """A text about a motion in which a spot ID may stand."""

    kind: LabelKind
    text: str


@dataclass(frozen=True)
class Doubt:
    """What is not known of a motion before the robot runs: a code of `issues.CODES` and the cause."""

    code: str
    text: str


@dataclass(frozen=True, eq=False)
class BaseOffset:
    """A translation along the axes of the base: the arguments of ``Offs``, a ``LIN_REL`` in the base.

    It turns with a correction (facts: rapid.md 2.4, M Offs(p, d) = Offs(M p, R d)). A translation along the tool's axes
    (``RelTool``, ``P:{..}``, ``LIN_REL .. #TOOL``) does not; on top of a target it is `Move.tool_offset`.

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
    labels : tuple of Label
        Texts in which the spot's ID may stand.
    spot_ids : tuple of str
        What may be the spot's ID, best first.
    named_spot : bool
        One of its names is that of a weld spot, whether or not the motion is known to weld.
    unknown : str
        Why the target of the motion, or what it is seen from, cannot be told before the robot runs.
    load : Load or None
        What the robot carries; None where the program does not tell.
    tool_offset : RigidTransform or None
        Shift in the axes of the target on top of it (``P:{Z -60}``); None where it is not known before the robot runs.
    doubts : tuple of Doubt
        Everything that is not known of the motion, with a code.
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
    labels: tuple[Label, ...] = ()
    spot_ids: tuple[str, ...] = ()
    named_spot: bool = False
    unknown: str = ""
    load: Load | None = None
    tool_offset: RigidTransform | None = IDENTITY
    doubts: tuple[Doubt, ...] = ()

    @property
    def codes(self) -> tuple[str, ...]:
        """Codes of what is not known of the motion, each once."""
        return tuple(dict.fromkeys(doubt.code for doubt in self.doubts))

    @property
    def has_spot_pose(self) -> bool:
        """Whether `spot_pose` is known."""
        if self.target is None or not self.target.components or self.tool_offset is None:
            return False
        return (self.offset is None or self.offset.literal) and self.base2spots is not None

    @property
    def _pose(self) -> RigidTransform | None:
        """``goal2base``: the target with its shifts along its own axes and along those of the base."""
        if self.target is None or self.target.pose is None or self.tool_offset is None:
            return None
        goal = self.target.pose if self.tool_offset is IDENTITY else self.target.pose * self.tool_offset
        if self.offset is None:
            return goal
        if not self.offset.literal:
            return None
        way = [0.0 if number is None else float(number.value) for number in self.offset.numbers]
        return RigidTransform.from_translation(way) * goal

    @property
    def world(self) -> RigidTransform | None:
        """Where the TCP goes, in the world; None for an external TCP and where a frame is not known."""
        if self.external_tcp or self._pose is None or self.base is None or self.base.pose is None:
            return None
        return self.base.pose * self._pose

    @property
    def workpiece(self) -> Frame | None:
        """What carries the part: the base, or with an external TCP what the robot holds (KUKA: tool, ABB: base)."""
        if not self.external_tcp or (self.base is not None and self.base.held):
            return self.base
        return self.tool

    @property
    def base2spots(self) -> RigidTransform | None:
        """Pose of the target's own base in the coordinates in which spots are compared.

        That is ``base2world``. With an external TCP the target is the gun seen from the part, and spots are compared
        in the part (DESIGN section 5): nothing lies between. None where the base is not known.
        """
        if self.external_tcp:
            return IDENTITY
        return None if self.base is None else self.base.pose

    @property
    def spot_pose(self) -> RigidTransform | None:
        """Pose of the TCP as spots are compared: in the world, or with an external TCP in the part frame."""
        if self._pose is None or self.base2spots is None:
            return None
        return self.base2spots * self._pose
