"""Pairs by name: exact, and complete about what did not pair."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class IdMatch:
    """Pairs of equal names, in the order of the source list.

    A name that occurs more than once in either list is never paired: which one is meant is for a person to say.

    Attributes
    ----------
    ids : tuple of str, length n
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
    """

    ids: tuple[str, ...]
    source_rows: NDArray[np.intp]
    reference_rows: NDArray[np.intp]
    missing: tuple[str, ...]
    extra: tuple[str, ...]
    source_duplicates: tuple[str, ...]
    reference_duplicates: tuple[str, ...]
    n_source: int
    n_reference: int


def match_by_id(source_ids: Sequence[str], reference_ids: Sequence[str]) -> IdMatch:
    """Pair two lists by exactly equal names."""
    source_count, reference_count = Counter(source_ids), Counter(reference_ids)
    rows = {name: row for row, name in enumerate(reference_ids)}
    pairs = [
        (name, row, rows[name])
        for row, name in enumerate(source_ids)
        if source_count[name] == 1 and reference_count[name] == 1
    ]
    return IdMatch(
        ids=tuple(name for name, _, _ in pairs),
        source_rows=np.array([row for _, row, _ in pairs], dtype=np.intp),
        reference_rows=np.array([row for _, _, row in pairs], dtype=np.intp),
        missing=tuple(name for name in source_count if name not in reference_count),
        extra=tuple(name for name in reference_count if name not in source_count),
        source_duplicates=tuple(name for name, count in source_count.items() if count > 1),
        reference_duplicates=tuple(name for name, count in reference_count.items() if count > 1),
        n_source=len(source_ids),
        n_reference=len(reference_ids),
    )
