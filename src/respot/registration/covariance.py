"""How well points determine a rigid transform: the normal matrix of a small left perturbation."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def unit_covariance(points: Array) -> tuple[Array, Array]:
    """Covariance of a rigid transform for noise of variance 1 per coordinate.

    A perturbed prediction is ``p' = c + exp([w]x) (p - c) + t`` with ``c`` the centroid, so each point has the rows
    ``J = [I, -[p - c]x]``; the covariance of ``(t, w)`` is the inverse of the sum of ``J'J``, which about the centroid
    has the blocks ``n I`` and ``sum(|d|^2 I - d d')`` and no others.

    Parameters
    ----------
    points : (n, 3) array
        Predicted points, reference frame [mm]; not collinear.

    Returns
    -------
    covariance : (6, 6) array
        For (t [mm], w [rad]).
    centroid : (3,) array
        The point about which it holds [mm].
    """
    centroid = points.mean(axis=0)
    offsets = points - centroid
    scatter = offsets.T @ offsets
    covariance = np.zeros((6, 6))
    covariance[:3, :3] = np.eye(3) / len(points)
    covariance[3:, 3:] = np.linalg.inv(np.trace(scatter) * np.eye(3) - scatter)
    return covariance, np.asarray(centroid, dtype=np.float64)


def jacobian(offsets: Array) -> Array:
    """Rows ``[I, -[d]x]`` (n, 3, 6) of points at ``offsets`` (n, 3) from the centroid [mm per (mm, rad)]."""
    rows = np.zeros((len(offsets), 3, 6))
    rows[:, :, :3] = np.eye(3)
    x, y, z = offsets.T
    rows[:, 0, 4], rows[:, 0, 5] = z, -y
    rows[:, 1, 3], rows[:, 1, 5] = -z, x
    rows[:, 2, 3], rows[:, 2, 4] = y, -x
    return rows


def leverage(points: Array, fitted: Array) -> Array:
    """Variance of the predicted position at ``points`` (m, 3), per coordinate, for unit noise at ``fitted`` (n, 3).

    The mean over the three coordinates of ``diag(J C J')``; a new measurement scatters with ``1 + leverage``.
    """
    covariance, centroid = unit_covariance(fitted)
    return unit_leverage(points - centroid, covariance)


def unit_leverage(offsets: Array, covariance: Array) -> Array:
    """As `leverage`, for ``offsets`` (m, 3) from the centroid [mm] and the ``covariance`` of `unit_covariance`.

    About the centroid t and w are uncorrelated: ``trace(J C J') = trace(C_tt) + d' (trace(C_ww) I - C_ww) d``.
    """
    turning = covariance[3:, 3:]
    form = np.trace(turning) * np.eye(3) - turning
    result: Array = (np.trace(covariance[:3, :3]) + np.einsum("ni,ni->n", offsets @ form, offsets)) / 3.0
    return result
