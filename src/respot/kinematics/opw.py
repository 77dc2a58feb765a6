"""Six-axis robots with a spherical wrist, in the seven lengths of Brandstötter, Angerer and Hofbaur ("OPW", 2014).

The inverse is py-opw-kinematics (all eight branches in closed form). Forward kinematics and derivatives run over our
own chain, so that pose and Jacobian cannot disagree; the tests hold both to each other.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Self

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import RigidTransform

from respot.geometry import Array
from respot.kinematics import numeric
from respot.kinematics.chain import Step, X, Y, Z
from respot.kinematics.model import RobotModel
from respot.kinematics.turns import nearest_turn

if TYPE_CHECKING:
    from py_opw_kinematics import Robot

LENGTHS = ("a1", "a2", "b", "c1", "c2", "c3", "c4")
#: A wrist centre that rounding puts this far outside the reach of a stretched arm is reached.
BOUNDARY_MM = 1e-9
#: A hand that rounding bends by less is straight [rad]; the cosine of a smaller angle is 1.
BOUNDARY_RAD = 1e-7
#: Below this sine of the elbow or of axis 5 the closed form is refined.
SINGULAR = 1e-3
#: No arm has a longer link [mm].
LONGEST_MM = 10_000.0


@dataclass(frozen=True, eq=False, kw_only=True)
class OpwRobot(RobotModel):
    """A robot with two parallel axes and a spherical wrist.

    The angles of the chain are ``theta = sign * joint - offset``: all zero when the arm points straight up, with z of
    the flange up. KUKA: offsets (0, -90, 0, 0, 0, 0), signs (-, +, +, -, +, -); ABB: offsets (0, 0, -90, 0, 0, 0),
    signs +.

    Parameters
    ----------
    a1, a2, b, c1, c2, c3, c4 : float
        Lengths, mm: axis 1 to axis 2 forward; axis 3 to forearm (positive forward when the arm points up); sideways;
        base to axis 2 upward; axis 2 to 3; axis 3 to the wrist centre; wrist centre to flange.
    offsets_deg : tuple of float
        Offset of each axis, degrees.
    signs : tuple of int
        1 or -1 for each axis.
    coupled_23 : bool
        A parallel linkage holds the forearm: the maker's axis 3 is the forearm's own angle, ``joint 3 + joint 2`` of
        the serial arm.
    """

    a1: float
    a2: float
    b: float = 0.0
    c1: float
    c2: float
    c3: float
    c4: float
    offsets_deg: tuple[float, ...] = (0.0,) * 6
    signs: tuple[int, ...] = (1,) * 6
    coupled_23: bool = False

    def __post_init__(self) -> None:
        problem = self._problem()
        if problem:
            raise ValueError(f"{self.name or 'robot'}: {problem}")

    def _problem(self) -> str:
        for name in LENGTHS:
            value = getattr(self, name)
            if not np.isfinite(value) or abs(value) > LONGEST_MM:
                return f"{name} = {value:g} mm is no length of a robot"
        if self.c2 <= 0.0:
            return f"c2 = {self.c2:g} mm, the distance from axis 2 to axis 3, must be positive"
        if self.c3 <= 0.0:
            return f"c3 = {self.c3:g} mm, the distance from axis 3 to the wrist, must be positive"
        if len(self.offsets_deg) != 6 or not np.isfinite(self.offsets_deg).all():
            return "offsets_deg must be six angles"
        if len(self.signs) != 6 or any(sign not in (1, -1) for sign in self.signs):
            return "signs must be six of 1 and -1"
        return ""

    @cached_property
    def steps(self) -> tuple[Step, ...]:
        """The chain from base to flange."""
        turns = [
            Step(axis, True, -offset, joint, f"offset_{joint + 1}", -1.0)
            for joint, (axis, offset) in enumerate(zip((Z, Y, Y, Z, Y, Z), self.offsets_deg, strict=True))
        ]
        a1, a2, b, c1, c2, c3, c4 = (
            Step(axis, False, getattr(self, name), parameter=name)
            for axis, name in zip((X, X, Y, Z, Z, Z, Z), LENGTHS, strict=True)
        )
        return (c1, turns[0], a1, b, turns[1], c2, turns[2], a2, c3, *turns[3:], c4)

    @cached_property
    def coupling(self) -> Array:
        """Chain joints per maker's joint, shape (6, 6)."""
        matrix = np.diag(np.array(self.signs, dtype=float))
        if self.coupled_23:
            matrix[2, 1] = -matrix[2, 2]
        return matrix

    @cached_property
    def _solver(self) -> Robot:
        from py_opw_kinematics import KinematicModel, Robot

        lengths = {name: getattr(self, name) for name in LENGTHS}
        o, s = self.offsets_deg, [sign < 0 for sign in self.signs]
        offsets, flips = (o[0], o[1], o[2], o[3], o[4], o[5]), (s[0], s[1], s[2], s[3], s[4], s[5])
        return Robot(KinematicModel(**lengths, offsets=offsets, flip_axes=flips))

    def inverse(self, poses: RigidTransform, near: npt.ArrayLike | None = None) -> Array:
        """All eight solutions of n poses, shape (n, 8, 6): NaN where one does not exist, else in [-180, 180] degrees.

        Branch ``4 * wrist flipped + 2 * reaching back + elbow``, in this fixed order.
        """
        matrices = np.asarray(poses.as_matrix(), dtype=float).reshape(-1, 4, 4)
        finite = np.isfinite(matrices).all(axis=(1, 2))
        found = np.full((len(matrices), 8, 6), np.nan)
        if finite.any():
            found[finite] = self._solver.reach(RigidTransform.from_matrix(matrices[finite])).joints + 0.0
            self._stretch(found, matrices)
            self._straighten(found, matrices)
            self._polish(found, matrices)
        if self.coupled_23:
            found[..., 2] += found[..., 1]
            found[..., 2] -= 360.0 * np.ceil((found[..., 2] - 180.0) / 360.0)
        if near is None:
            return found
        return nearest_turn(found, np.atleast_2d(np.asarray(near, dtype=float))[:, None, :], self.revolute)

    def _stretch(self, serial: Array, matrices: Array) -> None:
        """Fill in, in place, solutions (n, 8, 6) of a fully stretched arm, which rounding puts outside its reach.

        The wrist centre is pulled a hair towards axis 2; `_polish` takes the rest away.
        """
        wrists = matrices[:, :3, 3] - self.c4 * matrices[:, :3, 2]
        heading = np.arctan2(wrists[:, 1], wrists[:, 0])
        for side in (self.a1, -self.a1):
            shoulders = np.stack(
                [side * np.cos(heading), side * np.sin(heading), np.full(len(wrists), self.c1)], axis=1
            )
            lever = shoulders - wrists
            distance = np.linalg.norm(lever, axis=1)
            rows = np.flatnonzero(np.abs(distance - self.c2 - np.hypot(self.a2, self.c3)) < BOUNDARY_MM)
            if len(rows):
                pulled = matrices[rows].copy()
                pulled[:, :3, 3] += 2.0 * BOUNDARY_MM * lever[rows] / distance[rows, None]
                retried = self._solver.reach(RigidTransform.from_matrix(pulled)).joints + 0.0
                serial[rows] = np.where(np.isnan(serial[rows]), retried, serial[rows])

    def _straighten(self, serial: Array, matrices: Array) -> None:
        """Fill in, in place, solutions (n, 8, 6) of a straight wrist, whose cosine rounding puts beyond 1.

        The hand is bent a hair about the wrist centre; `_polish` takes it away.
        """
        x, z = matrices[:, :3, 0], matrices[:, :3, 2]
        wrists = matrices[:, :3, 3] - self.c4 * z
        # a straight hand lies in the plane of the arm
        across = np.abs(wrists[:, 0] * z[:, 1] - wrists[:, 1] * z[:, 0])
        near = (across <= BOUNDARY_RAD * np.hypot(wrists[:, 0], wrists[:, 1]) + BOUNDARY_MM) | (self.b != 0.0)
        rows = np.flatnonzero(near & np.isnan(serial[:, :, 0]).any(axis=1) & np.isfinite(across))
        if not len(rows):
            return
        cosine, sine = np.cos(2.0 * BOUNDARY_RAD), np.sin(2.0 * BOUNDARY_RAD)
        bent = matrices[rows].copy()
        bent[:, :3, 0] = cosine * x[rows] - sine * z[rows]
        bent[:, :3, 2] = cosine * z[rows] + sine * x[rows]
        bent[:, :3, 3] = wrists[rows] + self.c4 * bent[:, :3, 2]
        retried = self._solver.reach(RigidTransform.from_matrix(bent)).joints + 0.0
        serial[rows] = np.where(np.isnan(serial[rows]), retried, serial[rows])

    def _polish(self, serial: Array, matrices: Array) -> None:
        """Refine, in place, solutions (n, 8, 6) at a stretched arm or a straight wrist.

        The closed form takes an arc cosine near 1 there and loses half of its digits: 1e-8 rad, 1e-5 mm.
        """
        signs, offsets = np.array(self.signs, dtype=float), np.array(self.offsets_deg)
        theta = np.radians(serial[..., [2, 4]] * signs[[2, 4]] - offsets[[2, 4]])
        theta[..., 0] += np.arctan2(self.a2, self.c3)
        near = np.abs(np.sin(theta)) < SINGULAR
        rows, branches = np.nonzero(near[..., 0])
        if len(rows):
            poses = RigidTransform.from_matrix(matrices[rows])
            spans, size = np.full(6, np.degrees(1.0)), self.c2 + self.c3 + self.c4
            refined, _ = numeric.solve(self.steps, poses, serial[rows, branches] * signs, size, spans)
            serial[rows, branches] = refined * signs
        rows, branches = np.nonzero(near[..., 1])
        if len(rows):
            chain = np.radians(serial[rows, branches] * signs - offsets)
            hand = _hand(chain, matrices[rows, :3, :3])
            turned = (np.degrees(hand) + offsets[3:]) * signs[3:]
            serial[rows, branches, 3:] = turned - 360.0 * np.ceil((turned - 180.0) / 360.0)

    def with_parameters(self, changes: Mapping[str, float]) -> Self:
        """Return the robot with lengths ``a1`` .. ``c4`` [mm] and ``offset_1`` .. ``offset_6`` [deg] increased."""
        offsets = list(self.offsets_deg)
        lengths = {}
        for name, change in changes.items():
            if name not in self.parameter_names:
                raise KeyError(name)
            if name in LENGTHS:
                lengths[name] = getattr(self, name) + change
            else:
                offsets[int(name.removeprefix("offset_")) - 1] += change
        return replace(self, offsets_deg=tuple(offsets), **lengths)

    def reach_text(self, pose: RigidTransform) -> str:
        """Say how far the wrist centre of a flange pose lies from what axes 2 and 3 reach."""
        wrist = pose.apply([0.0, 0.0, -self.c4])
        radial = float(np.hypot(wrist[0], wrist[1]))
        if radial < abs(self.b):
            return f"the wrist centre is {abs(self.b) - radial:.1f} mm too near to axis 1"
        forward = float(np.sqrt(radial**2 - self.b**2))
        distances = [float(np.hypot(side - self.a1, wrist[2] - self.c1)) for side in (forward, -forward)]
        forearm = float(np.hypot(self.a2, self.c3))
        longest, shortest = self.c2 + forearm, abs(self.c2 - forearm)
        if min(distances) > longest:
            return f"axis 3 fully stretched, the wrist centre is {min(distances) - longest:.1f} mm beyond the arm"
        return f"axis 3 fully folded, the wrist centre is {shortest - max(distances):.1f} mm too near to axis 2"


def _hand(theta: Array, rotations: Array) -> Array:
    """Angles 4 to 6 of the chain, shape (n, 3), from angles (n, 6) whose first three are right [rad].

    Axis 5 from its sine, which is exact where the cosine is 1; its side is that of ``theta``.
    """
    c1, s1 = np.cos(theta[:, 0]), np.sin(theta[:, 0])
    slope = theta[:, 1] + theta[:, 2]
    c, s = np.cos(slope), np.sin(slope)
    # the forearm's x, y and z axes in the base
    forearm = np.stack([np.stack([c * c1, c * s1, -s], axis=1), np.stack([-s1, c1, 0.0 * c], axis=1),
                        np.stack([s * c1, s * s1, c], axis=1)], axis=1)  # fmt: skip
    r = forearm @ rotations
    side = np.where(np.sin(theta[:, 4]) < 0.0, -1.0, 1.0)
    fourth = np.arctan2(side * r[:, 1, 2], side * r[:, 0, 2])
    fifth = np.arctan2(side * np.hypot(r[:, 0, 2], r[:, 1, 2]), r[:, 2, 2])
    c4, s4 = np.cos(fourth), np.sin(fourth)
    sixth = np.arctan2(c4 * r[:, 1, 0] - s4 * r[:, 0, 0], c4 * r[:, 1, 1] - s4 * r[:, 0, 1])
    return np.stack([fourth, fifth, sixth], axis=1)
