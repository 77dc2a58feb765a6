"""Fit records by hand: one with everything that a page may have to tell, one in which nothing was found."""

from __future__ import annotations

import copy
import random
from typing import Any


def statistics(rms: float, n: int) -> dict[str, Any]:
    return {"rms": rms, "mean": 0.9 * rms, "max": 2.6 * rms, "n": n}


def parameter(value: float | None, unit: str, half: float | None = None) -> dict[str, Any]:
    ci95 = None if value is None or half is None else [value - half, value + half]
    return {"value": value, "unit": unit, "ci95": ci95}


def effect(
    name: str, where: dict[str, Any], *, named: bool = False, remedy: str = "robot", **more: Any
) -> dict[str, Any]:
    return {
        "name": name,
        "where": where,
        "parameters": {},
        "named": named,
        "not_separated_from": [],
        "rivals": [],
        "p_value": 0.001,
        "heldout_gain": 0.4,
        "remedy": {"where": remedy, "text": f"What to do about {name}."},
        "evidence": {},
        **more,
    }


def spots(n: int, size: float, seed: int = 1) -> list[dict[str, Any]]:
    draw = random.Random(seed)
    rows = []
    for i in range(n):
        x, y, z = 1800.0 + 12.0 * (i % 5), draw.uniform(-900, 900), draw.uniform(600, 1500)
        shift = [draw.gauss(0, size) for _ in range(3)]
        after = sum(part**2 for part in shift) ** 0.5
        rows.append(
            {
                "id": f"SP{i + 1:03d}",
                "reference_id": f"SP{i + 1:03d}",
                "as_found": 640.0 + draw.uniform(-5, 5),
                "before": after + draw.uniform(0.3, 2.2),
                "after": after,
                **dict(zip(("x", "y", "z"), (x, y, z), strict=True)),
                **dict.fromkeys(("a", "b", "c")),
                **dict(zip(("dx", "dy", "dz"), shift, strict=True)),
                "inlier": True,
                "weight": 1.0,
                "repaired": False,
            }
        )
    return rows


def nothing_found() -> dict[str, Any]:
    """A theory record with the keys of the first release and no effect."""
    return {
        "version": "9.9",
        "method": "robust",
        "kind": "theory",
        "frame": "same",
        "n_source": 12,
        "n_reference": 12,
        "n_matched": 12,
        "n_inliers": 12,
        "missing": [],
        "extra": [],
        "matching": {"by": "id", "not_equal_names": []},
        "transform": {
            "rotation": [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            "translation": [10.0, -2.0, 0.5],
            "abc": [0.0, 0.0, 0.0],
            "tool_offset": None,
            "centroid": [1824.0, 0.0, 1050.0],
            "sigma": 0.1,
            "ci95": {"tx": 0.05, "ty": 0.06, "tz": 0.05, "rx": 0.01, "ry": 0.02, "rz": 0.01},
        },
        "affine_12": None,
        "translation_only": {"translation": [10.0, -2.0, 0.5], "rms": 0.19, "max": 0.4, "leave_one_out": 0.21},
        "rotation_support": {"supported": False, "p_value": 0.4, "verdict": "the data do not support a rotation"},
        "residual_directions": [
            {"axis": [1.0, 0.0, 0.0], "sd": 0.12},
            {"axis": [0.0, 1.0, 0.0], "sd": 0.1},
            {"axis": [0.0, 0.0, 1.0], "sd": 0.1},
        ],
        "residual_sd_xyz": [0.12, 0.1, 0.1],
        "effects": [],
        "effects_tried": [],
        "as_found": statistics(10.3, 12),
        "before": statistics(0.18, 12),
        "after": statistics(0.18, 12),
        "after_all": statistics(0.18, 12),
        "leave_one_out": {"before": 0.2, "after": 0.2},
        "heldout": {
            "scheme": "leave-one-out",
            "n": 12,
            "before": statistics(0.2, 12),
            "after": statistics(0.2, 12),
            "repaired_ids": [],
        },
        "inlier_threshold": 0.6,
        "noise_floor": None,
        "unexplained": {"present": None, "correlates": []},
        "spots": spots(12, 0.1),
    }


def everything() -> dict[str, Any]:
    """A measured record with several effects, hidden ones, questions, outliers and what else a page may have to show."""
    record = copy.deepcopy(nothing_found())
    rows = spots(96, 0.11, seed=7)
    rows[4].update(inlier=False, after=7.31, before=8.02, dx=6.9, dy=-2.1, dz=1.2, weight=0.0)
    rows[40].update(inlier=False, after=3.2, before=3.9, dx=0.4, dy=3.1, dz=0.7, weight=0.0)
    rows[10].update(reference_id="SP021", repaired=True, before=22.4)
    rows[20].update(reference_id="SP011", repaired=True, before=21.9)
    record.update(
        kind="measured",
        frame="free",
        n_source=100,
        n_reference=98,
        n_matched=96,
        n_inliers=94,
        missing=["SP097", "SP098", "SP099", "SP100"],
        extra=["TB_01", "TB_02"],
        matching={"by": "id", "not_equal_names": [{"id": "SP003", "reference_id": "sp_003", "rule": "spelling"}]},
        affine_12={"rms": 1.1, "leave_one_out": 1.31},
        as_found=statistics(641.0, 96),
        before=statistics(1.42, 96),
        after=statistics(0.19, 94),
        after_all=statistics(0.84, 96),
        leave_one_out={"before": 1.47, "after": 0.2},
        inlier_threshold=0.74,
        residual_directions=[
            {"axis": [0.1, 0.99, 0.1], "sd": 0.31},
            {"axis": [1.0, 0.0, 0.0], "sd": 0.11},
            {"axis": [0.0, 0.0, 1.0], "sd": 0.1},
        ],
        residual_sd_xyz=[0.11, 0.31, 0.1],
        seed=3,
        spots=rows,
    )
    record["effects"] = [
        effect(
            "swapped_ids",
            {"ids": ["SP011", "SP021"]},
            named=True,
            remedy="spot_list",
            rivals=[{"name": "names right, spots displaced", "heldout_rms": 21.4}],
            evidence={"wrong_list": "source", "loo_before": 4.2, "loo_after": 1.47, "checked": True, "seen": None},
        ),
        effect(
            "joint_zero",
            {"axis": 3},
            parameters={"offset": parameter(0.1204, "degrees", 0.0131)},
            not_separated_from=["gravity_sag"],
            rivals=[
                {"name": "joint_zero", "where": {"axis": 2}, "heldout_rms": 1.1},
                {"name": "gravity_sag", "heldout_rms": 0.23},
                {"name": "scale", "heldout_rms": 1.31},
            ],
            heldout_rms=0.21,
            heldout_gain=0.92,
            remedy_text="",
        ),
        effect(
            "group_shift",
            {"column": "station", "level": "S2"},
            parameters={
                name: parameter(value, "mm", 0.06) for name, value in zip("xyz", (0.8, -0.05, 0.31), strict=True)
            },
            p_value=0.012,
            remedy="base",
            not_separated_from=["wrong_frame", "drift"],
        ),
        effect(
            "tip_wear",
            {},
            parameters={
                "per_weld": parameter(-0.0007, "mm", 0.0002),
                "from": {"value": 0.5, "unit": "", "ci95": [0.1, 1.6]},
                "tilt": parameter(None, "degrees"),
            },
            remedy="process",
        ),
    ]
    record["effects"][1]["remedy"]["text"] = "Master axis 3 again at its mark, then measure ten spots again."
    record["effects_tried"] = [
        {
            "name": "gravity_sag",
            "where": {"axis": 2},
            "p_value": 0.004,
            "heldout_rms": 0.23,
            "verdict": "lost to joint_zero",
        },
        {"name": "scale", "where": {}, "p_value": 0.2, "heldout_rms": 1.31, "verdict": "no gain"},
        *(
            {
                "name": "covariate",
                "where": {"column": f"col_{i}"},
                "p_value": 0.5,
                "heldout_rms": 1.4 + i / 100,
                "verdict": "",
            }
            for i in range(24)
        ),
    ]
    record["hidden"] = [
        {"name": "joint_zero", "where": {"axis": 1}, "share": 1.0, "absorbed_by": "rigid", "measure": None},
        {
            "name": "link_length",
            "where": {"parameter": "a2"},
            "share": 0.93,
            "absorbed_by": ["rigid", "joint_zero"],
            "measure": "the same spots near and far from the robot",
        },
    ]
    record["questions"] = [
        {"text": "does the rail bend", "missing": None},
        {"text": "is axis 3 or the sag of the arm the cause", "missing": 12},
    ]
    record["measure_next"] = ["twelve spots with the elbow down", "five spots with and without payload"]
    record["heldout"] = {
        "scheme": "nested, 5 blocks in space",
        "n": 96,
        "before": statistics(1.51, 96),
        "after": statistics(0.21, 96),
        "repaired_ids": ["SP011", "SP021"],
    }
    record["noise"] = {"sigma": 0.11, "floor": 0.08, "ratio": 1.38, "reached": False, "source": "repeats"}
    record["unexplained"] = {
        "present": True,
        "text": "what is left is larger than the noise and follows temperature_c",
        "correlates": [{"column": "temperature_c", "strength": 0.41, "p_value": 0.002}],
    }
    record["issues"] = [
        {
            "level": "info",
            "code": "ROTATION_NOT_SUPPORTED",
            "message": "no rotation",
            "path": None,
            "line": None,
            "column": None,
        },
        {
            "level": "warning",
            "code": "OUTLIER",
            "message": "SP005 is 7.31 mm off",
            "path": "t.csv",
            "line": 6,
            "column": 1,
        },
    ]
    return record
