"""Small lines to try things on, and what two output folders must have in common."""

from __future__ import annotations

from pathlib import Path

from respot.simulation import plant_files

#: Files of an output folder that hold clock times, process numbers or nothing: the ledger and the lock.
NOT_COMPARED = ("ledger.sqlite", ".lock")


def make_line(folder: Path, robots: int, spots: int = 12, seed: int = 3, effects: str = "none") -> Path:
    """Write a simulated line and return its line file; without effects a robot takes a quarter of a second."""
    for path, data in plant_files(robots, spots, 0.1, seed, {"effects": f'"{effects}"'}):
        place = folder / path
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_bytes(data)
    return folder / "line.toml"


def contents(folder: Path) -> dict[str, bytes]:
    """Every file of an output folder that does not depend on when and how often it was made."""
    files = (path for path in sorted(folder.rglob("*")) if path.is_file())
    named = ((path.relative_to(folder).as_posix(), path) for path in files)
    return {name: path.read_bytes() for name, path in named if not name.startswith(NOT_COMPARED)}
