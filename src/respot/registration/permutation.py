"""A permutation test for a renaming: whether the same residuals could be renamed away wherever they lay."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

DRAWS = 999


def placement_p_value(predicted: Array, reference: Array, permutation: Rows, cycle: Rows, *, seed: int) -> float:
    """Share of random placements of a cycle's residual vectors that a renaming explains as well.

    Under the null hypothesis names are right and the residual vectors of the cycle's members, as named, might as well
    have come at any other spots (exchangeable, as in Freedman and Lane's test: directions and lengths are kept, so
    residuals that prefer the flange keep preferring it). The statistic is the fall of the sum of squares by the best
    renaming among the spots drawn. ``p = (1 + as good) / (1 + draws)``.

    Parameters
    ----------
    predicted, reference : (n, 3) arrays
        Images of the source spots, and the reference spots as named [mm].
    permutation : (n,) int array
        Accepted renaming: source row i belongs to reference row ``permutation[i]``.
    cycle : (k,) int array
        Rows of the cycle under test.
    seed : int
        Of the 999 draws.
    """
    rng = np.random.default_rng(seed)
    n, k = len(predicted), len(cycle)
    vectors = predicted[cycle] - reference[cycle]
    observed = np.sum(vectors**2) - np.sum((predicted[cycle] - reference[permutation[cycle]]) ** 2)
    if n <= 2000:
        drawn = np.argsort(rng.random((DRAWS, n)), axis=1)[:, :k]
    else:
        drawn = np.stack([rng.choice(n, k, replace=False) for _ in range(DRAWS)])
    places = reference[drawn]
    moved = places + vectors
    squares = np.sum((moved[:, :, None, :] - places[:, None, :, :]) ** 2, axis=-1)
    as_named = np.trace(squares, axis1=1, axis2=2)
    if k == 2:
        renamed = squares[:, 0, 1] + squares[:, 1, 0]
    else:
        renamed = np.array([cost[linear_sum_assignment(cost)].sum() for cost in squares])
    as_good = int(np.count_nonzero(as_named - renamed >= observed * (1.0 - 1e-9)))
    return (1 + as_good) / (1 + DRAWS)
