"""Where the TCP lands when it is told a pose, and the pose that it must be told to land somewhere.

With E the effects of a calibration, a told pose P (source frame) is reached as E(P): the joints of P are those of the
nominal arm, on the branch nearest to the taught ones, and E goes through them (`respot.calibration.effects.moved`).
E(P') = W is solved by P' <- (W E(P')^-1) P': what the effects add is taken off in front of the pose. Effects are small
and change slowly from place to place (their slope is the step's rate, some 1e-3), so that a few steps reach the last
digit; tool offsets take one.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from respot.calibration.effects.catalogue import MECHANISMS
from respot.calibration.effects.moved import moved
from respot.calibration.effects.term import Term
from respot.calibration.observations import Observations
from respot.geometry import Array, distance_mm, pose, turn_deg
from respot.kinematics.model import RobotModel

Bools = NDArray[np.bool_]

#: A pose is found where it lands this near to where it should.
FOUND_MM, FOUND_DEG = 1e-6, 1e-7
#: Steps go on while they bring the worst place so much nearer: down to the last digit of arithmetic.
_GAIN = 0.5
_STEPS = 40


@dataclass(frozen=True, eq=False)
class Errors:
    """The pose effects of a calibration.

    Parameters
    ----------
    terms, values : sequences of equal length
        As `Calibration`.
    tool_offset : (3,) array or None
        In the tool frame [mm].
    """

    terms: Sequence[Term]
    values: Sequence[Array]
    tool_offset: Array | None = None

    def of_an_open_gun(self) -> Errors:
        """Return the errors where the gun does not squeeze: nothing bends it."""
        return self._kept(lambda term: term.effect != "gun_deflection")

    def of_another_tool(self) -> Errors:
        """Return the errors with another tool on the flange: what the fitted one has of its own stays away."""
        kept = self._kept(lambda term: MECHANISMS[term.effect].acts != "tool")
        return replace(kept, tool_offset=None)

    def _kept(self, wanted: Callable[[Term], bool]) -> Errors:
        kept = [(term, value) for term, value in zip(self.terms, self.values, strict=True) if wanted(term)]
        return replace(self, terms=[term for term, _ in kept], values=[value for _, value in kept])


@dataclass(frozen=True, eq=False)
class Seats:
    """What n places of programs come with beside their poses.

    Parameters
    ----------
    observations : Observations
        Of n places; poses are those of the programs. Joints where the arm plays a part, else None.
    tool2flange : RigidTransform or None
        Of n places, with joints [mm].
    """

    observations: Observations
    tool2flange: RigidTransform | None = None

    def __len__(self) -> int:
        return len(self.observations)

    @property
    def poses(self) -> RigidTransform:
        """Poses as the programs have them, source frame [mm]."""
        assert self.observations.rotations is not None  # noqa: S101 - programs tell orientations
        return pose(self.observations.positions, self.observations.rotations)

    def rows(self, rows: NDArray[np.intp]) -> Seats:
        """Return some of the places."""
        return Seats(self.observations.rows(rows), None if self.tool2flange is None else self.tool2flange[rows])

    def at(self, poses: RigidTransform) -> tuple[Seats, Bools]:
        """Return the places at other poses, with the joints nearest to their own, and which (n,) the arm reaches."""
        seen = replace(self.observations, positions=np.asarray(poses.translation), rotations=poses.rotation)
        if seen.joints is None or self.tool2flange is None or seen.robot is None:
            return replace(self, observations=seen), np.ones(len(seen), dtype=np.bool_)
        flange = seen.base2source.inv() * poses * self.tool2flange.inv()
        joints, reached = _nearest(seen.robot, flange, seen.joints)
        return replace(self, observations=replace(seen, joints=joints)), reached


def _nearest(robot: RobotModel, flange: RigidTransform, near: Array) -> tuple[Array, Bools]:
    """Joints (n, axes) of flange poses nearest to others [deg], these where there are none, and which are found."""
    branches = robot.inverse(flange, near=near)
    apart = np.sum((branches - near[:, None, :]) ** 2, axis=2)
    apart = np.where(np.isfinite(apart), apart, np.inf)
    best = np.argmin(apart, axis=1)
    rows = np.arange(len(near))
    reached = np.isfinite(apart[rows, best])
    return np.where(reached[:, None], branches[rows, best], near), reached


def landed(errors: Errors, seats: Seats) -> RigidTransform:
    """Where the TCP lands at n places, source frame [mm]."""
    seen = seats.observations
    if errors.tool_offset is not None:
        seen = seen.tipped(errors.tool_offset)
    points, rotations = moved(seen, errors.terms, errors.values)
    assert rotations is not None  # noqa: S101 - programs tell orientations
    return pose(points, rotations)


@dataclass(frozen=True, eq=False)
class Solution:
    """Poses to tell the robot.

    Parameters
    ----------
    seats : Seats
        The n places at these poses.
    there : RigidTransform
        Where they land [mm].
    reached : (n,) array of bool
        Whether the arm reaches each.
    left_mm, left_deg : (n,) arrays
        How far each lands from where it should.
    """

    seats: Seats
    there: RigidTransform
    reached: Bools
    left_mm: Array
    left_deg: Array

    @property
    def found(self) -> Bools:
        """Which places (n,) are solved."""
        return np.asarray(self.reached & (self.left_mm < FOUND_MM) & (self.left_deg < FOUND_DEG))


def solve(errors: Errors, seats: Seats, wanted: RigidTransform, start: RigidTransform | None = None) -> Solution:
    """Find the poses that land at n wanted ones, to 1e-6 mm and 1e-7 degrees, and as far below as numbers go.

    Parameters
    ----------
    errors : Errors
    seats : Seats
        n places; their joints tell the branch.
    wanted : RigidTransform
        n poses, source frame [mm].
    start : RigidTransform, optional
        Where to begin; by default at the wanted poses.
    """
    best = _solution(errors, *seats.at(wanted if start is None else start), wanted)
    for _ in range(_STEPS):
        told = wanted * best.there.inv() * best.seats.poses
        trial = _solution(errors, *best.seats.at(told), wanted)
        if _worst(trial) > _GAIN * _worst(best) and best.found[best.reached].all():
            break
        best = trial
    return best


def _solution(errors: Errors, seats: Seats, reached: Bools, wanted: RigidTransform) -> Solution:
    there = landed(errors, seats)
    return Solution(seats, there, reached, distance_mm(there, wanted), turn_deg(there, wanted))


def _worst(solution: Solution) -> float:
    """How far the worst place that the arm reaches is from where it should land, a degree counted as 10 mm."""
    left = solution.left_mm + 10.0 * solution.left_deg
    return float(left[solution.reached].max(initial=0.0))
