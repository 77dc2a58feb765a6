"""Where the spots of a line lie, how the gun stands at them, and on which way the robot comes.

Both layouts put the spots on the curved side of a car body in front of the robot, about 1600 x 800 x 1200 mm. *Easy*:
five to eight gun families over the whole side, stations mixed in space. *Hard*: three to six families, each spread by
15 to 25 degrees, stations in clusters with families of their own, and approaches alike within a family.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from respot.simulation.arm import Floats, apply, forward, inverse
from respot.simulation.robots import RobotSpec

Ints = NDArray[np.int64]
#: Half the width and height of the body side, and its depth [mm].
_HALF_WIDTH, _HALF_HEIGHT, _DEPTH = 800.0, 600.0, 800.0
_RAIL_LENGTH = 3600.0
_WRIST_MARGIN, _LIMIT_MARGIN = 12.0, 6.0


@dataclass(frozen=True)
class Gun:
    """A C gun on the flange.

    Parameters
    ----------
    turn : ndarray of shape (3, 3)
        Tool axes in the flange frame; tool Z is the electrodes' axis.
    at : ndarray of shape (3,)
        TCP in the flange frame [mm].
    mass : float
        Mass with its dress pack [kg].
    centre : ndarray of shape (3,)
        Centre of mass in the flange frame [mm].
    """

    turn: Floats
    at: Floats
    mass: float
    centre: Floats


@dataclass(frozen=True)
class Layout:
    """The spots of a line.

    Parameters
    ----------
    joints : ndarray of shape (n, 6)
        Commanded joints [deg].
    approach : ndarray of shape (n, 6)
        Joints [deg] of the point from which the robot comes.
    positions : ndarray of shape (n, 3)
        Programmed TCP in the world frame [mm].
    tool : ndarray of shape (n, 3, 3)
        Orientation of the tool.
    root_at : ndarray of shape (n, 3)
        Foot of the robot [mm]; it travels with the rail.
    rail : ndarray of shape (n,) or None
        Axis E1 [mm].
    station, program, family : ndarray of int of shape (n,)
        Which station, program and gun family a spot belongs to.
    order : ndarray of int of shape (n,)
        Place of each spot on the path: program by program.
    """

    joints: Floats
    approach: Floats
    positions: Floats
    tool: Floats
    root_at: Floats
    rail: Floats | None
    station: Ints
    program: Ints
    family: Ints
    order: Ints


def draw_gun(rng: np.random.Generator) -> Gun:
    """A heavy gun whose weight hangs beside the flange axis."""
    tilt = Rotation.from_euler("YXZ", [-90 + rng.uniform(-25, 25), rng.uniform(-15, 15), rng.uniform(-30, 30)], True)
    at = np.array([rng.uniform(180, 340), rng.uniform(-90, 90), rng.uniform(520, 760)])
    side = rng.uniform(0, 2 * np.pi)
    centre = np.array([rng.uniform(60, 140) * np.cos(side), rng.uniform(60, 140) * np.sin(side), rng.uniform(240, 340)])
    return Gun(np.asarray(tilt.as_matrix()), at, float(rng.uniform(120, 160)), centre)


def uneven(rng: np.random.Generator, n: int, groups: int) -> Ints:
    """Sizes of groups that differ, none below a third of the fair share."""
    share = n / groups
    floor = np.full(groups, int(np.ceil(share / 3)))
    return np.asarray(floor + rng.multinomial(n - floor.sum(), rng.dirichlet(np.full(groups, 4.0))))


def draw_layout(robot: RobotSpec, gun: Gun, spots: int, layout: str, rail: bool, rng: np.random.Generator) -> Layout:
    """Draw a line that the robot can reach.

    Parameters
    ----------
    robot : RobotSpec
        Nominal arm.
    gun : Gun
        What it carries.
    spots : int
        How many.
    layout : str
        ``easy`` or ``hard``.
    rail : bool
        Whether the robot travels on a rail along world Y.
    rng : numpy.random.Generator
        Source of chance.
    """
    hard = layout == "hard"
    stations = int(rng.integers(4, 6))
    station = np.repeat(np.arange(stations), uneven(rng, spots, stations))
    families = int(rng.integers(3, 7)) if hard else int(rng.integers(5, 9))
    if hard:
        # each station uses a few families: what stands close together is welded in like attitudes
        shares = rng.dirichlet(np.full(families, 0.7), stations)
        family = np.array([rng.choice(families, p=shares[at]) for at in station])
    else:
        station = rng.permutation(station)
        family = np.repeat(np.arange(families), uneven(rng, spots, families))
        rng.shuffle(family)
    turns = _families(rng, families, hard)
    centres = np.column_stack([rng.uniform(-0.75, 0.75, stations), rng.uniform(-0.75, 0.75, stations)])
    if hard:
        centres[:, 0] = np.linspace(-0.75, 0.75, stations)[rng.permutation(stations)]
    spreads = np.radians(rng.uniform(15, 25, families)) if hard else np.radians(rng.uniform(14, 24, families))
    flips = rng.random(families) < (0.15 if hard else 0.3)
    limits = np.asarray(robot.limits)

    joints, positions, tool = np.empty((spots, 6)), np.empty((spots, 3)), np.empty((spots, 3, 3))
    rails = rng.uniform(0, _RAIL_LENGTH, spots) if rail else np.zeros(spots)
    todo = np.arange(spots)
    pitch = min(28.0, 0.35 * np.sqrt(4 * _HALF_WIDTH * _HALF_HEIGHT / spots))
    for attempt in range(400):
        now = np.repeat(todo, 4)
        if hard:
            place = centres[station[now]] + 0.17 * rng.standard_normal((len(now), 2))
        else:
            place = rng.uniform(-1, 1, (len(now), 2))
        if attempt > 60:  # a family that cannot reach its place takes another place
            place = rng.uniform(-1, 1, (len(now), 2)) * 0.8
        local = _surface(robot, np.clip(place, -1, 1), rng)
        wobble = rng.standard_normal((len(now), 3)) * spreads[family[now], None] / np.sqrt(3)
        flange = np.asarray((Rotation.from_rotvec(wobble) * Rotation.from_matrix(turns[family[now]])).as_matrix())
        at = local - flange @ gun.at
        found, reached = inverse(robot, flange, at, flips[family[now]])
        away = np.minimum(found - limits[:, 0], limits[:, 1] - found).min(axis=1)
        wrist = np.abs(found[:, 4]) if attempt < 200 else np.full(len(now), 90.0)
        good = reached & (away > _LIMIT_MARGIN) & (wrist > _WRIST_MARGIN) & (np.abs(found[:, 0]) < 80)
        good &= np.abs(found[:, 3:]).max(axis=1) < 172  # no turn of an axis lies near its seam
        local[:, 1] += rails[now]
        done = np.setdiff1d(np.arange(spots), todo)
        for row in np.flatnonzero(good):
            spot = now[row]
            if spot in todo and not np.any(np.linalg.norm(positions[done] - local[row], axis=1) < pitch):
                joints[spot], positions[spot], tool[spot] = found[row], local[row], flange[row] @ gun.turn
                todo, done = todo[todo != spot], np.append(done, spot)
        if not len(todo):
            break
        if attempt % 40 == 39:  # a family out of reach stands differently
            turns[family[todo]] = _families(rng, len(todo), hard)
    else:
        raise ValueError(f"{robot.name} does not reach {spots} spots: try fewer")
    root_at = np.column_stack([np.zeros(spots), rails, np.zeros(spots)])
    program = _programs(station, spots, hard, rng)
    positions = _on_the_arm(robot, gun, joints, root_at)
    order = _path(program, positions, rng)
    approach = _approach(joints, limits, family, hard, rng)
    return Layout(joints, approach, positions, tool, root_at, rails if rail else None, station, program, family, order)


def _on_the_arm(robot: RobotSpec, gun: Gun, joints: Floats, root_at: Floats) -> Floats:
    """Programmed positions exactly where the nominal arm brings the TCP."""
    frames = forward(robot, joints, root_at=root_at)
    return frames.flange_at + apply(frames.flange, gun.at)


def _families(rng: np.random.Generator, families: int, hard: bool) -> Floats:
    """Flange attitudes of gun families: pointing forward, swung, tipped and rolled."""
    swing = 45.0 if hard else 55.0
    yaw, pitch = rng.uniform(-swing, swing, families), rng.uniform(-35, 45, families)
    roll = rng.uniform(-140, 140, families)
    angles = np.column_stack([yaw, 90 + pitch, roll])
    return np.asarray(Rotation.from_euler("ZYZ", angles, degrees=True).as_matrix())


def _surface(robot: RobotSpec, place: Floats, rng: np.random.Generator) -> Floats:
    """Points (n, 3) [mm] of the body side before the robot's foot; `place` (n, 2) runs from -1 to 1."""
    near = robot.length("a1") + 0.47 * (robot.length("c2") + robot.length("c3"))
    bulge = 0.6 * np.abs(place[:, 0]) ** 2.2 + 0.4 * place[:, 1] ** 2
    depth = near + _DEPTH * bulge + rng.normal(0, 70, len(place))
    height = 950.0 + _HALF_HEIGHT * place[:, 1]
    return np.column_stack([depth, _HALF_WIDTH * place[:, 0], height])


def _programs(station: Ints, spots: int, hard: bool, rng: np.random.Generator) -> Ints:
    """Programs: on hard lines each welds some of two stations, on easy ones any spots; none is just a station."""
    if hard:
        return np.asarray((station + (rng.random(spots) < 0.5)) % (int(station.max()) + 1), dtype=np.int64)
    programs = int(rng.integers(3, 5))
    return np.asarray(rng.permutation(np.repeat(np.arange(programs), uneven(rng, spots, programs))))


def _path(program: Ints, positions: Floats, rng: np.random.Generator) -> Ints:
    """Place on the path of each spot: program by program, within one always on to the nearest spot."""
    order = np.empty(len(program), dtype=np.int64)
    step = 0
    for number in np.unique(program):
        left = list(rng.permutation(np.flatnonzero(program == number)))
        here = left.pop(0)
        order[here], step = step, step + 1
        while left:
            nearest = int(np.argmin(np.linalg.norm(positions[left] - positions[here], axis=1)))
            here = left.pop(nearest)
            order[here], step = step, step + 1
    return order


def _approach(joints: Floats, limits: Floats, family: Ints, hard: bool, rng: np.random.Generator) -> Floats:
    """Joints of the points before the spots: every axis has some way to go, in either sense."""
    way = rng.uniform(0.4, 3.5, joints.shape)
    if hard:  # one family is entered in one manner, with exceptions
        manner = rng.choice([-1.0, 1.0], (family.max() + 1, 6))[family]
        sense = np.where(rng.random(joints.shape) < 0.75, manner, -manner)
    else:
        sense = rng.choice([-1.0, 1.0], joints.shape)
    return np.clip(joints - sense * way, limits[:, 0] + 0.5, limits[:, 1] - 0.5)
