"""What every robot model offers, whatever convention describes it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Self

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import RigidTransform

from respot.geometry import Array
from respot.kinematics.chain import Pass, Step


@dataclass(frozen=True, eq=False, kw_only=True)
class RobotModel(ABC):
    """A robot arm from its base to its flange.

    Joints are in the maker's own zero and sign: degrees, mm for a linear axis. Poses are ``flange2base`` in mm.

    Parameters
    ----------
    name : str
        Name of the robot.
    limits_deg : Array or None
        Lower and upper limit of each axis, shape (axes, 2), degrees or mm, infinite where unknown; None: limits
        unknown.
    source : str
        Where the numbers come from.
    payload_kg : float or None
        Rated payload.
    """

    name: str = ""
    limits_deg: Array | None = None
    source: str = ""
    payload_kg: float | None = field(default=None)

    @cached_property
    @abstractmethod
    def steps(self) -> tuple[Step, ...]:
        """The chain from base to flange; joint k stands in it once, in order."""

    @cached_property
    def coupling(self) -> Array:
        """Chain joints per maker's joint, shape (axes, axes): signs, and linkages between axes."""
        return np.eye(self.axes)

    @cached_property
    def axes(self) -> int:
        """Number of axes."""
        return sum(step.joint >= 0 for step in self.steps)

    @cached_property
    def revolute(self) -> npt.NDArray[np.bool_]:
        """Whether each axis turns, shape (axes,)."""
        return np.array([step.turns for step in self.steps if step.joint >= 0])

    @property
    def limits_text(self) -> str:
        """What is known of the limits."""
        return "limits unknown, not checked" if self.limits_deg is None else "limits known"

    def forward(self, joints: npt.ArrayLike) -> RigidTransform:
        """Pose of the flange in the base frame, one for joints (axes,), n for joints (n, axes).

        Raises
        ------
        ValueError
            A joint is not finite, or there are not as many as axes.
        """
        matrices = self.run(joints).matrices
        # products of rotations need not be made orthogonal, which takes as long as all the rest
        return RigidTransform(matrices[0] if np.ndim(joints) == 1 else matrices, normalize=False, copy=False)

    @abstractmethod
    def inverse(self, poses: RigidTransform, near: npt.ArrayLike | None = None) -> Array:
        """All joint solutions of n flange poses in the base frame, shape (n, branches, axes); limits are not applied.

        A branch that does not exist for a pose is NaN. A single pose counts as n = 1.

        Parameters
        ----------
        poses : RigidTransform
            ``flange2base``, one or n.
        near : array_like, optional
            Joints, shape (axes,) or (n, axes): every solution gets the full turns that bring it nearest to them.
        """

    def run(self, joints: npt.ArrayLike) -> Pass:
        """Pass along the chain for joints (axes,) or (n, axes)."""
        return Pass(self.steps, checked_joints(joints, self.axes) @ self.coupling.T)

    def jacobian(self, joints: npt.ArrayLike) -> Array:
        """Geometric Jacobian of the flange with respect to the joints, shape (n, 6, axes).

        Rows 0..2: translation, mm per degree (per mm of a linear axis); rows 3..5: rotation vector, degrees per
        degree (per mm); both along the axes of the base.
        """
        chain = self.run(joints)
        return np.asarray(chain.twists([i for i, s in enumerate(self.steps) if s.joint >= 0]) @ self.coupling)

    @cached_property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of the geometric parameters, lengths in mm, angles in degrees."""
        return tuple(step.parameter for step in self.steps if step.parameter)

    @abstractmethod
    def with_parameters(self, changes: Mapping[str, float]) -> Self:
        """Return the robot with some geometric parameters increased by ``changes`` [mm, deg].

        Raises
        ------
        KeyError
            A name is none of `parameter_names`.
        """

    def parameter_jacobian(self, joints: npt.ArrayLike) -> Array:
        """Motion of the flange per unit of each of `parameter_names`, shape (n, 6, parameters); rows as `jacobian`."""
        named = [(i, step.gain) for i, step in enumerate(self.steps) if step.parameter]
        return np.asarray(self.run(joints).twists([i for i, _ in named]) * np.array([gain for _, gain in named]))

    def frames(self, joints: npt.ArrayLike) -> tuple[Array, Array]:
        """Rotations (n, axes, 3, 3) and origins (n, axes, 3) of the frame behind each axis, in the base frame, mm."""
        links = self.run(joints).links
        rotations = np.stack([np.stack([c.T for c in columns], axis=-1) for columns, _ in links], axis=1)
        return rotations, np.stack([position.T for _, position in links], axis=1)

    def with_limits(self, limits_deg: npt.ArrayLike | None) -> Self:
        """Return the robot with other limits, shape (axes, 2)."""
        return replace(self, limits_deg=None if limits_deg is None else checked_limits(limits_deg, self.axes))


def checked_joints(joints: npt.ArrayLike, axes: int) -> Array:
    """Joints as a finite array of shape (n, axes).

    Raises
    ------
    ValueError
        They are not.
    """
    found = np.atleast_2d(np.asarray(joints, dtype=float))
    if found.ndim != 2 or found.shape[1] != axes:
        raise ValueError(f"joints must have the shape (n, {axes}), these have {np.shape(joints)}")
    bad = np.argwhere(~np.isfinite(found))
    if len(bad):
        raise ValueError(f"row {bad[0][0] + 1}, axis {bad[0][1] + 1} is not a finite angle")
    return found


def checked_limits(limits_deg: npt.ArrayLike, axes: int) -> Array:
    """Limits as an array (axes, 2), lower below upper.

    Raises
    ------
    ValueError
        They are not.
    """
    limits = np.asarray(limits_deg, dtype=float)
    if limits.shape != (axes, 2) or np.isnan(limits).any():
        raise ValueError(f"limits must be {axes} pairs of a lower and an upper bound")
    wrong = np.flatnonzero(limits[:, 0] >= limits[:, 1])
    if len(wrong):
        low, high = limits[wrong[0]]
        raise ValueError(f"axis {wrong[0] + 1}: the lower limit {low:g} is not below the upper limit {high:g}")
    return limits
