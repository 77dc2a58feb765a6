"""The rigid transform from positions and orientations together, each with a weight of its own.

A spot's position says where the transform takes a point, its orientation how it turns. With noise of ``sigma_mm`` per
coordinate and ``sigma_deg`` per component of a turn the most likely transform minimises

    sum |R s + t - r|^2 / sigma_mm^2  +  sum |R A - B|^2 / (2 sigma_deg^2)        (A, B: orientations as matrices)

which adds the terms ``A B' / (2 sigma_deg^2)`` to the covariance matrix of Kabsch and Umeyama and is solved by one
singular value decomposition. ``|R A - B|^2 / 2`` is the square of the turn between the two [rad], up to its fourth
power: the likelihood is that of the matrix Fisher distribution (C. G. Khatri and K. V. Mardia, J. R. Statist. Soc. B
39 (1977)). Weights that are not given are estimated, as variance components (W. Foerstner, 1979; the Helmert equations
in their simple form): squares over what the six parameters leave of each kind of observation.

Orientations make the transform determined where positions leave a part open: spots on a line, two spots, one spot.
There a constant turn of the tool frame between the two lists cannot be told from a turn of the frame; elsewhere it
widens the estimate of ``sigma_deg`` and so takes the weight off the orientations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats
from scipy.spatial.transform import Rotation

from respot.registration.errors import RegistrationError
from respot.registration.outlier_test import SCALE_FLOOR, f_limit
from respot.registration.rigid import (
    COLLINEAR_TOLERANCE,
    RigidFit,
    check_pairs,
    fit_rigid,
    rotations_from_covariance,
)
from respot.registration.row_order import own_order

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

INLIER_CHI = float(stats.chi.ppf(0.999, 3))
ANGLE_FLOOR = 1e-3
"""A finer scatter of orientations than this is printing [deg]: quaternions of 5 digits."""
_MEDIAN_CHI = float(stats.chi.median(3))
_STARTS = 50
_TURNS = 50
_SETTLED = 1e-7  # relative change of both weights


@dataclass(frozen=True, eq=False)
class OrientedFit:
    """A rigid transform from positions and orientations.

    Attributes
    ----------
    rigid : RigidFit
        Rotation, translation and what they leave of the positions; its rank may be 0 (one spot) or 1 (on a line).
    turns : (n, 3) array
        Rotation vector from each reference orientation to the predicted one, reference frame [deg].
    agree : (n,) bool array
        Orientations that took part: within 99.9 % of their scatter, the others are wrong. Positions all take part.
    sigma_mm, sigma_deg : float
        Noise per coordinate [mm] and per component of a turn [deg], as given or estimated; 1 where it was to be
        estimated and the six parameters leave nothing to do so (one spot).
    covariance : (6, 6) array
        Of t [mm] and w [rad], a left perturbation about the centroid of the predicted spots, as `unit_covariance` has
        it, for these two.
    centroid : (3,) array
        Mean of the predicted spots, which is that of the reference's [mm].
    degrees_of_freedom : int
        3 n + 3 (orientations that took part) - 6.
    """

    rigid: RigidFit
    turns: Array
    agree: Mask
    sigma_mm: float
    sigma_deg: float
    covariance: Array
    centroid: Array
    degrees_of_freedom: int

    @property
    def half_width(self) -> Array:
        """Half of the 95 % interval of each of tx, ty, tz [mm] and rx, ry, rz [deg], by Student's t."""
        free = max(self.degrees_of_freedom, 1)
        units = np.array([1.0, 1.0, 1.0, *[180.0 / np.pi] * 3])
        result: Array = float(stats.t.ppf(0.975, free)) * units * np.sqrt(np.diag(self.covariance))
        return result


def fit_rigid_oriented(
    source: ArrayLike,
    reference: ArrayLike,
    source_rotations: Rotation,
    reference_rotations: Rotation,
    sigma_mm: float | None = None,
    sigma_deg: float | None = None,
) -> OrientedFit:
    """Most likely rigid transform of paired poses; wrong orientations are told and left out.

    Parameters
    ----------
    source, reference : (n, 3) arrays, n >= 1
        Positions without outliers [mm].
    source_rotations, reference_rotations : Rotation of n
        Orientations of the same spots, each in its own frame.
    sigma_mm : float, optional
        Noise of a position per coordinate [mm]; estimated if left out.
    sigma_deg : float, optional
        Noise of an orientation per component of a turn [deg]; estimated if left out. With infinity orientations say
        nothing and this is `fit_rigid`.

    Raises
    ------
    RegistrationError
        As `check_pairs`; ``SHAPE_MISMATCH`` for another number of orientations, ``BAD_OPTION`` for a sigma that is not
        positive.
    DegenerateError
        As `fit_rigid`, if ``sigma_deg`` is infinite or fewer than one orientation agrees with the others.
    """
    first, second = check_pairs(source, reference, minimum=1)
    for rotations in (source_rotations, reference_rotations):
        if rotations.single or len(rotations) != len(first):
            raise RegistrationError("SHAPE_MISMATCH", f"orientations must be one for each of the {len(first)} pairs")
    for name, sigma in (("sigma_mm", sigma_mm), ("sigma_deg", sigma_deg)):
        if sigma is not None and not sigma > 0.0:
            raise RegistrationError("BAD_OPTION", f"{name} is {sigma}: it must be positive")
    poses = _Poses(first, second, source_rotations.as_matrix(), reference_rotations.as_matrix())
    given = sigma_mm, sigma_deg
    if sigma_deg == np.inf:
        fit_rigid(first, second)  # refuses what positions alone do not determine
        agree = np.zeros(len(first), dtype=bool)
        start = poses.rotation(agree, (1.0, np.inf))
        return _answer(poses, start, agree, poses.sigmas(start, agree, given, (1.0, np.inf)))
    agree = np.ones(len(first), dtype=bool)
    rotation = _start(poses)
    size = poses.sigmas(rotation, agree, given, (1.0, 1.0))
    for _ in range(_TURNS):
        lengths = np.linalg.norm(poses.turns(rotation), axis=1)
        kept = lengths <= _limit(lengths, sigma_deg)
        same, before, agree = bool((kept == agree).all()), size, kept
        size = poses.sigmas(rotation, agree, given, size)
        rotation = poses.rotation(agree, size)
        if same and np.allclose(size, before, rtol=_SETTLED, atol=0.0):
            break
    if not agree.any():
        fit_rigid(first, second)
    return _answer(poses, rotation, agree, size)


def _limit(lengths: Array, sigma_deg: float | None) -> float:
    """How far a good orientation may be turned [deg]; from their median where the noise is not known."""
    if sigma_deg is not None:
        return INLIER_CHI * sigma_deg
    if len(lengths) < 3:
        return float("inf")  # two that differ do not say which is wrong
    scale = max(float(np.median(lengths)) / _MEDIAN_CHI, ANGLE_FLOOR)
    return scale * float(np.sqrt(f_limit(max(len(lengths), 4))))


class _Poses:
    """Pairs about their centroids, and the sums that a fit takes from them. Angles in degrees."""

    def __init__(self, source: Array, reference: Array, own: Array, other: Array) -> None:
        self.source, self.reference = source, reference
        self.middles = source.mean(axis=0), reference.mean(axis=0)
        self.about = source - self.middles[0], reference - self.middles[1]
        self.said = other @ np.swapaxes(own, 1, 2)  # B A': what a spot's orientation alone says the rotation is

    def rotation(self, agree: Mask, size: tuple[float, float]) -> Array:
        """Best rotation (3, 3) for noise ``size`` [mm, deg]."""
        positions = self.about[0].T @ self.about[1] / size[0] ** 2
        turns = self.said[agree].sum(axis=0).T / (2.0 * np.radians(size[1]) ** 2)
        result: Array = rotations_from_covariance(positions + turns)[0]
        return result

    def residuals(self, rotation: Array) -> Array:
        """Predicted minus reference (n, 3) [mm], with the best translation."""
        result: Array = self.about[0] @ rotation.T - self.about[1]
        return result

    def turns(self, rotation: Array) -> Array:
        """Rotation vectors (n, 3) from the reference's orientations to the predicted ones, reference frame [deg]."""
        result: Array = np.degrees(Rotation.from_matrix(rotation @ np.swapaxes(self.said, 1, 2)).as_rotvec())
        return result

    def lever(self, rotation: Array) -> Array:
        """Normal matrix (3, 3) of a turn [rad] about the centroid by the positions, for unit noise [mm^2]."""
        about = self.about[0] @ rotation.T
        scatter = about.T @ about
        result: Array = np.trace(scatter) * np.eye(3) - scatter
        return result

    def sigmas(
        self,
        rotation: Array,
        agree: Mask,
        given: tuple[float | None, float | None],
        size: tuple[float, float],
    ) -> tuple[float, float]:
        """Noise [mm, deg] as given, or by what the parameters leave of the squares at weights ``size``."""
        sigma_mm, sigma_deg = given
        lever, pairs = self.lever(rotation), len(self.source)
        count = int(agree.sum())
        of_turns = count / np.radians(size[1]) ** 2 * np.eye(3)
        taken = float(np.trace(np.linalg.pinv(lever / size[0] ** 2 + of_turns, hermitian=True) @ of_turns))
        if sigma_mm is None:
            left = 3.0 * pairs - 3.0 - (3.0 - taken)
            square = float(np.sum(self.residuals(rotation) ** 2))
            sigma_mm = max(float(np.sqrt(square / left)), SCALE_FLOOR) if left > 0.1 else size[0]
        if sigma_deg is None:
            left = 3.0 * count - taken
            square = float(np.sum(self.turns(rotation)[agree] ** 2))
            sigma_deg = max(float(np.sqrt(square / left)), ANGLE_FLOOR) if left > 0.1 else size[1]
        return sigma_mm, sigma_deg


def _start(poses: _Poses) -> Array:
    """Of the rotations that single spots say, and that of the positions, the one most spots agree with."""
    order = own_order(poses.source, poses.reference)
    some = order[np.unique(np.linspace(0, len(order) - 1, min(_STARTS, len(order))).astype(int))]
    by_positions = rotations_from_covariance(poses.about[0].T @ poses.about[1])[0]
    starts = np.concatenate([by_positions[None], poses.said[some]])
    # the median turn [deg] plus the median residual as a turn at the spots' own distance: neither is moved by a few
    cosines = (np.einsum("bij,nij->bn", starts, poses.said) - 1.0) / 2.0
    angles = np.degrees(np.arccos(np.clip(cosines, -1.0, 1.0)))
    left = np.linalg.norm(np.einsum("bij,nj->bni", starts, poses.about[0]) - poses.about[1], axis=2)
    reach = max(float(np.sqrt(np.mean(np.sum(poses.about[0] ** 2, axis=1)))), 1e-9)
    costs = np.median(angles, axis=1) + np.degrees(np.sqrt(np.mean(left**2, axis=1)) / reach)
    result: Array = starts[int(np.argmin(costs))]
    return result


def _answer(poses: _Poses, rotation: Array, agree: Mask, size: tuple[float, float]) -> OrientedFit:
    lever, pairs, count = poses.lever(rotation), len(poses.source), int(agree.sum())
    covariance = np.zeros((6, 6))
    covariance[:3, :3] = size[0] ** 2 / pairs * np.eye(3)
    covariance[3:, 3:] = np.linalg.inv(lever / size[0] ** 2 + count / np.radians(size[1]) ** 2 * np.eye(3))
    about = poses.about[0]
    values = np.linalg.eigvalsh(about.T @ about / pairs)[::-1]
    spread: Array = np.sqrt(np.clip(values, 0.0, None))
    across = rotations_from_covariance(about.T @ poses.about[1] / pairs)
    rigid = RigidFit(
        rotation=rotation,
        translation=poses.middles[1] - rotation @ poses.middles[0],
        residuals=poses.residuals(rotation),
        spread=spread,
        rank=int(np.sum(spread > max(COLLINEAR_TOLERANCE * spread[0], SCALE_FLOOR))),
        mirrored=bool(across[2] < 0 and across[1][2] > COLLINEAR_TOLERANCE * across[1][0]),
    )
    free = 3 * pairs + 3 * count - 6
    return OrientedFit(rigid, poses.turns(rotation), agree, *size, covariance, poses.middles[1], free)
