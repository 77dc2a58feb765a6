"""A line of robots to try the scale on: backups of both makers, a reference each, hidden effects, and what goes wrong.

Two backups are broken and one reference is that of another robot. Names tell nothing: what is hidden stands in the
truth alone.
"""

from __future__ import annotations

import csv
import io
import json
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from respot.simulation.backup import backup_files
from respot.simulation.line import Line, chance_of, simulate
from respot.simulation.robots import ROBOTS
from respot.simulation.tables import measured_csv

#: Fewer robots have no room for what goes wrong.
LEAST_ROBOTS = 8
#: What robots may have; the last ones have nothing. SIZE is in mm, as of `simulate`.
_EFFECTS = (
    "joint_zero@2:1.2", "joint_zero@3:1.2", "joint_zero@5:1.2", "gravity_sag:1.2", "drift:1.2", "link_length:1.2",
    "group_shift@station:1.2", "swapped_ids", "", "", "",
)  # fmt: skip
#: The gun that wears, and what it does to each robot that carries it.
_WEARS, _WEAR = "G2-C40", "tip_wear:1.2"
_GUNS = ("G1-X20", _WEARS, "G3-X35")
_PER_STATION = 4
_EPOCH = (2020, 1, 1, 0, 0, 0)
#: How far floor programs are from the simulation: shift [mm], turn [deg]; and how far hands put each spot [mm].
_SHIFT, _TURN, _BY_HAND = 25.0, 0.3, 0.4


@dataclass(frozen=True)
class PlantRobot:
    """A robot as it is drawn, before its line is simulated.

    Parameters
    ----------
    name, station, gun : str
        As the plant calls them.
    model : str
        One of `ROBOTS`.
    kind : str
        ``theory`` or ``measured``.
    effects : tuple of str
        What is hidden.
    trouble : str
        ``cut short``, ``no programs``, ``wrong reference``, or empty.
    zipped : bool
        Whether the backup is a zip.
    seed : int
        Of its own line.
    """

    name: str
    station: str
    gun: str
    model: str
    kind: str
    effects: tuple[str, ...]
    trouble: str
    zipped: bool
    seed: int


def plant_files(
    robots: int, spots: int = 40, noise: float = 0.1, seed: int = 0, options: Mapping[str, str] | None = None
) -> Iterator[tuple[str, bytes]]:
    """All files of a line, robot by robot, by their paths; the line file and the truth come last.

    Parameters
    ----------
    robots : int
        How many.
    spots : int
        Of each robot; they vary by a quarter.
    noise : float
        Standard deviation of the trackers per coordinate [mm].
    seed : int
        Source of chance.
    options : mapping of str to str
        Further lines of ``[defaults]``: key and value as TOML spells it.

    Raises
    ------
    ValueError
        Too few robots.
    """
    if robots < LEAST_ROBOTS:
        raise ValueError(f"a line has at least {LEAST_ROBOTS} robots")
    drawn = draw_plant(robots, seed)
    truth = []
    for robot in drawn:
        chance = chance_of(robot.seed, "plant")
        number = int(chance.integers(round(0.75 * spots), round(1.25 * spots) + 1))
        line = simulate(robot.model, max(8, number), noise, robot.effects, robot.seed)
        yield from _backup(robot, line)
        yield f"references/{robot.name}.csv", _reference(robot, line, noise, chance).encode()
        hidden = [{"name": each["name"], "where": each["where"]} for each in line.truth]
        truth.append({"robot": robot.name, "effects": hidden, "trouble": robot.trouble})
    yield "line.toml", _line_file(drawn, noise, options or {}).encode()
    record = {"seed": seed, "recurring": {"effect": _WEAR.partition(":")[0], "gun": _WEARS}, "robots": truth}
    yield "truth.json", (json.dumps(record, indent=1) + "\n").encode()


def draw_plant(robots: int, seed: int) -> list[PlantRobot]:
    """Draw the robots of a line."""
    chance = chance_of(seed, "line", robots)
    kuka = [name for name, spec in ROBOTS.items() if spec.maker == "kuka"]
    abb = [name for name, spec in ROBOTS.items() if spec.maker == "abb"]
    drawn = []
    for number in range(robots):
        station = 10 * (number // _PER_STATION + 1)
        measured = bool(chance.uniform() < 0.7)
        gun = _GUNS[int(chance.integers(len(_GUNS)))]
        models = kuka if chance.uniform() < 0.6 else abb
        own = _EFFECTS[int(chance.integers(len(_EFFECTS)))]
        if not measured:  # programs are brought to a theory by a rigid motion; only names can hide there
            effects = ("swapped_ids",) if chance.uniform() < 0.3 else ()
        else:
            effects = (_WEAR,) if gun == _WEARS else (own,) if own else ()
        drawn.append(
            PlantRobot(
                name=f"{station:03d}R{number % _PER_STATION + 1:02d}",
                station=f"{station:03d}",
                gun=gun,
                model=models[int(chance.integers(len(models)))],
                kind="measured" if measured else "theory",
                effects=effects,
                trouble="",
                zipped=bool(chance.uniform() < 0.5),
                seed=int(chance.integers(1 << 31)),
            )
        )
    bad = chance.permutation(robots)[:3]
    drawn[bad[0]] = replace(drawn[bad[0]], trouble="cut short", zipped=True)
    drawn[bad[1]] = replace(drawn[bad[1]], trouble="no programs", zipped=False)
    drawn[bad[2]] = replace(drawn[bad[2]], trouble="wrong reference")
    return drawn


def _backup(robot: PlantRobot, line: Line) -> Iterator[tuple[str, bytes]]:
    files = backup_files(line)
    if robot.trouble == "no programs":
        programs = (".src", ".dat", ".mod", ".sys")
        files = {path: data for path, data in files.items() if not path.lower().endswith(programs)}
    if not robot.zipped:
        yield from ((f"backups/{robot.name}/{path}", data) for path, data in files.items())
        return
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for path, data in files.items():
            archive.writestr(zipfile.ZipInfo(path, _EPOCH), data, zipfile.ZIP_DEFLATED)
    packed = out.getvalue()
    yield f"backups/{robot.name}.zip", packed[: len(packed) * 2 // 3] if robot.trouble == "cut short" else packed


def _reference(robot: PlantRobot, line: Line, noise: float, chance: np.random.Generator) -> str:
    if robot.trouble == "wrong reference":  # the names are right, and the places those of other spots
        other = simulate(robot.model, line.n, noise, (), robot.seed + 1)
        line = replace(line, measured=other.measured)
    if robot.kind == "measured":
        return measured_csv(line)
    return _theory_csv(line, chance, other=robot.trouble == "wrong reference")


def _theory_csv(line: Line, chance: np.random.Generator, *, other: bool) -> str:
    """Where the spots are planned: the floor programs, moved as one, but for what hands did to each."""
    turn = Rotation.from_rotvec(np.radians(chance.normal(0.0, _TURN / np.sqrt(3), 3)))
    middle = line.positions.mean(axis=0)
    moved = turn.apply((line.measured if other else line.positions) - middle) + middle
    planned = moved + chance.normal(0.0, _SHIFT / np.sqrt(3), 3) + chance.normal(0.0, _BY_HAND, (line.n, 3))
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["id", "x", "y", "z"])
    named = zip(line.measured_ids, planned, strict=True)
    writer.writerows([name, *(f"{value:.3f}" for value in row)] for name, row in named)
    return out.getvalue()


def _line_file(drawn: Sequence[PlantRobot], noise: float, options: Mapping[str, str]) -> str:
    lines = ["[line]", 'name = "simulated"', "", "[defaults]", "tolerance = 5.0"]
    lines += [f"{key} = {value}" for key, value in options.items()]
    for robot in drawn:
        source = f"backups/{robot.name}{'.zip' if robot.zipped else ''}"
        entry: dict[str, Any] = {"name": robot.name, "source": source, robot.kind: f"references/{robot.name}.csv"}
        entry |= {"group": f"fixture {robot.station}", "station": robot.station, "gun": robot.gun}
        lines += ["", "[[robot]]", *(f'{key} = "{value}"' for key, value in entry.items())]
        if robot.kind == "measured":
            lines.append(f"noise = {noise}")
    return "\n".join(lines) + "\n"
