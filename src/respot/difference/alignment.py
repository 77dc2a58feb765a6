"""Which elements of an old sequence are which of a new one.

Patience first: what occurs once on both sides is an anchor, and the longest increasing run of anchors is kept. Between
anchors the rarest common element is extended to a run, as histogram diff does. Programs are mostly equal and their
points have names, so nearly all of the work is done by hashing.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Hashable, Iterator, Sequence
from difflib import SequenceMatcher

#: Ranges of the old and the new sequence: (old start, old end, new start, new end).
Range = tuple[int, int, int, int]
Pair = tuple[int, int]

#: What occurs more often on one side is no start of a run.
_MOST_OCCURRENCES = 64
#: A gap slides no further to find the beginning of a group.
_FURTHEST = 20
#: Cells of a table that pairs what is alike, or what has no anchors.
_MOST_CELLS = 40_000


def align(old: Sequence[Hashable], new: Sequence[Hashable]) -> list[Pair]:
    """Return pairs of equal elements, increasing on both sides."""
    return sorted(_pairs(old, new))


def gaps(pairs: Sequence[Pair], old_count: int, new_count: int) -> list[Range]:
    """Return the ranges between pairs that hold something on either side."""
    found = []
    before = (-1, -1)
    for pair in [*pairs, (old_count, new_count)]:
        between = (before[0] + 1, pair[0], before[1] + 1, pair[1])
        if between[0] < between[1] or between[2] < between[3]:
            found.append(between)
        before = pair
    return found


def _pairs(old: Sequence[Hashable], new: Sequence[Hashable]) -> Iterator[Pair]:
    waiting: list[Range] = [(0, len(old), 0, len(new))]
    while waiting:
        i0, i1, j0, j1 = waiting.pop()
        while i0 < i1 and j0 < j1 and old[i0] == new[j0]:
            yield i0, j0
            i0, j0 = i0 + 1, j0 + 1
        while i0 < i1 and j0 < j1 and old[i1 - 1] == new[j1 - 1]:
            i1, j1 = i1 - 1, j1 - 1
            yield i1, j1
        if i0 == i1 or j0 == j1:
            continue
        anchors = _anchors(old, new, (i0, i1, j0, j1))
        if not anchors:
            run = _rarest_run(old, new, (i0, i1, j0, j1))
            anchors = [] if run is None else [(run[0] + step, run[1] + step) for step in range(run[2])]
        if not anchors and (i1 - i0) * (j1 - j0) <= _MOST_CELLS:
            # nothing but what occurs again and again
            matcher = SequenceMatcher(None, old[i0:i1], new[j0:j1], autojunk=False)
            for i, j, length in matcher.get_matching_blocks():
                yield from ((i0 + i + step, j0 + j + step) for step in range(length))
        if not anchors:
            continue
        before = (i0, j0)
        for anchor in anchors:
            yield anchor
            waiting.append((before[0], anchor[0], before[1], anchor[1]))
            before = (anchor[0] + 1, anchor[1] + 1)
        waiting.append((before[0], i1, before[1], j1))


def _anchors(old: Sequence[Hashable], new: Sequence[Hashable], within: Range) -> list[Pair]:
    """Return elements that occur once on both sides, the longest increasing run of them."""
    i0, i1, j0, j1 = within
    places = [_once(old, i0, i1), _once(new, j0, j1)]
    common = [
        (index, other)
        for item, index in places[0].items()
        if index >= 0 and (other := places[1].get(item, -1)) >= 0
    ]  # fmt: skip
    common.sort()
    return [common[index] for index in increasing([other for _, other in common])]


def _once(items: Sequence[Hashable], start: int, end: int) -> dict[Hashable, int]:
    """Place of each element of a range, -1 where it occurs again."""
    found: dict[Hashable, int] = {}
    for index in range(start, end):
        item = items[index]
        found[item] = -1 if item in found else index
    return found


def increasing(values: Sequence[int]) -> list[int]:
    """Return the indices of a longest strictly increasing subsequence."""
    tails: list[int] = []
    last: list[int] = []
    previous: list[int] = []
    for index, value in enumerate(values):
        place = bisect_left(tails, value)
        previous.append(last[place - 1] if place else -1)
        tails[place : place + 1] = [value]
        last[place : place + 1] = [index]
    found = []
    index = last[-1] if last else -1
    while index >= 0:
        found.append(index)
        index = previous[index]
    return found[::-1]


def _rarest_run(old: Sequence[Hashable], new: Sequence[Hashable], within: Range) -> tuple[int, int, int] | None:
    """Return the longest common run that starts at one of the rarest common elements: both starts and the length."""
    i0, i1, j0, j1 = within
    places: dict[Hashable, list[int]] = {}
    for index in range(i0, i1):
        places.setdefault(old[index], []).append(index)
    best: tuple[int, int, int] | None = None
    rank = (_MOST_OCCURRENCES + 1, 0)
    seen: dict[Hashable, int] = {}
    for item in new[j0:j1]:
        if item in places:
            seen[item] = seen.get(item, 0) + 1
    for other in range(j0, j1):
        item = new[other]
        starts = places.get(item, ())
        count = max(len(starts), seen.get(item, 0))
        if not starts or count > rank[0]:
            continue
        for start in starts:
            if start > i0 and other > j0 and old[start - 1] == new[other - 1]:
                continue  # a longer run was seen from its own start
            length = 1
            while start + length < i1 and other + length < j1 and old[start + length] == new[other + length]:
                length += 1
            if (count, -length) < rank:
                best, rank = (start, other, length), (count, -length)
    return best


def slide(
    pairs: Sequence[Pair],
    items: tuple[Sequence[Hashable], Sequence[Hashable]],
    starts: tuple[Sequence[bool], Sequence[bool]],
) -> list[Pair]:
    """Let what came or went begin where a group begins: if ``a b a`` became ``a``, both ``a b`` and ``b a`` went.

    Parameters
    ----------
    pairs : sequence of Pair
        Pairs of equal elements.
    items : (sequence, sequence)
        The old and the new sequence.
    starts : (sequence of bool, sequence of bool)
        Whether a group begins at each element.
    """
    partners = [dict(pairs), {new: old for old, new in pairs}]
    for i0, i1, j0, j1 in gaps(pairs, len(items[0]), len(items[1])):
        if i0 < i1 and j0 < j1:
            continue
        side = 0 if i0 < i1 else 1
        first, last, place = (i0, i1, j0) if side == 0 else (j0, j1, i0)
        best = _best_slide(items[side], starts[side], partners[side], (first, last, place))
        step = 1 if best > 0 else -1
        for _ in range(abs(best)):
            loose, taken = (last, first) if step > 0 else (first - 1, last - 1)
            other = partners[side].pop(loose)
            partners[side][taken] = other
            partners[1 - side][other] = taken
            first, last = first + step, last + step
    return sorted(partners[0].items())


def _best_slide(
    items: Sequence[Hashable], starts: Sequence[bool], partners: dict[int, int], gap: tuple[int, int, int]
) -> int:
    """Return how far to move a gap so that a group begins at its start and behind its end."""
    first, last, place = gap

    def worth(by: int) -> int:
        return int(starts[first + by]) + int(last + by == len(items) or starts[last + by])

    best = 0
    for step in (-1, 1):
        by = 0
        while abs(by) < _FURTHEST:
            edge = first + by - 1 if step < 0 else last + by
            same = edge + last - first if step < 0 else edge - last + first
            if not 0 <= edge < len(items) or partners.get(edge) != place + by - (step < 0):
                break
            if items[edge] != items[same]:
                break
            by += step
            if worth(by) > worth(best):
                best = by
    return best


def pair_alike(within: Range, alike: Callable[[int, int], float]) -> list[Pair]:
    """Pair what is alike within a range, in order, so that the sum of likeness is largest.

    Parameters
    ----------
    within : Range
        The range.
    alike : callable
        Likeness of an old and a new element, by index; 0 or less for what is never paired.

    Returns
    -------
    list of Pair
        For a range too large for a table, what stands at the same place on both sides.
    """
    i0, i1, j0, j1 = within
    rows, columns = i1 - i0, j1 - j0
    if not rows or not columns:
        return []
    if rows * columns > _MOST_CELLS:
        side = min(rows, columns)
        return [(i0 + step, j0 + step) for step in range(side) if alike(i0 + step, j0 + step) > 0]
    likeness = [[alike(i0 + row, j0 + column) for column in range(columns)] for row in range(rows)]
    best = [[0.0] * (columns + 1) for _ in range(rows + 1)]
    for row in range(rows - 1, -1, -1):
        for column in range(columns - 1, -1, -1):
            paired = likeness[row][column]
            kept = max(best[row + 1][column], best[row][column + 1])
            best[row][column] = max(kept, best[row + 1][column + 1] + paired) if paired > 0 else kept
    found = []
    row = column = 0
    while row < rows and column < columns:
        if likeness[row][column] > 0 and best[row][column] == best[row + 1][column + 1] + likeness[row][column]:
            found.append((i0 + row, j0 + column))
            row, column = row + 1, column + 1
        elif best[row][column] == best[row + 1][column]:
            row += 1
        else:
            column += 1
    return found
