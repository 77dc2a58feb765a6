"""The line as it really is: what effects may touch, and where the TCP lands when they do."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from respot.simulation.arm import Floats, Frames, apply, forward
from respot.simulation.columns import Column, number
from respot.simulation.layout import Gun, Layout
from respot.simulation.robots import RobotSpec

#: Standard gravity, down the world [m/s2].
GRAVITY = np.array([0.0, 0.0, -9.80665])


@dataclass(frozen=True)
class Cell:
    """Everything an effect may look at.

    Parameters
    ----------
    robot : RobotSpec
        Nominal arm.
    gun : Gun
        What it carries.
    layout : Layout
        Programmed spots.
    columns : mapping
        What the plant records.
    frames : Frames
        Nominal frames at the spots.
    tracker : ndarray of shape (3,)
        Where the tracker stands in the world [mm].
    """

    robot: RobotSpec
    gun: Gun
    layout: Layout
    columns: Mapping[str, Column]
    frames: Frames
    tracker: Floats

    @property
    def n(self) -> int:
        """Number of spots."""
        return len(self.layout.joints)

    @property
    def positions(self) -> Floats:
        """Programmed TCP (n, 3) [mm]."""
        return self.layout.positions

    @property
    def approach_sign(self) -> Floats:
        """Sense (n, 6) of the last motion of each axis."""
        return np.sign(self.layout.joints - self.layout.approach)

    @property
    def minutes(self) -> Floats:
        """Clock (n,) [min]."""
        return number(self.columns, "time_min")

    def torque_arm(self, points: Floats, forces: Floats, joint: int) -> Floats:
        """Torque (n,) [N m] about a joint axis (from 0) of forces (n, 3) [N] at points (n, 3) [mm]."""
        arm = (points - self.frames.origins[:, joint]) / 1000.0
        return np.asarray(np.sum(self.frames.axes[:, joint] * np.cross(arm, forces), axis=1))


@dataclass
class State:
    """How the real line departs from the nominal one.

    Parameters
    ----------
    n : int
        Number of spots.
    joints : ndarray of shape (n, 6)
        Added to the commanded joints [deg].
    lengths : dict
        Added to lengths of the arm [mm].
    twists : ndarray of shape (6, 6)
        Errors of the links, see `forward`.
    tool_shift : ndarray of shape (n, 3)
        Of the TCP, in the tool frame [mm].
    root_at, root_turn : ndarray of shape (n, 3)
        Motion of the robot's foot [mm], [rad].
    shift : ndarray of shape (n, 3)
        Of what is measured, in the world [mm].
    measured_joints : ndarray of shape (n, 6)
        What the encoders say beyond the command [deg].
    ids : ndarray of int of shape (n,)
        The spot under whose name the measured list has each spot.
    misread : callable or None
        Orientations as a reader takes them who knows only the usual convention.
    """

    n: int
    joints: Floats = field(init=False)
    lengths: dict[str, float] = field(default_factory=dict)
    twists: Floats = field(default_factory=lambda: np.zeros((6, 6)))
    tool_shift: Floats = field(init=False)
    root_at: Floats = field(init=False)
    root_turn: Floats = field(init=False)
    shift: Floats = field(init=False)
    measured_joints: Floats = field(init=False)
    ids: NDArray[np.int64] = field(init=False)
    misread: Callable[[Rotation], Rotation] | None = None

    def __post_init__(self) -> None:
        self.joints, self.measured_joints = np.zeros((self.n, 6)), np.zeros((self.n, 6))
        self.tool_shift, self.shift = np.zeros((self.n, 3)), np.zeros((self.n, 3))
        self.root_at, self.root_turn = np.zeros((self.n, 3)), np.zeros((self.n, 3))
        self.ids = np.arange(self.n)

    def positions(self, cell: Cell) -> Floats:
        """Where the TCP really lands: (n, 3) [mm]."""
        frames = forward(
            cell.robot,
            cell.layout.joints + self.joints,
            self.lengths,
            self.twists if self.twists.any() else None,
            cell.layout.root_at + self.root_at,
            self.root_turn if self.root_turn.any() else None,
        )
        tcp = cell.gun.at + self.tool_shift @ cell.gun.turn.T
        return frames.flange_at + apply(frames.flange, tcp) + self.shift

    def orientations(self, cell: Cell) -> Rotation:
        """How the tool really stands: n rotations."""
        frames = forward(cell.robot, cell.layout.joints + self.joints, self.lengths, self.twists, None, self.root_turn)
        return Rotation.from_matrix(frames.flange @ cell.gun.turn)


@dataclass(frozen=True)
class Effect:
    """A cause that moves spots.

    Parameters
    ----------
    name : str
        Kind.
    where : mapping
        Axis, column, level, parameter or ids.
    push : callable
        Adds the effect at an amplitude to a state.
    parameters : callable
        Physical values at an amplitude, for the truth.
    fixed : bool
        The amplitude cannot be chosen: names and conventions.
    """

    name: str
    where: Mapping[str, Any]
    push: Callable[[State, float], None]
    parameters: Callable[[float], Mapping[str, Any]]
    fixed: bool = False


def rigid_motion(points: Floats, centre: Floats, shift: Floats, rotation: Floats) -> Floats:
    """Shifts (n, 3) [mm] of points under a small motion of a body: a shift and a turn [rad] about a centre."""
    arm = points - centre
    return np.asarray(shift + Rotation.from_rotvec(rotation).apply(arm) - arm)


def direction(rng: np.random.Generator) -> Floats:
    """A unit vector of any direction."""
    vector = rng.standard_normal(3)
    return np.asarray(vector / np.linalg.norm(vector))
