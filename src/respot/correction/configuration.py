"""Status and turn or confdata of moved targets, from the robot's kinematic model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import RigidTransform

from respot.correction.scope import Moving
from respot.kinematics.cell import Reason, RobotCell
from respot.kinematics.configuration import reconfigure
from respot.kinematics.motion_chain import Chain, chains_of, standing
from respot.languages import Language
from respot.program.moves import Move
from respot.program.poses import target_poses


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


#: Uses that are computed at once: the trials of full turns take 5 kB each.
_AT_ONCE = 4096


@dataclass(frozen=True, eq=False)
class _Use:
    """A target with one of the tools it is used with: where in the list it stands, and its old numbers."""

    index: int
    move: Move
    numbers: Sequence[float]


def configure(
    cell: RobotCell | Reason, language: Language, moving: Sequence[Moving], after: RigidTransform
) -> list[Configured]:
    """Configuration of n > 0 moved targets: the solution nearest the joints that the old values define.

    See DESIGN section 5.

    Parameters
    ----------
    cell : RobotCell or Reason
        The robot, or why it has no model.
    language : Language
        Its language.
    moving : sequence of n Moving
        The targets.
    after : RigidTransform
        New poses of the n in their bases, as they will be printed.
    """
    if isinstance(cell, Reason):
        return [Configured(code=cell.code, message=cell.message)] * len(moving)
    found: list[Configured | None] = [None] * len(moving)
    uses: list[_Use] = []
    for index, item in enumerate(moving):
        numbers = [item.target.number(name) for name in language.configuration_fields]
        if any(number is None for number in numbers):
            found[index] = Configured(code="CONFIG_INCONSISTENT", message=_missing(language, numbers))
            continue
        first: dict[int, Move] = {}
        for move in item.moves:
            first.setdefault(id(move.tool), move)
        uses += [_Use(index, move, [number for number in numbers if number is not None]) for move in first.values()]
    before = target_poses([item.target for item in moving])
    for start in range(0, len(uses), _AT_ONCE):
        _add(found, cell, language, moving, uses[start : start + _AT_ONCE], (before, after))
    return [item if item is not None else Configured() for item in found]


def _missing(language: Language, numbers: Sequence[float | None]) -> str:
    names = zip(language.configuration_fields, numbers, strict=True)
    return f"the target has no {', '.join(name for name, number in names if number is None)}"


def _add(
    found: list[Configured | None],
    cell: RobotCell,
    language: Language,
    moving: Sequence[Moving],
    uses: Sequence[_Use],
    poses: Sequence[RigidTransform],
) -> None:
    """Add what some uses come to."""
    index = [use.index for use in uses]
    targets = [moving[use.index].target for use in uses]
    reasons, chains = chains_of(cell, [use.move for use in uses], targets, [each[index] for each in poses])
    for use, reason in zip(uses, reasons, strict=True):
        if reason is not None:
            message = f"status/turn or confdata need the whole chain: {reason.message}"
            found[use.index] = _both(found[use.index], Configured(code=reason.code, message=message))
    if chains:
        known = [use for use, reason in zip(uses, reasons, strict=True) if reason is None]
        for use, result in zip(known, _reconfigured(cell, language, known, *chains), strict=True):
            found[use.index] = _both(found[use.index], result)


def _reconfigured(
    cell: RobotCell, language: Language, uses: Sequence[_Use], before: Chain, after: Chain
) -> list[Configured]:
    """One call for all."""
    old = np.array([use.numbers for use in uses])
    placed = standing(cell, before)
    result = reconfigure(placed, before.tool2flange, before.tool2world, after.tool2world, old, after.tool2flange)
    return [
        Configured(code=reason.code, message=reason.message)
        if reason is not None
        else Configured({name: float(value) for name, value in zip(language.configuration_fields, row, strict=True)})
        for reason, row in zip(result.reasons, result.configuration.tolist(), strict=True)
    ]


def _both(first: Configured | None, second: Configured) -> Configured:
    """Return what a target gets that is used with several tools."""
    if first is None or first.code:
        return second if first is None else first
    if second.code or second.values == first.values:
        return second
    message = "the target is used with several tools, which need different status/turn or confdata"
    return Configured(code="CONFIG_INCONSISTENT", message=message)
