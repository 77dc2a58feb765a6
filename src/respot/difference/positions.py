"""How far targets, offsets and frames are from where they were: as programmed, and seen from the world."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from scipy.spatial.transform import RigidTransform

from respot.difference.canonical import single
from respot.difference.findings import Change, Moved, Place, Shift
from respot.difference.index import Index
from respot.geometry import turn_deg
from respot.program.moves import BaseOffset, Move
from respot.program.targets import Target, TargetKind
from respot.tolerance import SAME_POSITION_MM, SAME_ROTATION_DEG

#: ABB's 9E9 and its like: the axis is not used (facts: rapid.md 2.1).
_UNUSED = 8e8
_CONFIGURATION = frozenset(("S", "T", "cf1", "cf4", "cf6", "cfx"))
_POSE = frozenset((*"XYZABC", *"xyz", "q1", "q2", "q3", "q4"))


@dataclass(frozen=True)
class Tolerance:
    """What counts as the same place.

    Parameters
    ----------
    mm : float
        Distance, also of an external axis.
    deg : float
        Turn, also of a joint.
    """

    mm: float = 0.0
    deg: float = 0.0

    @classmethod
    def of(cls, mm: float, deg: float | None = None) -> Tolerance:
        """Return a tolerance; without a turn it is the one that moves the end of a lever of a metre as far."""
        return cls(mm, math.degrees(mm / 1000.0) if deg is None else deg)

    def holds(self, shift: Shift | None) -> bool:
        """Whether a shift is none."""
        if shift is None:
            return True
        return shift.distance <= max(self.mm, SAME_POSITION_MM) and shift.turn <= max(self.deg, SAME_ROTATION_DEG)


def shift_between(old: RigidTransform, new: RigidTransform) -> Shift:
    """Return how far a pose moved: along the axes of what it is seen from, mm, and its turn, degrees."""
    dx, dy, dz = (new.translation - old.translation).tolist()
    return Shift(dx, dy, dz, float(turn_deg(old, new)))


class Comparer:
    """Compares the targets of two sides.

    Parameters
    ----------
    old, new : Index
        Both sides.
    tolerance : Tolerance
        What counts as the same place.
    """

    def __init__(self, old: Index, new: Index, tolerance: Tolerance) -> None:
        self._old = old
        self._new = new
        self._tolerance = tolerance

    def target(self, old: Target, new: Target, same_text: bool) -> tuple[Moved | None, bool]:
        """Compare a target with its older state.

        Parameters
        ----------
        old, new : Target
            The target.
        same_text : bool
            Its literal is written the same; only its base can have moved it.

        Returns
        -------
        Moved or None
            How it moved; None where it did not, or no further than the tolerance.
        bool
            Its numbers differ, but within the tolerance.
        """
        uses = self._uses(old, new)
        if same_text and all(self._same_base(*pair) for pair in uses):
            return None, False
        shift = None if same_text else _own_shift(old, new)
        configuration = {} if same_text else _changes(old, new, _CONFIGURATION.__contains__)
        posed = _POSE if old.components and new.components else frozenset()
        axes = {} if same_text else _changes(old, new, lambda name: name not in _CONFIGURATION | posed)
        small = {name: change for name, change in axes.items() if self._small(change, name)}
        axes = {name: change for name, change in axes.items() if name not in small}
        world, (before, after) = self._world(uses, old, new)
        if shift is None and world is not None and all(self._same_base(*pair) for pair in uses):
            world = Shift(0.0, 0.0, 0.0)  # digits that no controller holds
        still = self._tolerance.holds(shift) and self._tolerance.holds(world)
        if still and not configuration and not axes:
            rounded = bool(small) or (shift is not None and not Tolerance().holds(shift))
            return None, rounded
        return _moved(old, new, shift, world, before, after, configuration, axes, self._new), False

    def offset(self, old: tuple[BaseOffset, Move], new: tuple[BaseOffset, Move]) -> tuple[Moved | None, bool]:
        """Compare a translation along the base with its older state; results as of `target`."""
        ways = [
            [0.0 if number is None else float(number.value) for number in offset.numbers]
            for offset, _ in (old, new)
        ]  # fmt: skip
        if [single(value) for value in ways[0]] == [single(value) for value in ways[1]]:
            return None, False
        shift = Shift(*(after - before for before, after in zip(*ways, strict=True)))
        if self._tolerance.holds(shift):
            return None, True
        move = new[1]
        return (
            Moved(
                target=f"{move.instruction}@{move.line}",
                program=move.program,
                routine=move.routine,
                kind="offset",
                old=Place(old[0].path, old[0].line),
                new=Place(new[0].path, new[0].line),
                shift=shift,
                tool=_names(old[1].tool, move.tool),
                base=_names(old[1].base, move.base),
            ),
            False,
        )

    def _uses(self, old: Target, new: Target) -> list[tuple[Move, Move]]:
        """Pair the motions to a target: under the same base on both sides, else the first on each."""
        before, after = self._old.uses.get(id(old), ()), self._new.uses.get(id(new), ())
        if not before or not after:
            return []
        if len(before) == 1 and len(after) == 1:
            return [(before[0], after[0])]
        by_base = {_base_name(move): move for move in reversed(before)}
        pairs = [(by_base[_base_name(move)], move) for move in after if _base_name(move) in by_base]
        return pairs or [(before[0], after[0])]

    def _same_base(self, old: Move, new: Move) -> bool:
        if old.external_tcp and new.external_tcp:
            return True  # spots are compared in the part
        if old.external_tcp != new.external_tcp:
            return False
        return self._old.signature(old.base)[1:] == self._new.signature(new.base)[1:]

    def _world(
        self, uses: Sequence[tuple[Move, Move]], old: Target, new: Target
    ) -> tuple[Shift | None, tuple[Move | None, Move | None]]:
        """Return the largest shift seen from the world, and the motions that it is of."""
        best: Shift | None = None
        chosen: tuple[Move | None, Move | None] = uses[0] if uses else _firsts(self._old, self._new, old, new)
        if old.pose is None or new.pose is None:
            return None, chosen
        for before, after in uses:
            if before.external_tcp != after.external_tcp or before.base2spots is None or after.base2spots is None:
                continue
            shift = shift_between(before.base2spots * old.pose, after.base2spots * new.pose)
            if best is None or shift.distance > best.distance:
                best, chosen = shift, (before, after)
        return best, chosen

    def _small(self, change: Change, name: str) -> bool:
        if not isinstance(change[0], float) or not isinstance(change[1], float):
            return False
        limit = self._tolerance.deg if name.lower().startswith(("a", "rax")) else self._tolerance.mm
        return abs(change[1] - change[0]) <= limit


def _firsts(old_index: Index, new_index: Index, old: Target, new: Target) -> tuple[Move | None, Move | None]:
    before, after = old_index.uses.get(id(old)), new_index.uses.get(id(new))
    return before[0] if before else None, after[0] if after else None


def _base_name(move: Move) -> tuple[str, bool]:
    return "" if move.base is None else move.base.name.upper(), move.external_tcp


def _own_shift(old: Target, new: Target) -> Shift | None:
    """Return the shift as programmed; None for joints, unknown poses, and where the numbers are the same."""
    if old.pose is None or new.pose is None:
        return None
    if list(map(single, old.components)) == list(map(single, new.components)):
        return None
    return shift_between(old.pose, new.pose)


def _changes(old: Target, new: Target, wanted: Callable[[str], bool]) -> dict[str, Change]:
    """Return the fields that differ as a controller holds them."""
    found: dict[str, Change] = {}
    for name in dict.fromkeys((*old.numbers, *new.numbers)):
        if not wanted(name):
            continue
        before, after = old.number(name), new.number(name)
        known = [value for value in (before, after) if value is not None]
        if len(known) == 2 and (single(known[0]) == single(known[1]) or min(map(abs, known)) >= _UNUSED):
            continue
        found[name] = (before, after)
    return found


def _names(old: object, new: object) -> Change:
    return None if old is None else str(old), None if new is None else str(new)


def _moved(
    old: Target,
    new: Target,
    shift: Shift | None,
    world: Shift | None,
    before: Move | None,
    after: Move | None,
    configuration: Mapping[str, Change],
    axes: Mapping[str, Change],
    index: Index,
) -> Moved:
    both_known = old.pose is not None and new.pose is not None
    return Moved(
        target=new.name,
        program=after.program if after is not None else index.robot.files[new.path].program,
        routine=after.routine if after is not None else "",
        kind="joints" if new.kind is TargetKind.JOINTS else "pose",
        old=Place(old.path, old.line),
        new=Place(new.path, new.line),
        shift=(shift or Shift(0.0, 0.0, 0.0)) if both_known else None,
        world=world,
        tool=_names(*(None if move is None else move.tool for move in (before, after))),
        base=_names(*(None if move is None else move.base for move in (before, after))),
        configuration=configuration,
        axes=axes,
        spot_id=after.spot_ids[0] if after is not None and after.weld and after.spot_ids else "",
    )


def pair_targets(old: Sequence[Target], new: Sequence[Target]) -> Iterator[tuple[Target | None, Target | None]]:
    """Pair the targets of one statement: those with names of their own by name, the others in their order.

    A target that has no partner is paired with None.
    """
    if len(old) == 1 and len(new) == 1:
        yield old[0], new[0]
        return
    named = {target.name.upper(): target for target in old if target.declared}
    unnamed = [target for target in old if not target.declared]
    left = {id(target) for target in old}
    for target in new:
        partner = named.get(target.name.upper()) if target.declared else unnamed.pop(0) if unnamed else None
        if partner is not None and id(partner) in left:
            left.discard(id(partner))
            yield partner, target
        else:
            yield None, target
    for target in old:
        if id(target) in left:
            yield target, None
