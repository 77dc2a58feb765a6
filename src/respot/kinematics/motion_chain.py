"""The kinematic chain of a motion: what the robot holds, what stands in the world, where its foot is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import RigidTransform

from respot.geometry import Array, batch, orthogonal, replaced
from respot.kinematics.cell import Reason, RobotCell
from respot.program.moves import Move
from respot.program.targets import Target

#: External axes as the languages name them.
EXTERNAL = {"krl": ("E1", "E2", "E3", "E4", "E5", "E6"), "rapid": tuple(f"eax_{letter}" for letter in "abcdef")}
_NO_TRACK = Reason("CONFIG_NOT_CHECKED", "the robot stands on an external axis: where its base is, is not known")
#: ABB's 9E9: the axis is not used.
_UNUSED = 8e9


@dataclass(frozen=True, eq=False)
class Chain:
    """What `RobotCell.flange2base` needs, for one motion or n.

    Parameters
    ----------
    tool2world, tool2flange : RigidTransform
        The tool held: TCP in the world and on the flange. An external TCP: the gun, and the target on the flange.
    external : Array
        External axes, shape (6,) or (n, 6); NaN where the target does not give them.
    """

    tool2world: RigidTransform
    tool2flange: RigidTransform
    external: Array

    def rows(self, rows: Sequence[int]) -> Chain:
        """Return the chain of some of n motions."""
        return Chain(self.tool2world[rows], self.tool2flange[rows], self.external[rows])


def chains_of(
    cell: RobotCell, moves: Sequence[Move], targets: Sequence[Target], poses: Sequence[RigidTransform]
) -> tuple[list[Reason | None], list[Chain]]:
    """Chains of n motions to targets, and what is not known of them.

    KUKA's #TCP: $BASE is the gun in the world, $TOOL the part on the flange (facts: krl.md 5). ABB: the gun is the
    tool, the part the work object (rapid.md 2.4).

    Parameters
    ----------
    cell : RobotCell
    moves, targets : sequences of n
    poses : sequence of RigidTransform
        Batches of n: where the targets may lie in their bases.

    Returns
    -------
    (list of Reason or None, list of Chain)
        What is not known of each motion; and for each of ``poses`` the chain of the m motions of which all is known,
        empty where m is 0.
    """
    external = external_axes(cell, targets)
    on_rail = np.ones(len(moves), dtype=bool)
    if cell.on_track:
        on_rail = np.isfinite(external[:, cell.track.axis]) if cell.track is not None else ~on_rail
    frames: dict[tuple[int, int], Reason | None] = {}
    reasons: list[Reason | None] = []
    for row, move in enumerate(moves):
        key = (id(move.tool), id(move.base))
        if key not in frames:
            frames[key] = _unknown_frame(move)
        reasons.append(frames[key] or (None if on_rail[row] else _NO_TRACK))
    rows = [row for row, reason in enumerate(reasons) if reason is None]
    if not rows:
        return reasons, []
    held = [at for at, row in enumerate(rows) if moves[row].external_tcp]
    pairs = [_carrying(moves[row]) for row in rows]
    fronts, others = (batch([pair[side] for pair in pairs]) for side in (0, 1))
    chains = []
    for each in poses:
        there, tool = fronts * each[rows], others
        if held:
            there, tool = replaced(there, held, others[held]), replaced(tool, held, there[held])
        chains.append(Chain(orthogonal(there), orthogonal(tool), external[rows]))
    return reasons, chains


def _unknown_frame(move: Move) -> Reason | None:
    """Which frame of a motion is not known, and why."""
    for frame, code in ((move.tool, "UNKNOWN_TOOL"), (move.base, "UNKNOWN_FRAME")):
        if frame is None or frame.pose is None:
            what = "the tool" if code == "UNKNOWN_TOOL" else "the base"
            return Reason(code, f"{what}: {'the program does not tell it' if frame is None else frame.unknown}")
    return None


def _carrying(move: Move) -> tuple[RigidTransform, RigidTransform]:
    """Return the frame that the target is seen from, and the other one: base and tool, or part and gun."""
    assert move.tool is not None and move.base is not None  # noqa: S101 - just seen
    tool, base = move.tool.pose, move.base.pose
    assert tool is not None and base is not None  # noqa: S101
    if not move.external_tcp:
        return base, tool
    return (base, tool) if move.base.held else (tool, base)


def external_axes(cell: RobotCell, targets: Sequence[Target]) -> Array:
    """External axes of n targets, shape (n, 6), NaN where a target does not give them."""
    names = EXTERNAL[cell.language]
    rows = [[target.number(name) for name in names] for target in targets]
    numbers = np.array(rows, dtype=float).reshape(-1, len(names))  # None becomes NaN
    return np.where(np.abs(numbers) > _UNUSED, np.nan, numbers)


def standing(cell: RobotCell, chain: Chain) -> RobotCell:
    """Cell with its foot where the chain's external axes put it."""
    return cell.at(chain.external) if cell.on_track else cell
