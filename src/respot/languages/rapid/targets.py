"""Literal positions of RAPID: robtargets and jointtargets, declared, in arrays and records, or in the code."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from respot.geometry import pose, rotation_from_quaternion
from respot.languages.literals import TargetTable
from respot.languages.rapid.symbols import Aggregate, Symbol, Value
from respot.program.targets import Number, Target, TargetKind
from respot.tolerance import QUATERNION_NORM

ROBTARGET_FIELDS = (
    ("x", "y", "z"),
    ("q1", "q2", "q3", "q4"),
    ("cf1", "cf4", "cf6", "cfx"),
    ("eax_a", "eax_b", "eax_c", "eax_d", "eax_e", "eax_f"),
)
JOINTTARGET_FIELDS = (
    ("rax_1", "rax_2", "rax_3", "rax_4", "rax_5", "rax_6"),
    ("eax_a", "eax_b", "eax_c", "eax_d", "eax_e", "eax_f"),
)
_KINDS = {
    tuple(len(group) for group in ROBTARGET_FIELDS): (TargetKind.POSE, ROBTARGET_FIELDS),
    tuple(len(group) for group in JOINTTARGET_FIELDS): (TargetKind.JOINTS, JOINTTARGET_FIELDS),
}


class Targets(TargetTable):
    """Every literal position of a robot."""

    def declared(self, symbol: Symbol) -> dict[tuple[int, ...], Target]:
        """Targets within a datum, by their index in it; ``()`` is the datum itself."""
        return dict(self._within(symbol.name, symbol.path, symbol.value, ()))

    def _within(
        self, name: str, path: str, value: Value | None, index: tuple[int, ...]
    ) -> Iterator[tuple[tuple[int, ...], Target]]:
        if not isinstance(value, Aggregate):
            return
        target = self.literal(name, path, value, declared=True)
        if target is not None:
            yield index, target
            return
        for number, item in enumerate(value.items, 1):
            yield from self._within(f"{name}{{{number}}}", path, item, (*index, number))

    def literal(self, name: str, path: str, aggregate: Aggregate, declared: bool = False) -> Target | None:
        """Target of an aggregate; None if it has not the shape of one."""
        found = _KINDS.get(aggregate.shape())
        if found is None:
            return None
        key = (path, aggregate.span[0])
        if key not in self._targets:
            kind, groups = found
            numbers = _numbers(aggregate, groups)
            line, column = self.place(path, aggregate.span[0])
            values = [numbers.get(field) for group in ROBTARGET_FIELDS[:2] for field in group]
            unknown = _doubt(values) if kind is TargetKind.POSE else ""
            known = kind is TargetKind.POSE and not unknown
            floats = [float(value.value) for value in values if value is not None]
            self._targets[key] = Target(
                name=name,
                kind=kind,
                path=path,
                line=line,
                column=column,
                span=aggregate.span,
                numbers=numbers,
                fields=frozenset(field for group in groups for field in group),
                pose=pose(floats[:3], rotation_from_quaternion(floats[3:])) if known else None,
                unknown=unknown,
                declared=declared,
            )
        return self._targets[key]


def _numbers(aggregate: Aggregate, groups: tuple[tuple[str, ...], ...]) -> dict[str, Number]:
    found: dict[str, Number] = {}
    for group, item in zip(groups, aggregate.items, strict=True):
        if isinstance(item, Aggregate):
            found.update(
                (name, value) for name, value in zip(group, item.items, strict=True) if isinstance(value, Number)
            )
    return found


def _doubt(values: list[Number | None]) -> str:
    quaternion = [float(value.value) for value in values[3:] if value is not None]
    if any(value is None for value in values):
        return "not every component of position and orientation is a number"
    norm = float(np.linalg.norm(quaternion))
    if norm == 0.0:
        return "the quaternion is all zero: the target was never taught"
    if abs(norm - 1.0) > QUATERNION_NORM:
        return f"the quaternion has length {norm:.4f}, not 1"
    return ""
