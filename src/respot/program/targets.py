"""Targets: programmed poses and joint positions, with the place of each of their numbers."""

from __future__ import annotations

from array import array
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from enum import StrEnum
from functools import cached_property
from itertools import chain
from math import isfinite

from scipy.spatial.transform import RigidTransform

from respot.geometry import pose, rotation_from_abc, rotation_from_quaternion
from respot.source import Span


@dataclass(frozen=True, slots=True)
class Number:
    """A number of a program: its exact value and its place, sign included."""

    value: Decimal
    span: Span


class LiteralNumbers(Mapping[str, Number]):
    """Numbers of a literal by field; exact values are made when they are asked for: a large backup has millions.

    Parameters
    ----------
    text : str
        The file.
    names : tuple of str
        The fields, in their order, each once.
    spans : sequence of tuple
        Place of the number of each field.

    Raises
    ------
    ValueError
        A text is no number that a controller holds, such as 1E400.
    """

    __slots__ = ("_names", "_places", "_text", "_values")

    def __init__(self, text: str, names: tuple[str, ...], spans: Sequence[Span]) -> None:
        self._text = text
        self._names = names
        self._places = array("I", chain.from_iterable(spans))
        self._values = array("d", [float(text[start:end]) for start, end in spans])
        if not all(map(isfinite, self._values)):
            raise ValueError("a number is not finite")

    def value(self, name: str) -> float | None:
        """Value of a field, None where there is none."""
        names = self._names
        return self._values[names.index(name)] if name in names else None

    def __getitem__(self, name: str) -> Number:
        if name not in self._names:
            raise KeyError(name)
        index = self._names.index(name)
        start, end = self._places[2 * index : 2 * index + 2]
        return Number(Decimal(self._text[start:end]), (start, end))

    def __contains__(self, name: object) -> bool:
        return name in self._names

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)


class TargetKind(StrEnum):
    """What a target fixes."""

    POSE = "pose"
    JOINTS = "joints"


@dataclass(frozen=True, eq=False)
class Target:
    """A literal position of a program. Two motions to the same declared point share one target.

    Parameters
    ----------
    name : str
        Its declared name, or for a literal in the code the motion it stands in, e.g. ``SpotL@41``.
    kind : TargetKind
        Pose or joints.
    path : str
        File of the literal.
    line, column : int
        Its place, from 1.
    span : tuple
        Span of the literal in the file.
    numbers : mapping of str to Number
        Field names of its language: ``X`` .. ``E6`` in KRL, ``x`` .. ``eax_f`` in RAPID.
    fields : frozenset of str
        Names of all fields that the literal has, numbers or not.
    components : tuple of float
        Its pose in its base as written: x, y, z in mm, then A, B, C in degrees or q1 to q4; empty for joints and where
        a field is no number.
    unknown : str
        Why there is no pose.
    declared : bool
        It has a name of its own.
    original_of : str
        Name of the target that was this one before it was touched up: a controller that limits touch-ups compares
        both (facts: rapid.md 2.4).
    """

    name: str
    kind: TargetKind
    path: str
    line: int
    column: int
    span: Span
    numbers: Mapping[str, Number] = field(default_factory=dict)
    fields: frozenset[str] = frozenset()
    components: tuple[float, ...] = ()
    unknown: str = ""
    declared: bool = True
    original_of: str = ""

    @cached_property
    def pose(self) -> RigidTransform | None:
        """``target2base``; None for joints and where a field is no number."""
        if not self.components:
            return None
        position, orientation = self.components[:3], self.components[3:]
        return pose(
            position, rotation_from_quaternion(orientation) if len(orientation) == 4 else rotation_from_abc(orientation)
        )

    def number(self, name: str) -> float | None:
        """Value of a field, None where the literal lacks it."""
        if isinstance(self.numbers, LiteralNumbers):
            return self.numbers.value(name)
        found = self.numbers.get(name)
        return None if found is None else float(found.value)

    def __str__(self) -> str:
        return self.name
