from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from respot.registration.exchanged import find_exchanged
from respot.registration.matching import match_by_id, match_by_name

SEEDS = st.integers(0, 2**32 - 1)
CLEAN, FLANGE = (0.3, 0.3, 0.3), (0.5, 4.9, 1.7)


def test_match_by_id_counts_everything():
    match = match_by_id(["b", "a", "x", "d", "d"], ["a", "b", "c", "c", "d"])
    assert match.ids == ("b", "a")
    assert match.source_rows.tolist() == [0, 1]
    assert match.reference_rows.tolist() == [1, 0]
    assert match.missing == ("x",)
    assert match.extra == ("c",)
    assert match.source_duplicates == ("d",)
    assert match.reference_duplicates == ("c",)
    assert (match.n_source, match.n_reference) == (5, 5)


def test_match_by_id_is_exact_and_may_be_empty():
    match = match_by_id(["P1"], ["p1"])
    assert match.ids == ()
    assert match.source_rows.dtype.kind == "i"


def names(n):
    return [f"S{k:03d}" for k in range(n)]


def found(source, reference):
    return {tuple(sorted(cycle.rows)) for cycle in find_exchanged(names(len(source)), source, reference).cycles}


def test_the_rear_door(points):
    ids, source, reference = points.rear_door()
    (cycle,) = find_exchanged(ids, source, reference).cycles
    assert cycle.ids == points.SWAPPED
    assert cycle.loo_before == pytest.approx(16.50, abs=0.005)
    assert cycle.loo_after == pytest.approx(5.78, abs=0.005)
    assert cycle.members_after < 0.25 * cycle.members_before
    assert 0.001 <= cycle.p_value <= 0.02  # two of 182 placements of these two residuals look like an exchange
    assert find_exchanged(ids, *points.repaired()[1:]).cycles == ()


def test_every_other_pair_of_the_rear_door_after_a_random_motion(points):
    _, source, reference = points.repaired()
    rng = np.random.default_rng(20)
    for pair in combinations(range(14), 2):
        other = points.move(reference, *points.random_motion(rng))
        other[list(pair)] = other[list(pair[::-1])]
        assert found(points.move(source, *points.random_motion(rng)), other) == {pair}


@settings(max_examples=30, deadline=None)
@given(SEEDS, st.integers(1, 3))
def test_separate_exchanges_are_all_found(points, seed, count):
    rng = np.random.default_rng(seed)
    source = np.array([(x, y, z) for x in (0, 150, 300) for y in (0, 200, 400) for z in (0, 250)], float)
    source += rng.uniform(-40, 40, source.shape)
    reference = points.move(source, *points.random_motion(rng)) + 0.3 * rng.normal(size=source.shape)
    pairs = rng.permutation(len(source))[: 2 * count].reshape(-1, 2)
    for i, j in pairs:
        reference[[i, j]] = reference[[j, i]]
    assert found(source, reference) == {tuple(sorted(map(int, pair))) for pair in pairs}


def test_names_passed_round_are_one_cycle_and_said_in_order(points):
    _, source, reference = points.repaired()
    reference = reference.copy()
    reference[[0, 4, 9]] = reference[[9, 0, 4]]  # the place of 0 now carries the name of 4, and so on
    result = find_exchanged(names(14), source, reference)
    (cycle,) = result.cycles
    assert cycle.rows == (0, 4, 9)
    np.testing.assert_allclose(reference[result.permutation], points.repaired()[2])


def layout(rng, n, kind):
    if kind == "box":
        return rng.uniform(-1, 1, (n, 3)) * [800, 400, 600]
    along = np.sort(rng.uniform(-600, 600, n))
    return np.stack([5 * rng.normal(size=n), along, np.where(np.arange(n) % 3, 0.0, 300.0)], axis=1)


@pytest.mark.parametrize("kind", ["box", "flange"])
@pytest.mark.parametrize("noise", [CLEAN, FLANGE])
@pytest.mark.parametrize("n", [6, 14, 40, 100])
def test_noise_alone_never_fires(kind, noise, n):
    rng = np.random.default_rng(30)
    alarms = 0
    for _ in range(100):
        source = layout(rng, n, kind)
        alarms += bool(found(source, source + 60.0 + noise * rng.normal(size=(n, 3))))
    assert alarms == 0


@pytest.mark.parametrize("kind", ["box", "flange"])
@pytest.mark.parametrize("length", [5, 15, 40])
@pytest.mark.parametrize("opposite", [False, True])
def test_two_displaced_spots_are_not_exchanged_spots(kind, length, opposite):
    rng = np.random.default_rng(31)
    alarms = 0
    for _ in range(100):
        source = layout(rng, 14, kind)
        reference = source + [0.5, 1.5, 1.0] * rng.normal(size=(14, 3))
        i, j = rng.choice(14, 2, replace=False)
        for row, sign in ((i, 1), (j, -1)):
            direction = np.array([0, sign, 0]) if opposite else rng.normal(size=3)
            reference[row] += length * direction / np.linalg.norm(direction)
        alarms += bool(found(source, reference))
    assert alarms <= 1  # opposite shifts along a flange, as long as the two are apart, are the same table


def test_near_neighbours_are_left_alone():
    source = layout(np.random.default_rng(32), 12, "box")
    source[1] = source[0] + [0.6, 0, 0]
    reference = source + 0.3 * np.random.default_rng(33).normal(size=source.shape)
    reference[[0, 1]] = reference[[1, 0]]
    assert found(source, reference) == set()


def test_too_few_witnesses_leave_names_alone():
    source = layout(np.random.default_rng(34), 5, "box")
    reference = source.copy()
    reference[[0, 1]] = reference[[1, 0]]
    assert found(source, reference) == set()


def test_a_displaced_spot_does_not_hide_an_exchange():
    rng = np.random.default_rng(35)
    source = layout(rng, 14, "box")
    reference = source + 0.3 * rng.normal(size=source.shape)
    reference[[2, 9]] = reference[[9, 2]]
    reference[5] += [0, 37, 0]
    assert found(source, reference) == {(2, 9)}


@pytest.mark.parametrize(
    ("own", "other", "rule"),
    [
        ("P02WP1615438", "p02wp1615438", "case or separators"),
        ("P02-WP_1615438", "P02WP1615438", "case or separators"),
        ("P1_2", "P1-2", "case or separators"),
        ("P02WP15", "P2WP0015", "leading zeros"),
        ("SP_7_1", "SP_7", "variant"),
        ("SP7", "SP7_new", "variant"),
    ],
)
def test_the_same_name_written_otherwise(own, other, rule):
    match = match_by_name(["Q1", own, "Q9"], ["Z4", other, "Q1"])
    assert (match.ids, match.reference_ids, match.rules) == (("Q1", own), ("Q1", other), ("", rule))
    assert (match.missing, match.extra) == (("Q9",), ("Z4",))


@pytest.mark.parametrize(
    ("own", "other"),
    [
        ("P1_2", "P12"),  # two numbers are not one
        ("SP_7", "SP_9"),  # two spots, not two variants
        ("SP_L", "SP_R"),
        ("SP", "SP_L"),
        ("WP1", "WP10"),
    ],
)
def test_names_that_only_look_alike_stay_apart(own, other):
    assert match_by_name([own], [other]).ids == ()


def test_a_prefix_or_suffix_that_a_whole_list_has():
    plain = ["WP10", "WP20", "WP30", "WP40"]
    match = match_by_name([f"020R01_{name}" for name in plain], plain)
    assert match.reference_ids == tuple(plain)
    assert set(match.rules) == {"prefix or suffix"}
    match = match_by_name(plain, [f"{name}_GEO" for name in plain])
    assert match.ids == tuple(plain)
    assert match_by_name(plain[:2], [f"A{name}" for name in plain[:2]]).ids == ()  # two names make no rule
    assert match_by_name(["5", "6", "7"], ["15", "16", "17"]).ids == ()  # nor is a number ever cut in two


def test_a_rule_never_chooses_between_two_names():
    match = match_by_name(["SP7_1", "SP7_2"], ["SP7"])
    assert match.ids == ()
    assert match.missing == ("SP7_1", "SP7_2")
    assert match_by_name(["p1", "P1"], ["P1"]).ids == ("P1",)  # the equal name comes first, and takes it
    assert match_by_name(["p1", "P01"], ["P001"]).ids == ()


def test_an_equal_name_is_never_given_up_for_a_rule():
    match = match_by_name(["A1", "a1"], ["a1", "A1"])
    assert match.reference_ids == ("A1", "a1")
    assert match.rules == ("", "")
