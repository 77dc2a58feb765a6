from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from respot.registration.affine import fit_affine
from respot.registration.rigid import fit_rigid

SEEDS = st.integers(0, 2**32 - 1)


def normal_equations(source, reference):
    """12 parameters the long way: one 4-column system for each coordinate."""
    rows = np.hstack([source, np.ones((len(source), 1))])
    return np.linalg.solve(rows.T @ rows, rows.T @ reference).T


def test_the_rear_door(points):
    _, source, reference = points.rear_door()
    fit = fit_affine(source, reference)
    np.testing.assert_allclose(fit.matrix[:3], normal_equations(source, reference), rtol=1e-4, atol=1e-3)
    assert np.sqrt(np.mean(np.sum(fit.residuals**2, axis=1))) == pytest.approx(14.111, abs=0.001)
    assert fit.matrix[1, 0] == pytest.approx(0.457, abs=0.001)  # where a rotation has about 0.00
    assert fit.departure > 0.2
    assert fit.shear == pytest.approx(24.75, abs=0.01)
    assert fit.stretches[0] > 1.25
    assert fit.stretches[2] < 0.79
    assert fit.spread[2] < 5.0  # the spots lie within 5 mm of a plane: that is why
    assert not fit.reflects
    # It follows the spots that it was fitted to better than a rigid motion, and all others worse.
    rigid = fit_rigid(source, reference).residuals
    assert np.sum(fit.residuals**2) < np.sum(rigid**2)
    assert np.sqrt(np.mean(np.sum(fit.leave_one_out**2, axis=1))) > 20.0 > 16.50


@settings(max_examples=20, deadline=None)
@given(SEEDS)
def test_leave_one_out_is_a_refit_without_the_spot(seed):
    rng = np.random.default_rng(seed)
    source = rng.uniform(-500, 500, (9, 3))
    reference = source + 10 + rng.normal(size=(9, 3))
    fit = fit_affine(source, reference)
    for row in range(9):
        others = np.arange(9) != row
        matrix = normal_equations(source[others], reference[others])
        np.testing.assert_allclose(
            fit.leave_one_out[row], matrix[:, :3] @ source[row] + matrix[:, 3] - reference[row], rtol=1e-5, atol=1e-6
        )


@settings(max_examples=20, deadline=None)
@given(SEEDS)
def test_a_rigid_motion_is_found_as_one(points, seed):
    rng = np.random.default_rng(seed)
    source = rng.uniform(-500, 500, (12, 3))
    turn, shift = points.random_motion(rng)
    fit = fit_affine(source, points.move(source, turn, shift))
    np.testing.assert_allclose(fit.matrix[:3, :3], turn, atol=1e-9)
    np.testing.assert_allclose(fit.matrix[:3, 3], shift, atol=1e-5)
    np.testing.assert_allclose(fit.stretches, 1.0, atol=1e-9)
    np.testing.assert_allclose(fit.nearest_rotation, turn, atol=1e-9)
    assert fit.departure < 1e-9
    assert fit.shear < 1e-6


def test_a_known_stretch_and_a_known_shear():
    source = np.random.default_rng(1).uniform(-500, 500, (10, 3))
    stretched = fit_affine(source, source * [1.1, 1.0, 0.95])
    np.testing.assert_allclose(stretched.stretches, [1.1, 1.0, 0.95])
    assert stretched.shear == pytest.approx(0.0, abs=1e-9)
    assert stretched.departure == pytest.approx(0.1)
    sheared = fit_affine(source, source @ np.array([[1, np.tan(np.radians(10)), 0], [0, 1, 0], [0, 0, 1]]).T)
    assert sheared.shear == pytest.approx(10.0)


def test_a_mirrored_list_is_seen():
    source = np.random.default_rng(2).uniform(-500, 500, (10, 3))
    fit = fit_affine(source, source * [1, -1, 1])
    assert fit.reflects
    assert np.linalg.det(fit.nearest_rotation) == pytest.approx(1.0)


@pytest.mark.parametrize("stray", [0.0, 0.05])
def test_coplanar_spots_leave_it_undetermined(stray):
    rng = np.random.default_rng(3)
    source = np.c_[rng.uniform(-500, 500, (12, 2)), stray * rng.normal(size=12)]
    assert fit_affine(source, source + 1.0) is None
    assert fit_affine(source[:3] + np.eye(3), source[:3]) is None


def test_four_spots_leave_nothing_to_test_it_by():
    source = np.array([(0, 0, 0), (300, 0, 0), (0, 200, 0), (0, 0, 100.0)])
    fit = fit_affine(source, source + np.random.default_rng(4).normal(size=(4, 3)))
    np.testing.assert_allclose(fit.residuals, 0.0, atol=1e-9)
    assert np.isnan(fit.leave_one_out).all()
