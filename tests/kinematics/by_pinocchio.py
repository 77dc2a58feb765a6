"""Kinematics of the two robots by pinocchio, from descriptions written after the makers' drawings.

It shares no code and no convention with respot: the arms are URDF text, pinocchio makes poses, Jacobians and torques of
it, and the solutions of a pose are collected by descending from many random starts. Status, turn and confdata are told
bit by bit from where pinocchio puts the axes.
"""

import math
import sys
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pytest

if sys.platform == "win32":
    pytest.skip("pinocchio has no wheels for Windows", allow_module_level=True)
import pinocchio as pin

LINK = '<link name="{name}">{inertial}</link>'
INERTIAL = (
    '<inertial><origin xyz="{x} {y} {z}"/><mass value="{mass}"/>'
    '<inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial>'
)
JOINT = (
    '<joint name="A{number}" type="revolute"><parent link="l{before}"/><child link="l{number}"/>'
    '<origin xyz="{x} {y} {z}"/><axis xyz="{axis}"/>'
    '<limit lower="-10" upper="10" effort="1e9" velocity="10"/></joint>'
)
# z of the flange looks along the forearm, its x downwards: A = 0, B = 90, C = 0 at home
FLANGE = (
    '<link name="flange"/><joint name="mount" type="fixed"><parent link="l6"/><child link="flange"/>'
    '<origin xyz="{x} 0 0" rpy="0 {quarter} 0"/></joint>'
)


@dataclass
class PinocchioArm:
    """An arm as six axes, each with its place seen from the axis before it [mm] and its direction, and the flange.

    ``bodies`` may give each link a mass [kg] and its centre, seen from the link's axis [mm].
    """

    axes: tuple[tuple[tuple[float, float, float], str], ...]
    flange: float
    bodies: tuple[tuple[float, tuple[float, float, float]], ...] = ()

    @cached_property
    def model(self):
        inertial = ["", *(self._inertial(mass, centre) for mass, centre in self.bodies or ((0, (0, 0, 0)),) * 6)]
        parts = [LINK.format(name=f"l{number}", inertial=text) for number, text in enumerate(inertial)]
        for number, (place, axis) in enumerate(self.axes, start=1):
            x, y, z = (value / 1000 for value in place)
            parts.append(JOINT.format(number=number, before=number - 1, x=x, y=y, z=z, axis=axis))
        parts.append(FLANGE.format(x=self.flange / 1000, quarter=math.pi / 2))
        return pin.buildModelFromXML(f'<robot name="arm">{"".join(parts)}</robot>')

    @staticmethod
    def _inertial(mass, centre):
        x, y, z = (value / 1000 for value in centre)
        return INERTIAL.format(mass=mass, x=x, y=y, z=z)

    @cached_property
    def data(self):
        return self.model.createData()

    @cached_property
    def frame(self):
        return self.model.getFrameId("flange")

    def place(self, joints):
        """Placement of the flange, in metres."""
        pin.framesForwardKinematics(self.model, self.data, np.radians(np.asarray(joints, dtype=float)))
        return self.data.oMf[self.frame].copy()

    def forward(self, joints):
        """Flange pose, mm."""
        matrix = self.place(joints).homogeneous
        matrix[:3, 3] *= 1000
        return matrix

    def jacobian(self, joints):
        """Motion of the flange along the axes of the base: mm, and degrees, per degree."""
        q = np.radians(np.asarray(joints, dtype=float))
        found = pin.computeFrameJacobian(self.model, self.data, q, self.frame, pin.LOCAL_WORLD_ALIGNED)
        return np.concatenate([np.radians(found[:3] * 1000), found[3:]])

    def placement_jacobian(self, joints):
        """Motion of the flange, rows as `jacobian`, per mm and degree of the six places of each axis, shape (6, 36)."""
        self.place(joints)
        found = pin.computeFrameKinematicRegressor(self.model, self.data, self.frame, pin.LOCAL_WORLD_ALIGNED)
        turned = np.arange(36) % 6 > 2
        found[:3, turned] = np.radians(found[:3, turned] * 1000)
        return found

    def inverse(self, joints, starts=400):
        """All joints, in (-180, 180] degrees, that bring the flange where ``joints`` bring it."""
        goal, random = self.place(joints), np.random.default_rng(1)
        found = []
        for _ in range(starts):
            q = self._descend(goal, random.uniform(-math.pi, math.pi, 6))
            if q is None:
                continue
            q = 180.0 - (180.0 - np.degrees(q)) % 360.0
            if all(np.abs((q - other + 180) % 360 - 180).max() > 1e-4 for other in found):
                found.append(q)
        return np.array(found)

    def _descend(self, goal, q):
        for _ in range(80):
            pin.framesForwardKinematics(self.model, self.data, q)
            error = pin.log6(self.data.oMf[self.frame].actInv(goal)).vector
            size = float(error @ error)
            if size < 1e-26:
                return q
            jacobian = pin.computeFrameJacobian(self.model, self.data, q, self.frame, pin.LOCAL)
            step = np.linalg.solve(jacobian.T @ jacobian + 0.01 * size * np.eye(6), jacobian.T @ error)
            q = q + step * min(1.0, 1.0 / np.abs(step).max())
        return None

    def holding(self, joints):
        """Torques [N mm] with which the axes hold the bodies."""
        return 1000 * pin.computeGeneralizedGravity(self.model, self.data, np.radians(np.asarray(joints, dtype=float)))

    def wrist(self, joints):
        """Wrist centre [mm] seen from axis 1, turned with it, and from axis 3, turned with the lower arm."""
        self.place(joints)
        first, second, third, wrist = (self.data.oMi[number] for number in (1, 2, 3, 5))
        return (
            1000 * first.actInv(wrist).translation,
            1000 * second.rotation.T @ (wrist.translation - third.translation),
        )

    def status_turn(self, joints):
        """S and T by krl.md, section 5."""
        from_first, from_third = self.wrist(joints)
        status = 0
        if from_first[0] < 0:
            status |= 0b001  # overhead
        if from_third[2] <= 0:
            status |= 0b010  # A3 turns the forearm down: it hangs below the line from axis 2 through axis 3
        if joints[4] < 0:
            status |= 0b100
        turn = 0
        for bit, angle in enumerate(joints):
            if angle < 0:
                turn |= 1 << bit
        return [status, turn]

    def confdata(self, joints):
        """cf1, cf4, cf6 and cfx by rapid.md 2.2."""
        from_first, from_third = self.wrist(joints)
        cfx = 0
        if from_first[0] < 0:
            cfx += 4  # behind axis 1
        if from_third[0] < 0:
            cfx += 2  # behind the lower arm, which stands upright at zero
        if joints[4] < 0:
            cfx += 1
        return [*(math.floor(joints[axis] / 90) for axis in (0, 3, 5)), cfx]


BODIES = tuple((mass, (20.0 * n, -35.0 + 11 * n, 60.0 - 7 * n)) for n, mass in enumerate((310, 240, 180, 60, 25, 140)))
# KR 210 R2700 prime: krl.md section 7. Arm stretched out horizontally; axes 1, 4 and 6 turn the other way.
KUKA = PinocchioArm(
    (((0, 0, 675), "0 0 -1"), ((350, 0, 0), "0 1 0"), ((1150, 0, 0), "0 1 0"),
     ((0, 0, -41), "-1 0 0"), ((1200, 0, 0), "0 1 0"), ((0, 0, 0), "-1 0 0")), 240, BODIES)  # fmt: skip
# IRB 6700-200/2.60: calibration.md section 9. Lower arm upright, forearm horizontal.
ABB = PinocchioArm(
    (((0, 0, 780), "0 0 1"), ((320, 0, 0), "0 1 0"), ((0, 0, 1125), "0 1 0"),
     ((0, 0, 200), "1 0 0"), ((1142.5, 0, 0), "0 1 0"), ((0, 0, 0), "1 0 0")), 200, BODIES)  # fmt: skip
