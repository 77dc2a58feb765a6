"""A fit as plain JSON values: the ``fit`` object of the interface. Numbers that do not exist are null."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from respot.calibration.discovery.records import hidden_of, measure_next_of, questions_of, tried_of
from respot.calibration.spot_fit import SpotFit
from respot.calibration.uncertainty import PARAMETERS
from respot.geometry import abc_from_rotation
from respot.registration.affine import AffineFit
from respot.registration.leave_one_out import without_folds
from respot.registration.matching import EXACT, PLACE, IdMatch
from respot.registration.paper import PaperFit
from respot.registration.statistics import distances, rms

Array = NDArray[np.float64]


def report(fit: SpotFit) -> dict[str, Any]:
    """Return the JSON object of a fit, without schema, version and issues.

    Of the method "paper" the entry ``paper`` holds what was chosen and ``robust`` our fit of the same pairs; of the
    method "affine" the figures after the fit are those of the 12 free parameters, the transform is null, and ``robust``
    holds our fit.
    """
    record = _report(fit)
    if fit.method == "paper" and fit.paper is not None and fit.paper_mean_square is not None:
        record["paper"] = {
            **_paper(fit.paper, fit.ids),
            "mean_square_reading": _paper(fit.paper_mean_square, fit.ids),
        }
    if fit.method == "affine" and fit.affine is not None:
        record.update(_affine_figures(fit, fit.affine, record))
    if fit.beside is not None:
        record["robust"] = _report(fit.beside)
    return record


def _report(fit: SpotFit) -> dict[str, Any]:
    inliers, rigid = fit.robust.inliers, fit.robust.rigid
    n = len(fit.ids)
    return {
        "method": fit.method,
        "kind": fit.model.kind,
        "frame": fit.model.frame,
        "n_source": fit.match.n_source if fit.match else n,
        "n_reference": fit.match.n_reference if fit.match else n,
        "n_matched": n,
        "n_inliers": int(inliers.sum()),
        "missing": list(fit.match.missing) if fit.match else [],
        "extra": list(fit.match.extra) if fit.match else [],
        "matching": None if fit.match is None else _matching(fit.match),
        "transform": _transform(fit),
        "affine_12": None if fit.affine is None else _affine(fit.affine),
        "translation_only": {
            "translation": fit.translation.translation.tolist(),
            "rms": rms(fit.translation.residuals),
            "max": distances(fit.translation.residuals).max,
            "leave_one_out": rms(fit.translation.leave_one_out),
        },
        "rotation_support": {
            "supported": fit.support.supported,
            "p_value": fit.support.p_value,
            "p_value_by_axis": fit.support.p_value_by_axis,
            "f_value": fit.support.f_value,
            "angle": fit.support.angle,
            "translation_leave_one_out": fit.support.translation_loo,
            "rigid_leave_one_out": _number(fit.support.rigid_loo),
            "verdict": fit.support.verdict,
        },
        "residual_directions": [
            {"axis": axis.tolist(), "sd": float(sd)}
            for axis, sd in zip(fit.directions.axes, fit.directions.sd, strict=True)
        ],
        "residual_sd_xyz": fit.directions.sd_xyz.tolist(),
        "noise_directions": {
            "isotropy_p": fit.uncertainty.isotropy_p,
            "intervals_by_direction": fit.uncertainty.by_direction,
        },
        "rigid_part": _rigid_part(fit),
        "effects": [effect.to_dict() for effect in fit.effects],
        **_search(fit),
        "orientations": None if fit.orientations is None else fit.orientations.to_dict(),
        "as_found": distances(fit.as_found).to_dict(),
        "before": distances(fit.before.residuals).to_dict(),
        "after": distances(rigid.residuals[inliers]).to_dict(),
        "after_all": distances(rigid.residuals).to_dict(),
        "leave_one_out": {"before": _number(rms(fit.before_loo)), "after": _number(rms(fit.after_loo[inliers]))},
        "heldout": _heldout(fit),
        "inlier_threshold": fit.robust.threshold,
        "noise_floor": fit.noise,
        "noise": _noise(fit),
        "unexplained": _unexplained(fit),
        "spots": _spots(fit),
    }


def _search(fit: SpotFit) -> dict[str, Any]:
    """What was tried and lost, what is hidden, what could not be asked, what to measure next."""
    found = fit.discovery
    tried = [] if fit.tool is None else [fit.tool.to_dict()]
    if fit.convention is not None:
        tried.append(fit.convention.to_dict())
    if found is None:
        asked = questions_of(None, len(fit.ids), None) if fit.kind_of_search == "all" else []
        return {"effects_tried": tried, "hidden": [], "questions": asked, "measure_next": []}
    listed = {record["name"] for record in tried} | {effect.name for effect in fit.effects}
    return {
        "effects_tried": [*tried, *(record for record in tried_of(found) if record["name"] not in listed)],
        "hidden": hidden_of(found),
        "questions": questions_of(fit.observations, len(fit.ids), found),
        "measure_next": measure_next_of(found),
    }


def _heldout(fit: SpotFit) -> dict[str, Any]:
    """Errors of spots that took no part: kept out from the start, else each fifth left out, else one at a time."""
    if fit.heldout is not None:
        return fit.heldout.to_dict()
    repaired = [name for name, changed in zip(fit.ids, fit.repaired, strict=True) if changed]
    found = fit.discovery
    if not fit.model.terms or found is None or found.nested is None or found.nested_folds is None:
        return {
            "scheme": "leave-one-out",
            "n": len(fit.ids),
            "before": _statistics(fit.before_loo),
            "after": _statistics(fit.after_loo),
            "repaired_ids": repaired,
        }
    judged = np.isfinite(found.nested).all(axis=1) & fit.robust.inliers
    before = without_folds(fit.source, fit.reference_as_named, found.nested_folds)
    return {
        "scheme": "each fifth of the spots left out of choosing and fitting; outliers are not counted",
        "n": int(judged.sum()),
        "before": _statistics(before[judged]),
        "after": _statistics(found.nested[judged]),
        "after_all": _statistics(found.nested[np.isfinite(found.nested).all(axis=1)]),
        "repaired_ids": repaired,
    }


def _rigid_part(fit: SpotFit) -> dict[str, Any]:
    """How the rigid part weighs what it was fitted to."""
    weighted, oriented = fit.weighted, fit.oriented
    return {
        "weights": "even" if weighted is None else "direction",
        "noise": None if weighted is None else weighted.noise.tolist(),
        "orientations": "compare" if oriented is None else "fit",
        "sigma_mm": None if oriented is None else oriented.sigma_mm,
        "sigma_deg": None if oriented is None else oriented.sigma_deg,
        "n_orientations": None if oriented is None else int(oriented.agree.sum()),
    }


def _unexplained(fit: SpotFit) -> dict[str, Any]:
    left = None if fit.discovery is None else fit.discovery.unexplained
    if left is None:
        return {"present": None, "text": "", "correlates": []}
    correlates = [
        {"column": each.column, "strength": each.strength, "p_value": each.p_value} for each in left.correlates
    ]
    return {"present": left.present, "text": left.text, "correlates": correlates}


def _noise(fit: SpotFit) -> dict[str, Any]:
    left = None if fit.discovery is None else fit.discovery.unexplained
    return {
        "sigma": fit.uncertainty.sigma,
        "floor": fit.noise,
        "ratio": None if not fit.noise else fit.uncertainty.sigma / fit.noise,
        "reached": None if left is None else left.reached,
        "source": fit.noise_source,
    }


def _affine(fit: AffineFit) -> dict[str, Any]:
    return {
        "matrix": fit.matrix.tolist(),
        "rms": rms(fit.residuals),
        "leave_one_out": _number(rms(fit.leave_one_out)),
        "spread": fit.spread.tolist(),
        "stretches": fit.stretches.tolist(),
        "shear": fit.shear,
        "departure": fit.departure,
        "reflects": fit.reflects,
    }


def _affine_figures(fit: SpotFit, affine: AffineFit, rigid: dict[str, Any]) -> dict[str, Any]:
    """Entries of the report that the unconstrained model fills in the rigid one's place."""
    predicted = fit.source @ affine.matrix[:3, :3].T + affine.matrix[:3, 3]
    after = distances(affine.residuals).to_dict()
    spots = [
        {
            **spot,
            "reference_id": name,
            "repaired": False,
            "after": float(np.linalg.norm(residual)),
            **dict(zip(("x", "y", "z", "dx", "dy", "dz"), [*point.tolist(), *residual.tolist()], strict=True)),
            **dict.fromkeys(("a", "b", "c")),
            "inlier": True,
            "weight": 1.0,
        }
        for spot, name, point, residual in zip(
            rigid["spots"], fit.reference_ids_as_named, predicted, affine.residuals, strict=True
        )
    ]
    return {
        "transform": None,
        "effects": [],
        "effects_tried": [],
        "orientations": None,
        "n_inliers": len(fit.ids),
        "after": after,
        "after_all": after,
        "leave_one_out": {**rigid["leave_one_out"], "after": _number(rms(affine.leave_one_out))},
        "heldout": rigid["heldout"]
        if fit.heldout is not None
        else {**rigid["heldout"], "after": _statistics(affine.leave_one_out), "repaired_ids": []},
        "inlier_threshold": None,
        "spots": spots,
    }


def _paper(fit: PaperFit, ids: Sequence[str]) -> dict[str, Any]:
    def names(rows: Sequence[int]) -> list[str]:
        return [ids[row] for row in rows]

    runner_up = fit.runner_up
    return {
        "tau": fit.tau,
        "n_min": fit.n_min,
        "subset_size": fit.subset_size,
        "score": fit.score,
        "subset": names(fit.subset),
        "inliers": names(fit.inliers),
        "dropped": names(fit.dropped),
        "subset_beyond_tau": names(fit.beyond),
        "d_n": fit.d_n,
        "delta": dict(zip(ids, fit.delta.tolist(), strict=True)),
        "subsets": {
            "tried": fit.n_subsets,
            "all": fit.exhaustive,
            "on_a_line": fit.n_degenerate,
            "qualified": fit.n_qualified,
        },
        "runner_up": None
        if runner_up is None
        else {
            "rank": runner_up.rank,
            "subset": names(runner_up.subset),
            "dropped": names(runner_up.dropped),
            "d_n": runner_up.d_n,
        },
    }


def _matching(match: IdMatch) -> dict[str, Any]:
    pairs = zip(match.ids, match.reference_ids, match.rules, strict=True)
    return {
        "by": "geometry" if PLACE in match.rules else "id",
        "not_equal_names": [
            {"id": own, "reference_id": other, "rule": rule} for own, other, rule in pairs if rule != EXACT
        ],
    }


def _transform(fit: SpotFit) -> dict[str, Any]:
    rotation = fit.model.rotation
    sure = fit.uncertainty
    return {
        "rotation": rotation.tolist(),
        "translation": fit.model.translation.tolist(),
        "abc": abc_from_rotation(Rotation.from_matrix(rotation)).tolist(),
        "tool_offset": None if fit.model.tool_offset is None else fit.model.tool_offset.tolist(),
        "covariance": sure.covariance[:6, :6].tolist(),
        "covariance_with_tool": None if fit.model.tool_offset is None else sure.covariance.tolist(),
        "centroid": sure.centroid.tolist(),
        "sigma": sure.sigma,
        "ci95": {name: float(half) for name, half in zip(PARAMETERS, sure.half_width[:6], strict=True)},
    }


def _spots(fit: SpotFit) -> list[dict[str, Any]]:
    points, tools = fit.calibrated, fit.calibrated_rotations
    angles = None if tools is None else abc_from_rotation(tools)
    residuals = fit.robust.rigid.residuals
    as_found, before, after = (np.linalg.norm(v, axis=1) for v in (fit.as_found, fit.before.residuals, residuals))
    rows = []
    for row, name in enumerate(fit.ids):
        a, b, c = (None, None, None) if angles is None else angles[row].tolist()
        x, y, z = points[row].tolist()
        dx, dy, dz = residuals[row].tolist()
        rows.append(
            {
                "id": name,
                "reference_id": fit.reference_ids[row],
                "as_found": float(as_found[row]),
                "before": float(before[row]),
                "after": float(after[row]),
                "x": x,
                "y": y,
                "z": z,
                "a": a,
                "b": b,
                "c": c,
                "dx": dx,
                "dy": dy,
                "dz": dz,
                "inlier": bool(fit.robust.inliers[row]),
                "weight": float(fit.robust.weights[row]),
                "repaired": bool(fit.repaired[row]),
            }
        )
    return rows


def _number(value: float) -> float | None:
    return value if isfinite(value) else None


def _statistics(vectors: Array) -> dict[str, float | int] | None:
    figures = distances(vectors)
    return figures.to_dict() if isfinite(figures.rms) else None
