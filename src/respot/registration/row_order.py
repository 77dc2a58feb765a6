"""An order of pairs that is their own, so that seeded draws do not depend on how a table is sorted."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_DECIMALS = 6  # of a millimetre: moving a table by a rigid motion rounds its distances far below


def own_order(source: Array, reference: Array) -> NDArray[np.intp]:
    """Rows (n,) by their distances from the two centroids, and by coordinates where these agree.

    Shuffled pairs are put into the same order; so are pairs that were moved by rigid motions, unless distances agree.

    Parameters
    ----------
    source, reference : (n, 3) arrays [mm]
    """
    middles = source.mean(axis=0), reference.mean(axis=0)
    near, far = (
        np.round(np.linalg.norm(points - middle, axis=1), _DECIMALS)
        for points, middle in zip((source, reference), middles, strict=True)
    )
    order: NDArray[np.intp] = np.argsort(near, kind="stable")
    if (np.diff(near[order]) == 0.0).any():  # rarely: the other keys cost as much each
        order = np.lexsort((*reference.T, *source.T, far, near))
    return order
