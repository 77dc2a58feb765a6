"""Tools, bases, loads and other frames that changed, came or went."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping

from respot.difference.canonical import TARGET, Mask, single
from respot.difference.dialect import FrameValue
from respot.difference.findings import Change, FrameChange, Place
from respot.difference.index import Index
from respot.difference.positions import Tolerance, shift_between
from respot.difference.programs import Side
from respot.program.statement import Statement


class FrameComparer:
    """Compares declarations of frames.

    Parameters
    ----------
    old, new : Index
        Both sides.
    tolerance : Tolerance
        What counts as the same place.
    """

    def __init__(self, old: Index, new: Index, tolerance: Tolerance) -> None:
        self._moves = [_moves(index) for index in (old, new)]
        self._tolerance = tolerance

    def changed(
        self, old: tuple[Side, Statement, FrameValue], new: tuple[Side, Statement, FrameValue]
    ) -> tuple[FrameChange | None, bool]:
        """Compare a frame with its older state.

        Returns
        -------
        FrameChange or None
            What changed; None where it did not, or no further than the tolerance.
        bool
            Its numbers differ, but within the tolerance.
        """
        (old_side, old_statement, before), (new_side, new_statement, after) = old, new
        known = before.pose is not None and after.pose is not None
        shift = shift_between(before.pose, after.pose) if before.pose is not None and after.pose is not None else None
        fields = _fields(before.fields, after.fields)
        texts = _text(old_statement, before), _text(new_statement, after)
        exact = Tolerance().holds(shift)
        if known and exact and not fields and not _same_numbers(old_statement, before, new_statement, after):
            fields = {"value": texts}  # such as a user frame and an object frame that make the same base
        if known and not fields and self._tolerance.holds(shift):
            return None, not exact
        name = after.name
        moves = self._moves[1][name.upper()]
        places = Place(old_side.path, old_statement.line), Place(new_side.path, new_statement.line)
        return FrameChange(after.kind, name, "changed", *places, shift, fields, texts, moves), False

    def lone(self, side: Side, statement: Statement, value: FrameValue, removed: bool) -> FrameChange:
        """Return a frame that only one side has."""
        place = Place(side.path, statement.line)
        text = _text(statement, value)
        moves = self._moves[0 if removed else 1][value.name.upper()]
        if removed:
            return FrameChange(value.kind, value.name, "removed", place, None, texts=(text, ""), moves=moves)
        return FrameChange(value.kind, value.name, "added", None, place, texts=("", text), moves=moves)


def frames_in(side: Side, statement: Statement) -> dict[str, FrameValue]:
    """Return the frames that a declaration holds, by name in upper case; those that are targets are none."""
    if statement.shape.tree is None or statement.kind not in side.dialect.data:
        return {}
    targets = {target.span for target in side.index.targets_in(side.path, statement)}
    found = side.dialect.frames(side.path, statement)
    return {value.name.upper(): value for value in found if value.span not in targets}


def frame_masks(values: Mapping[str, FrameValue], names: Iterable[str]) -> Iterator[Mask]:
    """Yield the literals of the named frames: they are compared by what they mean."""
    for name in names:
        yield values[name].span, TARGET


def _text(statement: Statement, value: FrameValue) -> str:
    return " ".join(statement.text[slice(*value.span)].split())


def _same_numbers(old: Statement, before: FrameValue, new: Statement, after: FrameValue) -> bool:
    """Whether the literals hold the same numbers, but for the signs of a quaternion."""
    found = []
    for statement, value in ((old, before), (new, after)):
        numbers = statement.numbers()
        inside = zip(numbers.values, numbers.spans, strict=True)
        found.append(
            [abs(single(number)) for number, span in inside if value.span[0] <= span[0] and span[1] <= value.span[1]]
        )
    return found[0] == found[1]


def _moves(index: Index) -> Counter[str]:
    """Count the motions that use a frame or a load, by its name in upper case."""
    found: Counter[str] = Counter()
    for move in index.robot.moves():
        for used in (move.tool, move.base, move.load):
            if used is not None:
                found[used.name.upper()] += 1
    return found


def _fields(old: Mapping[str, float | str], new: Mapping[str, float | str]) -> dict[str, Change]:
    found: dict[str, Change] = {}
    for name in dict.fromkeys((*old, *new)):
        before, after = old.get(name), new.get(name)
        if isinstance(before, float) and isinstance(after, float):
            if single(before) != single(after):
                found[name] = (before, after)
        elif before is None or after is None or str(before).upper() != str(after).upper():
            found[name] = (before, after)
    return found
