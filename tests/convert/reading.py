"""What the independent readers find: literals with the place of each number, and the motions that go to them.

Nothing here or in the two readers is shared with respot: regular expressions, and 4x4 matrices in plain numpy.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from tests.convert.independent import NUMBER, from_abb, from_kuka

POSITION = {"krl": "XYZ", "rapid": ("x", "y", "z")}
ORIENTATION = {"krl": "ABC", "rapid": ("q1", "q2", "q3", "q4")}
CONFIGURATION = {"krl": ("S", "T"), "rapid": ("cf1", "cf4", "cf6", "cfx")}


@dataclass(frozen=True)
class Literal:
    """A literal: where it stands, and the text of each of its numbers by field; ``offset`` is a way along the base."""

    language: str
    path: str
    name: str
    line: int
    span: tuple[int, int]
    spans: Mapping[str, tuple[int, int]]
    texts: Mapping[str, str]
    offset: bool = False

    def values(self, names: Sequence[str]) -> np.ndarray:
        return np.array([float("".join(self.texts.get(name, "0").split())) for name in names])

    @property
    def complete(self) -> bool:
        names = (*POSITION[self.language], *ORIENTATION[self.language])
        return not self.offset and all(name in self.texts for name in names)

    @property
    def pose(self) -> np.ndarray:
        numbers = self.values((*POSITION[self.language], *ORIENTATION[self.language]))
        return from_kuka(*numbers) if self.language == "krl" else from_abb(*numbers)


@dataclass(frozen=True)
class Use:
    """A motion to a literal: ``base`` is a 4x4 base2world, one for a held part, None where the reader does not know."""

    literal: Literal
    program: str
    base: np.ndarray | None
    external: bool = False


@dataclass
class Reading:
    """A backup as a reader sees it: text of each file, literals by file in order, motions."""

    texts: dict[str, str] = field(default_factory=dict)
    literals: dict[str, list[Literal]] = field(default_factory=dict)
    uses: list[Use] = field(default_factory=list)

    def add(self, literal: Literal) -> Literal:
        """Add a literal, once."""
        found = self.literals.setdefault(literal.path, [])
        for other in found:
            if other.span == literal.span:
                return other
        found.append(literal)
        return literal


def split_top(text: str, separator: str, start: int = 0) -> list[tuple[int, int]]:
    """Spans between separators that stand in no bracket."""
    found, depth, begin = [], 0, start
    for place in range(start, len(text)):
        letter = text[place]
        if letter in "([{":
            depth += 1
        elif letter in ")]}":
            depth -= 1
        elif letter in separator and depth == 0:
            found.append((begin, place))
            begin = place + 1
    return [*found, (begin, len(text))]


def stripped(text: str, span: tuple[int, int]) -> tuple[int, int]:
    """Return the span without blanks at its ends."""
    start, end = span
    while start < end and text[start].isspace():
        start += 1
    while end > start and text[end - 1].isspace():
        end -= 1
    return start, end


__all__ = ["NUMBER", "Literal", "Reading", "Use", "split_top", "stripped"]
