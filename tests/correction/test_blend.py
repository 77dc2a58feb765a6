"""Shifts along a path: laws that hold for every path."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from respot.correction.blend import BESIDE, PLATEAU_MM, PLATEAU_SHARE, BlendedPath

quick = settings(max_examples=60, deadline=None)


def drawn(seed: int, points: int = 25, step: float = 60.0):
    """A path, some of whose points are welds, and what they are shifted by."""
    rng = np.random.default_rng(seed)
    places = np.cumsum(rng.normal(scale=step, size=(points, 3)), axis=0)
    welds = np.sort(rng.choice(points, rng.integers(1, 7), replace=False))
    return places, welds, rng.normal(scale=3.0, size=(len(welds), 3))


def length_of(places) -> np.ndarray:
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=1))])


@quick
@given(st.integers(0, 10_000))
def test_welds_get_their_own_shift(seed):
    places, welds, values = drawn(seed)
    np.testing.assert_array_equal(BlendedPath(places, welds).shifts(welds, values)[welds], values)


@quick
@given(st.integers(0, 10_000))
def test_points_on_a_plateau_keep_their_way_to_the_weld(seed):
    places, welds, values = drawn(seed)
    found, length = BlendedPath(places, welds).shifts(welds, values), length_of(places)
    for row in range(len(places)):
        before, after = welds[welds <= row], welds[welds >= row]
        gap = length[after[0]] - length[before[-1]] if len(before) and len(after) else np.inf
        reach = min(PLATEAU_MM, PLATEAU_SHARE * gap)
        if len(before) and length[row] - length[before[-1]] <= reach:
            np.testing.assert_allclose(found[row], values[list(welds).index(before[-1])], atol=1e-12)
        if len(after) and length[after[0]] - length[row] <= reach:
            np.testing.assert_allclose(found[row], values[list(welds).index(after[0])], atol=1e-12)


@quick
@given(st.integers(0, 10_000))
def test_no_point_is_shifted_further_than_the_larger_of_its_welds(seed):
    places, welds, values = drawn(seed)
    found = BlendedPath(places, welds).shifts(welds, values)
    sizes = np.linalg.norm(values, axis=1)
    for row in range(len(places)):
        last = np.searchsorted(welds, row, side="right") - 1
        following = np.searchsorted(welds, row, side="left")
        near = sizes[[max(last, 0), min(following, len(welds) - 1)]]
        assert np.linalg.norm(found[row]) <= near.max() + 1e-12


@quick
@given(st.integers(0, 10_000))
def test_the_path_run_backwards_gets_the_same_shifts(seed):
    places, welds, values = drawn(seed)
    there = BlendedPath(places, welds).shifts(welds, values)
    back = BlendedPath(places[::-1], len(places) - 1 - welds[::-1]).shifts(len(places) - 1 - welds[::-1], values[::-1])
    np.testing.assert_allclose(there, back[::-1], atol=1e-9)


@quick
@given(st.integers(0, 10_000))
def test_shifts_change_steadily_and_level_out_at_the_plateaus(seed):
    """Of two welds on a straight way of many points: no step is larger than the cubic's steepest, and it starts level."""
    rng = np.random.default_rng(seed)
    gap, points = rng.uniform(50.0, 2000.0), 2001
    places = np.linspace(0.0, gap, points)[:, None] * np.array([1.0, 0.0, 0.0])
    values = rng.normal(scale=3.0, size=(2, 3))
    found = BlendedPath(places, np.array([0, points - 1])).shifts(np.array([0, points - 1]), values)
    whole = float(np.linalg.norm(values[1] - values[0]))
    steps = np.linalg.norm(np.diff(found, axis=0), axis=1)
    room = gap - 2.0 * min(PLATEAU_MM, PLATEAU_SHARE * gap)
    assert steps.max() <= 1.5 * whole / room * gap / (points - 1) * (1.0 + 1e-9)
    assert steps.sum() == pytest.approx(whole)
    turns = np.linalg.norm(np.diff(found, 2, axis=0), axis=1)
    assert turns.max() <= 6.0 * whole * (gap / (points - 1) / room) ** 2 * (1.0 + 1e-6)


@quick
@given(st.integers(0, 10_000), st.integers(0, 24))
def test_another_given_point_is_kept_and_plateaus_too(seed, row):
    places, welds, values = drawn(seed)
    path = BlendedPath(places, welds)
    if row in welds:
        return
    fixed = np.sort(np.append(welds, row))
    given_ = np.insert(values, np.searchsorted(welds, row), [9.0, 9.0, 9.0], axis=0)
    found, alone = path.shifts(fixed, given_), path.shifts(welds, values)
    np.testing.assert_array_equal(found[fixed], given_)
    beside = np.flatnonzero(path.ranks == BESIDE)
    kept = beside[beside != row]
    np.testing.assert_allclose(found[kept], alone[kept], atol=1e-12)


@pytest.mark.parametrize("backwards", [False, True])
def test_what_lies_between_a_weld_and_a_given_point_on_its_plateau_stays_with_the_weld(backwards):
    y = np.array([0.0, 40.0, 60.0, 80.0, 1000.0])
    fixed, values = np.array([0, 3, 4]), np.array([[1.0, 0.0, 0.0], [0.0, 5.0, 0.0], [0.0, 0.0, 2.0]])
    if backwards:
        y, fixed, values = -y[::-1], 4 - fixed[::-1], values[::-1]
    found = BlendedPath(y[:, None] * np.array([0.0, 1.0, 0.0]), fixed[[0, 2]]).shifts(fixed, values)
    for row in [2, 3] if backwards else [1, 2]:
        np.testing.assert_array_equal(found[row], [1.0, 0.0, 0.0])


def test_ranks():
    """Two welds 400 mm apart, points every 50 mm, one 200 mm behind."""
    x = np.array([-50.0, 0.0, 50.0, 100.0, 150.0, 400.0, 600.0])
    path = BlendedPath(x[:, None] * np.array([0.0, 1.0, 0.0]), np.array([1, 5]))
    assert path.ranks.tolist() == [1, 0, 1, 2, 3, 0, 3]
