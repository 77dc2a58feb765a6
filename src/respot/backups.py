"""Opens a backup: a folder, a zip, or one program file, with the robots in it.

`respot.archives` reads the bytes, `respot.trees` finds the controllers, a language reads each; nothing is executed and
nothing is written.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

from respot.archives import Tree, read_files, read_tree
from respot.issues import BadInputError, Issue
from respot.languages import LANGUAGES
from respot.languages.profile import Profile
from respot.program.robot import Robot
from respot.trees import Controller, files_below, find_controllers, missing_parts, not_live, strays

__all__ = ["Backup", "open_backup", "read_files"]


@dataclass(frozen=True, eq=False)
class Backup:
    """A backup with its robots.

    Parameters
    ----------
    path : Path
        As the user named it.
    files : mapping of str to bytes
        Every file.
    robots : sequence of Robot
        What respot read from them.
    issues : sequence of Issue
        About the backup itself; those of a robot are with the robot.
    profiles : sequence of Profile
        The plant's instruction forms that it was read with.
    """

    path: Path
    files: Mapping[str, bytes]
    robots: Sequence[Robot]
    issues: Sequence[Issue]
    profiles: Sequence[Profile] = ()

    @cached_property
    def sha256(self) -> str:
        """Hash of all paths and bytes."""
        digest = hashlib.sha256()
        for path in sorted(self.files):
            data = self.files[path]
            digest.update(f"{path}\0{len(data)}\0".encode("utf-8", "surrogateescape"))
            digest.update(data)
        return digest.hexdigest()

    def files_of(self, robot: Robot) -> dict[str, bytes]:
        """Return the files of a robot's controller; those of controllers in folders below are not among them."""
        return files_below(self.files, robot.root, [other.root for other in self.robots])

    def robot(self, name: str | None = None) -> Robot:
        """Return the one robot, or the robot of a name.

        Raises
        ------
        BadInputError
            There is none, more than one and no name, or none of that name.
        """
        if not self.robots:
            message = "holds no KUKA or ABB robot program; name the folder that holds KRC or RAPID"
            hints = [issue for issue in self.issues if issue.code in ("NESTED_ARCHIVE", "HALF_BACKUP")]
            if hints:
                more = f" (and {len(hints) - 1} more)" if len(hints) > 1 else ""
                hint = hints[0]
                where = f" outside of {hint.path}, which {hint.message}" if hint.path else f": {hint.message}"
                message = f"holds no robot program{where}{more}"
            raise BadInputError("NO_ROBOT", message, str(self.path))
        names = ", ".join(robot.name for robot in self.robots)
        if name is None:
            if len(self.robots) > 1:
                raise BadInputError("SEVERAL_ROBOTS", f"holds {names}: pick one with --robot-name", str(self.path))
            return self.robots[0]
        for robot in self.robots:
            if robot.name.lower() == name.lower():
                return robot
        raise BadInputError("NO_ROBOT", f"holds no robot {name}; there is {names}", str(self.path))


def open_backup(path: Path, profiles: Sequence[Profile] = ()) -> Backup:
    """Read a backup from a folder, a zip, or a program file with its data list.

    Parameters
    ----------
    path : Path
        Folder, zip or file.
    profiles : sequence of Profile
        A plant's instruction forms, tried before those of respot.

    Raises
    ------
    BadInputError
        As `respot.archives.read_tree`.
    """
    tree = read_tree(path)
    controllers = _single(tree) if tree.single else find_controllers(tree.files)
    roots = [controller.root for controller in controllers]
    robots: list[Robot] = []
    for controller in controllers:
        language = controller.language.with_plant(profiles)
        files = files_below(tree.files, controller.root, roots)
        name = controller.folder or _name(path)
        noticed = [] if tree.single else [missing_parts(controller, files), not_live(controller, files)]
        issues = [issue for issue in noticed if issue is not None]
        found = language.read_robots(name, controller.root, files, language.forms)
        robots += [replace(robot, issues=[*issues, *robot.issues]) for robot in found]
    return Backup(path, tree.files, _told_apart(robots), [*tree.issues, *strays(tree.files, controllers)], profiles)


def _single(tree: Tree) -> list[Controller]:
    """The one robot of a program file."""
    suffixes = {language.name: tuple(language.suffixes) for language in LANGUAGES.values()}
    return [
        Controller(language, "")
        for language in LANGUAGES.values()
        if any(name.lower().endswith(suffixes[language.name]) for name in tree.files)
    ]


def _name(path: Path) -> str:
    own = path.resolve()
    return own.name if own.is_dir() else own.stem


def _told_apart(robots: Sequence[Robot]) -> list[Robot]:
    """Give robots of one name, such as five backups of one controller, the folder they lie in as their name."""
    names = [robot.name.lower() for robot in robots]
    told = []
    for robot in robots:
        if names.count(robot.name.lower()) > 1:
            folder = robot.root.rstrip("/") or robot.name.removesuffix(f" {robot.task}")
            robot = replace(robot, name=f"{folder} {robot.task}".rstrip())
        told.append(robot)
    again = [robot.name.lower() for robot in told]
    return [
        replace(robot, name=f"{robot.name} {robot.language}") if again.count(robot.name.lower()) > 1 else robot
        for robot in told
    ]
