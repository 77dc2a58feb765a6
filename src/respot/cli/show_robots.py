"""The list of robots on the terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from respot.cli.display import Column, line, table

_LENGTHS = ("a1", "a2", "b", "c1", "c2", "c3", "c4")


def show_list(records: Sequence[Mapping[str, Any]]) -> None:
    """Print one line for each robot."""
    text = ("source", "commit", "note")
    columns = [Column("name", number=False), *map(Column, _LENGTHS), *(Column(name, number=False) for name in text)]
    table(columns, [_row(record) for record in records])
    line()
    line(f"{len(records)} robots; lengths in mm; limits unknown, not checked: the list holds none")
    line("--robot NAME takes one of them, --robot FILE.toml another; without it the backup's own machine data decide")


def _row(record: Mapping[str, Any]) -> list[str]:
    notes = ["axes 2 and 3 coupled"] if record["coupled_23"] else []
    notes += [record["note"]] if record["note"] else []
    lengths = [f"{record['lengths'][name]:g}" for name in _LENGTHS]
    return [record["name"], *lengths, record["source"], record["commit"], "; ".join(notes)]
