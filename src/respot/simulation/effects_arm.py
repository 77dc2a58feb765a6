"""Effects of the arm: zeros, gears, links, weight, play.

Written from mechanics: masses hang on springs, wheels run out of true, gears have play. Each maker draws an effect at
an amplitude of one, of the order of a millimetre; its amplitude is set later so that it leaves what was asked for.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from respot.simulation.arm import Floats, apply
from respot.simulation.state import GRAVITY, Cell, Effect, State

#: Moving parts behind joint 2: joint they hang on (from 0), mass [kg], centre along the part in shares of a length.
# Published inertias of a KR 210, rounded: only their order of size matters.
_PARTS = (
    (1, 190.0, 0.46, "c2"),
    (2, 255.0, 0.16, "c3"),
    (3, 72.0, -0.33, "c3"),
    (4, 46.0, 0.02, "c4"),
    (5, 14.0, 0.7, "c4"),
)


def axis_of(place: str | None, rng: np.random.Generator, sensible: tuple[int, ...]) -> int:
    """Axis (from 1) of a place such as ``3``, or drawn.

    Raises
    ------
    ValueError
        The place is no axis.
    """
    if place is None:
        return int(rng.choice(sensible))
    if place not in {"1", "2", "3", "4", "5", "6"}:
        raise ValueError(f"{place} is no axis: 1 to 6")
    return int(place)


def _add_joint(state: State, axis: int, degrees: Floats | float) -> None:
    state.joints[:, axis - 1] += degrees


def joint_zero(_: Cell, rng: np.random.Generator, place: str | None) -> Effect:
    """Mastering error of an axis."""
    axis = axis_of(place, rng, (2, 3, 4, 5))
    unit = 0.05 * rng.choice([-1.0, 1.0])
    return Effect(
        "joint_zero",
        {"axis": axis},
        lambda state, size: _add_joint(state, axis, unit * size),
        lambda size: {"zero_deg": unit * size},
    )


def joint_profile(cell: Cell, rng: np.random.Generator, place: str | None) -> Effect:
    """An axis turns by another ratio, and a spring balancer on a crank pulls it off its way."""
    axis = axis_of(place, rng, (2, 3, 4))
    angle = np.radians(cell.layout.joints[:, axis - 1])
    middle = 0.5 * (angle.min() + angle.max())
    gain = rng.choice([-1.0, 1.0]) * rng.uniform(0.6, 1.2) * 1e-3
    spring = rng.choice([-1.0, 1.0]) * rng.uniform(0.4, 1.0) * 1e-3
    crank, rest = rng.uniform(0.3, 0.6), rng.uniform(-0.8, 0.8)
    swing = angle - middle - rest
    pull = np.sin(swing) / np.sqrt(1 + crank**2 - 2 * crank * np.cos(swing))
    wrong = np.degrees(gain * (angle - middle) + spring * (pull - pull.mean()))
    return Effect(
        "joint_profile",
        {"axis": axis},
        lambda state, size: _add_joint(state, axis, wrong * size),
        lambda size: {"gain": gain * size, "balancer_mrad": 1e3 * spring * size, "crank": crank},
    )


def gear(cell: Cell, rng: np.random.Generator, place: str | None) -> Effect:
    """A gear wheel out of true: once and twice in its turn, each with a phase of its own; or the motor's encoder.

    The place may be ``AXIS`` or ``AXISxmotor``: once and twice a turn of the motor.

    Raises
    ------
    ValueError
        The place is no axis, or no file of this robot tells how far its motor turns.
    """
    number, _, wheel = (place or "").partition("x")
    axis = axis_of(number or None, rng, (1, 2, 3, 4, 5))
    turns: float = int(rng.integers(6, 13))
    if wheel:
        ratios = cell.robot.ratios
        if wheel != "motor" or not ratios:
            raise ValueError(f"{place}: a wheel is motor, of a robot whose files tell its ratios")
        turns = abs(ratios[axis - 1][0] / ratios[axis - 1][1])
    first, second = rng.uniform(0, 2 * np.pi, 2)
    part = rng.uniform(0.25, 0.45)
    angle = np.radians(cell.layout.joints[:, axis - 1])
    wave = np.sin(turns * angle + first) + part * np.sin(2 * turns * angle + second)
    unit = 0.05
    return Effect(
        "gear",
        {"axis": axis},
        lambda state, size: _add_joint(state, axis, unit * size * wave),
        lambda size: {
            "harmonics": [turns, 2 * turns],
            "amplitudes_deg": [unit * size, unit * size * part],
            "phases_deg": [float(np.degrees(first)), float(np.degrees(second))],
        },
    )


def backlash(cell: Cell, rng: np.random.Generator, place: str | None) -> Effect:
    """Play of an axis: it stops short of the way it came, not equally far in both senses."""
    axis = axis_of(place, rng, (1, 2, 3, 4, 5))
    up, down = 0.05, 0.05 * rng.uniform(0.4, 0.85)
    if rng.random() < 0.5:
        up, down = down, up
    sense = cell.approach_sign[:, axis - 1]
    short = np.where(sense > 0, -up, np.where(sense < 0, down, 0.0))
    return Effect(
        "backlash",
        {"axis": axis},
        lambda state, size: _add_joint(state, axis, short * size),
        lambda size: {"short_coming_up_deg": up * size, "short_coming_down_deg": down * size},
    )


def link_length(_: Cell, rng: np.random.Generator, place: str | None) -> Effect:
    """A length of the arm is not what the controller believes."""
    name = str(rng.choice(["a1", "a2", "c2", "c3"])) if place is None else place
    if name not in {"a1", "a2", "b", "c1", "c2", "c3", "c4"}:
        raise ValueError(f"{name} is no length of the arm: a1 a2 b c1 c2 c3 c4")
    unit = float(rng.choice([-1.0, 1.0]))

    def push(state: State, size: float) -> None:
        state.lengths[name] = state.lengths.get(name, 0.0) + unit * size

    return Effect("link_length", {"parameter": name}, push, lambda size: {"error_mm": unit * size})


def link_geometry(_: Cell, rng: np.random.Generator, place: str | None) -> Effect:
    """Every link is a little off: as the arm was machined and put together."""
    nowhere("link_geometry", place)
    errors = np.column_stack([rng.normal(0, 0.35, (6, 3)), rng.normal(0, 4e-4, (6, 3))])

    def push(state: State, size: float) -> None:
        state.twists += errors * size

    def values(size: float) -> Mapping[str, Any]:
        return {"shifts_mm": (errors[:, :3] * size).tolist(), "turns_mrad": (errors[:, 3:] * size * 1e3).tolist()}

    return Effect("link_geometry", {}, push, values)


def loads(cell: Cell) -> list[tuple[int, float, Floats]]:
    """What hangs on the arm: joint behind which it moves (from 0), mass [kg], centre (n, 3) [mm] in the world."""
    found = []
    for joint, mass, share, length in _PARTS:
        up = np.array([0.0, 0.0, share * cell.robot.length(length)])
        found.append((joint, mass, cell.frames.origins[:, joint] + apply(cell.frames.turns[:, joint], up)))
    gun = cell.frames.flange_at + apply(cell.frames.flange, cell.gun.centre)
    return [*found, (5, cell.gun.mass, gun)]


def torque(cell: Cell, joint: int) -> Floats:
    """Torque (n,) [N m] of all weight about a joint axis (from 0)."""
    return sum(
        (cell.torque_arm(centre, mass * GRAVITY, joint) for at, mass, centre in loads(cell) if at >= joint),
        np.zeros(cell.n),
    )


def gravity_sag(cell: Cell, rng: np.random.Generator, place: str | None) -> Effect:
    """Arm and gun hang on joints that give way."""
    nowhere("gravity_sag", place)
    soft = {2: rng.uniform(1.5, 3.0), 3: rng.uniform(2.0, 4.5), 5: rng.uniform(2.0, 6.0)}  # [1e-7 rad / N m]
    sags = {axis: np.degrees(give * 1e-7 * torque(cell, axis - 1)) for axis, give in soft.items()}

    def push(state: State, size: float) -> None:
        for axis, sag in sags.items():
            _add_joint(state, axis, sag * size)

    def values(size: float) -> Mapping[str, Any]:
        gives = {f"a{axis}_rad_per_mnm": give * 0.1 * size for axis, give in soft.items()}
        return {**gives, "gun_kg": cell.gun.mass, "gun_centre_mm": cell.gun.centre.tolist()}

    return Effect("gravity_sag", {"axes": list(soft)}, push, values)


def readback_lag(cell: Cell, rng: np.random.Generator, place: str | None) -> Effect:
    """The robot was measured before it settled: some of the last way was left, and only the encoders knew."""
    nowhere("readback_lag", place)
    slow = rng.uniform(0.004, 0.02, 6)  # share of the way that is left
    waited = np.exp(rng.normal(0, 0.6, (cell.n, 1)))
    left = -(cell.layout.joints - cell.layout.approach) * slow * waited

    def push(state: State, size: float) -> None:
        state.joints += left * size
        state.measured_joints += left * size

    return Effect("readback_lag", {}, push, lambda size: {"share_left": (slow * size).tolist()})


def nowhere(name: str, place: str | None) -> None:
    """Refuse a place where there is none to choose."""
    if place is not None:
        raise ValueError(f"{name} has no place: {place}")
