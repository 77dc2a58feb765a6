"""A KRC4-like backup of a simulated line: programs, frames, machine data, as an archive of the controller has them."""

from __future__ import annotations

import uuid
from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from respot.simulation.arm import Floats
from respot.simulation.line import Line
from respot.simulation.programs import BASE, approaches, forces_of, programs_of, templates

_TOOL_NAME, _BASE_NAME = "SZ_X01_SERVO", "KAROSSE LI"


def kuka_files(line: Line) -> dict[str, bytes]:
    """Files of the backup, CRLF and in the controller's code page."""
    forms = templates()
    chance = np.random.default_rng([line.seed, 5309])
    station = int(chance.integers(11, 40)) * 10
    rail = line.external_axes is not None
    programs = programs_of(line)
    named = {"tool_name": _TOOL_NAME, "base_name": _BASE_NAME}
    robot = {name: real(line.robot[name]) for name in ("a1", "c1", "c2", "c3", "c4")}
    texts = {
        "am.ini": forms.get_template("am.ini.j2").render(
            name=f"ST{station}R01",
            serial=int(chance.integers(500000, 900000)),
            guid=str(uuid.UUID(int=int(chance.integers(1 << 62)), version=4)),
        ),
        "KRC/R1/cell.src": forms.get_template("cell.src.j2").render(programs=list(programs)),
        "KRC/R1/System/$config.dat": forms.get_template("config.dat.j2").render(
            tool=_members("XYZABC", _six(line.flange2tool[:3, 3], line.flange2tool[:3, :3])),
            base=_members("XYZABC", np.array(BASE)),
            gun_kg=real(round(line.gun_kg, 1)),
            gun_centre=_members("XYZ", np.round(line.gun_centre, 1)),
            home_e1="1800.00" if rail else "0.0",
            **named,
        ),
        "KRC/R1/Mada/$machine.dat": forms.get_template("machine.dat.j2").render(
            limits=[[real(low), real(high)] for low, high in line.robot["limits_deg"]],
            trafo=line.robot["trafo"],
            ratios=line.robot["ratios"],
            minus_a2=real(-line.robot["a2"]),
            rail=rail,
            **robot,
        ),
    }
    for name, rows in programs.items():
        values = {"name": name, "rel": int(chance.integers(20, 140)), "spots": _spots(line, rows), **named}
        for kind in ("src", "dat"):
            path = f"KRC/R1/Program/{name}.{kind}"
            texts[path] = forms.get_template(f"program.{kind}.j2").render(values)
    return {path: text.replace("\n", "\r\n").encode("cp1252") for path, text in texts.items()}


def real(value: float) -> str:
    """Print a REAL as a controller does: float32, six digits where they suffice, else nine."""
    single = np.float32(value)
    if single == 0:
        return "0.0"
    short = f"{single:#.6g}"
    return short if np.float32(short) == single else f"{single:#.9g}"


def _spots(line: Line, rows: Sequence[int]) -> list[dict[str, Any]]:
    """What the templates print of the spots of one program."""
    via, via_turns = approaches(line)
    forces, turns = forces_of(line), line.rotations.as_matrix()
    rail = np.zeros(line.n) if line.external_axes is None else line.external_axes[:, 0]
    return [
        {
            "id": line.ids[row],
            "via": f"P{10 * number}",
            "via_pose": _e6pos(via[row], via_turns[row], line.approach_joints[row], rail[row], line),
            "pose": _e6pos(line.positions[row], turns[row], line.joints[row], rail[row], line),
            "weld": int(10 + round(forces[row] / 500)),
            "force": real(round(forces[row] / 1000, 2)),
        }
        for number, row in enumerate(rows, start=1)
    ]


def _six(at: Floats, turn: Floats) -> Floats:
    return np.concatenate([at, Rotation.from_matrix(turn).as_euler("ZYX", degrees=True)])


def _members(names: str, values: Floats) -> str:
    return ",".join(f"{name} {real(value)}" for name, value in zip(names, values, strict=True))


def _e6pos(at: Floats, turn: Floats, joints: Floats, rail: float, line: Line) -> str:
    """Members of an E6POS in the fixture's base, with all nine digits, so that base times point stays exact."""
    base = Rotation.from_euler("ZYX", BASE[3:], degrees=True)
    local = _six(base.inv().apply(at - np.array(BASE[:3])), (base.inv() * Rotation.from_matrix(turn)).as_matrix())
    shown = ",".join(f"{name} {np.float32(value):#.9g}" for name, value in zip("XYZABC", local, strict=True))
    status, turns = _status_turn(joints, line)
    return f"{shown},S {status},T {turns},E1 {real(rail)},E2 0.0,E3 0.0,E4 0.0,E5 0.0,E6 0.0"


def _status_turn(joints: Floats, line: Line) -> tuple[int, int]:
    """Status and Turn: wrist behind axis 1, elbow above its stretched angle, axis 5 negative; axes below zero."""
    robot = line.robot
    upper, fore = np.radians(joints[1]), np.radians(joints[1] + joints[2])
    wrist = robot["a1"] + robot["c2"] * np.cos(upper) + robot["c3"] * np.cos(fore) - robot["a2"] * np.sin(fore)
    above = np.radians(joints[2]) > -np.arctan2(robot["a2"], robot["c3"])
    status = int(wrist < 0) + 2 * int(above) + 4 * int(joints[4] < 0)
    return status, sum(1 << axis for axis, angle in enumerate(joints) if angle < 0)
