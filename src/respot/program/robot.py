"""A robot as its backup describes it: files, modules, routines, frames."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

from respot.issues import Issue
from respot.program.forms import Form
from respot.program.frames import Frame, FrameReading
from respot.program.moves import Move
from respot.program.statement import Statement
from respot.program.targets import Target
from respot.source import SourceText


@dataclass(frozen=True)
class Call:
    """A call of a routine."""

    name: str
    line: int


@dataclass(frozen=True)
class Unread:
    """A statement that no rule knows; what it does to the robot is not known either."""

    line: int
    text: str
    reason: str


@dataclass(frozen=True, eq=False)
class Routine:
    """A routine.

    Parameters
    ----------
    name, program : str
        Its name and the program it stands in.
    path : str
        File.
    line : int
        Line of its head.
    steps : sequence of Move or Call
        Its motions and calls, in order.
    unread : sequence of Unread
        Statements that no rule knows.
    task : str
        Task that runs it, where a controller has several.
    service : bool
        By its name it looks after the gun, not the part.
    """

    name: str
    program: str
    path: str
    line: int
    steps: Sequence[Move | Call]
    unread: Sequence[Unread] = ()
    task: str = ""
    service: bool = False

    @cached_property
    def moves(self) -> list[Move]:
        """Its motions, in order."""
        return [step for step in self.steps if isinstance(step, Move)]

    @cached_property
    def calls(self) -> list[str]:
        """Names of the routines it calls, in order."""
        return [step.name for step in self.steps if isinstance(step, Call)]


@dataclass(frozen=True, eq=False)
class ProgramFile:
    """A file of a program, read."""

    source: SourceText
    program: str
    statements: Sequence[Statement]


@dataclass(frozen=True)
class Fact:
    """What a backup says about its controller, and where.

    Parameters
    ----------
    value : str
        As the file spells it.
    path : str
        File.
    line : int
        Line, from 1.
    """

    value: str
    path: str
    line: int


@dataclass(frozen=True, eq=False)
class Machine:
    """The robot's own data as plain values; kinematic models are made from them.

    Parameters
    ----------
    model : str
        Robot type as the backup names it; empty if it does not.
    values : mapping of str to object
        Values of the machine data; of several robots of one controller only those of this one.
    paths : sequence of str
        Files they come from.
    facts : mapping of str to Fact
        What a person asks a controller for first: ``"controller"``, ``"version"``, ``"serial"``, ``"robot type"``,
        ``"absolute accuracy"``, ``"options"`` or ``"tech packs"``, ``"task"``; only what the backup says.
    lines : mapping of str to int
        Line of a value in its file, where ``values`` are single values and not instances with a line of their own.
    """

    model: str = ""
    values: Mapping[str, object] = field(default_factory=dict)
    paths: Sequence[str] = ()
    facts: Mapping[str, Fact] = field(default_factory=dict)
    lines: Mapping[str, int] = field(default_factory=dict)


def _never(path: str, name: str) -> bool:
    """Say that no code writes a datum."""
    del path, name
    return False


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
    task : str
        Task that moves it, where one controller moves several robots; empty otherwise. Such robots share ``root``.
    find_forms : callable
        Finds its inline forms, of which not every job asks.
    writes : callable
        ``writes(path, name)``: whether code may give a datum declared in a file another value while the robot runs.
    find_readings : callable
        Finds where its code reads tools and bases, of which not every job asks.
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
    task: str = ""
    find_forms: Callable[[], Sequence[Form]] = tuple
    writes: Callable[[str, str], bool] = _never
    find_readings: Callable[[], Sequence[FrameReading]] = tuple

    @cached_property
    def forms(self) -> Sequence[Form]:
        """Its inline forms, with all copies of their fields."""
        return self.find_forms()

    @cached_property
    def readings(self) -> Sequence[FrameReading]:
        """Where its code takes the value of a tool or base, other than to move under it."""
        return self.find_readings()

    @property
    def programs(self) -> list[str]:
        """Names of the programs, in order of their files."""
        return list(dict.fromkeys(file.program for file in self.files.values()))

    def moves(self) -> Iterator[Move]:
        """Every motion of every routine."""
        for routine in self.routines:
            yield from routine.moves
