"""The robot that a backup's own machine data describe."""

from __future__ import annotations

from dataclasses import replace

from respot.kinematics.abb_machine import abb_cell
from respot.kinematics.cell import Reason, RobotCell
from respot.kinematics.kuka_machine import kuka_cell
from respot.kinematics.model import RobotModel
from respot.program.robot import Machine


def cell_of(machine: Machine, language: str, robot: RobotModel | None = None) -> RobotCell | Reason:
    """Cell of a robot from its machine data, or why there is none.

    Parameters
    ----------
    machine : Machine
        Robot data of the backup.
    language : str
        ``"krl"`` or ``"rapid"``.
    robot : RobotModel, optional
        A model that the user named (``--robot``). It replaces the lengths of the machine data, and their limits if it
        has its own; the robot's place is the backup's where it holds one.
    """
    read = {"krl": kuka_cell, "rapid": abb_cell}
    if language not in read:
        return Reason("CONFIG_NOT_CHECKED", f"no kinematics for the language {language!r}")
    try:
        found = read[language](machine, robot)
    except ValueError as error:
        found = Reason("CONFIG_NOT_CHECKED", str(error))
    if robot is None:
        return found
    if isinstance(found, RobotCell):
        return replace(found, notes=(*found.notes, f"robot {robot.name} named by the user"))
    note = f"{found}: the robot {robot.name} is taken to stand in the world's origin"
    return RobotCell(model=robot, language=language, notes=(note, robot.limits_text))


def model_of(machine: Machine, language: str) -> RobotModel | None:
    """Model of a robot from its machine data; None where `cell_of` gives a reason."""
    found = cell_of(machine, language)
    return found.model if isinstance(found, RobotCell) else None
