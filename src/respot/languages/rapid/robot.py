"""Reads the RAPID files of one controller into the neutral model."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import PurePosixPath

from respot.issues import Issue
from respot.languages.rapid import blocks, machine
from respot.languages.rapid.binding import Binder
from respot.languages.rapid.recognition import recognise
from respot.languages.rapid.run_time import read_run_time
from respot.languages.rapid.symbols import Task, read_module
from respot.languages.rapid.syntax import ENCODINGS, read_statements
from respot.languages.rapid.targets import Targets
from respot.languages.reading import opaque_issues
from respot.program.frames import Frame
from respot.program.robot import ProgramFile, Robot, Routine
from respot.source import SourceText

SUFFIXES = (".mod", ".sys", ".modx", ".sysx", ".prg")


def read_robot(name: str, root: str, files: Mapping[str, bytes]) -> Robot:
    """Read a controller.

    Parameters
    ----------
    name : str
        Name to use where ``system.xml`` gives none.
    root : str
        Folder of the controller inside the backup.
    files : mapping of str to bytes
        Its files by path inside the backup. Copies of modules under ``HOME`` are not live and stay out.
    """
    issues: list[Issue] = []
    read, layouts = _read_modules(files, issues)
    targets = Targets({path: file.source for path, file in read.items()})
    routines: list[Routine] = []
    tools: list[Frame] = []
    bases: list[Frame] = []
    tasks = {
        task: [read_module(path, read[path].program, layouts[path]) for path in paths]
        for task, paths in _tasks(read).items()
    }
    run_times = read_run_time(tasks)
    for task, modules in tasks.items():
        binder = Binder(task, Task(modules), targets, run_times[task])
        for module in modules:
            for symbol in module.symbols.values():
                targets.declared(symbol)
                if symbol.type in ("tooldata", "wobjdata") and symbol.value is not None:
                    (tools if symbol.type == "tooldata" else bases).append(binder.frame(symbol))
        routines += [binder.routine(block, module) for module in modules for block in module.routines.values()]
    return Robot(
        name=machine.system_name(files) or name,
        language="rapid",
        root=root,
        machine=machine.read_machine(files),
        files=read,
        routines=routines,
        targets=list(targets),
        tools=tools,
        bases=bases,
        issues=issues,
    )


def _read_modules(
    files: Mapping[str, bytes], issues: list[Issue]
) -> tuple[dict[str, ProgramFile], dict[str, blocks.Layout]]:
    """Live modules and what each is made of, by path; what was noticed goes to ``issues``."""
    read: dict[str, ProgramFile] = {}
    layouts: dict[str, blocks.Layout] = {}
    for path, data in files.items():
        if not path.lower().endswith(SUFFIXES) or "/home/" in f"/{path.lower()}":
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


def _tasks(read: Mapping[str, ProgramFile]) -> dict[str, list[str]]:
    """Paths by task folder; all files are one task where there are none."""
    tasks: dict[str, list[str]] = {}
    for path in read:
        parts = path.upper().split("/")
        task = next((part for part in parts if part.startswith("TASK") and part[4:].isdigit()), "")
        tasks.setdefault(task, []).append(path)
    return tasks
