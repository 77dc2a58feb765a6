"""A fit as plain JSON values: the ``fit`` object of the interface. Numbers that do not exist are null."""

from __future__ import annotations

from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from respot.calibration.fit import SpotFit
from respot.calibration.uncertainty import PARAMETERS
from respot.geometry import abc_from_rotation
from respot.registration.statistics import distances, rms

Array = NDArray[np.float64]


def report(fit: SpotFit) -> dict[str, Any]:
    """Return the JSON object of a fit, without schema, version and issues."""
    inliers, rigid = fit.robust.inliers, fit.robust.rigid
    n = len(fit.ids)
    return {
        "kind": fit.calibration.kind,
        "frame": fit.calibration.frame,
        "n_source": fit.match.n_source if fit.match else n,
        "n_reference": fit.match.n_reference if fit.match else n,
        "n_matched": n,
        "n_inliers": int(inliers.sum()),
        "missing": list(fit.match.missing) if fit.match else [],
        "extra": list(fit.match.extra) if fit.match else [],
        "transform": _transform(fit),
        "affine_12": None
        if fit.affine is None
        else {"matrix": fit.affine.matrix.tolist(), "rms": rms(fit.affine.residuals)},
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
        "effects": [effect.to_dict() for effect in fit.effects],
        "as_found": distances(fit.as_found).to_dict(),
        "before": distances(fit.before.residuals).to_dict(),
        "after": distances(rigid.residuals[inliers]).to_dict(),
        "after_all": distances(rigid.residuals).to_dict(),
        "leave_one_out": {"before": _number(rms(fit.before_loo)), "after": _number(rms(fit.after_loo[inliers]))},
        "heldout": {
            "scheme": "leave-one-out",
            "n": n,
            "before": _statistics(fit.before_loo),
            "after": _statistics(fit.after_loo),
            "repaired_ids": [name for name, changed in zip(fit.ids, fit.repaired, strict=True) if changed],
        },
        "inlier_threshold": fit.robust.threshold,
        "noise_floor": fit.noise,
        "unexplained": {"present": None, "correlates": []},
        "spots": _spots(fit),
    }


def _transform(fit: SpotFit) -> dict[str, Any]:
    rotation = fit.calibration.rotation
    sure = fit.uncertainty
    return {
        "rotation": rotation.tolist(),
        "translation": fit.calibration.translation.tolist(),
        "abc": abc_from_rotation(Rotation.from_matrix(rotation)).tolist(),
        "covariance": sure.covariance.tolist(),
        "centroid": sure.centroid.tolist(),
        "sigma": sure.sigma,
        "ci95": {name: float(half) for name, half in zip(PARAMETERS, sure.half_width, strict=True)},
    }


def _spots(fit: SpotFit) -> list[dict[str, Any]]:
    points, turned = fit.calibration.predict(fit.source, fit.source_rotations)
    angles = None if turned is None else abc_from_rotation(turned)
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
