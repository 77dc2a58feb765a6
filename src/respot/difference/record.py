"""The `diff` record of INTERFACES.md."""

from __future__ import annotations

from collections import Counter
from typing import Any

from respot.difference.comparison import Comparison
from respot.difference.findings import (
    CodeChange,
    FileChange,
    FrameChange,
    Moved,
    Named,
    Noise,
    Place,
    Renamed,
    RobotDifference,
    Shift,
)

Record = dict[str, Any]


def as_record(comparison: Comparison) -> Record:
    """Return a comparison as plain values: every difference, however many."""
    return {
        "old": str(comparison.old.path),
        "new": str(comparison.new.path),
        "same": comparison.same,
        "robots": [_robot(robot) for robot in comparison.robots],
        "files": [_file(change) for change in comparison.files],
        "noise": [_noise(noise) for noise in comparison.noise],
    }


def _robot(robot: RobotDifference) -> Record:
    counts: Counter[str] = Counter()
    for noise in robot.noise:
        counts[noise.kind] += noise.count
    return {
        "name": robot.name,
        "language": robot.language,
        "status": robot.status,
        "same": robot.same,
        "targets": robot.targets,
        "moved": [_moved(item) for item in robot.moved],
        "frames": [_frame(item) for item in robot.frames],
        "added": [_named(item) for item in robot.added],
        "removed": [_named(item) for item in robot.removed],
        "renamed": [_renamed(item) for item in robot.renamed],
        "code": [_code(item) for item in robot.code],
        "files": [_file(item) for item in robot.files],
        "noise": [_noise(item) for item in robot.noise],
        "noise_counts": dict(sorted(counts.items())),
    }


def _place(place: Place | None) -> Record | None:
    return None if place is None else {"path": place.path, "line": place.line}


def _shift(shift: Shift | None) -> Record | None:
    if shift is None:
        return None
    return {"dx": shift.dx, "dy": shift.dy, "dz": shift.dz, "distance": shift.distance}


def _moved(item: Moved) -> Record:
    return {
        "target": item.target,
        "program": item.program,
        "routine": item.routine,
        "kind": item.kind,
        "spot_id": item.spot_id or None,
        "path": item.new.path,
        "line": item.new.line,
        "old": _place(item.old),
        "shift": _shift(item.shift),
        "turn_deg": None if item.shift is None else item.shift.turn,
        "world": None if item.world is None else {**(_shift(item.world) or {}), "turn_deg": item.world.turn},
        "tool": item.tool[1],
        "base": item.base[1],
        "old_tool": item.tool[0],
        "old_base": item.base[0],
        "configuration": {name: list(change) for name, change in item.configuration.items()},
        "axes": {name: list(change) for name, change in item.axes.items()},
    }


def _frame(item: FrameChange) -> Record:
    return {
        "kind": item.kind,
        "name": item.name,
        "change": item.change,
        "old": _place(item.old),
        "new": _place(item.new),
        "shift": _shift(item.shift),
        "turn_deg": None if item.shift is None else item.shift.turn,
        "fields": {name: list(change) for name, change in item.fields.items()},
        "before": item.texts[0],
        "after": item.texts[1],
        "moves": item.moves,
    }


def _named(item: Named) -> Record:
    return {
        "target": item.target,
        "program": item.program,
        "path": item.place.path,
        "line": item.place.line,
        "value": item.text,
    }


def _renamed(item: Renamed) -> Record:
    return {
        "old_name": item.old_name,
        "new_name": item.new_name,
        "type": item.type,
        "program": item.program,
        "old": _place(item.old),
        "new": _place(item.new),
    }


def _code(item: CodeChange) -> Record:
    return {
        "path": item.path,
        "old_path": item.old_path,
        "kind": item.kind,
        "aspects": list(item.aspects),
        "routine": item.routine,
        "old": _place(item.old),
        "new": _place(item.new),
        "old_lines": list(item.old_lines),
        "new_lines": list(item.new_lines),
    }


def _file(item: FileChange) -> Record:
    return {
        "path": item.path,
        "change": item.change,
        "kind": item.kind,
        "old_path": item.old_path or None,
        "old_bytes": item.old_bytes,
        "new_bytes": item.new_bytes,
    }


def _noise(item: Noise) -> Record:
    return {
        "kind": item.kind,
        "path": item.path,
        "line": item.line,
        "name": item.name or None,
        "old": item.old,
        "new": item.new,
        "count": item.count,
    }
