"""The joint least-squares fit of a rigid transform and a constant offset in the tool frame: the numbers alone.

``reference = rotation @ (source + tool @ offset) + translation``: 9 parameters. Given the offset, the rigid part is the
closed form of `respot.registration.rigid`; the offset is found by variable projection (G. Golub and V. Pereyra, SIAM J.
Numer. Anal. 10 (1973)): Gauss-Newton on what of the tool's columns the rigid part cannot imitate. Facts:
calibration.md sections 6 and 7.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from respot.registration.covariance import jacobian
from respot.registration.errors import RegistrationError
from respot.registration.rigid import transform_of

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

DETERMINED = 1e-3
"""A direction of the offset is determined when at least this part of its columns (RMS) is not a rigid motion.

With tools that turn by s radians (RMS) about axes across it a direction keeps about s: 0.001 is 0.06 degrees, what the
orientation of a robot is known to. How well a determined direction is known, its interval says."""

OPEN_SD = 1000.0
"""What is not determined of an offset is known to this standard deviation: guns are no longer [mm]."""

LEAST_SPOTS = 6
SCALE_FLOOR = 1e-3  # mm; a finer scale than a micrometre is printing, not noise
_STEPS = 40
_STILL_MM = 1e-9
_RANK = 1e-14
_SPOTS_APART = 200  # distances between more spots than these are not compared


@dataclass(frozen=True, eq=False)
class Identifiability:
    """What of a tool offset the spots determine beside the rigid part.

    Attributes
    ----------
    gains : (3,) array
        For each direction, the part of its columns (RMS, 0 to 1) that no rigid motion imitates; largest first.
    directions : (3, 3) array
        Unit vectors as rows, tool frame.
    """

    gains: Array
    directions: Array

    @property
    def determined(self) -> Mask:
        """Which directions (3,) are determined."""
        return np.asarray(self.gains > DETERMINED, dtype=np.bool_)

    @property
    def rank(self) -> int:
        """How many directions are determined."""
        return int(self.determined.sum())

    @property
    def condition(self) -> float:
        """Largest over smallest gain; infinite where one is zero."""
        return float(self.gains[0] / self.gains[2]) if self.gains[2] > 0.0 else float("inf")

    @property
    def basis(self) -> Array:
        """Determined directions as columns (3, rank), tool frame."""
        return self.directions[self.determined].T

    def known(self, axis: int) -> bool:
        """Whether the component along tool axis 0, 1 or 2 is determined: no open direction has a share in it."""
        return bool(np.all(np.abs(self.directions[~self.determined][:, axis]) < 0.01))


@dataclass(frozen=True, eq=False)
class ToolFit:
    """A rigid transform with a tool offset, and what it leaves.

    Attributes
    ----------
    offset : (3,) array
        From the TCP of the source to the point that was compared, tool frame [mm]; nothing along open directions.
    rotation, translation : (3, 3) and (3,) arrays
        The rigid part, source to reference [mm].
    moved : (n, 3) array
        ``source + tool @ offset``, source frame [mm].
    residuals : (n, 3) array
        Predicted minus reference, of all pairs [mm].
    inliers : (n,) bool array
        Pairs that were fitted.
    sigma : float
        Noise per coordinate, sqrt(SSR / (3m - 6 - rank)) over the m inliers [mm].
    degrees_of_freedom : int
        3m - 6 - rank.
    covariance : (9, 9) array
        Of t [mm] and w [rad], a left perturbation of the rigid part about ``centroid``, and of the offset in the tool
        frame [mm]. An open direction of the offset counts as 0 with a standard deviation of `OPEN_SD`.
    centroid : (3,) array
        Mean of the calibrated inliers, reference frame [mm].
    identifiability : Identifiability
    """

    offset: Array
    rotation: Array
    translation: Array
    moved: Array
    residuals: Array
    inliers: Mask
    sigma: float
    degrees_of_freedom: int
    covariance: Array
    centroid: Array
    identifiability: Identifiability


def moved_by(source: Array, tools: Array, offset: Array) -> Array:
    """Points (n, 3) that lie at ``offset`` in the tool frames ``tools`` (n, 3, 3) at ``source`` (n, 3) [mm]."""
    return np.asarray(source + tools @ offset, dtype=np.float64)


def identifiability(points: Array, tools: Array) -> Identifiability:
    """What spots (n, 3) with tool orientations (n, 3, 3) determine of an offset, in any frame [mm]."""
    _, open_columns = rigid_split(points, tools)
    _, values, right = np.linalg.svd(np.linalg.qr(open_columns, mode="r"))
    return Identifiability(values / np.sqrt(len(points)), right)


def rigid_split(points: Array, tools: Array) -> tuple[Array, Array]:
    """Orthonormal basis (3n, 6) of small rigid motions, and what is left of the tool's columns (3n, 3) beside them."""
    offsets = points - points.mean(axis=0)
    extent = max(float(np.sqrt(np.mean(offsets**2))), 1e-9)
    rigid = _orthonormal(jacobian(offsets / extent).reshape(-1, 6))
    return rigid, _beside(rigid, tools.reshape(-1, 3))


def _orthonormal(columns: Array) -> Array:
    """Orthonormal columns of the same span (..., n, k), by the k x k products: far quicker than QR for many spots."""
    values, vectors = np.linalg.eigh(np.swapaxes(columns, -1, -2) @ columns)
    known = values > _RANK * values[..., -1:]
    factor = np.where(known, 1.0 / np.sqrt(np.where(known, values, 1.0)), 0.0)
    return np.asarray(columns @ (vectors * factor[..., None, :]), dtype=np.float64)


def _beside(orthonormal: Array, columns: Array) -> Array:
    """What of columns lies outside a span; twice, since products lose half of the digits."""
    for _ in range(2):
        columns = columns - orthonormal @ (np.swapaxes(orthonormal, -1, -2) @ columns)
    return columns


def solve(
    source: Array,
    tools: Array,
    reference: Array,
    weights: Array,
    start: Array,
    basis: Array,
    still: float = _STILL_MM,
) -> Array:
    """Offset of the least-squares fit; leading axes are a batch.

    Parameters
    ----------
    source, reference : (..., n, 3) arrays [mm]
    tools : (..., n, 3, 3) array
    weights : (..., n) array
        Non-negative; at least 3 positive.
    start : (..., 3) array
        Where to begin [mm].
    basis : (3, k) array
        Directions in which the offset is sought; along others it stays that of ``start``.
    still : float
        A step below this ends the search [mm].

    Returns
    -------
    (..., 3) array [mm]
    """
    offset = np.array(start, dtype=np.float64)
    size = np.ones(offset.shape[:-1])
    roots = np.sqrt(weights)
    cost, step = _gauss_newton(source, tools, reference, weights, roots, offset, basis)
    for _ in range(_STEPS):
        tried = offset + size[..., None] * step
        tried_cost, tried_step = _gauss_newton(source, tools, reference, weights, roots, tried, basis)
        better = tried_cost <= cost
        moved = float(np.max(np.abs(size[..., None] * step), initial=0.0))
        offset = np.where(better[..., None], tried, offset)
        step = np.where(better[..., None], tried_step, step)
        cost = np.where(better, tried_cost, cost)
        size = np.where(better, np.minimum(2.0 * size, 1.0), 0.5 * size)
        if moved < still:
            break
    return offset


def _gauss_newton(
    source: Array, tools: Array, reference: Array, weights: Array, roots: Array, offset: Array, basis: Array
) -> tuple[Array, Array]:
    """Weighted sum of squares at an offset (rigid part refitted), and the step to the next one."""
    moved = source + np.einsum("...nij,...j->...ni", tools, offset)
    rotation, translation = transform_of(moved, reference, weights)
    back = np.einsum("...ji,...nj->...ni", rotation, reference - translation[..., None, :])
    left = (moved - back) * roots[..., None]
    total = weights.sum(axis=-1)[..., None]
    arms = moved - np.einsum("...n,...nk->...k", weights, moved)[..., None, :] / total[..., None]
    extent = np.maximum(np.sqrt(np.mean(arms**2, axis=(-2, -1))), 1e-9)[..., None, None]
    flat = (arms / extent).reshape(-1, 3)
    shape = (*arms.shape[:-2], 3 * arms.shape[-2])
    rigid = (jacobian(flat).reshape(*arms.shape, 6) * roots[..., None, None]).reshape(*shape, 6)
    columns = ((tools @ basis) * roots[..., None, None]).reshape(*shape, basis.shape[1])
    columns = _beside(_orthonormal(rigid), columns)
    flat_left = left.reshape(*shape)
    products = np.linalg.pinv(np.swapaxes(columns, -1, -2) @ columns, rcond=_RANK, hermitian=True)
    step = -np.einsum("...kl,...nl,...n->...k", products, columns, flat_left, optimize=True)
    return np.sum(flat_left**2, axis=-1), np.einsum("ik,...k->...i", basis, step)


def distance_start(source: Array, tools: Array, reference: Array, basis: Array) -> Array:
    """Offset from distances between spots alone, without any transform: a start where the offset is large.

    ``|ds + dR t|^2 = d^2`` is linear in t and in the products of its components; these 9 are solved for, and the
    products are then forgotten.

    Parameters
    ----------
    source, reference : (n, 3) arrays [mm]
    tools : (n, 3, 3) array
    basis : (3, k) array

    Returns
    -------
    (3,) array [mm]
    """
    step = max(1, -(-len(source) // _SPOTS_APART))
    source, tools, reference = source[::step], tools[::step], reference[::step]
    one, two = np.triu_indices(len(source), 1)
    between = source[one] - source[two]
    turned = (tools[one] - tools[two]) @ basis
    wanted = np.sum((reference[one] - reference[two]) ** 2, axis=1) - np.sum(between**2, axis=1)
    linear = 2.0 * np.einsum("ni,nik->nk", between, turned)
    products = np.einsum("nik,nil->nkl", turned, turned)
    rows, columns = np.triu_indices(basis.shape[1])
    twice = np.where(rows == columns, 1.0, 2.0)
    design = np.concatenate([linear, products[:, rows, columns] * twice], axis=1)
    scale = np.maximum(np.linalg.norm(design, axis=0), 1e-12)
    answer = np.linalg.lstsq(design / scale, wanted, rcond=1e-9)[0] / scale
    return np.asarray(basis @ answer[: basis.shape[1]], dtype=np.float64)


def fit_tool(
    source: Array, tools: Array, reference: Array, inliers: Mask | None = None, near: Array | None = None
) -> ToolFit:
    """Least squares over the inliers (default all), with the covariance of all parameters.

    Parameters
    ----------
    source, reference : (n, 3) arrays [mm]
    tools : (n, 3, 3) array
        Tool orientations in the source frame.
    inliers : (n,) bool array, optional
    near : (3,) array, optional
        Where to begin, if the offset is known roughly [mm].

    Raises
    ------
    RegistrationError
        ``TOOL_NOT_DETERMINED`` where the inliers determine no direction of the offset; ``TOO_FEW_PAIRS``.
    """
    chosen = np.ones(len(source), dtype=np.bool_) if inliers is None else inliers
    basis = determined_basis(source[chosen], tools[chosen])
    part = source[chosen], tools[chosen], reference[chosen]
    even = np.ones(len(part[0]))
    if near is not None:
        return _finish(source, tools, reference, chosen, solve(*part, even, basis @ (basis.T @ near), basis))
    both = [solve(*part, even, start, basis) for start in (np.zeros(3), distance_start(*part, basis))]
    costs = [_gauss_newton(*part, even, even, offset, basis)[0] for offset in both]
    return _finish(source, tools, reference, chosen, both[int(np.argmin(costs))])


def determined_basis(source: Array, tools: Array) -> Array:
    """Directions (3, k) in which spots (n, 3) with orientations (n, 3, 3) determine an offset.

    Raises
    ------
    RegistrationError
        ``TOO_FEW_PAIRS``, or ``TOOL_NOT_DETERMINED`` where there is none.
    """
    if len(source) < LEAST_SPOTS:
        raise RegistrationError("TOO_FEW_PAIRS", f"a tool offset needs at least {LEAST_SPOTS} spots, not {len(source)}")
    found = identifiability(source, tools)
    if found.rank == 0:
        raise RegistrationError("TOOL_NOT_DETERMINED", undetermined_text(found))
    return found.basis


def undetermined_text(found: Identifiability) -> str:
    """Say which directions of the offset the spots leave open, and what would determine them."""
    if found.rank == 0:
        return (
            "the tool points the same way at all spots, so that a tool offset and a shift of all spots are the same "
            f"(rank 0 of 3; only {found.gains[0]:.1e} of the offset's columns is no rigid motion): no direction of the "
            "offset is determined; measure spots with the tool turned by 20 degrees and more"
        )
    shown = ", ".join(
        f"({x:+.2f} {y:+.2f} {z:+.2f})" for x, y, z in _upright(found.directions[~found.determined]).tolist()
    )
    return (
        f"the offset along {shown} of the tool frame is not determined (rank {found.rank} of 3, condition number "
        f"{found.condition:.0f}): the tool never turns across it, and the shift of all spots swallows it; it is held "
        "at 0"
    )


def _upright(directions: Array) -> Array:
    largest = np.take_along_axis(directions, np.argmax(np.abs(directions), axis=1)[:, None], axis=1)
    return directions * np.where(largest < 0.0, -1.0, 1.0) + 0.0


def _finish(source: Array, tools: Array, reference: Array, inliers: Mask, offset: Array) -> ToolFit:
    moved = moved_by(source, tools, offset)
    rotation, translation = transform_of(moved[inliers], reference[inliers])
    predicted = moved @ rotation.T + translation
    residuals = predicted - reference
    found = identifiability(moved[inliers], tools[inliers])
    centroid = predicted[inliers].mean(axis=0)
    rigid = jacobian(predicted[inliers] - centroid)
    design = np.concatenate([rigid, rotation @ tools[inliers]], axis=2).reshape(-1, 9)
    free = max(3 * int(inliers.sum()) - 6 - found.rank, 1)
    variance = float(np.sum(residuals[inliers] ** 2)) / free
    open_directions = found.directions[~found.determined]
    normal = design.T @ design
    normal[6:, 6:] += max(variance, SCALE_FLOOR**2) / OPEN_SD**2 * open_directions.T @ open_directions
    scale = np.sqrt(np.diag(normal))
    covariance = variance * np.linalg.inv(normal / np.outer(scale, scale)) / np.outer(scale, scale)
    return ToolFit(
        offset=offset,
        rotation=rotation,
        translation=translation,
        moved=moved,
        residuals=residuals,
        inliers=inliers,
        sigma=float(np.sqrt(variance)),
        degrees_of_freedom=free,
        covariance=(covariance + covariance.T) / 2.0,
        centroid=centroid,
        identifiability=found,
    )


def blocks_of(fit: ToolFit, tools: Array) -> Array:
    """Rows (n, 3, p) of all pairs with ``block @ block'`` the variance of the prediction for unit noise."""
    arms = fit.moved - fit.moved[fit.inliers].mean(axis=0)
    extent = max(float(np.sqrt(np.mean(arms**2))), 1e-9)
    columns = np.concatenate([jacobian(arms / extent), tools @ fit.identifiability.basis], axis=2)
    fitted = columns[fit.inliers].reshape(-1, columns.shape[2])
    values, vectors = np.linalg.eigh(fitted.T @ fitted)
    known = values > _RANK * values[-1]
    return np.asarray(columns @ (vectors[:, known] / np.sqrt(values[known])), dtype=np.float64)


def leave_out(fit: ToolFit, source: Array, tools: Array, reference: Array, groups: Sequence[NDArray[np.intp]]) -> Array:
    """Residuals of spots under the fit of all inliers outside their group, by refitting.

    Parameters
    ----------
    fit : ToolFit
        The fit of all; its offset is where every refit starts.
    source, reference : (n, 3) arrays [mm]
    tools : (n, 3, 3) array
    groups : sequence of int arrays
        Rows that are left out together.

    Returns
    -------
    (n, 3) array
        Predicted minus reference; NaN for rows of no group, and where the others determine fewer directions of the
        offset than all do [mm].
    """
    left = np.full_like(source, np.nan)
    rank = fit.identifiability.rank
    for rows in groups:
        keep = fit.inliers.copy()
        keep[rows] = False
        if int(keep.sum()) < LEAST_SPOTS:
            continue
        part = source[keep], tools[keep], reference[keep]
        found = identifiability(fit.moved[keep], part[1])
        if found.rank < rank:
            continue
        offset = solve(*part, np.ones(len(part[0])), fit.offset, fit.identifiability.basis)
        moved = moved_by(*part[:2], offset)
        rotation, translation = transform_of(moved, part[2])
        left[rows] = moved_by(source[rows], tools[rows], offset) @ rotation.T + translation - reference[rows]
    return left


def leave_one_out_tool(fit: ToolFit, tools: Array) -> Array:
    """Leave-one-out residuals by the blocks of the hat matrix: exact to first order at the solution.

    An inlier's residual becomes ``(I - H_ii)^-1 e_i``; an outlier's stays what it is under the fit of the inliers.

    Parameters
    ----------
    fit : ToolFit
    tools : (n, 3, 3) array

    Returns
    -------
    (n, 3) array
        Predicted minus reference, reference frame; NaN where one spot alone determines a parameter [mm].
    """
    keep = fit.inliers
    hat = blocks_of(fit, tools)[keep]
    inner = np.eye(3) - hat @ np.swapaxes(hat, 1, 2)
    own = np.einsum("ji,nj->ni", fit.rotation, fit.residuals[keep])
    worst = np.linalg.eigvalsh(inner)[:, 0]
    inner[worst < 1e-6] = np.nan
    held = np.full_like(own, np.nan)
    good = worst >= 1e-6
    held[good] = np.linalg.solve(inner[good], own[good][:, :, None])[:, :, 0]
    result = fit.residuals.copy()
    result[keep] = held @ fit.rotation.T
    return result
