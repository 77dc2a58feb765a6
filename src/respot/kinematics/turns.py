"""Full turns: an angle and the same angle plus 360 degrees are one pose and two joint positions."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from respot.geometry import Array

#: Turns that an axis is searched over, to both sides; ABB counts quadrants -5..4 and up to 8.
TURNS = 360.0 * np.arange(-3, 4)
#: Inverse kinematics comes back to an angle but for rounding: so near to a border, nothing is beyond it [deg; mm].
ROUNDING = 1e-6


def nearest_turn(joints: Array, near: npt.ArrayLike, revolute: npt.NDArray[np.bool_]) -> Array:
    """Joints (..., axes) plus the full turns that bring each revolute axis nearest to ``near`` [deg]."""
    turns = np.round((np.asarray(near, dtype=float) - joints) / 360.0)
    return np.asarray(joints + 360.0 * turns * revolute)


def outside(joints: Array, limits: Array | None) -> Array:
    """How far each joint (..., axes) lies outside the limits (axes, 2), 0 inside and on them [deg or mm]."""
    if limits is None:
        return np.zeros_like(joints)
    beyond = np.maximum(limits[:, 0] - joints, joints - limits[:, 1])
    return np.asarray(np.where(beyond <= ROUNDING, 0.0, beyond))


def chosen_turn(joints: Array, consistent: npt.NDArray[np.bool_], limits: Array | None) -> tuple[Array, Array]:
    """Take of each angle the turn that is consistent, inside the limits if possible, and else nearest to zero.

    Parameters
    ----------
    joints : Array
        Angles plus each of `TURNS`, shape (..., axes, turns).
    consistent : ndarray of bool
        Whether an angle agrees with what the program says, same shape.
    limits : Array or None
        Limits, shape (axes, 2).

    Returns
    -------
    angles, found : Array
        The angles, shape (..., axes), and whether any turn was consistent.
    """
    beyond = outside(np.moveaxis(joints, -2, -1), limits)
    cost = np.abs(joints) + 1e6 * (np.moveaxis(beyond, -1, -2) > 0.0)
    cost = np.where(consistent, cost, np.inf)
    best = np.argmin(cost, axis=-1)[..., None]
    angles = np.take_along_axis(joints, best, axis=-1)[..., 0]
    found = np.isfinite(np.take_along_axis(cost, best, axis=-1)[..., 0])
    return np.asarray(angles), np.asarray(found)
