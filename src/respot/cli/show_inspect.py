"""A robot on the terminal: a tree of what it holds, then its frames and targets as tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from respot.cli.display import Branches, Column, line, table, tree
from respot.inspection import summary

_COLUMNS = ("routine", "line", "motion", "target", "spot", "tool", "base", "x", "y", "z", "a", "b", "c")
_TEXT = frozenset(("routine", "motion", "target", "spot", "tool", "base"))
#: Rows of a table; JSON has them all.
_MOST_ROWS = 60


def show_robots(records: Sequence[Mapping[str, Any]]) -> None:
    """Print robots: what they hold, frames, and the targets of each program in their base."""
    for record in records:
        line()
        tree(f"{record['name']}  {record['language']}, {record['model'] or 'model unknown'}", _branches(dict(record)))
        for kind in ("tools", "bases"):
            used = [frame for frame in record["frames"][kind] if frame["unknown"] or any(_pose(frame))]
            if used:
                line(f"\n{kind}")
                columns = [Column("name", number=False), Column("label", number=False), *map(Column, "xyzabc")]
                table(columns, [_frame_row(frame) for frame in used], [bool(frame["unknown"]) for frame in used])
        for program in record["programs"]:
            _show_program(program, [target for target in record["targets"] if target["program"] == program])


def show_table(record: Mapping[str, Any]) -> None:
    """Print a spot table."""
    spots = record["spots"]
    line()
    tree(record["path"], [f"spots: {len(spots)}", f"columns: {', '.join(record['columns'])}"])
    names = [name for name in "xyzabc" if name in spots[0]]
    rows = [
        [spot["id"], *("" if spot[name] is None else f"{spot[name]:.3f}" for name in names)]
        for spot in spots[:_MOST_ROWS]
    ]
    line()
    table([Column("id", number=False), *map(Column, names)], rows)
    if len(spots) > len(rows):
        line(f"... and {len(spots) - len(rows)} more; --json has them all")


def _branches(record: dict[str, Any]) -> Branches:
    facts = tuple(f"{name}: {fact['value']}" for name, fact in record["facts"].items())
    counts = summary(record)["programs"]
    moving = {name: count for name, count in counts.items() if _holds(count)}
    programs = tuple(f"{name}: {_counted(count)}" for name, count in moving.items())
    still = len(counts) - len(moving)
    rest = (f"{still} without a motion",) if still else ()
    spots = len(record["spots"])
    return [
        ("controller", facts) if facts else "controller: the backup does not tell",
        f"spots: {spots}" if spots else "spots: none that its programs tell",
        (f"programs: {len(counts)}", programs + rest),
    ]


def _holds(count: Mapping[str, Any]) -> bool:
    return bool(count["targets"] or count["joints"] or count["unresolved"])


def _counted(count: Mapping[str, Any]) -> str:
    parts = [_plural(count["spots"], "spot")] if count["spots"] else []
    if count["targets"]:
        parts.append(f"{_plural(count['targets'], 'motion')} to points")
    if count["joints"]:
        parts.append(f"{_plural(count['joints'], 'motion')} to joints")
    if count["unresolved"]:
        parts.append(f"{_plural(count['unresolved'], 'motion')} whose goal the program computes or does not tell")
    frames = [f"{kind} {', '.join(count[kind])}" for kind in ("tools", "bases") if count[kind]]
    return "; ".join([*parts, *frames])


def _plural(number: int, word: str) -> str:
    return f"{number} {word}" if number == 1 else f"{number} {word}s"


def _show_program(program: str, targets: Sequence[Mapping[str, Any]]) -> None:
    if not targets:
        return
    line(f"\n{program}")
    shown = targets[:_MOST_ROWS]
    columns = [Column(name, name not in _TEXT) for name in _COLUMNS]
    table(columns, [_row(target) for target in shown], [target["doubt"] is not None for target in shown])
    if any(target["doubt"] is not None for target in shown):
        line("(?) stands for: where the motion goes is not sure; --json says why for each")
    if len(targets) > len(shown):
        line(f"... and {len(targets) - len(shown)} more; --json has them all")


def _pose(record: Mapping[str, Any]) -> list[float]:
    return [record[name] for name in "xyzabc"]


def _frame_row(frame: Mapping[str, Any]) -> list[str]:
    if frame["unknown"]:
        return [frame["name"], f"{frame['label']} ({frame['unknown']})".strip(), *[""] * 6]
    return [frame["name"], frame["label"], *(f"{value:.3f}" for value in _pose(frame))]


def _row(target: Mapping[str, Any]) -> list[str]:
    pose = ["" if value is None else f"{value:.3f}" for value in _pose(target)]
    marks = [text for text, holds in (("weld", target["weld"]), ("external TCP", target["external_tcp"])) if holds]
    motion = ", ".join([target["kind"], *marks, *(["shifted"] if target["offset"] else [])])
    known = [target["tool"] or "?", target["base"] or "?"]
    name = f"{target['name']} (?)" if target["doubt"] is not None else target["name"]
    return [target["routine"], str(target["line"]), motion, name, target["spot_id"] or "", *known, *pose]
