"""Reads the KRL files of one robot into the neutral model."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import PurePosixPath

from respot.issues import Issue
from respot.languages.forms import Forms
from respot.languages.krl import blocks, machine
from respot.languages.krl.binding import Binder
from respot.languages.krl.controller import read_facts
from respot.languages.krl.forms import FORMS, Data, read_forms
from respot.languages.krl.frames import Frames
from respot.languages.krl.readings import frame_readings
from respot.languages.krl.recognition import recognise
from respot.languages.krl.run_time import RunTime, read_run_time
from respot.languages.krl.symbols import Scope, Symbols, is_own, module_key, read_definitions, read_symbols
from respot.languages.krl.syntax import ENCODINGS, read_statements
from respot.languages.krl.targets import Targets
from respot.languages.layout import live_programs
from respot.languages.reading import opaque_issues
from respot.program.forms import Form
from respot.program.robot import Fact, Machine, ProgramFile, Robot
from respot.source import SourceText

SUFFIXES = (".src", ".dat", ".sub")
#: Types of points. A FRAME becomes a target only where a motion goes to it: most are tools and bases.
_POINTS = frozenset(("POS", "E6POS", "E3POS", "AXIS", "E6AXIS", "E3AXIS"))


def read_robots(name: str, root: str, files: Mapping[str, bytes], forms: Forms = FORMS) -> list[Robot]:
    """Read a controller: one robot, as KUKA builds them.

    Parameters
    ----------
    name : str
        Name to use where ``am.ini`` gives none.
    root : str
        Folder of the robot inside the backup.
    files : mapping of str to bytes
        The robot's files by path inside the backup.
    forms : Forms
        Instruction forms.
    """
    issues: list[Issue] = []
    read: dict[str, ProgramFile] = {}
    live = live_programs("krl", SUFFIXES, root, files)
    for path, data in files.items():
        if path in live:
            if recognise(data) == "krl":
                read[path] = _read_file(path, data)
            else:
                issues.append(Issue("NOT_A_PROGRAM", "is no KRL module; it is copied as it is", path))
    unread = {path: data for path, data in files.items() if path in live and path not in read}
    for path, file in read.items():
        issues += opaque_issues(file)
        issues += blocks.block_issues(path, file.statements)
    code = {path: blocks.routines(file.statements) for path, file in read.items() if not path.lower().endswith(".dat")}
    scopes = list(_scopes(read))
    symbols = Symbols(scopes, [read_definitions(path, read[path].statements, module_key(path)) for path in code])
    run_time = read_run_time({path: (module_key(path), found) for path, found in code.items()}, forms, symbols)
    frames = Frames(symbols, run_time)
    targets = Targets({path: file.source for path, file in read.items()})
    for scope in scopes:
        for symbol in scope.symbols.values():
            if symbol.type in _POINTS and not symbol.name.startswith("$"):
                targets.declared(symbol)
    binder = Binder(symbols, frames, targets, run_time, forms)
    routines = binder.bind({path: (read[path].program, found) for path, found in code.items()})
    issues += [*symbols.issues(), *binder.issues]
    facts = read_facts(root, files, scopes)
    robot = Robot(
        name=facts["controller"].value if "controller" in facts else name,
        language="krl",
        root=root,
        machine=_machine(scopes, facts),
        files=read,
        routines=routines,
        targets=list(targets),
        tools=frames.declared("TOOL"),
        bases=frames.declared("BASE"),
        issues=issues,
        find_forms=lambda: _forms(read, code, symbols, forms),
        writes=lambda path, name: _is_written(symbols, run_time, path, name),
        find_readings=lambda: tuple(frame_readings(read, unread, frames)),
    )
    return [robot]


def _is_written(symbols: Symbols, run_time: RunTime, path: str, name: str) -> bool:
    """Whether code may change what a data list declares."""
    scope = symbols.scopes.get(module_key(path))
    symbol = None if scope is None or scope.path != path else scope.symbols.get("".join(name.split()).upper())
    return symbol is not None and run_time.writes(symbol)


def _forms(read: Mapping[str, ProgramFile], programs: Iterable[str], symbols: Symbols, forms: Forms) -> Sequence[Form]:
    data = Data(symbols, {path: file.source for path, file in read.items()})
    return [form for path in programs for form in read_forms(read[path].source, read[path].statements, data, forms)]


def _read_file(path: str, data: bytes) -> ProgramFile:
    source = SourceText(path, data, ENCODINGS)
    return ProgramFile(source, PurePosixPath(path).stem, read_statements(source.text, source.line_starts))


def _scopes(read: Mapping[str, ProgramFile]) -> Iterable[Scope]:
    """Data lists, those of the robot's own folder first: ``KRC/STEU`` holds a second ``$config.dat``."""
    for path in sorted(read, key=lambda path: not is_own(path)):
        if path.lower().endswith(".dat"):
            file = read[path]
            everywhere = file.program.lower() in ("$config", "$machine", "$robcor")
            yield read_symbols(path, file.statements, module_key(path), everywhere)


def _machine(scopes: Iterable[Scope], facts: Mapping[str, Fact]) -> Machine:
    """Machine data of the robot's own folder, with the line of each value."""
    scope = next((scope for scope in scopes if scope.module.endswith("$MACHINE")), None)
    lines = {} if scope is None else {key: symbol.line for key, symbol in scope.symbols.items()}
    return replace(machine.read_machine(scope), facts=facts, lines=lines)
