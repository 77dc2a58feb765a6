"""The transform that fixtures and public backups are converted by."""

from __future__ import annotations

import numpy as np

from tests.convert.independent import matrix

#: 30 mm, and 2 degrees about a skew axis through the middle of the spots.
AXIS = np.array([1.0, -2.0, 2.0]) / 3.0
SHIFT = np.array([18.0, -18.0, 16.0]) * 30.0 / np.linalg.norm([18.0, -18.0, 16.0])


def rotation_about_axis(axis: np.ndarray, degrees: float) -> np.ndarray:
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turn = np.radians(degrees)
    return np.eye(3) + np.sin(turn) * cross + (1.0 - np.cos(turn)) * cross @ cross


def transform_about(centre: np.ndarray) -> np.ndarray:
    turn = rotation_about_axis(AXIS, 2.0)
    return matrix(turn, centre + SHIFT - turn @ centre)
