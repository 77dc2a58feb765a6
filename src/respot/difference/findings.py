"""What a comparison finds: plain records, all places with file and line on both sides."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from respot.issues import Issue


@dataclass(frozen=True)
class Place:
    """A line of a file of a backup, from 1."""

    path: str
    line: int


@dataclass(frozen=True)
class Shift:
    """How far something moved: along x, y and z in mm, and its turn in degrees.

    Parameters
    ----------
    dx, dy, dz : float
        New minus old, mm.
    turn : float
        Angle of the rotation between both, degrees.
    """

    dx: float
    dy: float
    dz: float
    turn: float = 0.0

    @property
    def distance(self) -> float:
        """Length of the way, mm."""
        return float((self.dx**2 + self.dy**2 + self.dz**2) ** 0.5)


#: Old and new value of something; None where a side lacks it.
Change = tuple[float | str | None, float | str | None]


@dataclass(frozen=True)
class Moved:
    """A target that is elsewhere.

    Parameters
    ----------
    target : str
        Its name in the new program.
    program, routine : str
        Where the new program moves to it first; the routine is empty where nothing does.
    kind : str
        ``pose``, ``joints``, or ``offset``: a translation along the base on top of a target.
    old, new : Place
        Its literals.
    shift : Shift or None
        As programmed: in its own base, or along the base's axes for an offset; None for joints and where a pose is not
        known.
    world : Shift or None
        Seen from the world, or with an external TCP from the part; None where that is not known.
    tool, base : Change
        Names of the frames it is used with; a text that is the same on both sides did not change.
    configuration, axes : mapping of str to Change
        Status and turn or confdata, and joints and external axes, that changed; of a pose that is not known all its
        numbers.
    spot_id : str
        ID of the weld spot; empty if it is none.
    """

    target: str
    program: str
    routine: str
    kind: str
    old: Place
    new: Place
    shift: Shift | None
    world: Shift | None = None
    tool: Change = (None, None)
    base: Change = (None, None)
    configuration: Mapping[str, Change] = field(default_factory=dict)
    axes: Mapping[str, Change] = field(default_factory=dict)
    spot_id: str = ""

    @property
    def largest(self) -> float:
        """The larger of both ways, mm; what the table of shifts is sorted by."""
        return max((shift.distance for shift in (self.shift, self.world) if shift is not None), default=0.0)


@dataclass(frozen=True)
class FrameChange:
    """A tool, base, load or other frame that changed, came or went.

    Parameters
    ----------
    kind : str
        ``tool``, ``base``, ``load`` or ``frame``.
    name : str
        As the program refers to it.
    change : str
        ``changed``, ``added`` or ``removed``.
    old, new : Place or None
        Its declarations.
    shift : Shift or None
        Between the poses; None where one is not known.
    fields : mapping of str to Change
        Other values that changed, such as ``mass``.
    texts : tuple of str
        Both declarations as written; empty on the side that has none.
    moves : int
        Motions of the new program, or of the old one if it is gone, that use it.
    """

    kind: str
    name: str
    change: str
    old: Place | None
    new: Place | None
    shift: Shift | None = None
    fields: Mapping[str, Change] = field(default_factory=dict)
    texts: tuple[str, str] = ("", "")
    moves: int = 0


@dataclass(frozen=True)
class Named:
    """A target that came or went: its name, the program that holds it, its place, and its numbers as written."""

    target: str
    program: str
    place: Place
    text: str


@dataclass(frozen=True)
class Renamed:
    """A datum or routine that has another name: recognised by its value and its use.

    Parameters
    ----------
    old_name, new_name : str
        Its names.
    type : str
        Declared type, or what kind of routine or record it is.
    program : str
        Where it lives.
    old, new : Place
        Its declarations.
    """

    old_name: str
    new_name: str
    type: str
    program: str
    old: Place
    new: Place


@dataclass(frozen=True)
class CodeChange:
    """Statements that differ.

    Parameters
    ----------
    path, old_path : str
        File on the new and on the old side.
    kind : str
        What it is about: ``motion``, ``speed``, ``zone``, ``weld``, ``io``, ``call``, ``flow`` ...; ``moved`` is a
        block that stands elsewhere.
    routine : str
        Routine; empty outside.
    old_lines, new_lines : sequence of str
        The statements as written, without indentation.
    old, new : Place or None
        Their first lines.
    aspects : tuple of str
        Everything that a changed statement is about; the first is its kind.
    """

    path: str
    old_path: str
    kind: str
    routine: str
    old_lines: Sequence[str]
    new_lines: Sequence[str]
    old: Place | None
    new: Place | None
    aspects: tuple[str, ...] = ()


@dataclass(frozen=True)
class Noise:
    """A difference that says nothing about what the robot does.

    Parameters
    ----------
    kind : str
        One of `NOISE`.
    path : str
        File, of the new side where there is one.
    line : int or None
        Line.
    old, new : str
        Texts, where they are worth showing.
    count : int
        How many such differences it stands for.
    name : str
        Datum that drifted.
    """

    kind: str
    path: str
    line: int | None = None
    old: str = ""
    new: str = ""
    count: int = 1
    name: str = ""


#: Kinds of noise, and what each is called.
NOISE = {
    "header": "edit counters (&REL)",
    "last_used": "last used values of inline forms (LAST_...)",
    "drift": "values that the program itself writes",
    "rounding": "shifts within the tolerance",
    "spelling": "numbers and words spelled otherwise",
    "comments": "comments",
    "folds": "texts of folds",
    "respot": "headers and records of respot",
    "order": "declarations in another order",
    "blanks": "blanks and empty lines",
    "line_ends": "line ends",
    "encoding": "code page or byte order mark",
    "stamps": "dates and counters of the backup itself",
}


@dataclass(frozen=True)
class FileChange:
    """A file that came, went, or differs and is no program that was read.

    Parameters
    ----------
    path : str
        Inside the backup; of the new side where there is one.
    change : str
        ``added``, ``removed``, ``changed`` or ``moved``.
    kind : str
        ``program``, ``parameters``, ``text`` or ``binary``.
    old_bytes, new_bytes : int or None
        Sizes.
    old_path : str
        Where it was, if it moved.
    """

    path: str
    change: str
    kind: str
    old_bytes: int | None
    new_bytes: int | None
    old_path: str = ""


@dataclass
class RobotDifference:
    """Everything that differs between two states of one robot.

    Parameters
    ----------
    name : str
        Its name, of the new side where there is one.
    language : str
        Its language.
    status : str
        ``compared``; ``added`` or ``removed`` where only one side has it.
    targets : int
        Targets that both sides have.
    issues : list of Issue
        What a person should know of it.
    """

    name: str
    language: str
    status: str = "compared"
    targets: int = 0
    moved: list[Moved] = field(default_factory=list)
    frames: list[FrameChange] = field(default_factory=list)
    added: list[Named] = field(default_factory=list)
    removed: list[Named] = field(default_factory=list)
    renamed: list[Renamed] = field(default_factory=list)
    code: list[CodeChange] = field(default_factory=list)
    files: list[FileChange] = field(default_factory=list)
    noise: list[Noise] = field(default_factory=list)
    issues: list[Issue] = field(default_factory=list)

    @property
    def same(self) -> bool:
        """Whether nothing differs but noise."""
        return self.status == "compared" and not any(
            (self.moved, self.frames, self.added, self.removed, self.renamed, self.code, self.files)
        )
