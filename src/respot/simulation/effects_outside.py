"""Effects that the engine has no file for: it must say that it does not know them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from respot.simulation.arm import apply
from respot.simulation.effects_arm import loads, nowhere
from respot.simulation.effects_cell import moving
from respot.simulation.state import GRAVITY, Cell, Effect, State, direction


def axis_scale(cell: Cell, rng: np.random.Generator, place: str | None) -> Effect:
    """The part grows along one of its axes alone."""
    axis = "xyz"[int(rng.integers(3))] if place is None else place
    if axis not in {"x", "y", "z"}:
        raise ValueError(f"{axis} is no axis of the part: x y z")
    column = "xyz".index(axis)
    field = np.zeros((cell.n, 3))
    field[:, column] = 1e-3 * (cell.positions - cell.positions.mean(axis=0))[:, column]
    return moving("axis_scale", {"axis": axis}, field, lambda size: {"per_mille": size})


def gun_flex(cell: Cell, rng: np.random.Generator, place: str | None) -> Effect:
    """A worn docking: it gives way with the square of the load across it, sticks, and more so far out."""
    nowhere("gun_flex", place)
    across, sideways = direction(rng), direction(rng)
    down = apply(np.swapaxes(cell.frames.flange, 1, 2), np.array([0.0, 0.0, -1.0]))
    load, other = down @ across, down @ sideways
    reach = np.linalg.norm((cell.positions - cell.layout.root_at)[:, :2], axis=1) / 2000.0
    stick = rng.uniform(0.2, 0.5)
    give = (load * np.abs(load) + stick * np.tanh(4 * other)) * (0.4 + reach**2)
    field = give[:, None] * across + 0.5 * (load * other * reach)[:, None] * sideways

    def push(state: State, size: float) -> None:
        state.tool_shift += field @ cell.gun.turn * size

    return Effect("gun_flex", {}, push, lambda size: {"mm": size, "across": across.tolist(), "stick": stick})


def refraction(cell: Cell, rng: np.random.Generator, place: str | None) -> Effect:
    """Warm air before the tracker: an error along the line of sight that grows with the square of the way."""
    nowhere("refraction", place)
    sight = cell.positions - cell.tracker
    far = np.linalg.norm(sight, axis=1)
    field = sight / far[:, None] * ((far / far.mean()) ** 2)[:, None]
    unit = float(rng.choice([-1.0, 1.0]))
    mean = float(far.mean())
    return moving(
        "refraction",
        {},
        unit * field,
        lambda size: {
            "mm_at_mean_distance": unit * size,
            "mean_distance_mm": mean,
            "tracker_mm": cell.tracker.tolist(),
        },
    )


def hvac(cell: Cell, rng: np.random.Generator, place: str | None) -> Effect:
    """The hall's ventilation starts and stops, and everything follows it to and fro."""
    nowhere("hvac", place)
    period, phase, way = rng.uniform(20, 26), rng.uniform(0, 2 * np.pi), direction(rng)
    wave = np.sin(2 * np.pi * cell.minutes / period + phase)
    field = (wave + 0.2 * wave**3)[:, None] * way
    return moving(
        "hvac",
        {"column": "time_min"},
        field,
        lambda size: {"amplitude_mm": (way * size).tolist(), "period_min": period},
    )


def cable_drag(cell: Cell, rng: np.random.Generator, place: str | None) -> Effect:
    """The dress pack runs from the foot over the upper arm to the gun: it pulls and twists as axes 1, 4 and 6 turn."""
    nowhere("cable_drag", place)
    frames = cell.frames
    hook = frames.origins[:, 2] + apply(frames.turns[:, 2], np.array([-220.0, rng.uniform(-200, 200), 280.0]))
    grip = frames.flange_at + apply(frames.flange, np.array([rng.uniform(150, 260), rng.uniform(-120, 120), 90.0]))
    span = hook - grip
    long = np.linalg.norm(span, axis=1)
    pull = 1.0 * np.maximum(long - 0.85 * long.min(), 0.0) ** 1.2  # [N]
    forces = pull[:, None] * span / long[:, None]
    one, four, six = np.radians(cell.layout.joints[:, [0, 3, 5]]).T
    soft = np.array([0.4, 0.0, 0.8, 6.0, 5.0, 8.0]) * rng.uniform(0.6, 1.4, 6) * 1e-6  # [rad / N m]
    yields = np.column_stack([soft[joint] * cell.torque_arm(grip, forces, joint) for joint in range(6)])
    twist = rng.uniform(20, 60)  # [N m / rad] of the hose between fore-arm and gun
    yields[:, 3] -= soft[3] * twist * (four + 0.6 * six)
    yields[:, 5] -= soft[5] * twist * (six + 0.6 * four)
    yields[:, 0] -= soft[0] * 800.0 * one * np.abs(one)  # the hose on the floor tightens to either side
    wrong = np.degrees(yields)

    def push(state: State, size: float) -> None:
        state.joints += wrong * size

    return Effect("cable_drag", {"axes": [1, 4, 6]}, push, lambda size: {"softness": (soft * size).tolist()})


def floor(cell: Cell, rng: np.random.Generator, place: str | None) -> Effect:
    """The robot's foot stands on a floor that gives way under the overturning moment, softer to one side."""
    nowhere("floor", place)
    moment = np.zeros((cell.n, 3))
    for _, mass, centre in loads(cell):
        moment += np.cross((centre - cell.layout.root_at) / 1000.0, mass * GRAVITY)  # [N m]
    side = rng.uniform(0, np.pi)
    own = np.array([[np.cos(side), np.sin(side), 0], [-np.sin(side), np.cos(side), 0], [0, 0, 1.0]])
    soft = np.array([1.0, rng.uniform(0.2, 0.6), 0.0]) * 1e-7  # [rad / N m]
    tilt = (moment @ own.T * soft) @ own

    def push(state: State, size: float) -> None:
        state.root_turn += tilt * size

    def values(size: float) -> Mapping[str, Any]:
        return {"rad_per_mnm": (soft[:2] * size * 1e6).tolist(), "softest_deg": float(np.degrees(side))}

    return Effect("floor", {}, push, values)
