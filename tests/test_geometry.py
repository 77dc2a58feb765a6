"""Conventions by hand-worked values, and laws."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from respot import geometry

ANGLES = st.tuples(st.floats(-180, 180), st.floats(-90, 90), st.floats(-180, 180))
ROOT = np.sqrt(0.5)


@pytest.mark.parametrize(
    ("abc", "columns"),  # images of the x, y and z axis: R = Rz(A) Ry(B) Rx(C)
    [
        ((90, 0, 0), ([0, 1, 0], [-1, 0, 0], [0, 0, 1])),
        ((0, 90, 0), ([0, 0, -1], [0, 1, 0], [1, 0, 0])),
        ((0, 0, 90), ([1, 0, 0], [0, 0, 1], [0, -1, 0])),
        ((90, 90, 0), ([0, 0, -1], [-1, 0, 0], [0, 1, 0])),
        ((90, 0, 90), ([0, 1, 0], [0, 0, 1], [1, 0, 0])),
        ((0, 45, 90), ([ROOT, 0, -ROOT], [ROOT, 0, ROOT], [0, -1, 0])),
    ],
)
def test_kuka_angles(abc, columns):
    assert geometry.rotation_from_abc(abc).as_matrix() == pytest.approx(np.array(columns, dtype=float).T, abs=1e-12)


@pytest.mark.parametrize(
    ("quaternion", "columns"),
    [
        ((1, 0, 0, 0), ([1, 0, 0], [0, 1, 0], [0, 0, 1])),
        ((ROOT, 0, 0, ROOT), ([0, 1, 0], [-1, 0, 0], [0, 0, 1])),
        ((ROOT, 0, ROOT, 0), ([0, 0, -1], [0, 1, 0], [1, 0, 0])),
        ((0, 0, 1, 0), ([-1, 0, 0], [0, 1, 0], [0, 0, -1])),
        ((-ROOT, -ROOT, 0, 0), ([1, 0, 0], [0, 0, 1], [0, -1, 0])),
    ],
)
def test_abb_quaternion_is_scalar_first(quaternion, columns):
    made = geometry.rotation_from_quaternion(quaternion).as_matrix()
    assert made == pytest.approx(np.array(columns, dtype=float).T, abs=1e-12)


@given(ANGLES)
def test_kuka_angles_come_back_as_the_same_rotation(abc):
    rotation = geometry.rotation_from_abc(abc)
    again = geometry.rotation_from_abc(geometry.abc_from_rotation(rotation))
    assert np.degrees((rotation.inv() * again).magnitude()) < 1e-6


@given(ANGLES, st.booleans())
def test_krl_to_quaternion_to_krl(abc, negative):
    rotation = geometry.rotation_from_abc(abc)
    near = geometry.quaternion_from_rotation(rotation) * (-1.0 if negative else 1.0)
    quaternion = geometry.quaternion_from_rotation(rotation, near=near)
    assert quaternion == pytest.approx(near)
    again = geometry.rotation_from_quaternion(quaternion)
    assert np.degrees((rotation.inv() * again).magnitude()) < 1e-6


def test_gimbal_lock_gives_c_zero():
    assert geometry.abc_from_rotation(geometry.rotation_from_abc((0, 90, 20))) == pytest.approx([-20, 90, 0], abs=1e-6)


def test_a_pose_turns_first_and_moves_then():
    base = geometry.pose([1000, 0, 500], geometry.rotation_from_abc([90, 0, 0]))
    point = geometry.pose([5, 6, 7], geometry.rotation_from_abc([0, 0, 0]))
    assert (base * point).translation == pytest.approx([994, 5, 507])
    assert geometry.distance_mm(base, base * point) == pytest.approx(np.sqrt(110))
    assert geometry.turn_deg(point, base * point) == pytest.approx(90)
