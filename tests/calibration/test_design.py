"""The choice of spots: laws of what a spot adds, whatever the model."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from respot.calibration.planning.design import Design, Question, whitened

SPOTS = 7
WIDTH = 5
slow = settings(max_examples=25, deadline=None)


def drawn(seed: int, spots: int = SPOTS, width: int = WIDTH):
    """A normal matrix of what is known, columns at the spots, and a field that the columns do not hold."""
    rng = np.random.default_rng(seed)
    known = rng.normal(size=(12, width)) * 10.0 ** rng.uniform(-2, 2, width)
    normal = known.T @ known
    rows = rng.normal(size=(spots, 3, width)) * np.sqrt(np.diag(normal)) / 4.0
    return normal, rows, rng.normal(size=(spots, 3))


def questions(seed: int):
    normal, rows, field = drawn(seed)
    turned, _ = whitened(normal, rows)
    return [Question(turned, field, 1.5), Question(turned, np.zeros_like(field), estimation=True)]


def left_by_hand(normal, rows, field, chosen) -> float:
    """What the best imitation leaves, with what is known as rows of a square root of its normal matrix."""
    root = np.linalg.cholesky(normal).T
    design = np.vstack([root, rows[chosen].reshape(-1, rows.shape[2])])
    wanted = np.concatenate([np.zeros(len(root)), field[chosen].ravel()])
    scale = np.linalg.norm(design, axis=0)
    answer = np.linalg.lstsq(design / scale, wanted, rcond=None)[0]
    return float(np.sum((wanted - design / scale @ answer) ** 2))


@slow
@given(st.integers(0, 10_000), st.lists(st.integers(0, SPOTS - 1), min_size=1, max_size=SPOTS, unique=True))
def test_squares_are_those_of_plain_least_squares(seed, chosen):
    normal, rows, field = drawn(seed)
    question = Question(whitened(normal, rows)[0], field)
    for row in chosen:
        question.change(row, 1.0)
    assert question.found == pytest.approx(left_by_hand(normal, rows, field, chosen), rel=1e-6, abs=1e-9)
    everything = left_by_hand(normal, rows, field, list(range(SPOTS)))
    assert Question(whitened(normal, rows)[0], field).with_all() == pytest.approx(everything, rel=1e-6)


@slow
@given(st.integers(0, 10_000), st.integers(0, SPOTS - 1), st.integers(0, SPOTS - 1))
def test_a_spot_that_is_taken_out_again_leaves_nothing(seed, kept, row):
    one, other = questions(seed)[0], questions(seed)[0]
    for each in (kept, row):
        one.change(each, 1.0)
    one.change(row, -1.0)
    other.change(kept, 1.0)
    assert one.found == pytest.approx(other.found, rel=1e-8, abs=1e-9)
    np.testing.assert_allclose(one.spread, other.spread, atol=1e-8)
    np.testing.assert_allclose(one.error, other.error, atol=1e-8)


@slow
@given(st.integers(0, 10_000), st.integers(0, SPOTS - 1))
def test_a_duplicate_helps_no_more_than_a_repeat_and_less_than_the_first_time(seed, row):
    normal, rows, field = drawn(seed)
    twice = np.concatenate([rows, rows[row : row + 1]]), np.concatenate([field, field[row : row + 1]])
    turned, _ = whitened(normal, twice[0])
    asked = [Question(turned, twice[1]), Question(turned, np.zeros_like(twice[1]), estimation=True)]
    design = Design(asked, [0.0, 0.0])
    first = design.worth()
    assert first[row] == pytest.approx(first[-1])
    repeated = Question(turned, twice[1])
    repeated.change(row, 1.0)
    once = repeated.found
    repeated.change(row, 1.0)
    design.in_order([row])
    again = design.worth()[-1]
    assert again <= first[row] + 1e-9
    design.in_order([SPOTS])
    assert design.squares[0] == pytest.approx(repeated.found)
    assert repeated.found - once <= once + 1e-9


@slow
@given(st.integers(0, 10_000), st.integers(1, 4))
def test_no_single_exchange_makes_a_choice_better(seed, count):
    design = Design(questions(seed), [0.0, 0.0])
    rows = design.choose(count)
    assert len(set(rows)) == count
    best = total(seed, rows)
    for row in rows:
        for other in set(range(SPOTS)) - set(rows):
            assert total(seed, [other if each == row else each for each in rows]) <= best + 1e-6


@slow
@given(st.integers(0, 10_000))
def test_a_choice_of_three_is_nearly_the_best_of_all(seed):
    best = max(total(seed, list(rows)) for rows in combinations(range(SPOTS), 3))
    assert total(seed, Design(questions(seed), [0.0, 0.0]).choose(3)) >= 0.9 * best


@slow
@given(st.integers(0, 10_000), st.randoms(use_true_random=False))
def test_candidates_may_come_in_any_order(seed, random):
    normal, rows, field = drawn(seed)
    order = list(range(SPOTS))
    random.shuffle(order)

    def chosen(places):
        turned, _ = whitened(normal, rows[places])
        asked = [Question(turned, field[places]), Question(turned, np.zeros((SPOTS, 3)), estimation=True)]
        return {places[row] for row in Design(asked, [0.0, 0.0]).choose(3)}

    one, other = chosen(list(range(SPOTS))), chosen(order)
    assert total(seed, sorted(one)) == pytest.approx(total(seed, sorted(other)), rel=1e-6)


def total(seed: int, rows) -> float:
    """What some spots are worth together: as a design adds it up."""
    design = Design(questions(seed), [0.0, 0.0])
    worth = 0.0
    for row in rows:
        worth += design.worth()[row]
        design.in_order([row])
    return worth
