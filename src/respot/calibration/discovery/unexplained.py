"""Is structure left that no effect explains? Against a known noise, and by what near spots have in common."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats
from scipy.spatial import cKDTree

from respot.calibration.discovery.joint_fit import JointFit
from respot.calibration.observations import Observations

Array = NDArray[np.float64]

FLOOR = 1.1
"""The floor is reached when what is left is at most this many times the known noise (DESIGN section 6)."""
ALPHA = 0.01
_DRAWS = 400
_NEIGHBOURS = 3
_SHOWN = 3


@dataclass(frozen=True)
class Correlate:
    """Something that the residual follows: share of its sum of squares, and how often chance does as well."""

    column: str
    strength: float
    p_value: float


@dataclass(frozen=True)
class Unexplained:
    """What is left beyond noise.

    Attributes
    ----------
    present : bool
    text : str
        Why, in words.
    correlates : tuple of Correlate
        What the residual follows most, strongest first.
    ratio : float or None
        Noise left over noise known; None where none is known.
    reached : bool or None
        Whether the known noise is reached; None where none is known.
    """

    present: bool
    text: str
    correlates: tuple[Correlate, ...]
    ratio: float | None
    reached: bool | None


def unexplained(fit: JointFit, observations: Observations, noise: float | None, seed: int) -> Unexplained:
    """Look for structure in what a model leaves.

    Parameters
    ----------
    fit : JointFit
    observations : Observations
        n spots.
    noise : float or None
        Known standard deviation per coordinate [mm].
    seed : int
        Of the permutations.
    """
    rows = np.flatnonzero(fit.inliers)
    vectors = fit.in_source[rows]
    found = _correlates(vectors, observations.rows(rows), seed)
    ratio = None if not noise else fit.sigma / noise
    if ratio is not None and noise is not None:
        by_chance = float(stats.chi2.sf(fit.free * ratio**2, fit.free))
        if ratio > FLOOR and by_chance < ALPHA:
            text = (
                f"{fit.sigma:.3f} mm per coordinate are left, {ratio:.2f} times the noise that is known ({noise:g} mm)"
            )
            return Unexplained(True, text, found[:_SHOWN], ratio, False)
        if ratio <= FLOOR:
            return Unexplained(
                False, f"what is left is the noise that is known ({ratio:.2f} times)", found[:_SHOWN], ratio, True
            )
    strong = [each for each in found if each.p_value * len(found) < ALPHA]
    if strong:
        names = ", ".join(each.column for each in strong[:_SHOWN])
        text = f"what is left is not by chance alone: near values of {names} leave errors that are alike"
        return Unexplained(True, text, found[:_SHOWN], ratio, None if ratio is None else ratio <= FLOOR)
    return Unexplained(
        False, "what is left shows no structure", found[:_SHOWN], ratio, None if ratio is None else ratio <= FLOOR
    )


def _correlates(vectors: Array, observations: Observations, seed: int) -> tuple[Correlate, ...]:
    """For each thing known of the spots: how alike the errors of spots with near values are."""
    rng = np.random.default_rng(seed)
    count = len(vectors)
    if count < 2 * _NEIGHBOURS + 2:
        return ()
    orders = np.argsort(rng.random((_DRAWS, count)), axis=1)
    total = float(np.sum(vectors**2))
    found = []
    for name, features in _features(observations).items():
        tree = cKDTree(features)
        # equal values are near in any order: a hair of noise draws it
        near = np.asarray(tree.query(features, k=min(_NEIGHBOURS + 1, count))[1])[:, 1:]
        alike = _alike(vectors[None], near)[0]
        by_chance = _alike(vectors[orders], near)
        p_value = float((1 + np.count_nonzero(by_chance >= alike)) / (1 + _DRAWS))
        found.append(Correlate(name, float(np.clip(alike / total, -1.0, 1.0)), p_value))
    return tuple(sorted(found, key=lambda each: (each.p_value, -each.strength)))


def _alike(vectors: Array, near: NDArray[np.intp]) -> Array:
    """Sum over spots of the product of each error with the mean of its neighbours', (draws,)."""
    return np.asarray(np.einsum("dni,dnki->d", vectors, vectors[:, near]) / near.shape[1])


def _features(observations: Observations) -> dict[str, Array]:
    """What spots can be near in: place, tool orientation, joints, each column."""
    rng = np.random.default_rng(0)
    found = {"place": observations.positions}
    if observations.rotations is not None:
        found["orientation"] = observations.tools.reshape(-1, 9)
    if observations.joints is not None:
        found["joints"] = observations.joints
    for name, column in observations.columns.items():
        if column.values is not None:
            values = column.values
        elif column.labels is not None:
            values = np.unique(np.array(column.labels, dtype=object).astype(str), return_inverse=True)[1].astype(float)
        else:
            continue
        span = max(float(np.ptp(values)), 1e-12)
        found[name] = (values + rng.random(len(values)) * 1e-6 * span)[:, None]
    return found
