"""The consensus start: half of the pairs wrong, flat and thin triples, and what it may not depend on."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from respot.registration.consensus import consensus_transform
from respot.registration.rigid import fit_rigid

SEEDS = st.integers(0, 2**32 - 1)


def table(rng, n, bad, noise=0.3):
    source = rng.uniform(-1, 1, (n, 3)) * [800, 400, 600] + [4000, 0, 1200]
    wrong = rng.permutation(n)[: round(bad * n)]
    return source, wrong, noise * rng.normal(size=(n, 3))


@settings(max_examples=25, deadline=None)
@given(SEEDS, st.sampled_from([4, 7, 19, 60, 300, 1000, 2500]))
def test_it_finds_the_motion_that_half_of_the_pairs_share(points, seed, n):
    rng = np.random.default_rng(seed)
    source, wrong, noise = table(rng, n, 0.5 if n > 19 else 0.0)
    rotation, shift = points.random_motion(rng)
    true = points.move(source, rotation, shift)
    reference = true + noise
    reference[wrong] += rng.normal(size=(len(wrong), 3)) * 300
    found, translation = consensus_transform(source, reference, seed=1)
    assert np.linalg.norm(source @ found.T + translation - true, axis=1).max() < 3.0
    np.testing.assert_allclose(found @ found.T, np.eye(3), atol=1e-9)
    assert np.linalg.det(found) == pytest.approx(1.0)


def test_four_pairs_have_to_agree_all_and_get_least_squares():
    rng = np.random.default_rng(1)
    for _ in range(20):
        source = rng.uniform(-500, 500, (4, 3))
        reference = source + rng.normal(size=(4, 3))
        rotation, translation = consensus_transform(source, reference, seed=0)
        fit = fit_rigid(source, reference)
        np.testing.assert_allclose(rotation, fit.rotation, atol=1e-9)
        np.testing.assert_allclose(translation, fit.translation, atol=1e-6)


def test_few_trials_do_as_well_where_they_are_enough():
    rng = np.random.default_rng(2)
    source, wrong, noise = table(rng, 1000, 0.3)
    reference = source + [10, 20, 30] + noise
    reference[wrong] += rng.normal(size=(len(wrong), 3)) * 30
    for trials in (40, 87, 1000):
        rotation, translation = consensus_transform(source, reference, seed=3, trials=trials)
        assert np.linalg.norm(source @ rotation.T + translation - source - [10, 20, 30], axis=1).max() < 0.3


@pytest.mark.parametrize("n", [12, 400])
def test_rows_on_a_line_are_no_trap(n):
    """Most triples are lines and say nothing; those that are not decide."""
    rng = np.random.default_rng(4)
    source = np.outer(np.linspace(0, 900, n), [1.0, 0.0, 0.0])
    source[::4] += [0, 300, 80]
    rotation, translation = consensus_transform(source, source + 0.01 * rng.normal(size=(n, 3)), seed=0)
    assert np.abs(source @ rotation.T + translation - source).max() < 0.1
    alone = np.outer(np.linspace(0, 900, n), [1.0, 2.0, 3.0])
    rotation, translation = consensus_transform(alone, alone + 1.0, seed=0)
    np.testing.assert_allclose(alone @ rotation.T + translation, alone + 1.0, atol=1e-6)
    for same in (np.ones((n, 3)), np.zeros((n, 3))):  # all spots in one place
        rotation, translation = consensus_transform(same, same, seed=0)
        np.testing.assert_allclose(same @ rotation.T + translation, same, atol=1e-9)


def test_a_spot_a_thousand_kilometres_off_costs_no_digits():
    rng = np.random.default_rng(5)
    source = rng.uniform(-500, 500, (60, 3))
    reference = source + [1, 2, 3]
    reference[7] += 1e9
    source[11] -= 1e9
    rotation, translation = consensus_transform(source, reference, seed=0)
    good = np.delete(np.arange(60), [7, 11])
    np.testing.assert_allclose(source[good] @ rotation.T + translation, reference[good], atol=1e-3)


@settings(max_examples=20, deadline=None)
@given(SEEDS, st.sampled_from([30, 260, 1100]), st.integers(0, 100))
def test_seed_and_rows(seed, n, draw):
    rng = np.random.default_rng(seed)
    source, wrong, noise = table(rng, n, 0.3)
    reference = source + noise
    reference[wrong] += rng.normal(size=(len(wrong), 3)) * 30
    order = rng.permutation(n)
    one = consensus_transform(source, reference, seed=draw)
    again = consensus_transform(source, reference, seed=draw)
    other = consensus_transform(source[order], reference[order], seed=draw)
    for a, b, c in zip(one, again, other, strict=True):
        assert np.array_equal(a, b)
        assert np.array_equal(a, c)
