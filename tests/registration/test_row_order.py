"""Seeded draws know nothing of how a table is sorted, nor of the frame it stands in."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from respot.registration.consensus import consensus_transform
from respot.registration.exchanged import find_exchanged
from respot.registration.row_order import own_order
from respot.registration.support import rotation_p_value_by_axis, rotation_support

SEEDS = st.integers(0, 2**32 - 1)


def cloud(rng, n):
    source = rng.uniform(-1, 1, (n, 3)) * [800, 400, 600]
    return source, source + rng.normal(size=(n, 3)) * [0.5, 5, 2]


@settings(max_examples=20, deadline=None)
@given(SEEDS)
def test_rows_find_back_to_one_order(points, seed):
    rng = np.random.default_rng(seed)
    source, reference = cloud(rng, 30)
    source[3], source[4] = source[5], source[5]  # distances that agree
    shuffle = rng.permutation(30)
    order, again = own_order(source, reference), own_order(source[shuffle], reference[shuffle])
    assert np.array_equal(source[order], source[shuffle][again])
    assert np.array_equal(reference[order], reference[shuffle][again])


@settings(max_examples=8, deadline=None)
@given(SEEDS)
def test_the_p_value_of_a_rotation(points, seed):
    rng = np.random.default_rng(seed)
    source, reference = cloud(rng, 12)
    p_value = rotation_p_value_by_axis(source, reference)
    shuffle = rng.permutation(12)
    assert rotation_p_value_by_axis(source[shuffle], reference[shuffle]) == p_value
    motion = points.random_motion(rng)
    assert rotation_p_value_by_axis(points.move(source, *motion), points.move(reference, *motion)) == p_value


def test_the_p_value_of_many_spots_is_the_limit_of_the_shuffles(points):
    rng = np.random.default_rng(8)
    p_values = []
    for _ in range(60):
        source, reference = cloud(rng, 5001)
        p_values.append(rotation_p_value_by_axis(source, reference))
    assert 15 <= np.sum(np.array(p_values) < 0.5) <= 45
    assert rotation_p_value_by_axis(source, points.move(reference, points.turn((0, 1, 0), 0.02), (0, 0, 0))) < 1e-3


def test_exchanged_names_and_their_evidence(points):
    ids, source, reference = points.rear_door()
    first = find_exchanged(ids, source, reference)
    support = rotation_support(source, reference)
    for seed in range(5):
        shuffle = np.random.default_rng(seed).permutation(14)
        again = find_exchanged([ids[row] for row in shuffle], source[shuffle], reference[shuffle])
        assert [set(cycle.ids) for cycle in again.cycles] == [set(cycle.ids) for cycle in first.cycles]
        assert [cycle.p_value for cycle in again.cycles] == [cycle.p_value for cycle in first.cycles]
        assert np.array_equal(again.robust.inliers, first.robust.inliers[shuffle])
        assert rotation_support(source[shuffle], reference[shuffle]).p_value_by_axis == support.p_value_by_axis


@settings(max_examples=15, deadline=None)
@given(SEEDS)
def test_the_consensus_start_moves_with_the_points(points, seed):
    rng = np.random.default_rng(seed)
    source, reference = cloud(rng, 40)
    reference[:15] += rng.uniform(-300, 300, (15, 3))
    rotation, translation = consensus_transform(source, reference, seed=3)
    shuffle, (turn, shift) = rng.permutation(40), points.random_motion(rng)
    moved = points.move(reference, turn, shift)
    other, other_translation = consensus_transform(source[shuffle], moved[shuffle], seed=3)
    np.testing.assert_allclose(other, turn @ rotation, atol=1e-9)
    np.testing.assert_allclose(other_translation, turn @ translation + shift, atol=1e-6)
