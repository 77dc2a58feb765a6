"""Conventions by hand-worked values, and laws."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

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


TURNS = st.tuples(st.floats(-5, 5), st.floats(-5, 5), st.floats(-5, 5))
WIDE = st.tuples(st.floats(-180, 180), st.floats(-180, 180), st.floats(-180, 180))
BY_THE_LOCK = st.floats(-9, -2).map(lambda power: 90.0 - 10.0**power)
STEEP = st.tuples(st.floats(-180, 180), BY_THE_LOCK | st.just(-90.0), st.floats(-180, 180))


def rotation_from_rotvec(degrees) -> Rotation:
    return Rotation.from_rotvec(degrees, degrees=True)


def circular(first, second) -> np.ndarray:
    return np.abs((np.asarray(first) - second + 180.0) % 360.0 - 180.0)


@given(WIDE | STEEP, TURNS)
def test_angles_near_old_ones_are_the_same_rotation_and_in_range(old, turn):
    rotation = rotation_from_rotvec(turn) * geometry.rotation_from_abc(old)
    abc = geometry.abc_from_rotation(rotation, near=old)
    assert np.degrees((rotation.inv() * geometry.rotation_from_abc(abc)).magnitude()) <= 5.01e-7
    assert (np.abs(abc) <= 180.0).all()


@given(WIDE | STEEP)
def test_angles_of_a_pose_that_stays_are_the_old_ones(old):
    """Not those of another triple, nor at the lock another A and C."""
    abc = geometry.abc_from_rotation(geometry.rotation_from_abc(old), near=old)
    tight = 1e-9 / max(abs(np.cos(np.radians(old[1]))), 1e-6)
    assert (circular(abc, old) <= tight).all()


@given(WIDE, TURNS)
def test_no_other_triple_of_the_rotation_is_nearer(old, turn):
    rotation = rotation_from_rotvec(turn) * geometry.rotation_from_abc(old)
    abc = geometry.abc_from_rotation(rotation, near=old)
    other = abc * [1.0, -1.0, 1.0] + 180.0
    assert np.sum(circular(abc, old) ** 2) <= np.sum(circular(other, old) ** 2) + 1e-9


@pytest.mark.parametrize(("b", "expected"), [(90.0, (11.5, 90.0, 18.5)), (-90.0, (11.5, -90.0, 21.5))])
def test_at_the_lock_a_and_c_share_the_way(b, expected):
    """Rz(3) Rz(10) Ry(90) Rx(20): A - C = -7, which 11.5 and 18.5 say with the least change; scipy says -7, 90, 0."""
    rotation = geometry.rotation_from_abc([3.0, 0.0, 0.0]) * geometry.rotation_from_abc([10.0, b, 20.0])
    assert geometry.abc_from_rotation(rotation, near=[10.0, b, 20.0]) == pytest.approx(expected, abs=1e-9)


def test_angles_beyond_half_a_turn_stay_beyond_only_where_the_source_was():
    rotation = geometry.rotation_from_abc([180.4, 10.0, -180.3])
    assert geometry.abc_from_rotation(rotation, near=[179.9, 10.0, -179.8]) == pytest.approx([-179.6, 10.0, 179.7])
    assert geometry.abc_from_rotation(rotation, near=[180.1, 10.0, -540.1]) == pytest.approx([180.4, 10.0, -540.3])


def test_angles_near_old_ones_of_a_batch_are_those_of_each(old=((10.0, 89.5, 20.0), (170.0, 100.0, -20.0))):
    rotations = rotation_from_rotvec([0.0, 1.0, 0.5]) * geometry.rotation_from_abc(old)
    batch = geometry.abc_from_rotation(rotations, near=old)
    assert batch == pytest.approx(
        np.array([geometry.abc_from_rotation(rotations[i], near=old[i]) for i in range(2)]), abs=1e-9
    )


@given(WIDE | STEEP, st.tuples(*[st.floats(-0.5, 0.5)] * 3))
def test_rounding_angles_turns_a_pose_by_no_more_anywhere(abc, rounding):
    """Near the lock digits are lost in A and C, not in the pose: half digits h turn it by sqrt(5) h at most."""
    rounded = np.asarray(abc) + 1e-4 * np.asarray(rounding)
    turn = (geometry.rotation_from_abc(abc).inv() * geometry.rotation_from_abc(rounded)).magnitude()
    assert np.degrees(turn) <= np.sqrt(5) * 0.5e-4 + 1e-9


@given(st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: np.linalg.norm(q) > 0.1), st.floats(0.999, 1.001))
def test_a_quaternion_keeps_sign_and_length(raw, length):
    old = length * np.asarray(raw) / np.linalg.norm(raw)
    again = geometry.quaternion_from_rotation(geometry.rotation_from_quaternion(old), near=old)
    assert again == pytest.approx(old, abs=1e-12)
    assert abs(np.linalg.norm(np.round(again, 7)) - length) <= 1e-7
