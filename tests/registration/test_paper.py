"""The paper's method against a second reading of its equations, in plain Python."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from respot.registration import paper
from respot.registration.errors import DegenerateError, RegistrationError
from respot.registration.paper import default_n_min, fit_paper
from respot.registration.rigid import fit_rigid

SEEDS = st.integers(0, 2**32 - 1)
#: Coordinates after the paper's calibration, its Table 1 (the source is named in points.py).
PUBLISHED = """
P02WP1615438 4324.14 30.26 1274.24
P02WP1615437 4322.44 95.26 1274.59
P02WP1615436 4319.49 165.63 1275.52
P02WP1615435 4313.72 241.10 1275.43
P02WP1615434 4306.72 312.75 1275.47
P02WP1615429 4324.69 -31.96 1277.37
P02WP1615430 4323.35 -98.18 1275.38
P02WP1615431 4319.57 -170.19 1275.30
P02WP1615432 4314.27 -236.58 1275.27
P02WP1615441 4257.91 -237.82 1587.70
P02WP1615439 4261.70 -185.49 1590.22
P02WP1609707 4263.81 -143.88 1591.06
P02WP1615442 4263.95 144.70 1590.95
P02WP1609713 4263.36 177.47 1590.41
"""


def by_hand(source, reference, tau, n_min, size=4, mean_square=False):
    """Equations (5) to (8), subset by subset and spot by spot: (D_n, subset, inliers, dropped) of all that qualify."""
    n, found = len(source), []
    for subset in itertools.combinations(range(n), size):
        p_mean = [sum(source[i][k] for i in subset) / size for k in range(3)]
        q_mean = [sum(reference[i][k] for i in subset) / size for k in range(3)]
        rotation = Rotation.align_vectors(
            [np.subtract(reference[i], q_mean) for i in subset], [np.subtract(source[i], p_mean) for i in subset]
        )[0].as_matrix()
        delta = {}
        for i in range(n):
            if i in subset:
                continue
            turned = [sum(rotation[k][j] * (source[i][j] - p_mean[j]) for j in range(3)) for k in range(3)]
            delta[i] = max(abs(turned[k] + q_mean[k] - reference[i][k]) for k in range(3))
        inliers = [i for i in delta if delta[i] <= tau]
        if len(inliers) > n_min:
            mean = 0.0 if mean_square else sum(delta[i] for i in inliers) / len(inliers)
            d_n = sum((delta[i] - mean) ** 2 for i in inliers) / len(inliers)
            found.append((d_n, subset, tuple(inliers), tuple(i for i in delta if delta[i] > tau)))
    return sorted(found)


@pytest.mark.filterwarnings("ignore:Optimal rotation is not uniquely:UserWarning")
@pytest.mark.parametrize("score", ["variance", "mean-square"])
@pytest.mark.parametrize(("tau", "n_min"), [(10.0, 5), (10.0, 7), (12.0, 5), (8.6, 4)])
def test_the_rear_door_by_a_second_hand(points, tau, n_min, score):
    _, source, reference = points.rear_door()
    found = by_hand(source.tolist(), reference.tolist(), tau, n_min, mean_square=score == "mean-square")
    fit = fit_paper(source, reference, tau=tau, n_min=n_min, score=score)
    best = found[0]
    assert fit.d_n == pytest.approx(best[0], rel=1e-6)
    assert (fit.subset, fit.inliers, fit.dropped) == best[1:]
    assert (fit.n_subsets, fit.exhaustive, fit.n_qualified) == (1001, True, len(found))
    rank = next(place for place, other in enumerate(found, start=1) if other[3] != best[3])
    assert fit.runner_up is not None
    assert (fit.runner_up.rank, fit.runner_up.subset, fit.runner_up.dropped) == (
        rank,
        found[rank - 1][1],
        found[rank - 1][3],
    )
    assert fit.runner_up.d_n == pytest.approx(found[rank - 1][0], rel=1e-6)


@pytest.mark.filterwarnings("ignore:Optimal rotation is not uniquely:UserWarning")
@settings(max_examples=15, deadline=None)
@given(SEEDS, st.integers(6, 8), st.sampled_from([2.0, 6.0, 15.0]))
def test_small_random_tables_by_a_second_hand(seed, n, tau):
    rng = np.random.default_rng(seed)
    source = rng.uniform(-400, 400, (n, 3))
    reference = source + [10, 5, -3] + 3 * rng.normal(size=(n, 3))
    reference[0] += 30
    found = by_hand(source.tolist(), reference.tolist(), tau, 1)
    if not found:
        with pytest.raises(RegistrationError, match="smallest --tau"):
            fit_paper(source, reference, tau=tau, n_min=1)
        return
    fit = fit_paper(source, reference, tau=tau, n_min=1)
    assert (fit.subset, fit.inliers, fit.dropped) == found[0][1:]
    assert fit.d_n == pytest.approx(found[0][0], rel=1e-5, abs=1e-9)


def hand_made():
    """Eight exact spots, shifted by (5, 0, 0); three more are 20, 30 and 40 mm off."""
    source = np.array([(x, y, z) for x in (0, 300) for y in (0, 200) for z in (0, 100)], dtype=float)
    source = np.vstack([source, [[150, 50, 20], [90, 130, 60], [210, 20, 80]]])
    reference = source + [5.0, 0, 0]
    reference[8:] += [[0, 20, 0], [0, 0, 30], [40, 0, 0]]
    return source, reference


def test_a_hand_made_table_where_the_right_answer_is_known():
    fit = fit_paper(*hand_made(), tau=1.0, n_min=3)
    assert fit.dropped == (8, 9, 10)
    assert set(fit.subset) | set(fit.inliers) == set(range(8))
    assert fit.d_n == pytest.approx(0.0, abs=1e-18)
    np.testing.assert_allclose(fit.rotation, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(fit.translation, [5, 0, 0], atol=1e-9)
    np.testing.assert_allclose(fit.delta, [0] * 8 + [20, 30, 40], atol=1e-9)
    assert fit.runner_up is None  # a subset with a wrong spot in it has not four inliers


def test_n_min_is_exceeded_not_met():
    source, reference = hand_made()
    assert fit_paper(source, reference, tau=1.0, n_min=3).inliers  # four inliers outside a subset of four
    with pytest.raises(RegistrationError, match="more than 4 others"):
        fit_paper(source, reference, tau=1.0, n_min=4)


def test_residuals_count_by_their_largest_coordinate():
    source, reference = hand_made()
    reference[8] = source[8] + [5 + 0.75, 0.75, 0.75]  # 1.30 mm long, 0.75 mm by its largest coordinate
    fit = fit_paper(source, reference, tau=1e-6, n_min=3)
    assert fit.dropped == (8, 9, 10)
    np.testing.assert_allclose(fit.delta, [0] * 8 + [0.75, 30, 40], atol=1e-9)


def test_inliers_are_counted_outside_the_subset_alone(points):
    _, source, reference = points.rear_door()
    fit = fit_paper(source, reference, n_min=7)
    assert not set(fit.subset) & set(fit.inliers)
    assert len(fit.subset) + len(fit.inliers) + len(fit.dropped) == 14
    # The method never looks into its own subset: with N_min 7 it holds both spots whose names are exchanged.
    assert fit.beyond == (12, 13)
    assert fit.dropped == (10,)


def test_the_smallest_tau_that_would_do_does_and_a_little_less_does_not(points):
    _, source, reference = points.rear_door()
    with pytest.raises(RegistrationError) as caught:
        fit_paper(source, reference, tau=0.5)
    assert caught.value.code == "NO_SUBSET"
    said = float(str(caught.value).split("would do is ")[1].split(" mm")[0])
    assert len(fit_paper(source, reference, tau=said).inliers) == default_n_min(14) + 1
    with pytest.raises(RegistrationError, match="smallest --tau"):
        fit_paper(source, reference, tau=said - 0.0011)


def table(rng, n):
    source = rng.uniform(-1, 1, (n, 3)) * [600, 300, 200]
    reference = source + [40, -10, 5] + rng.normal(size=(n, 3))
    reference[: n // 4] += rng.uniform(-40, 40, (n // 4, 3))
    return source, reference


@settings(max_examples=25, deadline=None)
@given(SEEDS)
def test_moving_the_source_or_shifting_the_reference_or_renaming_its_axes_changes_nothing_else(points, seed):
    rng = np.random.default_rng(seed)
    source, reference = table(rng, 10)
    fit = fit_paper(source, reference, tau=8.0, n_min=2)
    turn, shift = points.random_motion(rng)
    axes = np.eye(3)[rng.permutation(3)] * rng.choice([-1.0, 1.0], 3)
    axes *= np.linalg.det(axes)
    other = rng.uniform(-500, 500, 3)
    moved = fit_paper(points.move(source, turn, shift), reference @ axes.T + other, tau=8.0, n_min=2)
    assert (moved.subset, moved.inliers, moved.dropped) == (fit.subset, fit.inliers, fit.dropped)
    assert moved.d_n == pytest.approx(fit.d_n, rel=1e-6, abs=1e-12)
    np.testing.assert_allclose(moved.rotation, axes @ fit.rotation @ np.transpose(turn), atol=1e-8)


def test_turning_the_reference_may_change_the_answer(points):
    """The largest coordinate difference depends on the axes: to the letter, and said in the module."""
    _, source, reference = points.rear_door()
    answers = {
        fit_paper(source, reference @ points.turn((1, 1, 1), angle).T, tau=10.0).dropped for angle in range(0, 120, 15)
    }
    assert len(answers) > 1


def test_random_subsets_same_seed_same_answer_and_right():
    rng = np.random.default_rng(3)
    source, reference = table(rng, 60)
    one, two = (fit_paper(source, reference, tau=6.0, seed=8) for _ in range(2))
    assert not one.exhaustive
    assert one.n_subsets == paper.TRIALS
    assert one.subset == two.subset
    assert np.array_equal(one.rotation, two.rotation)
    assert len(set(one.subset)) == 4
    assert fit_paper(source, reference, tau=6.0, seed=9).subset != one.subset
    assert not set(one.subset) & set(range(15))
    assert set(one.dropped) <= set(range(15))


def test_batches_change_nothing(monkeypatch):
    source, reference = table(np.random.default_rng(4), 12)
    whole = fit_paper(source, reference, tau=6.0)
    monkeypatch.setattr(paper, "_CELLS", 100)
    parts = fit_paper(source, reference, tau=6.0)
    assert (whole.subset, whole.d_n, whole.runner_up) == (parts.subset, parts.d_n, parts.runner_up)


def test_the_rotation_is_proper_even_for_a_mirrored_list():
    source, _ = table(np.random.default_rng(5), 8)
    fit = fit_paper(source, source * [1, -1, 1], tau=1e4, n_min=0)
    assert np.linalg.det(fit.rotation) == pytest.approx(1.0)


def test_subsets_on_a_line_are_left_out():
    source = np.array([(50.0 * k, 0, 0) for k in range(5)] + [(100, 300, 0), (150, 50, 200)])
    fit = fit_paper(source, source + 1.0, tau=1.0, n_min=1)
    assert fit.n_degenerate == math.comb(5, 4)
    assert not set(fit.subset) <= set(range(5))
    with pytest.raises(DegenerateError):
        fit_paper(source[:5], source[:5] + 1.0, tau=1.0, n_min=0)


@pytest.mark.parametrize(
    ("options", "code"),
    [
        ({"tau": 0.0}, "BAD_OPTION"),
        ({"tau": float("nan")}, "BAD_OPTION"),
        ({"n_min": -1}, "BAD_OPTION"),
        ({"n_min": 10}, "BAD_OPTION"),
        ({"subset_size": 3}, "BAD_OPTION"),
        ({"trials": 0}, "BAD_OPTION"),
        ({"subset_size": 14}, "TOO_FEW_PAIRS"),
    ],
)
def test_options_out_of_range_are_refused(points, options, code):
    with pytest.raises(RegistrationError) as caught:
        fit_paper(*points.rear_door()[1:], **options)
    assert caught.value.code == code


def published():
    return np.array([[float(word) for word in line.split()[1:]] for line in PUBLISHED.strip().splitlines()])


def test_the_published_coordinates_are_least_squares_over_all_spots_and_no_answer_of_the_method(points):
    _, source, reference = points.rear_door()
    plain = fit_rigid(source, reference).predict(source)
    assert np.abs(plain - published()).max() < 0.01
    assert np.linalg.norm(published() - reference, axis=1).mean() == pytest.approx(8.875, abs=0.001)
    for options in (
        {},
        {"tau": 12.0},
        {"n_min": 7},
        {"score": "mean-square"},
        {"tau": 40.0},
        {"tau": 40.0, "n_min": 9},
    ):
        fit = fit_paper(source, reference, **options)
        assert np.abs(source @ fit.rotation.T + fit.translation - published()).max() > 1.0


@pytest.mark.parametrize(
    ("options", "d_n", "dropped", "beyond"),
    [
        ({}, 0.587, (9, 12, 13), ()),
        ({"tau": 12.0}, 0.992, (12, 13), ()),
        ({"n_min": 7}, 0.746, (10,), (12, 13)),
        ({"score": "mean-square"}, 9.657, (10, 11, 12, 13), ()),
        ({"score": "mean-square", "n_min": 7}, 10.754, (12, 13), ()),
    ],
)
def test_the_table_of_the_samples_readme(points, options, d_n, dropped, beyond):
    fit = fit_paper(*points.rear_door()[1:], **options)
    assert fit.d_n == pytest.approx(d_n, abs=0.0006)
    assert (fit.dropped, fit.beyond) == (dropped, beyond)
