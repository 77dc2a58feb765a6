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
from respot.geometry import Array, distance_mm
from respot.issues import BadInputError, Issue
from respot.languages import LANGUAGES
from respot.languages.profile_file import read_profile
from respot.program.moves import Move
from respot.program.poses import spot_poses
from respot.program.robot import Robot
from respot.tables import Table, read_table
from respot.tolerance import SAME_POSITION_MM


@dataclass(frozen=True, eq=False)
class SpotTable:
    """Weld spots.

    Parameters
    ----------
    ids : sequence of str
        Spot IDs, each once.
    positions : (n, 3) array
        TCP in the world, mm; with an external TCP in the part frame.
    rotations : Rotation or None
        Orientations in the same coordinates, batch of n.
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
    table : Table or None
        The table; None for a backup.
    """

    path: Path
    spots: SpotTable
    sha256: str
    backup: Backup | None = None
    robot: Robot | None = None
    table: Table | None = None

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
    path: Path,
    reference_ids: Collection[str] = (),
    spot_id: str | None = None,
    robot_name: str | None = None,
    profiles: Sequence[Path] = (),
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
    profiles : sequence of Path
        A plant's instruction forms.

    Raises
    ------
    BadInputError
        The source or a profile cannot be read, or it is not clear which robot is meant.
    """
    if not is_backup(path):
        table = read_table(path)
        return Source(path, spots_of_table(table), table.sha256, table=table)
    backup = open_backup(path, [read_profile(profile) for profile in profiles])
    robot = backup.robot(robot_name)
    return Source(path, spots_of_robot(robot, reference_ids, spot_id), backup.sha256, backup, robot)


def is_backup(path: Path) -> bool:
    """Whether a path is taken for a backup or a program, not for a table: by its suffix, or since it is a folder."""
    suffixes = tuple(suffix for language in LANGUAGES.values() for suffix in language.suffixes)
    return path.is_dir() or path.suffix.lower() == ".zip" or path.name.lower().endswith(suffixes)


def spots_of_table(table: Table) -> SpotTable:
    """Return the spots of a table; orientations only where every row has one.

    Raises
    ------
    BadInputError
        ``MISSING_COLUMN`` if the table has joints and no positions.
    """
    issues = list(table.issues)
    missing = len(table.ids) - sum(table.oriented)
    if table.rotations is not None and missing:
        message = f"{missing} of {len(table.ids)} rows have no orientation; only the positions are used"
        issues.append(Issue("PARTLY_ORIENTED", message, table.path))
    rotations = None if missing else table.rotations
    return SpotTable(table.ids, table.positions, rotations, issues=issues)


def spots_of_robot(robot: Robot, reference_ids: Collection[str] = (), pattern: str | None = None) -> SpotTable:
    """Find the weld spots of a robot's programs.

    A target is a spot if its motion welds, and otherwise if its name is that of a weld spot or, with a reference list
    at hand, in the list. The same ID on several targets: the one that welds (INTERFACES, sources and references).

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
    others: dict[str, list[Move]] = {}
    for move in robot.moves():
        spot_id = chooser.choose(move)
        if spot_id is not None:
            (welds if move.weld else others).setdefault(spot_id, []).append(move)
    for spot_id, moves in others.items():
        if spot_id not in welds and (chooser.listed(spot_id) or chooser.tells(moves)):
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
    issues += _drop_other_frame(ids, kept)
    if not kept:
        return SpotTable(ids, np.empty((0, 3)), None, kept, issues)
    poses = spot_poses(kept)
    return SpotTable(ids, np.asarray(poses.translation), poses.rotation, kept, issues)


def _drop_other_frame(ids: list[str], moves: list[Move]) -> list[Issue]:
    """Keep either the spots in the world or those in the part frame: one transform cannot hold for both."""
    external = [move.external_tcp for move in moves]
    fewer = sum(external) * 2 <= len(external)  # are those with an external TCP
    dropped = [name for name, is_external in zip(ids, external, strict=True) if is_external == fewer]
    if not dropped or len(dropped) == len(ids):
        return []
    kept = [(name, move) for name, move in zip(ids, moves, strict=True) if move.external_tcp != fewer]
    ids[:], moves[:] = [name for name, _ in kept], [move for _, move in kept]
    which = "with an external TCP, in the part frame" if fewer else "with the gun on the robot, in the world"
    message = f"{', '.join(dropped)}: welded {which}, unlike the {len(ids)} others: left out"
    return [Issue("EXTERNAL_TCP", message)]


def _doubt(spot_id: str, moves: Sequence[Move]) -> Issue | None:
    """Why a spot cannot be used."""
    first = moves[0]
    if not all(_same_place(first, move) for move in moves[1:]):
        where = ", ".join(f"{move.path}:{move.line}" for move in moves[:4])
        return Issue("AMBIGUOUS_SPOT", f"{spot_id} is welded at several targets: {where}", first.path, first.line)
    if first.unknown:
        code = first.codes[0] if first.codes else "RUN_TIME_POSE"
        return Issue(code, f"{spot_id}: {first.unknown}", first.path, first.line)
    if not first.has_spot_pose:
        doubt = next((doubt for doubt in first.doubts if doubt.code != "UNKNOWN_TOOL"), None)
        if doubt is not None:
            return Issue(doubt.code, f"{spot_id}: {doubt.text}", first.path, first.line)
        if first.target is not None and first.target.unknown:
            return Issue("RUN_TIME_POSE", f"{spot_id}: {first.target.unknown}", first.path, first.line)
        reason = first.base.unknown if first.base is not None else "the program does not set it"
        return Issue("UNKNOWN_FRAME", f"{spot_id}: base {first.base or 'unknown'}: {reason}", first.path, first.line)
    return None


def _same_place(first: Move, second: Move) -> bool:
    """Whether two welds are at one target and in one place."""
    if first.target is not second.target or first.external_tcp != second.external_tcp:
        return False
    if first.base is second.base and first.tool_offset is second.tool_offset and first.offset is second.offset:
        return True
    poses = first.spot_pose, second.spot_pose
    if poses[0] is None or poses[1] is None:
        return poses[0] is poses[1]
    return float(distance_mm(poses[0], poses[1])) <= SAME_POSITION_MM


class _Chooser:
    """Picks the spot ID of a motion."""

    def __init__(self, reference_ids: Iterable[str], pattern: str | None) -> None:
        self._reference = {spot_id.casefold(): spot_id for spot_id in reference_ids}
        try:
            self._pattern = re.compile(pattern, re.IGNORECASE) if pattern else None
        except re.error as error:
            raise BadInputError("BAD_OPTION", f"--spot-id {pattern!r} is no regular expression: {error}") from error

    def choose(self, move: Move) -> str | None:
        """ID of a motion: the first that the reference lists, else the first at all."""
        candidates = self._candidates(move)
        for candidate in candidates:
            if candidate.casefold() in self._reference:
                return self._reference[candidate.casefold()]
        return candidates[0] if candidates else None

    def listed(self, spot_id: str) -> bool:
        """Whether the reference has the ID."""
        return spot_id.casefold() in self._reference

    def tells(self, moves: Sequence[Move]) -> bool:
        """Whether the name alone makes a spot of a target that nothing is known to weld."""
        return self._pattern is not None or any(move.named_spot for move in moves)

    def _candidates(self, move: Move) -> list[str]:
        if self._pattern is None:
            return list(move.spot_ids)
        matches = (self._pattern.search(label.text) for label in move.labels)
        found = (match.group(1 if match.re.groups else 0) for match in matches if match)
        return [text for text in found if text]
