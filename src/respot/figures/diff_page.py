"""The page of ``respot diff``: what moved and what else is different, for a reviewer before a download."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from respot import __version__
from respot.difference.findings import NOISE
from respot.figures.pages import render

_LEVELS = ("error", "warning", "info")
#: Rows of a table on the page: a browser takes no more with ease. The JSON has them all.
_MOST_ROWS = 2000
_WORDS = (
    ("moved", "target moved", "targets moved"),
    ("frames", "frame changed", "frames changed"),
    ("added", "target added", "targets added"),
    ("removed", "target removed", "targets removed"),
    ("renamed", "name changed", "names changed"),
    ("code", "change of code", "changes of code"),
    ("files", "file differs", "files differ"),
)


def diff_page(
    record: Mapping[str, Any],
    *,
    tolerance: tuple[float, float] = (0.0, 0.0),
    issues: Sequence[Mapping[str, Any]] = (),
) -> str:
    """Return a comparison as one HTML file that needs nothing from outside.

    Parameters
    ----------
    record : mapping
        The JSON object of ``respot diff``.
    tolerance : (float, float)
        What counted as the same place, mm and degrees.
    issues : sequence of mapping
        Issues as in the JSON.
    """
    values = {
        "old": record["old"],
        "new": record["new"],
        "same": record["same"],
        "tolerance": tolerance,
        "robots": [_robot(robot) for robot in record["robots"]],
        "files": record["files"],
        "issues": sorted(issues, key=lambda issue: _LEVELS.index(issue["level"])),
        "version": record.get("version") or __version__,
    }
    return render("diff.html.j2", values)


def _robot(robot: Mapping[str, Any]) -> dict[str, Any]:
    moved = sorted(robot["moved"], key=_largest, reverse=True)
    rows = [_moved(item) for item in moved[:_MOST_ROWS]]
    return {
        **robot,
        "counts": [(len(robot[name]), one if len(robot[name]) == 1 else many) for name, one, many in _WORDS],
        "moved": rows,
        "notes": any(row["said"] for row in rows),
        "moved_left": max(0, len(moved) - _MOST_ROWS),
        "frames": [{**item, "said": _frame(item)} for item in robot["frames"]],
        "code": [_code(item) for item in robot["code"][:_MOST_ROWS]],
        "code_left": max(0, len(robot["code"]) - _MOST_ROWS),
        "noise": [(NOISE[kind], count) for kind, count in robot["noise_counts"].items()],
    }


def _largest(item: Mapping[str, Any]) -> float:
    return max((shift["distance"] for shift in (item["shift"], item["world"]) if shift is not None), default=0.0)


def _moved(item: Mapping[str, Any]) -> dict[str, Any]:
    numbers = []
    for shift, turn in (
        (item["shift"], item["turn_deg"]),
        (item["world"], (item["world"] or {}).get("turn_deg")),
    ):
        known = shift is not None
        numbers += [f"{shift[name]:.3f}" if known else "" for name in ("dx", "dy", "dz", "distance")]
        numbers.append(f"{turn:.4f}" if known and turn is not None else "")
    changes = {**item["configuration"], **item["axes"]}
    said = [f"{name} {_value(old)} to {_value(new)}" for name, (old, new) in changes.items()]
    if item["old_base"] != item["base"]:
        said.append(f"base {item['old_base'] or 'unknown'} to {item['base'] or 'unknown'}")
    return {**item, "numbers": numbers, "said": said}


def _frame(item: Mapping[str, Any]) -> list[str]:
    said = []
    shift = item["shift"]
    if shift is not None:
        way = ", ".join(f"{shift[name]:.3f}" for name in ("dx", "dy", "dz"))
        said.append(f"by ({way}), {shift['distance']:.3f} mm, {item['turn_deg']:.4f} deg")
    said += [f"{name} {_value(old)} to {_value(new)}" for name, (old, new) in item["fields"].items()]
    return said


def _code(item: Mapping[str, Any]) -> dict[str, Any]:
    places = [f"{place['path']}:{place['line']}" for place in (item["old"], item["new"]) if place is not None]
    return {**item, "place": " to ".join(dict.fromkeys(places))}


def _value(value: float | str | None) -> str:
    return "none" if value is None else f"{value:g}" if isinstance(value, float) else str(value)
