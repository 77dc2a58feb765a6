"""A robot on its place: model, base in the world, limits, and what forbids trusting them."""

from __future__ import annotations

from dataclasses import dataclass

from scipy.spatial.transform import RigidTransform

from respot.geometry import IDENTITY, Array
from respot.kinematics.model import RobotModel


@dataclass(frozen=True)
class Reason:
    """Why something cannot be computed or must not be written: a code of `respot.issues` and a message."""

    code: str
    message: str

    def __str__(self) -> str:
        return self.message


@dataclass(frozen=True, eq=False)
class RobotCell:
    """A robot on its place.

    Parameters
    ----------
    model : RobotModel
        The arm, with its software limits.
    language : str
        ``"krl"`` or ``"rapid"``: whose configuration its programs carry.
    robroot : RigidTransform
        Robot base in the world (``base2world``).
    absolute_accuracy : bool
        The controller compensates the arm's own errors: joints from nominal lengths are not the robot's joints.
    on_track : bool
        The robot base moves with an external axis.
    external_axes : int
        Number of external axes.
    notes : tuple of str
        What a report must say.
    """

    model: RobotModel
    language: str = "krl"
    robroot: RigidTransform = IDENTITY
    absolute_accuracy: bool = False
    on_track: bool = False
    external_axes: int = 0
    notes: tuple[str, ...] = ()

    @property
    def limits(self) -> Array | None:
        """Software limits, shape (axes, 2) [deg or mm]; None where they are not known."""
        return self.model.limits_deg

    def flange2base(self, tool2world: RigidTransform, tool2flange: RigidTransform) -> RigidTransform:
        """Flange poses in the robot base of TCP poses in the world, the tool held by the robot."""
        return self.robroot.inv() * tool2world * tool2flange.inv()
