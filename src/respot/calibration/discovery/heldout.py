"""Errors of spots that were left out, by several ways to fold; never by what determines the term itself."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from respot.calibration.discovery.joint_fit import JointFit
from respot.calibration.effects.tool_offset import orientation_families
from respot.calibration.observations import Observations

Array = NDArray[np.float64]
Labels = NDArray[np.intp]

_LEAST_KNOWN = 0.3
"""A way to fold that leaves less than this of what determines a term is not used for it."""
_TURNING_DEG = 5.0


@dataclass(frozen=True)
class HeldOut:
    """RMS of held-out errors by way to fold [mm]."""

    rms: Mapping[str, float]

    def over(self, schemes: Sequence[str]) -> float:
        """Mean square over some ways, rooted [mm]."""
        return float(np.sqrt(np.mean([self.rms[scheme] ** 2 for scheme in schemes])))


def folds_of(observations: Observations) -> dict[str, Labels]:
    """Ways to fold n spots: labels (n,) by name.

    ``space``: eight blocks; ``orientation``: families of like tool orientations; ``time``: six blocks in the order of
    measuring, where a column tells it; ``mixed``: every fifth spot along the widest direction.
    """
    points = observations.positions
    centred = points - points.mean(axis=0)
    order = np.argsort(centred @ np.linalg.svd(centred, full_matrices=False)[2][0], kind="stable")
    found = {"mixed": np.empty(len(points), dtype=np.intp), "space": _blocks(points, 3)}
    found["mixed"][order] = np.arange(len(points)) % 5
    if observations.rotations is not None:
        spread = np.degrees((observations.rotations.mean().inv() * observations.rotations).magnitude())
        if float(np.sqrt(np.mean(spread**2))) > _TURNING_DEG:
            families = orientation_families(observations.rotations, np.ones(len(points), dtype=np.bool_), order)
            labels = np.zeros(len(points), dtype=np.intp)
            for number, rows in enumerate(families):
                labels[rows] = number
            if len(families) > 1:
                found["orientation"] = labels
    times = [c.values for c in observations.columns.values() if c.role == "time" and c.values is not None]
    if times:
        labels = np.empty(len(points), dtype=np.intp)
        labels[np.argsort(times[0], kind="stable")] = np.arange(len(points)) * 6 // len(points)
        found["time"] = labels
    return found


def _blocks(points: Array, depth: int) -> Labels:
    """Blocks (n,) by halving along the widest direction, ``depth`` times."""
    labels = np.zeros(len(points), dtype=np.intp)
    for _ in range(depth):
        for block in np.unique(labels):
            rows = np.flatnonzero(labels == block)
            if len(rows) < 2:
                continue
            centred = points[rows] - points[rows].mean(axis=0)
            along = centred @ np.linalg.svd(centred, full_matrices=False)[2][0]
            labels[rows[along > np.median(along)]] += int(labels.max()) + 1
        labels = np.unique(labels, return_inverse=True)[1].astype(np.intp)
    return labels


def heldout(fit: JointFit, folds: Mapping[str, Labels], skip: Collection[str] = ()) -> HeldOut:
    """Held-out errors of a model, linear about its solution, over the inliers.

    A way to fold is left out where it takes away most of what determines one of the model's terms.

    Parameters
    ----------
    fit : JointFit
    folds : mapping of str to (n,) int array
    skip : collection of str
        Ways that are not used: what a term follows is not folded by.
    """
    rows = np.flatnonzero(fit.inliers)
    columns, wanted = fit.columns[rows], fit.linear[rows]
    found = {}
    for scheme, labels in folds.items():
        if scheme in skip:
            continue
        vectors = _left_out(columns, wanted, labels[rows], fit.ridge)
        if vectors is not None:
            found[scheme] = float(np.sqrt(np.mean(np.sum(vectors**2, axis=1))))
    return HeldOut(found)


def _left_out(columns: Array, wanted: Array, labels: Labels, ridge: Array) -> Array | None:
    """Errors (m, 3) of each fold by the fit of the others; None where a fold holds what determines a parameter."""
    size = columns.shape[2]
    names, fold = np.unique(labels, return_inverse=True)
    if len(names) < 2:
        return None
    parts = []
    products = []
    for number in range(len(names)):
        design = columns[fold == number].reshape(-1, size)
        parts.append(design.T @ design)
        products.append(design.T @ wanted[fold == number].ravel())
    grams = np.stack(parts)
    total = grams.sum(axis=0) + np.diag(ridge)
    all_products = np.sum(products, axis=0)
    without = total - grams
    if size > 6 and not _still_known(without, total):
        return None
    answers = np.einsum(
        "fkl,fl->fk", np.linalg.pinv(without, rcond=1e-12, hermitian=True), all_products - np.stack(products)
    )
    return np.asarray(wanted - np.einsum("nik,nk->ni", columns, answers[fold]))


def _still_known(without: Array, total: Array) -> bool:
    """Whether every fold's rest keeps enough of what determines each parameter beside all others."""
    full = 1.0 / np.maximum(np.diag(np.linalg.pinv(total, rcond=1e-12, hermitian=True))[6:], 1e-300)
    rest = 1.0 / np.maximum(
        np.diagonal(np.linalg.pinv(without, rcond=1e-12, hermitian=True), axis1=1, axis2=2)[:, 6:], 1e-300
    )
    return bool(np.all(rest >= _LEAST_KNOWN * full))
