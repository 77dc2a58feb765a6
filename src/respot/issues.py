"""Issue records and the one table of their codes.

Every doubt that respot has about a file, a target or a fit becomes an `Issue` with a code from `CODES`; nothing below
the command line prints or exits. Input that makes an answer impossible raises `BadInputError`, which carries its issue.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum


class Level(StrEnum):
    """How serious an issue is: an error means that an answer or a program is missing."""

    INFO = "info"
    WARNING = "warning"
    ERROR = "error"


_I, _W, _E = Level.INFO, Level.WARNING, Level.ERROR

#: code -> (level, what it means). The message of an issue says what happened; this says what the code is for.
CODES: dict[str, tuple[Level, str]] = {
    # input from strangers
    "CANNOT_READ": (_E, "a file is missing or cannot be read"),
    "NO_ROBOT": (_E, "the source holds no robot program that respot knows"),
    "SEVERAL_ROBOTS": (_E, "the source holds more than one robot; one must be named"),
    "UNSAFE_ARCHIVE": (_E, "a backup that cannot be unpacked or copied safely"),
    "NESTED_ARCHIVE": (_W, "an archive inside a backup; it is copied as it is and not opened"),
    "FILE_NAMES": (_I, "file names of an archive that are not plain ASCII, and how they were read"),
    "HALF_BACKUP": (_W, "parts of a backup are missing"),
    "NOT_LIVE": (_I, "program files that the controller does not run from where they lie; copied as they are"),
    "NOT_IN_A_ROBOT": (_W, "program files of a backup that belong to none of its robots"),
    "UNKNOWN_TASK": (_W, "the backup does not tell which robot a task moves"),
    "BAD_TABLE": (_E, "a table cannot be read"),
    "MISSING_COLUMN": (_E, "a table lacks a column that is needed"),
    "NOT_A_NUMBER": (_E, "a cell that must hold a finite number does not"),
    "AMBIGUOUS_NUMBER": (_E, "a number of a table can be read in two ways, with a decimal comma or with thousands"),
    "MIXED_UNITS": (_E, "a table says two units for what needs one"),
    "TABLE_UNITS": (_I, "numbers of a table were converted to mm or degrees"),
    "TABLE_COLUMNS": (_I, "how columns of a table were understood that can be read in more than one way"),
    "TABLE_ROWS": (_I, "rows of a table that are no spots were left out"),
    "PARTLY_ORIENTED": (_I, "some spots of a table have no orientation; none is used"),
    "DUPLICATE_ID": (_E, "the same spot ID stands twice in a table"),
    "BAD_PROFILE": (_E, "a profile of instruction forms cannot be used"),
    "BAD_CALIBRATION": (_E, "a calibration file cannot be used"),
    "BAD_OPTION": (_E, "an option or a combination of options makes no sense"),
    "OUTPUT_EXISTS": (_E, "the output folder exists and is not empty"),
    "CANNOT_WRITE": (_E, "a file or folder cannot be written"),
    "IN_USE": (_E, "another run of respot writes the same folder"),
    "SOURCE_CHANGED": (_E, "a file changed between reading it and writing its successor"),
    "OWN_FOLDER": (_I, "a hidden folder in which respot keeps what undo needs; it is no part of the backup"),
    "BAD_TEMPLATE": (_E, "a plant's template cannot be used, or does not write what is intended"),
    # taking back
    "NOTHING_TO_UNDO": (_E, "a folder holds no conversion that could be taken back"),
    "CHANGED_SINCE": (_E, "a file was changed after respot wrote it"),
    "ORIGINALS_LOST": (_E, "an original that undo needs is missing or damaged"),
    "STAYS_CHANGED": (_W, "a file that the conversion did not write was changed since; it stays as it is"),
    "SET_ASIDE": (_W, "a changed file was set aside for its original to come back"),
    # matching and fitting
    "NO_COMMON_IDS": (_E, "source and reference share no spot ID"),
    "TOO_FEW_PAIRS": (_E, "fewer than four spots are matched"),
    "COLLINEAR_SPOTS": (_E, "the matched spots lie on a line: the rotation about it is not determined"),
    "COPLANAR_SPOTS": (_E, "the matched spots lie in a plane: 12 free parameters are not determined"),
    "NO_SUBSET": (_E, "no subset of spots meets the paper's conditions"),
    "NOT_RIGID": (_I, "a model that is no rigid motion; for comparison only"),
    "SUBSET_NOT_TESTED": (_W, "the paper's method keeps a spot in its subset that its own threshold would drop"),
    "PAPER_AMBIGUOUS": (_I, "what the paper leaves unsaid changes which spots are dropped"),
    "PAPER_COMPARED": (_I, "how far the paper's transform is from the robust one"),
    "UNIT_MISMATCH": (_E, "one of the two lists is in another unit"),
    "ROWS_SHIFTED": (_E, "names and coordinates of a list have slipped against each other"),
    "NOT_CONGRUENT": (_E, "distances between spots differ: the two lists cannot be the same body"),
    "AMBIGUOUS_MATCH": (_E, "spots can be paired in two ways that are as good as each other"),
    "TOO_MANY_SPOTS": (_E, "more spots than geometry can match"),
    "MATCHED_BY_GEOMETRY": (_W, "spots are paired by their places, not by their names"),
    "NAMES_DISAGREE": (_W, "spots of the same name lie at different places"),
    "DOUBTFUL_PAIR": (_W, "a spot paired by its place has a neighbour as near"),
    "NAMES_SPELLED": (_I, "names are the same but for case or separators"),
    "NAMES_BY_RULE": (_W, "names are taken for the same by a rule: leading zeros, prefix, suffix, variant"),
    "PROBABLY_RENAMED": (_W, "a spot without a partner lies where the other list has one without a partner"),
    "UNMATCHED_SOURCE": (_W, "a spot of the source has no partner in the reference"),
    "UNMATCHED_REFERENCE": (_W, "a spot of the reference has no partner in the source"),
    "EXCHANGED_NAMES": (_W, "spots carry each other's names"),
    "ROTATION_NOT_SUPPORTED": (_I, "the data do not support a rotation: a translation alone predicts no worse"),
    "OUTLIER": (_W, "a spot does not follow the model"),
    "TOOL_OFFSET": (_W, "the TCP of the source is wrong by a constant in the tool frame"),
    "TOOL_NOT_DETERMINED": (_E, "the spots do not determine a tool offset: the tool points the same way at all"),
    "TOOL_NOT_TRIED": (_I, "a tool offset was not looked for, since the spots do not determine it"),
    "CONGRUENT_BY_TOOL": (_W, "two lists are the same body after an offset in the tool frame, and not before"),
    "ORIENTATIONS_TURNED": (_W, "the tool frames of two lists differ by a constant turn"),
    "ORIENTATION_CONVENTION": (_W, "orientations of one list are probably written in another convention"),
    "ORIENTATIONS_DISAGREE": (_W, "orientations of two lists do not mean the same tool directions"),
    "JOINTS_NOT_USED": (_W, "joints are not known, or do not belong to the poses: the arm's effects are not tried"),
    "COLUMN_NOT_USED": (_I, "a column of a table cannot be used to explain residuals"),
    "EFFECT_FOUND": (_W, "the residual follows an effect that the rigid transform lacks"),
    "UNEXPLAINED": (_W, "structure is left that no effect explains"),
    "ABSOLUTE_ACCURACY": (_W, "the controller compensates the arm's own errors: effects of the arm are refused"),
    # comparing two states
    "DIFFERENT_ROBOTS": (_E, "two sources hold no robot, or no language, in common"),
    "RUN_TIME_FRAME": (_W, "a tool, base or target differs whose value the program writes while it runs"),
    "OTHER_ROBOT_COMPARED": (_W, "two robots with different serial numbers are compared"),
    # using a stored calibration
    "EFFECT_LEFT_OUT": (_W, "a column that an effect follows is not known: the effect is left out"),
    "ANOTHER_ROBOT": (_E, "a calibration was fitted to another robot"),
    "ANOTHER_SOURCE": (_W, "a calibration is used on another source than it was fitted to"),
    "NO_ORIENTATION": (_E, "orientations are needed and not known"),
    "NO_INTERVAL": (_W, "a calibration does not say how sure it is"),
    "OPTION_UNUSED": (_W, "an option was given that nothing uses"),
    "NOT_FRESH": (_W, "a calibration is held against the very measurements that it was fitted to"),
    "OUT_OF_TOLERANCE": (_W, "a spot is farther from where it is predicted than the tolerance"),
    "PROMISE_NOT_KEPT": (_W, "fresh measurements depart from a calibration by more than its held-out error allows"),
    # planning measurements
    "FEW_CANDIDATES": (_W, "fewer spots are left to measure than were asked for"),
    "NOTHING_TO_SEPARATE": (_I, "a calibration holds no rivals: spots are chosen that make it surer"),
    "NOT_SEPARABLE": (_W, "no spots of the program tell two explanations apart"),
    "NOT_PLANNED": (_W, "what an explanation follows is not known of the spots that may be measured"),
    # reading programs
    "OPAQUE_STATEMENT": (_W, "a statement that no rule knows; it is kept as it is"),
    "UNBALANCED_BLOCK": (_W, "a block or fold is opened and not closed, or closed and not opened"),
    "FORM_DISAGREES": (_W, "the copies of a field of an inline form are not the same"),
    "FORM_NOT_CHANGED": (_E, "a field of an inline form cannot be changed in all its copies"),
    "UNKNOWN_ENCODING": (_W, "the bytes of a file fit no code page of its language"),
    "BINARY_MODULE": (_I, "an encoded module; it is copied as it is"),
    "NOT_A_PROGRAM": (_I, "a file with a program's name that is something else; it is copied as it is"),
    "SEVERAL_MODULES": (_E, "a file with more than one module; it is copied as it is"),
    "UNKNOWN_FRAME": (_E, "the base or work object of a target is not known"),
    "UNKNOWN_TOOL": (_W, "the tool of a target is not known"),
    "UNKNOWN_TARGET": (_E, "a motion goes to a target that is not declared"),
    "UNKNOWN_MODE": (_E, "whether the robot holds the gun or the part at a motion is not known"),
    "MODE_CONTRADICTS": (_W, "a tool or base was measured for the other interpolation mode than a motion uses"),
    "AMBIGUOUS_NAME": (_W, "a global name is declared more than once; the controller cannot load both"),
    "CYCLIC_IMPORT": (_W, "an IMPORT leads back to itself; the name has no value"),
    "CONTRADICTING_FRAMES": (_E, "tool and work object of a motion are both held by the robot, or neither is"),
    "DISPLACED": (_E, "a program displacement may be active where the robot goes to a target"),
    "EXTERNAL_OFFSET": (_W, "code shifts external axes while the robot runs"),
    "LATE_BINDING": (_W, "a routine is chosen while the robot runs; respot does not follow the call"),
    "RUN_TIME_POSE": (_E, "the position of a motion is computed while the robot runs"),
    "RUN_TIME_SHIFT": (_W, "a motion is shifted along the tool by what is computed while the robot runs"),
    "EXTERNAL_TCP": (_E, "external TCP and held gun are mixed: one transform cannot hold for both"),
    "AMBIGUOUS_SPOT": (_E, "a spot ID stands for several different weld targets"),
    # correcting
    "OUT_OF_SCOPE": (_I, "the target's base holds no matched spot; it stays"),
    "NOT_REACHED": (_I, "no routine with a matched spot moves to the target; it stays"),
    "JOINT_TARGET": (_I, "a joint position; it stays"),
    "WORLD_BASE": (
        _E,
        "a target in the world frame of a routine that welds: the program cannot tell if it belongs to the part",
    ),
    "CONFIG_NOT_CHECKED": (_E, "status/turn or confdata of a moved target cannot be computed"),
    "CONFIG_INCONSISTENT": (_E, "status/turn or confdata of a target do not fit its own pose"),
    "OUT_OF_REACH": (_E, "the robot cannot reach a moved target"),
    "OUT_OF_LIMITS": (_E, "a moved target leaves the software limits of an axis"),
    "JOINT_TRAVEL": (_E, "a correction changes how far an axis turns to a target by more than 180 degrees"),
    "NEAR_LIMIT": (_W, "a moved target comes near a software limit"),
    "NEAR_SINGULARITY": (_W, "a moved target comes near a singularity"),
    "BRANCH_CHANGE": (_W, "after the correction the arm changes its branch between two targets"),
    "SAME_BASE_STAYS": (_W, "targets under a base that moves are left where they are: no matched spot is near them"),
    "SHIFT_TOO_LARGE": (_E, "a target would move further than --max-shift"),
    "RESIDUAL_TOO_LARGE": (_E, "a moved target departs from the path's rigid motion by more than --max-residual"),
    "SNAP_UNRESOLVED": (_E, "--snap, and a weld whose name or theoretical position is not settled"),
    "SNAPPED": (_W, "welds were put onto their theoretical positions one by one: the rigid motion is given up"),
    "EXTRAPOLATED": (_W, "a target or spot lies outside the hull of the fitted spots"),
    "SHARED_TARGET": (_E, "a target is used under several bases or by a refused program"),
    "ALREADY_APPLIED": (_E, "this calibration was applied to this source before"),
    "EFFECT_WRITTEN": (_W, "an effect is made good by the points: nobody may put it right elsewhere as well"),
    "EFFECT_NOT_WRITTEN": (_W, "an effect that comes and goes is not written into points"),
    "EFFECT_NOT_KNOWN": (_E, "what an effect follows is not known at a target: the target cannot be corrected"),
    "EFFECTS_TOO_LARGE": (_E, "the pose that lands a target where it should is not found"),
    "NO_KINEMATICS": (_E, "effects of the arm are to be written, and no kinematic model of the robot is known"),
    "WRONG_FRAME": (_E, "spots lie under another frame than is written: the program is wrong, not its points"),
    "FRAME_KEPT": (_W, "a tool or base is off and stays as it is, for other programs use it"),
    "RIGID_PART_KEPT": (_I, "a rigid motion of all points under a base is left out: the registration swallows it"),
    "NOT_CHECKED": (_I, "what respot does not check"),
    "VERIFY_FAILED": (_E, "what was written is not what was intended"),
    # a line of robots
    "BAD_LINE_FILE": (_E, "a line file cannot be used"),
    "UNKNOWN_KEY": (_E, "a line file has a key that respot does not know"),
    "SAME_ROBOT_TWICE": (_E, "a robot stands twice in a line file"),
    "ANOTHER_LINE": (_E, "the output folder belongs to another line"),
    "BAD_LEDGER": (_E, "the ledger of a line cannot be used"),
    "LEDGER_STOPPED": (_E, "the ledger of a line can no longer be written"),
    "NO_CLUSTER": (_E, "a cluster cannot be used"),
    "WORKER_LOST": (_E, "the process that worked on a robot ended"),
    "TIMED_OUT": (_E, "a robot took longer than --timeout"),
    "OUT_OF_MEMORY": (_E, "a robot needs more memory than it may have"),
    "INTERNAL_FAULT": (_E, "a fault of respot"),
    "ROBOT_LEFT_LINE": (_W, "the output folder holds a robot that is no longer in the line file"),
}


@dataclass(frozen=True)
class Issue:
    """One finding, with the place it is about.

    Parameters
    ----------
    code : str
        A key of `CODES`.
    message : str
        What happened and what to do about it, in one or two sentences.
    path : str, optional
        File the issue is about, as the user knows it.
    line, column : int, optional
        Place in the file, counted from 1.
    excerpt : str, optional
        The line itself.
    """

    code: str
    message: str
    path: str | None = None
    line: int | None = None
    column: int | None = None
    excerpt: str | None = None

    def __post_init__(self) -> None:
        if self.code not in CODES:
            raise KeyError(self.code)

    @property
    def level(self) -> Level:
        """Level of the issue's code."""
        return CODES[self.code][0]

    def __str__(self) -> str:
        place = ":".join(str(part) for part in (self.path, self.line, self.column) if part is not None)
        text = f"{place}: {self.code} {self.message}" if place else f"{self.code} {self.message}"
        if self.excerpt:
            text += f"\n    {self.excerpt}"
            if self.column is not None:
                text += f"\n    {' ' * (self.column - 1)}^"
        return text

    def as_json(self) -> dict[str, object]:
        """Record of INTERFACES.md, JSON."""
        return {
            "level": self.level.value,
            "code": self.code,
            "message": self.message,
            "path": self.path,
            "line": self.line,
            "column": self.column,
        }


class BadInputError(Exception):
    """Input or options that make an answer impossible: exit code 2, nothing written."""

    def __init__(self, code: str, message: str, path: str | None = None, line: int | None = None) -> None:
        self.issue = Issue(code, message, path, line)
        super().__init__(str(self.issue))


def has_errors(issues: Iterable[Issue]) -> bool:
    """Whether any issue is an error."""
    return any(issue.level is Level.ERROR for issue in issues)
