"""Where a calibration was fitted: the hull of its spots, and which points lie outside of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

Array = NDArray[np.float64]

#: Spots extend along an axis where their RMS extent is more than this share of the widest one.
_FLAT = 1e-3
#: Coordinates are written to the micrometre: nearer than this is on the hull [mm].
_ROUNDING_MM = 1e-3


def outside(spots: Array, points: Array, margin: float = 0.0) -> NDArray[np.bool_]:
    """Which points lie outside the hull of the spots by more than a margin.

    Spots in a plane (or on a line) have a flat hull: a point is outside where it leaves the plane, or the hull in it.

    Parameters
    ----------
    spots : (n, 3) array, n >= 1
        [mm]
    points : (m, 3) array
        [mm]
    margin : float
        By how much spots are uncertain themselves [mm].

    Returns
    -------
    (m,) bool array
        Distances are to the planes of the hull's faces: near an edge a point may be farther than it says.
    """
    reach = margin + _ROUNDING_MM
    centre = spots.mean(axis=0)
    _, extent, axes = np.linalg.svd(spots - centre, full_matrices=True)
    extent = np.concatenate([extent, np.zeros(3 - len(extent))])
    wide = extent > max(_FLAT * extent[0], _ROUNDING_MM)
    own, others = (spots - centre) @ axes.T, (points - centre) @ axes.T
    beyond: NDArray[np.bool_] = np.zeros(len(points), dtype=bool)
    for axis in np.flatnonzero(~wide):
        beyond |= (others[:, axis] > own[:, axis].max() + reach) | (others[:, axis] < own[:, axis].min() - reach)
    return np.asarray(beyond | _beyond_hull(own[:, wide], others[:, wide], reach))


def _beyond_hull(own: Array, others: Array, reach: float) -> NDArray[np.bool_]:
    if own.shape[1] == 0:
        return np.zeros(len(others), dtype=bool)
    box = ((others > own.max(axis=0) + reach) | (others < own.min(axis=0) - reach)).any(axis=1)
    if own.shape[1] == 1:
        return np.asarray(box)
    try:
        faces = ConvexHull(own).equations
    except QhullError:  # pragma: no cover - a hull that rounding makes flat: its box is the least that is known
        return np.asarray(box)
    return np.asarray((others @ faces[:, :-1].T + faces[:, -1] > reach).any(axis=1))
