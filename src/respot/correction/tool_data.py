"""Whether a fitted tool offset goes into the data of the tool or into the points, and what a person is told of it.

All frames of the fitted tool change, or none: one literal cannot be right for a tool that changed and one that did not.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

from scipy.spatial.transform import RigidTransform

from respot.correction.changeable import Changeable
from respot.correction.image import Direction
from respot.correction.scope import Scope
from respot.geometry import Array
from respot.issues import BadInputError, Issue
from respot.program.frames import Frame


@dataclass(frozen=True, eq=False)
class ToolData:
    """What becomes of the data of tools.

    Parameters
    ----------
    changes : mapping of int to RigidTransform
        What each gets on the right, N' = N d, by `id` of the tool; none where the offset goes into the points.
    issues : sequence of Issue
        Where the offset is written, and why not in the tool.
    """

    changes: Mapping[int, RigidTransform] = field(default_factory=dict)
    issues: Sequence[Issue] = ()


def tool_data(
    offset: Array,
    tools: Sequence[Frame],
    scope: Scope,
    changeable: Changeable | None,
    *,
    inverse: bool,
    in_tool: bool | None,
) -> ToolData:
    """Decide where a fitted offset goes.

    Parameters
    ----------
    offset : (3,) array
        Along the axes of the tool [mm].
    tools : sequence of Frame
        All frames that are the fitted tool.
    scope : Scope
        What moves.
    changeable : Changeable or None
        Which frames may be changed; None for depth `points`.
    inverse : bool
        The offset is taken out again.
    in_tool : bool or None
        Whether it stands in the tool's data then; None where nothing says.

    Raises
    ------
    BadInputError
        ``BAD_OPTION``: it stands in the data of a tool that must stay as it is now.
    """
    if changeable is None or not tools:
        return ToolData()
    first = tools[0]
    reason = next(filter(None, (changeable.objection(tool, "tool") for tool in tools)), "")
    reason = reason or _with_others(scope, {id(tool) for tool in tools})
    if reason and in_tool:
        message = f"the tool offset of this calibration stands in {first} and cannot be taken out: {reason}"
        raise BadInputError("BAD_OPTION", message, first.path, first.line)
    if in_tool is False:
        reason = "there it was written before"
    if reason:
        message = f"{first} stays as it is, and its error goes into the points: {reason}"
        return ToolData(issues=[Issue("FRAME_KEPT", message, first.path, first.line)])
    change = RigidTransform.from_translation(-offset if inverse else offset)
    return ToolData({id(tool): change for tool in tools})


def said_of_tool(offset: Array, tools: Sequence[Frame], data: ToolData, direction: Direction, kind: str) -> Issue:
    """Say where an offset (3,) [mm] is written, and what a person must not do."""
    x, y, z = offset.tolist()
    what = f"tool_offset {x:+.2f} {y:+.2f} {z:+.2f} mm"
    names = ", ".join(dict.fromkeys(map(str, tools))) or "the tool"
    if data.changes:
        message = f"{what} is written into {names}: points keep what they say of the tip"
    elif direction == "compensate":
        message = (
            f"{what} is written into the points: leave the TCP in the tool data as it is. Correct the tool or the "
            "points, never both"
        )
    elif kind == "theory":
        message = (
            f"{what}: the points are those of a tip that is where its data say, and {names} of this backup is not: the "
            "simulation must bring its own tool"
        )
    else:
        message = f"{what} is taken out of the points"
    return Issue("EFFECT_WRITTEN", message)


def _with_others(scope: Scope, tools: Collection[int]) -> str:
    """Say which target is gone to with one of the tools and with another one."""
    for item in scope.moving:
        used = {id(move.tool) for move in item.moves}
        if not used.isdisjoint(tools) and not used <= set(tools):
            return f"{item.target.name} is used with another tool as well"
    return ""
