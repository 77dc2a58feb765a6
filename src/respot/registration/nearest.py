"""Which spot of the reference is nearest to a place: exactly, or how far it is, roughly and many times quicker."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from respot.registration.congruence import distances_between

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

_CELL = 10.0  # mm
_MOST_CELLS = 4_000_000
_COARSEST = 20.0  # mm; cells of a list that is wider (one spot a kilometre off) would say nothing


class NearestSpots:
    """The spots of a reference, and the way to the nearest of them.

    Parameters
    ----------
    spots : (m, 3) array
        [mm]
    reach : float
        What lies further away has no nearest spot [mm].
    roughly : bool
        Make ready for `rough_lengths` from cells; else these are exact.

    Attributes
    ----------
    between : (m, m) array
        Distances between the spots [mm].
    """

    def __init__(self, spots: Array, reach: float, *, roughly: bool) -> None:
        self.spots, self.reach = spots, reach
        self.between = distances_between(spots)
        self._tree = cKDTree(spots)
        cell = _cell_of(spots, reach) if roughly else np.inf
        self._field = _DistanceField(spots, reach, cell) if cell <= _COARSEST else None

    def of(self, points: Array) -> tuple[Array, Rows]:
        """Distance and row of the spot nearest to each of the points (n, 3); infinite [mm] where there is none."""
        lengths, rows = self._tree.query(points, distance_upper_bound=self.reach)
        return np.asarray(lengths, dtype=np.float64), np.asarray(rows, dtype=np.intp)

    def rough_lengths(self, points: Array) -> NDArray[np.floating]:
        """Distances (n,) of points (n, 3) to the nearest spot [mm], of a large list by some millimetres wrong."""
        return self.of(points)[0] if self._field is None else self._field.of(points)


def _cell_of(spots: Array, reach: float) -> float:
    """Edge of a cell [mm], so that no more than four million fill the box of the spots."""
    edges = np.ptp(spots, axis=0) + 2.0 * reach
    return max(_CELL, float(np.prod(np.cbrt(edges)) / np.cbrt(_MOST_CELLS)))  # roots first: a product may overflow


class _DistanceField:
    """Distances to the nearest of some spots, by cells: wrong by half a cell's diagonal at most.

    Parameters
    ----------
    spots : (m, 3) array
        [mm]
    reach : float
        Distances beyond are infinite [mm].
    cell : float
        Edge of a cell [mm].
    """

    def __init__(self, spots: Array, reach: float, cell: float) -> None:
        low, high = spots.min(axis=0) - reach, spots.max(axis=0) + reach
        self.cell = cell
        self.origin = low - self.cell  # a border of cells that are too far from any spot
        shape = np.ceil((high - low) / self.cell).astype(np.intp) + 2
        self.last = (shape - 1).astype(np.float64)
        self.strides = np.array([shape[1] * shape[2], shape[2], 1], dtype=np.float64)
        self.lengths = np.full(int(np.prod(shape)), np.inf, dtype=np.float32)
        width = int(np.ceil(reach / self.cell))
        around = np.stack(np.meshgrid(*[np.arange(-width, width + 1)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
        own = np.floor((spots - self.origin) / self.cell)
        cells = own[:, None, :] + around
        centres = self.origin + (cells + 0.5) * self.cell
        lengths = np.linalg.norm(centres - spots[:, None, :], axis=-1)
        inside = (lengths <= reach) & ((cells >= 0) & (cells <= self.last)).all(axis=-1)
        np.minimum.at(self.lengths, self._places(cells[inside]), lengths[inside].astype(np.float32))

    def of(self, points: Array) -> NDArray[np.float32]:
        """Rough distances (...,) of points (..., 3) to the nearest spot [mm]; infinite beyond the reach."""
        cells = np.floor((points - self.origin) / self.cell)
        np.clip(cells, 0.0, self.last, out=cells)
        result: NDArray[np.float32] = self.lengths[self._places(cells)]
        return result

    def _places(self, cells: Array) -> NDArray[np.intp]:
        result: NDArray[np.intp] = (cells @ self.strides).astype(np.intp)
        return result
