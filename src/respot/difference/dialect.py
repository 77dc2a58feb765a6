"""What a comparison must know of a language: how a file is divided, what statements are about, what is a frame."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from scipy.spatial.transform import RigidTransform

from respot.program.robot import Robot
from respot.program.statement import Statement
from respot.source import Span

#: A part of a datum in upper case: its name, then indices and names of fields.
Path = tuple[str, ...]
#: An index that is computed: any element.
ANY = "*"
_HEAD = re.compile(r"[\w$]+")
_STEP = re.compile(r"[\[{]([^\]}]*)[\]}]|\.\s*([\w$]+)")

#: What statements are about, the most important first.
RANK = ("motion", "target", "weld", "speed", "zone", "io", "frame", "call", "flow", "wait", "data", "header", "unread")


def ranked(abouts: Iterable[str]) -> tuple[str, ...]:
    """Return what some statements are about, each once, the most important first."""
    return tuple(sorted(dict.fromkeys(abouts), key=lambda about: RANK.index(about) if about in RANK else len(RANK)))


def path_of(text: str) -> Path:
    """Return the path of a part: ``A{2}.TRANS`` is ``("A", "2", "TRANS")``."""
    head = _HEAD.match(text)
    steps = [] if head is None else [head[0].upper()]
    for match in _STEP.finditer(text, 0 if head is None else head.end()):
        if match[2]:
            steps.append(match[2].upper())
        elif match[1].strip():
            steps += [part if part.isdecimal() else ANY for part in "".join(match[1].split()).split(",")]
    return tuple(steps)


@dataclass(frozen=True)
class Datum:
    """A name that a statement declares or gives a value, in upper case, with its type; empty for an assignment."""

    name: str
    type: str


@dataclass(frozen=True, eq=False)
class FrameValue:
    """The value of a tool, base, load or other frame in its declaration.

    Parameters
    ----------
    kind : str
        ``tool``, ``base``, ``load`` or ``frame``.
    name : str
        As declared.
    pose : RigidTransform or None
        ``tool2flange``, ``base2world``; None where the literal does not give it.
    fields : mapping of str to (float or str)
        Everything else that it says, by name.
    span : tuple
        Its literal.
    """

    kind: str
    name: str
    pose: RigidTransform | None
    span: Span
    fields: Mapping[str, float | str] = field(default_factory=dict)


@dataclass(frozen=True)
class Dialect:
    """A language as a comparison sees it.

    Parameters
    ----------
    heads, ends : frozenset of str
        Kinds of statements that begin and end a routine, or any other part whose statements are in order.
    data : frozenset of str
        Kinds of declarations; outside routines their order says nothing.
    data_heads : frozenset of str
        Heads of parts that hold nothing but data.
    comments, folds : frozenset of str
        Kinds of lines that say nothing to the robot.
    name_of : callable
        Name that a head gives its part.
    declared : callable
        What a declaration declares.
    frames : callable
        Frames among it: ``frames(path, statement)``.
    noise : callable
        Kind of noise that a changed statement is, given what it declares; empty if it is none.
    about : callable
        What a statement is about: ``motion``, ``speed``, ``io`` ...
    aspects : callable
        What of a changed statement differs, the most important first.
    companions : callable
        Names of data that take their name from a point's, in one order for all points.
    persistent : callable
        Whether a controller saves the value that a datum of this declaration has while the robot runs.
    typed : callable
        Whether the spelling of a datum's value shows that a person wrote it, not the controller.
    values : callable
        Every value that a declaration gives, by the part of the datum that it is the value of:
        ``values(path, statement, records)``.
    records : callable
        Type and name of the fields of each record that a robot's programs declare.
    local_data, writing : frozenset of str
        Kinds of statements that declare a name in a routine, and of those that give a datum a value.
    left : re.Pattern
        Finds what such a statement writes: its last group that matched, or the whole match.
    precise : bool
        Whether the reading knows that code changes a datum; otherwise it may be that nobody knows.
    writers : frozenset of str
        Routines of the system, in upper case, that write into their arguments.
    first_is_main : bool
        Whether the first routine of a file is the one that is started.
    """

    heads: frozenset[str]
    ends: frozenset[str]
    data: frozenset[str]
    data_heads: frozenset[str]
    comments: frozenset[str]
    folds: frozenset[str]
    name_of: Callable[[Statement], str]
    declared: Callable[[str, Statement], Sequence[Datum]]
    frames: Callable[[str, Statement], Sequence[FrameValue]]
    noise: Callable[[Statement, Sequence[Datum]], str]
    about: Callable[[Statement], str]
    aspects: Callable[[Statement, Statement], tuple[str, ...]]
    companions: Callable[[str], Sequence[str]]
    persistent: Callable[[Statement], bool]
    typed: Callable[[Statement], bool]
    values: Callable[[str, Statement, Mapping[str, Sequence[tuple[str, str]]]], Mapping[Path, str]]
    records: Callable[[Robot], Mapping[str, Sequence[tuple[str, str]]]]
    local_data: frozenset[str]
    writing: frozenset[str]
    left: re.Pattern[str]
    precise: bool
    writers: frozenset[str] = frozenset()
    first_is_main: bool = False
