"""How far geometry and gravity carry on a measured robot: ``ladder.py PROGRAMMED MEASURED ROBOT``.

An independent reference for the effects `link_geometry` and `gravity_sag`: own code, the robot's chain alone is taken
from the package. PROGRAMMED holds joints (``id,j1..``), MEASURED points (``id,x,y,z``), ROBOT is a file as for
``--robot``. Each rung is fitted to one part of the rows and judged on the rest, in random splits and with contiguous
blocks of rows left out in turn; printed is the mean 3D error of the rows left out [mm].

The rungs: base 6 and tool 3; joint offsets; a small 6-dof error behind every axis (prior 2 mm, 10 mrad); and on top
of that the turn of the joints under gravity (prior 1 mrad), once as sines and cosines of the arm's pitch angles, once
as the arm's load per mass and moment of each link. Where PROGRAMMED has torques ``tau1..`` [Nm], a turn of each joint
in proportion is tried too, without and with link errors. The fit is Gauss-Newton with Huber
weights on the norm of the residual (1 mm); priors weigh against the robust spread of the residual.
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from respot.kinematics.gravity import DOWN, gravity_basis
from respot.kinematics.model import RobotModel
from respot.kinematics.robot_file import robot_of

Array = NDArray[np.float64]
Index = NDArray[np.int64]
#: One column of a turn under load: the axis it turns, and the turn per unit for each row [rad].
Column = tuple[int, Array]

#: Standard deviations: a link's shift [mm] and turn [rad], a gravity coefficient [rad], compliance [rad/Nm].
LINK_MM, LINK_RAD, GRAVITY_RAD, COMPLIANCE = 2.0, 0.01, 0.001, 0.001
#: Joint offsets alone: wide, so that those which base and tool imitate stay where they are [rad].
OFFSET_RAD = 0.1
HUBER_MM, ROUNDS, SPREAD_FLOOR_MM = 1.0, 30, 0.01
#: Median length of a 3-vector of three standard normal numbers.
CHI3_MEDIAN = 1.538


@dataclass(frozen=True)
class Data:
    """Rows of a robot: joints (n, axes) in degrees or mm, points (n, 3) in mm, torques (n, axes) in Nm or None."""

    joints: Array
    points: Array
    torques: Array | None = None

    def part(self, rows: Index) -> Data:
        """Return some of the rows."""
        return Data(self.joints[rows], self.points[rows], None if self.torques is None else self.torques[rows])


@dataclass(frozen=True)
class Rung:
    """One model: standard deviations of a link's six errors (0: fixed), columns of the load and their deviation."""

    name: str
    link: tuple[float, ...]
    columns: Callable[[RobotModel, Data], list[Column]] | None = None
    load: float = GRAVITY_RAD


def pitch_columns(robot: RobotModel, data: Data) -> list[Column]:
    """Sine and cosine of the pitch of each of the arm's links (sums of the parallel axes), on each of these axes."""
    parallel = pitch_axes(robot)
    turned = np.radians(data.joints @ robot.coupling.T)
    pitches = np.cumsum(turned[:, parallel] * np.array(pitch_signs(robot, parallel)), axis=1)
    return [(axis, wave(pitches[:, k])) for axis in parallel for k in range(len(parallel)) for wave in (np.cos, np.sin)]


def pitch_axes(robot: RobotModel) -> list[int]:
    """Axes from the second on that are parallel to it in every posture: 2 and 3, of a UR also 4."""
    found = [1]
    axes = axis_directions(robot)
    for axis in range(2, robot.axes):
        if np.abs(np.abs(np.sum(axes[:, 1] * axes[:, axis], axis=1)) - 1).max() > 1e-6:
            break
        found.append(axis)
    return found


def pitch_signs(robot: RobotModel, parallel: list[int]) -> list[float]:
    """Whether each of the axes turns as the second does or against it."""
    axes = axis_directions(robot)
    return [float(np.sign(np.sum(axes[0, 1] * axes[0, axis]))) for axis in parallel]


def axis_directions(robot: RobotModel) -> Array:
    """Directions of the axes in a few postures, shape (postures, axes, 3)."""
    chain = robot.run(np.random.default_rng(0).uniform(-90, 90, (5, robot.axes)))
    places = [i for i, step in enumerate(robot.steps) if step.joint >= 0]
    return np.stack([chain.axes[i].T for i in places], axis=1)


def mass_columns(robot: RobotModel, data: Data) -> list[Column]:
    """Load of each link's mass [1 unit at 1 m] and moments on each axis; the robot stands upright."""
    anywhere = np.random.default_rng(0).uniform(-90, 90, (20, robot.axes))
    present = np.abs(gravity_basis(robot, anywhere, DOWN)).max(axis=0) > 1e-6
    basis = gravity_basis(robot, data.joints, DOWN)
    basis[..., 0] /= 1000.0
    return [(int(axis), basis[:, axis, link, term]) for axis, link, term in np.argwhere(present)]


def torque_columns(robot: RobotModel, data: Data) -> list[Column]:
    """Measured torque of each axis, none where there are no torques."""
    return [] if data.torques is None else [(axis, data.torques[:, axis]) for axis in range(robot.axes)]


def rungs(data: Data) -> list[Rung]:
    """Models to be tried."""
    none, offset = (0.0,) * 6, (0.0,) * 5 + (OFFSET_RAD,)
    full = (LINK_MM,) * 3 + (LINK_RAD,) * 3
    found = [Rung("base + tool", none), Rung("+ joint offsets", offset), Rung("+ link errors", full)]
    if data.torques is not None:
        found.append(Rung("base + tool + torques", none, torque_columns, COMPLIANCE))
        found.append(Rung("links + torques", full, torque_columns, COMPLIANCE))
    found.append(Rung("links + gravity, pitch", full, pitch_columns))
    found.append(Rung("links + gravity, masses", full, mass_columns))
    return found


class Model:
    """One rung fitted to some rows."""

    def __init__(self, robot: RobotModel, rung: Rung, data: Data) -> None:
        self.robot, self.rung = robot, rung
        load = [] if rung.columns is None else [rung.load] * len(rung.columns(robot, data))
        deviation = np.concatenate([np.full(9, np.inf), np.tile(rung.link, robot.axes), load])
        self.free = np.flatnonzero(deviation > 0)
        self.values = np.zeros(len(deviation))
        flange = np.asarray(robot.forward(data.joints).translation)
        self.base = best_rigid(flange, data.points)
        weights = np.ones(len(data.points))
        spread = 1.0
        for turn in range(ROUNDS):
            predicted, jacobian = self.run(data)
            residual = data.points - predicted
            length = np.linalg.norm(residual, axis=1)
            if turn > 2:
                weights = np.minimum(1.0, HUBER_MM / np.maximum(length, 1e-9))
                spread = max(float(np.median(length)) / CHI3_MEDIAN, SPREAD_FLOOR_MM)
            moved = self._step(jacobian, residual, weights, spread, deviation)
            if turn > 5 and moved < 1e-6:
                break

    def _step(self, jacobian: Array, residual: Array, weights: Array, spread: float, deviation: Array) -> float:
        """One Gauss-Newton step; the largest change."""
        part = jacobian[:, :, self.free]
        normal = np.einsum("nij,n,nik->jk", part, weights, part) / spread**2
        right = np.einsum("nij,n,ni->j", part, weights, residual) / spread**2
        prior = 1.0 / deviation[self.free] ** 2
        # the tool may be hidden, if the orientations do not vary
        normal += np.diag(prior + 1e-10)
        right -= prior * self.values[self.free]
        scale = 1.0 / np.sqrt(np.diag(normal))
        step = scale * np.linalg.solve(normal * np.outer(scale, scale), right * scale)
        self.values[self.free] += step
        self.base = self.base @ small(self.values[:6])
        self.values[:6] = 0.0
        return float(np.abs(step).max())

    def run(self, data: Data) -> tuple[Array, Array]:
        """Points (n, 3), and their derivatives by every value (n, 3, values)."""
        robot, count = self.robot, len(data.joints)
        links = self.values[9 : 9 + 6 * robot.axes].reshape(-1, 6)
        columns = [] if self.rung.columns is None else self.rung.columns(robot, data)
        turned = data.joints @ robot.coupling.T
        for (axis, turn), value in zip(columns, self.values[9 + 6 * robot.axes :], strict=True):
            turned[:, axis] += np.degrees(turn * value)
        frame = np.broadcast_to(self.base, (count, 4, 4))
        behind: list[Array] = []
        for step in robot.steps:
            value = step.value + (turned[:, step.joint] if step.joint >= 0 else np.zeros(count))
            frame = frame @ elementary(step.axis, step.turns, value)
            if step.joint >= 0:
                behind.append(frame)
                frame = frame @ small(links[step.joint])
        points = frame[:, :3, :3] @ self.values[6:9] + frame[:, :3, 3]
        jacobian = np.zeros((count, 3, len(self.values)))
        jacobian[:, :, :6] = motion(np.broadcast_to(self.base, (count, 4, 4)), points)
        jacobian[:, :, 6:9] = frame[:, :3, :3]
        for joint, place in enumerate(behind):
            jacobian[:, :, 9 + 6 * joint : 15 + 6 * joint] = motion(place, points)
        for k, (axis, turn) in enumerate(columns):
            jacobian[:, :, 9 + 6 * robot.axes + k] = jacobian[:, :, 9 + 6 * axis + 5] * turn[:, None]
        return points, jacobian

    def errors(self, data: Data) -> Array:
        """Distances of the points from where the model puts them [mm]."""
        return np.asarray(np.linalg.norm(data.points - self.run(data)[0], axis=1))


def motion(frame: Array, points: Array) -> Array:
    """Motion of points per shift along and turn about the axes of frames (n, 4, 4), shape (n, 3, 6)."""
    arm = points - frame[:, :3, 3]
    turns = [np.cross(frame[:, :3, k], arm) for k in range(3)]
    return np.concatenate([frame[:, :3, :3], np.stack(turns, axis=2)], axis=2)


def small(values: Array) -> Array:
    """Frame of a shift and a rotation vector."""
    found = np.eye(4)
    found[:3, :3] = Rotation.from_rotvec(values[3:]).as_matrix()
    found[:3, 3] = values[:3]
    return found


def elementary(axis: int, turns: bool, values: Array) -> Array:
    """Frames of turns [deg] about, or shifts along, a coordinate axis, shape (n, 4, 4)."""
    found = np.tile(np.eye(4), (len(values), 1, 1))
    if turns:
        found[:, :3, :3] = Rotation.from_rotvec(np.radians(values)[:, None] * np.eye(3)[axis]).as_matrix()
    else:
        found[:, axis, 3] = values
    return found


def best_rigid(source: Array, target: Array) -> Array:
    """Rigid motion of points onto points by least squares."""
    found = np.eye(4)
    left, _, right = np.linalg.svd((target - target.mean(0)).T @ (source - source.mean(0)))
    found[:3, :3] = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
    found[:3, 3] = target.mean(0) - found[:3, :3] @ source.mean(0)
    return found


def read(programmed: Path, measured: Path, kind: str = "j") -> Data:
    """Read two tables, joined by id; ``kind`` is ``j`` for commanded joints, ``jm`` for measured ones."""
    with programmed.open(newline="") as stream:
        rows = {row["id"]: row for row in csv.DictReader(stream)}
    with measured.open(newline="") as stream:
        points = {row["id"]: [float(row[c]) for c in "xyz"] for row in csv.DictReader(stream) if row["id"] in rows}
    first = next(iter(rows.values()))
    joints = [name for name in (f"{kind}{k}" for k in range(1, 10)) if name in first]
    torques = [name for name in (f"tau{k}" for k in range(1, 10)) if name in first]
    kept = [rows[name] for name in points]
    return Data(
        np.array([[float(row[c]) for c in joints] for row in kept]),
        np.array(list(points.values())),
        np.array([[float(row[c]) for c in torques] for row in kept]) if torques else None,
    )


def random_splits(count: int, share: float, seeds: int) -> Iterator[tuple[Index, Index]]:
    """Rows to fit and rows to judge by, at random."""
    for seed in range(seeds):
        order = np.random.default_rng(seed).permutation(count)
        tested = count - int((1.0 - share) * count + 1e-9)
        yield order[: count - tested], order[count - tested :]


def block_splits(count: int, blocks: int) -> Iterator[tuple[Index, Index]]:
    """Rows to fit and rows to judge by: contiguous blocks in turn."""
    for block in np.array_split(np.arange(count), blocks):
        yield np.setdiff1d(np.arange(count), block), block


def score(robot: RobotModel, rung: Rung, data: Data, splits: Iterator[tuple[Index, Index]]) -> tuple[float, Array]:
    """Mean error of all rows left out, and the mean of each split."""
    errors = [Model(robot, rung, data.part(fit)).errors(data.part(judge)) for fit, judge in splits]
    return float(np.concatenate(errors).mean()), np.array([found.mean() for found in errors])


def main() -> None:
    """Print the ladder."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("programmed", type=Path)
    parser.add_argument("measured", type=Path)
    parser.add_argument("robot")
    parser.add_argument("--measured-joints", action="store_true", help="use jm1.. instead of j1..")
    parser.add_argument("--test", type=float, default=0.5, help="share left out in the random splits")
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--blocks", type=int, default=5)
    options = parser.parse_args()
    robot = robot_of(options.robot)
    data = read(options.programmed, options.measured, "jm" if options.measured_joints else "j")
    count = len(data.points)
    print(f"{options.measured.name}: {count} rows, {robot.name}; mean error of the rows left out [mm]")
    print(f"{'':24} {'random':>7} {'(splits)':>17} {'blocks':>7}   blocks one by one")
    for rung in rungs(data):
        mean, each = score(robot, rung, data, random_splits(count, options.test, options.seeds))
        block_mean, blocks = score(robot, rung, data, block_splits(count, options.blocks))
        spread = f"({each.min():.3f}-{each.max():.3f})"
        print(f"{rung.name:24} {mean:7.3f} {spread:>17} {block_mean:7.3f}   " + " ".join(f"{b:.3f}" for b in blocks))


if __name__ == "__main__":
    main()
