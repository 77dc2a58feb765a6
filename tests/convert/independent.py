"""A reader of the rear-door samples in few lines that shares nothing with respot: regular expressions and 4x4 matrices."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

SAMPLES = Path(__file__).parents[2] / "samples" / "rear_door"
NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"


def table(path: Path) -> dict[str, np.ndarray]:
    with path.open(newline="") as file:
        return {row["id"]: np.array([float(row[axis]) for axis in "xyz"]) for row in csv.DictReader(file)}


def matrix(rotation: np.ndarray, translation) -> np.ndarray:
    made = np.eye(4)
    made[:3, :3], made[:3, 3] = rotation, translation
    return made


def rotation_about(axis: int, degrees: float) -> np.ndarray:
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    made = np.eye(3)
    made[i, i] = made[j, j] = c
    made[i, j], made[j, i] = -s, s
    return made


def from_kuka(x, y, z, a, b, c) -> np.ndarray:
    return matrix(rotation_about(2, a) @ rotation_about(1, b) @ rotation_about(0, c), (x, y, z))


def from_abb(x, y, z, w, i, j, k) -> np.ndarray:
    w, i, j, k = np.array([w, i, j, k]) / np.sqrt(w * w + i * i + j * j + k * k)
    rotation = [
        [1 - 2 * (j * j + k * k), 2 * (i * j - k * w), 2 * (i * k + j * w)],
        [2 * (i * j + k * w), 1 - 2 * (i * i + k * k), 2 * (j * k - i * w)],
        [2 * (i * k - j * w), 2 * (j * k + i * w), 1 - 2 * (i * i + j * j)],
    ]
    return matrix(np.array(rotation), (x, y, z))


def abc_of(rotation: np.ndarray, near: np.ndarray) -> np.ndarray:
    """KUKA angles of a rotation matrix: of the two triples, and whole turns of each angle, those nearest to others."""
    a = np.degrees(np.arctan2(rotation[1, 0], rotation[0, 0]))
    b = np.degrees(np.arctan2(-rotation[2, 0], np.hypot(rotation[0, 0], rotation[1, 0])))
    c = np.degrees(np.arctan2(rotation[2, 1], rotation[2, 2]))
    triples = np.array([[a, b, c], [a + 180.0, 180.0 - b, c + 180.0]])
    triples += 360.0 * np.round((near - triples) / 360.0)
    found = min(triples, key=lambda triple: np.linalg.norm(triple - near))
    beyond = (np.abs(found) > 180.0) & (np.abs(near) <= 180.0)
    return np.where(beyond, found - 360.0 * np.sign(found), found)


def quaternion_of(rotation: np.ndarray, near: np.ndarray) -> np.ndarray:
    """ABB quaternion of a rotation matrix, with the sign and length of another: the eigenvector of the largest value."""
    m = rotation
    form = np.array(
        [
            [m[0, 0] + m[1, 1] + m[2, 2], m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]],
            [m[2, 1] - m[1, 2], m[0, 0] - m[1, 1] - m[2, 2], m[0, 1] + m[1, 0], m[0, 2] + m[2, 0]],
            [m[0, 2] - m[2, 0], m[0, 1] + m[1, 0], m[1, 1] - m[0, 0] - m[2, 2], m[1, 2] + m[2, 1]],
            [m[1, 0] - m[0, 1], m[0, 2] + m[2, 0], m[1, 2] + m[2, 1], m[2, 2] - m[0, 0] - m[1, 1]],
        ]
    )
    found = np.linalg.eigh(form)[1][:, -1]
    return found * np.linalg.norm(near) * (-1.0 if found @ near < 0.0 else 1.0)


def angle_between(first: np.ndarray, second: np.ndarray) -> float:
    """Degrees between the rotations of two 4x4 matrices, exact for small ones too."""
    turn = first[:3, :3].T @ second[:3, :3]
    sine = 0.5 * np.linalg.norm([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    return float(np.degrees(np.arctan2(sine, 0.5 * (np.trace(turn) - 1.0))))


@dataclass(frozen=True)
class Point:
    """A literal: its pose in its base, its base in the world, the text of its pose numbers, everything else it holds."""

    pose: np.ndarray
    base: np.ndarray
    numbers: list[str]
    rest: tuple[str, ...]


def kuka_points(root: Path) -> dict[str, Point]:
    config = (root / "KRC/R1/System/$config.dat").read_bytes().decode("cp1252")
    bases = {}
    for number, text in re.findall(r"^BASE_DATA\[(\d+)\]=\{([^}]*)\}", config, re.M):
        bases[int(number)] = from_kuka(*(float(value) for value in re.findall(rf"[XYZABC] ({NUMBER})", text)))
    points = {}
    for file in sorted((root / "KRC/R1/Program").glob("*.dat")):
        text = file.read_bytes().decode("cp1252")
        used = dict(re.findall(r"DECL FDAT F(\w+)=\{TOOL_NO \d+,BASE_NO (\d+)", text))
        for name, body in re.findall(r"DECL E6POS X(\w+)=\{([^}]*)\}", text):
            members = [member.split(" ") for member in body.split(",")]
            numbers = [value for key, value in members if key in "XYZABC"]
            rest = tuple(value for key, value in members if key not in "XYZABCST")
            pose = from_kuka(*(float(value) for value in numbers))
            points[f"{file.stem}.{name}"] = Point(pose, bases[int(used[name])], numbers, rest)
    return points


def abb_points(root: Path) -> dict[str, Point]:
    system = (root / "RAPID/TASK1/SYSMOD/WeldData.sys").read_bytes().decode("latin-1")
    bases = {}
    for name, body in re.findall(r'wobjdata (\w+):=\[FALSE,TRUE,"",(.*)\];', system):
        values = [float(value) for value in re.findall(NUMBER, body)]
        bases[name] = from_abb(*values[:7]) @ from_abb(*values[7:])
    points = {}
    for file in sorted((root / "RAPID/TASK1/PROGMOD").glob("*.mod")):
        text = file.read_bytes().decode("latin-1")
        live = re.sub(r"^\s*!.*$", "", text, flags=re.M)
        used = dict(re.findall(r"^\s*(?:Move[LJ]|Spot[LJ]) (?:Offs\(|RelTool\()?(\w+)\b.*\\WObj:=(\w+)", live, re.M))
        found = [(name, body, used[name]) for name, body in re.findall(r"robtarget (\w+):=\[(.*)\];", live)]
        for number, (body, spot, wobj) in enumerate(
            re.findall(
                r"(?:Move|Spot)[LJ] \[(\[.*?\],\[.*?\],\[.*?\],\[.*?\])\],\w+,(?:gun1,sd_)?(\w+),.*\\WObj:=(\w+)", live
            )
        ):
            found.append((spot if spot.startswith("P02") else f"inline{number}", body, wobj))
        for name, body, wobj in found:
            texts = re.findall(NUMBER, body)
            pose = from_abb(*(float(value) for value in texts[:7]))
            points[f"{file.stem}.{name}"] = Point(pose, bases[wobj], texts[:7], tuple(texts[11:]))
    return points


@dataclass(frozen=True)
class RobotFiles:
    name: str
    read: Callable[[Path], dict[str, Point]]
    welding: tuple[str, ...]
    offsets: str
    encoding: str

    @property
    def root(self) -> Path:
        return SAMPLES / self.name


ROBOTS = (
    RobotFiles("kuka", kuka_points, ("rear_door_u", "rear_door_o"), r"LIN_REL \{(.*?)\} #BASE", "cp1252"),
    RobotFiles("abb", abb_points, ("RearDoor",), r"Offs\(\w+,(.*?)\)", "latin-1"),
)
