"""Can two lists of paired spots be the same body? Distances between spots say so before anything is fitted.

A rigid motion keeps every distance. Where names, rows, units or the whole list are wrong, distances disagree, and they
say which spots do. No frame and no transform plays a part here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from respot.registration.consensus import quota_of

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

TOLERANCE = 40.0
"""Distances that differ by no more than this may be of the same body: spots 10 mm off along each axis [mm]."""
SHARE_OF_BODY = 0.15  # and by no more than this share of the median distance: small parts agree by chance
_PARTNERS = 0.7  # a spot of the group agrees with this share of the group
_CLEARLY_MORE = 1.3
_SAMPLE = 400
_UNIT_NEAR = 0.05  # ratio of distances within 5 % of a factor between units
UNITS = {
    25.4: "inches",
    1000.0: "metres",
    10.0: "centimetres",
    1000.0 / 25.4: "inches and metres",
}


@dataclass(frozen=True, eq=False)
class Congruence:
    """How far paired spots keep their distances.

    Attributes
    ----------
    rows : (k,) int array
        Pairs that were compared: all, or an even sample of 400.
    group : (k,) bool array
        The largest group found whose members agree with most of each other.
    tolerance : float
        Largest difference of two distances that agree [mm].
    same_body : bool
        At least 45 % of the pairs, and at least 4 (of fewer: all), are in the group.
    source_distances, reference_distances : (k, k) arrays
        [mm]
    """

    rows: Rows
    group: NDArray[np.bool_]
    tolerance: float
    same_body: bool
    source_distances: Array
    reference_distances: Array

    @property
    def suspects(self) -> tuple[int, ...]:
        """Pairs outside the group, the worst first: by the median difference of their distances to the group."""
        outside = np.flatnonzero(~self.group)
        others = self.group if self.group.any() else np.ones(len(self.group), dtype=bool)
        differences = np.abs(self.source_distances - self.reference_distances)[outside][:, others]
        worst = outside[np.argsort(-np.median(differences, axis=1), kind="stable")]
        return tuple(int(row) for row in self.rows[worst])

    def widest(self, pair: int) -> tuple[int, float, float]:
        """Which other pair disagrees most with ``pair``; their distance in the source and in the reference [mm]."""
        own = int(np.flatnonzero(self.rows == pair)[0])
        other = int(np.argmax(np.abs(self.source_distances[own] - self.reference_distances[own])))
        return (
            int(self.rows[other]),
            float(self.source_distances[own, other]),
            float(self.reference_distances[own, other]),
        )


def distances_between(points: Array) -> Array:
    """Distances (n, n) between points (n, 3) [mm]."""
    squares = np.sum((points[:, None, :] - points[None, :, :]) ** 2, axis=-1)
    return np.asarray(np.sqrt(squares), dtype=np.float64)


def tolerance_of(distances: Array) -> float:
    """Difference up to which two distances agree, for a body of these distances [mm]."""
    apart = distances[np.triu_indices(len(distances), 1)]
    return min(TOLERANCE, SHARE_OF_BODY * float(np.median(apart))) if apart.size else TOLERANCE


def congruence(source: ArrayLike, reference: ArrayLike) -> Congruence:
    """Compare the distances of paired spots.

    The group is what is left when the spot that agrees with the fewest others is taken out, again and again, until
    every spot agrees with at least 70 % of the rest.

    Parameters
    ----------
    source, reference : (n, 3) arrays
        Paired spots, finite [mm].
    """
    first, second = np.asarray(source, dtype=np.float64), np.asarray(reference, dtype=np.float64)
    n = len(first)
    rows = np.arange(n, dtype=np.intp) if n <= _SAMPLE else np.linspace(0, n - 1, _SAMPLE).astype(np.intp)
    own, other = distances_between(first[rows]), distances_between(second[rows])
    tolerance = min(tolerance_of(own), tolerance_of(other))
    agree = np.abs(own - other) <= tolerance
    np.fill_diagonal(agree, False)
    group = np.ones(len(rows), dtype=bool)
    partners = agree.sum(axis=1)
    for _ in range(len(rows)):
        left = int(group.sum())
        weakest = int(np.argmin(np.where(group, partners, len(rows))))
        if left <= 1 or partners[weakest] >= _PARTNERS * (left - 1):
            break
        group[weakest] = False
        partners = partners - agree[:, weakest]
    enough = quota_of(len(rows)) if len(rows) >= 4 else len(rows)
    return Congruence(rows, group, tolerance, int(group.sum()) >= enough, own, other)


def unit_factor(source: ArrayLike, reference: ArrayLike) -> tuple[float, str] | None:
    """Whether the distances of the reference are those of the source in another unit.

    Returns
    -------
    (factor, units) or None
        Reference distances over source distances, as the exact factor between two units, and which unit one of the
        lists is in (the other: millimetres); where at least half of the distances have this ratio within 5 %.
    """
    first, second = np.asarray(source, dtype=np.float64), np.asarray(reference, dtype=np.float64)
    step = max(1, len(first) // _SAMPLE)
    upper = np.triu_indices(len(first[::step]), 1)
    own, other = distances_between(first[::step])[upper], distances_between(second[::step])[upper]
    known = (own > 0.0) & (other > 0.0)
    if not known.any():
        return None
    ratio = np.log(other[known] / own[known])
    for unit, name in UNITS.items():
        for factor in (unit, 1.0 / unit):
            if np.mean(np.abs(ratio - np.log(factor)) <= _UNIT_NEAR) >= 0.5:
                return factor, name
    return None


def shifted_rows(source: ArrayLike, reference: ArrayLike, *, seed: int = 0) -> tuple[int, Congruence] | None:
    """Whether the pairs agree when one list is moved by some rows against the other, round the end.

    Parameters
    ----------
    source, reference : (n, 3) arrays
        Pairs as named, in the order of the list whose rows may have slipped [mm].
    seed : int
        Of the distances that are compared.

    Returns
    -------
    (shift, congruence) or None
        Pair i agrees with the reference of pair ``i + shift``, and how well. None where no shift makes at least 70 % of
        the pairs agree, and clearly more than as named (in a row of equal pitch many agree either way).
    """
    first, second = np.asarray(source, dtype=np.float64), np.asarray(reference, dtype=np.float64)
    n = len(first)
    if n < 4:
        return None
    named = float(congruence(first, second).group.mean())
    if named >= _PARTNERS:
        return None
    rng = np.random.default_rng(seed)
    one = rng.integers(0, n, 300)
    two = (one + rng.integers(1, n, 300)) % n
    own = np.linalg.norm(first[one] - first[two], axis=1)
    shifts = np.arange(1, n)
    other = np.linalg.norm(
        second[(one[None] + shifts[:, None]) % n] - second[(two[None] + shifts[:, None]) % n], axis=-1
    )
    best = int(shifts[np.argmin(np.median(np.abs(other - own[None]), axis=1))])
    agreed = congruence(first, np.roll(second, -best, axis=0))
    if float(agreed.group.mean()) < max(_PARTNERS, _CLEARLY_MORE * named):
        return None
    return (best if best <= n // 2 else best - n), agreed
