"""Statistics of residual vectors: 3D distances, and the directions in which residuals point."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Distances:
    """RMS, mean and maximum of ``n`` 3D distances [mm]."""

    rms: float
    mean: float
    max: float
    n: int

    def to_dict(self) -> dict[str, float | int]:
        """Return the JSON object ``{rms, mean, max, n}``."""
        return {"rms": self.rms, "mean": self.mean, "max": self.max, "n": self.n}


def distances(vectors: Array) -> Distances:
    """Summarise difference vectors by their lengths.

    Parameters
    ----------
    vectors : (n, 3) array
        Difference vectors [mm]; ``n`` of 0 gives NaN figures.
    """
    lengths = np.linalg.norm(vectors, axis=-1)
    if lengths.size == 0:
        return Distances(float("nan"), float("nan"), float("nan"), 0)
    return Distances(rms(vectors), float(lengths.mean()), float(lengths.max()), int(lengths.size))


def rms(vectors: Array) -> float:
    """Root of the mean squared length of (n, 3) vectors [mm]: of 3D distances, not per coordinate."""
    return float(np.sqrt(np.mean(np.sum(np.square(vectors), axis=-1))))


@dataclass(frozen=True)
class ResidualDirections:
    """Spread of residuals, along the coordinate axes and along their own principal axes.

    Attributes
    ----------
    axes : (3, 3) array
        Principal directions as rows (unit vectors, reference frame), widest first; the largest
        component of each is positive.
    sd : (3,) array
        Standard deviation along each row of ``axes`` [mm].
    sd_xyz : (3,) array
        Standard deviation along x, y, z of the reference frame [mm].
    """

    axes: Array
    sd: Array
    sd_xyz: Array


def residual_directions(residuals: Array) -> ResidualDirections:
    """Principal axes and standard deviations of residual vectors.

    Eigenvectors of the scatter matrix of the centred residuals over n: the spread of these spots, nothing beyond them.

    Parameters
    ----------
    residuals : (n, 3) array, n >= 1
        Residual vectors in the reference frame [mm].
    """
    centred = residuals - residuals.mean(axis=0)
    scatter = centred.T @ centred / len(residuals)
    values, vectors = np.linalg.eigh(scatter)
    axes = vectors.T[::-1].copy()
    largest = np.take_along_axis(axes, np.argmax(np.abs(axes), axis=1)[:, None], axis=1)
    axes *= np.where(largest < 0, -1.0, 1.0)
    return ResidualDirections(axes, np.sqrt(np.clip(values[::-1], 0.0, None)), np.sqrt(np.diag(scatter)))
