"""A simulated line: what the plant has in its hands, and the truth behind it."""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from respot.simulation.arm import Floats, forward
from respot.simulation.columns import Column, draw_columns
from respot.simulation.effects import Wish, make_effect, read_wish
from respot.simulation.layout import Layout, draw_gun, draw_layout
from respot.simulation.robots import LENGTHS, RobotSpec, spec_of
from respot.simulation.state import Cell, Effect, State

LAYOUTS = ("easy", "hard")
#: Below this share of its raw size an effect counts as swallowed by the rigid fit.
_SWALLOWED = 0.05
#: Scatter of encoders [deg] and of measured orientations [deg].
_ENCODER, _ANGLE = 2e-4, 0.02
_UNEVEN = np.array([0.6, 1.3, 1.0])


@dataclass(frozen=True)
class Line:
    """A line of weld spots with hidden effects.

    Parameters
    ----------
    ids : tuple of str
        Names of the spots.
    positions : ndarray of shape (n, 3)
        Programmed TCP in the world frame [mm]; the robot's foot is the world's origin, unless a rail carries it.
    rotations : scipy Rotation of length n
        Programmed tool orientations.
    joints, measured_joints, approach_joints : ndarray of shape (n, 6)
        Commanded joints, what the encoders said, and the point from which the robot came [deg].
    external_axes : ndarray of shape (n, 6) or None
        E1 to E6 [mm], NaN where there is none; None without a rail (E1 carries the robot along world Y).
    order : ndarray of int of shape (n,)
        Place of each spot on the path.
    columns : mapping of str to ndarray of shape (n,)
        What the plant recorded: numbers, or objects that are strings.
    measured : ndarray of shape (n, 3)
        What the tracker says in its own frame [mm], with noise; row i is spot i, listed under ``measured_ids[i]``.
    measured_true : ndarray of shape (n, 3)
        The same without noise.
    measured_ids : tuple of str
        Names in the measured list.
    measured_rotations : scipy Rotation of length n or None
        Tool orientations of the measured list as a reader of A, B, C takes them.
    flange2tool : ndarray of shape (4, 4)
        The tool as programmed.
    robot : mapping
        name, a1 .. c4, offsets_deg, signs, limits_deg.
    truth : tuple of mappings
        name, where, parameters, left_rms, raw_rms [mm] of each effect.
    noise : float
        Standard deviation per coordinate [mm].
    seed : int
        Source of chance.
    layout : str
        easy or hard.
    gun_kg, gun_centre : float, ndarray of shape (3,)
        Mass of the gun and its centre in the flange frame [mm], as a controller knows them.
    world2tracker : ndarray of shape (4, 4)
        Registration, for the truth.
    """

    ids: tuple[str, ...]
    positions: Floats
    rotations: Rotation
    joints: Floats
    measured_joints: Floats
    approach_joints: Floats
    external_axes: Floats | None
    order: NDArray[np.int64]
    columns: Mapping[str, Column]
    measured: Floats
    measured_true: Floats
    measured_ids: tuple[str, ...]
    measured_rotations: Rotation | None
    flange2tool: Floats
    robot: Mapping[str, Any]
    truth: tuple[Mapping[str, Any], ...]
    noise: float
    seed: int
    layout: str
    gun_kg: float
    gun_centre: Floats
    world2tracker: Floats

    @property
    def n(self) -> int:
        """Number of spots."""
        return len(self.ids)


def simulate(
    robot: str = "kr210_r2700_extra",
    spots: int = 120,
    noise: float = 0.1,
    effects: Sequence[str] = (),
    seed: int = 0,
    layout: str = "easy",
    columns: bool = True,
    rail: bool = False,
    orientations: bool = False,
) -> Line:
    """Simulate a line with hidden effects.

    Parameters
    ----------
    robot : str
        One of `ROBOTS`.
    spots : int
        How many.
    noise : float
        Standard deviation per coordinate [mm]; on hard lines the RMS over the axes.
    effects : sequence of str
        ``NAME[@PLACE][:SIZE]``. SIZE [mm] is the RMS of 3D distances that the effect alone leaves after the best rigid
        fit of all spots, or before it where the fit swallows more than 95 % of it; 1 mm if not given. ``swapped_ids``
        takes the pair that comes nearest, ``convention`` has no size.
    seed : int
        Spots, columns, noise and each effect draw from it independently: another effect leaves the rest as it is.
    layout : str
        ``easy`` or ``hard``.
    columns : bool
        Whether the measured list has further columns; without, effects still follow them.
    rail : bool
        Whether the robot travels; the effect ``rail`` asks for it by itself.
    orientations : bool
        Whether orientations were measured; the effect ``convention`` asks for it by itself.

    Raises
    ------
    ValueError
        Something that was asked for does not exist; the message suggests what does.
    """
    spec, wishes = spec_of(robot), [read_wish(text) for text in effects]
    if layout not in LAYOUTS:
        raise ValueError(f"{layout} is no layout: easy or hard")
    if spots < 8:
        raise ValueError("a line has at least 8 spots")
    if not noise >= 0:
        raise ValueError(f"noise must not be negative: {noise}")
    names = {wish.name for wish in wishes}
    cell = draw_cell(spec, spots, layout, rail or "rail" in names, seed)
    state = State(cell.n)
    truth = [_impose(wish, cell, state, number, seed) for number, wish in enumerate(wishes)]
    chance = chance_of(seed, "measuring")
    world2tracker = _registration(chance)
    turn, shift = Rotation.from_matrix(world2tracker[:3, :3]), world2tracker[:3, 3]
    real = turn.apply(state.positions(cell)) + shift
    ids = _ids(cell.n, chance)
    encoders = cell.layout.joints + state.measured_joints + chance.normal(0, _ENCODER, (cell.n, 6))
    uneven = _UNEVEN[chance.permutation(3)] / np.sqrt(np.mean(_UNEVEN**2)) if layout == "hard" else np.ones(3)
    heard = chance.standard_normal((cell.n, 3)) * noise * uneven
    for record in truth:
        if "rows" in record["where"]:
            record["where"] = {"ids": [ids[row] for row in record["where"]["rows"]]}
    return Line(
        ids=ids,
        positions=cell.positions,
        rotations=Rotation.from_matrix(cell.layout.tool),
        joints=cell.layout.joints,
        measured_joints=encoders,
        approach_joints=cell.layout.approach,
        external_axes=_external(cell.layout),
        order=cell.layout.order,
        columns=cell.columns if columns else {},
        measured=real + heard,
        measured_true=real,
        measured_ids=tuple(ids[row] for row in state.ids),
        measured_rotations=_orientations(cell, state, turn, chance) if orientations or state.misread else None,
        flange2tool=_matrix(cell.gun.turn, cell.gun.at),
        robot=_record(spec),
        truth=tuple(truth),
        noise=noise,
        seed=seed,
        layout=layout,
        gun_kg=cell.gun.mass,
        gun_centre=cell.gun.centre,
        world2tracker=world2tracker,
    )


def draw_cell(spec: RobotSpec, spots: int, layout: str, rail: bool, seed: int) -> Cell:
    """Draw robot, gun, spots and columns: all that no effect touches."""
    chance = chance_of(seed, "layout")
    gun = draw_gun(chance)
    drawn = draw_layout(spec, gun, spots, layout, rail, chance)
    frames = forward(spec, drawn.joints, root_at=drawn.root_at)
    around = np.array([chance.uniform(1500, 3500), chance.choice([-1, 1]) * chance.uniform(3000, 4500), 1600.0])
    return Cell(spec, gun, drawn, draw_columns(drawn, layout, chance_of(seed, "columns")), frames, around)


def rigid_rest(here: Floats, there: Floats) -> Floats:
    """What the best rigid motion of `here` (n, 3) leaves of `there` (n, 3): residuals (n, 3) [mm]."""
    one, two = here - here.mean(axis=0), there - there.mean(axis=0)
    left, _, right = np.linalg.svd(one.T @ two)
    mirror = np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    return np.asarray(two - one @ left @ mirror @ right)


def rms(residuals: Floats) -> float:
    """RMS of 3D distances."""
    return float(np.sqrt(np.mean(np.sum(residuals**2, axis=1))))


def _impose(wish: Wish, cell: Cell, state: State, number: int, seed: int) -> dict[str, Any]:
    """Draw an effect, give it its size, add it to the line, and return its truth."""
    effect = make_effect(wish, cell, chance_of(seed, wish.name, number))
    size = amplitude(effect, cell, wish.size)
    left, raw = _leaves(effect, cell, size)
    effect.push(state, size)
    return {
        "name": effect.name,
        "where": _plain(effect.where),
        "parameters": _plain(effect.parameters(size)),
        "left_rms": left,
        "raw_rms": raw,
    }


def _plain(values: Mapping[str, Any]) -> dict[str, Any]:
    """Values that JSON can hold."""
    return {name: value.item() if isinstance(value, np.generic) else value for name, value in values.items()}


def _leaves(effect: Effect, cell: Cell, size: float) -> tuple[float, float]:
    """RMS [mm] that an effect alone leaves after the rigid fit, and before it."""
    alone = State(cell.n)
    effect.push(alone, size)
    programmed, real = cell.positions[alone.ids], alone.positions(cell)
    return rms(rigid_rest(programmed, real)), rms(real - programmed)


def amplitude(effect: Effect, cell: Cell, wish: float | None) -> float:
    """Amplitude at which an effect leaves what is wished [mm], 1 mm by default; shifts are all but proportional to it.

    Raises
    ------
    ValueError
        The effect moves no spot.
    """
    if effect.fixed:
        return 1.0
    size, wanted = 1.0, 1.0 if wish is None else wish
    for _ in range(12):
        left, raw = _leaves(effect, cell, size)
        now = left if left > _SWALLOWED * raw else raw
        if now < 1e-9:
            raise ValueError(f"{effect.name} moves no spot of this line")
        if abs(now / wanted - 1) < 1e-3:
            break
        size *= wanted / now
    return size


def chance_of(seed: int, what: str, number: int = 0) -> np.random.Generator:
    """Return a source of chance of its own for each thing that is drawn."""
    return np.random.default_rng([seed, zlib.crc32(what.encode()), number])


def _registration(chance: np.random.Generator) -> Floats:
    """The tracker's own frame: anywhere in the hall, turned any way round, not quite level."""
    turn = Rotation.from_euler("ZYX", [chance.uniform(-180, 180), *chance.normal(0, 2, 2)], degrees=True)
    return _matrix(np.asarray(turn.as_matrix()), chance.uniform(-4000, 4000, 3) * [1, 1, 0.2])


def _matrix(turn: Floats, at: Floats) -> Floats:
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = turn, at
    return out


def _ids(n: int, chance: np.random.Generator) -> tuple[str, ...]:
    """Names of the trade: a part, then a number of the welding plan, with gaps."""
    numbers = 1600000 + int(chance.integers(1000, 90000)) + np.cumsum(chance.integers(1, 4, n))
    return tuple(f"P02WP{value}" for value in chance.permutation(numbers))


def _external(layout: Layout) -> Floats | None:
    if layout.rail is None:
        return None
    axes = np.full((len(layout.rail), 6), np.nan)
    axes[:, 0] = layout.rail
    return axes


def _orientations(cell: Cell, state: State, turn: Rotation, chance: np.random.Generator) -> Rotation:
    jitter = Rotation.from_rotvec(np.radians(chance.normal(0, _ANGLE, (cell.n, 3))))
    real = turn * state.orientations(cell) * jitter
    return state.misread(real) if state.misread else real


def _record(spec: RobotSpec) -> dict[str, Any]:
    return {
        "name": spec.name,
        "maker": spec.maker,
        "trafo": spec.trafo,
        "ratios": [list(ratio) for ratio in spec.ratios],
        **dict(zip(LENGTHS, (float(length) for length in spec.lengths), strict=True)),
        "offsets_deg": [float(offset) for offset in spec.offsets],
        "signs": list(spec.signs),
        "limits_deg": [list(limit) for limit in spec.limits],
    }
