"""Effect ``tool_offset``: the TCP is wrong by a constant in the tool frame.

Tried in this order: do the spots determine an offset at all; does it help beyond chance (permutation of residual
vectors after D. Freedman and D. Lane, J. Bus. Econ. Stat. 1 (1983)); does it predict spots that it was not fitted to,
left out one by one and by families of like orientation. What passes is part of the model. It is *named* only where the
noise is known from elsewhere, the model reaches it, and what can imitate it is too small or too large to be it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats
from scipy.spatial.transform import Rotation

from respot.calibration.effects.effect import Effect, Remedy, Rival
from respot.calibration.effects.tool_fit import (
    LEAST_SPOTS,
    ToolFit,
    leave_one_out_tool,
    leave_out,
    rigid_split,
    undetermined_text,
)
from respot.calibration.effects.tool_robust import canonical_order, fit_tool_robust
from respot.registration.covariance import jacobian
from respot.registration.errors import RegistrationError
from respot.registration.leave_one_out import leave_one_out
from respot.registration.rigid import fit_rigid, transform_of
from respot.registration.statistics import rms

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

NAME = "tool_offset"
ALPHA = 0.01
DRAWS = 999
CLEAR_GAIN = 0.9
"""The leave-one-out error must fall by a tenth: the permutation test alone lets one table in a hundred pass."""

FLOOR = 1.1
"""The noise that the model leaves must come within this factor of the noise known from elsewhere."""

FLANGE_LENGTH_MM = 10.0
"""No arm is wrong by more than this in its last length: a larger offset is no `link_length`."""
AXIS_6_MM = 100.0
"""5 degrees of axis 6 at a gun of a good metre: a larger offset is no `joint_zero`."""

_NOTHING_LEFT = 1e-3  # mm RMS; what is printed in a table is coarser
_SAMPLE = 2000
_SAME_FAMILY = np.radians(0.5)


@dataclass(frozen=True, eq=False)
class ToolTrial:
    """What became of the trial of a tool offset.

    Attributes
    ----------
    accepted : bool
        Whether the offset is part of the model.
    verdict : str
        Why, in words.
    code : str or None
        ``TOOL_NOT_DETERMINED`` or ``TOO_FEW_PAIRS`` where nothing could be tried.
    fit : ToolFit or None
        The joint fit, accepted or not.
    effect : Effect or None
        Of an accepted offset.
    left_out : (n, 3) array or None
        Leave-one-out residuals of the joint fit; outliers under the fit of the inliers [mm].
    figures : dict
        JSON values: p value, gains, rank.
    """

    accepted: bool
    verdict: str
    code: str | None = None
    fit: ToolFit | None = None
    effect: Effect | None = None
    left_out: Array | None = None
    figures: dict[str, Any] | None = None

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON object of ``effects_tried``."""
        return {"name": NAME, "accepted": self.accepted, "verdict": self.verdict, **(self.figures or {})}


def investigate(
    source: Array,
    rotations: Rotation,
    reference: Array,
    *,
    kind: str,
    noise: float | None = None,
    seed: int = 0,
    fit: ToolFit | None = None,
) -> ToolTrial:
    """Try a tool offset on paired spots, names repaired.

    Parameters
    ----------
    source, reference : (n, 3) arrays
        [mm]
    rotations : Rotation of n
        Tool orientations in the source frame.
    kind : str
        ``"theory"`` or ``"measured"``.
    noise : float, optional
        Standard deviation per coordinate, known independently [mm].
    seed : int
        Of the robust fit's subsets and of the permutations.
    fit : ToolFit, optional
        The robust fit of these pairs, where it is known already.
    """
    tools = rotations.as_matrix()
    try:
        fit = fit or fit_tool_robust(source, tools, reference, seed=seed)
    except RegistrationError as error:
        return ToolTrial(False, str(error), error.code)
    keep = fit.inliers
    rigid = fit_rigid(source[keep], reference[keep], checked=False)
    found = fit.identifiability
    figures: dict[str, Any] = {
        "rank": found.rank,
        "condition": found.condition if np.isfinite(found.condition) else None,
        "gains": found.gains.tolist(),
        "rms_rigid": rms(rigid.residuals),
        "rms": rms(fit.residuals[keep]),
    }
    if figures["rms_rigid"] <= _NOTHING_LEFT:
        return ToolTrial(False, "the rigid transform leaves nothing to explain", None, fit, figures=figures)
    left_out = leave_one_out_tool(fit, tools)
    alone = leave_one_out(source, reference, keep)
    figures["p_value"] = permutation_p_value(source[keep], tools[keep], reference[keep], seed=seed)
    figures["leave_one_out_rigid"] = _finite(rms(alone[keep]))
    figures["leave_one_out"] = _finite(rms(left_out[keep]))
    families = orientation_families(rotations, keep, canonical_order(source, reference))
    figures["families"] = len(families)
    figures["family_out_rigid"], figures["family_out"] = _family_errors(fit, source, tools, reference, families)
    accepted, verdict = _judge(figures)
    if not accepted:
        return ToolTrial(False, verdict, None, fit, figures=figures, left_out=left_out)
    effect = _effect(fit, figures, source, reference, kind, noise)
    return ToolTrial(True, verdict, None, fit, effect, left_out, figures)


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None


def _judge(figures: dict[str, Any]) -> tuple[bool, str]:
    p_value, alone, joint = figures["p_value"], figures["leave_one_out_rigid"], figures["leave_one_out"]
    if p_value > ALPHA:
        return False, f"no tool offset shows: chance explains as much (p = {p_value:.2g})"
    if alone is None or joint is None:
        return False, "one spot alone determines a part of the model: a tool offset cannot be judged by the others"
    held = f"leave-one-out {joint:.3f} mm with it, {alone:.3f} mm without"
    if joint > CLEAR_GAIN * alone:
        return False, f"a tool offset hardly helps spots that it was not fitted to ({held}; p = {p_value:.2g})"
    by_family, alone = figures["family_out"], figures["family_out_rigid"]
    if by_family is None:
        families = "orientations fall into too few families to leave one out"
    else:
        families = f"a family of orientations left out {by_family:.3f} mm with it, {alone:.3f} mm without"
        if by_family >= alone:
            return False, f"a tool offset does not hold for orientations that it was not fitted to ({held}; {families})"
    return True, f"p = {p_value:.2g}; {held}; {families}"


def permutation_p_value(source: Array, tools: Array, reference: Array, *, seed: int = 0) -> float:
    """Chance that a rigid motion and noise alone give an offset that explains as much.

    The residual vectors of the rigid fit are laid on other spots (Freedman and Lane), the rigid part is fitted again,
    and the tool's columns as well, all to first order; the statistic is the share of the sum of squares that the
    offset explains. ``p = (1 + as large) / (1 + 999)``. Drawn in the order of coordinates: sorting changes nothing.

    Parameters
    ----------
    source, reference : (n, 3) arrays [mm]
    tools : (n, 3, 3) array
    seed : int
    """
    order = canonical_order(source, reference)
    order = order[:: max(1, -(-len(order) // _SAMPLE))]
    rigid = fit_rigid(source[order], reference[order], checked=False)
    vectors = rigid.residuals @ rigid.rotation
    basis, columns = rigid_split(source[order], tools[order])
    left, values, _ = np.linalg.svd(columns, full_matrices=False)
    explains = left[:, values > 1e-6 * np.sqrt(len(order))]

    def statistic(flat: Array) -> Array:
        beside = np.sum(flat**2, axis=1) - np.sum((flat @ basis) ** 2, axis=1)
        share = np.sum((flat @ explains) ** 2, axis=1)
        return np.asarray(share / np.maximum(beside, 1e-30), dtype=np.float64)

    rng = np.random.default_rng(seed)
    observed = float(statistic(vectors.reshape(1, -1))[0])
    as_large = 0
    for _ in range(0, DRAWS, 111):
        drawn = np.stack([vectors[rng.permutation(len(vectors))].ravel() for _ in range(111)])
        as_large += int(np.count_nonzero(statistic(drawn) >= observed * (1.0 - 1e-9)))
    return (1 + as_large) / (1 + DRAWS)


def orientation_families(rotations: Rotation, keep: NDArray[np.bool_], order: Rows) -> list[Rows]:
    """Rows of inliers with like tool orientations: farthest-first, 3 to 6 families of 4 spots on average.

    Parameters
    ----------
    rotations : Rotation of n
    keep : (n,) bool array
    order : (n,) int array
        Canonical order of the rows, so that sorting changes nothing.
    """
    rows = order[keep[order]]
    members = rotations[rows]

    def apart(centre: Rotation) -> Array:
        return np.asarray((centre.inv() * members).magnitude(), dtype=np.float64)

    wanted = int(np.clip(len(rows) // 4, 3, 6))
    centres = [int(np.argmin(apart(members.mean())))]
    distances = apart(members[centres[0]])[:, None]
    while len(centres) < wanted:
        nearest = distances.min(axis=1)
        if nearest.max() <= _SAME_FAMILY:
            break
        centres.append(int(np.argmax(nearest)))
        distances = np.hstack([distances, apart(members[centres[-1]])[:, None]])
    label = np.argmin(distances, axis=1)
    return [rows[label == family] for family in range(len(centres))]


def _family_errors(
    fit: ToolFit, source: Array, tools: Array, reference: Array, families: Sequence[Rows]
) -> tuple[float | None, float | None]:
    """RMS over spots whose family of orientations took no part: of the rigid fit, of the joint fit [mm]."""
    joint = leave_out(fit, source, tools, reference, families)
    alone = np.full_like(joint, np.nan)
    for rows in families:
        rest = fit.inliers.copy()
        rest[rows] = False
        if int(rest.sum()) >= LEAST_SPOTS:
            rotation, translation = transform_of(source[rest], reference[rest])
            alone[rows] = source[rows] @ rotation.T + translation - reference[rows]
    both = np.isfinite(joint).all(axis=1) & np.isfinite(alone).all(axis=1)
    if len(families) < 2 or not both.any():
        return None, None
    return rms(alone[both]), rms(joint[both])


def _effect(
    fit: ToolFit, figures: dict[str, Any], source: Array, reference: Array, kind: str, noise: float | None
) -> Effect:
    found, size = fit.identifiability, float(np.linalg.norm(fit.offset))
    reach = stats.t.ppf(0.975, fit.degrees_of_freedom) * np.sqrt(np.diag(fit.covariance)[6:])
    parameters = {
        name: {
            "value": float(value) if found.known(axis) else None,
            "unit": "mm",
            "ci95": [float(value - half), float(value + half)] if found.known(axis) else None,
        }
        for axis, (name, value, half) in enumerate(zip("xyz", fit.offset, reach, strict=True))
    }
    alike = tuple(
        name for name, largest in (("joint_zero", AXIS_6_MM), ("link_length", FLANGE_LENGTH_MM)) if size <= largest
    )
    scale = _scale_rival(source[fit.inliers], reference[fit.inliers])
    clear = scale is None or figures["leave_one_out"] < scale
    reached = noise is not None and fit.sigma <= FLOOR * noise
    return Effect(
        name=NAME,
        where={"frame": "tool"},
        named=reached and clear and not alike and found.rank == 3,
        remedy=Remedy("tool", remedy_text(fit, kind, alike)),
        heldout_gain=figures["leave_one_out_rigid"] - figures["leave_one_out"],
        p_value=figures["p_value"],
        parameters=parameters,
        not_separated_from=alike if clear else (*alike, "scale"),
        rivals=(
            Rival("rigid transform alone", figures["leave_one_out_rigid"]),
            *(() if scale is None else (Rival("scale", scale),)),
        ),
        evidence={
            **figures,
            "sigma": fit.sigma,
            "noise_floor": noise,
            "floor_reached": None if noise is None else reached,
            "undetermined": found.directions[~found.determined].tolist(),
        },
    )


def _scale_rival(source: Array, reference: Array) -> float | None:
    """Leave-one-out RMS of the rigid transform with a uniform scale instead of an offset, to first order [mm]."""
    rigid = fit_rigid(source, reference, checked=False)
    arms = source - source.mean(axis=0)
    extent = max(float(np.sqrt(np.mean(arms**2))), 1e-9)
    columns = np.concatenate([jacobian(arms / extent), arms[:, :, None] / extent], axis=2)
    hat = np.linalg.qr(columns.reshape(-1, 7))[0]
    vectors = (rigid.residuals @ rigid.rotation).ravel()
    left = (vectors - hat @ (hat.T @ vectors)).reshape(-1, 3)
    blocks = hat.reshape(-1, 3, 7)
    inner = np.eye(3) - blocks @ np.swapaxes(blocks, 1, 2)
    if np.linalg.eigvalsh(inner)[:, 0].min() < 1e-6:
        return None
    return rms(np.linalg.solve(inner, left[:, :, None])[:, :, 0])


def remedy_text(fit: ToolFit, kind: str, alike: Sequence[str]) -> str:
    """Say what a person should do about it, in full sentences."""
    x, y, z = fit.offset.tolist()
    size = float(np.linalg.norm(fit.offset))
    point = "point that was measured" if kind == "measured" else "point that the theoretical list means"
    what = f"The {point} lies {x:+.2f} {y:+.2f} {z:+.2f} mm from the TCP of the source, along the axes of the tool."
    if size > AXIS_6_MM:
        what += f" {size:.0f} mm: the poses are those of the flange, or of another tool."
    what += (
        " Measure the TCP again; if it is confirmed, add the offset to the tool (KUKA: TOOL_DATA, ABB: tframe.trans of "
        "the tooldata; both TOOL * offset), and fit again. Correct the tool or the points, never both."
    )
    if alike:
        causes = {"joint_zero": "a zero error of axis 6", "link_length": "a wrong length of the flange"}
        named = " or ".join(causes[name] for name in alike)
        what += f" Spots alone cannot tell it from {named}: look at the mastering marks and at another tool first."
    if fit.identifiability.rank < 3:
        what += f" {undetermined_text(fit.identifiability).capitalize()}."
    return what
