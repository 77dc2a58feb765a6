"""A comparison on the terminal: a line for each robot, the largest shifts, and the code as a unified diff."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import typer

from respot.cli.display import Column, line, table, table_width, terminal_width
from respot.cli.outcome import printable
from respot.difference.findings import NOISE

#: Rows of a table and lines of code without ``--all``.
_MOST_ROWS = 25
_MOST_LINES = 200
_COLOURS = {"-": typer.colors.RED, "+": typer.colors.GREEN, "@": typer.colors.CYAN, "~": typer.colors.YELLOW}
_HOW = "--all shows them, --json has them too"
Record = Mapping[str, Any]


@dataclass(frozen=True)
class Show:
    """How much to show, and whether in colour."""

    noise: bool = False
    everything: bool = False
    coloured: bool = False


def show_comparison(record: Record, look: Show) -> None:
    """Print a comparison."""
    for robot in record["robots"]:
        _Robot(robot, look).show()
    if record["files"]:
        line("\nfiles that belong to no robot")
        _files(record["files"], look)
    if len(record["robots"]) > 1 or record["files"]:
        same = sum(robot["same"] for robot in record["robots"])
        line(f"\n{same} of {_plural(len(record['robots']), 'robot')} without a difference")


def summary(robot: Record) -> str:
    """One line about a robot."""
    if robot["status"] != "compared":
        where = "new" if robot["status"] == "added" else "old"
        return f"{robot['name']}: only in the {where} source, {_plural(robot['targets'], 'target')}"
    counts = [
        (len(robot["moved"]), "target", "moved"),
        (len(robot["frames"]), "frame", "changed"),
        (len(robot["added"]), "target", "added"),
        (len(robot["removed"]), "target", "removed"),
        (len(robot["renamed"]), "name", "changed"),
        (len(robot["code"]), "change", "of code"),
        (len(robot["files"]), "file", "differ" if len(robot["files"]) > 1 else "differs"),
    ]
    parts = [f"{_plural(count, thing)} {what}" for count, thing, what in counts if count]
    noise = sum(robot["noise_counts"].values())
    said = ", ".join(parts) or "no difference"
    return f"{robot['name']}: {said}; noise: {noise}" if noise else f"{robot['name']}: {said}"


class _Robot:
    """Prints one robot."""

    def __init__(self, robot: Record, look: Show) -> None:
        self._robot = robot
        self._look = look

    def show(self) -> None:
        _echo(summary(self._robot), self._look, bold=True)
        if self._robot["status"] != "compared":
            return
        self._moved()
        self._frames()
        self._names()
        _code(self._robot["code"], self._look)
        if self._robot["files"]:
            line("\nfiles")
            _files(self._robot["files"], self._look)
        self._noise()

    def _moved(self) -> None:
        rows = sorted(self._robot["moved"], key=_largest, reverse=True)
        places = [item for item in rows if item["shift"] is not None]
        if places:
            line("\nlargest shifts, mm and degrees: as programmed, and in the world (the part for an external TCP)")
            shown = places if self._look.everything else places[:_MOST_ROWS]
            _table_that_fits([_moved_row(item) for item in shown])
            _more(len(places) - len(shown), "shift")
        others = [item for item in rows if item["shift"] is None]
        if others:
            line("\njoints and external axes")
            shown = others if self._look.everything else others[:_MOST_ROWS]
            for item in shown:
                line(f"  {_place(item)}: {item['target']}: {_changes(item)}")
            _more(len(others) - len(shown), "target")

    def _frames(self) -> None:
        frames = self._robot["frames"]
        if not frames:
            return
        line("\ntools, bases, loads and other frames")
        shown = frames if self._look.everything else frames[:_MOST_ROWS]
        for item in shown:
            used = f", used by {_plural(item['moves'], 'motion')}" if item["moves"] else ""
            place = item["new"] or item["old"]
            line(
                f"  {place['path']}:{place['line']}: {item['kind']} {item['name']} {item['change']}{used}{_frame(item)}"
            )
        _more(len(frames) - len(shown), "frame")

    def _names(self) -> None:
        robot = self._robot
        rows = [f"- {item['target']}  {_place(item)}" for item in robot["removed"]]
        rows += [f"+ {item['target']}  {_place(item)}" for item in robot["added"]]
        rows += [
            f"~ {item['old_name']} is now {item['new_name']} ({item['type']})  {_place(item['new'])}"
            for item in robot["renamed"]
        ]
        if not rows:
            return
        line("\nremoved (-), added (+), renamed (~)")
        shown = rows if self._look.everything else rows[:_MOST_ROWS]
        for row in shown:
            _echo(f"  {row}", self._look, _COLOURS[row[0]])
        _more(len(rows) - len(shown), "name")

    def _noise(self) -> None:
        counts = self._robot["noise_counts"]
        if not counts:
            return
        told = ", ".join(f"{NOISE[kind]}: {count}" for kind, count in counts.items())
        line(f"\nnoise, counted apart: {told}" + ("" if self._look.noise else " (--noise)"))
        if "drift" in counts:
            line("of values that the program itself writes nobody can tell whether someone edited them too")
        if not self._look.noise:
            return
        for item in self._robot["noise"]:
            times = f" ({item['count']} times)" if item["count"] > 1 else ""
            name = f" {item['name']}" if item["name"] else ""
            line(f"  {_place(item)}: {NOISE[item['kind']]}{times}{name}")
            for mark, text in (("-", item["old"]), ("+", item["new"])):
                if text:
                    _echo(f"    {mark}{_one_line(text)}", self._look, _COLOURS[mark])


_NAMES = ("target", "program", "base")
_NUMBERS = ("dX", "dY", "dZ", "distance", "turn", "world dX", "dY", "dZ", "distance", "turn")
_COLUMNS = (*(Column(name, number=False) for name in _NAMES), *map(Column, _NUMBERS), Column("", number=False))
_PROGRAM, _BASE, _TURN, _NOTES = 1, 2, 7, len(_COLUMNS) - 1
#: What a narrow terminal goes without, the least first: columns, and what these are called. How far a target moved in
#: the world always stays: where a base moved it is all that there is.
_LEAST = (
    ((_NOTES,), ""),
    ((8, 9, 10, 12), "dX, dY, dZ and turn in the world"),
    ((_BASE,), "base"),
    ((_TURN,), "turn"),
    ((_PROGRAM,), "program"),
    ((3, 4, 5), "dX, dY, dZ"),
)


def _table_that_fits(rows: Sequence[Sequence[str]]) -> None:
    """Print shifts; no number is ever cut: columns that do not fit are left out, and that is said."""
    kept = list(range(len(_COLUMNS)))
    left: list[str] = []
    for indices, name in _LEAST:
        if table_width(*_part(rows, kept)) <= terminal_width():
            break
        kept = [index for index in kept if index not in indices]
        left += [name] if name else []
    table(*_part(rows, kept))
    for row in rows:
        notes = [row[_NOTES]] if _NOTES not in kept and row[_NOTES] else []
        notes += [f"base {row[_BASE]}"] if _BASE not in kept and " -> " in row[_BASE] else []
        notes += [f"turn {row[_TURN]}"] if _TURN not in kept and row[6] == "0.000" and float(row[_TURN]) else []
        if notes:
            line(f"  {row[0]} ({row[_PROGRAM]}): {', '.join(notes)}")
    if left:
        line(f"too wide for this terminal: {'; '.join(left)}; --json has them, and what is piped")


def _part(rows: Sequence[Sequence[str]], kept: Sequence[int]) -> tuple[list[Column], list[list[str]]]:
    titles = [_COLUMNS[index] if index != 11 or 8 in kept else Column("in world") for index in kept]
    return titles, [[row[index] for index in kept] for row in rows]


def _moved_row(item: Record) -> list[str]:
    shifts = [item["shift"], item["world"]]
    turns = [item["turn_deg"], None if item["world"] is None else item["world"]["turn_deg"]]
    numbers = []
    for shift, turn in zip(shifts, turns, strict=True):
        if shift is None:
            numbers += ["", "", "?", "?", "?"]
            continue
        numbers += [*(f"{shift[name]:.3f}" for name in ("dx", "dy", "dz", "distance")), f"{turn:.4f}"]
    name = item["spot_id"] if item["spot_id"] and item["spot_id"] not in item["target"] else ""
    base = item["base"] or "?"
    if item["old_base"] != item["base"]:
        base = f"{item['old_base'] or '?'} -> {base}"
    notes = ", ".join(part for part in (name, _changes(item)) if part)
    return [item["target"], item["program"], base, *numbers, notes]


def _largest(item: Record) -> float:
    return max((shift["distance"] for shift in (item["shift"], item["world"]) if shift is not None), default=0.0)


def _changes(item: Record) -> str:
    changes = {**item["configuration"], **item["axes"]}
    return ", ".join(f"{name} {_value(old)} -> {_value(new)}" for name, (old, new) in changes.items())


def _frame(item: Record) -> str:
    parts = []
    shift = item["shift"]
    if shift is not None and (shift["distance"] > 0.0 or item["turn_deg"] > 0.0):
        way = ", ".join(f"{shift[name]:.3f}" for name in ("dx", "dy", "dz"))
        parts.append(f"by ({way}) = {shift['distance']:.3f} mm, {item['turn_deg']:.4f} deg")
    parts += [f"{name} {_value(old)} -> {_value(new)}" for name, (old, new) in item["fields"].items()]
    if not parts:
        parts = [f"{item['before'] or 'nothing'} -> {item['after'] or 'nothing'}"]
    return f": {'; '.join(parts)}"


def _value(value: float | str | None) -> str:
    return "none" if value is None else f"{value:g}" if isinstance(value, float) else str(value)


def _code(changes: Sequence[Record], look: Show) -> None:
    if not changes:
        return
    line("\ncode")
    left = len(changes) if look.everything else _MOST_LINES
    rows = list(_diff(changes))
    shown = rows if look.everything else rows[:left]
    for row in shown:
        _echo(
            row, look, _COLOURS.get(row[0]) if row[:3] not in ("---", "+++") else None, bold=row[:3] in ("---", "+++")
        )
    _more(len(rows) - len(shown), "line")


def _diff(changes: Sequence[Record]) -> Iterator[str]:
    """Yield the lines of a unified diff of statements; a block that moved is marked ``~``."""
    header = ("", "")
    for change in changes:
        shown = (change["old_path"], change["path"])
        if shown != header:
            header = shown
            yield f"--- {shown[0]}"
            yield f"+++ {shown[1]}"
        where = f" in {change['routine']}" if change["routine"] else ""
        at = [
            f"{mark}{place['line']},{len(change[lines])}"
            for mark, place, lines in (("-", change["old"], "old_lines"), ("+", change["new"], "new_lines"))
            if place is not None
        ]
        about = ", ".join(change["aspects"]) if change["kind"] != "moved" else "block moved"
        yield f"@@ {' '.join(at)} @@ {about}{where}"
        if change["kind"] == "moved":
            yield from (f"~{_one_line(text)}" for text in change["new_lines"])
            continue
        yield from (f"-{_one_line(text)}" for text in change["old_lines"])
        yield from (f"+{_one_line(text)}" for text in change["new_lines"])


def _files(files: Sequence[Record], look: Show) -> None:
    shown = files if look.everything else files[:_MOST_ROWS]
    for item in shown:
        sizes = [f"{size} bytes" for size in (item["old_bytes"], item["new_bytes"]) if size is not None]
        size = " -> ".join(dict.fromkeys(sizes))
        origin = f" from {item['old_path']}" if item["old_path"] else ""
        line(f"  {item['change']}: {item['path']}{origin} ({item['kind']}, {size})")
    _more(len(files) - len(shown), "file")


def _more(count: int, thing: str) -> None:
    if count > 0:
        line(f"... and {_plural(count, f'more {thing}')}; {_HOW}")


def _place(item: Record) -> str:
    return item["path"] if item["line"] is None else f"{item['path']}:{item['line']}"


def _one_line(text: str) -> str:
    return " ".join(text.split("\n")).replace("\r", "")


def _plural(number: int, word: str) -> str:
    return f"{number} {word}" if number == 1 else f"{number} {word}s"


def _echo(text: str, look: Show, colour: str | None = None, bold: bool = False) -> None:
    if look.coloured:
        typer.secho(printable(text), fg=colour, bold=bold or None, color=True)
    else:
        typer.echo(printable(text))
