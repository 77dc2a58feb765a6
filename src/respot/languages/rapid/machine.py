"""Robot data of an ABB backup as plain values: ``MOC.cfg``, tools and work objects."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

from respot.geometry import pose, rotation_from_quaternion
from respot.languages.rapid.controller import ControllerData, Instance, MovingTask
from respot.languages.rapid.symbols import Aggregate, Value
from respot.program.frames import Frame, Load, PoseLiteral
from respot.program.robot import Fact, Machine
from respot.program.targets import Number
from respot.tolerance import QUATERNION_NORM

TOOL0 = Frame("tool0", world=True, held=True)
WOBJ0 = Frame("wobj0", world=True)

_POSE = ("x", "y", "z", "q1", "q2", "q3", "q4")
#: Whether a robot runs with its calibrated lengths: ``r1_calib``; ``r1_uncalib`` are the nominal ones (rapid.md 4.3).
_CALIBRATED = re.compile(r"r\d+_calib", re.IGNORECASE)


def read_machine(data: ControllerData, task: MovingTask, folder: str = "") -> Machine:
    """Robot data of one robot of a controller.

    Parameters
    ----------
    data : ControllerData
        What the backup says about the controller.
    task : MovingTask
        The task that moves the robot: of ``ROBOT`` and ``SINGLE`` only the instances of its mechanical unit group
        stay. A task that names no robot of ``MOC.cfg`` leaves all of them.
    folder : str
        Folder of the robot's task.
    """
    values = dict(data.motion)
    if task.robot:
        named = [row for row in values.get("ROBOT", []) if (row.value("name") or "").lower() == task.robot.lower()]
        if named:
            values["ROBOT"] = named
            values["SINGLE"] = _singles(data, named[0], task)
    robots = values.get("ROBOT", [])
    own = robots[0] if len(robots) == 1 else None
    facts = dict(data.facts)
    if own is not None:
        facts |= _robot_facts(data, own)
    facts |= _task_facts(data, folder)
    model = "" if own is None else own.get("use_robot_type", "")
    paths = tuple(dict.fromkeys(row.path for rows in data.motion.values() for row in rows))
    return Machine(model, dict(values), paths, facts)


def _singles(data: ControllerData, robot: Instance, task: MovingTask) -> list[Instance]:
    """Single axes of a robot's group, through ``MECHANICAL_UNIT`` ``-use_single_0`` .., and the one it stands on."""
    names = {robot.get("base_frame_coordinated", ""), *task.units}
    for unit in data.motion.get("MECHANICAL_UNIT", []):
        if unit.value("name") in task.units:
            names |= {value for key, value in unit.items() if key.lower().startswith("use_single_")}
    return [row for row in data.motion.get("SINGLE", []) if row.value("name") in names]


def _task_facts(data: ControllerData, folder: str) -> dict[str, Fact]:
    """Name, program and hidden modules of a task."""
    entry = data.task_of(folder)
    if entry is None:
        return {}
    hidden = ", ".join(module for module, is_hidden in entry.modules if is_hidden)
    said = {"task": entry.name, "program": entry.program, "hidden modules": hidden}
    return {key: Fact(value, entry.path, entry.line) for key, value in said.items() if value}


def _robot_facts(data: ControllerData, robot: Instance) -> dict[str, Fact]:
    """Type, serial number and absolute accuracy of a robot."""
    facts = {}
    kind, calibration = robot.fact("use_robot_type"), robot.fact("use_robot_calib")
    if kind is not None:
        facts["robot type"] = kind
    if calibration is not None:
        active = _CALIBRATED.fullmatch(calibration.value) is not None
        said = f"{'active' if active else 'not active'} ({calibration.value})"
        facts["absolute accuracy"] = Fact(said, calibration.path, calibration.line)
    for row in data.motion.get("ROBOT_SERIAL_NUMBER", []):
        high, low = row.value("robot_serial_number_high_part"), row.value("robot_serial_number_low_part")
        if row.value("name") == robot.value("use_robot_serial_number") and high and low:
            facts["serial"] = Fact(f"{high.strip()}-{low.strip()}", row.path, row.line)
    return facts


def read_tool(name: str, value: Value | None, path: str, line: int) -> Frame:
    """Tool of a ``tooldata``: ``[robhold,[[x,y,z],[q1,q2,q3,q4]],[load]]``.

    Parameters
    ----------
    name : str
        Its name.
    value : Value or None
        Its value; None where the backup has none.
    path, line :
        Its declaration.
    """
    items = _items(value)
    found = _pose(items[1], path, line) if len(items) == 3 else None
    held = _truth(items[0]) if items else None
    if found is None or held is None:
        return Frame(name, "", None, "no literal tooldata", path, line, held=held is True)
    return Frame(name, "", found.pose, "", path, line, held=held, literal=found)


def read_work_object(name: str, value: Value | None, path: str, line: int) -> Frame:
    """Base of a ``wobjdata``: ``[robhold,ufprog,ufmec,uframe,oframe]``; its pose is ``uframe * oframe``.

    Parameters as `read_tool`.
    """
    items = _items(value)
    user, work = (_pose(item, path, line) for item in items[3:]) if len(items) == 5 else (None, None)
    held, fixed = (_truth(items[0]), _truth(items[1])) if len(items) == 5 else (None, None)
    if user is None or work is None or held is None or fixed is None:
        return Frame(name, "", None, "no literal wobjdata", path, line, held=held is True)
    if not fixed:
        unit = str(items[2]).strip('"') or "a mechanical unit"
        return Frame(name, "", None, f"its user frame moves with {unit}", path, line, held=held)
    whole = user.pose * work.pose
    return Frame(name, "", whole, "", path, line, held=held, user=user.pose, literal=work, user_literal=user)


def read_load(name: str, value: Value | None, path: str, line: int) -> Load:
    """Load of a ``loaddata``: ``[mass,[x,y,z],[q1,q2,q3,q4],ix,iy,iz]``, in kg and, from the flange, mm.

    Parameters as `read_tool`.
    """
    items = _items(value)
    centre = items[1].numbers() if len(items) == 6 and isinstance(items[1], Aggregate) else None
    if centre is None or len(centre) != 3 or not isinstance(items[0], Number):
        return Load(name, unknown="no literal loaddata", path=path, line=line)
    x, y, z = (float(number.value) for number in centre)
    return Load(name, float(items[0].value), (x, y, z), "", path, line)


def read_tool_load(name: str, value: Value | None, path: str, line: int) -> Load:
    """Load that a ``tooldata`` carries with it; of a stationary tool that is the gripper (facts: rapid.md 2.4)."""
    items = _items(value)
    return read_load(name, items[2] if len(items) == 3 else None, path, line)


def _items(value: Value | None) -> Sequence[Value]:
    return value.items if isinstance(value, Aggregate) else ()


def _pose(value: Value, path: str, line: int) -> PoseLiteral | None:
    if not isinstance(value, Aggregate) or value.shape() != (3, 4):
        return None
    parts = [item.numbers() for item in value.items if isinstance(item, Aggregate)]
    numbers = [number for part in parts if part is not None for number in part]
    if len(numbers) != len(_POSE):
        return None
    values = [float(number.value) for number in numbers]
    if abs(math.hypot(*values[3:]) - 1.0) > QUATERNION_NORM:
        return None
    found = pose(values[:3], rotation_from_quaternion(values[3:]))
    return PoseLiteral(found, dict(zip(_POSE, numbers, strict=True)), value.span, path, line)


def _truth(value: Value) -> bool | None:
    return {"TRUE": True, "FALSE": False}.get(str(value).upper())
