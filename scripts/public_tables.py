"""Public calibration records of robots as tables of respot's own: ``public_tables.py FOLDER -o OUT``.

FOLDER holds the repositories psh117/kinematics_calibration (Panda), fergujm2/ContinuousRobotCalibration (Aubo i5) and
Zhangzhongqiu/robot-calibration (KUKA iiwa), each as a work tree or a bare git directory, at any depth. Their licences
do not allow that the data are passed on, so nothing of them stands here. A repository that is not there is left out.

For each record OUT gets ``NAME_programmed.csv`` (``id,j1..`` in degrees and what else was recorded),
``NAME_measured.csv`` (``id,x,y,z`` in mm, ``q1..q4`` where it was measured) and ``NAME.toml``, the nominal robot for
``--robot``:

- ``panda_left``, ``panda_right``, ``panda_top``: commanded joints, points;
- ``aubo_i5``: stops of a run, the mean of the joints read back and of the tracker's pose while the arm stands still;
  the two clocks differ by a constant that the motion itself shows. ``time_min`` is the middle of the stop;
- ``iiwa_0kg``, ``iiwa_1.25kg``, ``iiwa_2.5kg`` and ``iiwa_all``: joints and torques read back (``tau1..7``, Nm),
  poses, ``payload_kg``; the order of the rows is that of the run. Only axes 1 and 2 move. The tool was mounted anew
  for each load: its length differs by millimetres, the base stays.
"""

from __future__ import annotations

import argparse
import csv
import io
import subprocess
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.io import loadmat
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]

#: a, alpha, d, offset of each link [mm, deg].
PANDA = [
    (0.0, 0.0, 333.0, 0.0),
    (0.0, -90.0, 0.0, 0.0),
    (0.0, 90.0, 316.0, 0.0),
    (82.5, 90.0, 0.0, 0.0),
    (-82.5, -90.0, 384.0, 0.0),
    (0.0, 90.0, 0.0, 0.0),
    (88.0, 90.0, 107.0, 0.0),
]
AUBO = [
    (0.0, 90.0, 98.5, 0.0),
    (408.0, 180.0, 140.5, 90.0),
    (376.0, 180.0, 121.5, 0.0),
    (0.0, 90.0, 102.5, 90.0),
    (0.0, -90.0, 102.5, 0.0),
    (0.0, 0.0, 94.0, 180.0),
]
IIWA = [
    (0.0, -90.0, 340.0, 0.0),
    (0.0, 90.0, 0.0, 0.0),
    (0.0, -90.0, 400.0, 180.0),
    (0.0, 90.0, 0.0, 0.0),
    (0.0, -90.0, 400.0, 180.0),
    (0.0, 90.0, 0.0, 0.0),
    (0.0, 0.0, 126.0, 0.0),
]

#: A stop of the Aubo: the joints move less than this [deg/s] for that long [s]; what is cut off at both ends [s].
STILL_DEG_S, STOP_S, MARGIN_S = 0.5, 1.4, 0.3
#: Least samples of the tracker in a stop, and the largest spread among them [mm].
SAMPLES, SPREAD_MM = 30, 0.3


@dataclass
class Record:
    """Rows of one record; what else was recorded is in ``further``, a column each."""

    name: str
    robot: str
    convention: str
    links: Sequence[tuple[float, ...]]
    ids: list[str]
    joints: Array
    points: Array
    quaternions: Array | None = None
    further: dict[str, Array] = field(default_factory=dict)

    def write(self, folder: Path) -> None:
        """Write the two tables and the robot."""
        joints = [f"j{k + 1}" for k in range(self.joints.shape[1])]
        columns = [self.joints, *(values[:, None] for values in self.further.values())]
        table(folder / f"{self.name}_programmed.csv", ["id", *joints, *self.further], self.ids, np.hstack(columns))
        if self.quaternions is None:
            table(folder / f"{self.name}_measured.csv", ["id", "x", "y", "z"], self.ids, self.points)
        else:
            names = ["id", "x", "y", "z", "q1", "q2", "q3", "q4"]
            table(folder / f"{self.name}_measured.csv", names, self.ids, np.hstack([self.points, self.quaternions]))
        lines = [f'name = "{self.robot}"', f'convention = "{self.convention}"']
        for a, alpha, d, offset in self.links:
            lines += ["[[link]]", f"a = {a}", f"alpha = {alpha}", f"d = {d}", f"offset = {offset}"]
        (folder / f"{self.name}.toml").write_text("\n".join(lines) + "\n")


def table(path: Path, header: Sequence[str], ids: Sequence[str], values: Array) -> None:
    """Write a table of names and numbers."""
    with path.open("w", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(header)
        writer.writerows([name, *(f"{value:.9g}" for value in row)] for name, row in zip(ids, values, strict=True))


class Repository:
    """Files of a repository, from a work tree or a bare git directory below a folder."""

    def __init__(self, folder: Path, name: str) -> None:
        self.name = name
        self.tree: Path | None = None
        self.git: Path | None = None
        for place in sorted(folder.rglob("*")):
            if not place.is_dir() or not place.name.endswith(name):
                continue
            heads = [found for found in (place, *place.glob("*"), *place.glob("*/.git")) if (found / "HEAD").is_file()]
            if heads:
                self.git = heads[0]
            else:
                self.tree = place
            break

    @property
    def there(self) -> bool:
        """Whether it was found."""
        return self.tree is not None or self.git is not None

    def read(self, path: str) -> bytes:
        """Content of a file."""
        if self.tree is not None:
            return (self.tree / path).read_bytes()
        command = ["git", "--git-dir", str(self.git), "show", f"HEAD:{path}"]
        return subprocess.run(command, check=True, capture_output=True).stdout

    def rows(self, path: str) -> list[list[str]]:
        """Cells of a comma-separated file."""
        return [row for row in csv.reader(io.StringIO(self.read(path).decode("utf-8-sig"))) if row]


def panda(repository: Repository) -> Iterable[Record]:
    """Three records of a Panda arm: joints and points are in files of their own, joined by the number of the motion."""
    motions = repository.rows("data/SNU/calib_pos.csv")
    for name in ("left", "right", "top"):
        measured = repository.rows(f"data/KETI/panda_{name}_no_q.csv")
        joints = np.array([[float(cell) for cell in motions[int(row[0]) - 1][1:8]] for row in measured])
        points = np.array([[float(cell) for cell in row[1:4]] for row in measured])
        ids = [f"P{int(row[0]):03}" for row in measured]
        yield Record(f"panda_{name}", "Franka Panda", "mdh", PANDA, ids, joints, points)


def iiwa(repository: Repository) -> Iterable[Record]:
    """Three runs of an iiwa with different loads, and all of them as one record."""
    every: list[Record] = []
    for run, load in enumerate((0.0, 1.25, 2.5), start=1):
        rows = repository.rows(f"{load:g}kg/20161216_run{run}_{load:g}kg.csv")[1:]
        values = np.array([[float(cell) for cell in row] for row in rows])
        frames = values[:, 15:31].reshape(-1, 4, 4)
        quaternions = Rotation.from_matrix(frames[:, :3, :3]).as_quat(scalar_first=True)
        further = {f"tau{k + 1}": values[:, 8 + k] for k in range(7)}
        further["payload_kg"] = np.full(len(values), load)
        ids = [f"I{run}{int(number):04}" for number in values[:, 0]]
        joints, points = np.degrees(values[:, 1:8]), frames[:, :3, 3]
        every.append(Record(f"iiwa_{load:g}kg", "KUKA iiwa", "dh", IIWA, ids, joints, points, quaternions, further))
    yield from every
    yield Record(
        "iiwa_all",
        "KUKA iiwa",
        "dh",
        IIWA,
        [name for record in every for name in record.ids],
        np.vstack([record.joints for record in every]),
        np.vstack([record.points for record in every]),
        np.vstack([record.quaternions for record in every if record.quaternions is not None]),
        {key: np.concatenate([record.further[key] for record in every]) for key in every[0].further},
    )


def aubo(repository: Repository) -> Iterable[Record]:
    """Stops of an Aubo i5."""
    place = "Experiments/20200915_FullTest/DataProcessed/DiscreteEvaluation"
    arm = matlab(repository.read(f"{place}.mat"))
    tracker = matlab(repository.read(f"{place}Tracker.mat"))
    time, joints = arm["tRobot"], np.degrees(arm["q"])
    seen, points, turns = tracker["t"], 1000.0 * tracker["p"], tracker["q"]
    good = np.isfinite(points).all(axis=1) & (np.linalg.norm(np.nan_to_num(turns), axis=1) > 0.5)
    seen, points, turns = seen[good], points[good], turns[good]
    late = clock_difference(time, joints, seen, points)
    print(f"  aubo_i5: the tracker's clock is {late:.2f} s ahead of the arm's")
    kept: list[tuple[float, Array, Array, Array]] = []
    for begin, end in stops(time, joints):
        of_arm = (time > begin + MARGIN_S) & (time < end - MARGIN_S)
        of_tracker = (seen > begin + late + MARGIN_S) & (seen < end + late - MARGIN_S)
        if of_arm.sum() < SAMPLES or of_tracker.sum() < SAMPLES:
            continue
        place_mm = np.median(points[of_tracker], axis=0)
        if np.median(np.linalg.norm(points[of_tracker] - place_mm, axis=1)) > SPREAD_MM:
            continue
        mean = Rotation.from_quat(turns[of_tracker], scalar_first=True).mean().as_quat(scalar_first=True)
        kept.append(((begin + end) / 120.0, joints[of_arm].mean(axis=0), place_mm, np.asarray(mean)))
    minutes, mean_joints, places, means = (np.array([row[k] for row in kept]) for k in range(4))
    ids = [f"A{number:03}" for number in range(1, len(kept) + 1)]
    further = {"time_min": minutes}
    yield Record("aubo_i5", "Aubo i5", "dh", AUBO, ids, mean_joints, places, means, further)


def matlab(content: bytes) -> dict[str, Array]:
    """Arrays of a MATLAB file."""
    with tempfile.NamedTemporaryFile(suffix=".mat") as stream:
        stream.write(content)
        stream.flush()
        found = loadmat(stream.name, squeeze_me=True)
    return {key: np.asarray(value, dtype=float) for key, value in found.items() if not key.startswith("__")}


def stops(time: Array, joints: Array) -> list[tuple[float, float]]:
    """Begin and end of each stop [s]."""
    grid = np.arange(time[0], time[-1], 0.05)
    smooth = sampled(grid, time, joints)
    still = np.abs(np.gradient(smooth, grid, axis=0)).max(axis=1) < STILL_DEG_S
    edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(int)))
    spans = [(grid[a], grid[b - 1]) for a, b in edges.reshape(-1, 2)]
    return [(float(a), float(b)) for a, b in spans if b - a > STOP_S]


def clock_difference(time: Array, joints: Array, seen: Array, points: Array) -> float:
    """Time of the tracker less that of the arm at the same moment: where the speeds of both agree best [s]."""
    step, widest = 0.02, 15.0
    grid = np.arange(max(time[0], seen[0]) + 2 * widest, min(time[-1], seen[-1]) - 2 * widest, step)
    wide = np.arange(grid[0] - widest, grid[-1] + widest, step)
    turning = np.linalg.norm(np.gradient(sampled(grid, time, joints), step, axis=0), axis=1)
    speed = np.minimum(np.linalg.norm(np.gradient(sampled(wide, seen, points), step, axis=0), axis=1), 1000.0)
    shifts = len(wide) - len(grid) + 1
    agree = [np.corrcoef(turning, speed[first : first + len(grid)])[0, 1] for first in range(shifts)]
    return float(wide[int(np.argmax(agree))] - grid[0])


def sampled(grid: Array, time: Array, values: Array) -> Array:
    """Values at other times, between samples along a line."""
    return np.stack([np.interp(grid, time, column) for column in values.T], axis=1)


def main() -> None:
    """Write the tables of all repositories that are there."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("folder", type=Path)
    parser.add_argument("-o", "--out", type=Path, required=True)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    readers = {"kinematics_calibration": panda, "ContinuousRobotCalibration": aubo, "robot-calibration": iiwa}
    for name, reader in readers.items():
        repository = Repository(options.folder, name)
        if not repository.there:
            print(f"{name}: not there")
            continue
        for record in reader(repository):
            record.write(options.out)
            print(f"{record.name}: {len(record.ids)} rows")


if __name__ == "__main__":
    main()
