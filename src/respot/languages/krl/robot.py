"""Reads the KRL files of one robot into the neutral model."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import PurePosixPath

from respot.issues import Issue
from respot.languages.krl import blocks, machine
from respot.languages.krl.binding import Binder
from respot.languages.krl.symbols import Scope, Symbols, read_symbols
from respot.languages.krl.syntax import ENCODINGS, read_statements
from respot.languages.krl.targets import Targets
from respot.languages.reading import opaque_issues
from respot.program.robot import ProgramFile, Robot
from respot.program.statement import Statement
from respot.source import SourceText

SUFFIXES = (".src", ".dat", ".sub")
_MOTIONS = frozenset(("motion", "relative_motion", "circular_motion"))
#: Types of points. A FRAME becomes a target only where a motion goes to it: most are tools and bases.
_POINTS = frozenset(("POS", "E6POS", "E3POS", "AXIS", "E6AXIS", "E3AXIS"))
_FRAME_NAMES = ("$TOOL", "$BASE", "FDAT_ACT")


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
    read = {path: _read_file(path, data) for path, data in files.items() if path.lower().endswith(SUFFIXES)}
    for path, file in read.items():
        issues += opaque_issues(file)
        issues += blocks.block_issues(path, file.statements)
    scopes = list(_scopes(read))
    symbols = Symbols(scopes)
    frames = machine.Frames(symbols)
    targets = Targets({path: file.source for path, file in read.items()})
    for scope in scopes:
        for symbol in scope.symbols.values():
            if symbol.type in _POINTS and not symbol.name.startswith("$"):
                targets.declared(symbol)
    code = {path: blocks.routines(file.statements) for path, file in read.items() if not path.lower().endswith(".dat")}
    binder = Binder(symbols, frames, targets, _written(read), _framing(code))
    routines = [binder.routine(block, read[path].program, path) for path, found in code.items() for block in found]
    return Robot(
        name=_name(files) or name,
        language="krl",
        root=root,
        machine=machine.read_machine(symbols.scopes.get("$MACHINE")),
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
    # KRC/STEU holds a second $config.dat and $machine.dat; the robot's own come last and win
    for path in sorted(read, key=lambda path: "/r1/" in f"/{path.lower()}"):
        if path.lower().endswith(".dat"):
            file = read[path]
            everywhere = file.program.lower() in ("$config", "$machine")
            yield read_symbols(path, file.statements, file.program, everywhere)


def _written(read: Mapping[str, ProgramFile]) -> dict[str, set[str]]:
    """Names that code assigns to, whole or in part, with the modules that do."""
    written: dict[str, set[str]] = {}
    for path, file in read.items():
        if path.lower().endswith(".dat"):
            continue
        for statement in file.statements:
            if statement.kind == "assignments":
                for assignment in statement.node.all("assignment"):
                    name = assignment.nodes[0].tokens("NAME")[0].text.upper()
                    written.setdefault(name, set()).add(file.program.upper())
    return written


def _framing(code: Mapping[str, list[blocks.Routine]]) -> set[str]:
    """Routines that move or set frames, themselves or through what they call."""
    calls: dict[str, set[str]] = {}
    framing: set[str] = set()
    for found in code.values():
        for block in found:
            key = block.name.upper()
            calls[key] = {_called(statement) for statement in block.body if statement.kind == "call"}
            if "BAS" in calls[key] or any(_sets_frames(statement) for statement in block.body):
                framing.add(key)
    growing = True
    while growing:
        more = {name for name, called in calls.items() if name not in framing and called & framing}
        framing |= more
        growing = bool(more)
    return framing


def _sets_frames(statement: Statement) -> bool:
    if statement.kind in _MOTIONS:
        return True
    return statement.kind == "assignments" and statement.source.lstrip().upper().startswith(_FRAME_NAMES)


def _called(statement: Statement) -> str:
    return statement.node.tokens("NAME")[0].text.upper()


def _name(files: Mapping[str, bytes]) -> str:
    for path, data in files.items():
        if PurePosixPath(path).name.lower() == "am.ini":
            return machine.archive_name(SourceText(path, data).text)
    return ""
