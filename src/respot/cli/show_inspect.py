"""A robot on the terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from respot.cli.display import Column, heading, line, table

_COLUMNS = ("routine", "line", "motion", "target", "spot", "tool", "base", "x", "y", "z", "a", "b", "c")
_TEXT = frozenset(("routine", "motion", "target", "spot", "tool", "base"))


def show_robots(records: Sequence[Mapping[str, Any]]) -> None:
    """Print robots: frames, and the targets of each program in their base."""
    for record in records:
        heading(f"{record['name']} ({record['language']}, {record['model'] or 'model unknown'})")
        for kind in ("tools", "bases"):
            used = [frame for frame in record["frames"][kind] if frame["x"] is not None and any(_pose(frame))]
            rows = [[frame["name"], frame["label"], *(f"{value:.3f}" for value in _pose(frame))] for frame in used]
            if rows:
                line(f"\n{kind}")
                table([Column("name", number=False), Column("label", number=False), *map(Column, "xyzabc")], rows)
        for program in record["programs"]:
            targets = [target for target in record["targets"] if target["program"] == program]
            if targets:
                line(f"\n{program}")
                table([Column(name, name not in _TEXT) for name in _COLUMNS], [_row(target) for target in targets])


def _pose(record: Mapping[str, Any]) -> list[float]:
    return [record[name] for name in "xyzabc"]


def _row(target: Mapping[str, Any]) -> list[str]:
    pose = ["" if value is None else f"{value:.3f}" for value in _pose(target)]
    motion = f"{target['kind']}, weld" if target["weld"] else target["kind"]
    known = [target["tool"] or "?", target["base"] or "?"]
    return [target["routine"], str(target["line"]), motion, target["name"], target["spot_id"] or "", *known, *pose]
