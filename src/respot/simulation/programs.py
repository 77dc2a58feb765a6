"""What backups of either maker share: the order of welding, the points before the spots, templates of robot code."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from respot.simulation.arm import Floats, apply, forward
from respot.simulation.line import Line
from respot.simulation.robots import ROBOTS

#: Where the fixture stands in the world [mm], and how it is turned: A, B, C [deg].
BASE = (1420.0, -815.5, 310.25, 0.85, -0.32, 0.14)


def templates() -> Environment:
    """Return Jinja with the markers of robot code; a name that nothing fills is an error."""
    return Environment(
        loader=FileSystemLoader(Path(__file__).parent / "templates"),
        variable_start_string="<<",
        variable_end_string=">>",
        block_start_string="<%",
        block_end_string="%>",
        comment_start_string="<#",
        comment_end_string="#>",
        undefined=StrictUndefined,
        keep_trailing_newline=True,
        autoescape=False,  # noqa: S701 - robot code, not HTML
    )


def programs_of(line: Line) -> dict[str, list[int]]:
    """Spots of each program, in the order of the path."""
    if "program" not in line.columns:
        return {"spots": [int(row) for row in np.argsort(line.order)]}
    programs: dict[str, list[int]] = {}
    for row in np.argsort(line.order):
        programs.setdefault(str(line.columns["program"][row]), []).append(int(row))
    return programs


def approaches(line: Line) -> tuple[Floats, Floats]:
    """TCP (n, 3) [mm] and tool orientations (n, 3, 3) of the points from which the robot comes."""
    rail = np.zeros(line.n) if line.external_axes is None else line.external_axes[:, 0]
    foot = np.column_stack([np.zeros(line.n), rail, np.zeros(line.n)])
    frames = forward(ROBOTS[line.robot["name"]], line.approach_joints, root_at=foot)
    return frames.flange_at + apply(frames.flange, line.flange2tool[:3, 3]), frames.flange @ line.flange2tool[:3, :3]


def forces_of(line: Line) -> Floats:
    """Squeeze force (n,) [N] of each spot."""
    return line.columns["force_n"].astype(np.float64) if "force_n" in line.columns else np.full(line.n, 2600.0)
