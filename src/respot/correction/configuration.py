"""Status and turn or confdata of moved targets, from the robot's kinematic model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import RigidTransform

from respot.correction.scope import Moving
from respot.kinematics.cell import Reason, RobotCell
from respot.kinematics.configuration import reconfigure
from respot.kinematics.motion_chain import Chain, chain_of, stacked, standing
from respot.languages import Language
from respot.program.moves import Move


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


@dataclass(frozen=True, eq=False)
class _Use:
    """A target with one of the tools it is used with: where in the list it stands, its old numbers, its chains."""

    index: int
    numbers: Sequence[float]
    before: Chain
    after: Chain


def configure(
    cell: RobotCell | Reason, language: Language, moving: Sequence[Moving], after: Sequence[RigidTransform]
) -> list[Configured]:
    """Configuration of moved targets: the solution nearest the joints that the old values define (DESIGN section 5).

    Parameters
    ----------
    cell : RobotCell or Reason
        The robot, or why it has no model.
    language : Language
        Its language.
    moving : sequence of Moving
        The targets.
    after : sequence of RigidTransform
        New pose of each in its base, as it will be printed.
    """
    if isinstance(cell, Reason):
        return [Configured(code=cell.code, message=cell.message)] * len(moving)
    found: list[Configured | None] = [None] * len(moving)
    uses: list[_Use] = []
    for index, (item, pose) in enumerate(zip(moving, after, strict=True)):
        made = _uses(cell, language, index, item, pose)
        if isinstance(made, Configured):
            found[index] = made
        else:
            uses += made
    for use, result in zip(uses, _reconfigured(cell, language, uses), strict=True):
        found[use.index] = _both(found[use.index], result)
    return [item if item is not None else Configured() for item in found]


def _uses(
    cell: RobotCell, language: Language, index: int, moving: Moving, after: RigidTransform
) -> list[_Use] | Configured:
    """The target with each of its tools."""
    fields = language.configuration_fields
    numbers = [moving.target.number(name) for name in fields]
    if any(number is None for number in numbers):
        missing = ", ".join(name for name, number in zip(fields, numbers, strict=True) if number is None)
        return Configured(code="CONFIG_INCONSISTENT", message=f"the target has no {missing}")
    first: dict[int, Move] = {}
    for move in moving.moves:
        first.setdefault(id(move.tool), move)
    old = moving.target.pose
    assert old is not None  # noqa: S101 - scope refuses it
    uses = []
    for move in first.values():
        chains = [chain_of(cell, move, moving.target, pose) for pose in (old, after)]
        for chain in chains:
            if isinstance(chain, Reason):
                message = f"status/turn or confdata need the whole chain: {chain.message}"
                return Configured(code=chain.code, message=message)
        before, new = (chain for chain in chains if isinstance(chain, Chain))
        uses.append(_Use(index, [float(number) for number in numbers if number is not None], before, new))
    return uses


def _reconfigured(cell: RobotCell, language: Language, uses: Sequence[_Use]) -> list[Configured]:
    """One call for all."""
    if not uses:
        return []
    before, after = stacked([use.before for use in uses]), stacked([use.after for use in uses])
    old = np.array([use.numbers for use in uses])
    placed = standing(cell, before)
    result = reconfigure(placed, before.tool2flange, before.tool2world, after.tool2world, old, after.tool2flange)
    return [
        Configured(code=reason.code, message=reason.message)
        if reason is not None
        else Configured({name: float(value) for name, value in zip(language.configuration_fields, row, strict=True)})
        for reason, row in zip(result.reasons, result.configuration, strict=True)
    ]


def _both(first: Configured | None, second: Configured) -> Configured:
    """Return what a target gets that is used with several tools."""
    if first is None or first.code:
        return second if first is None else first
    if second.code or second.values == first.values:
        return second
    message = "the target is used with several tools, which need different status/turn or confdata"
    return Configured(code="CONFIG_INCONSISTENT", message=message)
