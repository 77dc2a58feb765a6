"""What a plant records beside each spot: clock, counters, weather, names. None of it knows of any effect.

Columns hang together as in life (the hall warms up with the day, caps wear with the clock), but each is made before any
effect is, and an effect that follows a column reads it from here.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from respot.simulation.arm import Floats
from respot.simulation.layout import Layout, uneven

Column = NDArray[Any]
#: Columns whose values are names, for shifts of groups.
GROUPS = ("station", "fixture", "program", "session")
#: Columns that a covariate may follow: no other effect lives in them.
COVARIATES = ("humidity_pct", "gun_voltage", "line_speed", "operator")
_OPERATORS = ("Kaya", "Lehmann", "Novak", "Okafor")
_PARTS = ("roof", "sill", "bpillar", "rear", "wheelhouse", "cowl")


def draw_columns(layout: Layout, kind: str, rng: np.random.Generator) -> dict[str, Column]:
    """Columns of a measured line.

    Parameters
    ----------
    layout : Layout
        Spots; gives the station, the program, the path.
    kind : str
        ``easy``: measured in random order; ``hard``: in the order of the path.
    rng : numpy.random.Generator
        Source of chance.

    Returns
    -------
    dict of str to ndarray of shape (n,)
        Numbers, or objects that are strings.
    """
    n = len(layout.order)
    sequence = layout.order if kind == "hard" else rng.permutation(n)
    clock = np.cumsum(rng.uniform(0.4, 1.6, n)) * (rng.uniform(240, 420) / n)
    minutes = clock[sequence]
    welds, dresses = _caps(clock, rng)
    weather = _weather(clock, rng)
    counts = uneven(rng, n, 3)
    session = np.repeat([f"S{k}" for k in (1, 2, 3)], counts).astype(object)
    first = 10 * int(rng.integers(11, 40))
    columns: dict[str, Column] = {
        "time_min": np.round(minutes, 2),
        "welds_since_cap": welds[sequence],
        "dress_count": dresses[sequence],
        "temperature_c": np.round(weather[0][sequence], 1),
        "humidity_pct": np.round(weather[1][sequence], 1),
        "force_n": _forces(n, rng),
        "station": _names([f"ST{first + 10 * k}" for k in range(int(layout.station.max()) + 1)], layout.station),
        "fixture": _names([f"FX{k}" for k in (1, 2, 3)], rng.permutation(np.repeat([0, 1, 2], uneven(rng, n, 3)))),
        "program": _names(program_names(layout, rng), layout.program),
        "operator": _names(_OPERATORS, rng.permutation(np.repeat(range(4), uneven(rng, n, 4)))),
        "shift": np.where(minutes < clock[-1] * rng.uniform(0.4, 0.7), "early", "late").astype(object),
        "session": session[sequence],
        "batch": np.floor(4711 + minutes / 12.0 + rng.uniform(0, 1)),
        "gun_voltage": np.round(rng.normal(1.85, 0.06, n), 3),
        "line_speed": np.round(rng.uniform(52, 64, n), 1),
    }
    sign = np.sign(np.round(layout.joints - layout.approach, 6))
    columns |= {f"approach_a{axis + 1}": sign[:, axis] for axis in range(6)}
    return columns


def is_text(column: Column) -> bool:
    """Whether a column holds names."""
    return column.dtype == object


def number(columns: Mapping[str, Column], name: str) -> Floats:
    """Return a column of numbers."""
    return np.asarray(columns[name], dtype=np.float64)


def program_names(layout: Layout, rng: np.random.Generator) -> list[str]:
    """Names of the programs, in the order of their numbers."""
    style = int(rng.integers(1, 9))
    return [f"{_PARTS[k % 6]}_{style}{k // 6 + 1}" for k in range(int(layout.program.max()) + 1)]


def _names(names: tuple[str, ...] | list[str], which: Column) -> Column:
    return np.asarray(names, dtype=object)[np.asarray(which, dtype=np.int64)]


def _caps(clock: Floats, rng: np.random.Generator) -> tuple[Column, Column]:
    """Welds since the last new cap, and dressings since then, along the clock."""
    rate = rng.uniform(3.0, 6.0)
    count, life, last = rng.uniform(0, 250), rng.uniform(320, 620), 0.0
    every = rng.uniform(60, 110)
    welds = np.empty(len(clock))
    for step, now in enumerate(clock):
        count, last = count + (now - last) * rate, now
        if count > life:
            count, life = rng.uniform(0, 15), rng.uniform(320, 620)
        welds[step] = np.floor(count)
    return welds, np.floor(welds / every)


def _weather(clock: Floats, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Temperature [C] that climbs with the day and humidity [%] that wanders by itself."""
    part = clock / clock[-1]
    warm = rng.uniform(18, 22) + rng.uniform(2, 6) * np.sin(np.pi / 2 * part) + rng.normal(0, 0.25, len(clock))
    knots = rng.uniform(32, 68, 9)  # weather at the door: up and down several times in a shift
    wet = np.interp(part, np.linspace(0, 1, 9), knots) + rng.normal(0, 1.5, len(clock))
    return warm, wet


def _forces(n: int, rng: np.random.Generator) -> Column:
    """Squeeze force [N]: one of a few stacks of sheets, with the gun's scatter."""
    stacks = rng.choice([2200.0, 2600.0, 3000.0, 3500.0, 4200.0], n, p=[0.2, 0.3, 0.2, 0.2, 0.1])
    return np.round(stacks * rng.normal(1, 0.02, n))
