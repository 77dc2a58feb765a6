"""Reads the RAPID files of one controller into the neutral model."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import PurePosixPath

from respot.issues import Issue
from respot.languages.rapid import blocks, machine
from respot.languages.rapid.binding import Binder
from respot.languages.rapid.symbols import Module, Task, read_module
from respot.languages.rapid.syntax import ENCODINGS, read_statements
from respot.languages.rapid.targets import Targets
from respot.languages.reading import opaque_issues
from respot.program.frames import Frame
from respot.program.robot import ProgramFile, Robot, Routine
from respot.program.statement import Statement
from respot.source import SourceText

SUFFIXES = (".mod", ".sys", ".modx", ".sysx", ".prg")
#: First bytes of modules that RobotWare encodes (facts: rapid.md 4.2).
_ENCODED = (b"\xfc", b"\xfd", b"\xfe")
_DISPLACING = ("pdispset", "pdispon")


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
    read: dict[str, ProgramFile] = {}
    layouts: dict[str, blocks.Layout] = {}
    for path, data in files.items():
        if not path.lower().endswith(SUFFIXES) or "/home/" in f"/{path.lower()}":
            continue
        if data.startswith(_ENCODED) and b"MODULE" not in data.upper():
            issues.append(Issue("BINARY_MODULE", "an encoded module; it is copied as it is", path))
            continue
        source = SourceText(path, data, ENCODINGS)
        statements = read_statements(source.text, source.line_starts)
        layouts[path] = blocks.layout(statements)
        program = layouts[path].name or PurePosixPath(path).stem
        read[path] = ProgramFile(source, program, statements)
        issues += opaque_issues(read[path])
        issues += blocks.block_issues(path, statements)
    targets = Targets({path: file.source for path, file in read.items()})
    routines: list[Routine] = []
    tools: list[Frame] = []
    bases: list[Frame] = []
    for paths in _tasks(read).values():
        modules = [read_module(path, read[path].program, layouts[path]) for path in paths]
        found, frames = _read_task(modules, {path: read[path] for path in paths}, targets)
        routines += found
        tools += frames["tooldata"]
        bases += frames["wobjdata"]
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


def _tasks(read: Mapping[str, ProgramFile]) -> dict[str, list[str]]:
    """Paths by task folder; all files are one task where there are none."""
    tasks: dict[str, list[str]] = {}
    for path in read:
        parts = path.upper().split("/")
        task = next((part for part in parts if part.startswith("TASK") and part[4:].isdigit()), "")
        tasks.setdefault(task, []).append(path)
    return tasks


def _read_task(
    modules: list[Module], read: Mapping[str, ProgramFile], targets: Targets
) -> tuple[list[Routine], dict[str, list[Frame]]]:
    task = Task(modules)
    statements = [(path, statement) for path, file in read.items() for statement in file.statements]
    binder = Binder(task, targets, _written(statements), _displaced(statements))
    frames: dict[str, list[Frame]] = {"tooldata": [], "wobjdata": []}
    for module in modules:
        for symbol in module.symbols.values():
            targets.declared(symbol)
            if symbol.type in frames and symbol.value is not None:
                frames[symbol.type].append(binder.frame(symbol))
    routines = [binder.routine(block, module) for module in modules for block in module.routines.values()]
    return routines, frames


def _written(statements: list[tuple[str, Statement]]) -> set[str]:
    """Names that code assigns to, whole or in part."""
    assignments = (
        node
        for _, statement in statements
        if statement.kind in ("assignment", "compact_if")
        for node in ([statement.node] if statement.kind == "assignment" else statement.node.all("assignment"))
    )
    return {node.nodes[0].nodes[0].text.lower() for node in assignments}


def _displaced(statements: list[tuple[str, Statement]]) -> str:
    for path, statement in statements:
        if statement.kind == "call":
            names = statement.node.tokens("NAME")
            if names and names[0].text.lower() in _DISPLACING:
                return f"{names[0].text} at {path}:{statement.line} displaces the positions of this task"
    return ""
