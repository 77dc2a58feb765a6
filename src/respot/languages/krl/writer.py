"""What KRL literals become when their target moves, and where the header of a changed file stands."""

from __future__ import annotations

from scipy.spatial.transform import RigidTransform

from respot.geometry import abc_from_rotation
from respot.languages.writing import header_span
from respot.program.robot import ProgramFile
from respot.program.targets import Target
from respot.source import Span
from respot.tolerance import ANGLE_DECIMALS, LENGTH_DECIMALS

_LENGTHS = dict.fromkeys("XYZ", LENGTH_DECIMALS)
_ANGLES = dict.fromkeys("ABC", ANGLE_DECIMALS)
DECIMALS = {**_LENGTHS, **_ANGLES, "S": 0, "T": 0}
_HEADS = ("routine", "function", "data_list")


def pose_values(target: Target, pose: RigidTransform) -> dict[str, float]:
    """New values of a target's fields, for ``pose`` in its base: X, Y, Z in mm, A, B, C in degrees."""
    values = [*pose.translation, *abc_from_rotation(pose.rotation)]
    return {name: float(value) for name, value in zip("XYZABC", values, strict=True) if name in target.numbers}


def has_configuration(target: Target) -> bool:
    """Whether the target carries status and turn."""
    return "S" in target.fields or "T" in target.fields


def header_place(file: ProgramFile) -> Span | None:
    """Where the header goes or stands: below the first DEF, DEFFCT or DEFDAT; None where there is none."""
    head = next((statement for statement in file.statements if statement.kind in _HEADS), None)
    return None if head is None else header_span(file.source, head.line)
