"""Two sources beside each other: which robot is which, and what differs between both states of each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from respot.backups import Backup, open_backup
from respot.difference.findings import FileChange, Noise, RobotDifference
from respot.difference.pairing import PathPair, pair_paths, pair_robots, pair_single
from respot.difference.positions import Tolerance
from respot.difference.robots import RobotComparison, RobotFiles
from respot.difference.texts import is_own_record, kind_of
from respot.issues import BadInputError, Issue
from respot.languages.profile import Profile
from respot.program.robot import Robot
from respot.spots import is_backup


@dataclass(frozen=True, eq=False)
class Comparison:
    """What differs between two sources.

    Parameters
    ----------
    old, new : Backup
        Both sides.
    robots : sequence of RobotDifference
        One for each robot that either side has.
    files : sequence of FileChange
        Files that belong to no robot.
    noise : sequence of Noise
        Records of ours that belong to no robot.
    issues : sequence of Issue
        What a person should know; issues that both sides have are left out.
    """

    old: Backup
    new: Backup
    robots: Sequence[RobotDifference]
    files: Sequence[FileChange] = field(default_factory=list)
    noise: Sequence[Noise] = field(default_factory=list)
    issues: Sequence[Issue] = field(default_factory=list)

    @property
    def same(self) -> bool:
        """Whether nothing differs but noise."""
        return not self.files and all(robot.same for robot in self.robots)


def compare(
    old: Path,
    new: Path,
    tolerance: Tolerance | None = None,
    robot_name: str | None = None,
    profiles: Sequence[Profile] = (),
) -> Comparison:
    """Compare two sources.

    Parameters
    ----------
    old, new : Path
        Backups (folder or zip) or program files.
    tolerance : Tolerance, optional
        What counts as the same place; exact without it.
    robot_name : str, optional
        Only the robot of this name.
    profiles : sequence of Profile
        A plant's instruction forms.

    Raises
    ------
    BadInputError
        A side cannot be read, is a table, or holds no robot that the other side has.
    """
    for path in (old, new):
        if path.exists() and not is_backup(path):
            message = "is neither a backup nor a program: diff compares folders, zips and program files"
            raise BadInputError("NO_ROBOT", message, str(path))
    sides = open_backup(old, profiles), open_backup(new, profiles)
    pairs, issues = pair_robots(*sides, robot_name)
    limits = tolerance or Tolerance()
    done: list[set[str]] = [set(), set()]
    robots = []
    for before, after in pairs:
        if before is None or after is None:
            robots.append(_lone(before, after))
            continue
        robots.append(_robot(sides, (before, after), limits, done))
    files, noise = ([], []) if robot_name is not None else _rest(sides)
    known = {(issue.code, issue.message) for issue in _issues(sides[0])}
    fresh = [issue for issue in _issues(sides[1]) if (issue.code, issue.message) not in known]
    told = [issue for robot in robots for issue in robot.issues]
    return Comparison(*sides, robots, files, noise, [*issues, *told, *fresh])


def _issues(backup: Backup) -> list[Issue]:
    return [*backup.issues, *(issue for robot in backup.robots for issue in robot.issues)]


def _lone(old: Robot | None, new: Robot | None) -> RobotDifference:
    if new is not None:
        return RobotDifference(new.name, new.language, "added", len(new.targets))
    assert old is not None  # noqa: S101 - one side has it
    return RobotDifference(old.name, old.language, "removed", len(old.targets))


def _robot(
    sides: tuple[Backup, Backup], pair: tuple[Robot, Robot], tolerance: Tolerance, done: list[set[str]]
) -> RobotDifference:
    """Compare one robot; files that robots of one controller share belong to the first of them."""
    states = []
    for backup, robot, taken in zip(sides, pair, done, strict=True):
        others = {path for other in backup.robots if other is not robot for path in other.files}
        files = {
            path: data for path, data in backup.files_of(robot).items() if path not in others and path not in taken
        }
        taken.update(files)
        states.append(RobotFiles(robot, files))
    paths, removed, added = _paths(sides, states)
    return RobotComparison(states[0], states[1], paths, removed, added, tolerance).run()


def _paths(sides: Sequence[Backup], states: Sequence[RobotFiles]) -> tuple[list[PathPair], list[str], list[str]]:
    if all(_is_single(backup) for backup in sides):
        return pair_single(states[0].files, states[1].files)
    below = [
        {path[len(state.robot.root) :]: data for path, data in state.files.items()} for state in states
    ]  # fmt: skip
    roots = [state.robot.root for state in states]
    pairs, removed, added = pair_paths(*below)
    return (
        [(roots[0] + old, roots[1] + new) for old, new in pairs],
        [roots[0] + path for path in removed],
        [roots[1] + path for path in added],
    )


def _is_single(backup: Backup) -> bool:
    return backup.path.is_file() and backup.path.suffix.lower() != ".zip"


def _rest(sides: tuple[Backup, Backup]) -> tuple[list[FileChange], list[Noise]]:
    """Compare the files that belong to no robot."""
    left = []
    for backup in sides:
        owned = {path for robot in backup.robots for path in backup.files_of(robot)}
        left.append({path: data for path, data in backup.files.items() if path not in owned})
    changes: list[FileChange] = []
    noise: list[Noise] = []
    old, new = left
    for path in sorted({*old, *new}):
        before, after = old.get(path), new.get(path)
        if before == after:
            continue
        known = [data for data in (before, after) if data is not None]
        if all(is_own_record(path, data) for data in known):
            noise.append(Noise("respot", path))
            continue
        change = "removed" if after is None else "added" if before is None else "changed"
        sizes = [None if data is None else len(data) for data in (before, after)]
        changes.append(FileChange(path, change, kind_of(path, *known), sizes[0], sizes[1]))
    return changes, noise
