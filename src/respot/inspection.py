"""What a robot holds as plain values: the `inspect` record of INTERFACES.md."""

from __future__ import annotations

from typing import Any

from scipy.spatial.transform import RigidTransform

from respot.geometry import abc_from_rotation, quaternion_from_rotation
from respot.program.frames import Frame
from respot.program.moves import Move
from respot.program.robot import Robot
from respot.program.targets import Target, TargetKind
from respot.spots import spots_of_robot


def inspect_robot(robot: Robot, spot_id: str | None = None) -> dict[str, Any]:
    """Record of a robot: name, programs, frames, and a target for every motion."""
    spots = spots_of_robot(robot, (), spot_id)
    ids = {id(move.target): name for name, move in zip(spots.ids, spots.moves, strict=True)}
    return {
        "name": robot.name,
        "language": robot.language,
        "model": robot.machine.model,
        "programs": robot.programs,
        "frames": {
            "tools": [_frame(frame) for frame in robot.tools],
            "bases": [_frame(frame) for frame in robot.bases],
        },
        "targets": [_target(move, move.target, ids) for move in robot.moves() if move.target is not None],
    }


def _frame(frame: Frame) -> dict[str, Any]:
    pose = _pose(frame.pose)
    return {
        "name": frame.name,
        "label": frame.label,
        **pose,
        "unknown": frame.unknown,
        "path": frame.path,
        "line": frame.line,
    }


def _target(move: Move, target: Target, ids: dict[int, str]) -> dict[str, Any]:
    numbers = {name.lower(): float(number.value) for name, number in target.numbers.items()}
    joints = target.kind is TargetKind.JOINTS
    world = move.world
    return {
        "name": target.name,
        "spot_id": ids.get(id(target)),
        "program": move.program,
        "routine": move.routine,
        "path": move.path,
        "line": move.line,
        "kind": move.motion.value,
        "weld": move.weld,
        "tool": None if move.tool is None else str(move.tool),
        "base": None if move.base is None else str(move.base),
        "external_tcp": move.external_tcp,
        **_pose(None if joints else target.pose),
        "joints": {name: value for name, value in numbers.items() if name.startswith(("a", "rax"))} if joints else None,
        "external_axes": {
            name: value
            for name, value in numbers.items()
            if name[0] == "e" and name[1:2] in "123456ax" and abs(value) < 9e8
        },
        "status": _whole(numbers.get("s")),
        "turn": _whole(numbers.get("t")),
        "confdata": [_whole(numbers[name]) for name in ("cf1", "cf4", "cf6", "cfx")] if "cf1" in numbers else None,
        **({"part": {key: _pose(target.pose)[key] for key in ("x", "y", "z", "q")}} if move.external_tcp else {}),
        "world": None if world is None else {key: _pose(world)[key] for key in ("x", "y", "z", "q")},
    }


def _whole(value: float | None) -> int | None:
    return None if value is None else int(value)


def _pose(pose: RigidTransform | None) -> dict[str, Any]:
    if pose is None:
        return dict.fromkeys(("x", "y", "z", "a", "b", "c", "q"))
    values = [*pose.translation.tolist(), *abc_from_rotation(pose.rotation).tolist()]
    return {**dict(zip("xyzabc", values, strict=True)), "q": quaternion_from_rotation(pose.rotation).tolist()}
