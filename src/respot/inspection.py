"""What a robot holds as plain values: the `inspect` record of INTERFACES.md."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from respot.geometry import (
    IDENTITY,
    abc_from_rotation,
    quaternion_from_rotation,
    rotation_from_abc,
    rotation_from_quaternion,
)
from respot.issues import Issue
from respot.program.frames import Frame
from respot.program.moves import Move
from respot.program.robot import Robot
from respot.program.targets import Target, TargetKind
from respot.spots import SpotTable
from respot.tables import Table

#: Names of the pose in a record.
_POSE = ("x", "y", "z", "a", "b", "c", "q")
#: ABB's 9E9: the axis is not used.
_UNUSED = 8e9

#: Forms whose copies are compared without being asked for: a second or two.
MOST_FORMS = 4000

Record = dict[str, Any]


def inspect_robot(robot: Robot, spots: SpotTable) -> Record:
    """Record of a robot: name, programs, frames, and a target for every motion.

    Parameters
    ----------
    robot : Robot
        The robot.
    spots : SpotTable
        Its weld spots.
    """
    ids = {id(move.target): name for name, move in zip(spots.ids, spots.moves, strict=True)}
    moves = list(robot.moves())
    aimed = [(move, move.target) for move in moves if move.target is not None]
    return {
        "name": robot.name,
        "language": robot.language,
        "model": robot.machine.model,
        "root": robot.root,
        "facts": {
            name: {"value": fact.value, "path": fact.path, "line": fact.line}
            for name, fact in robot.machine.facts.items()
        },
        "programs": robot.programs,
        "frames": {
            "tools": [_frame(frame) for frame in robot.tools],
            "bases": [_frame(frame) for frame in robot.bases],
        },
        "spots": list(spots.ids),
        "targets": _targets(aimed, ids),
        "relative": [_relative(move) for move in moves if move.target is None and not move.unknown],
        "unresolved": [_unresolved(move) for move in moves if move.target is None and move.unknown],
    }


def form_issues(robot: Robot, every: bool = False) -> list[Issue]:
    """Say which copies of the fields of inline forms disagree.

    Parameters
    ----------
    robot : Robot
        The robot.
    every : bool
        Compare all forms, however many; without it a robot with more than `MOST_FORMS` is only said to have them.
    """
    if len(robot.forms) > MOST_FORMS and not every:
        message = (
            f"{robot.name}: the copies in {len(robot.forms)} inline forms were not compared; --forms compares them"
        )
        return [Issue("NOT_CHECKED", message)]
    return [issue for form in robot.forms for issue in form.disagreements()]


def inspect_table(table: Table) -> Record:
    """Record of a spot table: its spots as they will be compared, mm and degrees."""
    rows: list[Record] = [{"id": name, "line": line} for name, line in zip(table.ids, table.lines, strict=True)]
    if table.positions is not None:
        for row, position in zip(rows, table.positions.tolist(), strict=True):
            row.update(_position(position))
    if table.rotations is not None:
        abc, quaternion = abc_from_rotation(table.rotations), quaternion_from_rotation(table.rotations)
        for row, angles, numbers, known in zip(rows, abc.tolist(), quaternion.tolist(), table.oriented, strict=True):
            row.update(
                {**dict(zip("abc", angles, strict=True)), "q": numbers}
                if known
                else dict.fromkeys(("a", "b", "c", "q"))
            )
    return {"path": table.path, "columns": list(table.columns), "spots": rows}


def summary(record: Record) -> Record:
    """Counts of a record by program: what a person wants to see first.

    Returns
    -------
    dict
        ``programs``: for each program ``spots``, ``welds``, ``targets``, ``joints``, ``unresolved``, ``tools`` and
        ``bases``; frames that no motion uses are not among them.
    """
    programs: dict[str, Record] = {
        name: {"spots": 0, "targets": 0, "joints": 0, "unresolved": 0, "tools": [], "bases": []}
        for name in record["programs"]
    }
    seen: set[tuple[str, str, str]] = set()
    for target in record["targets"]:
        program = programs[target["program"]]
        program["joints" if target["joints"] is not None else "targets"] += 1
        spot = (target["program"], target["name"], str(target["spot_id"]))
        if target["spot_id"] is not None and spot not in seen:
            seen.add(spot)
            program["spots"] += 1
        for kind in ("tool", "base"):
            name = target[kind] or "?"
            if target["joints"] is None and name not in program[f"{kind}s"]:
                program[f"{kind}s"].append(name)
    for count in Counter(item["program"] for item in record["unresolved"]).items():
        programs[count[0]]["unresolved"] = count[1]
    return {"programs": programs}


def _frame(frame: Frame) -> Record:
    pose = frame.pose
    values: list[Any] = [None] * 7
    if pose is not None:
        abc = abc_from_rotation(pose.rotation).tolist()
        values = [*pose.translation.tolist(), *abc, quaternion_from_rotation(pose.rotation).tolist()]
    return {
        "name": frame.name,
        "label": frame.label,
        **dict(zip(_POSE, values, strict=True)),
        "unknown": frame.unknown,
        "path": frame.path,
        "line": frame.line,
    }


def _targets(aimed: Sequence[tuple[Move, Target]], ids: dict[int, str]) -> list[Record]:
    """Records of motions; all poses at once, since a large backup holds a hundred thousand."""
    own = _poses([target.components for _, target in aimed])
    in_world = _in_world(aimed, own)
    abc, quaternion = _orientations(own)
    world_quaternion = _orientations(in_world)[1]
    records = []
    for row, (move, target) in enumerate(aimed):
        known = own[0][row]
        pose = [*own[1][row].tolist(), *abc[row].tolist(), quaternion[row].tolist()] if known else [None] * 7
        world = {**_position(in_world[1][row]), "q": world_quaternion[row].tolist()} if in_world[0][row] else None
        part = {"part": _part(move)} if move.external_tcp and known else {}
        records.append(
            {
                **_described(move, target, ids.get(id(target))),
                **dict(zip(_POSE, pose, strict=True)),
                **_configured(target),
                **part,
                "world": world,
            }
        )
    return records


#: Which rows are known, their positions (n, 3) in mm, and their rotations.
_Poses = tuple[np.ndarray[Any, np.dtype[np.bool_]], np.ndarray[Any, np.dtype[np.float64]], Rotation]


def _poses(components: Sequence[Sequence[float]]) -> _Poses:
    known = np.array([bool(values) for values in components], dtype=bool)
    positions = np.zeros((len(components), 3))
    quaternions = np.tile([0.0, 0.0, 0.0, 1.0], (len(components), 1))
    for count, rotation in ((6, rotation_from_abc), (7, rotation_from_quaternion)):
        rows = [row for row, values in enumerate(components) if len(values) == count]
        if rows:
            numbers = np.array([components[row] for row in rows])
            positions[rows] = numbers[:, :3]
            quaternions[rows] = rotation(numbers[:, 3:]).as_quat()
    return known, positions, Rotation.from_quat(quaternions)


def _in_world(aimed: Sequence[tuple[Move, Target]], own: _Poses) -> _Poses:
    """Poses in the world, base by base."""
    known, positions, quaternions = np.zeros(len(aimed), dtype=bool), own[1].copy(), own[2].as_quat()
    by_base: dict[int, list[int]] = {}
    bases: dict[int, RigidTransform] = {}
    for row, (move, _) in enumerate(aimed):
        sure = own[0][row] and not move.unknown and not move.external_tcp
        if sure and move.base is not None and move.base.pose is not None:
            by_base.setdefault(id(move.base), []).append(row)
            bases[id(move.base)] = move.base.pose
    for key, rows in by_base.items():
        base = bases[key]
        known[rows] = True
        positions[rows] = base.apply(positions[rows])
        quaternions[rows] = (base.rotation * Rotation.from_quat(quaternions[rows])).as_quat()
    for row, (move, _) in enumerate(aimed):
        if known[row] and (move.tool_offset is not IDENTITY or move.offset is not None):  # P:{Z -60}, RelTool, Offs
            place = move.world
            known[row] = place is not None
            if place is not None:
                positions[row], quaternions[row] = place.translation, place.rotation.as_quat()
    return known, positions, Rotation.from_quat(quaternions)


def _orientations(poses: _Poses) -> tuple[Any, Any]:
    if not len(poses[0]):
        return np.zeros((0, 3)), np.zeros((0, 4))
    return abc_from_rotation(poses[2]), quaternion_from_rotation(poses[2])


def _part(move: Move) -> Record | None:
    """Pose of an external TCP's goal in the part frame."""
    pose = move.spot_pose
    if pose is None:
        return None
    return {**_position(pose.translation), "q": quaternion_from_rotation(pose.rotation).tolist()}


def _position(values: Iterable[float]) -> dict[str, float]:
    return {name: float(value) for name, value in zip("xyz", values, strict=True)}


def _described(move: Move, target: Target, spot_id: str | None) -> Record:
    return {
        "name": target.name,
        "spot_id": spot_id,
        "program": move.program,
        "routine": move.routine,
        "path": move.path,
        "line": move.line,
        "declared": {"path": target.path, "line": target.line},
        "kind": move.motion.value,
        "weld": move.weld,
        "tool": None if move.tool is None else str(move.tool),
        "base": None if move.base is None else str(move.base),
        "external_tcp": move.external_tcp,
        "offset": _shift(move),
        "load": None if move.load is None else move.load.name,
        "codes": list(move.codes),
        "doubt": _doubt(move, target),
    }


def _shift(move: Move) -> Record | None:
    """Shifts on top of the target: along the base, and in the target's own axes; None for a plain motion."""
    if move.offset is None and move.tool_offset is IDENTITY:
        return None
    base = None
    if move.offset is not None and move.offset.literal:
        base = [0.0 if number is None else float(number.value) for number in move.offset.numbers]
    tool = None
    if move.tool_offset is not None and move.tool_offset is not IDENTITY:
        tool = {
            **_position(move.tool_offset.translation),
            "q": quaternion_from_rotation(move.tool_offset.rotation).tolist(),
        }
    return {"base": base, "tool": tool}


def _doubt(move: Move, target: Target) -> str | None:
    """Why the place of a target is not known, or None."""
    if target.kind is TargetKind.JOINTS:
        return None
    if move.unknown or target.unknown:
        return move.unknown or target.unknown
    told = next((doubt.text for doubt in move.doubts if doubt.code != "UNKNOWN_TOOL"), None)
    if told is not None or (move.tool_offset is not None and move.base2spots is not None):
        return told
    if move.base2spots is None:
        return "the program does not tell the base" if move.base is None else f"{move.base}: {move.base.unknown}"
    return "what shifts the target along the tool is computed while the robot runs"


def _configured(target: Target) -> Record:
    """Joints, external axes, status and turn or confdata of a target."""
    numbers = {name.lower(): float(number.value) for name, number in target.numbers.items()}
    joints = target.kind is TargetKind.JOINTS
    return {
        "joints": {name: value for name, value in numbers.items() if name.startswith(("a", "rax"))} if joints else None,
        "external_axes": {
            name: value
            for name, value in numbers.items()
            if name[0] == "e" and name[1:2] in "123456ax" and abs(value) < _UNUSED
        },
        "status": _whole(numbers.get("s")),
        "turn": _whole(numbers.get("t")),
        "confdata": [_whole(numbers[name]) for name in ("cf1", "cf4", "cf6", "cfx")] if "cf1" in numbers else None,
    }


def _relative(move: Move) -> Record:
    """A motion away from the last position, or to joints that the backup does not hold."""
    return {**_motion(move), "offset": _shift(move)}


def _unresolved(move: Move) -> Record:
    """A motion whose goal is not known before the robot runs."""
    return {**_motion(move), "reason": move.unknown}


def _motion(move: Move) -> Record:
    return {
        "instruction": move.instruction,
        "program": move.program,
        "routine": move.routine,
        "path": move.path,
        "line": move.line,
        "codes": list(move.codes),
    }


def _whole(value: float | None) -> int | None:
    return None if value is None else int(value)
