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
    apart = np.linalg.norm(source - middles[0], axis=1), np.linalg.norm(reference - middles[1], axis=1)
    keys = (*reference.T, *source.T, np.round(apart[1], _DECIMALS), np.round(apart[0], _DECIMALS))
    order: NDArray[np.intp] = np.lexsort(keys)
    return order
