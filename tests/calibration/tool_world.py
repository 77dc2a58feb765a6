"""Tables of weld spots with a gun that turns, made without the engine: positions, orientations, offset, noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

OFFSET = np.array([4.0, -3.0, 6.0])


@dataclass
class World:
    """Source positions (n, 3), tool orientations (n, 3, 3) and reference positions (n, 3), mm."""

    source: np.ndarray
    tools: np.ndarray
    reference: np.ndarray

    @property
    def ids(self) -> list[str]:
        return [f"W{row:03d}" for row in range(len(self.source))]


def matrix(vector: np.ndarray) -> np.ndarray:
    """Rotation about a vector by its length in radians: Rodrigues' formula, written out."""
    angle = float(np.linalg.norm(vector))
    if angle == 0.0:
        return np.eye(3)
    x, y, z = vector / angle
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross


def world(
    rng: np.random.Generator,
    n: int = 20,
    *,
    offset: np.ndarray = OFFSET,
    noise: float = 0.3,
    turn_deg: float = 25.0,
    axis: np.ndarray | None = None,
) -> World:
    """Spots in a box of a car side; the tool stands anyhow and turns by ``turn_deg`` (sd per axis) from spot to spot.

    With ``axis`` (tool frame) it turns about that axis alone.
    """
    source = rng.uniform(-1.0, 1.0, (n, 3)) * [800.0, 400.0, 600.0] + [1500.0, 300.0, 900.0]
    middle = matrix(rng.normal(size=3))
    spread = np.radians(turn_deg)
    if axis is None:
        turns = [matrix(rng.normal(size=3) * spread) for _ in range(n)]
    else:
        turns = [matrix(axis * rng.normal() * spread) for _ in range(n)]
    tools = np.array([middle @ turn for turn in turns])
    rotation, shift = matrix(rng.normal(size=3)), rng.uniform(-3000.0, 3000.0, 3)
    reference = np.array([rotation @ (p + tool @ offset) + shift for p, tool in zip(source, tools, strict=True)])
    return World(source, tools, reference + rng.normal(0.0, noise, (n, 3)))
