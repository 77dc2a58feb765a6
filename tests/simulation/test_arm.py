"""The simulator's own kinematics, checked a second way and against the engine's, which shares no code with it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from respot.kinematics.robots import find_robot
from respot.simulation.arm import apply, forward, inverse
from respot.simulation.robots import ROBOTS, spec_of


def joints_of(robot, n=200, seed=1):
    limits = np.array(robot.limits)
    joints = np.random.default_rng(seed).uniform(limits[:, 0], limits[:, 1], (n, 6))
    joints[:, 3:] = np.clip(joints[:, 3:], -175, 175)
    return joints


def chain(robot, joints):
    """One pose at a time, by transforms."""
    shift = RigidTransform.from_translation
    turn = lambda axis, degrees: RigidTransform.from_rotation(Rotation.from_euler(axis, degrees, degrees=True))  # noqa: E731
    size = robot.length
    q = np.asarray(joints) * robot.signs - robot.offsets
    return (
        shift([0, 0, size("c1")])
        * turn("z", q[0])
        * shift([size("a1"), size("b"), 0])
        * turn("y", q[1])
        * shift([0, 0, size("c2")])
        * turn("y", q[2])
        * shift([size("a2"), 0, size("c3")])
        * turn("z", q[3])
        * turn("y", q[4])
        * turn("z", q[5])
        * shift([0, 0, size("c4")])
    )


@pytest.mark.parametrize("name", ROBOTS)
def test_forward_is_the_chain_of_transforms(name):
    robot = ROBOTS[name]
    joints = joints_of(robot, 20)
    frames = forward(robot, joints)
    for row, q in enumerate(joints):
        pose = chain(robot, q)
        assert frames.flange_at[row] == pytest.approx(pose.translation, abs=1e-9)
        assert frames.flange[row] == pytest.approx(pose.rotation.as_matrix(), abs=1e-12)


@pytest.mark.parametrize("name", ROBOTS)
def test_the_engine_has_the_same_robots_and_they_stand_the_same(name):
    robot = ROBOTS[name]
    joints = joints_of(robot)
    frames = forward(robot, joints)
    engine = find_robot(name).forward(joints)
    assert frames.flange_at == pytest.approx(engine.translation, abs=1e-6)
    assert frames.flange == pytest.approx(engine.rotation.as_matrix(), abs=1e-9)


def test_a_kuka_in_its_home_position():
    # facts: krl.md section 7, a KR 210 R2700 prime at A 0,-90,90,0,0,0
    frames = forward(ROBOTS["kr210_r2700_prime"], np.array([[0.0, -90, 90, 0, 0, 0]]))
    assert frames.flange_at[0] == pytest.approx([1790, 0, 1784])


@pytest.mark.parametrize("name", ROBOTS)
def test_inverse_finds_the_joints_again(name):
    robot = ROBOTS[name]
    joints = joints_of(robot, 2000)
    frames = forward(robot, joints)
    found, reached = inverse(robot, frames.flange, frames.flange_at, joints[:, 4] < 0)
    again = forward(robot, found[reached])
    assert reached.mean() > 0.9
    assert again.flange_at == pytest.approx(frames.flange_at[reached], abs=1e-6)
    assert again.flange == pytest.approx(frames.flange[reached], abs=1e-9)
    assert np.mean(np.abs(found - joints).max(axis=1) < 1e-6) > 0.4  # where arm and elbow are the simulated ones


def test_inverse_says_what_is_out_of_reach():
    robot = ROBOTS["kr210_r2700_extra"]
    far = np.array([[4000.0, 0, 1000], [1900.0, 0, 1200]])
    _, reached = inverse(robot, np.broadcast_to(np.eye(3), (2, 3, 3)), far, np.zeros(2, bool))
    assert reached.tolist() == [False, True]


@pytest.mark.parametrize("axis", range(6))
def test_axes_and_origins_are_what_turns_the_flange(axis):
    robot = ROBOTS["kr210_r2700_extra"]
    joints = joints_of(robot, 30)
    step = np.zeros(6)
    step[axis] = 1e-4
    frames, moved = forward(robot, joints), forward(robot, joints + step)
    lever = np.cross(frames.axes[:, axis], frames.flange_at - frames.origins[:, axis])
    assert (moved.flange_at - frames.flange_at) == pytest.approx(np.radians(1e-4) * lever, abs=1e-6)


def test_errors_of_links_and_foot_move_the_flange():
    robot = ROBOTS["kr210_r2700_extra"]
    joints = joints_of(robot, 30)
    plain = forward(robot, joints)
    twists = np.zeros((6, 6))
    twists[5] = [1, 2, 3, 0, 0, 0]
    assert forward(robot, joints, twists=twists).flange_at == pytest.approx(
        plain.flange_at + apply(plain.flange, np.array([1.0, 2, 3]))
    )
    longer = forward(robot, joints, {"c1": 2.0})
    assert longer.flange_at - plain.flange_at == pytest.approx(np.tile([0, 0, 2.0], (30, 1)))
    turned = forward(robot, joints, root_at=np.full((30, 3), 5.0), root_turn=np.tile([0, 0, np.pi / 2], (30, 1)))
    quarter = Rotation.from_euler("z", 90, degrees=True)
    assert turned.flange_at == pytest.approx(quarter.apply(plain.flange_at) + 5)


def test_a_robot_that_is_not_there():
    with pytest.raises(ValueError, match="did you mean kr210_r2700_extra"):
        spec_of("KR210-R2700-extra")
