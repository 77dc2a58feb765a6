"""An ABB robot from its ``MOC.cfg``: type, joint bounds, base frame (facts: rapid.md 4.3).

The lengths are in no backup; they come from the built-in list.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from respot.geometry import Array, pose, rotation_from_quaternion
from respot.kinematics.cell import Reason, RobotCell
from respot.kinematics.model import RobotModel
from respot.kinematics.opw import OpwRobot
from respot.kinematics.robots import built_in_robots, similar_robots
from respot.kinematics.track import Track
from respot.program.robot import Machine
from respot.tolerance import QUATERNION_NORM

Row = Mapping[str, str]

#: Sections of ``MOC.cfg`` that describe a mechanical unit with one axis.
_UNIT = ("SINGLE", "SINGLE_TYPE", "JOINT")
#: ``ROB1_6700_2.60_200``: robot of the controller, type, reach in m, payload in kg. Anything behind names a variant.
_TYPE = re.compile(r"ROB\d+_(\w+?)_(\d+\.?\d*)_(\d+)", re.IGNORECASE)


def abb_cell(machine: Machine, model: RobotModel | None = None) -> RobotCell | Reason:
    """Cell of an ABB robot, or why its configuration does not make one; ``model`` replaces the robot type's."""
    robots = _rows(machine, "ROBOT")
    if not robots:
        return _no("the backup holds no MOC.cfg with a ROBOT")
    if len(robots) > 1:
        names = ", ".join(row.get("name", "?") for row in robots)
        return _no(f"the controller moves several robots ({names}): it cannot be told which one runs a program")
    robot = robots[0]
    found = model or robot_of_type(robot.get("use_robot_type", ""))
    if isinstance(found, Reason):
        return found
    robroot = _base_frame(robot)
    if isinstance(robroot, Reason):
        return robroot
    try:
        limits, notes = _limits(machine, robot)
        if limits is not None and found.limits_deg is None and found.axes == len(limits):
            found = found.with_limits(limits)
    except ValueError as error:
        return _no(f"joint bounds in MOC.cfg: {error}")
    track = _track(machine, robot, robroot)
    if isinstance(track, Reason):
        notes.append(f"the robot stands on {robot.get('base_frame_coordinated')}, its base moves: {track}")
    elif track is not None:
        notes.append(f"the robot stands on {track.name}: taken to run along the x axis of its base frame")
    gravity, tilt = _gravity(robot)
    return RobotCell(
        model=found,
        language="rapid",
        robroot=track.base2world(np.zeros(6)) if isinstance(track, Track) else robroot,
        absolute_accuracy=bool(re.fullmatch(r"r\d+_calib", robot.get("use_robot_calib", ""), re.IGNORECASE)),
        on_track=track is not None,
        track=track if isinstance(track, Track) else None,
        gravity=gravity,
        external_axes=len(_rows(machine, "SINGLE")),
        notes=(*notes, *tilt),
    )


def _track(machine: Machine, robot: Row, robroot: RigidTransform) -> Track | Reason | None:
    """What carries the robot (``base_frame_coordinated``): a SINGLE of mechanics TRACK; None where nothing does.

    The SINGLE has its base frame, its joint's logical axis 7 is eax_a. The robot's base frame is seen from the
    carriage.
    """
    unit = robot.get("base_frame_coordinated", "")
    if not unit:
        return None
    singles, kinds, joints = ({r.get("name", ""): r for r in _rows(machine, k)} for k in _UNIT)
    single = singles.get(unit)
    if single is None:
        return _no(f"MOC.cfg has no SINGLE {unit}")
    mechanics = kinds.get(single.get("use_single_type", ""), {}).get("mechanics", "")
    if mechanics.upper() != "TRACK":
        return _no(f"{unit} is no TRACK but {mechanics or 'unknown'}")
    axis = _number(joints.get(single.get("use_joint", ""), {}), "logical_axis")
    if axis is None or axis not in range(7, 13):
        return _no(f"the joint of {unit} has no logical axis from 7 to 12")
    start = _base_frame(single)
    if isinstance(start, Reason):
        return start
    return Track(int(axis) - 7, start, (1.0, 0.0, 0.0), robroot, name=unit)


def _gravity(robot: Row) -> tuple[Array | None, list[str]]:
    """Direction of gravity in the base, as ``gravity_beta`` (about y) or ``gravity_alpha`` (about x) tell it."""
    angles = [_number(robot, f"gravity_{name}") or 0.0 for name in ("alpha", "beta")]
    if not any(angles):
        return None, []
    if all(angles):
        return None, ["gravity_alpha and gravity_beta are both set: gravity is taken to point down the world"]
    tilted = Rotation.from_rotvec([*angles, 0.0])
    name = "gravity_alpha" if angles[0] else "gravity_beta"
    note = f"{name} {sum(angles):g} rad: mounted tilted as far as gravity is concerned"
    return np.asarray(tilted.inv().apply([0.0, 0.0, -1.0])), [note]


def robot_of_type(kind: str) -> OpwRobot | Reason:
    """Robot of a ``use_robot_type``, e.g. ``ROB1_6700_2.60_200``; type, reach and payload must all be the same."""
    parts = _TYPE.fullmatch(kind)
    wanted = _key(*parts.groups()) if parts else None
    for name, robot in built_in_robots().items():
        if wanted is not None and name.startswith("irb") and name.count("_") == 2:
            family, payload, reach = name.removeprefix("irb").split("_")
            if _key(family, reach, payload) == wanted:
                return robot.model
    guess = "irb" + "_".join((parts[1], parts[3], parts[2].replace(".", ""))) if parts else kind
    similar = [name for name in similar_robots(guess) if name.startswith("irb")]
    hint = f"; similar: {', '.join(similar)}" if similar else ""
    return _no(f"robot type {kind!r} is not in the built-in list{hint}. If one fits, name it with --robot")


def _key(family: str, reach: str, payload: str) -> tuple[str, str, str]:
    """Type, reach in digits without the zeros around them, payload: ``2.60`` and ``260`` are one reach."""
    return family.lower(), reach.replace(".", "").strip("0"), payload.lstrip("0")


def _base_frame(robot: Row) -> RigidTransform | Reason:
    """``base2world``; only values that are not the default are written, metres and a quaternion, scalar first."""
    position = [1000.0 * (_number(robot, f"base_frame_pos_{axis}") or 0.0) for axis in "xyz"]
    vector = [_number(robot, f"base_frame_orient_u{n}") or 0.0 for n in (1, 2, 3)]
    scalar = _number(robot, "base_frame_orient_u0")
    if scalar is None:
        scalar = 0.0 if abs(np.linalg.norm(vector) - 1.0) < QUATERNION_NORM else 1.0
    quaternion = [scalar, *vector]
    if not np.isfinite([*position, *quaternion]).all() or abs(np.linalg.norm(quaternion) - 1.0) > QUATERNION_NORM:
        return _no(f"the base frame of {robot.get('name', 'the robot')} in MOC.cfg is no pose: |q| is not 1")
    return pose(position, rotation_from_quaternion(quaternion))


def _limits(machine: Machine, robot: Row) -> tuple[Array | None, list[str]]:
    """Joint bounds of the six arms [deg]: ROBOT.use_joint_n -> JOINT.use_arm -> ARM, in radians."""
    joints, arms = ({row.get("name", ""): row for row in _rows(machine, kind)} for kind in ("JOINT", "ARM"))
    limits = np.tile([-np.inf, np.inf], (6, 1))
    for n in range(6):
        name = robot.get(f"use_joint_{n}", "")
        arm = arms.get(joints.get(name, {}).get("use_arm", name), {})
        for column, key in enumerate(("lower_joint_bound", "upper_joint_bound")):
            bound = _number(arm, key)
            if bound is not None:
                limits[n, column] = np.degrees(bound)
    unknown = [str(n + 1) for n in range(6) if not np.isfinite(limits[n]).all()]
    if len(unknown) == 6 and not np.isfinite(limits).any():
        return None, ["joint bounds unknown, not checked"]
    return limits, [f"joint bounds of axis {', '.join(unknown)} unknown"] if unknown else []


def _rows(machine: Machine, kind: str) -> Sequence[Row]:
    found = machine.values.get(kind)
    return [row for row in found if isinstance(row, Mapping)] if isinstance(found, Sequence) else []


def _number(row: Row, key: str) -> float | None:
    if key not in row:
        return None
    try:
        return float(row[key])
    except ValueError as error:
        raise ValueError(f"{key} {row[key]!r} is no number") from error


def _no(message: str) -> Reason:
    return Reason("CONFIG_NOT_CHECKED", message)
