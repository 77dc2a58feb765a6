"""Depth `points`: every moved target gets the numbers of its new pose, in its own base.

With G = source2reference and B = base2world, the TCP must come to G B T; the target becomes T' = B^-1 G B T. An offset
d along the base becomes R(B)^-1 R(G) R(B) d, so that B (T' + d') = G B (T + d). With an external TCP the spots are
compared in the part frame, in which the targets are programmed: B is one, and T' = G T (DESIGN section 5, P' = D P).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from respot.correction.scope import Moving
from respot.geometry import Array, batch, distance_mm, pose, rotation_from_abc, rotation_from_quaternion, turn_deg
from respot.languages import Language
from respot.languages.writing import Change, Templates, changes_of, finest
from respot.program.moves import BaseOffset, Move
from respot.program.poses import target_poses
from respot.program.robot import ProgramFile
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
    return bool(move_at_all(before, after))


def move_at_all(before: RigidTransform, after: RigidTransform) -> NDArray[np.bool_]:
    """Whether n poses (n,) differ from n others by more than numerical noise."""
    same_place = distance_mm(before, after) <= SAME_POSITION_MM
    return np.asarray(~(same_place & (turn_deg(before, after) <= SAME_ROTATION_DEG)))


def new_poses(moving: Sequence[Moving], source2reference: RigidTransform) -> RigidTransform:
    """Return the new ``target2base`` of n > 0 targets."""
    bases = {id(item.base2spots): item.base2spots for item in moving}
    turned = {key: in_base(base, source2reference) for key, base in bases.items()}
    return batch([turned[id(item.base2spots)] for item in moving]) * target_poses([item.target for item in moving])


def printed_poses(
    targets: Sequence[Target], after: RigidTransform, files: Mapping[str, ProgramFile], language: Language
) -> RigidTransform:
    """Poses that the robot reads once n new ones are written with the digits that their literals get."""
    rows = []
    for target, values in zip(targets, language.pose_values(targets, after), strict=True):
        text, decimals = files[target.path].source.text, language.decimals(target)
        spans = {name: target.numbers[name].span for name in values}
        styles = {name: NumberStyle.changed(text[slice(*span)], decimals[name]) for name, span in spans.items()}
        rows.append([float(spell(value, styles[name])) for name, value in values.items()])
    numbers = np.array(rows)
    turned = rotation_from_quaternion if numbers.shape[1] == 7 else rotation_from_abc
    return pose(numbers[:, :3], turned(numbers[:, 3:]))


def point_edits(
    moving: Sequence[Moving],
    after: RigidTransform,
    configured: Mapping[int, Mapping[str, float]],
    files: Mapping[str, ProgramFile],
    language: Language,
    templates: Templates,
) -> Iterator[PointEdit]:
    """Edits of n targets; none of one whose literal already says the new pose to the last digit.

    Parameters
    ----------
    moving : sequence of Moving
        The targets.
    after : RigidTransform
        Their new poses in their bases.
    configured : mapping of int to mapping of str to float
        New values of status and turn or confdata, by `id` of what moves.
    files : mapping of str to ProgramFile
        Their files.
    language, templates :
        How they are written.
    """
    if not moving:
        return
    targets = [item.target for item in moving]
    before = target_poses(targets)
    # only its configuration may change where a base or tool takes it along
    moves, shifts, turns = move_at_all(before, after), distance_mm(before, after), turn_deg(before, after)
    poses = language.pose_values(targets, after)
    for row, (item, target) in enumerate(zip(moving, targets, strict=True)):
        values = {**(poses[row] if moves[row] else {}), **configured.get(id(item), {})}
        text = files[target.path].source.text
        changes = changes_of(text, target.numbers, values, language.decimals(target))
        if not changes:
            continue
        replacement = templates.literal(text, target.span, changes)
        yield PointEdit(
            path=target.path,
            line=target.line,
            target=target.name,
            programs=frozenset(item.programs),
            edit=Edit(target.span, replacement, "point"),
            before=text[slice(*target.span)],
            after=replacement,
            intended=values,
            shift_mm=float(shifts[row]) if moves[row] else 0.0,
            turn_deg=float(turns[row]) if moves[row] else 0.0,
        )


def new_offset(offset: BaseOffset, base: RigidTransform, source2reference: RigidTransform) -> Array:
    """Return the new components (3,) of an offset along the base, mm."""
    old = np.array([0.0 if number is None else float(number.value) for number in offset.numbers])
    return np.asarray(_turn_in_base(base, source2reference).apply(old))


@lru_cache(maxsize=256)
def _turn_in_base(base: RigidTransform, source2reference: RigidTransform) -> Rotation:
    """Rotation of a correction seen in a base; thousands of motions share a base."""
    return in_base(base, source2reference).rotation


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
