"""An IRC5-like backup of a simulated line: modules, tool and work object, motion configuration."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from respot.simulation.arm import Floats
from respot.simulation.line import Line
from respot.simulation.programs import BASE, approaches, forces_of, programs_of, templates


def abb_files(line: Line) -> dict[str, bytes]:
    """Files of the backup, CRLF and in the controller's code page.

    Raises
    ------
    ValueError
        The robot travels: a track of the controller cannot run across it.
    """
    if line.external_axes is not None:
        raise ValueError(f"no backup is written for {line.robot['name']} on a rail: take a KUKA robot")
    forms, chance = templates(), np.random.default_rng([line.seed, 5309])
    programs = programs_of(line)
    modules = {name: name.replace("_", " ").title().replace(" ", "_") for name in programs}
    serial = f"{line.robot['trafo'].split()[1].split('-')[0]}-{int(chance.integers(500000, 900000))}"
    station = int(chance.integers(11, 40)) * 10
    common = {"system": f"ST{station}R01", "serial": serial, "robot": line.robot["trafo"], "modules": modules}
    texts = {
        "system.xml": forms.get_template("abb_system.xml.j2").render(common),
        "BACKINFO/backinfo.txt": forms.get_template("abb_backinfo.txt.j2").render(common),
        "SYSPAR/MOC.cfg": forms.get_template("abb_moc.cfg.j2").render(
            kind=_kind(line), serial=serial, limits=np.round(np.radians(line.robot["limits_deg"]), 5).tolist()
        ),
        "RAPID/TASK1/SYSMOD/WeldData.sys": forms.get_template("abb_data.sys.j2").render(
            tool=_pose(line.flange2tool[:3, 3], Rotation.from_matrix(line.flange2tool[:3, :3])),
            gun_kg=f"{line.gun_kg:.1f}",
            gun_centre=",".join(f"{value:.1f}" for value in line.gun_centre),
            base=_pose(np.array(BASE[:3]), _base()),
            welds=_welds(line),
        ),
        "RAPID/TASK1/PROGMOD/MainModule.mod": forms.get_template("abb_main.mod.j2").render(common),
    }
    for name, rows in programs.items():
        path = f"RAPID/TASK1/PROGMOD/{modules[name]}.mod"
        texts[path] = forms.get_template("abb_program.mod.j2").render(name=modules[name], spots=_spots(line, rows))
    return {path: text.replace("\n", "\r\n").encode("cp1252") for path, text in texts.items()}


def _base() -> Rotation:
    return Rotation.from_euler("ZYX", BASE[3:], degrees=True)


def _kind(line: Line) -> str:
    """Type as the configuration spells it: ``IRB 6700-200/2.60`` is ``ROB1_6700_2.60_200``."""
    series, _, rest = line.robot["trafo"].removeprefix("IRB ").partition("-")
    payload, _, reach = rest.partition("/")
    return f"ROB1_{series}_{float(reach):.2f}_{payload}"


def _welds(line: Line) -> dict[int, int]:
    """Weld program and its force [N]."""
    return {weld: 500 * (weld - 10) for weld in sorted({_weld(force) for force in forces_of(line)})}


def _weld(force: float) -> int:
    return int(10 + round(force / 500))


def _spots(line: Line, rows: Sequence[int]) -> list[dict[str, Any]]:
    """What the template prints of the spots of one program."""
    via, turns = approaches(line)
    forces, via_turns = forces_of(line), Rotation.from_matrix(turns)
    return [
        {
            "id": line.ids[row],
            "via": f"p{10 * number}",
            "via_target": _target(via[row], via_turns[row], line.approach_joints[row], line),
            "target": _target(line.positions[row], line.rotations[row], line.joints[row], line),
            "weld": _weld(forces[row]),
        }
        for number, row in enumerate(rows, start=1)
    ]


def _target(at: Floats, turn: Rotation, joints: Floats, line: Line) -> str:
    """Literal of a robtarget in the fixture's work object."""
    local = _pose(_base().inv().apply(at - np.array(BASE[:3])), _base().inv() * turn)
    conf = ",".join(str(value) for value in _configuration(joints, line))
    return f"[{local},[{conf}],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]]"


def _pose(at: Floats, turn: Rotation) -> str:
    place = ",".join(f"{value:.9g}" for value in np.round(at, 6) + 0.0)
    quaternion = ",".join(f"{value:.9g}" for value in np.round(turn.as_quat(scalar_first=True), 9) + 0.0)
    return f"[{place}],[{quaternion}]"


def _configuration(joints: Floats, line: Line) -> tuple[int, ...]:
    """Quarter turns of axes 1, 4 and 6, and which way wrist centre, lower arm and axis 5 lie."""
    robot = line.robot
    lower, fore = np.radians(joints[1]), np.radians(joints[1] + joints[2] + 90.0)
    wrist = robot["a1"] + robot["c2"] * np.sin(lower) + robot["c3"] * np.sin(fore) + robot["a2"] * np.cos(fore)
    behind_arm = np.radians(joints[2] + 90.0) < -np.arctan2(robot["a2"], robot["c3"])
    quarters = (int(np.floor(joints[axis] / 90.0)) for axis in (0, 3, 5))
    return (*quarters, 4 * int(wrist < 0) + 2 * int(behind_arm) + int(joints[4] < 0))
