"""The joint least-squares fit of the rigid part and all accepted effects, exact in the arm, with its covariance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from respot.calibration.discovery.evening import uneven_noise
from respot.calibration.effects.catalogue import columns_of
from respot.calibration.effects.moved import moved, tip_of
from respot.calibration.effects.term import Term
from respot.calibration.observations import Observations
from respot.registration.covariance import jacobian
from respot.registration.rigid import transform_of

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

SCALE_FLOOR = 1e-3
"""A finer scale than a micrometre is printing, not noise [mm]."""
TIP_MM = 2.0
"""Columns are made anew where the tool turns out to be this far from where they were made: levers are metres."""
_TURNS = 25
_STILL = 1e-9


@dataclass(frozen=True, eq=False)
class JointFit:
    """A rigid transform with effects, ``reference = rotation @ moved(source) + translation``, and what it leaves.

    Attributes
    ----------
    terms : tuple of Term
    values : tuple of arrays
        Of the parameters of each term.
    rotation, translation : (3, 3) and (3,) arrays
        The rigid part, source to reference [mm].
    moved : (n, 3) array
        Source spots with the effects, source frame [mm].
    rotations : Rotation of n, or None
        Their orientations, source frame.
    residuals : (n, 3) array
        Predicted minus reference, all pairs [mm].
    inliers : (n,) bool array
    columns : (n, 3, 6 + k) array
        Derivatives of the moved spots, source frame, of all pairs: rigid part (mm, rad times ``extent``) and parameters
        in units of their priors.
    priors : (k,) array
    extent : float
        [mm]
    sigma : float
        Noise per coordinate, ``sqrt(SSR / free)`` [mm].
    free : float
        3m - 6 - effective number of parameters.
    """

    terms: tuple[Term, ...]
    values: tuple[Array, ...]
    rotation: Array
    translation: Array
    moved: Array
    rotations: Rotation | None
    residuals: Array
    inliers: Mask
    columns: Array
    priors: Array
    extent: float
    sigma: float
    free: float

    @cached_property
    def in_source(self) -> Array:
        """Residuals along the axes of the source frame (n, 3) [mm]."""
        return np.asarray(self.residuals @ self.rotation)

    @cached_property
    def ridge(self) -> Array:
        """Diagonal (6 + k,) that the priors add to the normal matrix, in units of variance."""
        return np.concatenate([np.zeros(6), np.full(len(self.priors), self.sigma**2)])

    @cached_property
    def normal(self) -> Array:
        """Normal matrix of the inliers with the priors (6 + k, 6 + k)."""
        design = self.columns[self.inliers].reshape(-1, self.columns.shape[2])
        return np.asarray(design.T @ design + np.diag(self.ridge))

    @cached_property
    def inverse(self) -> Array:
        """Inverse of the normal matrix: the covariance for unit noise, in units of the priors."""
        return np.asarray(np.linalg.pinv(self.normal, rcond=1e-13, hermitian=True), dtype=np.float64)

    @cached_property
    def noise(self) -> Array | None:
        """Covariance (3, 3) of the noise, source frame, where it is not the same along all axes; None where it is."""
        return uneven_noise(self.in_source[self.inliers], self.free)

    @cached_property
    def _spread(self) -> Array:
        """Covariance (6 + k, 6 + k) in units of the priors: of least squares under the noise as it is."""
        if self.noise is None:
            return np.asarray(self.sigma**2 * self.inverse)
        rows = self.columns[self.inliers]
        middle = np.einsum("nik,ij,njl->kl", rows, self.noise, rows, optimize=True) + self.sigma**2 * np.diag(
            self.ridge
        )
        return np.asarray(self.inverse @ middle @ self.inverse)

    @cached_property
    def value_sd(self) -> tuple[Array, ...]:
        """Standard deviations of each term's values, in their units."""
        sd = np.sqrt(np.maximum(np.diag(self._spread)[6:], 0.0)) * self.priors
        return split_by(sd, [len(value) for value in self.values])

    @cached_property
    def covariance(self) -> Array:
        """Covariance (6 + k, 6 + k) of the rigid part and the parameters.

        The rigid part as a left perturbation about the inliers' calibrated centroid, tx, ty, tz [mm] and rx, ry, rz
        [deg] along the axes of the reference frame; the parameters in their units.
        """
        turn = np.eye(6 + len(self.priors))
        turn[:3, :3] = self.rotation
        turn[3:6, 3:6] = self.rotation * np.degrees(1.0 / self.extent)
        turn[6:, 6:] = np.diag(self.priors)
        found = turn @ self._spread @ turn.T
        return np.asarray((found + found.T) / 2.0)

    @property
    def linear(self) -> Array:
        """What the linear model about the solution is fitted to, source frame (n, 3) [mm]."""
        at = np.concatenate([np.zeros(6), *self.values]) if self.values else np.zeros(6)
        scaled = np.concatenate([at[:6], at[6:] / self.priors]) if len(self.priors) else at
        return np.asarray(self.columns @ scaled - self.in_source)


def split_by(vector: Array, sizes: Sequence[int]) -> tuple[Array, ...]:
    """Parts of a vector, of so many numbers each."""
    stops = np.cumsum([0, *sizes]).tolist()
    return tuple(vector[start:stop] for start, stop in pairwise(stops))


def fit_jointly(
    observations: Observations, reference: Array, terms: Sequence[Term], inliers: Mask, start: Sequence[Array] = ()
) -> JointFit:
    """Least squares over the inliers: Gauss-Newton with the columns of the nominal arm and tool, exact predictions.

    Parameters
    ----------
    observations : Observations
        n spots.
    reference : (n, 3) array
        [mm]
    terms : sequence of Term
    inliers : (n,) bool array
    start : sequence of arrays, optional
        Values to begin with.
    """
    points = observations.positions
    extent = max(float(np.sqrt(np.mean((points[inliers] - points[inliers].mean(axis=0)) ** 2))), 1e-9)
    priors = np.array([parameter.prior for term in terms for parameter in term.parameters])
    columns = np.empty((len(points), 3, 6 + len(priors)))
    tip = np.full(3, np.inf)
    sizes = [len(term.parameters) for term in terms]
    scaled = np.concatenate([*start]) / priors if start else np.zeros(len(priors))
    count = int(inliers.sum())
    sigma, free = 0.0, float(max(3 * count - 6, 1))

    def split(vector: Array) -> tuple[Array, ...]:
        return split_by(vector * priors, sizes)

    for _ in range(_TURNS):
        now = tip_of(terms, split(scaled))
        if float(np.abs(now - tip).max()) > TIP_MM:
            tip = now
            columns[:, :, 6:] = columns_of(observations.tipped(tip), terms)
        places, _rotations = moved(observations, terms, split(scaled))
        rotation, translation = transform_of(places[inliers], reference[inliers])
        left = ((reference - translation) @ rotation - places)[inliers].ravel()
        sigma = max(float(np.sqrt(left @ left / free)), SCALE_FLOOR)
        columns[:, :, :6] = jacobian((places - places[inliers].mean(axis=0)) / extent)
        design = columns[inliers].reshape(-1, columns.shape[2])
        gram = design.T @ design
        ridge = np.concatenate([np.zeros(6), np.full(len(priors), sigma**2)])
        inverse = np.linalg.pinv(gram + np.diag(ridge), rcond=1e-13, hermitian=True)
        gradient = design.T @ left
        gradient[6:] -= sigma**2 * scaled
        step = (inverse @ gradient)[6:]
        free = max(3.0 * count - float(np.trace(inverse @ gram)), 1.0)
        scaled = scaled + step
        if not len(step) or float(np.abs(step).max()) < _STILL:
            break
    values = split(scaled)
    places, rotations = moved(observations, terms, values)
    rotation, translation = transform_of(places[inliers], reference[inliers])
    residuals = places @ rotation.T + translation - reference
    sigma = max(float(np.sqrt(np.sum(residuals[inliers] ** 2) / free)), SCALE_FLOOR)
    return JointFit(
        tuple(terms),
        values,
        rotation,
        translation,
        places,
        rotations,
        residuals,
        inliers,
        columns,
        priors,
        extent,
        sigma,
        free,
    )
