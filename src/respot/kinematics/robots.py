"""The built-in list of robots: ``robots.json`` beside this file, with source and commit on each row.

The list holds lengths, no limits: a robot known by its name alone says "limits unknown, not checked". The two
generations of KUKA's Quantec differ in the sign of a2: ``.._extra``, ``.._prime``, ``.._ultra``, ``.._pro`` have +41,
``.._2`` has -115.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cache
from importlib import resources

from respot.issues import BadInputError
from respot.kinematics.opw import LENGTHS, OpwRobot


@dataclass(frozen=True)
class BuiltIn:
    """A row of the list: the robot, where its numbers come from, and what to know about them."""

    model: OpwRobot
    source: str
    commit: str
    note: str = ""


@cache
def built_in_robots() -> dict[str, BuiltIn]:
    """Every robot of the list by name."""
    rows = json.loads(resources.files(__package__).joinpath("robots.json").read_text(encoding="utf-8"))
    return {row["name"]: _robot(row) for row in rows}


def _robot(row: dict[str, object]) -> BuiltIn:
    source, commit, note = (str(row.get(key, "")) for key in ("source", "commit", "note"))
    fields = {key: row[key] for key in (*LENGTHS, "name")}
    fields |= {key: tuple(row[key]) for key in ("signs", "offsets_deg")}  # type: ignore[arg-type]
    origin = f"{source} {commit}".strip()
    model = OpwRobot(**fields, coupled_23=bool(row.get("coupled_23")), source=origin)  # type: ignore[arg-type]
    return BuiltIn(model, source, commit, note)


def record_of(robot: BuiltIn) -> dict[str, object]:
    """Record of a robot for JSON: lengths in mm, zero angles in degrees."""
    model = robot.model
    return {
        "name": model.name,
        "lengths": {name: getattr(model, name) for name in LENGTHS},
        "offsets_deg": list(model.offsets_deg),
        "signs": list(model.signs),
        "coupled_23": model.coupled_23,
        "limits": model.limits_text,
        "source": robot.source,
        "commit": robot.commit,
        "note": robot.note,
    }


def find_robot(name: str) -> OpwRobot:
    """Return the robot of a name; letter case, blanks, dashes and underscores do not matter.

    Raises
    ------
    BadInputError
        The list has no such robot; the message names similar ones.
    """
    robots = built_in_robots()
    if name in robots:
        return robots[name].model
    plain = {_plain(known): robot.model for known, robot in robots.items()}
    if _plain(name) in plain:
        return plain[_plain(name)]
    similar = similar_robots(name)
    hint = f"did you mean {', '.join(similar)}?" if similar else "`respot robots` lists the names"
    raise BadInputError("BAD_OPTION", f"no robot {name!r} in the built-in list: {hint} A TOML file may describe it.")


def similar_robots(name: str) -> list[str]:
    """Names of the list that resemble a name, best first, at most four."""
    plain = {_plain(known): known for known in built_in_robots()}
    return [plain[found] for found in get_close_matches(_plain(name), plain, n=4, cutoff=0.6)]


def _plain(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", name.lower())
