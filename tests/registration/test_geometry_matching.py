"""Pairs by place alone: bodies and noise are made here, the right pairs are known before."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from respot.registration.errors import RegistrationError
from respot.registration.geometry_matching import match_by_geometry

SEEDS = st.integers(0, 2**32 - 1)


def body(rng, n, kind):
    if kind == "box":
        return rng.uniform(-1, 1, (n, 3)) * [800, 400, 600]
    u, v = rng.uniform(-600, 600, n), rng.uniform(-400, 400, n)
    return np.stack([60 * np.cos(u / 400) + 20 * np.sin(v / 150), u, v], axis=1)


def lists(points, rng, n, kind, noise, lost=0.3):
    """Source, reference with 30 % of the spots lost and as many others, and the reference row of each source spot."""
    source = body(rng, n, kind)
    kept = rng.permutation(n)[: round((1 - lost) * n)]
    others = np.vstack([source[kept], body(rng, n - len(kept), kind)])
    order = rng.permutation(len(others))
    truth = np.full(n, -1)
    truth[kept] = np.argsort(order)[: len(kept)]
    moved = points.move(others[order], *points.random_motion(rng))
    return source, moved + noise * rng.normal(size=moved.shape), truth


def code_of(source, reference, **options):
    try:
        match_by_geometry(source, reference, **options)
    except RegistrationError as error:
        return error.code
    return "MATCH"


@pytest.mark.parametrize("kind", ["box", "panel"])
@pytest.mark.parametrize("noise", [1.0, 5.0, 10.0])
@pytest.mark.parametrize(("n", "trials"), [(14, 12), (40, 4)])
def test_share_of_right_assignments(points, kind, noise, n, trials):
    rng = np.random.default_rng(50)
    right = wrong = 0
    for seed in range(trials):
        source, reference, truth = lists(points, rng, n, kind, noise)
        best = match_by_geometry(source, reference, seed=seed).best
        agree = truth[best.source_rows] == best.reference_rows
        right += int(agree.sum()) / int((truth >= 0).sum())
        wrong += bool(agree.mean() < 0.5)
    assert wrong == 0
    assert right / trials >= (0.9 if noise == 10.0 else 0.95)


def test_a_hundred_spots_among_strangers(points):
    source, reference, truth = lists(points, np.random.default_rng(51), 100, "box", 5.0)
    best = match_by_geometry(source, reference).best
    assert np.mean(truth[best.source_rows] == best.reference_rows) > 0.95


@settings(max_examples=8, deadline=None)
@given(SEEDS)
def test_order_and_frames_play_no_part(points, seed):
    rng = np.random.default_rng(seed)
    source = body(rng, 12, "box")
    own, other = rng.permutation(12), rng.permutation(12)
    moved = points.move(source, *points.random_motion(rng))
    best = match_by_geometry(points.move(source, *points.random_motion(rng))[own], moved[other]).best
    assert np.array_equal(own[best.source_rows], other[best.reference_rows])
    assert len(best.source_rows) == 12
    np.testing.assert_allclose(best.lengths, 0.0, atol=1e-6)


def test_same_seed_same_answer(points):
    source, reference, _ = lists(points, np.random.default_rng(52), 14, "panel", 5.0)
    one, two = (match_by_geometry(source, reference, seed=3) for _ in range(2))
    assert np.array_equal(one.best.reference_rows, two.best.reference_rows)
    assert one.rivalry == two.rivalry


def test_the_rear_door_is_paired_right_without_its_names(points):
    """All 14, the two exchanged names among them; turned by half a turn the door lies nearly on itself."""
    _, source, reference = points.rear_door()
    order = np.random.default_rng(53).permutation(14)
    right = np.array([*range(12), 13, 12])
    for same_frame in (False, True):
        found = match_by_geometry(source, reference[order], same_frame=same_frame)
        assert np.array_equal(order[found.best.reference_rows], right)
        assert found.runner_up is not None
        assert 0.5 < found.rivalry < 0.7


@pytest.mark.parametrize("kind", ["box", "panel"])
@pytest.mark.parametrize("n", [8, 14, 40])
def test_two_different_parts_are_never_matched(points, kind, n):
    rng = np.random.default_rng(54)
    codes = [code_of(body(rng, n, kind), points.move(body(rng, n, kind), *points.random_motion(rng))) for _ in range(8)]
    assert set(codes) <= {"NOT_CONGRUENT", "AMBIGUOUS_MATCH"}


@pytest.mark.parametrize("seed", [5, 67, 75, 338])
def test_a_few_spots_that_agree_loosely_are_chance(seed):
    """Without this rule 26 of 400 pairs of different small parts of 8 spots are matched."""
    rng = np.random.default_rng(seed)
    with pytest.raises(RegistrationError, match="two different parts would do as well"):
        match_by_geometry(body(rng, 8, "panel") / 2, body(rng, 8, "panel") / 2)


def test_rows_of_equal_pitch_are_refused_with_the_runner_up():
    source = np.array([(0, 50.0 * i, 300.0 * j) for i in range(10) for j in range(2)])
    with pytest.raises(RegistrationError, match=r"two placements are as good.*degrees and \d+ mm away") as caught:
        match_by_geometry(source, source + [60, 20, 5], same_frame=True)
    assert caught.value.code == "AMBIGUOUS_MATCH"


@pytest.mark.parametrize(("irregular", "noise"), [(0.0, 1.0), (3.0, 1.0), (3.0, 5.0), (10.0, 3.0)])
def test_rows_of_nearly_equal_pitch_are_matched_right_or_not_at_all(points, irregular, noise):
    rng = np.random.default_rng(55)
    for seed in range(8):
        whole = np.array([(0, 50.0 * i, 300.0 * j) for i in range(16) for j in range(2)])
        whole += irregular * rng.normal(size=whole.shape)
        own, other = rng.permutation(32)[:24], rng.permutation(32)[:24]
        moved = points.move(whole, *points.random_motion(rng)) + noise * rng.normal(size=whole.shape)
        try:
            best = match_by_geometry(whole[own], moved[other], seed=seed).best
        except RegistrationError as error:
            assert error.code in {"AMBIGUOUS_MATCH", "NOT_CONGRUENT"}
        else:
            assert np.mean(own[best.source_rows] == other[best.reference_rows]) > 0.9


def mirrored(rng, depth, n=8):
    return np.stack([depth * rng.normal(size=n), rng.uniform(50, 600, n), rng.uniform(-300, 300, n)], axis=1)


def test_a_mirror_symmetric_part_is_matched_in_the_same_frame_alone():
    half = mirrored(np.random.default_rng(56), 0.0)
    part = np.vstack([half, half * [1, -1, 1]])
    assert code_of(part, part + [40, 10, 5]) == "AMBIGUOUS_MATCH"  # flat: half a turn lays it on itself
    best = match_by_geometry(part, part + [40, 10, 5], same_frame=True).best
    assert np.array_equal(best.source_rows, best.reference_rows)


@pytest.mark.parametrize("depth", [20.0, 100.0])
def test_the_left_part_is_not_the_right_one(points, depth):
    rng = np.random.default_rng(57)
    for _ in range(6):
        part = mirrored(rng, depth, 14)
        other = points.move(part * [1, -1, 1], *points.random_motion(rng)) + rng.normal(size=part.shape)
        assert code_of(part, other) in {"NOT_CONGRUENT", "AMBIGUOUS_MATCH"}
    with pytest.raises(RegistrationError, match="mirror image"):
        match_by_geometry(
            mirrored(np.random.default_rng(1), 100.0, 14), mirrored(np.random.default_rng(1), 100.0, 14) * [1, -1, 1]
        )


def test_neighbours_within_the_noise_are_doubtful():
    rng = np.random.default_rng(58)
    source = body(rng, 14, "box")
    source[1] = source[0] + [6.0, 0, 0]
    found = match_by_geometry(source, source + 3.0 * rng.normal(size=source.shape))
    assert set(found.doubtful) >= {0, 1}
    assert len(found.doubtful) <= 4


def test_too_few_and_too_many():
    spots = body(np.random.default_rng(59), 14, "box")
    assert code_of(spots[:3], spots) == "TOO_FEW_PAIRS"
    assert code_of(np.zeros((2001, 3)), spots) == "TOO_MANY_SPOTS"


@pytest.mark.parametrize("kind", ["box", "panel"])
def test_long_lists_are_looked_up_in_cells_and_matched_as_well(points, kind):
    rng = np.random.default_rng(60)
    source, reference, truth = lists(points, rng, 300, kind, 2.0)
    best = match_by_geometry(source, reference).best
    assert np.mean(truth[best.source_rows] == best.reference_rows) > 0.95
    assert len(best.source_rows) >= 200


@pytest.mark.parametrize("far", [1e6, 1e12])
def test_one_spot_far_off_hides_nothing(points, far):
    """Cells over its distance would hold the whole part."""
    source, reference, truth = lists(points, np.random.default_rng(61), 120, "box", 1.0)
    strangers = np.flatnonzero(~np.isin(np.arange(120), truth))
    reference[strangers[0]] += [far, far, far]
    best = match_by_geometry(source, reference).best
    assert np.mean(truth[best.source_rows] == best.reference_rows) > 0.95


def test_long_lists_of_different_parts_are_never_matched():
    rng = np.random.default_rng(62)
    assert code_of(body(rng, 150, "box"), body(rng, 150, "box")) == "NOT_CONGRUENT"
