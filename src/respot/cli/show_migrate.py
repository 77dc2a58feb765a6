"""A line on the terminal."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from respot.cli.display import Column, heading, line, table, table_width, terminal_width
from respot.figures.line_page import common_text, goes_with_text, headline, size_text
from respot.figures.words import effect_noun, figure, listing

if TYPE_CHECKING:
    from respot.line.line_file import LineFile

_LEFT = False
#: Of the last column: it is cut before figures are, to no fewer letters than these; and what stands around it.
_LEAST_ROOM, _AROUND = 16, 5


def show_line(data: Mapping[str, Any], file: LineFile, output: Path | None) -> None:
    """Print a line: each robot, what returns, what failed, where it is."""
    heading(f"Line {data['line']} ({file.path})")
    _show_robots(data)
    _show_fleet(data)
    _show_groups(data)
    failed = [robot for robot in data["robots"] if robot["error"]]
    if failed:
        heading("failed")
        for robot in failed:
            line(f"  {robot['name']}: {robot['error']['code']} {robot['error']['message']}")
    heading("in short")
    if data["running"] is not None:
        line(f"  running: {data['running']}")
    if output is None:
        good = sum(robot["state"] == "dry-run" for robot in data["robots"])
        line(f"  {good} of {len(data['robots'])} robots can be done; nothing written (dry run)")
        return
    line(f"  {headline(data['totals'])}")
    skipped = sum(robot["state"] == "skipped" for robot in data["robots"])
    if skipped:
        line(f"  {skipped} were done before and did not change")
    if data["running"] is None:  # the summary comes last
        line(f"  in {output}: index.html, line.csv, line.json, robots/NAME")


def _show_robots(data: Mapping[str, Any]) -> None:
    rows, marked = [], []
    for robot in data["robots"]:
        effects = [effect_noun(effect["name"], effect["where"]) for effect in robot["effects"]]
        seconds = robot["seconds"]
        rows.append(
            [
                robot["name"],
                robot["state"],
                "" if robot["spots"] is None else str(robot["spots"]),
                *("" if robot[key] is None else figure(robot[key]) for key in ("before", "after")),
                str(robot["edits"] or ""),
                "" if seconds is None else f"{seconds:.1f}",
                listing(effects) or robot["note"] or (robot["error"] or {}).get("code", ""),
            ]
        )
        marked.append(robot["state"] == "failed" or bool(robot["refused"]))
    columns = [
        Column("robot", _LEFT),
        Column("state", _LEFT),
        Column("spots"),
        Column("before"),
        Column("after"),
        Column("targets"),
        Column("seconds"),
        Column("effects, notes", _LEFT),
    ]
    room = max(_LEAST_ROOM, terminal_width() - table_width(columns[:-1], [row[:-1] for row in rows]) - _AROUND)
    for row in rows:
        row[-1] = row[-1] if len(row[-1]) <= room else f"{row[-1][: room - 1]}…"
    table(columns, rows, marked)
    for robot in data["robots"]:
        for text in robot["refused"]:
            line(f"  REFUSED, left as it was: {robot['name']}, {text}")


def _show_fleet(data: Mapping[str, Any]) -> None:
    returning = [row for row in data["fleet"] if row["count"] > 1]
    if not returning:
        return
    heading("effects that return")
    for row in returning:
        size = size_text(row["size"])
        large = f"; {size}" if size else ""
        line(f"  {row['label']}: {row['count']} of {row['of']} robots, named on {row['named']}{large}")
        for item in row["goes_with"]:
            line(f"    gathers on {goes_with_text(item)}")


def _show_groups(data: Mapping[str, Any]) -> None:
    for group in data["groups"]:
        for effect in group["effects"]:
            shown = f"{effect['label']} ({listing(effect['robots'])})"
            line(f"  group {group['group']}, {shown}: {common_text(effect)}")
