"""The weld spots of a source as arrays.

A source is a backup (folder or zip), a program file, or a spot table.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from respot.backups import Backup, open_backup
from respot.geometry import Array
from respot.issues import BadInputError, Issue
from respot.languages import LANGUAGES
from respot.program.moves import Move
from respot.program.robot import Robot
from respot.tables import Table, read_table


@dataclass(frozen=True, eq=False)
class SpotTable:
    """Weld spots.

    Parameters
    ----------
    ids : sequence of str
        Spot IDs, each once.
    positions : (n, 3) array
        TCP in the world, mm (of a table: as the table has them).
    rotations : Rotation or None
        ``tool2world``, batch of n.
    moves : sequence of Move
        The motion that welds each spot; empty for a table.
    issues : sequence of Issue
        Spots that could not be used, and why.
    """

    ids: Sequence[str]
    positions: Array
    rotations: Rotation | None
    moves: Sequence[Move] = ()
    issues: Sequence[Issue] = ()


@dataclass(frozen=True, eq=False)
class Source:
    """A source with its spots.

    Parameters
    ----------
    path : Path
        As the user named it.
    spots : SpotTable
        Its weld spots.
    sha256 : str
        Hash of what was read.
    backup : Backup or None
        None for a table.
    robot : Robot or None
        The robot of the backup that the spots are of.
    """

    path: Path
    spots: SpotTable
    sha256: str
    backup: Backup | None = None
    robot: Robot | None = None

    @property
    def issues(self) -> list[Issue]:
        """What was noticed while reading."""
        found = list(self.spots.issues)
        if self.backup is not None:
            found += self.backup.issues
        if self.robot is not None:
            found += self.robot.issues
        return found


def read_source(
    path: Path, reference_ids: Collection[str] = (), spot_id: str | None = None, robot_name: str | None = None
) -> Source:
    """Read a source.

    Parameters
    ----------
    path : Path
        Backup, program file or table.
    reference_ids : collection of str
        IDs of the list it will be compared with, where that is known.
    spot_id : str, optional
        Regular expression for spot IDs.
    robot_name : str, optional
        Which robot of a backup with several.

    Raises
    ------
    BadInputError
        The source cannot be read, or it is not clear which robot is meant.
    """
    if not _is_backup(path):
        table = read_table(path)
        return Source(path, spots_of_table(table), table.sha256)
    backup = open_backup(path)
    robot = backup.robot(robot_name)
    return Source(path, spots_of_robot(robot, reference_ids, spot_id), backup.sha256, backup, robot)


def _is_backup(path: Path) -> bool:
    suffixes = tuple(suffix for language in LANGUAGES.values() for suffix in language.suffixes)
    return path.is_dir() or path.suffix.lower() == ".zip" or path.name.lower().endswith(suffixes)


def spots_of_table(table: Table) -> SpotTable:
    """Return the spots of a table."""
    return SpotTable(table.ids, table.positions, table.rotations)


def spots_of_robot(robot: Robot, reference_ids: Collection[str] = (), pattern: str | None = None) -> SpotTable:
    """Find the weld spots of a robot's programs.

    A target is a spot if its motion welds; with a reference list at hand also if its name is in the list and no other
    target of that name welds (INTERFACES, sources and references).

    Parameters
    ----------
    robot : Robot
        The robot.
    reference_ids : collection of str
        IDs of the reference; names are compared without case and the reference's spelling is taken.
    pattern : str, optional
        Regular expression for the ID in a target's or weld datum's name; its first group, or the whole match.

    Raises
    ------
    BadInputError
        The pattern is no regular expression.
    """
    chooser = _Chooser(reference_ids, pattern)
    welds: dict[str, list[Move]] = {}
    named: dict[str, list[Move]] = {}
    for move in robot.moves():
        spot_id = chooser.choose(move)
        if spot_id is not None:
            (welds if move.weld else named).setdefault(spot_id, []).append(move)
    for spot_id, moves in named.items():
        if spot_id not in welds and chooser.listed(spot_id):
            welds[spot_id] = moves
    ids: list[str] = []
    kept: list[Move] = []
    issues: list[Issue] = []
    for spot_id, moves in welds.items():
        doubt = _doubt(spot_id, moves)
        if doubt is not None:
            issues.append(doubt)
        else:
            ids.append(spot_id)
            kept.append(moves[0])
    poses = [world for move in kept if (world := move.world) is not None]
    positions = np.array([pose.translation for pose in poses]).reshape(-1, 3)
    rotations = Rotation.concatenate([pose.rotation for pose in poses]) if poses else None
    return SpotTable(ids, positions, rotations, kept, issues)


def _doubt(spot_id: str, moves: Sequence[Move]) -> Issue | None:
    """Why a spot cannot be used."""
    first = moves[0]
    places = {(move.target.path, move.target.span) for move in moves if move.target is not None}
    if len(places) > 1:
        where = ", ".join(f"{move.path}:{move.line}" for move in moves[:4])
        return Issue("AMBIGUOUS_SPOT", f"{spot_id} is welded at several targets: {where}", first.path, first.line)
    if first.unknown:
        return Issue("RUN_TIME_POSE", f"{spot_id}: {first.unknown}", first.path, first.line)
    if first.external_tcp:
        return Issue("EXTERNAL_TCP", f"{spot_id}: the robot holds the part; not supported yet", first.path, first.line)
    if first.world is None:
        reason = first.base.unknown if first.base is not None else "the program does not set it"
        if first.target is not None and first.target.unknown:
            return Issue("RUN_TIME_POSE", f"{spot_id}: {first.target.unknown}", first.path, first.line)
        return Issue("UNKNOWN_FRAME", f"{spot_id}: base {first.base or 'unknown'}: {reason}", first.path, first.line)
    return None


class _Chooser:
    """Picks the spot ID of a motion."""

    def __init__(self, reference_ids: Iterable[str], pattern: str | None) -> None:
        self._reference = {spot_id.casefold(): spot_id for spot_id in reference_ids}
        try:
            self._pattern = re.compile(pattern, re.IGNORECASE) if pattern else None
        except re.error as error:
            raise BadInputError("BAD_OPTION", f"--spot-id {pattern!r} is no regular expression: {error}") from error

    def choose(self, move: Move) -> str | None:
        candidates = self._candidates(move)
        for candidate in candidates:
            if candidate.casefold() in self._reference:
                return self._reference[candidate.casefold()]
        return candidates[0] if candidates else None

    def listed(self, spot_id: str) -> bool:
        return spot_id.casefold() in self._reference

    def _candidates(self, move: Move) -> list[str]:
        if self._pattern is None:
            return list(move.spot_ids)
        matches = (self._pattern.search(name) for name in move.spot_ids)
        found = (match.group(1 if match.re.groups else 0) for match in matches if match)
        return [text for text in found if text]
