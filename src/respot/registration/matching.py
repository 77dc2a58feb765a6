"""Pairs by name: exact first, then by rules that are each said, and complete about what did not pair.

The same spot is written P02WP1615438, p02wp1615438, P02WP01615438 or WP_P02WP1615438_1 by one system or another. The
rules are tried from the mildest to the boldest, each only on names that are still alone, and a rule pairs two names
only if no third name would fit as well.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Matching = Literal["auto", "id", "geometry"]
Rows = NDArray[np.intp]

EXACT, SPELLING, ZEROS, AFFIX, VARIANT, PLACE = (
    "",
    "case or separators",
    "leading zeros",
    "prefix or suffix",
    "variant",
    "geometry",
)
_SEPARATORS = re.compile(r"[\s_.\-/]+")
_LOOSE = re.compile(r"(?<!\d)_|_(?!\d)")
_NUMBER = re.compile(r"0+(?=\d)")
_VARIANT = re.compile(r"_(\d{1,2}|[a-km-qs-z]|v\d+|new|old|neu|alt|copy|kopie)$")  # _l and _r are other spots
_LEAST_AFFIX = 3  # a prefix is a rule of the list if it joins this many names
_SHARE_AFFIX = 0.5  # and this share of those that are still alone


@dataclass(frozen=True, eq=False)
class IdMatch:
    """Pairs, in the order of the source list.

    A name that occurs more than once in either list is never paired: which one is meant is for a person to say.

    Attributes
    ----------
    ids : tuple of str, length n
        Names in the source.
    source_rows, reference_rows : (n,) int arrays
        Where each pair stands in its list (0-based).
    missing : tuple of str
        Names of the source that the reference lacks.
    extra : tuple of str
        Names of the reference that the source lacks.
    source_duplicates, reference_duplicates : tuple of str
        Names that occur more than once in that list, each once.
    n_source, n_reference : int
        Lengths of the lists.
    reference_ids : tuple of str, length n
        Names in the reference.
    rules : tuple of str, length n
        Why two names are one: empty for equal names, else the rule; ``"geometry"`` where names played no part.
    """

    ids: tuple[str, ...]
    source_rows: Rows
    reference_rows: Rows
    missing: tuple[str, ...]
    extra: tuple[str, ...]
    source_duplicates: tuple[str, ...]
    reference_duplicates: tuple[str, ...]
    n_source: int
    n_reference: int
    reference_ids: tuple[str, ...] = ()
    rules: tuple[str, ...] = ()


def match_by_id(source_ids: Sequence[str], reference_ids: Sequence[str]) -> IdMatch:
    """Pair two lists by exactly equal names."""
    return _matched(source_ids, reference_ids, _equal(source_ids, reference_ids))


def match_by_name(source_ids: Sequence[str], reference_ids: Sequence[str]) -> IdMatch:
    """Pair two lists by name: equal, then by case and separators, leading zeros, prefix or suffix, variant suffix.

    A prefix or suffix counts as a rule of a list where it joins at least 3 names and half of those that are still
    alone; no rule ever cuts a number in two. A variant suffix is a short number or one letter after a separator that
    one list has and the other lacks; never L or R, which are other spots.
    """
    pairs = _equal(source_ids, reference_ids)
    for rule, key in ((SPELLING, _spelling), (ZEROS, _zeros)):
        _add(pairs, rule, source_ids, reference_ids, key, key)
    for own, other in _affixes(source_ids, reference_ids, pairs):
        _add(pairs, AFFIX, source_ids, reference_ids, own, other)
    # One of the two must be the plain name: SP_7 and SP_9 left alone are two spots, not two variants of SP.
    for own, other in ((_variant, _zeros), (_zeros, _variant)):
        _add(pairs, VARIANT, source_ids, reference_ids, own, other)
    return _matched(source_ids, reference_ids, pairs)


def match_of_places(
    source_ids: Sequence[str], reference_ids: Sequence[str], source_rows: Rows, reference_rows: Rows
) -> IdMatch:
    """Describe pairs that geometry found; what is alone is missing or extra by its place, whatever its name."""
    pairs = {int(i): (int(j), PLACE) for i, j in zip(source_rows, reference_rows, strict=True)}
    return _matched(source_ids, reference_ids, pairs, names_count=False)


Pairs = dict[int, tuple[int, str]]


def _equal(source_ids: Sequence[str], reference_ids: Sequence[str]) -> Pairs:
    source_count, reference_count = Counter(source_ids), Counter(reference_ids)
    rows = {name: row for row, name in enumerate(reference_ids)}
    return {
        row: (rows[name], EXACT)
        for row, name in enumerate(source_ids)
        if source_count[name] == 1 and reference_count[name] == 1
    }


def _matched(
    source_ids: Sequence[str], reference_ids: Sequence[str], pairs: Pairs, names_count: bool = True
) -> IdMatch:
    source_count, reference_count = Counter(source_ids), Counter(reference_ids)
    order = sorted(pairs)
    taken = {pairs[row][0] for row in order}
    missing = [name for row, name in enumerate(source_ids) if row not in pairs]
    extra = [name for row, name in enumerate(reference_ids) if row not in taken]
    if names_count:  # a duplicate is said as such, not as missing
        missing = [name for name in missing if name not in reference_count]
        extra = [name for name in extra if name not in source_count]
    return IdMatch(
        ids=tuple(source_ids[row] for row in order),
        source_rows=np.array(order, dtype=np.intp),
        reference_rows=np.array([pairs[row][0] for row in order], dtype=np.intp),
        missing=tuple(dict.fromkeys(missing)),
        extra=tuple(dict.fromkeys(extra)),
        source_duplicates=tuple(name for name, count in source_count.items() if count > 1),
        reference_duplicates=tuple(name for name, count in reference_count.items() if count > 1),
        n_source=len(source_ids),
        n_reference=len(reference_ids),
        reference_ids=tuple(reference_ids[pairs[row][0]] for row in order),
        rules=tuple(pairs[row][1] for row in order),
    )


def _alone(
    source_ids: Sequence[str], reference_ids: Sequence[str], pairs: Pairs
) -> tuple[list[tuple[int, str]], list[tuple[int, str]]]:
    """Rows and names of either list without a partner; duplicates are left out."""
    taken = {row for row, _ in pairs.values()}
    source_count, reference_count = Counter(source_ids), Counter(reference_ids)
    own = [(row, name) for row, name in enumerate(source_ids) if row not in pairs and source_count[name] == 1]
    other = [(row, name) for row, name in enumerate(reference_ids) if row not in taken and reference_count[name] == 1]
    return own, other


def _add(
    pairs: Pairs,
    rule: str,
    source_ids: Sequence[str],
    reference_ids: Sequence[str],
    own_key: Callable[[str], str],
    other_key: Callable[[str], str],
) -> None:
    """Pair names of equal keys, where either list has the key once."""
    own, other = _alone(source_ids, reference_ids, pairs)
    own_keys, other_keys = Counter(own_key(name) for _, name in own), Counter(other_key(name) for _, name in other)
    rows = {other_key(name): row for row, name in other}
    for row, name in own:
        key = own_key(name)
        if key and own_keys[key] == 1 and other_keys[key] == 1:
            pairs[row] = (rows[key], rule)


def _spelling(name: str) -> str:
    """Name without case and separators; a separator between two digits stays, or two numbers would become one."""
    return _LOOSE.sub("", _separated(name))


def _separated(name: str) -> str:
    return _SEPARATORS.sub("_", name.strip().casefold()).strip("_")


def _zeros(name: str) -> str:
    return re.sub(r"\d+", lambda found: _NUMBER.sub("", found[0]), _spelling(name))


def _variant(name: str) -> str:
    return _zeros(_VARIANT.sub("", _separated(name)))


def _affixes(
    source_ids: Sequence[str], reference_ids: Sequence[str], pairs: Pairs
) -> list[tuple[Callable[[str], str], Callable[[str], str]]]:
    """Keys that take a common prefix or suffix off the names of one list, the most frequent first."""
    own, other = _alone(source_ids, reference_ids, pairs)
    least = max(_LEAST_AFFIX, int(np.ceil(_SHARE_AFFIX * min(len(own), len(other)))))
    found: Counter[tuple[bool, str, str]] = Counter()
    for in_source, longer, shorter in ((True, own, other), (False, other, own)):
        keys = {_zeros(name) for _, name in shorter}
        for _, name in longer:
            text = _zeros(name)
            for cut in range(1, len(text)):
                if text[cut - 1].isdigit() and text[cut].isdigit():
                    continue
                if text[cut:] in keys:
                    found[in_source, text[:cut], ""] += 1
                if text[:cut] in keys:
                    found[in_source, "", text[cut:]] += 1
    return [
        (_without(prefix, suffix), _zeros) if in_source else (_zeros, _without(prefix, suffix))
        for (in_source, prefix, suffix), count in found.most_common()
        if count >= least
    ]


def _without(prefix: str, suffix: str) -> Callable[[str], str]:
    """Key without the affix; a name that has it not gets no key."""

    def key(name: str) -> str:
        text = _zeros(name)
        fits = text.startswith(prefix) and text.endswith(suffix) and len(text) > len(prefix) + len(suffix)
        return text[len(prefix) : len(text) - len(suffix)] if fits else ""

    return key
