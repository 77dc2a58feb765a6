"""Effects of the cell: the part, its stations, the clock, the rail, and the list that people keep."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from respot.simulation.arm import Floats
from respot.simulation.columns import COVARIATES, GROUPS, is_text, number
from respot.simulation.effects_arm import nowhere
from respot.simulation.state import Cell, Effect, State, direction, rigid_motion

#: Turn [rad] of a body that moves its far spots by about as much as a shift of 1 mm does.
_TURN = 6e-4


def moving(name: str, where: Mapping[str, Any], field: Floats, values: Callable[[float], Mapping[str, Any]]) -> Effect:
    """Return an effect that shifts what is measured by `field` (n, 3) [mm] at an amplitude of one."""

    def push(state: State, size: float) -> None:
        state.shift += field * size

    return Effect(name, where, push, values)


def scale(cell: Cell, rng: np.random.Generator, place: str | None) -> Effect:
    """Part and fixture are warmer than the drawing."""
    nowhere("scale", place)
    unit = 1e-3 * rng.choice([-1.0, 1.0])
    field = unit * (cell.positions - cell.positions.mean(axis=0))
    return moving("scale", {}, field, lambda size: {"per_mille": 1e3 * unit * size})


def deformation(cell: Cell, rng: np.random.Generator, place: str | None) -> Effect:
    """The part is bent: an arch, a twist and a bit of a wave across its side."""
    nowhere("deformation", place)
    middle = cell.positions.mean(axis=0)
    u, v = (cell.positions - middle)[:, 1] / 800.0, (cell.positions - middle)[:, 2] / 600.0
    bend = rng.normal(0, 1, 3)
    wave = rng.normal(0, 0.35, 2)
    height = bend[0] * u**2 + bend[1] * u * v + bend[2] * v**2 + wave[0] * np.sin(2 * u) * u**2 + wave[1] * v**3
    normal = np.array([1.0, *rng.normal(0, 0.25, 2)])
    normal /= np.linalg.norm(normal)
    return moving(
        "deformation",
        {},
        height[:, None] * normal,
        lambda size: {"bends_mm": (bend * size).tolist(), "normal": normal.tolist()},
    )


def _body(rng: np.random.Generator) -> tuple[Floats, Floats]:
    """A small motion of a body: shift [mm] and turn [rad]."""
    return direction(rng), direction(rng) * _TURN * rng.uniform(0.3, 1.0)


def _with_time(cell: Cell, rng: np.random.Generator, share: Floats) -> tuple[Floats, Floats, Floats]:
    """Shifts of spots by a body that moves by a share (n,) of a small motion; the motion as well."""
    shift, rotation = _body(rng)
    whole = rigid_motion(cell.positions, cell.positions.mean(axis=0), shift, rotation)
    return share[:, None] * whole, shift, rotation


def drift(cell: Cell, rng: np.random.Generator, place: str | None) -> Effect:
    """The tracker's stand creeps all day, at not quite the same pace."""
    nowhere("drift", place)
    day = cell.minutes / cell.minutes.max()
    pace = rng.uniform(-0.2, 0.2)
    field, shift, rotation = _with_time(cell, rng, day + pace * day * (day - 1))
    return moving(
        "drift",
        {"column": "time_min"},
        field,
        lambda size: {"over_the_day_mm": (shift * size).tolist(), "turn_mrad": (1e3 * rotation * size).tolist()},
    )


def warmup(cell: Cell, rng: np.random.Generator, place: str | None) -> Effect:
    """The robot grows while it gets warm: one time constant, or two."""
    nowhere("warmup", place)
    fast = rng.uniform(15, 70)
    slow, share = fast * rng.uniform(2.5, 4), float(rng.choice([1.0, rng.uniform(0.5, 0.85)]))
    risen = 1 - share * np.exp(-cell.minutes / fast) - (1 - share) * np.exp(-cell.minutes / slow)
    field, shift, _ = _with_time(cell, rng, risen)
    return moving(
        "warmup",
        {"column": "time_min"},
        field,
        lambda size: {"at_last_mm": (shift * size).tolist(), "minutes": [fast, slow], "share_of_first": share},
    )


def group_shift(cell: Cell, rng: np.random.Generator, place: str | None) -> Effect:
    """One station, fixture, program or measuring session moved as a body."""
    column, _, level = (place or str(rng.choice(GROUPS))).partition("=")
    if column not in cell.columns or not is_text(cell.columns[column]):
        raise ValueError(f"{column} names no groups: {', '.join(GROUPS)}")
    values = cell.columns[column]
    levels, counts = np.unique(values.astype(str), return_counts=True)
    if not level:
        fit = levels[(counts >= 4) & (counts <= 0.5 * cell.n)]
        level = str(rng.choice(fit if len(fit) else levels))
    inside = values == level
    if not inside.any():
        raise ValueError(f"{column} has no {level}: {', '.join(levels)}")
    shift, rotation = _body(rng)
    body = rigid_motion(cell.positions, cell.positions[inside].mean(axis=0), shift, rotation)
    return moving(
        "group_shift",
        {"column": column, "level": level},
        np.where(inside[:, None], body, 0.0),
        lambda size: {"shift_mm": (shift * size).tolist(), "turn_mrad": (1e3 * rotation * size).tolist()},
    )


def covariate(cell: Cell, rng: np.random.Generator, place: str | None) -> Effect:
    """Spots follow some further column: a number until they have enough of it, or a name."""
    column = place or str(rng.choice(COVARIATES))
    if column not in cell.columns:
        raise ValueError(f"there is no column {column}: {', '.join(cell.columns)}")
    if is_text(cell.columns[column]):
        values = cell.columns[column].astype(str)
        levels = np.unique(values)
        shifts = rng.normal(0, 1, (len(levels), 3)) / np.sqrt(3)
        field = shifts[np.searchsorted(levels, values)]
        return moving(
            "covariate",
            {"column": column},
            field,
            lambda size: {f"{name}_mm": (shift * size).tolist() for name, shift in zip(levels, shifts, strict=True)},
        )
    value = number(cell.columns, column)
    value = (value - value.min()) / np.ptp(value)
    half, way = rng.uniform(0.3, 0.8), direction(rng)
    share = value * (1 + half) / (value + half)
    return moving(
        "covariate",
        {"column": column},
        2 * share[:, None] * way,
        lambda size: {"over_the_range_mm": (2 * way * size).tolist(), "half_at_part_of_range": half},
    )


def rail(cell: Cell, rng: np.random.Generator, place: str | None) -> Effect:
    """The rail is neither straight nor level: it bows, and the robot pitches, rolls and yaws along it."""
    nowhere("rail", place)
    if cell.layout.rail is None:
        raise ValueError("rail needs a robot on a rail")
    half = 0.5 * np.ptp(cell.layout.rail)
    part = (cell.layout.rail - cell.layout.rail.min()) / half - 1.0
    bow = rng.normal(0, 0.5, (3, 2)) * np.array([[1.0], [0.3], [1.0]])
    ratio = rng.normal(0, 0.3)
    tilt = rng.normal(0, 2.5e-4, (3, 2))
    shift = (bow[:, 0] * np.cos(np.pi * part / 2)[:, None]) + bow[:, 1] * (part**3 - 0.6 * part)[:, None]
    shift[:, 1] += ratio * part
    turned = tilt[:, 0] * part[:, None] + tilt[:, 1] * (part**2 - 1 / 3)[:, None]

    def push(state: State, size: float) -> None:
        state.root_at += shift * size
        state.root_turn += turned * size

    def values(size: float) -> Mapping[str, Any]:
        names = ("pitch", "roll", "yaw")  # about X, Y, Z of the world; the rail runs along Y
        slopes = {f"{name}_mrad": (1e3 * row * size).tolist() for name, row in zip(names, tilt, strict=True)}
        return {"bows_mm": (bow * size).tolist(), "ratio_per_mille": 1e3 * ratio * size / half, **slopes}

    return Effect("rail", {"axis": "e1"}, push, values)


def swapped_ids(cell: Cell, rng: np.random.Generator, place: str | None, size: float | None = None) -> Effect:
    """Two spots carry each other's names in the measured list; without a size a neighbour, at times three in a ring."""
    nowhere("swapped_ids", place)
    if size is None:
        first = int(rng.integers(cell.n))
        near = np.argsort(np.linalg.norm(cell.positions - cell.positions[first], axis=1))[1:7]
        ring = [first, *(int(k) for k in rng.choice(near, 1 if rng.random() < 0.75 else 2, replace=False))]
    else:  # no other pair comes as near to the distance that leaves the size
        one, two = np.triu_indices(cell.n, 1)
        apart = np.linalg.norm(cell.positions[one] - cell.positions[two], axis=1)
        best = int(np.argmin(np.abs(apart * np.sqrt(2 / cell.n) - size)))
        ring = [int(one[best]), int(two[best])]

    def push(state: State, _: float) -> None:
        state.ids[ring] = state.ids[np.roll(ring, 1)]

    return Effect("swapped_ids", {"rows": ring}, push, lambda _: {}, fixed=True)


def convention(_: Cell, rng: np.random.Generator, place: str | None) -> Effect:
    """Orientations of the measured list are written in a convention that its reader does not expect."""
    kinds: dict[str, Callable[[Rotation], Rotation]] = {
        "euler_xyz": lambda real: _zyx(real.as_euler("XYZ", degrees=True)),
        "sign": lambda real: _zyx(-real.as_euler("ZYX", degrees=True)),
        "radians": lambda real: _zyx(real.as_euler("ZYX")),
        "quaternion_scalar_last": lambda real: Rotation.from_quat(real.as_quat(), scalar_first=True),
    }
    kind = str(rng.choice(list(kinds))) if place is None else place
    if kind not in kinds:
        raise ValueError(f"{kind} is no convention: {', '.join(kinds)}")

    def push(state: State, size: float) -> None:  # noqa: ARG001
        state.misread = kinds[kind]

    return Effect("convention", {"convention": kind}, push, lambda _: {}, fixed=True)


def _zyx(degrees: Floats) -> Rotation:
    """Orientations as the reader of A, B, C takes three numbers."""
    return Rotation.from_euler("ZYX", degrees, degrees=True)
