"""A robot on its place: model, base in the world, limits, and what forbids trusting them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy.typing as npt
from scipy.spatial.transform import RigidTransform

from respot.geometry import IDENTITY, Array
from respot.kinematics.model import RobotModel
from respot.kinematics.track import Track


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
        Robot base in the world (``base2world``), one or n; on a track where the track stands at zero.
    absolute_accuracy : bool
        The controller compensates the arm's own errors: joints from nominal lengths are not the robot's joints.
    on_track : bool
        The robot base moves with an external axis: `at` tells where it is.
    track : Track or None
        How it moves; None where it does not, or where the machine data do not tell.
    gravity : Array or None
        Direction of gravity along the axes of the robot's base, shape (3,), where the controller was told; None: down
        the world.
    external_axes : int
        Number of external axes.
    motor_turns : Array or None
        Turns of the motor for a turn of each axis, shape (axes,), NaN where it is not known or where other axes turn
        the motor as well; None where nothing is known.
    notes : tuple of str
        What a report must say.
    """

    model: RobotModel
    language: str = "krl"
    robroot: RigidTransform = IDENTITY
    absolute_accuracy: bool = False
    on_track: bool = False
    track: Track | None = None
    gravity: Array | None = None
    external_axes: int = 0
    motor_turns: Array | None = None
    notes: tuple[str, ...] = ()

    @property
    def limits(self) -> Array | None:
        """Software limits, shape (axes, 2) [deg or mm]; None where they are not known."""
        return self.model.limits_deg

    def flange2base(self, tool2world: RigidTransform, tool2flange: RigidTransform) -> RigidTransform:
        """Flange poses in the robot base.

        The tool held by the robot: TCP poses in the world, and the TCP seen from the flange. An external TCP: the gun
        in the world, and the target seen from the flange, ``part2flange * target2part`` (facts: rapid.md 2.4, krl.md
        5): the flange comes to ``gun2world * (part2flange * target2part)^-1``.
        """
        return self.robroot.inv() * tool2world * tool2flange.inv()

    def at(self, external: npt.ArrayLike) -> RobotCell:
        """Cell of a robot whose external axes stand at ``external``, shape (n, k) or (k,), mm or degrees.

        Raises
        ------
        ValueError
            The robot moves with an external axis and it is not known how, or the axis is not given.
        """
        if not self.on_track:
            return self
        if self.track is None:
            raise ValueError("the robot stands on an external axis, and the machine data do not tell how it moves")
        return replace(self, robroot=self.track.base2world(external), on_track=False)
