"""Reads the KRL files of one robot into the neutral model."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import PurePosixPath

from respot.issues import Issue
from respot.languages.krl import blocks, machine
from respot.languages.krl.binding import Binder
from respot.languages.krl.recognition import recognise
from respot.languages.krl.run_time import read_run_time
from respot.languages.krl.symbols import Scope, Symbols, is_own, module_key, read_symbols
from respot.languages.krl.syntax import ENCODINGS, read_statements
from respot.languages.krl.targets import Targets
from respot.languages.reading import opaque_issues
from respot.program.robot import ProgramFile, Robot
from respot.source import SourceText

SUFFIXES = (".src", ".dat", ".sub")
#: Types of points. A FRAME becomes a target only where a motion goes to it: most are tools and bases.
_POINTS = frozenset(("POS", "E6POS", "E3POS", "AXIS", "E6AXIS", "E3AXIS"))


def read_robot(name: str, root: str, files: Mapping[str, bytes]) -> Robot:
    """Read a robot.

    Parameters
    ----------
    name : str
        Name to use where ``am.ini`` gives none.
    root : str
        Folder of the robot inside the backup.
    files : mapping of str to bytes
        The robot's files by path inside the backup.
    """
    issues: list[Issue] = []
    read: dict[str, ProgramFile] = {}
    for path, data in files.items():
        if path.lower().endswith(SUFFIXES):
            if recognise(data) == "krl":
                read[path] = _read_file(path, data)
            else:
                issues.append(Issue("NOT_A_PROGRAM", "is no KRL module; it is copied as it is", path))
    for path, file in read.items():
        issues += opaque_issues(file)
        issues += blocks.block_issues(path, file.statements)
    code = {path: blocks.routines(file.statements) for path, file in read.items() if not path.lower().endswith(".dat")}
    run_time = read_run_time({module_key(path): found for path, found in code.items()})
    scopes = list(_scopes(read))
    symbols = Symbols(scopes)
    frames = machine.Frames(symbols, run_time)
    targets = Targets({path: file.source for path, file in read.items()})
    for scope in scopes:
        for symbol in scope.symbols.values():
            if symbol.type in _POINTS and not symbol.name.startswith("$"):
                targets.declared(symbol)
    binder = Binder(symbols, frames, targets, run_time)
    routines = [binder.routine(block, read[path].program, path) for path, found in code.items() for block in found]
    machines = [scope for scope in scopes if scope.module.endswith("$MACHINE")]
    return Robot(
        name=_name(files) or name,
        language="krl",
        root=root,
        machine=machine.read_machine(machines[0] if machines else None),
        files=read,
        routines=routines,
        targets=list(targets),
        tools=frames.declared("TOOL"),
        bases=frames.declared("BASE"),
        issues=issues,
    )


def _read_file(path: str, data: bytes) -> ProgramFile:
    source = SourceText(path, data, ENCODINGS)
    return ProgramFile(source, PurePosixPath(path).stem, read_statements(source.text, source.line_starts))


def _scopes(read: Mapping[str, ProgramFile]) -> Iterable[Scope]:
    """Data lists, those of the robot's own folder first: ``KRC/STEU`` holds a second ``$config.dat``."""
    for path in sorted(read, key=lambda path: not is_own(path)):
        if path.lower().endswith(".dat"):
            file = read[path]
            everywhere = file.program.lower() in ("$config", "$machine")
            yield read_symbols(path, file.statements, module_key(path), everywhere)


def _name(files: Mapping[str, bytes]) -> str:
    for path, data in files.items():
        if PurePosixPath(path).name.lower() == "am.ini":
            return machine.archive_name(SourceText(path, data).text)
    return ""
