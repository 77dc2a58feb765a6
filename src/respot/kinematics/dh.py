"""Robots of any number of revolute and prismatic axes, in standard or modified Denavit-Hartenberg parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import RigidTransform

from respot.geometry import Array
from respot.kinematics import numeric
from respot.kinematics.chain import Step, X, Z
from respot.kinematics.model import RobotModel
from respot.kinematics.opw import LONGEST_MM
from respot.kinematics.turns import nearest_turn

#: Slots of `DhRobot.inverse`.
BRANCHES = 8
#: Rounds of new starts for poses that have not converged; starts per pose when all branches are wanted.
ROUNDS, STARTS = 24, 40
#: Two solutions are the same branch if no joint differs by more [deg or mm].
SAME = 1e-3


@dataclass(frozen=True)
class Link:
    """One link: standard ``Rz(theta) Tz(d) Tx(a) Rx(alpha)``, modified ``Rx(alpha) Tx(a) Rz(theta) Tz(d)``.

    Parameters
    ----------
    a, d : float
        Lengths, mm.
    alpha, offset : float
        Angles, degrees: the twist, and what is added to the joint. For a prismatic axis ``offset`` is the constant
        theta.
    prismatic : bool
        The joint is added to d [mm], not to theta [deg].
    """

    a: float = 0.0
    alpha: float = 0.0
    d: float = 0.0
    offset: float = 0.0
    prismatic: bool = False


@dataclass(frozen=True, eq=False, kw_only=True)
class DhRobot(RobotModel):
    """A robot in Denavit-Hartenberg parameters.

    Parameters
    ----------
    links : tuple of Link
        The links from the base.
    modified : bool
        Modified (Craig's) convention.
    """

    links: tuple[Link, ...]
    modified: bool = False

    def __post_init__(self) -> None:
        problem = self._problem()
        if problem:
            raise ValueError(f"{self.name or 'robot'}: {problem}")

    def _problem(self) -> str:
        if not self.links:
            return "it has no links"
        for number, link in enumerate(self.links, start=1):
            for name in ("a", "d", "alpha", "offset"):
                value = getattr(link, name)
                if not np.isfinite(value) or abs(value) > LONGEST_MM:
                    return f"link {number}: {name} = {value:g} is no number of a robot"
        if not any(link.a or link.d or link.prismatic for link in self.links):
            return "all its lengths are 0"
        return ""

    @cached_property
    def steps(self) -> tuple[Step, ...]:
        """The chain from base to flange."""
        chain: list[Step] = []
        for joint, link in enumerate(self.links):
            n = joint + 1
            turn = Step(Z, True, link.offset, -1 if link.prismatic else joint, f"offset_{n}")
            lift = Step(Z, False, link.d, joint if link.prismatic else -1, f"d_{n}")
            along, twist = Step(X, False, link.a, -1, f"a_{n}"), Step(X, True, link.alpha, -1, f"alpha_{n}")
            chain += [twist, along, turn, lift] if self.modified else [turn, lift, along, twist]
        return tuple(chain)

    @cached_property
    def reach_mm(self) -> float:
        """Sum of all lengths, at least 1 mm: a length scale."""
        return max(1.0, sum(abs(link.a) + abs(link.d) for link in self.links))

    def inverse(self, poses: RigidTransform, near: npt.ArrayLike | None = None) -> Array:
        """Joint solutions of n poses, shape (n, 8, axes), NaN where there are fewer; found numerically.

        With ``near`` the first slot is the solution that the descent from ``near`` reaches, or another one if it
        fails, and the other slots are NaN. Without it the slots hold up to eight different solutions, nearest to zero
        first; of a robot with more than six axes they are examples. Angles are in (-180, 180] unless ``near`` is
        given.
        """
        batch = RigidTransform.from_matrix(np.asarray(poses.as_matrix()).reshape(-1, 4, 4))
        found = np.full((len(batch), BRANCHES, self.axes), np.nan)
        if not len(batch):
            return found
        if near is None:
            for slot, solutions in enumerate(self._many(batch)):
                found[:, slot] = solutions
            return found
        begin = np.broadcast_to(np.asarray(near, dtype=float), (len(batch), self.axes)).copy()
        joints = self._one(batch, begin)
        found[:, 0] = nearest_turn(joints, begin, self.revolute)
        return found

    def _one(self, poses: RigidTransform, begin: Array) -> Array:
        """One solution of each pose, NaN where none is found, from ``begin`` and then from other starts."""
        joints, reached = self._descend(poses, begin)
        joints[~reached] = np.nan
        for seed in range(ROUNDS):
            missing = np.flatnonzero(np.isnan(joints[:, 0]))
            if not len(missing):
                break
            trial, reached = self._descend(poses[missing], numeric.starts(len(missing), self._range, seed))
            joints[missing[reached]] = trial[reached]
        return joints

    def _many(self, poses: RigidTransform) -> list[Array]:
        """Up to `BRANCHES` different solutions of each pose."""
        count = len(poses)
        trials = []
        for seed in range(STARTS):
            joints, reached = self._descend(poses, numeric.starts(count, self._range, seed))
            joints = np.where(self.revolute, -((180.0 - joints) % 360.0) + 180.0, joints)
            joints[~reached] = np.nan
            trials.append(joints)
        every = np.stack(trials, axis=1)
        size = np.where(np.isnan(every[..., 0]), np.inf, np.abs(every).sum(axis=-1))
        every = np.take_along_axis(every, np.argsort(size, axis=1)[..., None], axis=1)
        found = [np.full((count, self.axes), np.nan) for _ in range(BRANCHES)]
        for row in range(count):
            kept: list[Array] = []
            for joints in every[row]:
                if len(kept) == BRANCHES or np.isnan(joints[0]):
                    break
                if all(self._apart(joints, other) > SAME for other in kept):
                    found[len(kept)][row] = joints
                    kept.append(joints)
        return found

    def _apart(self, first: Array, second: Array) -> float:
        difference = first - second
        return float(np.abs(np.where(self.revolute, (difference + 180.0) % 360.0 - 180.0, difference)).max())

    def _descend(self, poses: RigidTransform, begin: Array) -> tuple[Array, npt.NDArray[np.bool_]]:
        spans = np.where(self.revolute, np.degrees(1.0), self.reach_mm)
        return numeric.solve(self.steps, poses, begin, self.reach_mm, spans)

    @cached_property
    def _range(self) -> Array:
        """Where to start from: the limits, else a whole turn, the robot's size for a linear axis."""
        half = np.where(self.revolute, 180.0, self.reach_mm)
        wide = np.column_stack([-half, half])
        if self.limits_deg is None:
            return wide
        return np.where(np.isfinite(self.limits_deg), self.limits_deg, wide)

    def with_parameters(self, changes: Mapping[str, float]) -> Self:
        """Return the robot with ``a_1``, ``d_1`` [mm], ``alpha_1``, ``offset_1`` [deg] ... increased."""
        links = list(self.links)
        for name, change in changes.items():
            if name not in self.parameter_names:
                raise KeyError(name)
            part, _, number = name.partition("_")
            link = links[int(number) - 1]
            values = {"a": link.a, "alpha": link.alpha, "d": link.d, "offset": link.offset}
            values[part] += change
            links[int(number) - 1] = Link(**values, prismatic=link.prismatic)
        return replace(self, links=tuple(links))
