"""Where KRL code takes the value of a tool or base, other than to move under it.

``$BASE=BASE_DATA[1]`` takes a base into force, and motions say themselves what is in force. Any other mention is a
reading: of a numbered frame, or of what is in force (``$BASE``, ``$TOOL``), from which the controller also tells where
the robot is (``$POS_ACT``, ``FORWARD``).
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterator, Mapping

from respot.languages.krl.frames import Frames
from respot.languages.krl.run_time import MOTIONS, left_of
from respot.languages.krl.symbols import is_own
from respot.program.frames import FrameReading, Role
from respot.program.robot import ProgramFile
from respot.program.statement import OPAQUE, Statement

#: ``bas.src`` hands tools and bases to motions; its ways are those of the reader.
_SYSTEM = frozenset(("bas",))
_TRIVIA = frozenset(("comment", "fold", "end_fold"))
#: Names that are, or are made of, frames; no number, one that is computed: any of them.
_NAMES = r"(?P<kind>BASE|TOOL)_DATA(?![\w$])(?:\s*\[\s*(?P<number>\d+)\s*\])?"
_FORCE = r"\$(?P<force>BASE|TOOL)(?:_C)?(?![\w$])"
_PLACE = r"\$POS_\w+|(?<![\w$])(?:FORWARD|INVERSE)(?=\s*\()"
_FRAMES = re.compile(rf"(?<![\w$]){_NAMES}|{_FORCE}|{_PLACE}", re.IGNORECASE)
#: What a file that is not understood may move under.
_UNDER = re.compile(rf"{_FRAMES.pattern}|(?<![\w$])(?:BAS\s*\(|FDAT_ACT(?!\w))", re.IGNORECASE)
_ROLES: Mapping[str, Role] = {"BASE": "base", "TOOL": "tool"}


def frame_readings(
    files: Mapping[str, ProgramFile], unread: Mapping[str, bytes], frames: Frames
) -> Iterator[FrameReading]:
    """Yield every reading of a tool or base.

    Parameters
    ----------
    files : mapping of str to ProgramFile
        Programs and data lists by path.
    unread : mapping of str to bytes
        Program files that are no KRL.
    frames : Frames
        The numbered tools and bases.
    """
    for path, file in files.items():
        if file.program.lower() not in _SYSTEM:
            yield from _in_file(path, file, frames)
    for path, data in unread.items():
        if _UNDER.search(data.decode("latin-1")):
            for role in _ROLES.values():
                yield FrameReading(None, role, "a file that is not understood may use it", path, 1)


def _in_file(path: str, file: ProgramFile, frames: Frames) -> Iterator[FrameReading]:
    starts = [statement.start for statement in file.statements]
    seen = -1
    for match in _FRAMES.finditer(file.source.text):
        row = bisect_right(starts, match.start()) - 1
        statement = file.statements[row] if row >= 0 else None
        if statement is None or row == seen or match.start() >= statement.end or statement.kind in _TRIVIA:
            continue
        seen = row
        yield from _in_statement(path, statement, frames)


def _in_statement(path: str, statement: Statement, frames: Frames) -> Iterator[FrameReading]:
    if statement.kind in (OPAQUE, "import_"):
        text, start, end = statement.text, statement.start, statement.end
        mentions = [(match, "code reads it") for match in _FRAMES.finditer(text, start, end)]
    else:
        mentions = list(_mentions(statement))
        yield from _given_again(path, statement, frames)
    for match, what in mentions:
        kind, number, force = match["kind"], match["number"], match["force"]
        if kind:
            frame = None if number is None else frames.numbered(kind.upper(), int(number))
            yield FrameReading(frame, _ROLES[kind.upper()], what, path, statement.line)
        else:
            name = match[0].upper()
            for role in (_ROLES[force.upper()],) if force else tuple(_ROLES.values()):
                yield FrameReading(None, role, f"code reads {name}, which depends on it", path, statement.line)


def _mentions(statement: Statement) -> Iterator[tuple[re.Match[str], str]]:
    """Yield what a statement reads of frames, and the words for it."""
    node = statement.node
    taken: dict[int, str] = {}
    for assignment in node.walk():
        if assignment.kind == "assignment":
            left, right = assignment.nodes[0], assignment.nodes[-1]
            taken[left.span[0]] = ""
            if left_of(assignment) in ("$BASE", "$TOOL"):
                made = "" if right.kind == "reference" else f"{left.text} is made of it"
                taken |= {part.span[0]: made for part in right.walk() if part.kind == "reference"}
    if statement.kind in MOTIONS:  # to go where the robot is, is to stay there
        taken |= {operand.span[0]: "" for operand in node.all("reference") if operand.text.upper().startswith("$POS_")}
    for part in statement.find("reference", "function_call"):
        what = taken.get(part.span[0], "code reads it")
        match = _FRAMES.match(statement.text, part.span[0])
        if what and match is not None:
            yield match, what


def _given_again(path: str, statement: Statement, frames: Frames) -> Iterator[FrameReading]:
    """Yield a frame that a data list gives a value in more than one line."""
    if statement.kind != "assignments" or not path.lower().endswith(".dat"):
        return
    for assignment in statement.node.all("assignment"):
        match = _FRAMES.match(statement.text, assignment.nodes[0].span[0])
        if match is None or not match["number"]:
            continue
        frame = frames.numbered(match["kind"].upper(), int(match["number"]))
        value = frame.literal
        if value is None or is_own(value.path) != is_own(path):  # the robot's own data list hides others
            continue
        if (value.path, value.span) != (path, assignment.nodes[-1].span):
            what = "another line gives it a value as well"
            yield FrameReading(frame, _ROLES[match["kind"].upper()], what, path, statement.line)
