"""Simulated lines as the engine sees them. The simulator shares no code with the engine."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import RigidTransform

from respot.calibration.covariates import covariates_of
from respot.calibration.discovery.discover import Discovery, discover
from respot.calibration.observations import Observations
from respot.kinematics.robots import find_robot
from respot.registration.robust import fit_robust
from respot.simulation import Line, simulate

ROBOT = "kr210_r2700_extra"
NOISE = 0.1


@dataclass(frozen=True)
class Seen:
    """A line and what was found on it."""

    line: Line
    observations: Observations
    found: Discovery

    @property
    def effects(self):
        return [each.term.effect for each in self.found.accepted]


def observations_of(line: Line) -> Observations:
    texts = {name: [str(value) for value in values] for name, values in line.columns.items()}
    numbers = {name: np.asarray(v, dtype=float) for name, v in line.columns.items() if v.dtype != object}
    travel = np.zeros(line.n) if line.external_axes is None else line.external_axes[:, 0]
    foot = RigidTransform.from_translation(travel[:, None] * np.array([0.0, 1.0, 0.0]))  # the rail runs along y
    return Observations(
        line.positions,
        line.rotations,
        line.joints,
        line.measured_joints,
        find_robot(str(line.robot["name"])),
        base2source=foot,
        external_axes=line.external_axes,
        columns=covariates_of(texts, numbers, ())[0],
    )


def look(*effects: str, seed: int = 11, spots: int = 80, noise: float | None = NOISE, rows=None, **options) -> Seen:
    """Simulate a line and look for effects; `noise` is what the engine is told."""
    line = simulate(ROBOT, spots, NOISE, effects, seed, rail=any(name.startswith("rail") for name in effects))
    seen, measured = observations_of(line), line.measured
    if rows is not None:
        seen, measured = seen.rows(rows), measured[rows]
    robust = fit_robust(seen.positions, measured)
    defaults = {"draws": 199, "nested": False, "inliers": robust.inliers}
    return Seen(line, seen, discover(seen, measured, noise=noise, **{**defaults, **options}))
