"""The least-squares rigid transform between paired points.

S. Umeyama, *Least-squares estimation of transformation parameters between two point patterns*,
IEEE PAMI 13 (1991), without its scale; W. Kabsch, Acta Cryst. A32 (1976).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import RigidTransform

from respot.registration.errors import DegenerateError, RegistrationError

Array = NDArray[np.float64]

COLLINEAR_TOLERANCE = 1e-3
"""Spots count as collinear when their spread across the best line is below this share of the spread along it.

At one thousandth, a metre of spots strays a millimetre from its line: as much as spots are uncertain,
so that the rotation about the line would be noise."""

BLOCK = 4096
"""Pairs summed at once: what they need stays in the cache, large tables take no copies, and products are too small for
a linear algebra library to spread over threads, which costs more than it gains."""


@dataclass(frozen=True, eq=False)
class RigidFit:
    """A rigid transform ``reference = rotation @ source + translation`` and what it leaves.

    Attributes
    ----------
    rotation : (3, 3) array
        Proper rotation, source to reference.
    translation : (3,) array
        Image of the source origin in the reference frame [mm].
    residuals : (n, 3) array
        Predicted minus reference, for every pair given, weighted or not [mm].
    spread : (3,) array
        RMS extent of the (weighted) source along its principal axes, widest first [mm].
    rank : int
        Number of axes along which the source extends (2: coplanar, 3: spatial).
    mirrored : bool
        True if a reflection would fit spatial points better than any rotation does: the sign of an
        axis, or the handedness of a frame, is probably wrong.
    """

    rotation: Array
    translation: Array
    residuals: Array
    spread: Array
    rank: int
    mirrored: bool

    @property
    def source2reference(self) -> RigidTransform:
        """The transform as scipy object."""
        return RigidTransform.from_matrix(homogeneous(self.rotation, self.translation))

    def predict(self, points: ArrayLike) -> Array:
        """Source points (..., 3) in the reference frame [mm]."""
        return np.asarray(points, dtype=np.float64) @ self.rotation.T + self.translation


def homogeneous(rotation: Array, translation: Array) -> Array:
    """Build the (4, 4) matrix of a rotation and a translation [mm]."""
    matrix = np.eye(4)
    matrix[:3, :3] = rotation
    matrix[:3, 3] = translation
    return matrix


def check_pairs(source: ArrayLike, reference: ArrayLike, minimum: int = 3) -> tuple[Array, Array]:
    """Return both point sets as (n, 3) float arrays, or say what is wrong with them.

    Raises
    ------
    RegistrationError
        ``SHAPE_MISMATCH`` if they are not (n, 3) of equal n, ``NOT_A_NUMBER`` for NaN or infinity,
        ``TOO_FEW_PAIRS`` for fewer than ``minimum`` pairs.
    """
    first, second = np.asarray(source, dtype=np.float64), np.asarray(reference, dtype=np.float64)
    if first.ndim != 2 or first.shape[1] != 3 or first.shape != second.shape:
        raise RegistrationError(
            "SHAPE_MISMATCH", f"source and reference must both be (n, 3): got {first.shape} and {second.shape}"
        )
    finite = np.isfinite(first).all(axis=1) & np.isfinite(second).all(axis=1)
    if not finite.all():
        rows = tuple(int(row) for row in np.flatnonzero(~finite))
        shown = ", ".join(str(row + 1) for row in rows[:5])
        raise RegistrationError("NOT_A_NUMBER", f"a coordinate is not a finite number in pair {shown}", rows=rows)
    if len(first) < minimum:
        raise RegistrationError("TOO_FEW_PAIRS", f"{len(first)} pairs, at least {minimum} are needed")
    return first, second


def rotations_from_covariance(covariance: Array) -> tuple[Array, Array, Array]:
    """Best rotations for cross-covariances ``sum(source_centred outer reference_centred)``.

    Parameters
    ----------
    covariance : (..., 3, 3) array

    Returns
    -------
    rotations : (..., 3, 3) array
        Proper rotations (determinant +1), source to reference.
    values : (..., 3) array
        Singular values of ``covariance``, largest first.
    sign : (...) array
        -1 where the unconstrained optimum is a reflection.
    """
    left, values, right = np.linalg.svd(covariance)
    sign = np.where(np.linalg.det(left) * np.linalg.det(right) < 0, -1.0, 1.0)
    left[..., :, 2] *= sign[..., None]
    return np.swapaxes(left @ right, -1, -2), values, sign


def transform_of(source: Array, reference: Array, weights: Array | None = None) -> tuple[Array, Array]:
    """Rotation and translation alone, unchecked; leading axes are a batch.

    Parameters
    ----------
    source, reference : (..., n, 3) arrays [mm]
    weights : (..., n) array, optional
        Non-negative, of positive sum.

    Returns
    -------
    rotations : (..., 3, 3) array
    translations : (..., 3) array [mm]
    """
    if weights is None:
        source_mean, reference_mean = source.mean(axis=-2), reference.mean(axis=-2)
        left = source - source_mean[..., None, :]
    else:
        share = weights / weights.sum(axis=-1, keepdims=True)
        source_mean = np.einsum("...n,...nk->...k", share, source)
        reference_mean = np.einsum("...n,...nk->...k", share, reference)
        left = (source - source_mean[..., None, :]) * share[..., None]
    covariance = np.swapaxes(left, -1, -2) @ (reference - reference_mean[..., None, :])
    rotations, _, _ = rotations_from_covariance(covariance)
    return rotations, reference_mean - np.einsum("...ij,...j->...i", rotations, source_mean)


def fit_rigid(
    source: ArrayLike, reference: ArrayLike, weights: ArrayLike | None = None, *, checked: bool = True
) -> RigidFit:
    """Least-squares rigid transform of paired points (Umeyama 1991, eq. 40 and 41, scale 1).

    Parameters
    ----------
    source, reference : (n, 3) arrays
        Paired points in their own frames [mm].
    weights : (n,) array, optional
        Non-negative weight of each pair; pairs of weight 0 take no part and still get a residual.
    checked : bool
        Refuse degenerate pairs. Unchecked where wrong pairs are still among them: one spot a kilometre off, by a digit
        too many, makes the others look like a point.

    Raises
    ------
    RegistrationError
        See `check_pairs`; ``TOO_FEW_PAIRS`` also for fewer than 3 pairs of positive weight.
    DegenerateError
        The pairs that take part coincide or lie on a line.
    """
    first, second = check_pairs(source, reference)
    share = np.ones(len(first)) if weights is None else np.asarray(weights, dtype=np.float64)
    if share.shape != (len(first),) or not np.isfinite(share).all() or (share < 0).any():
        raise RegistrationError("SHAPE_MISMATCH", "weights must be n finite numbers, none of them negative")
    used = share > 0
    if int(used.sum()) < 3:
        raise RegistrationError("TOO_FEW_PAIRS", f"{int(used.sum())} pairs take part, at least 3 are needed")
    share = share / share.sum()
    source_mean, reference_mean = share @ first, share @ second
    own, other, covariance = _scatters(first, second, source_mean, reference_mean, share)
    spread = _principal_spread(own)
    if checked:
        _require_plane(spread, "source")
        _require_plane(_principal_spread(other), "reference")
    rotation, values, sign = rotations_from_covariance(covariance)
    if checked and values[1] + sign * values[2] <= COLLINEAR_TOLERANCE**2 * values[0]:
        raise DegenerateError(
            "source and reference do not correspond along more than one direction: "
            "the rotation about that direction is not determined"
        )
    translation = reference_mean - rotation @ source_mean
    residuals = np.empty_like(first)
    for begin in range(0, len(first), BLOCK):
        rows = slice(begin, begin + BLOCK)
        residuals[rows] = first[rows] @ rotation.T + translation - second[rows]
    return RigidFit(
        rotation=rotation,
        translation=translation,
        residuals=residuals,
        spread=spread,
        rank=int(np.sum(spread > COLLINEAR_TOLERANCE * spread[0])),
        mirrored=bool(sign < 0 and values[2] > COLLINEAR_TOLERANCE * values[0]),
    )


def _scatters(
    source: Array, reference: Array, source_mean: Array, reference_mean: Array, share: Array
) -> tuple[Array, Array, Array]:
    """Weighted sums of outer products about the means: source, reference, source with reference."""
    own, other, across = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3))
    for begin in range(0, len(source), BLOCK):
        rows = slice(begin, begin + BLOCK)
        first, second = source[rows] - source_mean, reference[rows] - reference_mean
        weighted = first * share[rows, None]
        own += weighted.T @ first
        across += weighted.T @ second
        other += (second * share[rows, None]).T @ second
    return own, other, across


def _principal_spread(scatter: Array) -> Array:
    spread: Array = np.sqrt(np.clip(np.linalg.eigvalsh(scatter)[::-1], 0.0, None))
    return spread


def _require_plane(spread: Array, name: str) -> None:
    if spread[0] <= 1e-9:
        raise DegenerateError(f"all {name} spots coincide: no part of the rotation is determined")
    if spread[1] <= COLLINEAR_TOLERANCE * spread[0]:
        raise DegenerateError(
            f"the {name} spots lie on one line ({spread[1]:.3f} mm across it, {spread[0]:.1f} mm along it, RMS): "
            "the rotation about that line is not determined; add spots away from it"
        )
