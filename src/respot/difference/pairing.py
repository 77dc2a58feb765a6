"""Which robot, and which file, is which on the other side."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import PurePosixPath

from respot.backups import Backup
from respot.issues import BadInputError, Issue
from respot.program.robot import Robot

_NUMBERED = re.compile(r"TASK\d+", re.IGNORECASE)
_TASK = re.compile(r"(?:^|/)(task\d+)/", re.IGNORECASE)
RobotPair = tuple[Robot | None, Robot | None]
PathPair = tuple[str, str]
#: Whether two robots agree in something, given all that are left on both sides.
_Same = Callable[[Robot, Robot, Sequence[Robot], Sequence[Robot]], bool]


def pair_robots(old: Backup, new: Backup, name: str | None = None) -> tuple[list[RobotPair], list[Issue]]:
    """Pair the robots of two backups: by name, by serial number, by task, then those that are left alone.

    Parameters
    ----------
    old, new : Backup
        Both sides.
    name : str, optional
        Only the robot of this name.

    Returns
    -------
    list of (Robot or None, Robot or None)
        A robot that only one side has stands beside None.
    list of Issue
        Robots that are compared though their names or serial numbers differ.

    Raises
    ------
    BadInputError
        A side holds no robot, the languages differ, or no robot has a partner.
    """
    sides = [_robots(backup, name) for backup in (old, new)]
    languages = [{robot.language for robot in side} for side in sides]
    if languages[0].isdisjoint(languages[1]):
        first, second = (", ".join(sorted(found)).upper() for found in languages)
        message = (
            f"holds {second} programs, {old.path} holds {first}: programs of two languages cannot be compared; "
            "`respot translate` brings one into the language of the other"
        )
        raise BadInputError("DIFFERENT_ROBOTS", message, str(new.path))
    left_old, left_new = list(sides[0]), list(sides[1])
    tasks = _Tasks(old, new)
    pairs: list[tuple[Robot, Robot]] = []
    for same in (tasks.same_name, _same_serial, tasks.same_task, _only_one):
        pairs += _matched(left_old, left_new, same)
    issues = [issue for pair in pairs if (issue := _doubt(*pair)) is not None]
    if not pairs:
        names = [", ".join(robot.name for robot in side) for side in sides]
        message = f"holds {names[1]}, {old.path} holds {names[0]}: no robot is on both sides; --robot-name picks one"
        raise BadInputError("DIFFERENT_ROBOTS", message, str(new.path))
    order = {id(robot): index for index, robot in enumerate(sides[1])}
    pairs.sort(key=lambda pair: order[id(pair[1])])
    lone: list[RobotPair] = [*((robot, None) for robot in left_old), *((None, robot) for robot in left_new)]
    return [*pairs, *lone], issues


def _robots(backup: Backup, name: str | None) -> list[Robot]:
    if name is not None or not backup.robots:
        return [backup.robot(name)]
    return list(backup.robots)


def _matched(left_old: list[Robot], left_new: list[Robot], same: _Same) -> list[tuple[Robot, Robot]]:
    """Take the pairs that agree in one thing, where only one robot on each side does."""
    found = []
    for robot in list(left_old):
        partners = [other for other in left_new if same(robot, other, left_old, left_new)]
        rivals = [other for other in left_old if partners and same(other, partners[0], left_old, left_new)]
        if len(partners) == 1 and len(rivals) == 1:
            found.append((robot, partners[0]))
            left_old.remove(robot)
            left_new.remove(partners[0])
    return found


class _Tasks:
    """Compares robots by name and task; a task that is only known by its number is known by its modules."""

    def __init__(self, old: Backup, new: Backup) -> None:
        self._sides = (old, new)
        self._folders: dict[tuple[str, str], dict[str, str]] = {}

    def same_name(self, old: Robot, new: Robot, left_old: Sequence[Robot], left_new: Sequence[Robot]) -> bool:
        """Compare names."""
        del left_old, left_new
        if old.language != new.language:
            return False
        if _NUMBERED.fullmatch(old.task) and _NUMBERED.fullmatch(new.task):
            controllers = [robot.name.removesuffix(robot.task).lower() for robot in (old, new)]
            return controllers[0] == controllers[1] and self._same_number(old, new)
        return old.name.lower() == new.name.lower()

    def same_task(self, old: Robot, new: Robot, left_old: Sequence[Robot], left_new: Sequence[Robot]) -> bool:
        """Compare tasks of one controller on each side, such as two backups of it that are named otherwise."""
        one = len({robot.root for robot in left_old}) == 1 == len({robot.root for robot in left_new})
        if not (one and old.task and new.task):
            return False
        if _NUMBERED.fullmatch(old.task) and _NUMBERED.fullmatch(new.task):
            return self._same_number(old, new)
        return old.task.lower() == new.task.lower()

    def _same_number(self, old: Robot, new: Robot) -> bool:
        place = (old.root, new.root)
        if place not in self._folders:
            files = [side.files_of(robot) for side, robot in zip(self._sides, (old, new), strict=True)]
            self._folders[place] = _task_folders(*files)
        return self._folders[place].get(old.task.lower()) == new.task.lower()


def _same_serial(old: Robot, new: Robot, left_old: Sequence[Robot], left_new: Sequence[Robot]) -> bool:
    del left_old, left_new
    serials = [robot.machine.facts.get("serial") for robot in (old, new)]
    known = [serial.value for serial in serials if serial is not None]
    return old.language == new.language and len(known) == 2 and known[0] == known[1]


def _only_one(old: Robot, new: Robot, left_old: Sequence[Robot], left_new: Sequence[Robot]) -> bool:
    return old.language == new.language and len(left_old) == 1 == len(left_new)


def _doubt(old: Robot, new: Robot) -> Issue | None:
    serials = [robot.machine.facts.get("serial") for robot in (old, new)]
    if serials[0] is not None and serials[1] is not None and serials[0].value != serials[1].value:
        message = (
            f"{old.name} has serial number {serials[0].value}, {new.name} has {serials[1].value}: "
            "two different robots are compared"
        )
        return Issue("OTHER_ROBOT_COMPARED", message, serials[1].path, serials[1].line)
    return None


def pair_paths(old: Mapping[str, bytes], new: Mapping[str, bytes]) -> tuple[list[PathPair], list[str], list[str]]:
    """Pair files by their paths below the robot's root.

    Names are compared without case. Folders of tasks may have other numbers (facts: rapid.md 4.1): the folder that
    holds most of the same modules is the same task. What is left is paired by its name alone where that is unique.

    Parameters
    ----------
    old, new : mapping of str to bytes
        Files by path below the root.

    Returns
    -------
    list of (str, str)
        Pairs.
    list of str, list of str
        What only the old or the new side has.
    """
    folders = _task_folders(old, new)
    there: dict[str, str] = {}
    for path in new:
        there.setdefault(path.lower(), path)
    pairs: list[PathPair] = []
    left_old: list[str] = []
    for path in old:
        match = _TASK.search(path)
        wanted = path.lower()
        if match is not None:
            folder = folders.get(match[1].lower())
            wanted = "" if folder is None else wanted[: match.start(1)] + folder + wanted[match.end(1) :]
        found = there.pop(wanted, None)
        if found is None:
            left_old.append(path)
        else:
            pairs.append((path, found))
    left_new = list(there.values())
    for path in list(left_old):
        same = [other for other in left_new if _last(other) == _last(path)]
        if len(same) == 1 and sum(_last(other) == _last(path) for other in left_old) == 1:
            pairs.append((path, same[0]))
            left_old.remove(path)
            left_new.remove(same[0])
    return pairs, left_old, left_new


def _last(path: str) -> str:
    return PurePosixPath(path).name.lower()


def _task_folders(old: Mapping[str, bytes], new: Mapping[str, bytes]) -> dict[str, str]:
    """Return the new folder of each old task folder."""
    sides = [_by_task(files) for files in (old, new)]
    scores = []
    for before, modules in sides[0].items():
        for after, others in sides[1].items():
            common = modules.keys() & others.keys()
            score = sum(3 if modules[name] == others[name] else 1 for name in common if len(modules[name]) > 1000)
            scores.append((score, len(common), before == after, before, after))
    found: dict[str, str] = {}
    for *_, before, after in sorted(scores, key=lambda item: (*map(int, item[:3]),), reverse=True):
        if before not in found and after not in found.values():
            found[before] = after
    return found


def _by_task(files: Mapping[str, bytes]) -> dict[str, dict[str, bytes]]:
    found: dict[str, dict[str, bytes]] = {}
    for path, data in files.items():
        match = _TASK.search(path)
        if match is not None:
            found.setdefault(match[1].lower(), {})[_last(path)] = data
    return found


def pair_single(old: Iterable[str], new: Iterable[str]) -> tuple[list[PathPair], list[str], list[str]]:
    """Pair two programs given as files by the suffixes of their files: their names may be anything."""
    sides = [{PurePosixPath(path.lower()).suffix: path for path in paths} for paths in (old, new)]
    common = [suffix for suffix in sides[0] if suffix in sides[1]]
    lone = [[path for suffix, path in side.items() if suffix not in common] for side in sides]
    return [(sides[0][suffix], sides[1][suffix]) for suffix in common], lone[0], lone[1]
