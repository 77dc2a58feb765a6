"""Depth `points`: every moved target gets the numbers of its new pose, in its own base.

With G = source2reference and B = base2world, the TCP must come to G B T; the target becomes T' = B^-1 G B T. An offset
d along the base becomes R(B)^-1 R(G) R(B) d, so that B (T' + d') = G B (T + d). With an external TCP the spots are
compared in the part frame, in which the targets are programmed: B is one, and T' = G T (DESIGN section 5, P' = D P).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.spatial.transform import RigidTransform

from respot.correction.scope import Moving
from respot.geometry import Array, distance_mm, rotation_from_abc, rotation_from_quaternion, turn_deg
from respot.languages import Language
from respot.languages.writing import Change, Templates, changes_of, finest
from respot.program.moves import BaseOffset, Move
from respot.program.targets import Target
from respot.source import Edit
from respot.tolerance import LENGTH_DECIMALS, SAME_POSITION_MM, SAME_ROTATION_DEG, NumberStyle, spell


@dataclass(frozen=True, eq=False)
class PointEdit:
    """A changed literal.

    Parameters
    ----------
    path : str
        File.
    line : int
        Line of the literal.
    target : str
        Name of the target, or of the motion whose offset turns.
    programs : frozenset of str
        Programs that use it.
    edit : Edit
        The change.
    before, after : str
        Text of the literal.
    intended : mapping of str to float
        Value that each changed field must have, before rounding.
    shift_mm, turn_deg : float
        How far the TCP moves in the world; of a tool or base the farthest of its targets.
    depth : str
        ``point``, or ``base`` and ``tool`` of a literal that is one.
    """

    path: str
    line: int
    target: str
    programs: frozenset[str]
    edit: Edit
    before: str
    after: str
    intended: Mapping[str, float]
    shift_mm: float
    turn_deg: float
    depth: Literal["point", "base", "tool"] = "point"


def in_base(base: RigidTransform, source2reference: RigidTransform) -> RigidTransform:
    """Return the correction seen in a base: B^-1 G B."""
    return base.inv() * source2reference * base


def moves_at_all(before: RigidTransform, after: RigidTransform) -> bool:
    """Whether two poses differ by more than numerical noise."""
    same_place = float(distance_mm(before, after)) <= SAME_POSITION_MM
    return not (same_place and float(turn_deg(before, after)) <= SAME_ROTATION_DEG)


def new_pose(moving: Moving, source2reference: RigidTransform) -> RigidTransform:
    """Return the new ``target2base`` of a target."""
    assert moving.target.pose is not None  # noqa: S101 - scope refuses it
    return in_base(moving.base2spots, source2reference) * moving.target.pose


def printed_pose(target: Target, after: RigidTransform, text: str, language: Language) -> RigidTransform:
    """Pose that the robot reads once ``after`` is written with the digits that the literal gets."""
    values = language.pose_values(target, after)
    decimals, read = language.decimals(target), {}
    for name, value in values.items():
        style = NumberStyle.of(text[slice(*target.numbers[name].span)]).at_least(decimals[name])
        read[name] = float(spell(value, style))
    numbers = list(read.values())
    if len(numbers) not in (6, 7):
        return after
    rotation = rotation_from_quaternion(numbers[3:]) if len(numbers) == 7 else rotation_from_abc(numbers[3:])
    return RigidTransform.from_components(numbers[:3], rotation)


def point_edit(
    moving: Moving,
    after: RigidTransform,
    configuration: Mapping[str, float],
    text: str,
    language: Language,
    templates: Templates,
) -> PointEdit | None:
    """Edit of a target; None where its literal already says the new pose to the last digit.

    Parameters
    ----------
    moving : Moving
        The target.
    after : RigidTransform
        Its new pose in its base.
    configuration : mapping of str to float
        New values of status and turn or confdata.
    text : str
        Its file.
    language, templates :
        How it is written.
    """
    target = moving.target
    assert target.pose is not None  # noqa: S101
    # only its configuration may change where a base or tool takes it along
    moves = moves_at_all(target.pose, after)
    values = {**(language.pose_values(target, after) if moves else {}), **configuration}
    changes = changes_of(text, target.numbers, values, language.decimals(target))
    if not changes:
        return None
    replacement = templates.literal(text, target.span, changes)
    return PointEdit(
        path=target.path,
        line=target.line,
        target=target.name,
        programs=frozenset(moving.programs),
        edit=Edit(target.span, replacement, "point"),
        before=text[slice(*target.span)],
        after=replacement,
        intended=values,
        shift_mm=float(distance_mm(target.pose, after)) if moves else 0.0,
        turn_deg=float(turn_deg(target.pose, after)) if moves else 0.0,
    )


def new_offset(offset: BaseOffset, base: RigidTransform, source2reference: RigidTransform) -> Array:
    """Return the new components (3,) of an offset along the base, mm."""
    old = np.array([0.0 if number is None else float(number.value) for number in offset.numbers])
    return np.asarray(in_base(base, source2reference).rotation.apply(old))


def offset_edit(move: Move, values: Array, text: str, templates: Templates) -> PointEdit | None:
    """Edit of an offset along the base; None where nothing changes to the last digit."""
    offset = move.offset
    assert offset is not None  # noqa: S101
    old = np.array([0.0 if number is None else float(number.value) for number in offset.numbers])
    if float(np.linalg.norm(values - old)) <= SAME_POSITION_MM:
        return None
    named = dict(zip("xyz", values, strict=True))
    numbers = {name: number for name, number in zip("xyz", offset.numbers, strict=True) if number is not None}
    decimals = finest(numbers.values(), LENGTH_DECIMALS)
    present = {name: float(named[name]) for name in numbers}
    changes: list[Change] = list(changes_of(text, numbers, present, dict.fromkeys("xyz", decimals)))
    missing = {name: float(value) for name, value in named.items() if name not in numbers}
    style = NumberStyle(decimals)
    missing = {name: value for name, value in missing.items() if abs(value) >= style.half_digit}
    if not changes and not missing:
        return None
    replacement = templates.literal(text, offset.span, changes)
    if missing:
        replacement = templates.complete(replacement, missing, style)
    return PointEdit(
        path=offset.path,
        line=offset.line,
        target=f"{move.instruction}@{move.line}",
        programs=frozenset((move.program,)),
        edit=Edit(offset.span, replacement, "offset"),
        before=text[slice(*offset.span)],
        after=replacement,
        intended={name: float(value) for name, value in named.items()},
        shift_mm=float(np.linalg.norm(values - old)),
        turn_deg=0.0,
    )
