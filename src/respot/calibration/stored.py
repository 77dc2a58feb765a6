"""A stored calibration is used on a source: read it, and say where the two do not belong together."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from respot.calibration.calibration import Calibration, CalibrationError
from respot.geometry import distance_mm, turn_deg
from respot.issues import BadInputError, Issue
from respot.kinematics.model import RobotModel
from respot.kinematics.robot_file import robot_from_record
from respot.program.robot import Robot
from respot.spots import Source

_SHOWN = 12
_STANDS, _ALIKE_MM, _ALIKE_DEG = 20, 1e-3, 1e-5


def load_calibration(path: Path) -> Calibration:
    """Read a calibration.

    Raises
    ------
    BadInputError
        ``BAD_CALIBRATION`` with the reason and what to do.
    """
    try:
        return Calibration.load(path)
    except CalibrationError as error:
        raise BadInputError("BAD_CALIBRATION", str(error).removeprefix(f"{path}: "), str(path)) from error


def robot_identity(robot: Robot) -> dict[str, str]:
    """What tells a robot from another, for a calibration's provenance: name, language, model, task, serial number."""
    serial = robot.machine.facts.get("serial")
    known = {"name": robot.name, "language": robot.language, "model": robot.machine.model, "task": robot.task}
    return {**known, "serial": "" if serial is None or not serial.value.strip(" 0") else serial.value}


def arm_of(
    calibration: Calibration, named: RobotModel | None, path: str, *, any_robot: bool = False
) -> tuple[RobotModel | None, list[Issue]]:
    """Kinematics to compute the effects of a calibration with: its own, unless a robot is named.

    Parameters
    ----------
    calibration : Calibration
    named : RobotModel or None
        ``--robot``.
    path : str
        The source, for messages.
    any_robot : bool
        Make a warning of the error.

    Raises
    ------
    BadInputError
        ``ANOTHER_ROBOT``: the named robot's lengths or zeros are not those that the effects were fitted with.
    """
    own = None if calibration.robot is None else robot_from_record(calibration.robot)
    if named is None or own is None or not calibration.terms or _same_arm(own, named):
        return own if named is None else named, []
    message = f"the effects were fitted with the arm of {own.name}, and --robot names another, {named.name}"
    if not any_robot:
        advice = "leave --robot out, or say --any-robot if you know that the calibration holds for it"
        raise BadInputError("ANOTHER_ROBOT", f"{message}; {advice}", path)
    return named, [Issue("ANOTHER_SOURCE", message, path)]


def _same_arm(first: RobotModel, second: RobotModel) -> bool:
    """Whether two arms stand alike at some joints: names and limits do not matter."""
    if first.axes != second.axes:
        return False
    joints = np.random.default_rng(0).uniform(-90.0, 90.0, (_STANDS, first.axes))
    one, other = first.forward(joints), second.forward(joints)
    return float(distance_mm(one, other).max()) < _ALIKE_MM and float(turn_deg(one, other).max()) < _ALIKE_DEG


def source_issues(
    calibration: Calibration, source: Source, *, any_robot: bool = False, option: str = "--any-robot"
) -> list[Issue]:
    """Compare a source with the one that a calibration was fitted to.

    Another file is a warning: a new program of the same robot is what predictions are for. Another robot is an error. A
    serial number (and task) decides where both are known; else model, language and name must agree.

    Parameters
    ----------
    calibration : Calibration
        The stored one.
    source : Source
        What it is used on.
    any_robot : bool
        Make a warning of the error.
    option : str
        What a person may say to get ``any_robot``; empty where nothing does.

    Raises
    ------
    BadInputError
        ``ANOTHER_ROBOT``.
    """
    stated = calibration.provenance.get("source_sha256")
    if not isinstance(stated, str) or stated == source.sha256:
        return []
    issues = []
    difference = _other_robot(calibration.provenance.get("robot"), source.robot)
    if difference:
        message = f"the calibration was fitted to another robot: {difference}"
        if not any_robot:
            advice = "fit one for this robot"
            advice += f", or say {option} if you know that it is the same" if option else ""
            raise BadInputError("ANOTHER_ROBOT", f"{message}; {advice}", str(source.path))
        issues.append(Issue("ANOTHER_SOURCE", message, str(source.path)))
    first = calibration.provenance.get("source", "an unnamed source")
    message = (
        f"sha256 {source.sha256[:_SHOWN]} is not what the calibration was fitted to ({first}, sha256 "
        f"{stated[:_SHOWN]}): it holds for the same robot in the same place, with the same tool and base data"
    )
    return [*issues, Issue("ANOTHER_SOURCE", message, str(source.path))]


def _other_robot(stated: object, robot: Robot | None) -> str:
    """What differs; empty if nothing does or nothing is known."""
    if robot is None or not isinstance(stated, Mapping):
        return ""
    own: Mapping[str, Any] = robot_identity(robot)
    # robots of one controller share its serial number and differ by task; names may be no more than a file's
    serials = bool(stated.get("serial") and own.get("serial"))
    for key in ("serial", "task") if serials else ("model", "language", "name"):
        if stated.get(key) and own.get(key) and str(stated[key]).casefold() != str(own[key]).casefold():
            return f"{key} {stated[key]}, this one has {own[key]}"
    return ""
