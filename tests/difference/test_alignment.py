"""Which element is which: laws that hold for every two sequences, and what people expect of a few."""

from __future__ import annotations

import random
import time
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from respot.difference.alignment import align, gaps, increasing, pair_alike, slide

WORDS = st.lists(st.sampled_from("abcdefgh"), max_size=40)


@given(WORDS, WORDS)
def test_pairs_are_equal_and_in_order(old, new):
    pairs = align(old, new)
    assert all(old[i] == new[j] for i, j in pairs)
    assert all(a[0] < b[0] and a[1] < b[1] for a, b in pairwise(pairs))


@given(WORDS, WORDS)
def test_gaps_and_pairs_are_everything(old, new):
    pairs = align(old, new)
    found = gaps(pairs, len(old), len(new))
    assert sum(i1 - i0 for i0, i1, _, _ in found) + len(pairs) == len(old)
    assert sum(j1 - j0 for _, _, j0, j1 in found) + len(pairs) == len(new)


@given(WORDS)
def test_a_sequence_is_itself(items):
    assert align(items, items) == [(i, i) for i in range(len(items))]


@given(st.lists(st.integers(), unique=True), st.data())
def test_what_is_left_out_is_the_only_gap(items, data):
    left = data.draw(st.sets(st.integers(0, max(0, len(items) - 1)), max_size=len(items)))
    kept = [i for i in range(len(items)) if i not in left]
    assert align(items, [items[i] for i in kept]) == [(i, j) for j, i in enumerate(kept)]


@given(WORDS, WORDS, st.data())
def test_sliding_keeps_pairs_equal_and_in_order(old, new, data):
    starts = [data.draw(st.lists(st.booleans(), min_size=len(side), max_size=len(side))) for side in (old, new)]
    before = align(old, new)
    after = slide(before, (old, new), (starts[0], starts[1]))
    assert len(after) == len(before)
    assert all(old[i] == new[j] for i, j in after)
    assert all(a[0] < b[0] and a[1] < b[1] for a, b in pairwise(after))


@pytest.mark.parametrize("inserted", [True, False], ids=["came", "went"])
def test_what_came_or_went_begins_where_a_group_begins(inserted):
    """Forms that begin and end alike: the middle one came, not the end of one and the beginning of another."""
    short, long = list("(a)(b)"), list("(a)(n)(b)")
    starts = [[item == "(" for item in side] for side in (short, long)]
    wanted = [(0, 0), (1, 1), (2, 2), (3, 6), (4, 7), (5, 8)]
    if not inserted:
        short, long, starts, wanted = long, short, starts[::-1], [(j, i) for i, j in wanted]
    assert slide(align(short, long), (short, long), (starts[0], starts[1])) == wanted


@given(st.lists(st.integers(-50, 50)))
def test_increasing(values):
    found = [values[i] for i in increasing(values)]
    assert all(a < b for a, b in pairwise(found))
    best = [0] * len(values)
    for i, value in enumerate(values):
        best[i] = 1 + max((best[j] for j in range(i) if values[j] < value), default=0)
    assert len(found) == max(best, default=0)


def test_the_most_alike_are_paired():
    likeness = [[0.1, 0.9, 0.0], [0.0, 0.2, 0.8]]
    assert pair_alike((0, 2, 0, 3), lambda i, j: likeness[i][j]) == [(0, 1), (1, 2)]


@pytest.mark.parametrize("words", [2, 50, 5000], ids=str)
def test_long_routines_take_no_time(words):
    dice = random.Random(1)
    old = [dice.randrange(words) for _ in range(20_000)]
    new = list(old)
    for _ in range(300):
        new.insert(dice.randrange(len(new)), dice.randrange(words))
        del new[dice.randrange(len(new))]
    start = time.process_time()
    align(old, new)
    assert time.process_time() - start < 20
