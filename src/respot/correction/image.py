"""What a correction makes of a target: its new pose in its own base, and the new offsets that motions add to it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, Protocol

from scipy.spatial.transform import RigidTransform

from respot.correction.changeable import Changeable
from respot.correction.points import new_offset, new_poses
from respot.correction.scope import Moving, Refusal, Scope
from respot.geometry import Array
from respot.issues import Issue
from respot.program.frames import Frame
from respot.program.moves import Move

Direction = Literal["align", "compensate"]


class Image(Protocol):
    """A correction as it is written into points.

    Attributes
    ----------
    direction : str
        ``align``: for the cell as simulated. ``compensate``: for the real cell.
    issues : list of Issue
        What a person should know; complete once `see` was called.
    """

    @property
    def direction(self) -> Direction:
        """For which cell the programs are."""

    @property
    def issues(self) -> Sequence[Issue]:
        """What a person should know."""

    def deviation(self, base2spots: RigidTransform) -> RigidTransform | None:
        """Rigid motion of all under a base, in the coordinates in which spots are compared [mm], or None."""

    def tool_change(self, tool: Frame) -> RigidTransform | None:
        """What the data of a tool get on the right, N' = N d; None of a tool that stays as it is."""

    def see(self, scope: Scope, changeable: Changeable | None = None) -> Sequence[Refusal]:
        """Look at all targets at once, before any is asked for; refusals of those that have no image.

        Parameters
        ----------
        scope : Scope
        changeable : Changeable or None
            Which tools and bases may be changed; None for depth `points`.
        """

    def poses(self, moving: Sequence[Moving]) -> RigidTransform:
        """New ``target2base`` of n > 0 targets; the old one of a target that was refused."""

    def offset(self, move: Move) -> Array:
        """New components (3,) of the offset of a motion along its base [mm]."""

    def record(self) -> dict[str, Any]:
        """What the record of a conversion says of it, JSON values."""


@dataclass(frozen=True, eq=False)
class RigidImage:
    """All targets move as one body, in the coordinates in which spots are compared.

    Parameters
    ----------
    motion : RigidTransform
        From old poses to new ones [mm].
    direction : str
        As `Image`.
    """

    motion: RigidTransform
    direction: Direction = "align"
    issues: Sequence[Issue] = field(default_factory=list)

    def deviation(self, base2spots: RigidTransform) -> RigidTransform:  # noqa: ARG002 - everything moves alike
        """All there is."""
        return self.motion

    def tool_change(self, tool: Frame) -> None:
        """No tool is wrong."""

    def see(self, scope: Scope, changeable: Changeable | None = None) -> Sequence[Refusal]:  # noqa: ARG002 - as above
        """Nothing is refused."""
        return ()

    def poses(self, moving: Sequence[Moving]) -> RigidTransform:
        """New ``target2base`` of n > 0 targets."""
        return new_poses(moving, self.motion)

    def offset(self, move: Move) -> Array:
        """New components (3,) of an offset along the base [mm]."""
        assert move.offset is not None and move.base2spots is not None  # noqa: S101 - asked before
        return new_offset(move.offset, move.base2spots, self.motion)

    def record(self) -> dict[str, Any]:
        """Nothing beside the edits."""
        return {}
