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
from respot.calibration.effects.readings import GIVEN, Columns, Rotations, own_readings, read_all
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
Mask = NDArray[np.bool_]
Rows = NDArray[np.intp]

LEAST = 12
"""9 parameters and a scan over readings: fewer spots agree by accident."""
HELD = 0.5
"""Families of orientations that took no part must be met this much better than as written, and without an offset."""

_FIRMLY = 5
_ROUGHLY = 0.5  # what the rough fit must gain, for a firm one to be tried
_NEAR = 4.0
_START = 40
_NOTHING = 1e-9  # weight of a row whose numbers are not known
_LEFT = 9  # spots that a fit without one family must keep
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
    alone = _spread(rigid.residuals)
    if alone <= _DUST_MM:
        return ConventionTrial(None, "positions agree as written")
    read = read_all(rotations, [GIVEN, *own_readings(columns)], columns, numbers)
    screened, tools = _screen(source, reference, read, canonical_order(source, reference))
    before = min(alone, float(screened[0]))
    nothing = f"no other reading of the source's orientations makes a tool offset fit (as written {before:.2f} mm)"
    likely = [row for row in np.argsort(screened, kind="stable").tolist() if row and screened[row] < _ROUGHLY * before]
    if not likely:
        return ConventionTrial(None, nothing)
    written = _fitted(source, rotations, reference, seed)
    before = before if written is None else min(before, _spread(written.residuals))
    fits: dict[int, ToolFit] = {}
    for row in likely[:_FIRMLY]:
        if screened[row] > _NEAR * screened[likely[0]]:
            break
        fit = _fitted(source, Rotation.from_matrix(tools[row]), reference, seed)
        if fit is not None:
            fits[row] = fit
            screened[row] = min(screened[row], _spread(fit.residuals))
    best, tied, runner_up = rank(_tried(read, screened, fits), _DUST_MM)
    if best is None or best.row not in fits or best.spread > CLEARLY * before:
        return ConventionTrial(None, nothing)
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
    """Other readings with what they leave; one that was not fitted firmly is no candidate, but may be tied."""
    size = {row: float(np.linalg.norm(fit.offset)) for row, fit in fits.items()}
    return [
        Tried("source", reading, row, float(spreads[row]), size.get(row, np.inf))
        for row, reading in enumerate(read.readings)
        if row
    ]


def _screen(source: Array, reference: Array, read: Rotations, order: Rows) -> tuple[Array, Array]:
    """Spread (k,) of a roughly robust fit under every reading [mm], and its tool orientations (k, n, 3, 3)."""
    k, n = read.known.shape
    sample = order[:: max(1, -(-n // _SAMPLE))]
    both = rotation_from_quaternion(read.quaternions.reshape(-1, 4)).as_matrix().reshape(k, 2, n, 3, 3)
    plain, together = np.zeros((k, n), dtype=np.intp), _together(read.quaternions)
    folds = np.flatnonzero([reading.folds for reading in read.readings])
    spreads, picked = np.full(k, np.inf), plain.copy()
    for rows, start, near in (
        (np.arange(k), plain, False),
        (np.arange(k), plain, True),
        (folds, together[folds], True),
    ):
        if not len(rows):
            continue
        now, way = _roughly(source, reference, both[rows], read.known[rows], start, sample, near)
        better = now < spreads[rows]
        spreads[rows[better]], picked[rows[better]] = now[better], way[better]
    spreads[read.known[:, sample].sum(axis=1) < max(LEAST_SPOTS, len(sample) // 2)] = np.inf
    return spreads, _pick(both, picked)


def _roughly(
    source: Array, reference: Array, both: Array, known: Mask, picked: Rows, sample: Rows, far: bool
) -> tuple[Array, Rows]:
    """Spread (k,) of a fit by weights, and the foldings (k, n) that it came to.

    Parameters
    ----------
    source, reference : (n, 3) arrays [mm]
    both : (k, 2, n, 3, 3) array
        Tool orientations under either folding.
    known : (k, n) bool array
    picked : (k, n) int array
        Foldings to begin with.
    sample : int array
        Rows that are fitted.
    far : bool
        Begin where distances between spots say, not at no offset.
    """
    begin = sample[:: max(1, -(-len(sample) // _START))]
    tools = _pick(both, picked)
    offset = np.zeros((len(both), 3))
    if far:
        offset = np.array([distance_start(source[begin], each[begin], reference[begin], np.eye(3)) for each in tools])
    first, second = (np.broadcast_to(each[sample], (len(both), len(sample), 3)) for each in (source, reference))
    weights = np.where(known, 1.0, _NOTHING)[:, sample]
    nearest = np.zeros(known.shape)
    for _ in range(_ROUNDS):
        tools = _pick(both, picked)[:, sample]
        offset = solve(first, tools, second, weights, offset, np.eye(3), _ROUGH_MM)
        moved = first + np.einsum("knij,kj->kni", tools, offset)
        rotation, translation = transform_of(moved, second, weights)
        left = source + np.einsum("kfnij,kj->kfni", both, offset)
        left = np.einsum("kij,kfnj->kfni", rotation, left) + translation[:, None, None] - reference
        lengths = np.linalg.norm(left, axis=-1)
        picked = np.argmin(lengths, axis=1)
        nearest = np.take_along_axis(lengths, picked[:, None], axis=1)[:, 0]
        scale = np.maximum(np.median(nearest, axis=1, keepdims=True), SCALE_FLOOR)
        weights = np.where(known, 1.0 / np.square(1.0 + np.square(nearest / (2.0 * scale))), _NOTHING)[:, sample]
    spreads = [_known_spread(row, mask) for row, mask in zip(nearest, known, strict=True)]
    return np.array(spreads), picked


def _pick(both: Array, picked: Rows) -> Array:
    return np.take_along_axis(both, picked[:, None, :, None, None], axis=1)[:, 0]


def _together(quaternions: Array) -> Rows:
    """Foldings (k, n) that bring each row nearest to the orientation from which the median row is least away."""
    n = quaternions.shape[2]
    rows = np.unique(np.linspace(0, n - 1, min(n, _START)).astype(np.intp))
    centres = quaternions[:, :, rows].reshape(len(quaternions), -1, 4)
    near = np.abs(np.einsum("kcq,kfnq->kcfn", centres, quaternions))
    best = np.argmax(np.median(near.max(axis=2), axis=2), axis=1)
    return np.asarray(np.argmax(near[np.arange(len(near)), best], axis=1), dtype=np.intp)


def _known_spread(lengths: Array, known: Mask) -> float:
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
    order = canonical_order(source, reference)
    families = orientation_families(rotations, fit.inliers, order)
    if len(families) < 3 or max(map(len, families)) > int(fit.inliers.sum()) - _LEFT:
        families = [order[part::4] for part in range(4)]
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
