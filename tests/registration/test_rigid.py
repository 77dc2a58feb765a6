from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from respot.registration.affine import fit_affine
from respot.registration.alternatives import fit_translation
from respot.registration.covariance import jacobian, leverage, unit_covariance
from respot.registration.errors import DegenerateError, RegistrationError
from respot.registration.leave_one_out import leave_one_out
from respot.registration.rigid import fit_rigid, transform_of
from respot.registration.statistics import distances, residual_directions, rms
from respot.registration.support import rotation_p_value_by_axis, rotation_support

SEEDS = st.integers(0, 2**32 - 1)


def cloud(rng, n=10, noise=0.5):
    source = rng.uniform(-1, 1, (n, 3)) * [800, 400, 600] + [4000, 0, 1400]
    return source, noise * rng.normal(size=(n, 3))


def test_recovers_a_known_motion(points):
    rotation = points.turn((1, 2, -0.5), 33)
    source, _ = cloud(np.random.default_rng(3))
    fit = fit_rigid(source, points.move(source, rotation, (100, -2000, 30)))
    np.testing.assert_allclose(fit.rotation, rotation, atol=1e-12)
    np.testing.assert_allclose(fit.translation, (100, -2000, 30), atol=1e-8)
    np.testing.assert_allclose(fit.source2reference.apply(source), fit.predict(source), atol=1e-9)
    assert np.abs(fit.residuals).max() < 1e-8
    assert fit.rank == 3
    assert not fit.mirrored


def test_residuals_are_predicted_minus_reference():
    source = np.array([[0, 0, 0], [100, 0, 0], [0, 100, 0], [100, 100, 0.0]])
    reference = source + np.array([0, 0, 5.0])
    reference[0, 2] += 4  # z of the plane cannot follow all four: 1 up, 1 down
    reference[3, 2] += 4
    fit = fit_rigid(source, reference)
    np.testing.assert_allclose(fit.residuals[:, 2], [-2, 2, 2, -2], atol=1e-2)


@settings(max_examples=40, deadline=None)
@given(SEEDS)
def test_moving_both_sets_moves_the_answer(points, seed):
    rng = np.random.default_rng(seed)
    source, error = cloud(rng)
    reference = points.move(source, *points.random_motion(rng)) + error
    (a, s), (b, t) = points.random_motion(rng), points.random_motion(rng)
    fit = fit_rigid(source, reference)
    moved = fit_rigid(points.move(source, a, s), points.move(reference, b, t))
    np.testing.assert_allclose(moved.rotation, b @ fit.rotation @ a.T, atol=1e-9)
    np.testing.assert_allclose(moved.residuals, fit.residuals @ b.T, atol=1e-6)


@settings(max_examples=40, deadline=None)
@given(SEEDS)
def test_least_squares_is_least_and_rows_have_no_order(points, seed):
    rng = np.random.default_rng(seed)
    source, error = cloud(rng)
    reference = points.move(source, *points.random_motion(rng)) + error
    fit = fit_rigid(source, reference)
    best = np.sum(fit.residuals**2)
    nudged = points.turn(tuple(rng.normal(size=3)), 0.01) @ fit.rotation
    centred = (source - source.mean(0)) @ nudged.T - (reference - reference.mean(0))
    assert np.sum(centred**2) >= best
    order = rng.permutation(len(source))
    np.testing.assert_allclose(fit_rigid(source[order], reference[order]).rotation, fit.rotation, atol=1e-12)


def test_weights_repeat_rows_and_zero_weight_leaves_out():
    rng = np.random.default_rng(8)
    source, error = cloud(rng)
    reference = source + error
    weights = np.array([0, 2, 1, 1, 3, 1, 1, 1, 1, 1.0])
    fit = fit_rigid(source, reference, weights)
    rows = np.repeat(np.arange(10), weights.astype(int))
    np.testing.assert_allclose(fit.rotation, fit_rigid(source[rows], reference[rows]).rotation, atol=1e-12)
    assert len(fit.residuals) == 10


def test_a_batch_equals_single_fits():
    rng = np.random.default_rng(1)
    source, reference = rng.normal(size=(5, 6, 3)), rng.normal(size=(5, 6, 3))
    rotations, translations = transform_of(source, reference)
    for k in range(5):
        fit = fit_rigid(source[k], reference[k])
        np.testing.assert_allclose(rotations[k], fit.rotation, atol=1e-10)
        np.testing.assert_allclose(translations[k], fit.translation, atol=1e-10)


def test_never_a_reflection():
    source, _ = cloud(np.random.default_rng(4))
    fit = fit_rigid(source, source * [1, -1, 1])
    assert np.linalg.det(fit.rotation) == pytest.approx(1)
    assert fit.mirrored


def test_three_spots_and_coplanar_spots_are_enough():
    source = np.array([[0, 0, 0], [300, 0, 0], [0, 200, 0.0]])
    assert fit_rigid(source, source + 1.0).rank == 2
    assert fit_affine(np.vstack([source, source + 40 * np.array([1, 1, 0])]), np.ones((6, 3))) is None


@pytest.mark.parametrize("stray", [0.0, 0.01, 0.3])
def test_collinear_spots_say_what_is_not_determined(points, stray):
    rng = np.random.default_rng(2)
    source = np.linspace(0, 1500, 8)[:, None] * np.array([0.6, 0.8, 0]) + stray * rng.normal(size=(8, 3))
    with pytest.raises(DegenerateError, match="rotation about that line is not determined") as caught:
        fit_rigid(source, points.move(source, points.turn((0, 0, 1), 20), (5, 5, 5)))
    assert caught.value.code == "COLLINEAR_SPOTS"


def test_coinciding_spots_and_lines_in_the_reference_alone():
    source, _ = cloud(np.random.default_rng(5))
    with pytest.raises(DegenerateError, match="coincide"):
        fit_rigid(np.ones((5, 3)), source[:5])
    with pytest.raises(DegenerateError, match="reference spots lie on one line"):
        fit_rigid(source, np.outer(np.arange(10), [1, 2, 3]))


@pytest.mark.parametrize(
    ("source", "code"),
    [
        (np.zeros((2, 3)), "TOO_FEW_PAIRS"),
        (np.array([[0, 0, 0], [1, np.nan, 0], [0, 1, 0]]), "NOT_A_NUMBER"),
        (np.array([[0, 0, 0], [1, np.inf, 0], [0, 1, 0]]), "NOT_A_NUMBER"),
        (np.zeros((4, 2)), "SHAPE_MISMATCH"),
    ],
)
def test_bad_input_has_a_code(source, code):
    with pytest.raises(RegistrationError) as caught:
        fit_rigid(source, np.zeros_like(source))
    assert caught.value.code == code


def test_leave_one_out_equals_refitting_by_hand(points):
    _, source, reference = points.rear_door()
    batch = leave_one_out(source, reference)
    for k in range(len(source)):
        kept = np.arange(len(source)) != k
        fit = fit_rigid(source[kept], reference[kept])
        np.testing.assert_allclose(batch[k], fit.predict(source[k]) - reference[k], atol=1e-8)
    assert rms(batch) == pytest.approx(16.50, abs=0.005)


def test_leave_one_out_leaves_outliers_out_of_every_fit(points):
    _, source, reference = points.rear_door()
    inliers = np.arange(14) < 12
    batch = leave_one_out(source, reference, inliers)
    fit = fit_rigid(source[inliers], reference[inliers])
    np.testing.assert_allclose(batch[12:], fit.predict(source[12:]) - reference[12:], atol=1e-8)
    np.testing.assert_allclose(batch[:12], leave_one_out(source[:12], reference[:12]), atol=1e-8)


def test_leave_one_out_says_where_the_others_lie_on_a_line():
    source = np.array([[0, 0, 0], [100, 0, 0], [250, 0, 0], [50, 80, 0.0]])
    assert np.isnan(leave_one_out(source, source)).all(axis=1).tolist() == [False, False, False, True]


def test_numbers_of_the_rear_door(points):
    _, source, reference = points.rear_door()
    assert distances(source - reference).mean == pytest.approx(76.1896, abs=0.002)
    assert distances(source - reference).max == pytest.approx(95.6224, abs=0.002)
    before = distances(fit_rigid(source, reference).residuals)
    assert (before.rms, before.mean, before.max) == pytest.approx((14.435, 8.875, 40.323), abs=0.002)
    assert rms(fit_affine(source, reference).residuals) == pytest.approx(14.111, abs=0.002)
    _, source, reference = points.repaired()
    fit = fit_rigid(source, reference)
    after = distances(fit.residuals)
    assert (after.rms, after.mean, after.max) == pytest.approx((5.163, 4.488, 9.662), abs=0.002)
    assert rms(leave_one_out(source, reference)) == pytest.approx(5.78, abs=0.005)
    shift = fit_translation(source, reference)
    assert rms(shift.residuals) == pytest.approx(5.255, abs=0.002)
    assert distances(shift.residuals).max == pytest.approx(9.239, abs=0.002)
    assert rms(shift.leave_one_out) == pytest.approx(5.659, abs=0.002)
    directions = residual_directions(fit.residuals)
    np.testing.assert_allclose(directions.sd_xyz, [0.53, 4.85, 1.68], atol=0.005)
    assert directions.axes[0, 1] > 0.99


def test_a_rotation_is_claimed_only_where_there_is_one(points):
    _, source, reference = points.repaired()
    verdict = rotation_support(source, reference)
    assert not verdict.supported
    assert verdict.p_value > 0.5
    assert "do not support" in verdict.verdict
    assert verdict.p_value_by_axis < 0.03  # x scatters by 1.03 mm without the rotation and 0.46 mm with it
    assert "weighed by the noise of each direction" in verdict.verdict
    turned = points.move(reference, points.turn((0, 1, 1), 3), (0, 0, 0))
    assert rotation_support(source, turned).supported
    same = rotation_support(source, source)
    assert not same.supported
    assert same.p_value == pytest.approx(1)


def test_a_true_null_rotation_is_claimed_about_one_time_in_twenty():
    rng = np.random.default_rng(11)
    claims = by_axis = 0
    for _ in range(300):
        source, error = cloud(rng, 12)
        claims += rotation_support(source, source + error + 60.0).supported
        by_axis += rotation_p_value_by_axis(source, source + error * [1, 9, 3] + 60.0) < 0.05
    assert claims <= 0.08 * 300
    assert 0.02 * 300 <= by_axis <= 0.09 * 300


def test_jacobian_is_the_derivative_of_a_small_motion(points):
    offsets = np.array([[100.0, -20, 35], [3, 700, -60]])
    degrees = 1e-4
    for k, axis in enumerate([(1, 0, 0), (0, 1, 0), (0, 0, 1)]):
        moved = points.move(offsets, points.turn(axis, degrees), (0, 0, 0))
        np.testing.assert_allclose(jacobian(offsets)[:, :, 3 + k], (moved - offsets) / np.radians(degrees), atol=1e-2)
        np.testing.assert_allclose(jacobian(offsets)[:, :, k], np.tile(axis, (2, 1)))


def test_covariance_predicts_the_scatter_of_the_transform():
    rng = np.random.default_rng(6)
    source, _ = cloud(rng, 12)
    _, centroid = unit_covariance(source)
    at = np.array([[5000.0, 900, 2000], centroid])
    images = np.array([fit_rigid(source, source + rng.normal(size=source.shape)).predict(at) for _ in range(2000)])
    np.testing.assert_allclose(images.var(axis=0).mean(axis=1), leverage(at, source), rtol=0.1)


@pytest.mark.parametrize("stray", [0.0, 0.05])
def test_two_tight_clusters_are_a_line(stray):
    rng = np.random.default_rng(12)
    source = np.repeat([[0.0, 0, 0], [900, 500, 0]], 6, axis=0) + stray * rng.normal(size=(12, 3))
    with pytest.raises(DegenerateError, match=r"lie on one line .* rotation about that line is not determined"):
        fit_rigid(source, source + 1.0)


def test_a_plane_is_enough_and_says_that_it_is_one():
    rng = np.random.default_rng(13)
    flat = rng.uniform(-1, 1, (9, 3)) * [800, 400, 0]
    fit = fit_rigid(flat, flat * [1, 1, -1] + [0, 0, 7])
    assert fit.rank == 2
    assert not fit.mirrored  # a flat part looks the same in the mirror
    np.testing.assert_allclose(fit.rotation, np.eye(3), atol=1e-12)
    assert fit_rigid(flat + rng.normal(size=(9, 3)) * 20, flat).rank == 3


def test_pairs_that_agree_along_one_direction_alone():
    """Two crosses, one of them upside down in the other's plane: nothing tells the turn about their common beam."""
    beam = np.array([[-300.0, 0, 0], [300, 0, 0]])
    source = np.vstack([beam, [[0, 100, 0], [0, -100, 0], [0, 0, 0], [0, 0, 0]]])
    reference = np.vstack([beam, [[0, 0, 0], [0, 0, 0], [0, 100, 0], [0, -100, 0]]])
    with pytest.raises(DegenerateError, match="do not correspond along more than one direction"):
        fit_rigid(source, reference)


def test_a_large_table_is_summed_block_by_block(points):
    rng = np.random.default_rng(14)
    source, error = cloud(rng, 10_001)
    reference = points.move(source, points.turn((1, 1, 0), 10), (5, 6, 7)) + error
    weights = rng.uniform(0, 2, 10_001)
    fit = fit_rigid(source, reference, weights)
    middle, target = np.average(source, axis=0, weights=weights), np.average(reference, axis=0, weights=weights)
    other, _ = Rotation.align_vectors(reference - target, source - middle, weights=weights)
    np.testing.assert_allclose(fit.rotation, other.as_matrix(), atol=1e-10)
    np.testing.assert_allclose(fit.residuals, other.apply(source - middle) + target - reference, atol=1e-6)


def test_leverage_is_the_mean_variance_of_the_three_coordinates():
    rng = np.random.default_rng(15)
    fitted, at = rng.normal(size=(7, 3)) * [900, 30, 200], rng.normal(size=(5, 3)) * 1000
    rows = jacobian(fitted - fitted.mean(axis=0)).reshape(-1, 6)
    inverse = np.linalg.inv(rows.T @ rows)
    np.testing.assert_allclose(unit_covariance(fitted)[0], inverse, rtol=1e-6, atol=1e-12)
    expected = [np.trace(row @ inverse @ row.T) / 3 for row in jacobian(at - fitted.mean(axis=0))]
    np.testing.assert_allclose(leverage(at, fitted), expected, rtol=1e-9)
