"""Which spots belong to a model with effects: the outlier test of the rigid fit, with the effects' columns in it."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from respot.calibration.discovery.joint_fit import SCALE_FLOOR, JointFit

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

LEVEL = 0.999
VOLUME_MM3 = 80.0**3
"""Where an outlier may lie: to weigh a model with few outliers against one with many."""
_TURNS = 40
_SHARE = 20


def judged(fit: JointFit) -> tuple[Array, Mask]:
    """Held-out residuals (n, 3) [mm, source frame] of each spot by the others, and which pass the outlier test.

    As `respot.registration.outlier_test`, linear about the solution; an inlier is judged by the fit of the others.

    Parameters
    ----------
    fit : JointFit
    """
    return _judge(fit.columns, fit.linear, fit.inliers, fit.ridge)[:2]


def settled(fit: JointFit) -> Mask:
    """Inliers (n,) with none left to move, from those of a fit, linear about its solution."""
    wanted, inliers = fit.linear, fit.inliers.copy()
    seen: set[bytes] = set()
    for _ in range(_TURNS):
        key = np.packbits(inliers).tobytes()
        if key in seen:
            break
        seen.add(key)
        _, passes, excess = _judge(fit.columns, wanted, inliers, fit.ridge)
        some = max(1, int(inliers.sum()) // _SHARE)
        coming = np.flatnonzero(~inliers & passes)
        going = np.flatnonzero(inliers & ~passes)
        if len(coming):
            inliers[coming[np.argsort(excess[coming])[:some]]] = True
        elif len(going) and int(inliers.sum()) > fit.columns.shape[2]:
            inliers[going[np.argsort(-excess[going])[:some]]] = False
        else:
            break
    return inliers


def _judge(columns: Array, wanted: Array, inliers: Mask, ridge: Array) -> tuple[Array, Mask, Array]:
    size = columns.shape[2]
    design = columns[inliers].reshape(-1, size)
    gram = design.T @ design
    inverse = np.linalg.pinv(gram + np.diag(ridge), rcond=1e-13, hermitian=True)
    answer = inverse @ (design.T @ wanted[inliers].ravel())
    left = columns @ answer - wanted
    spread = np.einsum("nik,kl,njl->nij", columns, inverse, columns)
    sign = np.where(inliers, -1.0, 1.0)[:, None, None]
    inner = np.linalg.pinv(np.eye(3) + sign * spread, rcond=1e-6, hermitian=True)
    heldout = np.where(inliers[:, None], np.einsum("nij,nj->ni", inner, left), left)
    values = np.einsum("ni,nij,nj->n", left, inner, left)
    count = int(inliers.sum())
    used = float(np.trace(inverse @ gram))
    total = float(np.sum(left[inliers] ** 2))
    free = max(3.0 * count - used, 1.0)
    less = max(free - 3.0, 1.0)
    floor = SCALE_FLOOR**2
    limit_out, limit_in = _limit(round(free, 1)), _limit(round(less, 1))
    outside = values / (max(total / free, floor) * limit_out)
    inside = values / (np.maximum((total - values) / less, floor) * limit_in)
    excess = np.where(inliers, inside, outside)
    return heldout, excess <= 1.0, excess


@lru_cache(maxsize=1024)
def _limit(free: float) -> float:
    """Largest test value of a good spot, by the degrees of freedom of the noise."""
    return 3.0 * float(stats.f.ppf(LEVEL, 3, free))


def misfit(fit: JointFit) -> float:
    """How badly a model and its choice of inliers explain all pairs: twice the negative logarithm of a likelihood.

    An inlier scatters about its place, an outlier lies anywhere in `VOLUME_MM3`; each parameter costs as by Schwarz.
    """
    count, all_pairs = int(fit.inliers.sum()), len(fit.inliers)
    used = 3.0 * count - fit.free
    inside = 3.0 * count * (np.log(2.0 * np.pi * fit.sigma**2) + 1.0)
    return float(inside + 2.0 * (all_pairs - count) * np.log(VOLUME_MM3) + used * np.log(all_pairs))
