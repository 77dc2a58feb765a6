"""Reads a fixture of ``tests/data/krl/binding``: one folder a trap, with the ``$config.dat`` of ``common`` unless it has its own."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from respot.languages.krl.robot import read_robots
from respot.program.moves import Move
from respot.program.robot import Robot

DATA = Path(__file__).parents[2] / "data" / "krl" / "binding"
SYSTEM = {"$config.dat", "bas.src", "$robcor.dat"}


def read(trap: str, **more: str) -> Robot:
    """Robot of a fixture; further files by name, ``__`` for the dot."""
    files = {"$config.dat": (DATA / "common" / "$config.dat").read_bytes()}
    files |= {path.name: path.read_bytes() for path in sorted((DATA / trap).iterdir())}
    files |= {name.replace("__", "."): text.encode("cp1252") for name, text in more.items()}
    placed = {f"KRC/R1/{'System' if name in SYSTEM else 'Program'}/{name}": data for name, data in files.items()}
    (robot,) = read_robots("robot", "", placed)
    return robot


def moves(trap: str, **more: str) -> list[Move]:
    """Motions of a fixture, in order."""
    return list(read(trap, **more).moves())


def by_name(trap: str) -> dict[str, Move]:
    """Motions of a fixture by the name of their target; each goes to another one."""
    return {str(move.target): move for move in moves(trap)}


def base(move: Move) -> str | None:
    return None if move.base is None else move.base.name


def tool(move: Move) -> str | None:
    return None if move.tool is None else move.tool.name


def world(move: Move) -> list[float] | None:
    return None if move.world is None else np.round(move.world.translation, 6).tolist()


def issues(robot: Robot) -> list[tuple[str, str, int]]:
    """Code, file and line of every issue."""
    return [(issue.code, str(issue.path).rpartition("/")[2], issue.line or 0) for issue in robot.issues]
