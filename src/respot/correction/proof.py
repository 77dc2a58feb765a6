"""Reads written files again and compares them with what was intended, as a reader who does not know how they were made.

The robot is read from the new bytes. Outside the numbers of changed literals and the one header nothing may differ, and
every changed number must say the intended value to half its last digit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from respot.correction.correction import Correction
from respot.correction.flange import apart, flanges
from respot.correction.points import PointEdit
from respot.languages import Language
from respot.program.robot import ProgramFile, Robot
from respot.program.targets import Number
from respot.source import SourceText, Span
from respot.tolerance import (
    ANGLE_DECIMALS,
    FLANGE_DEG,
    FLANGE_MM,
    LENGTH_DECIMALS,
    QUATERNION_DECIMALS,
    NumberStyle,
)

#: Decimals that a field must have at least to say what is intended.
_DECIMALS = {
    **dict.fromkeys("XYZxyz", LENGTH_DECIMALS),
    **dict.fromkeys("ABC", ANGLE_DECIMALS),
    **dict.fromkeys(("q1", "q2", "q3", "q4"), QUATERNION_DECIMALS),
}


class VerifyError(Exception):
    """What was written is not what was intended.

    Parameters
    ----------
    message : str
        What, with the file.
    path : str, optional
        The file.
    line : int, optional
        Line of what was written.
    """

    def __init__(self, message: str, path: str | None = None, line: int | None = None) -> None:
        super().__init__(message)
        self.path, self.line = path, line


def prove(correction: Correction, old: Mapping[str, bytes], new: Mapping[str, bytes]) -> None:
    """Prove that new files are the old ones with the intended numbers.

    Parameters
    ----------
    correction : Correction
        What was intended.
    old, new : mapping of str to bytes
        The backup before and as it was written.

    Raises
    ------
    VerifyError
        With the file, and the target where one is wrong.
    """
    changed = {path for path in old if new.get(path) != old[path]}
    if set(old) != set(new) or changed - set(correction.files):
        stray = sorted((set(old) ^ set(new)) | (changed - set(correction.files)))
        raise VerifyError(f"{stray[0]}: is not as it was, though nothing of it should change")
    robots = correction.language.read_robots(
        correction.robot.name, correction.robot.root, new, correction.language.forms
    )
    robot = next((found for found in robots if found.task == correction.robot.task), None)
    if robot is None:
        raise VerifyError(f"{correction.robot.name} is not found again in what was written")
    if correction.depth.changes:
        _check_flanges(correction, robot)
    literals_before, literals_after = _literals(correction.robot), _literals(robot)
    by_path: dict[str, dict[Span, PointEdit]] = {}
    for edit in correction.edits:
        by_path.setdefault(edit.path, {})[edit.edit.span] = edit
    for path in correction.files:
        before, after = literals_before.get(path, []), literals_after.get(path, [])
        edits = by_path.get(path, {})
        _compare(path, correction.language, correction.robot.files[path], robot.files[path], before, after, edits)


#: Span of a literal and its numbers by field.
_Literal = tuple[Span, Mapping[str, Number]]


def _literals(robot: Robot) -> dict[str, list[_Literal]]:
    """Literals that a correction may change, by file and in order: targets, offsets along the base, frames."""
    found: dict[str, list[_Literal]] = {}
    for target in robot.targets:
        found.setdefault(target.path, []).append((target.span, target.numbers))
    for move in robot.moves():
        if move.offset is not None:
            named = zip("xyz", move.offset.numbers, strict=True)
            numbers = {name: number for name, number in named if number is not None}
            found.setdefault(move.offset.path, []).append((move.offset.span, numbers))
    used = (frame for move in robot.moves() for frame in (move.base, move.tool) if frame is not None)
    for frame in {id(frame): frame for frame in (*robot.tools, *robot.bases, *used)}.values():
        for literal in (frame.literal, frame.user_literal):
            if literal is not None:
                found.setdefault(literal.path, []).append((literal.span, literal.numbers))
    unique = {path: dict(literals) for path, literals in found.items()}
    return {path: sorted(literals.items(), key=lambda literal: literal[0]) for path, literals in unique.items()}


def _check_flanges(correction: Correction, robot: Robot) -> None:
    """Check the law of depth on what was written: every motion puts the flange where it was intended, all others too.

    Raises
    ------
    VerifyError
        With the motion.
    """
    before, after = list(correction.robot.moves()), list(robot.moves())
    if len(before) != len(after):
        raise VerifyError(f"there are {len(after)} motions where there were {len(before)}")
    intended = flanges(before, correction.goals, correction.offsets)
    shift, turn = apart(intended, flanges(after))
    unknown = np.isnan(intended).any(axis=(1, 2)) != np.isnan(flanges(after)).any(axis=(1, 2))
    wrong = np.flatnonzero(unknown | (shift > FLANGE_MM) | (turn > FLANGE_DEG))
    if len(wrong):
        move = before[int(wrong[0])]
        message = (
            f"{move.path}:{move.line}: {move.target or move.instruction} puts the flange {shift[wrong[0]]:.4f} mm and "
            f"{turn[wrong[0]]:.5f} degrees from where it was intended"
        )
        raise VerifyError(message, move.path, move.line)


def _compare(
    path: str,
    language: Language,
    old: ProgramFile,
    new: ProgramFile,
    before: Sequence[_Literal],
    after: Sequence[_Literal],
    edits: Mapping[Span, PointEdit],
) -> None:
    if len(before) != len(after):
        raise VerifyError(f"{path}: has {len(after)} positions where it had {len(before)}", path)
    old_cuts, new_cuts = _header(old, language), _header(new, language)
    for (old_span, old_numbers), (new_span, new_numbers) in zip(before, after, strict=True):
        edit = edits.get(old_span)
        if edit is None:
            continue
        numbers = {name: new_numbers[name] for name in edit.intended if name in new_numbers}
        kept = [name for name in numbers if name in old_numbers]
        old_cuts += [old_numbers[name].span for name in kept]
        new_cuts += _added(new.source, new_span, [numbers[name] for name in numbers if name not in old_numbers])
        new_cuts += [numbers[name].span for name in kept]
        _check_values(path, new.source, edit, numbers)
    if _cut(old.source.text, old_cuts) != _cut(new.source.text, new_cuts):
        line = _first_difference(old.source.text, old_cuts, new.source, new_cuts)
        raise VerifyError(f"{path}: differs outside the numbers of moved targets, first in line {line}", path, line)


def _check_values(path: str, source: SourceText, edit: PointEdit, numbers: Mapping[str, Number]) -> None:
    for name, value in edit.intended.items():
        number = numbers.get(name)
        if number is None:
            if abs(value) > 1e-3:
                raise VerifyError(f"{path}: {edit.target} lacks {name}", path, edit.line)
            continue
        # half a digit of a number that was cut short would excuse what was cut
        style = NumberStyle.of(source.text[slice(*number.span)]).at_least(_DECIMALS.get(name, 0))
        if abs(float(number.value) - value) > style.half_digit * (1.0 + 1e-6) + 1e-12:
            line = source.place(number.span[0])[0]
            message = f"{path}: {edit.target} has {name} {number.value}, {value:.9f} was intended"
            raise VerifyError(message, path, line)


def _header(file: ProgramFile, language: Language) -> list[Span]:
    """Span of our header, if any."""
    place = language.header_place(file)
    return [place] if place is not None and place[1] > place[0] else []


def _added(source: SourceText, literal: Span, numbers: Sequence[Number]) -> list[Span]:
    """Spans of members that a relative motion got in addition: from the comma before each to its last digit."""
    spans = []
    for number in numbers:
        comma = source.text.rfind(",", literal[0], number.span[0])
        spans.append((comma, number.span[1]))
    return spans


def _first_difference(old: str, old_spans: Sequence[Span], new: SourceText, new_spans: Sequence[Span]) -> int:
    """Line of a new text at which it departs from the old one outside of spans."""
    first, second = _cut(old, old_spans), _cut(new.text, new_spans)
    same = next((at for at, pair in enumerate(zip(first, second, strict=False)) if pair[0] != pair[1]), len(first))
    for start, end in sorted(new_spans):
        if same < start:
            break
        same += end - start
    return new.place(min(same, len(new.text)))[0]


def _cut(text: str, spans: Sequence[Span]) -> str:
    parts, position = [], 0
    for start, end in sorted(spans):
        parts.append(text[position:start])
        position = end
    parts.append(text[position:])
    return "".join(parts)
