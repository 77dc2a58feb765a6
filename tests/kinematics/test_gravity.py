"""Gravity loads against the potential energy, and by hand."""

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from respot.kinematics.cell import RobotCell
from respot.kinematics.dh import DhRobot, Link
from respot.kinematics.gravity import gravity_basis, gravity_in_base
from respot.kinematics.robots import built_in_robots, find_robot

PRIME = find_robot("kr210_r2700_prime")


def potential(robot, joints, gravity, weights, centres):
    """Energy of point weights [N] at centres (axes, 3) in their links, N mm."""
    rotations, origins = robot.frames(joints)
    places = origins[0] + np.einsum("kij,kj->ki", rotations[0], centres)
    return -float(np.sum(weights * (places @ gravity)))


@pytest.mark.parametrize("robot", [PRIME, find_robot("irb2400"), find_robot("irb6700_200_260"),
                                   DhRobot(links=(Link(0, -90, 500, 0, True), Link(150, 20, 100, 10)))])  # fmt: skip
def test_loads_are_the_slope_of_the_energy(robot):
    random = np.random.default_rng(5)
    joints = random.uniform(-120, 120, robot.axes)
    gravity = Rotation.from_euler("xyz", [20, -35, 10], degrees=True).apply([0, 0, -1])
    weights, centres = random.uniform(100, 900, robot.axes), random.uniform(-300, 300, (robot.axes, 3))
    moments = np.column_stack([weights, weights[:, None] * centres])
    loads = np.einsum("jkc,kc->j", gravity_basis(robot, joints, gravity)[0], moments)
    for axis in range(robot.axes):
        step = np.radians(1e-3) if robot.revolute[axis] else 1e-3
        change = 1e-3 * np.eye(robot.axes)[axis]
        up, down = (potential(robot, joints + s * change, gravity, weights, centres) for s in (1, -1))
        assert loads[axis] == pytest.approx(-(up - down) / (2 * step), rel=1e-6, abs=1e-3)


def test_stretched_arm_by_hand():
    # stretched out, 1 N in the origin of frame 3 hangs 1150 mm in front of axis 2 and pulls it down: A2 grows
    basis = gravity_basis(PRIME, np.zeros(6), [0, 0, -1])[0]
    assert basis[1, 2, 0] == pytest.approx(1150)
    assert basis[0] == pytest.approx(0.0)  # axis 1 is vertical
    assert basis[2, 1] == pytest.approx(0.0)  # what stands before an axis does not load it


def test_gravity_follows_the_mounting():
    wall = RigidTransform.from_rotation(Rotation.from_euler("y", 90, degrees=True))
    assert gravity_in_base(RobotCell(PRIME, robroot=wall)) == pytest.approx([1, 0, 0])
    assert gravity_in_base(RobotCell(PRIME)) == pytest.approx([0, 0, -1])
    assert built_in_robots()["kr210_r2700_prime"].model is PRIME
