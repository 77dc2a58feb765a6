"""What an ABB backup says about its controller: ``backinfo.txt``, ``system.xml``, ``SYS.cfg``, ``MOC.cfg``.

Plain values, each with its file and line (facts: rapid.md 4). A task moves what its mechanical unit group names:
``CAB_TASKS`` ``-UseMechanicalUnitGroup`` -> ``MECHANICAL_UNIT_GROUP`` ``-Robot`` -> ``ROBOT``. Tasks without
``-MotionTask`` may name a group too and move nothing.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import PurePosixPath

from respot.program.robot import Fact
from respot.source import SourceText

#: ``-name "x" -attr 1 -flag``
_ATTRIBUTE = re.compile(r'-(\w+)(?:\s+("[^"]*"|(?!-[A-Za-z_])\S+))?')
_SECTION = re.compile(r"[A-Z][A-Z0-9_]*:")
_CONTINUED = re.compile(r"\\[ \t]*$")
_TASK = re.compile(r">>(TASK\d+):\s*\(([^,)]*),?([^,)]*)", re.IGNORECASE)
_MODULE = re.compile(r"(\S.*?)\s+@\s*(.*)")
_VERSION = re.compile(r"RobotWare Version:\s*(\S+)", re.IGNORECASE)
_SAVED = re.compile(r"#\s*(\d{2,4}-\d\d-\d\d\s+\d\d:\d\d:\d\d)")
_XML_VALUES = {"controller": re.compile(r"<SystemName>([^<]*)<"), "serial": re.compile(r"<SerialNo>([^<]*)<")}
_XML_OPTION = re.compile(r'<Option\s+descr="([^"]*)"')


class Instance(Mapping[str, str]):
    """An instance of a ``.cfg`` file: its attributes as they are written, and its line.

    Parameters
    ----------
    attributes : mapping of str to str
        Values without their quotes; a flag is empty.
    path : str
        File.
    line : int
        Line it begins in, from 1.
    """

    def __init__(self, attributes: Mapping[str, str], path: str = "", line: int = 0) -> None:
        self._attributes = dict(attributes)
        self.path = path
        self.line = line

    def __getitem__(self, key: str) -> str:
        return self._attributes[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self._attributes)

    def __len__(self) -> int:
        return len(self._attributes)

    def value(self, name: str) -> str | None:
        """Value of an attribute whose name may be written in any case; None where it is not there."""
        return next((value for key, value in self._attributes.items() if key.lower() == name.lower()), None)

    def fact(self, name: str) -> Fact | None:
        """Value of an attribute, with its place."""
        value = self.value(name)
        return None if value is None else Fact(value, self.path, self.line)


Configuration = dict[str, list[Instance]]


def read_configuration(text: str, path: str = "") -> Configuration:
    r"""Instances of a ``.cfg`` file by type; a line that ends in ``\`` goes on in the next (facts: rapid.md 4.3)."""
    found: Configuration = {}
    section, pending, start = "", "", 0
    for number, line in enumerate(re.split(r"\r*\n|\r", text), start=1):
        start = start if pending else number
        whole = pending + line
        if _CONTINUED.search(whole):
            pending = _CONTINUED.sub(" ", whole)
            continue
        pending = ""
        whole = whole.strip()
        if _SECTION.fullmatch(whole):
            section = whole[:-1]
            found.setdefault(section, [])
        elif whole.startswith("-") and section:
            attributes = {key: value.strip('"') for key, value in _ATTRIBUTE.findall(whole)}
            found[section].append(Instance(attributes, path, start))
    return found


@dataclass(frozen=True)
class TaskEntry:
    """A task as ``backinfo.txt`` lists it: ``>>TASK1: (T_ROB1,Program,)``.

    Parameters
    ----------
    folder, name, program : str
        Its folder, its name, its program; the program may be empty.
    path, line : str, int
        Where that stands.
    modules : tuple of (str, bool)
        Each module's path in the task's folder, and whether it is hidden.
    """

    folder: str
    name: str
    program: str
    path: str
    line: int
    modules: tuple[tuple[str, bool], ...] = ()


@dataclass(frozen=True)
class MovingTask:
    """A task that moves a robot.

    Parameters
    ----------
    name : str
        Name of the task.
    robot : str
        Name of its ``ROBOT`` in ``MOC.cfg``; empty if the backup does not tell.
    units : tuple of str
        Further mechanical units of its group.
    path, line : str, int
        Where the task is declared.
    """

    name: str
    robot: str
    units: tuple[str, ...]
    path: str
    line: int


@dataclass(frozen=True, eq=False)
class ControllerData:
    """What a backup says about its controller.

    Parameters
    ----------
    facts : mapping of str to Fact
        Controller, version, serial, options ...
    tasks : sequence of TaskEntry
        Its tasks, from ``backinfo.txt``.
    system, motion : Configuration
        ``SYS.cfg`` and ``MOC.cfg``; empty where they are missing.
    """

    facts: Mapping[str, Fact]
    tasks: Sequence[TaskEntry]
    system: Configuration
    motion: Configuration

    def task_of(self, folder: str) -> TaskEntry | None:
        """Entry of a task's folder."""
        return next((task for task in self.tasks if task.folder.lower() == folder.lower()), None)

    def moving_tasks(self) -> list[MovingTask]:
        """Tasks that move a robot, in the order of ``CAB_TASKS``; a group without ``-Robot`` moves none."""
        groups = {group.value("Name") or "": group for group in self.system.get("MECHANICAL_UNIT_GROUP", [])}
        found = []
        for task in self.system.get("CAB_TASKS", []):
            name = task.value("Name")
            if not name or task.value("MotionTask") is None:
                continue
            group = groups.get(task.value("UseMechanicalUnitGroup") or "")
            if group is None:
                found.append(MovingTask(name, "", (), task.path, task.line))
            elif group.value("Robot"):
                numbered = [key for key in group if key.lower().startswith("mechanicalunit_")]
                units = tuple(group[key] for key in sorted(numbered))
                found.append(MovingTask(name, group.value("Robot") or "", units, task.path, task.line))
        return found


def read_controller(root: str, files: Mapping[str, bytes]) -> ControllerData:
    """Read what a backup says about its controller.

    Parameters
    ----------
    root : str
        Folder of the controller inside the backup.
    files : mapping of str to bytes
        Its files. Copies under ``HOME`` say nothing about the controller.
    """
    found: dict[str, SourceText] = {}
    for path, data in files.items():
        name = PurePosixPath(path).name.lower()
        wanted = name in ("moc.cfg", "sys.cfg", "backinfo.txt", "system.xml", "version.xml")
        if wanted and not path[len(root) :].lower().startswith("home/"):
            found.setdefault(name, SourceText(path, data, ("latin-1",)))
    facts: dict[str, Fact] = {}
    tasks: list[TaskEntry] = []
    if "system.xml" in found:
        _read_system(found["system.xml"], facts)
    if "version.xml" in found:
        _read_version(found["version.xml"], facts)
    if "backinfo.txt" in found:
        tasks = _read_backinfo(found["backinfo.txt"], facts)
    system, motion = (
        read_configuration(found[name].text, found[name].path) if name in found else {}
        for name in ("sys.cfg", "moc.cfg")
    )
    return ControllerData(facts, tasks, system, motion)


def _lines(source: SourceText) -> list[tuple[int, str]]:
    return list(enumerate(re.split(r"\r*\n|\r", source.text), start=1))


def _read_system(source: SourceText, facts: dict[str, Fact]) -> None:
    """``system.xml`` names the system and counts its options."""
    options = []
    for number, line in _lines(source):
        for key, pattern in _XML_VALUES.items():
            match = pattern.search(line)
            if match and match[1].strip():
                facts.setdefault(key, Fact(match[1].strip(), source.path, number))
        options += [(number, match[1]) for match in _XML_OPTION.finditer(line)]
    if options:
        facts["options"] = Fact("; ".join(name for _, name in options), source.path, options[0][0])


def _read_version(source: SourceText, facts: dict[str, Fact]) -> None:
    """``version.xml`` of RobotWare; add-ins have one of their own."""
    if "<Type>RobotWare<" not in source.text:
        return
    for number, line in _lines(source):
        match = re.search(r"<VersionName>([^<]+)<", line)
        if match:
            facts.setdefault("version", Fact(match[1].strip(), source.path, number))


def _read_backinfo(source: SourceText, facts: dict[str, Fact]) -> list[TaskEntry]:
    """``>>SECTION:`` and its lines; a task lists its modules, ``PROGMOD/Main.mod @ HIDDEN``."""
    tasks: list[TaskEntry] = []
    options: list[tuple[int, str]] = []
    section = ""
    for number, text in _lines(source):
        line = text.strip()
        saved = _SAVED.match(line)
        if saved and not section:
            facts["saved"] = Fact(saved[1], source.path, number)
        if line.startswith(">>"):
            section = line[2:].partition(":")[0].upper()
            match = _TASK.match(line)
            if match:
                tasks.append(TaskEntry(match[1], match[2].strip(), match[3].strip(), source.path, number))
        elif line and section == "SYSTEM_ID":
            facts.setdefault("system id", Fact(line, source.path, number))
        elif line and section == "PRODUCTS_ID":
            version = _VERSION.match(line)
            if version:
                facts["version"] = Fact(version[1], source.path, number)
            else:
                options.append((number, line))
        elif line and section.startswith("TASK") and tasks:
            module = _MODULE.match(line)
            if module:
                entry = (module[1].replace("\\", "/"), module[2].strip().upper() == "HIDDEN")
                tasks[-1] = replace(tasks[-1], modules=(*tasks[-1].modules, entry))
    if options:
        facts["options"] = Fact("; ".join(line for _, line in options), source.path, options[0][0])
    return tasks
