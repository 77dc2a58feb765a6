"""Table 1 of the paper, typed in as (id, actual, theoretical); and points for tests, made without the engine."""

from __future__ import annotations

import math

import numpy as np

TABLE = """
P02WP1615438 4257.08 49.53 1248.03 4324.31 28.43 1276.51
P02WP1615437 4255.23 114.52 1248.16 4322.70 98.41 1276.51
P02WP1615436 4252.13 184.89 1248.86 4319.14 170.64 1276.53
P02WP1615435 4246.20 260.35 1248.50 4313.76 240.44 1276.54
P02WP1615434 4239.06 331.98 1248.27 4306.86 306.93 1276.06
P02WP1615429 4257.75 -12.68 1251.36 4324.31 -28.42 1276.51
P02WP1615430 4256.56 -78.91 1249.58 4322.70 -98.40 1276.51
P02WP1615431 4252.93 -150.92 1249.72 4319.14 -170.63 1276.53
P02WP1615432 4247.77 -217.33 1249.88 4313.76 -240.42 1276.54
P02WP1615441 4190.09 -217.68 1562.07 4257.65 -243.95 1587.09
P02WP1615439 4193.76 -165.34 1564.44 4262.80 -176.02 1588.74
P02WP1609707 4195.78 -123.72 1565.15 4264.60 -137.22 1588.04
P02WP1615442 4195.30 164.86 1564.11 4262.80 176.03 1588.74
P02WP1609713 4194.65 197.62 1563.47 4264.60 137.23 1588.04
"""
SWAPPED = ("P02WP1615442", "P02WP1609713")


def rear_door() -> tuple[list[str], np.ndarray, np.ndarray]:
    rows = [line.split() for line in TABLE.strip().splitlines()]
    numbers = np.array([[float(word) for word in row[1:]] for row in rows])
    return [row[0] for row in rows], numbers[:, :3], numbers[:, 3:]


def repaired() -> tuple[list[str], np.ndarray, np.ndarray]:
    ids, source, reference = rear_door()
    reference = reference.copy()
    reference[[12, 13]] = reference[[13, 12]]
    return ids, source, reference


def turn(axis: tuple[float, float, float], degrees: float) -> np.ndarray:
    """Rodrigues' formula, written out."""
    length = math.sqrt(sum(component**2 for component in axis))
    x, y, z = (component / length for component in axis)
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    d = 1 - c
    return np.array(
        [
            [c + x * x * d, x * y * d - z * s, x * z * d + y * s],
            [y * x * d + z * s, c + y * y * d, y * z * d - x * s],
            [z * x * d - y * s, z * y * d + x * s, c + z * z * d],
        ]
    )


def move(points: np.ndarray, rotation: np.ndarray, shift: tuple[float, float, float]) -> np.ndarray:
    return np.array([[sum(rotation[i][k] * p[k] for k in range(3)) + shift[i] for i in range(3)] for p in points])


def random_motion(rng: np.random.Generator) -> tuple[np.ndarray, tuple[float, float, float]]:
    axis = rng.normal(size=3)
    x, y, z = rng.uniform(-3000, 3000, 3)
    return turn((axis[0], axis[1], axis[2]), rng.uniform(-180, 180)), (x, y, z)
