"""Reads the RAPID files of one controller into the neutral model."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import PurePosixPath

from respot.issues import Issue
from respot.languages.forms import Forms
from respot.languages.layout import live_programs
from respot.languages.rapid import blocks, machine
from respot.languages.rapid.binding import Binder
from respot.languages.rapid.controller import read_controller
from respot.languages.rapid.forms import FORMS
from respot.languages.rapid.recognition import recognise
from respot.languages.rapid.run_time import RunTime, read_run_time
from respot.languages.rapid.symbols import Module, Task, read_module
from respot.languages.rapid.syntax import ENCODINGS, read_statements
from respot.languages.rapid.targets import Targets
from respot.languages.rapid.tasks import missing_modules, share_tasks
from respot.languages.reading import opaque_issues
from respot.program.frames import Frame, FrameReading
from respot.program.robot import ProgramFile, Robot, Routine
from respot.program.targets import Target
from respot.source import SourceText

SUFFIXES = (".mod", ".sys", ".modx", ".sysx", ".prg")


def read_robots(name: str, root: str, files: Mapping[str, bytes], forms: Forms = FORMS) -> list[Robot]:
    """Read a controller: one robot, or one for each task that moves one.

    Tasks that move nothing belong to the first robot. Every task keeps its own names; persistent data of one name in
    several tasks are seen across all of them (facts: rapid.md 7).

    Parameters
    ----------
    name : str
        Name to use where ``system.xml`` gives none.
    root : str
        Folder of the controller inside the backup.
    files : mapping of str to bytes
        Its files by path inside the backup. Copies of modules that are not live stay out.
    forms : Forms
        Instruction forms.

    Returns
    -------
    list of Robot
        Several are named ``system task``, have their ``task`` set and share ``root``.
    """
    issues: list[Issue] = []
    read, layouts = _read_modules(root, files, issues)
    data = read_controller(root, files)
    issues += missing_modules(root, files, data)
    tasks = {
        task: [read_module(path, read[path].program, layouts[path]) for path in paths]
        for task, paths in _tasks(root, read).items()
    }
    run_times = read_run_time(tasks, forms)
    bound = {
        task: _bind(task, modules, {module.path: read[module.path] for module in modules}, run_times[task], forms)
        for task, modules in tasks.items()
    }
    moving = [task for task, found in bound.items() if any(routine.moves for routine in found.routines)]
    shares = share_tasks(root, data, list(tasks), moving)
    controller = data.facts["controller"].value if "controller" in data.facts else name
    writes = _writes(tasks, run_times)
    robots = []
    for share in shares:
        parts = [bound[task] for task in share.folders]
        own = [issue for issue in issues if len(shares) == 1 or share.holds(_task(root, issue.path or ""))]
        robots.append(
            Robot(
                name=f"{controller} {share.name}" if len(shares) > 1 else controller,
                language="rapid",
                root=root,
                machine=machine.read_machine(data, share.moving, share.folder),
                files={path: file for path, file in read.items() if _task(root, path) in share.folders},
                routines=[routine for part in parts for routine in part.routines],
                targets=[target for part in parts for target in part.targets],
                tools=[frame for part in parts for frame in part.tools],
                bases=[frame for part in parts for frame in part.bases],
                issues=[*own, *share.issues, *(issue for part in parts for issue in part.issues)],
                task=share.name if len(shares) > 1 else "",
                writes=writes,
                find_readings=partial(_readings, root, parts, share.folders, files, read),
            )
        )
    return robots


def _writes(tasks: Mapping[str, Sequence[Module]], run_times: Mapping[str, RunTime]) -> Callable[[str, str], bool]:
    """Return what tells whether code of any task may change a datum of a module."""
    modules = {module.path: (module, run_times[task]) for task, found in tasks.items() for module in found}

    def writes(path: str, name: str) -> bool:
        module, run_time = modules.get(path, (None, None))
        symbol = None if module is None else module.symbols.get(name.lower())
        return symbol is not None and run_time is not None and bool(run_time.changes(symbol))

    return writes


@dataclass(frozen=True, eq=False)
class _Bound:
    """What the modules of a task hold."""

    routines: list[Routine]
    targets: list[Target]
    tools: list[Frame]
    bases: list[Frame]
    issues: list[Issue]
    #: of module files of the task that cannot be read, and of others that code may load
    readings: Callable[[Mapping[str, bytes], Mapping[str, bytes]], list[FrameReading]]


def _readings(
    root: str,
    parts: Sequence[_Bound],
    folders: Sequence[str],
    files: Mapping[str, bytes],
    read: Mapping[str, ProgramFile],
) -> Sequence[FrameReading]:
    """Where the tasks of a robot read tools and work objects."""
    live = live_programs("rapid", SUFFIXES, root, files)
    others = {path: data for path, data in files.items() if path not in read and path.lower().endswith(SUFFIXES)}
    others = {path: data for path, data in others.items() if recognise(data) != "binary"}
    unread = {path: data for path, data in others.items() if path in live and _task(root, path) in folders}
    loadable = {path: data for path, data in others.items() if path not in live}
    return [reading for part in parts for reading in part.readings(unread, loadable)]


def _bind(
    task: str, modules: Sequence[Module], files: Mapping[str, ProgramFile], run_time: RunTime, forms: Forms
) -> _Bound:
    targets = Targets({path: file.source for path, file in files.items()})
    binder = Binder(task, Task(modules), targets, run_time, forms)
    tools: list[Frame] = []
    bases: list[Frame] = []
    for module in modules:
        for symbol in module.symbols.values():
            if symbol.type in ("tooldata", "wobjdata") and symbol.initial is not None:
                frame = binder.frame(symbol, module)
                if frame is not None:
                    (tools if symbol.type == "tooldata" else bases).append(frame)
    routines = [binder.routine(block, module) for module in modules for block in module.routines.values()]
    return _Bound(routines, list(targets), tools, bases, binder.issues, partial(binder.readings, files))


def _read_modules(
    root: str, files: Mapping[str, bytes], issues: list[Issue]
) -> tuple[dict[str, ProgramFile], dict[str, blocks.Layout]]:
    """Live modules and what each is made of, by path; what was noticed goes to ``issues``."""
    read: dict[str, ProgramFile] = {}
    layouts: dict[str, blocks.Layout] = {}
    live = live_programs("rapid", SUFFIXES, root, files)
    for path, data in files.items():
        if path not in live:
            continue
        kind = recognise(data)
        if kind == "other":
            issues.append(Issue("NOT_A_PROGRAM", "is no RAPID module; it is copied as it is", path))
            continue
        if kind == "binary":
            issues.append(Issue("BINARY_MODULE", "an encoded module; it is copied as it is", path))
            continue
        source = SourceText(path, data, ENCODINGS)
        statements = read_statements(source.text, source.line_starts)
        layouts[path] = blocks.layout(statements)
        if len(layouts[path].modules) > 1:
            message = "holds more than one MODULE, as no controller saves it; it is copied as it is: split it"
            issues.append(Issue("SEVERAL_MODULES", message, path, layouts[path].modules[1].line))
            continue
        program = layouts[path].name or PurePosixPath(path).stem
        read[path] = ProgramFile(source, program, statements)
        issues += opaque_issues(read[path])
        issues += blocks.block_issues(path, statements)
    return read, layouts


def _tasks(root: str, read: Mapping[str, ProgramFile]) -> dict[str, list[str]]:
    """Paths by task folder, in the order of their numbers; all files are one task where there are none."""
    tasks: dict[str, list[str]] = {}
    for path in read:
        tasks.setdefault(_task(root, path), []).append(path)
    return {task: tasks[task] for task in sorted(tasks, key=lambda task: (len(task), task))}


def _task(root: str, path: str) -> str:
    """Folder of the task that a file belongs to: ``TASK1``, or what lies in ``RAPID`` under the task's own name."""
    parts = path[len(root) :].upper().split("/")[:-1]
    found = [part for part in parts if part.startswith("TASK") and part[4:].isdigit()]
    named = parts[:1] == ["RAPID"] and len(parts) > 1 and parts[1].startswith("T_")
    return found[0] if found else parts[1] if named else ""
