"""Effect ``convention`` where the reference has positions only: a tool offset fits under another reading, not as read.

Orientations move positions only through an offset of the tool. Where that is large (poses of a flange, another tool), a
wrong reading leaves what no offset explains, and the right one leaves the noise. Where it is small nothing is said.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from respot.calibration.effects.convention import (
    CLEARLY,
    ConventionFinding,
    ConventionTrial,
    Tried,
    finding_of,
    rank,
)
from respot.calibration.effects.readings import Columns, Rotations, own_readings, read_all
from respot.calibration.effects.tool_fit import (
    LEAST_SPOTS,
    SCALE_FLOOR,
    ToolFit,
    distance_start,
    leave_out,
    solve,
)
from respot.calibration.effects.tool_offset import orientation_families
from respot.calibration.effects.tool_robust import canonical_order, fit_tool_robust
from respot.calibration.effects.turns import SHARE
from respot.geometry import rotation_from_quaternion
from respot.registration.errors import RegistrationError
from respot.registration.rigid import transform_of
from respot.registration.robust import fit_robust
from respot.registration.statistics import rms

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

LEAST = 12
"""9 parameters and a scan over readings: fewer spots agree by accident."""
HELD = 0.5
"""Families of orientations that took no part must be met this much better than as written, and without an offset."""

_FIRMLY = 5
_ROUNDS = 5
_ROUGH_MM = 0.1
_SAMPLE = 100
_DUST_MM = 2.0 * SCALE_FLOOR


def find_convention_by_tool(
    source: Array,
    rotations: Rotation,
    reference: Array,
    *,
    seed: int,
    kind: str = "measured",
    columns: Columns = "abc",
    numbers: Array | None = None,
) -> ConventionFinding | None:
    """Find another reading of the source's orientations. Parameters as `investigate_by_tool`."""
    trial = investigate_by_tool(source, rotations, reference, seed=seed, kind=kind, columns=columns, numbers=numbers)
    return trial.finding


def investigate_by_tool(
    source: Array,
    rotations: Rotation,
    reference: Array,
    *,
    seed: int,
    kind: str = "measured",
    columns: Columns = "abc",
    numbers: Array | None = None,
) -> ConventionTrial:
    """Look for another reading of the source's orientations under which a constant tool offset fits.

    Parameters
    ----------
    source, reference : (n, 3) arrays
        Paired spots, names repaired [mm].
    rotations : Rotation of n
        Tool orientations in the source frame, as read in our convention.
    seed : int
        Of the robust fits' subsets.
    kind : str
        ``"theory"`` or ``"measured"``.
    columns : "abc" or "quaternion"
        What the source's orientations are written in.
    numbers : (n, 3) array, optional
        A, B, C as they stand in the list, degrees.
    """
    if len(source) < LEAST:
        return ConventionTrial(None, f"a convention is judged by positions at {LEAST} spots or more, not {len(source)}")
    try:
        rigid = fit_robust(source, reference, seed=seed).rigid
    except RegistrationError as error:
        return ConventionTrial(None, str(error))
    written = _fitted(source, rotations, reference, seed)
    alone = _spread(rigid.residuals)
    before = alone if written is None else min(alone, _spread(written.residuals))
    if before <= _DUST_MM:
        return ConventionTrial(None, "positions agree as written")
    read = read_all(rotations, own_readings(columns), columns, numbers)
    screened, tools = _screen(source, reference, read, canonical_order(source, reference))
    fits: dict[int, ToolFit] = {}
    for row in np.argsort(screened, kind="stable")[:_FIRMLY].tolist():
        fit = _fitted(source, Rotation.from_matrix(tools[row]), reference, seed)
        if fit is not None and np.isfinite(screened[row]):
            fits[row] = fit
            screened[row] = min(screened[row], _spread(fit.residuals))
    best, tied, runner_up = rank(_tried(read, screened, fits), _DUST_MM)
    if best is None or best.spread > CLEARLY * before:
        return ConventionTrial(
            None, f"no other reading of the source's orientations makes a tool offset fit (as written {before:.2f} mm)"
        )
    turned = Rotation.from_matrix(tools[best.row])
    held = _held(fits[best.row], turned, source, reference, None if written is None else rotations, written)
    if held is None or held[1] > HELD * held[0]:
        return ConventionTrial(
            None,
            f"a tool offset fits if the source {best.reading.words}, but not at orientations that it was not fitted to",
        )
    evidence = {
        "spread_rigid_mm": alone,
        "spread_written_mm": None if written is None else _spread(written.residuals),
        "spread_after_mm": best.spread,
        "family_out_before": held[0],
        "family_out_after": held[1],
        "tool_offset": fits[best.row].offset.tolist(),
    }
    finding = finding_of(best, tied, runner_up, before, kind, "mm", evidence, gain=held[0] - held[1])
    return ConventionTrial(
        replace(finding, rotations=turned),
        f"no tool offset fits the orientations as written ({before:.2f} mm are left), and one does "
        f"({best.spread:.2f} mm) if {finding.text}",
    )


def _fitted(source: Array, rotations: Rotation, reference: Array, seed: int) -> ToolFit | None:
    try:
        return fit_tool_robust(source, rotations.as_matrix(), reference, seed=seed)
    except RegistrationError:
        return None


def _spread(residuals: Array) -> float:
    """Length within which `SHARE` of the residuals stays [mm]."""
    return float(np.quantile(np.linalg.norm(residuals, axis=-1), SHARE, method="lower"))


def _tried(read: Rotations, spreads: Array, fits: dict[int, ToolFit]) -> list[Tried]:
    """Readings with what they leave; one that was not fitted firmly is no candidate, but may be tied."""
    size = {row: float(np.linalg.norm(fit.offset)) for row, fit in fits.items()}
    return [
        Tried("source", reading, row, float(spreads[row]), size.get(row, np.inf))
        for row, reading in enumerate(read.readings)
    ]


def _screen(source: Array, reference: Array, read: Rotations, order: Rows) -> tuple[Array, Array]:
    """Spread (k,) of a roughly robust fit under every reading [mm], and its tool orientations (k, n, 3, 3)."""
    k, n = read.known.shape
    sample = order[:: max(1, -(-n // _SAMPLE))]
    both = rotation_from_quaternion(read.quaternions.reshape(-1, 4)).as_matrix().reshape(k, 2, n, 3, 3)
    tools = both[:, 0].copy()
    known = read.known
    few = known[:, sample].sum(axis=1) < max(LEAST_SPOTS, len(sample) // 2)
    first, second = source[sample], reference[sample]
    starts = [np.zeros((k, 3)), np.array([distance_start(first, each[sample], second, np.eye(3)) for each in tools])]
    spreads = np.full(k, np.inf)
    for offset in starts:
        picked = np.zeros((k, n), dtype=np.intp)
        weights = np.where(known[:, sample] | few[:, None], 1.0, 1e-9)
        for _ in range(_ROUNDS):
            turned = np.take_along_axis(both, picked[:, None, :, None, None], axis=1)[:, 0]
            offset = _solve(first, turned[:, sample], second, weights, offset)
            moved = first + np.einsum("knij,kj->kni", turned[:, sample], offset)
            rotation, translation = transform_of(moved, np.broadcast_to(second, moved.shape), weights)
            left = source + np.einsum("kfnij,kj->kfni", both, offset)
            left = np.einsum("kij,kfnj->kfni", rotation, left) + translation[:, None, None] - reference
            lengths = np.linalg.norm(left, axis=-1)
            picked = np.argmin(lengths, axis=1)
            nearest = np.take_along_axis(lengths, picked[:, None], axis=1)[:, 0]
            scale = np.maximum(np.median(nearest, axis=1, keepdims=True), SCALE_FLOOR)
            weights = np.where(known, 1.0 / np.square(1.0 + np.square(nearest / (2.0 * scale))), 1e-9)[:, sample]
        now = np.array([_known_spread(row, mask) for row, mask in zip(nearest, known, strict=True)])
        now[few] = np.inf
        better = now < spreads
        chosen = np.take_along_axis(both, picked[:, None, :, None, None], axis=1)[:, 0]
        tools[better] = chosen[better]
        spreads = np.where(better, now, spreads)
    return spreads, tools


def _solve(source: Array, tools: Array, reference: Array, weights: Array, start: Array) -> Array:
    pair = (np.broadcast_to(each, tools.shape[:-1]) for each in (source, reference))
    first, second = pair
    return solve(first, tools, second, weights, start, np.eye(3), _ROUGH_MM)


def _known_spread(lengths: Array, known: NDArray[np.bool_]) -> float:
    return float(np.quantile(lengths[known], SHARE, method="lower")) if known.any() else np.inf


def _held(
    fit: ToolFit,
    rotations: Rotation,
    source: Array,
    reference: Array,
    as_written: Rotation | None,
    written: ToolFit | None,
) -> tuple[float, float] | None:
    """RMS over spots whose family of orientations took no part [mm].

    The better of as written and without an offset, and under the reading; None where that cannot be said.
    """
    families = orientation_families(rotations, fit.inliers, canonical_order(source, reference))
    if len(families) < 3:
        return None
    joint = leave_out(fit, source, rotations.as_matrix(), reference, families)
    alone, other = (np.full_like(joint, np.nan) for _ in range(2))
    for rows in families:
        rest = fit.inliers.copy()
        rest[rows] = False
        if int(rest.sum()) >= LEAST_SPOTS:
            rotation, translation = transform_of(source[rest], reference[rest])
            alone[rows] = source[rows] @ rotation.T + translation - reference[rows]
    if as_written is not None and written is not None:
        same = replace(written, inliers=fit.inliers)
        other = leave_out(same, source, as_written.as_matrix(), reference, families)
    both = np.isfinite(joint).all(axis=1) & np.isfinite(alone).all(axis=1)
    if int(both.sum()) < LEAST_SPOTS:
        return None
    before = rms(alone[both])
    if bool(np.isfinite(other[both]).all()):
        before = min(before, rms(other[both]))
    return before, rms(joint[both])
