"""Joints of motions as their programs run, and from which side each axis comes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from respot.correction.goals import literal
from respot.correction.joints import Places
from respot.correction.pose_table import PoseTable
from respot.correction.sequence import goes_somewhere, sequences
from respot.geometry import Array
from respot.kinematics.cell import RobotCell
from respot.kinematics.opw import OpwRobot
from respot.languages import Language
from respot.program.moves import Move
from respot.program.robot import Robot, Routine
from respot.tolerance import AXIS_MOVES_DEG


@dataclass(frozen=True, eq=False)
class Runs:
    """How the arm stands at every motion of some routines.

    Parameters
    ----------
    joints : mapping of int to (6,) array
        By `id` of the motion [deg].
    sides : mapping of int to (6,) array
        Sign of the last motion of each axis; NaN where the program does not tell it, or different callers differ.
    likely : mapping of int to (6,) array
        The same, with the side on the first way that leads to it where they differ, and that of the next motion where
        none tells it: for places where nothing is welded.
    unknown : mapping of int to str
        Why the joints of a motion are not known.
    """

    joints: dict[int, Array]
    sides: dict[int, Array]
    likely: dict[int, Array]
    unknown: dict[int, str]


def runs_of(cell: RobotCell, model: OpwRobot, robot: Robot, language: Language, routines: Sequence[Routine]) -> Runs:
    """Follow the motions of routines, and of what they call, with the programs as they are."""
    followed = [[move for move in moves if goes_somewhere(move)] for moves in sequences(robot, routines)]
    called = {id(move) for moves in followed for move in moves}
    holding = [routine for routine in robot.routines if any(id(move) in called for move in routine.moves)]
    places = Places(cell, model, language, holding, PoseTable(), _as_written)
    joints_of: dict[int, Array] = {}
    sides, likely = _Sides(), dict[int, Array]()
    for moves in followed:
        joints, _ = places.joints(moves, ())
        told = sides_of(joints)
        sides.add(moves, told)
        for move, row in zip(moves, _filled_back(told), strict=True):
            known = likely.setdefault(id(move), row)
            likely[id(move)] = np.where(np.isnan(known), row, known)
        for move, row in zip(moves, joints, strict=True):
            if np.isfinite(row).all():
                joints_of.setdefault(id(move), row)
    unknown = {id(move): reason.message for move, _, reason in places.unknown}
    agreed = sides.agreed()
    likely = {key: np.where(np.isnan(agreed[key]), row, agreed[key]) for key, row in likely.items()}
    return Runs(joints_of, agreed, likely, unknown)


class _Sides:
    """Sides of motions on all ways that lead to them."""

    def __init__(self) -> None:
        self._seen: dict[int, tuple[Array, Array]] = {}

    def add(self, moves: Sequence[Move], sides: Array) -> None:
        """Add a way: (n, axes) signs, NaN where not known."""
        for move, row in zip(moves, sides, strict=True):
            up, down = self._seen.get(id(move), (np.zeros(len(row)), np.zeros(len(row))))
            self._seen[id(move)] = np.maximum(up, row > 0.0), np.maximum(down, row < 0.0)

    def agreed(self) -> dict[int, Array]:
        """Sides that all ways have in common, by `id` of the motion."""
        return {key: np.where(up != down, up - down, np.nan) for key, (up, down) in self._seen.items()}


def _as_written(move: Move) -> Array:
    assert move.offset is not None  # noqa: S101 - asked before
    return literal(move.offset.numbers)


def sides_of(joints: Array) -> Array:
    """Sign of the last motion of each axis along n motions, (n, axes); NaN before the first and behind unknown joints.

    Parameters
    ----------
    joints : (n, axes) array
        [deg], NaN where not known.
    """
    way = np.vstack([np.full((1, joints.shape[1]), np.nan), np.diff(joints, axis=0)])
    told = np.where(np.isnan(way), np.nan, np.sign(way))
    events = np.isnan(way) | (np.abs(way) > AXIS_MOVES_DEG)
    last = np.maximum.accumulate(np.where(events, np.arange(len(joints))[:, None], 0), axis=0)
    return np.asarray(np.take_along_axis(told, last, axis=0))


def _filled_back(sides: Array) -> Array:
    """Sides (n, axes) with those that are not known taken from the next row that knows."""
    if not len(sides):
        return sides
    rows = np.arange(len(sides))[:, None]
    following = np.minimum.accumulate(np.where(np.isnan(sides), len(sides) - 1, rows)[::-1], axis=0)[::-1]
    return np.asarray(np.where(np.isnan(sides), np.take_along_axis(sides, following, axis=0), sides))
