"""Noise that differs by direction: a test for it, and the rigid fit that weighs each direction by its own noise.

The test is Mauchly's for sphericity (Ann. Math. Stat. 11 (1940)), with its distribution for few spots simulated for
these very spots. The fit is generalised least squares with one covariance of the residual vectors for all spots,
estimated from them in turn with the fit (feasible generalised least squares), and drawn towards a sphere as far as few
residuals demand (Chen, Wiesel, Eldar and Hero, IEEE Trans. Signal Process. 58 (2010), their OAS).

When weighing gains: where noise is uneven and a turn moves spots along a quiet direction as well as a noisy one, so
that the quiet one can tell the turn. With noise of 0.5 / 4.9 / 1.7 mm along x / y / z, as at the rear door, the largest
error of the transform falls by 16 / 27 / 38 % for 8 / 14 / 60 spots in a box, by 14 to 18 % for a flange;
the error at new spots by 6 to 25 %. With noise that is the same along all axes nothing is gained and no more than 0.6
% lost (`scripts/registration_study.py --only directions`). Its residuals are larger than those of plain least squares,
whose sum of squares is the least there is: it promises a better transform, not a smaller RMS. Of few spots its
intervals hold a little less often (93 to 95 % at 8).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats
from scipy.spatial.transform import Rotation

from respot.registration.covariance import jacobian
from respot.registration.errors import RegistrationError
from respot.registration.outlier_test import SCALE_FLOOR
from respot.registration.rigid import RigidFit, check_pairs, fit_rigid
from respot.registration.row_order import own_order

Array = NDArray[np.float64]

SIGNIFICANCE = 0.01
DRAWS = 999
_LEAST = 6  # fewer spots say nothing about the shape of their noise
_MANY = 2000  # spots; beyond, Bartlett's chi-square holds
_TURNS, _STEPS = 30, 10


@dataclass(frozen=True, eq=False)
class WeightedFit:
    """Rigid fit that weighs residuals by the noise of their direction.

    Attributes
    ----------
    rigid : RigidFit
        The transform, with the residuals of all pairs given.
    inliers : (n,) bool array
        Pairs that took part.
    noise : (3, 3) array
        Covariance of one residual vector that the weights come from, reference frame [mm^2].
    covariance : (6, 6) array
        Of the transform, for the scatter of the residuals as it is, not drawn towards a sphere: t [mm], w [rad] about
        ``centroid``, as `unit_covariance` has it.
    centroid : (3,) array
        Mean of the predicted spots that took part [mm].
    degrees_of_freedom : int
        m - 2 for m that took part, of Student's t for intervals: each direction has a noise of its own.
    shrinkage : float
        How far ``noise`` was drawn towards a sphere, 0 to 1.
    """

    rigid: RigidFit
    inliers: NDArray[np.bool_]
    noise: Array
    covariance: Array
    centroid: Array
    degrees_of_freedom: int
    shrinkage: float

    @property
    def rotation(self) -> Array:
        """Of `rigid`."""
        return self.rigid.rotation

    @property
    def translation(self) -> Array:
        """Of `rigid`."""
        return self.rigid.translation

    @property
    def residuals(self) -> Array:
        """Of `rigid`."""
        return self.rigid.residuals

    @property
    def half_width(self) -> Array:
        """Half of the 95 % interval of each of tx, ty, tz [mm] and rx, ry, rz [deg], by Student's t."""
        units = np.array([1.0, 1.0, 1.0, *[180.0 / np.pi] * 3])
        result: Array = float(stats.t.ppf(0.975, self.degrees_of_freedom)) * units * np.sqrt(np.diag(self.covariance))
        return result


def isotropy_p_value(source: ArrayLike, reference: ArrayLike, *, seed: int = 0) -> float:
    """Chance that noise which is the same along all axes leaves residuals of the rigid fit as uneven as these.

    Gaussian noise is drawn 999 times for these spots and the fit taken from it (first order); of more than 2000 spots
    Bartlett's approximation is taken, chi-square with 5 degrees of freedom. 1 where the residuals are rounding. The
    order of the rows plays no part.

    Parameters
    ----------
    source, reference : (n, 3) arrays, n >= 6
        Pairs without outliers [mm].
    seed : int
        Of the draws.

    Raises
    ------
    RegistrationError
        As `fit_rigid`; ``TOO_FEW_PAIRS`` for fewer than 6 pairs.
    """
    first, second = check_pairs(source, reference, minimum=_LEAST)
    order = own_order(first, second)
    rigid = fit_rigid(first[order], second[order])
    residuals, n = rigid.residuals, len(first)
    if float(np.mean(np.square(residuals))) <= SCALE_FLOOR**2:
        return 1.0
    if n > _MANY:
        return rough_isotropy_p_value(residuals)
    observed = float(_sphericity(residuals[None])[0])
    predicted = rigid.predict(first[order])
    basis = np.linalg.qr(jacobian(predicted - predicted.mean(axis=0)).reshape(-1, 6))[0]
    rng = np.random.default_rng(seed)
    below = 0
    for _ in range(9):
        drawn = rng.normal(size=(DRAWS // 9, 3 * n))
        drawn -= (drawn @ basis) @ basis.T
        below += int(np.count_nonzero(_sphericity(drawn.reshape(-1, n, 3)) <= observed))
    return (1 + below) / (1 + DRAWS)


def rough_isotropy_p_value(residuals: Array) -> float:
    """As `isotropy_p_value`, from the residuals (n, 3) of a rigid fit by Bartlett's limit: for few spots rough."""
    if float(np.mean(np.square(residuals))) <= SCALE_FLOOR**2:
        return 1.0
    return float(stats.chi2.sf(-(len(residuals) - 2 - 23 / 18) * float(_sphericity(residuals[None])[0]), 5))


def _sphericity(residuals: Array) -> Array:
    """Mauchly's criterion (b,) of residuals (b, n, 3), as a logarithm: 0 for a sphere, else below."""
    scatter = np.swapaxes(residuals, 1, 2) @ residuals
    size = np.trace(scatter, axis1=1, axis2=2) / 3.0
    determinant = np.maximum(np.linalg.det(scatter / size[:, None, None]), 1e-300)
    result: Array = np.log(determinant)
    return result


def fit_weighted(source: ArrayLike, reference: ArrayLike, inliers: ArrayLike | None = None) -> WeightedFit:
    """Rigid fit that weighs residuals by the noise of their direction, estimated from them.

    Parameters
    ----------
    source, reference : (n, 3) arrays
        Pairs [mm].
    inliers : (n,) bool array, optional
        Pairs that take part, at least 6 (default all): those of `respot.registration.robust.fit_robust`.

    Raises
    ------
    RegistrationError
        As `fit_rigid`; ``TOO_FEW_PAIRS`` for fewer than 6 pairs that take part.
    """
    every, other = check_pairs(source, reference, minimum=_LEAST)
    chosen = np.ones(len(every), dtype=bool) if inliers is None else np.asarray(inliers, dtype=bool)
    if chosen.shape != (len(every),):
        raise RegistrationError("SHAPE_MISMATCH", f"{len(every)} pairs, but inliers are {chosen.shape}")
    first, second = check_pairs(every[chosen], other[chosen], minimum=_LEAST)
    rigid = fit_rigid(first, second)
    rotation, translation = rigid.rotation, rigid.translation
    residuals, (noise, shrinkage) = rigid.residuals, noise_covariance(rigid.residuals)
    for _ in range(_TURNS):
        rotation, translation = _generalised(first, second, rotation, translation, noise)
        residuals = first @ rotation.T + translation - second
        before = noise
        noise, shrinkage = noise_covariance(residuals)
        if np.allclose(noise, before, rtol=1e-9, atol=1e-9 * float(np.trace(noise))):
            break
    weight: Array = np.asarray(np.linalg.inv(noise), dtype=np.float64)
    predicted = first @ rotation.T + translation
    return WeightedFit(
        rigid=replace(
            rigid, rotation=rotation, translation=translation, residuals=every @ rotation.T + translation - other
        ),
        inliers=chosen,
        noise=noise,
        covariance=_covariance(predicted, weight, _scatter(residuals)),
        centroid=predicted.mean(axis=0),
        degrees_of_freedom=len(first) - 2,
        shrinkage=shrinkage,
    )


def noise_covariance(residuals: Array) -> tuple[Array, float]:
    """Covariance (3, 3) of one residual vector of a rigid fit [mm^2], and how far it was drawn towards a sphere.

    The scatter over n - 2 (six parameters are two spots' worth), then OAS. Never below the rounding of printed numbers.
    Drawn less it fits uneven noise a little better, but with 8 to 14 spots its 95 % intervals held in 89 to
    93 % of simulated fits only.

    Parameters
    ----------
    residuals : (n, 3) array, n >= 3 [mm]
    """
    free, scatter = len(residuals) - 2, _scatter(residuals)
    share = float(_sphere_share(scatter, free))
    return drawn_to_sphere(scatter, free), share


def drawn_to_sphere(scatter: Array, free: ArrayLike) -> Array:
    """Covariances (..., 3, 3) drawn towards a sphere by OAS, never below the rounding of printed numbers [mm^2].

    Parameters
    ----------
    scatter : (..., 3, 3) array
        Mean outer products of residual vectors [mm^2].
    free : (...) array
        Over how many degrees of freedom.
    """
    share = _sphere_share(scatter, free)[..., None, None]
    sphere = np.trace(scatter, axis1=-2, axis2=-1)[..., None, None] / 3.0
    result: Array = (1.0 - share) * scatter + (share * sphere + SCALE_FLOOR**2) * np.eye(3)
    return result


def _sphere_share(scatter: Array, free: ArrayLike) -> Array:
    """How far (...) OAS draws: 1 all the way."""
    sphere = np.trace(scatter, axis1=-2, axis2=-1) / 3.0
    square = np.sum(np.square(scatter), axis=(-2, -1))
    uneven = square - 3.0 * sphere**2
    need = (square / 3.0 + 9.0 * sphere**2) / (np.asarray(free) + 1.0 / 3.0)
    result: Array = np.where(uneven > need, need / np.where(uneven > need, uneven, 1.0), 1.0)
    return result


def _scatter(residuals: Array) -> Array:
    result: Array = residuals.T @ residuals / (len(residuals) - 2)
    return result


def _generalised(
    source: Array, reference: Array, rotation: Array, translation: Array, noise: Array
) -> tuple[Array, Array]:
    """Gauss-Newton to the generalised least squares for a known noise."""
    weight = np.linalg.inv(noise)
    for _ in range(_STEPS):
        predicted = source @ rotation.T + translation
        centroid = predicted.mean(axis=0)
        rows = jacobian(predicted - centroid)
        weighed = np.einsum("ij,njk->nik", weight, rows)
        normal = np.einsum("nik,nil->kl", rows, weighed)
        step = -np.linalg.solve(normal, np.einsum("nik,ni->k", weighed, predicted - reference))
        turn = Rotation.from_rotvec(step[3:]).as_matrix()
        rotation, translation = turn @ rotation, turn @ (translation - centroid) + centroid + step[:3]
        if float(np.abs(step[:3]).max()) < 1e-9 and float(np.abs(step[3:]).max()) < 1e-13:
            break
    return rotation, translation


def plain_covariance(points: Array, noise: Array) -> Array:
    """Covariance (6, 6) of the *unweighted* least-squares transform where the noise differs by direction.

    ``(J'J)^-1 J' S J (J'J)^-1`` with the covariance S of one residual vector: what intervals of the plain fit rest on
    where the noise is not a sphere. For t [mm] and w [rad] about the centroid, as `unit_covariance` has it.

    Parameters
    ----------
    points : (n, 3) array
        Predicted points, reference frame [mm]; not collinear.
    noise : (3, 3) array
        Covariance of one residual vector [mm^2].

    Raises
    ------
    RegistrationError
        ``SHAPE_MISMATCH`` for a noise that is not (3, 3).
    """
    if noise.shape != (3, 3):
        raise RegistrationError("SHAPE_MISMATCH", f"the noise must be a (3, 3) covariance, not {noise.shape}")
    return _covariance(points, np.eye(3), noise)


def _covariance(points: Array, weight: Array, noise: Array) -> Array:
    """Covariance (6, 6) of the least-squares transform of some weight under some noise (White's sandwich)."""
    rows = jacobian(points - points.mean(axis=0))
    weighed = np.einsum("ij,njk->nik", weight, rows)
    inverse = np.linalg.inv(np.einsum("nik,nil->kl", rows, weighed))
    result: Array = inverse @ np.einsum("nik,ij,njl->kl", weighed, noise, weighed) @ inverse
    return result
