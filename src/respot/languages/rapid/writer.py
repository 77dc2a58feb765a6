"""What RAPID literals become when their target moves, and where the header of a changed file stands."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import RigidTransform

from respot.geometry import quaternion_from_rotation
from respot.languages.writing import finest, header_span
from respot.program.robot import ProgramFile
from respot.program.targets import Target
from respot.source import Span
from respot.tolerance import (
    FRAME_LENGTH_DECIMALS,
    FRAME_QUATERNION_DECIMALS,
    LENGTH_DECIMALS,
    QUATERNION_DECIMALS,
)

_POSITION = ("x", "y", "z")
_QUATERNION = ("q1", "q2", "q3", "q4")
_LEAST = ((_POSITION, LENGTH_DECIMALS), (_QUATERNION, QUATERNION_DECIMALS))
_CONFIGURATION = dict.fromkeys(("cf1", "cf4", "cf6", "cfx"), 0)
FRAME_DECIMALS = {
    **dict.fromkeys(_POSITION, FRAME_LENGTH_DECIMALS),
    **dict.fromkeys(_QUATERNION, FRAME_QUATERNION_DECIMALS),
}


def decimals(target: Target) -> dict[str, int]:
    """Decimals that each field gets at least when it changes."""
    found = dict(_CONFIGURATION)
    for names, least in _LEAST:
        found.update(dict.fromkeys(names, finest([target.numbers[name] for name in names], least)))
    return found


def pose_values(targets: Sequence[Target], poses: RigidTransform) -> list[dict[str, float]]:
    """New values of the fields of n targets that have a pose, for poses in their work objects.

    x, y, z in mm, q1 to q4 near the old ones.
    """
    old = np.array([target.components[3:] for target in targets])
    rows = np.hstack([poses.translation, quaternion_from_rotation(poses.rotation, near=old)]).tolist()
    return [dict(zip(_POSITION + _QUATERNION, row, strict=True)) for row in rows]


def has_configuration(target: Target) -> bool:
    """Whether the target carries confdata; a robtarget always does."""
    return "cf1" in target.fields


def header_place(file: ProgramFile) -> Span | None:
    """Where the header goes or stands: below MODULE; None in a fragment without one."""
    head = next((statement for statement in file.statements if statement.kind == "module"), None)
    if head is None:
        return None
    line = file.source.place(head.end)[0]
    for statement in file.statements:
        # a declaration may begin behind MODULE and go on: no comment into its middle
        if statement.line <= line < file.source.place(statement.end)[0]:
            line = file.source.place(statement.end)[0]
    return header_span(file.source, line)
