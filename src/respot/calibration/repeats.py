"""Noise from repeats: the same spots measured several times tell how far a measurement scatters, whatever the model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

from respot.registration.errors import RegistrationError
from respot.tables.table import Table

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Repeats:
    """Spots averaged over their repeats, and the noise that the repeats show.

    Attributes
    ----------
    ids : tuple of n str
        Each spot once, in the order in which it first occurs.
    positions : (n, 3) array
        Means [mm].
    counts : (n,) int array
        How often each was measured.
    sigma : float or None
        Standard deviation per coordinate of one measurement [mm]; None where no spot was measured twice.
    degrees_of_freedom : int
        3 times (measurements minus spots).
    sigma_xyz : (3,) array or None
        The same along each axis [mm].
    """

    ids: tuple[str, ...]
    positions: Array
    counts: NDArray[np.intp]
    sigma: float | None
    degrees_of_freedom: int
    sigma_xyz: Array | None

    @property
    def sigma_of_mean(self) -> float | None:
        """Standard deviation per coordinate of a mean, over the spots in quadrature [mm]."""
        return None if self.sigma is None else float(self.sigma * np.sqrt(np.mean(1.0 / self.counts)))

    def interval(self, share: float = 0.95) -> tuple[float, float] | None:
        """Return the interval of `sigma` by chi-square [mm]; None without repeats."""
        if self.sigma is None:
            return None
        free = self.degrees_of_freedom
        low, high = (float(stats.chi2.ppf(side, free)) for side in ((1.0 + share) / 2.0, (1.0 - share) / 2.0))
        return self.sigma * float(np.sqrt(free / low)), self.sigma * float(np.sqrt(free / high))


def noise_from_repeats(ids: Sequence[str], positions: ArrayLike) -> Repeats:
    """Average spots that were measured more than once, and estimate the noise from what they differ by.

    The noise is the pooled standard deviation within spots: what a spot's own place has in it does not count. It is
    that of the measuring; how far a spot strays from the model is seen in the residuals only.

    Parameters
    ----------
    ids : sequence of m str
        Name of each measurement; the same name is the same spot (compared without case).
    positions : (m, 3) array
        [mm]

    Raises
    ------
    RegistrationError
        ``SHAPE_MISMATCH`` or ``NOT_A_NUMBER``.
    """
    points = np.asarray(positions, dtype=np.float64)
    if points.shape != (len(ids), 3):
        raise RegistrationError("SHAPE_MISMATCH", f"{len(ids)} names for points {points.shape}")
    bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if len(bad):
        name = ids[int(bad[0])]
        raise RegistrationError("NOT_A_NUMBER", f"a coordinate of {name} is not a finite number", ids=(name,))
    first: dict[str, str] = {}
    for name in ids:
        first.setdefault(name.casefold(), name)
    place = {key: row for row, key in enumerate(first)}
    rows = np.array([place[name.casefold()] for name in ids], dtype=np.intp)
    counts = np.bincount(rows, minlength=len(first)).astype(np.intp)
    means = np.zeros((len(first), 3))
    np.add.at(means, rows, points)
    means /= counts[:, None] if len(counts) else 1.0
    over = int(len(ids) - len(first))
    if over <= 0:
        return Repeats(tuple(first.values()), means, counts, None, 0, None)
    squares = np.sum((points - means[rows]) ** 2, axis=0) / over
    return Repeats(tuple(first.values()), means, counts, float(np.sqrt(squares.mean())), 3 * over, np.sqrt(squares))


def noise_of_table(table: Table) -> Repeats | None:
    """Return what the repeats of a table say about the noise; None where no position stands in several rows.

    The table's own positions are the means, so that the noise of a spot that is fitted is `Repeats.sigma_of_mean`.
    """
    every = table.repeats
    if every is None or every.positions is None:
        return None
    return noise_from_repeats(every.ids, every.positions)
