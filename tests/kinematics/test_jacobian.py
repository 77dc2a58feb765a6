"""Analytic derivatives against central differences of the forward kinematics."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from respot.kinematics.dh import DhRobot, Link
from respot.kinematics.robots import built_in_robots

GANTRY = DhRobot(
    name="gantry",
    links=(Link(0, -90, 500, 0, True), Link(0, 90, 300, 90, True), Link(150, 20, 100, 10), Link(80, -70, 40)),
)
CRAIG = DhRobot(
    name="craig",
    modified=True,
    links=(Link(0, 0, 300), Link(100, -90, 0, -90), Link(400, 0, 20), Link(50, 90, 0, 0, True)),
)
ROBOTS = [row.model for row in built_in_robots().values()] + [GANTRY, CRAIG]


def twist(before, after, step):
    """Motion per unit from the pose at -step to that at +step: mm, degrees."""
    turn = np.degrees((after.rotation * before.rotation.inv()).as_rotvec())
    return np.concatenate([after.translation - before.translation, turn], axis=-1) / (2 * step)


def assert_close(analytic, numeric):
    # relative to the largest entry of the same kind: mm per degree are of another size than degrees per degree
    for rows in (slice(0, 3), slice(3, 6)):
        scale = max(np.abs(analytic[:, rows]).max(), 1.0)
        assert np.abs(analytic[:, rows] - numeric[:, rows]).max() < 1e-6 * scale


@given(st.sampled_from(ROBOTS), st.lists(st.floats(-180, 180), min_size=6, max_size=6))
def test_joints(robot, joints):
    q = np.array(joints[: robot.axes])
    numeric = np.empty((1, 6, robot.axes))
    for axis in range(robot.axes):
        change = 1e-2 * np.eye(robot.axes)[axis]
        numeric[0, :, axis] = twist(robot.forward(q - change), robot.forward(q + change), 1e-2)
    assert_close(robot.jacobian(q), numeric)


@given(st.sampled_from(ROBOTS), st.lists(st.floats(-180, 180), min_size=6, max_size=6))
def test_geometric_parameters(robot, joints):
    q = np.array(joints[: robot.axes])
    numeric = np.empty((1, 6, len(robot.parameter_names)))
    for column, name in enumerate(robot.parameter_names):
        before, after = robot.with_parameters({name: -1e-2}), robot.with_parameters({name: 1e-2})
        numeric[0, :, column] = twist(before.forward(q), after.forward(q), 1e-2)
    assert_close(robot.parameter_jacobian(q), numeric)


def test_parameters_have_names():
    assert ROBOTS[0].parameter_names == (
        "c1", "offset_1", "a1", "b", "offset_2", "c2", "offset_3", "a2", "c3", "offset_4", "offset_5", "offset_6", "c4",
    )  # fmt: skip
    assert CRAIG.parameter_names[:4] == ("alpha_1", "a_1", "offset_1", "d_1")
    with pytest.raises(KeyError):
        ROBOTS[0].with_parameters({"c9": 1.0})
    with pytest.raises(KeyError):
        CRAIG.with_parameters({"d_5": 1.0})


def test_by_hand_for_axis_one():
    # KR 210 R2700 prime at home: a degree of A1 moves the flange 1790 mm * pi / 180 to the right, turns it -1 about Z
    robot = built_in_robots()["kr210_r2700_prime"].model
    column = robot.jacobian([0, -90, 90, 0, 0, 0])[0, :, 0]
    assert column == pytest.approx([0, -1790 * np.pi / 180, 0, 0, 0, -1], abs=1e-12)


def test_frames_end_before_the_flange():
    robot = built_in_robots()["kr210_r2700_prime"].model
    rotations, origins = robot.frames([0, -90, 90, 0, 0, 0])
    assert rotations.shape == (1, 6, 3, 3) and origins.shape == (1, 6, 3)
    assert origins[0, 1] == pytest.approx([350, 0, 675])
    assert origins[0, 5] == pytest.approx([1550, 0, 1784])
