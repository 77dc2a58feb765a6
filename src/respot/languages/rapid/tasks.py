"""Which robot each task of a controller moves.

With MultiMove one controller moves several robots, each from a task of its own. ``SYS.cfg`` names the tasks that move
something, ``backinfo.txt`` which folder is which task. Where one of them is missing and the controller has several
robots, a task that holds motions is taken to move one of its own, and that is said: no name is trusted to tell which.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from respot.issues import Issue
from respot.languages.rapid.controller import ControllerData, MovingTask


@dataclass(frozen=True, eq=False)
class Share:
    """The tasks of one robot.

    Parameters
    ----------
    name : str
        Name of the task that moves it; empty where one robot has all tasks.
    folder : str
        Folder of that task; empty if it is not known.
    folders : list of str
        Folders of all its tasks.
    moving : MovingTask
        What the backup says about the task; its path is empty where that is nothing.
    issues : list of Issue
        What is not known.
    first : bool
        It has what belongs to no task.
    """

    name: str
    folder: str
    folders: list[str]
    moving: MovingTask
    issues: list[Issue]
    first: bool

    def holds(self, folder: str) -> bool:
        """Whether files of a task's folder are this robot's."""
        return folder in self.folders or (self.first and not folder)


def share_tasks(root: str, data: ControllerData, folders: Sequence[str], with_motions: Sequence[str]) -> list[Share]:
    """Share the tasks of a controller among its robots.

    Parameters
    ----------
    root : str
        Folder of the controller inside the backup.
    data : ControllerData
        What the backup says.
    folders : sequence of str
        Folders of all tasks that hold modules.
    with_motions : sequence of str
        Those whose modules hold motions.
    """
    moving = {task.name.lower(): task for task in data.moving_tasks()}
    known = {folder: _name(data, folder) for folder in folders}
    shares: list[Share] = []
    for folder in folders:
        task = moving.get(known[folder].lower())
        if task is not None:
            shares.append(Share(task.name, folder, [folder], task, _unknown_robot(data, task), False))
        elif folder in with_motions and not (moving and known[folder]):
            shares.append(_by_motions(root, data, folder, known[folder] or folder))
    if len(shares) < 2 or not _has_several_robots(data):
        sure = [share for share in shares if share.moving.path] or [_whole(root, data, folders, with_motions)]
        return [replace(sure[0], name="", folders=list(folders), first=True)]
    taken = {folder for share in shares for folder in share.folders}
    rest = [folder for folder in folders if folder not in taken]
    return [replace(shares[0], folders=[*shares[0].folders, *rest], first=True), *shares[1:]]


def _has_several_robots(data: ControllerData) -> bool:
    """Whether the backup says so: by its tasks, else by its robots, else by the option MultiMove."""
    moving, robots = data.moving_tasks(), data.motion.get("ROBOT", [])
    if moving or robots:
        return len(moving or robots) > 1
    return "options" in data.facts and "multimove" in data.facts["options"].value.lower()


def _whole(root: str, data: ControllerData, folders: Sequence[str], with_motions: Sequence[str]) -> Share:
    """All tasks of a controller whose one moving task has no folder, or no name."""
    moving = data.moving_tasks()
    task = moving[0] if len(moving) == 1 else MovingTask("", "", (), "", 0)
    issues = []
    if not moving and len(with_motions) > 1 and len(data.motion.get("ROBOT", [])) != 1:
        message = f"{', '.join(with_motions)} hold motions, and no SYS.cfg tells what they move: read as of one robot"
        issues.append(Issue("UNKNOWN_TASK", message, root.rstrip("/") or None))
    return Share("", folders[0] if len(folders) == 1 else "", list(folders), task, issues, True)


def missing_modules(root: str, files: Iterable[str], data: ControllerData) -> list[Issue]:
    """Say which modules ``backinfo.txt`` lists that are not in the backup; hidden ones need not be."""
    present = {path[len(root) :].lower() for path in files}
    found = []
    for task in data.tasks:
        missing = [
            module
            for module, hidden in task.modules
            if not hidden and not {f"{rapid}{task.folder}/{module}".lower() for rapid in ("RAPID/", "")} & present
        ]
        if missing:
            shown = ", ".join(missing[:5])
            message = f"{task.name or task.folder} lacks {len(missing)} of its modules: {shown}; the rest is read"
            found.append(Issue("HALF_BACKUP", message, task.path, task.line))
    return found


def _name(data: ControllerData, folder: str) -> str:
    """Name of a task by its folder; empty if the backup does not tell."""
    entry = data.task_of(folder)
    if entry is not None:
        return entry.name
    return folder if folder.startswith("T_") else ""


def _unknown_robot(data: ControllerData, task: MovingTask) -> list[Issue]:
    names = [row.value("name") or "" for row in data.motion.get("ROBOT", [])]
    if not names or task.robot.lower() in (name.lower() for name in names):
        return []
    said = f"moves {task.robot}" if task.robot else "has no mechanical unit group"
    message = f"{task.name} {said}; MOC.cfg has {', '.join(names)}: its kinematics are not known"
    return [Issue("UNKNOWN_TASK", message, task.path, task.line)]


def _by_motions(root: str, data: ControllerData, folder: str, name: str) -> Share:
    lacking = "SYS.cfg" if not data.moving_tasks() else "backinfo.txt"
    message = (
        f"{name} holds motions, and no {lacking} tells which robot it moves: "
        "it is taken as a robot of its own, its kinematics are not known"
    )
    moving = MovingTask(name, "", (), "", 0)
    return Share(name, folder, [folder], moving, [Issue("UNKNOWN_TASK", message, root.rstrip("/") or None)], False)
