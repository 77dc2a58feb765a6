"""Status and turn or confdata of moved targets, from the robot's kinematic model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import RigidTransform

from respot.correction.scope import Moving
from respot.kinematics.cell import Reason, RobotCell
from respot.kinematics.configuration import reconfigure
from respot.kinematics.from_backup import cell_of
from respot.languages import Language
from respot.program.frames import Frame
from respot.program.robot import Robot


@dataclass(frozen=True)
class Configured:
    """What becomes of a moved target's status and turn or confdata.

    Parameters
    ----------
    values : mapping of str to float
        New values by field.
    code, message : str
        Why there are none; empty where there are.
    """

    values: Mapping[str, float] = field(default_factory=dict)
    code: str = ""
    message: str = ""


def configure(
    robot: Robot, language: Language, moving: Sequence[Moving], after: Sequence[RigidTransform]
) -> list[Configured]:
    """Configuration of moved targets: the solution nearest the joints that the old values define (DESIGN section 5).

    Parameters
    ----------
    robot : Robot
        The robot, with its machine data.
    language : Language
        Its language.
    moving : sequence of Moving
        The targets.
    after : sequence of RigidTransform
        New pose of each in its base.
    """
    cell = cell_of(robot.machine, robot.language)
    if isinstance(cell, Reason):
        return [Configured(code=cell.code, message=cell.message)] * len(moving)
    return [_one(cell, language, item, pose) for item, pose in zip(moving, after, strict=True)]


def notes_of(robot: Robot) -> Sequence[str]:
    """Return what the model leaves unchecked, such as unknown limits."""
    cell = cell_of(robot.machine, robot.language)
    return () if isinstance(cell, Reason) else cell.notes


def _one(cell: RobotCell, language: Language, moving: Moving, after: RigidTransform) -> Configured:
    fields = language.configuration_fields
    numbers = [moving.target.number(name) for name in fields]
    if any(number is None for number in numbers):
        missing = ", ".join(name for name, number in zip(fields, numbers, strict=True) if number is None)
        return Configured(code="CONFIG_INCONSISTENT", message=f"the target has no {missing}")
    tools = _tools(moving)
    if isinstance(tools, Configured):
        return tools
    base, old = moving.base.pose, moving.target.pose
    assert base is not None and old is not None  # noqa: S101 - scope refuses both
    results = [reconfigure(cell, tool, base * old, base * after, np.array([numbers])) for tool in tools]
    for result in results:
        if (reason := result.reasons[0]) is not None:
            return Configured(code=reason.code, message=reason.message)
    first = results[0].configuration[0]
    if any((result.configuration[0] != first).any() for result in results):
        message = "the target is used with several tools, which need different status/turn or confdata"
        return Configured(code="CONFIG_INCONSISTENT", message=message)
    return Configured({name: float(value) for name, value in zip(fields, first, strict=True)})


def _tools(moving: Moving) -> list[RigidTransform] | Configured:
    """Poses of the tools that the target is used with."""
    frames: dict[int, Frame | None] = {id(move.tool): move.tool for move in moving.moves}
    poses = []
    for frame in frames.values():
        if frame is None or frame.pose is None:
            reason = "the program does not tell it" if frame is None else f"{frame}: {frame.unknown}"
            return Configured(code="UNKNOWN_TOOL", message=f"status/turn or confdata need the tool: {reason}")
        poses.append(frame.pose)
    return poses
