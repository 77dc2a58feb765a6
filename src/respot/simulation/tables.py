"""The tables of a simulated line: what is programmed, what was measured, and the truth apart from both."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Sequence

import numpy as np

from respot.simulation.arm import Floats
from respot.simulation.columns import is_text
from respot.simulation.line import Line

_JOINTS = [f"j{axis}" for axis in range(1, 7)]
_MEASURED_JOINTS = [f"jm{axis}" for axis in range(1, 7)]


def programmed_csv(line: Line) -> str:
    """Programmed spots in the order of the path: pose in the world frame [mm, deg], joints, rail."""
    names = ["id", "x", "y", "z", "a", "b", "c", *_JOINTS]
    blocks = [
        _texts(line.positions, 4),
        _texts(line.rotations.as_euler("ZYX", degrees=True), 5),
        _texts(line.joints, 5),
    ]
    if line.external_axes is not None:
        names.append("e1")
        blocks.append(_texts(line.external_axes[:, :1], 3))
    rows = [[line.ids[row], *(cell for block in blocks for cell in block[row])] for row in np.argsort(line.order)]
    return _csv(names, rows)


def measured_csv(line: Line) -> str:
    """Measured spots in the order of the clock: position in the tracker's frame [mm], joints, what the plant recorded.

    Joints come from the robot, which knows its spots by their right names; all else stands with the measured place.
    """
    named = {name: row for row, name in enumerate(line.ids)}
    robot = [named[name] for name in line.measured_ids]
    names, blocks = ["id", "x", "y", "z"], [_texts(line.measured, 3)]
    if line.measured_rotations is not None:
        titles, values = _orientation(line)
        names += titles
        blocks.append(values)
    names += [*_JOINTS, *_MEASURED_JOINTS]
    blocks += [_texts(line.joints[robot], 5), _texts(line.measured_joints[robot], 5)]
    if line.external_axes is not None:
        names.append("e1")
        blocks.append(_texts(line.external_axes[robot, :1], 3))
    for name, column in line.columns.items():
        names.append(name)
        blocks.append([[str(value) if is_text(column) else f"{float(value):.10g}"] for value in column])
    when = np.argsort(line.columns["time_min"].astype(float)) if "time_min" in line.columns else np.argsort(line.order)
    rows = [[line.measured_ids[row], *(cell for block in blocks for cell in block[row])] for row in when]
    return _csv(names, rows)


def truth_json(line: Line) -> str:
    """Everything that is hidden: effects, noise-free positions, right names, registration."""
    record = {
        "seed": line.seed,
        "layout": line.layout,
        "robot": line.robot["name"],
        "spots": line.n,
        "noise": line.noise,
        "effects": [dict(effect) for effect in line.truth],
        "world2tracker": line.world2tracker.tolist(),
        "measured_true": [
            {"listed_as": listed, "is": real, "xyz": np.round(xyz, 3).tolist()}
            for listed, real, xyz in zip(line.measured_ids, line.ids, line.measured_true, strict=True)
        ],
    }
    return json.dumps(_short(record), indent=1) + "\n"


def _short(value: object) -> object:
    """Numbers to nine significant digits: the last ones depend on the processor."""
    if isinstance(value, dict):
        return {name: _short(item) for name, item in value.items()}
    if isinstance(value, list):
        return [_short(item) for item in value]
    return float(f"{value:.9g}") if isinstance(value, float) else value


def _orientation(line: Line) -> tuple[list[str], list[list[str]]]:
    """Orientations as the list spells them, right or in a convention of its own."""
    kinds = [effect["where"]["convention"] for effect in line.truth if effect["name"] == "convention"]
    rotations = line.measured_rotations
    if rotations is None:
        raise ValueError("the line has no measured orientations")
    if kinds == ["quaternion_scalar_last"]:
        return ["q1", "q2", "q3", "q4"], _texts(rotations.as_quat(scalar_first=True), 7)
    return ["a", "b", "c"], _texts(rotations.as_euler("ZYX", degrees=True), 5)


def _texts(values: Floats, decimals: int) -> list[list[str]]:
    return [[f"{value:.{decimals}f}" for value in row] for row in values]


def _csv(names: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(names)
    writer.writerows(rows)
    return out.getvalue()
