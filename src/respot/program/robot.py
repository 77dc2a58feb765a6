"""A robot as its backup describes it: files, modules, routines, frames."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from respot.issues import Issue
from respot.program.frames import Frame
from respot.program.moves import Move
from respot.program.statement import Statement
from respot.program.targets import Target
from respot.source import SourceText


@dataclass(frozen=True, eq=False)
class Routine:
    """A routine: its motions and the names of the routines it calls, in order."""

    name: str
    program: str
    path: str
    line: int
    moves: Sequence[Move]
    calls: Sequence[str]


@dataclass(frozen=True, eq=False)
class ProgramFile:
    """A file of a program, read."""

    source: SourceText
    program: str
    statements: Sequence[Statement]


@dataclass(frozen=True, eq=False)
class Machine:
    """The robot's own data as plain values; kinematic models are made from them."""

    model: str = ""
    values: Mapping[str, object] = field(default_factory=dict)
    paths: Sequence[str] = ()


@dataclass(frozen=True, eq=False)
class Robot:
    """One robot of a backup.

    Parameters
    ----------
    name : str
        From the backup's own data, else the folder's name.
    language : str
        ``"krl"`` or ``"rapid"``.
    root : str
        Folder of the robot inside the backup, with a trailing ``/`` unless it is the backup itself.
    machine : Machine
        Robot data.
    files : mapping of str to ProgramFile
        Every program file that was read, by path inside the backup.
    routines : sequence of Routine
        All routines with their motions.
    targets : sequence of Target
        Every literal target, used or not.
    tools, bases : sequence of Frame
        The declared frames.
    issues : sequence of Issue
        What was noticed while reading.
    """

    name: str
    language: str
    root: str
    machine: Machine
    files: Mapping[str, ProgramFile]
    routines: Sequence[Routine]
    targets: Sequence[Target]
    tools: Sequence[Frame]
    bases: Sequence[Frame]
    issues: Sequence[Issue]

    @property
    def programs(self) -> list[str]:
        """Names of the programs, in order of their files."""
        return list(dict.fromkeys(file.program for file in self.files.values()))

    def moves(self) -> Iterator[Move]:
        """Every motion of every routine."""
        for routine in self.routines:
            yield from routine.moves
