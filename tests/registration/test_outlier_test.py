"""The outlier test against refits by hand, and what it is for: good spots of small tables stay."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats
from scipy.spatial.transform import Rotation

from respot.registration.errors import DegenerateError, RegistrationError
from respot.registration.outlier_test import SCALE_FLOOR, f_limit, outlier_excess, settle_inliers
from respot.registration.robust import fit_robust

SEEDS = st.integers(0, 2**32 - 1)


def table(seed, n, noise=0.3):
    rng = np.random.default_rng(seed)
    source = rng.uniform(-1, 1, (n, 3)) * [800, 400, 600]
    return source, source + [60, -20, 30] + noise * rng.normal(size=(n, 3))


def refit(source, reference):
    """Least squares by another solver, and its normal matrix from finite turns."""
    middle, target = source.mean(axis=0), reference.mean(axis=0)
    rotation, _ = Rotation.align_vectors(reference - target, source - middle)
    return lambda points: rotation.apply(points - middle) + target


def by_hand(source, reference, row, others):
    """The linear model written out: residual of one row under the fit of others, weighed by its own covariance."""
    predict = refit(source[others], reference[others])
    image = predict(source)
    centre = image[others].mean(axis=0)

    def columns(point):
        x, y, z = point - centre
        return np.array([[1, 0, 0, 0, z, -y], [0, 1, 0, -z, 0, x], [0, 0, 1, y, -x, 0.0]])

    normal = sum(columns(image[other]).T @ columns(image[other]) for other in others)
    spread = np.eye(3) + columns(image[row]) @ np.linalg.inv(normal) @ columns(image[row]).T
    miss = image[row] - reference[row]
    left = sum(np.sum((image[other] - reference[other]) ** 2) for other in others)
    free = 3 * len(others) - 6
    return miss @ np.linalg.inv(spread) @ miss / 3 / (left / free) / stats.f.ppf(0.999, 3, free)


def test_a_pair_is_judged_by_all_other_inliers():
    source, reference = table(1, 9, noise=0.5)
    inliers = np.ones(9, dtype=bool)
    inliers[[2, 7]] = False
    reference[2] += [3, 0, 0]
    excess = outlier_excess(source, reference, inliers)
    for row in range(9):
        others = [k for k in np.flatnonzero(inliers) if k != row]
        assert excess[row] == pytest.approx(by_hand(source, reference, row, others), rel=5e-3)


def test_values_of_large_tables_are_on_the_right_side_of_the_limit():
    source, reference = table(2, 150)
    reference[:20] += np.linspace(0.2, 2, 20)[:, None]
    inliers = np.arange(150) >= 10
    excess = outlier_excess(source, reference, inliers)
    exact = [by_hand(source, reference, row, [k for k in np.flatnonzero(inliers) if k != row]) for row in range(150)]
    assert np.array_equal(excess > 1, np.array(exact) > 1)


def test_one_good_pair_in_a_thousand_fails():
    failed = [outlier_excess(*table(seed, 12), np.ones(12, dtype=bool)) > 1 for seed in range(1500)]
    assert 6 <= np.sum(failed) <= 34  # 18,000 trials at 0.001: 18 expected, three times its deviation allowed


def test_good_spots_come_back_and_bad_ones_do_not():
    source, reference = table(3, 10)
    reference[[0, 1]] += [[0, 5, 0], [4, 0, -3]]
    core = np.zeros(10, dtype=bool)
    core[4:] = True
    assert settle_inliers(source, reference, core).tolist() == [False, False] + [True] * 8
    bad_inside = np.arange(10) != 1
    assert settle_inliers(source, reference, bad_inside).tolist() == [False, False] + [True] * 8


def test_a_core_that_cannot_judge_is_left_alone():
    source, reference = table(4, 8)
    three = np.arange(8) < 3
    assert settle_inliers(source, reference, three).tolist() == three.tolist()
    with pytest.raises(RegistrationError, match="at least 4"):
        outlier_excess(source, reference, three)
    source[:4] = np.outer(range(4), [100, 50, 20])
    line = np.arange(8) < 4
    assert settle_inliers(source, reference, line).tolist() == line.tolist()
    with pytest.raises(DegenerateError):
        outlier_excess(source, source + 1.0, line)


def test_four_inliers_judge_others_and_not_each_other():
    source, reference = table(5, 6, noise=0.1)
    excess = outlier_excess(source, reference, np.arange(6) < 4)
    assert (excess[:4] == 0).all()
    assert (excess[4:] > 0).all()


def test_a_pair_that_alone_fixes_a_turn_is_not_judged_by_it():
    """Only the last spot is off the line: what it says about the turn about the line nobody can deny."""
    source = np.vstack([np.outer(np.linspace(0, 900, 7), [1, 0, 0]), [[400, 300, 0]]])
    reference = source + 0.1 * np.random.default_rng(6).normal(size=(8, 3))
    reference[7] += [0, np.sqrt(300**2 - 20**2) - 300, 20]
    assert np.isfinite(outlier_excess(source, reference, np.ones(8, dtype=bool))).all()
    assert fit_robust(source, reference).inliers[7]


def test_printed_numbers_are_no_noise():
    source, _ = table(7, 8)
    reference = np.round(source + [1, 2, 3], 3)
    excess = outlier_excess(source, reference, np.ones(8, dtype=bool))
    assert (excess < 1).all()
    assert fit_robust(source, source + 1).scale == SCALE_FLOOR


def test_limit_is_three_times_the_table_value_of_f():
    assert f_limit(4) == pytest.approx(3 * 23.70, abs=0.02)  # F(0.999; 3, 6) in any printed table
    assert f_limit(22) == pytest.approx(3 * 6.17, abs=0.02)  # F(0.999; 3, 60)


@pytest.mark.parametrize("n", [8, 14])
def test_good_spots_of_small_tables_are_kept(n):
    lost = sum(not fit_robust(*table(seed, n)).inliers.all() for seed in range(300))
    assert lost <= 0.04 * 300  # 0.1 % a spot; a threshold on a robust scale loses one in 10 % of the tables


@settings(max_examples=25, deadline=None)
@given(SEEDS, st.integers(6, 40), st.floats(0.2, 5))
def test_wider_noise_widens_scale_and_threshold_alike(seed, n, factor):
    source, reference = table(seed, n, noise=0.01)
    shift = np.array([60, -20, 30])
    fit, wide = (
        fit_robust(source, reference),
        fit_robust(source, source + shift + factor * (reference - source - shift)),
    )
    assert np.array_equal(fit.inliers, wide.inliers)
    assert wide.scale == pytest.approx(factor * fit.scale, rel=1e-3)
    assert wide.threshold == pytest.approx(factor * fit.threshold, rel=1e-3)
