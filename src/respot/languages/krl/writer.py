"""What KRL literals become when their target moves, and where the header of a changed file stands."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, radians

import numpy as np
from scipy.spatial.transform import RigidTransform

from respot.geometry import abc_from_rotation
from respot.languages.writing import finest, header_span
from respot.program.robot import ProgramFile
from respot.program.targets import Target
from respot.source import Span
from respot.tolerance import ANGLE_DECIMALS, FRAME_ANGLE_DECIMALS, FRAME_LENGTH_DECIMALS, LENGTH_DECIMALS, STEEP

FRAME_DECIMALS = {**dict.fromkeys("XYZ", FRAME_LENGTH_DECIMALS), **dict.fromkeys("ABC", FRAME_ANGLE_DECIMALS)}
_HEADS = ("routine", "function", "data_list")


def decimals(target: Target) -> dict[str, int]:
    """Decimals that each field gets at least when it changes."""
    cosine = abs(cos(radians(target.components[4]))) if target.components else 1.0
    angle = ANGLE_DECIMALS + sum(cosine < limit for limit in STEEP)
    found = {"S": 0, "T": 0}
    for names, least in (("XYZ", LENGTH_DECIMALS), ("ABC", angle)):
        own = [number for name in names if (number := target.numbers.get(name)) is not None]
        found.update(dict.fromkeys(names, finest(own, least)))
    return found


def pose_values(targets: Sequence[Target], poses: RigidTransform) -> list[dict[str, float]]:
    """New values of the fields of n targets that have a pose, for poses in their bases.

    X, Y, Z in mm, A, B, C in degrees near the old.
    """
    old = np.array([target.components[3:] for target in targets])
    rows = np.hstack([poses.translation, abc_from_rotation(poses.rotation, near=old)]).tolist()
    return [dict(zip("XYZABC", row, strict=True)) for row in rows]


def has_configuration(target: Target) -> bool:
    """Whether the target carries status and turn."""
    return "S" in target.fields or "T" in target.fields


def header_place(file: ProgramFile) -> Span | None:
    """Where the header goes or stands: below the first DEF, DEFFCT or DEFDAT; None where there is none."""
    head = next((statement for statement in file.statements if statement.kind in _HEADS), None)
    return None if head is None else header_span(file.source, head.line)
