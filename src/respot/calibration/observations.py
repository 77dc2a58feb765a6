"""What is known of spots beside their names and places: what effects are computed from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from respot.calibration.covariates import Covariate
from respot.calibration.spot_frames import SpotFrames
from respot.geometry import IDENTITY
from respot.kinematics.gravity import gravity_basis
from respot.kinematics.model import RobotModel

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

DOWN = np.array([0.0, 0.0, -1.0])
_OF_JOINTS = frozenset(
    {"tools", "flange2base", "flange_jacobian", "parameter_jacobian", "link_frames", "gravity_levers"}
)
"""What does not depend on where the TCP is, and is worth keeping."""


@dataclass(frozen=True, eq=False)
class Observations:
    """Spots of a source, n of them, in the source's frame.

    Attributes
    ----------
    positions : (n, 3) array
        TCP [mm].
    rotations : Rotation of n, or None
        Tool orientations.
    joints, measured_joints : (n, axes) array or None
        As commanded, and as read when the spot was measured, the maker's own zero and sign [deg or mm].
    robot : RobotModel or None
        Needed with joints; without it they are of no use.
    base2source : RigidTransform
        Robot base in the source frame, one or n (a robot on a rail).
    gravity : (3,) array
        Direction of gravity in the source frame.
    external_axes : (n, 6) array or None
        [mm or deg], NaN where there is none.
    carried : int or None
        External axis, from 0, that carries the robot along.
    columns : mapping of str to Covariate
        Every further column.
    motor_turns : (axes,) array or None
        Turns of the motor for a turn of each axis, NaN where not known.
    absolute_accuracy : bool
        The controller compensates the arm's own errors: effects of the arm make no sense then.
    frames : SpotFrames or None
        The tools and bases that the spots of a backup name.
    """

    positions: Array
    rotations: Rotation | None = None
    joints: Array | None = None
    measured_joints: Array | None = None
    robot: RobotModel | None = None
    base2source: RigidTransform = IDENTITY
    gravity: Array = field(default_factory=DOWN.copy)
    external_axes: Array | None = None
    carried: int | None = None
    columns: Mapping[str, Covariate] = field(default_factory=dict)
    absolute_accuracy: bool = False
    motor_turns: Array | None = None
    frames: SpotFrames | None = None

    def __len__(self) -> int:
        return len(self.positions)

    def rows(self, rows: Rows) -> Observations:
        """Return some of the spots."""
        several = not self.base2source.single
        return replace(
            self,
            positions=self.positions[rows],
            rotations=None if self.rotations is None else self.rotations[rows],
            joints=None if self.joints is None else self.joints[rows],
            measured_joints=None if self.measured_joints is None else self.measured_joints[rows],
            base2source=self.base2source[rows] if several else self.base2source,
            external_axes=None if self.external_axes is None else self.external_axes[rows],
            columns={name: column.rows(rows) for name, column in self.columns.items()},
            frames=None if self.frames is None else self.frames.rows(rows),
        )

    def at(self, positions: Array) -> Observations:
        """Return the same spots of the same arm with their TCP elsewhere (n, 3), source frame [mm]."""
        found = replace(self, positions=positions)
        for name in _OF_JOINTS & self.__dict__.keys():
            found.__dict__[name] = self.__dict__[name]
        return found

    def tipped(self, offset: Array) -> Observations:
        """Return the same spots with their TCP moved by an offset (3,) along the axes of the tool [mm]."""
        return self.at(self.positions + self.tools @ offset) if np.any(offset) else self

    @property
    def has_arm(self) -> bool:
        """Whether the arm's own effects can be computed."""
        return self.robot is not None and self.joints is not None

    @cached_property
    def tools(self) -> Array:
        """Tool orientations as matrices (n, 3, 3)."""
        assert self.rotations is not None  # noqa: S101 - effects ask first
        return np.asarray(self.rotations.as_matrix())

    @cached_property
    def _base_rotation(self) -> Array:
        """Rotation of the robot base in the source frame, (3, 3) or (n, 3, 3)."""
        return np.asarray(self.base2source.rotation.as_matrix())

    def in_source(self, vectors: Array) -> Array:
        """Vectors (n, 3, k) of the robot base, along the axes of the source frame."""
        return np.asarray(self._base_rotation @ vectors)

    @cached_property
    def points_in_base(self) -> Array:
        """TCP in the robot base (n, 3) [mm]."""
        return np.asarray(self.base2source.inv().apply(self.positions))

    @cached_property
    def flange2base(self) -> RigidTransform:
        """Nominal flange poses of the commanded joints."""
        assert self.robot is not None and self.joints is not None  # noqa: S101 - effects ask first
        return self.robot.forward(self.joints)

    @cached_property
    def flange_jacobian(self) -> Array:
        """Motion of the flange with the joints: `RobotModel.jacobian`."""
        assert self.robot is not None and self.joints is not None  # noqa: S101
        return self.robot.jacobian(self.joints)

    @cached_property
    def parameter_jacobian(self) -> Array:
        """Motion of the flange with the robot's parameters: `RobotModel.parameter_jacobian`."""
        assert self.robot is not None and self.joints is not None  # noqa: S101
        return self.robot.parameter_jacobian(self.joints)

    @cached_property
    def link_frames(self) -> tuple[Array, Array]:
        """Frames behind the axes: `RobotModel.frames`."""
        assert self.robot is not None and self.joints is not None  # noqa: S101
        return self.robot.frames(self.joints)

    @cached_property
    def joint_columns(self) -> Array:
        """Shift of the TCP per degree (mm) of each axis, source frame, (n, 3, axes)."""
        return self._at_tcp(self.flange_jacobian)

    @cached_property
    def parameter_columns(self) -> Array:
        """Shift of the TCP per unit [mm, deg] of each of the robot's parameters, source frame, (n, 3, parameters)."""
        return self._at_tcp(self.parameter_jacobian)

    @cached_property
    def link_columns(self) -> Array:
        """Shift of the TCP per mm and per degree of an error of each link, source frame, (n, 3, 6 axes).

        Translations along and turns about the axes of the frame behind each joint.
        """
        rotations, origins = self.link_frames
        levers = self.points_in_base[:, None, :] - origins
        blocks = []
        for axis in range(3):
            direction = rotations[..., axis]
            blocks += [direction, np.radians(np.cross(direction, levers))]
        stacked = np.stack([blocks[k] for k in (0, 2, 4, 1, 3, 5)], axis=-1)  # n, axes, 3, 6
        flat = np.moveaxis(stacked, 2, 1).reshape(len(self), 3, -1)
        return self.in_source(flat)

    @cached_property
    def gravity_levers(self) -> Array:
        """Levers of gravity [m] on each axis: `gravity_basis` / 1000, shape (n, axes, axes, 4)."""
        assert self.robot is not None and self.joints is not None  # noqa: S101
        down = np.asarray(self.base2source.rotation.inv().apply(self.gravity))
        levers = gravity_basis(self.robot, self.joints, down)
        levers[..., 0] /= 1000.0  # the moments' columns are unit vectors: per metre of lever already
        return levers

    @cached_property
    def approach(self) -> Array | None:
        """Sign of the last motion of each axis (n, axes), NaN where no column tells; None without any."""
        if self.joints is None:
            return None
        signs = np.full((len(self), self.joints.shape[1]), np.nan)
        for name, column in self.columns.items():
            if column.role == "approach" and column.values is not None:
                axis = int(name.strip()[-1]) - 1
                if axis < signs.shape[1]:
                    signs[:, axis] = np.sign(column.values)
        return signs if np.isfinite(signs).any() else None

    def _at_tcp(self, twists: Array) -> Array:
        lever = self.points_in_base - np.asarray(self.flange2base.translation)
        turning = np.radians(np.cross(np.swapaxes(twists[:, 3:], 1, 2), lever[:, None, :]))
        return self.in_source(twists[:, :3] + np.swapaxes(turning, 1, 2))
