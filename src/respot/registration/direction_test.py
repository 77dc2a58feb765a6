"""The outlier test for noise that differs by direction: residuals are weighed by the noise of their own direction.

By its length alone a residual of 12 mm is an outlier, or none, whether it lies along a flange, where people space spots
by hand, or across it. Where residuals show that their noise is not the same along all axes, each pair is judged by
``d' V^-1 d``: d is its residual under the least-squares fit of the *other* inliers, and V the covariance of d for the
covariance S of one residual vector, which is estimated from these others and drawn towards a sphere as far as few
residuals demand (`respot.registration.anisotropy.noise_covariance`). Three times a quantile of F with 3 and
``(3 m - 6) * direction_share(S)`` degrees of freedom is the limit, for m others: of a sphere the plain test
(`respot.registration.outlier_test`), and of very many pairs chi-square. Hotelling's T^2, which takes nothing of S for
known, lets 13 others judge by 7.1 standard deviations only, and almost nobody would be an outlier.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from respot.registration.anisotropy import drawn_to_sphere, noise_covariance
from respot.registration.covariance import jacobian, unit_covariance
from respot.registration.errors import RegistrationError
from respot.registration.outlier_test import LEVEL, PARAMETERS, settle
from respot.registration.rigid import fit_rigid, transform_of

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

LEAST_WITNESSES = 6
"""Fewer residuals do not tell the noise of three directions."""
_CONCENTRATED, _SHARE, _STEPS = 30, 0.75, 20
_GROWTH = 5  # no more than one in so many comes or goes in a turn: a core of three quarters grows quickly
_MANY = 1000  # inliers; of more the prediction is certain beside the noise, and one pair does not move it


def settle_by_direction(source: Array, reference: Array, inliers: Mask) -> Mask:
    """As `respot.registration.outlier_test.settle_inliers`, with each direction's own noise.

    Parameters
    ----------
    source, reference : (n, 3) arrays [mm]
    inliers : (n,) bool array
        Where to start. Of many the nearest three quarters, by a covariance that is theirs alone: bad spots that lie
        beside each other must not widen the noise that lets them in.
    """
    return settle(source, reference, _nearest(source, reference, inliers), direction_excess, _GROWTH)


def _nearest(source: Array, reference: Array, inliers: Mask) -> Mask:
    """Three quarters of the inliers, if they are many, by the noise of their direction (concentration steps)."""
    rows = np.flatnonzero(inliers)
    if len(rows) < _CONCENTRATED:
        return inliers
    nearest, chosen = rows, np.zeros(0, dtype=np.intp)
    for _ in range(_STEPS):
        rotation, translation = transform_of(source[nearest], reference[nearest])
        residuals = source[rows] @ rotation.T + translation - reference[rows]
        noise = noise_covariance(residuals[np.isin(rows, nearest)])[0]
        lengths = np.einsum("ni,ij,nj->n", residuals, np.linalg.inv(noise), residuals, optimize=True)
        chosen, nearest = nearest, rows[np.sort(np.argsort(lengths, kind="stable")[: int(_SHARE * len(rows))])]
        if np.array_equal(chosen, nearest):
            break
    core = np.zeros_like(inliers)
    core[nearest] = True
    return core


def direction_excess(source: Array, reference: Array, inliers: Mask) -> Array:
    """Test value of each pair over its limit, (n,): above 1 the pair is an outlier to all other inliers.

    Inliers are judged in closed form (first order) without themselves.

    Parameters
    ----------
    source, reference : (n, 3) arrays [mm]
    inliers : (n,) bool array

    Raises
    ------
    RegistrationError
        ``TOO_FEW_PAIRS`` for fewer than 7 inliers.
    DegenerateError
        The inliers lie on a line.
    """
    pairs = int(inliers.sum())
    if pairs <= LEAST_WITNESSES:
        raise RegistrationError("TOO_FEW_PAIRS", f"{pairs} inliers, at least {LEAST_WITNESSES + 1} tell directions")
    rigid = fit_rigid(source[inliers], reference[inliers])
    predicted = rigid.predict(source)
    residuals = predicted - reference
    if pairs > _MANY:
        noise = noise_covariance(residuals[inliers])[0]
        lengths = np.einsum("ni,ij,nj->n", residuals, np.linalg.inv(noise), residuals, optimize=True)
        return np.asarray(lengths / direction_limit(noise[None], np.array([pairs])), dtype=np.float64)
    unit, centroid = unit_covariance(predicted[inliers])
    offsets = predicted - centroid
    rows = jacobian(offsets)
    hat = rows @ unit @ np.swapaxes(rows, 1, 2)
    own, ours = residuals[inliers], offsets[inliers]
    scatter = np.broadcast_to(own.T @ own, hat.shape).copy()
    alone = residuals.copy()
    # a direction in which only this pair speaks (eigenvalue 0) says nothing about it
    share = np.linalg.pinv(np.eye(3) - hat[inliers], rcond=1e-6, hermitian=True)
    alone[inliers] = np.einsum("nij,nj->ni", share, own)
    scatter[inliers] += _without(ours, own, np.einsum("kl,nil,ni->nk", unit, rows[inliers], alone[inliers]))
    others = pairs - inliers.astype(np.intp)
    noise = drawn_to_sphere(scatter / (others - 2)[:, None, None], others - 2)
    spread = _spread(noise, rows, unit, ours)
    crossed = hat[inliers] @ noise[inliers]
    spread[inliers] -= crossed + np.swapaxes(crossed, 1, 2)
    spread += noise
    spread[inliers] = share @ spread[inliers] @ share
    values = np.einsum("ni,nij,nj->n", alone, np.linalg.pinv(spread, rcond=1e-9, hermitian=True), alone)
    result: Array = values / direction_limit(noise, others)
    return result


def direction_limit(noise: Array, others: Array | NDArray[np.intp]) -> Array:
    """Largest value of a good pair: 3 times 99.9 % of F with 3 and ``(3 m - 6) * direction_share`` degrees of freedom.

    Parameters
    ----------
    noise : (n, 3, 3) array
        Covariance of one residual vector [mm^2].
    others : (n,) array
        How many pairs told it.
    """
    evenness = np.trace(noise, axis1=1, axis2=2) ** 2 / (3.0 * np.sum(noise**2, axis=(1, 2)))
    limit: Array = 3.0 * stats.f.ppf(LEVEL, 3, (3 * others - PARAMETERS) * evenness)
    return limit


def _without(offsets: Array, residuals: Array, step: Array) -> Array:
    """What taking a pair out adds to the scatter (n, 3, 3) of the residuals, itself included.

    The fit moves by ``step`` (n, 6): all residuals change by ``t + w x offset``, and the pair's own is gone.
    """
    shift, turn = step[:, :3], step[:, 3:]
    cross = np.zeros((len(step), 3, 3))
    cross[:, 0, 1], cross[:, 0, 2], cross[:, 1, 2] = -turn[:, 2], turn[:, 1], -turn[:, 0]
    cross -= np.swapaxes(cross, 1, 2)
    mixed = cross @ (offsets.T @ residuals)
    changed = mixed + np.swapaxes(mixed, 1, 2) + len(offsets) * shift[:, :, None] * shift[:, None, :]
    changed -= cross @ (offsets.T @ offsets) @ cross
    own = residuals + shift + np.einsum("nij,nj->ni", cross, offsets)
    result: Array = changed - own[:, :, None] * own[:, None, :]
    return result


def _spread(noise: Array, rows: Array, unit: Array, offsets: Array) -> Array:
    """Covariance (n, 3, 3) of predictions by the least-squares fit of pairs at ``offsets``, for noise (n, 3, 3)."""
    columns = jacobian(offsets)
    tensor = np.einsum("jka,jlb->klab", columns, columns, optimize=True)
    normal = np.einsum("nkl,klab->nab", noise, tensor)
    lever = rows @ unit
    result: Array = lever @ normal @ np.swapaxes(lever, 1, 2)
    return result
