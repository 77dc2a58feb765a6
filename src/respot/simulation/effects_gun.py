"""Effects of the gun: its frame, its weight, its force, its caps."""

from __future__ import annotations

import numpy as np

from respot.simulation.arm import apply
from respot.simulation.columns import number
from respot.simulation.effects_arm import nowhere
from respot.simulation.state import Cell, Effect, State, direction


def tool_offset(_: Cell, rng: np.random.Generator, place: str | None) -> Effect:
    """The TCP is elsewhere in the tool than the controller believes."""
    nowhere("tool_offset", place)
    way = direction(rng)

    def push(state: State, size: float) -> None:
        state.tool_shift += way * size

    return Effect("tool_offset", {}, push, lambda size: {"offset_mm": (way * size).tolist()})


def tip_wear(cell: Cell, rng: np.random.Generator, place: str | None) -> Effect:
    """Caps burn off, not quite evenly with the count, and the gun closes at a slant to its own axis."""
    nowhere("tip_wear", place)
    tilt, turn = np.radians(rng.uniform(12, 30)), rng.uniform(0, 2 * np.pi)
    way = np.array([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)])
    power = float(rng.choice([rng.uniform(0.82, 0.93), rng.uniform(1.08, 1.2)]))
    worn = (number(cell.columns, "welds_since_cap") / 400.0) ** power

    def push(state: State, size: float) -> None:
        state.tool_shift += worn[:, None] * way * size

    return Effect(
        "tip_wear",
        {"column": "welds_since_cap"},
        push,
        lambda size: {"mm_at_400_welds": size, "direction": way.tolist(), "power": power},
    )


def gun_sag(cell: Cell, rng: np.random.Generator, place: str | None) -> Effect:
    """The gun's bracket is a cantilever that bends under the gun: its end moves, and turns the tip with it."""
    nowhere("gun_sag", place)
    give = rng.uniform(0.5, 1.5, 2)  # [mm] at its end for its whole weight across, about each of its own two axes
    roll, length = rng.uniform(0, np.pi), rng.uniform(180, 320)
    own = np.array([[np.cos(roll), -np.sin(roll), 0], [np.sin(roll), np.cos(roll), 0], [0, 0, 1.0]])
    weight = apply(np.swapaxes(cell.frames.flange, 1, 2), np.array([0.0, 0.0, -1.0])) @ own
    end = np.column_stack([weight[:, 0] * give[0], weight[:, 1] * give[1], np.zeros(cell.n)]) @ own.T
    slope = 1.5 * np.cross([0.0, 0.0, 1.0], end) / length  # of a cantilever with its load at the end
    tip = end + np.cross(slope, cell.gun.at - [0.0, 0.0, length])
    in_tool = tip @ cell.gun.turn

    def push(state: State, size: float) -> None:
        state.tool_shift += in_tool * size

    return Effect("gun_sag", {}, push, lambda size: {"end_mm": (give * size).tolist(), "bracket_mm": length})


def gun_deflection(cell: Cell, rng: np.random.Generator, place: str | None) -> Effect:
    """The C of the gun opens under its squeeze force, a little more than in proportion."""
    nowhere("gun_deflection", place)
    opens = rng.uniform(0.0, 0.25) * rng.choice([-1.0, 1.0])
    way = np.array([opens, 0.0, 1.0]) / np.hypot(1.0, opens)
    stiffening = rng.uniform(0.05, 0.2)
    load = number(cell.columns, "force_n") / 3000.0
    yields = load * (1 + stiffening * load)

    def push(state: State, size: float) -> None:
        state.tool_shift += yields[:, None] * way * size

    return Effect(
        "gun_deflection",
        {"column": "force_n"},
        push,
        lambda size: {"mm_at_3000_n": size * (1 + stiffening), "direction": way.tolist()},
    )
