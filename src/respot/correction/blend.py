"""Shifts along a path that are given at some of its points: kept near welds, and carried over smoothly between."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from respot.geometry import Array

Rows = NDArray[np.intp]

PLATEAU_MM = 100.0
"""Points nearer along the path than this to a weld move as it does: approach and retract keep their way to it."""
PLATEAU_SHARE = 0.45
"""Of the way between two welds that are nearer to each other: each has this much of it."""

BESIDE = 1
"""Rank of a point right before or behind a weld, on its plateau."""


@dataclass(frozen=True, eq=False)
class BlendedPath:
    """A path with welds.

    Parameters
    ----------
    places : (n, 3) array
        Where it goes, in order [mm].
    welds : (m,) array of int
        Which of them are welds, ascending, m > 0.
    """

    places: Array
    welds: Rows

    @cached_property
    def _length(self) -> Array:
        """Length of the path to each point (n,) [mm]."""
        return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(self.places, axis=0), axis=1))])

    @cached_property
    def _reach(self) -> tuple[Array, Array]:
        """How far the plateau of each point reaches back and ahead (n,) [mm]: 0 where nothing is welded."""
        back, ahead = np.zeros(len(self.places)), np.zeros(len(self.places))
        between = np.minimum(PLATEAU_MM, PLATEAU_SHARE * np.diff(self._length[self.welds]))
        back[self.welds] = np.concatenate([[PLATEAU_MM], between])
        ahead[self.welds] = np.concatenate([between, [PLATEAU_MM]])
        return back, ahead

    @cached_property
    def ranks(self) -> Rows:
        """How near a weld each point (n,) is: 0 one itself, 1 right `BESIDE` it, 2 on its plateau, 3 on none."""
        last, following = self._neighbours(self.welds)
        back, ahead = self._reach
        behind, before = self._length - self._length[last], self._length[following] - self._length
        after = (behind >= 0.0) & (behind <= ahead[last])
        ahead_of = (before >= 0.0) & (before <= back[following])
        rows = np.arange(len(self.places))
        found = np.where(after | ahead_of, 2, 3)
        found[(after & (rows - last == 1)) | (ahead_of & (following - rows == 1))] = BESIDE
        found[self.welds] = 0
        return np.asarray(found, dtype=np.intp)

    def _neighbours(self, fixed: Rows) -> tuple[Rows, Rows]:
        """The last of some rows before each point, and the next; beyond their ends the first or last of them."""
        rows = np.arange(len(self.places))
        last = np.clip(np.searchsorted(fixed, rows, side="right") - 1, 0, len(fixed) - 1)
        following = np.clip(np.searchsorted(fixed, rows, side="left"), 0, len(fixed) - 1)
        return fixed[last], fixed[following]

    def shifts(self, fixed: Rows, values: Array) -> Array:
        """Shifts (n, 3) of all points.

        On the plateau of a weld its own shift; between a cubic of the path's length that leaves and arrives level;
        before the first given point and behind the last one, theirs. No point is shifted further than the larger of its
        two neighbours, and the path run backwards gets the same shifts.

        Parameters
        ----------
        fixed : (k,) array of int
            Points whose shifts are given, ascending: the welds, and others.
        values : (k, 3) array
            Their shifts [mm].
        """
        given = np.zeros_like(self.places)
        given[fixed] = values
        last, following = self._neighbours(fixed)
        back, ahead = self._reach
        start, end = self._length[last] + ahead[last], self._length[following] - back[following]
        room = end - start
        # a given point on the plateau of a weld: the way to it stays the weld's
        there = np.where(ahead[last] > back[following], 0.0, np.where(ahead[last] < back[following], 1.0, 0.5))
        way = np.where(room > 0.0, (self._length - start) / np.where(room > 0.0, room, 1.0), there)
        part = np.clip(way, 0.0, 1.0)
        part = (part * part * (3.0 - 2.0 * part))[:, None]
        return np.asarray((1.0 - part) * given[last] + part * given[following])
