"""Noise that differs by direction: is it told, and does weighing by it pay, honestly."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import optimize, stats
from scipy.spatial.transform import Rotation

from respot.registration.anisotropy import fit_weighted, isotropy_p_value, noise_covariance, plain_covariance
from respot.registration.covariance import unit_covariance
from respot.registration.errors import DegenerateError, RegistrationError
from respot.registration.rigid import fit_rigid

SEEDS = st.integers(0, 2**32 - 1)
UNEVEN = np.array([0.5, 4.9, 1.7])


def table(rng, n, noise):
    source = rng.uniform(-1, 1, (n, 3)) * [800, 400, 600]
    return source, source + rng.normal(size=(n, 3)) * noise


def test_the_rear_door_is_uneven_and_keeps_its_numbers(points):
    _, source, reference = points.repaired()
    assert isotropy_p_value(source, reference) == pytest.approx(0.001)
    fit = fit_weighted(source, reference)
    spread = np.sqrt(np.diag(fit.residuals.T @ fit.residuals) / 14)
    np.testing.assert_allclose(spread, [0.5, 4.9, 1.7], atol=0.1)
    plain = fit_rigid(source, reference).residuals
    assert np.sqrt(np.mean(np.sum(plain**2, axis=1))) == pytest.approx(5.163, abs=0.001)
    assert np.sum(fit.residuals**2) >= np.sum(plain**2)  # least squares stays least


def test_even_noise_is_called_uneven_as_often_as_said():
    rng = np.random.default_rng(1)
    p_values = [isotropy_p_value(*table(rng, n, 0.4), seed=k) for n in (6, 14) for k in range(150)]
    assert sum(p <= 0.05 for p in p_values) <= 28  # 15 expected of 300
    assert stats.kstest(p_values, "uniform").pvalue > 1e-3


def test_many_spots_by_the_limit():
    rng = np.random.default_rng(2)
    p_values = [isotropy_p_value(*table(rng, 2001, 0.4)) for _ in range(100)]
    assert stats.kstest(p_values, "uniform").pvalue > 1e-3
    assert isotropy_p_value(*table(rng, 2001, [0.4, 0.4, 0.5])) < 1e-6


def test_weights_against_another_minimiser():
    """The same sum of squares, minimised by a general solver, for the noise that the fit came to."""
    rng = np.random.default_rng(3)
    source, reference = table(rng, 12, UNEVEN)
    fit = fit_weighted(source, reference)
    root = np.linalg.cholesky(np.linalg.inv(fit.noise))

    def misses(x):
        return ((Rotation.from_rotvec(x[3:] / 1000).apply(source) + x[:3] - reference) @ root).ravel()

    other = optimize.least_squares(misses, np.zeros(6), xtol=1e-15, ftol=1e-15, gtol=1e-15)
    np.testing.assert_allclose(fit.rotation, Rotation.from_rotvec(other.x[3:] / 1000).as_matrix(), atol=1e-8)
    np.testing.assert_allclose(fit.translation, other.x[:3], atol=1e-5)
    np.testing.assert_allclose(fit.residuals, source @ fit.rotation.T + fit.translation - reference, atol=1e-9)


@settings(max_examples=25, deadline=None)
@given(SEEDS)
def test_moving_and_reordering_move_the_answer(points, seed):
    rng = np.random.default_rng(seed)
    source, reference = table(rng, 12, UNEVEN)
    (a, s), (b, t) = points.random_motion(rng), points.random_motion(rng)
    order = rng.permutation(12)
    fit = fit_weighted(source, reference)
    moved = fit_weighted(points.move(source, a, s)[order], points.move(reference, b, t)[order])
    np.testing.assert_allclose(moved.rotation, b @ fit.rotation @ a.T, atol=1e-7)
    np.testing.assert_allclose(moved.residuals, fit.residuals[order] @ b.T, atol=1e-3)
    np.testing.assert_allclose(moved.noise, b @ fit.noise @ b.T, atol=1e-3)
    both = np.kron(np.eye(2), b)
    np.testing.assert_allclose(moved.covariance, both @ fit.covariance @ both.T, rtol=1e-4, atol=1e-4)
    assert isotropy_p_value(source[order], reference[order]) == isotropy_p_value(source, reference)


def test_it_pays_on_held_out_spots_and_costs_nothing_where_noise_is_even():
    rng = np.random.default_rng(4)
    ratio = {}
    for name, noise in (("uneven", UNEVEN), ("even", np.ones(3))):
        squares = np.zeros(2)
        for _ in range(200):
            source, reference = table(rng, 14, noise)
            new = rng.uniform(-1, 1, (10, 3)) * [800, 400, 600]
            fit, plain = fit_weighted(source, reference), fit_rigid(source, reference)
            squares += [
                np.sum((new @ fit.rotation.T + fit.translation - new) ** 2),
                np.sum((plain.predict(new) - new) ** 2),
            ]
        ratio[name] = np.sqrt(squares[0] / squares[1])
    assert ratio["uneven"] < 0.87
    assert ratio["even"] < 1.02


def held(source, reference, fit, covariance, free):
    """Which of the six intervals hold the truth, which is no motion at all."""
    rotation, translation = fit
    centre = (source @ rotation.T + translation).mean(axis=0)
    back = rotation.T
    turn = np.array([back[2, 1] - back[1, 2], back[0, 2] - back[2, 0], back[1, 0] - back[0, 1]]) / 2
    error = np.concatenate([back @ (centre - translation) - centre, turn])
    return np.abs(error) <= stats.t.ppf(0.975, free) * np.sqrt(np.diag(covariance))


def test_intervals_by_direction_hold_where_one_noise_for_all_does_not():
    rng = np.random.default_rng(5)
    weighted, by_axis, one = [], [], []
    for _ in range(500):
        source, reference = table(rng, 14, UNEVEN)
        fit, plain = fit_weighted(source, reference), fit_rigid(source, reference)
        transform, points = (plain.rotation, plain.translation), plain.predict(source)
        weighted.append(held(source, reference, (fit.rotation, fit.translation), fit.covariance, 12))
        scatter = plain.residuals.T @ plain.residuals / 12
        by_axis.append(held(source, reference, transform, plain_covariance(points, scatter), 12))
        even = unit_covariance(points)[0] * np.sum(plain.residuals**2) / 36
        one.append(held(source, reference, transform, even, 36))
    assert 0.93 <= np.mean(weighted) <= 0.97
    assert 0.93 <= np.mean(by_axis) <= 0.97
    assert np.mean(weighted, axis=0).min() > 0.88
    assert np.mean(one, axis=0).min() < 0.85  # the widest direction is promised too little


def test_one_noise_for_all_is_a_case_of_it():
    source, _ = table(np.random.default_rng(6), 9, 1.0)
    np.testing.assert_allclose(plain_covariance(source, 4.0 * np.eye(3)), 4.0 * unit_covariance(source)[0], atol=1e-12)
    with pytest.raises(RegistrationError, match=r"\(3, 3\)"):
        plain_covariance(source, np.ones(3))


def test_few_residuals_are_drawn_to_a_sphere_and_many_are_not():
    rng = np.random.default_rng(7)
    assert noise_covariance(rng.normal(size=(6, 3)))[1] > 0.5
    noise, share = noise_covariance(rng.normal(size=(4000, 3)) * UNEVEN)
    assert share < 0.01
    np.testing.assert_allclose(np.sqrt(np.diag(noise)), UNEVEN, rtol=0.05)


def test_exact_and_bad_input():
    source, _ = table(np.random.default_rng(8), 9, 1.0)
    assert isotropy_p_value(source, source + 3.0) == 1.0
    np.testing.assert_allclose(fit_weighted(source, source + 3.0).translation, 3.0, atol=1e-6)
    for call in (fit_weighted, isotropy_p_value):
        with pytest.raises(RegistrationError, match="at least 6"):
            call(source[:5], source[:5])
        with pytest.raises(DegenerateError, match="line"):
            call(np.outer(np.arange(9), [1, 2, 3]), source)


def test_pairs_that_take_no_part_get_a_residual():
    rng = np.random.default_rng(9)
    source, reference = table(rng, 20, UNEVEN)
    reference[[3, 8]] += [200.0, 0, 50]
    inliers = ~np.isin(np.arange(20), [3, 8])
    fit, alone = fit_weighted(source, reference, inliers), fit_weighted(source[inliers], reference[inliers])
    assert np.array_equal(fit.rotation, alone.rotation)
    assert np.array_equal(fit.covariance, alone.covariance)
    assert fit.degrees_of_freedom == 16
    assert fit.residuals.shape == (20, 3)
    np.testing.assert_allclose(fit.rigid.predict(source) - reference, fit.residuals, atol=1e-9)
    np.testing.assert_allclose(fit.centroid, fit.rigid.predict(source[inliers]).mean(axis=0))
    assert (fit.rigid.rank, fit.rigid.mirrored) == (3, False)
    np.testing.assert_allclose(
        fit.half_width[:3], stats.t.ppf(0.975, 16) * np.sqrt(np.diag(fit.covariance)[:3]), rtol=1e-12
    )
    with pytest.raises(RegistrationError, match="at least 6"):
        fit_weighted(source, reference, np.arange(20) < 5)
    with pytest.raises(RegistrationError, match="inliers are"):
        fit_weighted(source, reference, inliers[:5])
