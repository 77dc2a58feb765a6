"""One program file beside its older state: which statement is which.

Statements that are written the same are paired by hashing alone; only what is left is read closer, by what it says.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from respot.difference.alignment import Pair, Range, align, gaps, pair_alike, slide
from respot.difference.canonical import TARGET, Key, key
from respot.difference.dialect import Datum, Dialect
from respot.difference.index import Index
from respot.difference.parts import Part, parts_of, texts
from respot.program.robot import ProgramFile
from respot.program.statement import Statement

#: Statements of the same kind that share so much of their tokens are one statement that was edited.
_ALIKE = 0.5


@dataclass(eq=False)
class Side:
    """One side of a file: its text, where its literals are, and its parts."""

    file: ProgramFile
    index: Index
    dialect: Dialect
    parts: dict[str, Part]
    _keys: dict[tuple[int, bool], Key] = field(default_factory=dict)
    _declared: dict[int, Sequence[Datum]] = field(default_factory=dict)
    names: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def read(cls, file: ProgramFile, index: Index, dialect: Dialect) -> Side:
        """Divide a file."""
        return cls(file, index, dialect, parts_of(file, dialect))

    @property
    def path(self) -> str:
        """Path of the file."""
        return self.file.source.path

    def rename(self, names: Mapping[str, str]) -> None:
        """Let names of this side stand for those of the other."""
        if names:
            self.names = names
            self._keys.clear()

    def key(self, statement: Statement, masked: bool = False) -> Key:
        """Return what a statement says, with or without the numbers of its positions."""
        place = (statement.start, masked)
        found = self._keys.get(place)
        if found is None:
            masks = self.index.masks(self.path, statement) if masked else ()
            found = self._keys[place] = key(statement, masks, self.names)
        return found

    def declared(self, statement: Statement) -> Sequence[Datum]:
        """Return what a declaration declares."""
        if statement.kind not in self.dialect.data or statement.shape.tree is None:
            return ()
        found = self._declared.get(statement.start)
        if found is None:
            found = self._declared[statement.start] = self.dialect.declared(self.path, statement)
        return found


@dataclass(eq=False)
class CodePair:
    """A routine on both sides: which of its statements are which."""

    old: Part
    new: Part
    pairs: list[Pair] = field(default_factory=list)
    #: statements that belong to a block that stands elsewhere
    moved_old: set[int] = field(default_factory=set)
    moved_new: set[int] = field(default_factory=set)

    def gaps(self) -> list[Range]:
        """Return what is not paired."""
        return gaps(self.pairs, len(self.old.code), len(self.new.code))


@dataclass(eq=False)
class DataPair:
    """The declarations of a part on both sides.

    Parameters
    ----------
    same : list
        Declarations that are written the same, by index.
    pairs : list
        Declarations of the same names that are written otherwise.
    removed, added : list of Statement
        Declarations of names that only one side has.
    """

    old: Part
    new: Part
    same: list[Pair] = field(default_factory=list)
    pairs: list[tuple[Statement, Statement]] = field(default_factory=list)
    removed: list[Statement] = field(default_factory=list)
    added: list[Statement] = field(default_factory=list)


class FilePair:
    """A program file on both sides.

    Parameters
    ----------
    old, new : Side
        Both states of it.
    """

    def __init__(self, old: Side, new: Side) -> None:
        self.old = old
        self.new = new
        self.parts = [(old.parts[name], new.parts[name]) for name in old.parts if name in new.parts]
        self.removed = [part for name, part in old.parts.items() if name not in new.parts]
        self.added = [part for name, part in new.parts.items() if name not in old.parts]
        self.data = [_pair_written(*pair) for pair in self.parts if pair[0].data or pair[1].data]
        self.code: list[CodePair] = []

    def pair_names(self) -> None:
        """Pair declarations that are not written the same by the names that they declare."""
        for data in self.data:
            waiting: dict[tuple[str, ...], list[Statement]] = {}
            for statement in data.removed:
                waiting.setdefault(self._identity(self.old, statement), []).append(statement)
            added = []
            for statement in data.added:
                found = waiting.get(self._identity(self.new, statement))
                if found:
                    data.pairs.append((found.pop(0), statement))
                else:
                    added.append(statement)
            left = {id(statement) for found in waiting.values() for statement in found}
            data.removed = [statement for statement in data.removed if id(statement) in left]
            data.added = added

    def _identity(self, side: Side, statement: Statement) -> tuple[str, ...]:
        names = [datum.name for datum in side.declared(statement)]
        return tuple(side.names.get(name, name) for name in names) if names else ("", *side.key(statement)[:3])

    def rename_routines(
        self, names: Mapping[str, str], is_still_used: Callable[[str], bool]
    ) -> list[tuple[Part, Part]]:
        """Pair routines that only differ by their names; they are removed and added no longer."""
        bodies: dict[tuple[Key, ...], list[Part]] = {}
        for part in self.removed:
            if part.size > 2 and not is_still_used(part.title.upper()):
                bodies.setdefault(part.body_key(names), []).append(part)
        found = []
        for part in list(self.added):
            same = bodies.get(part.body_key({})) if bodies and part.size > 2 else None
            if same and same[0].head is not None and part.head is not None and same[0].head.kind == part.head.kind:
                old = same.pop(0)
                found.append((old, part))
                self.removed.remove(old)
                self.added.remove(part)
                self.parts.append((old, part))
        return found

    def align_code(self) -> None:
        """Pair the statements of every routine by what they say."""
        for old, new in self.parts:
            starts = _group_starts(old.code), _group_starts(new.code)
            written = texts(old.code), texts(new.code)
            pair = CodePair(old, new, slide(align(*written), written, starts))
            if any(i0 < i1 and j0 < j1 for i0, i1, j0, j1 in pair.gaps()):
                # some may only be spelled otherwise: what is written the same alone would be paired too eagerly
                keys = [self.old.key(item) for item in old.code], [self.new.key(item) for item in new.code]
                pair.pairs = slide(align(*keys), keys, starts)
            self.code.append(pair)

    def pair_edited(self) -> None:
        """Pair what is left in the gaps: first by all but the numbers of positions, then by likeness."""
        for pair in self.code:
            for i0, i1, j0, j1 in pair.gaps():
                rows = [i for i in range(i0, i1) if i not in pair.moved_old]
                columns = [j for j in range(j0, j1) if j not in pair.moved_new]
                pair.pairs += [
                    (rows[row], columns[column]) for row, column in self._edited(pair, rows, columns)
                ]  # fmt: skip
            pair.pairs.sort()

    def _edited(self, pair: CodePair, rows: Sequence[int], columns: Sequence[int]) -> list[Pair]:
        old = [pair.old.code[row] for row in rows]
        new = [pair.new.code[column] for column in columns]
        keys = ([self.old.key(item, masked=True) for item in old], [self.new.key(item, masked=True) for item in new])
        tokens = ([frozenset(item) for item in keys[0]], [frozenset(item) for item in keys[1]])

        def alike(row: int, column: int) -> float:
            if keys[0][row] == keys[1][column]:
                return 1.0 + self._nearness(old[row], new[column])
            if old[row].kind != new[column].kind:
                return 0.0
            shared = len(tokens[0][row] & tokens[1][column])
            likeness = 2.0 * shared / (len(tokens[0][row]) + len(tokens[1][column]))
            return 0.9 * likeness if likeness >= _ALIKE else 0.0

        whole = (0, len(rows), 0, len(columns))
        if len(rows) * len(columns) <= 40_000:
            return pair_alike(whole, alike)
        found = align(*keys)
        for between in gaps(found, len(rows), len(columns)):
            found = [*found, *pair_alike(between, alike)]
        return sorted(found)

    def _nearness(self, old: Statement, new: Statement) -> float:
        """Say how near the positions of two statements are, from 0 to 1: which of several like statements is which."""
        if TARGET not in self.old.key(old, masked=True):
            return 0.0
        before = self.old.index.targets_in(self.old.path, old)
        after = self.new.index.targets_in(self.new.path, new)
        if not before or not after or not before[0].components or not after[0].components:
            return 0.0
        way = sum((a - b) ** 2 for a, b in zip(before[0].components[:3], after[0].components[:3], strict=True))
        return float(1.0 / (1.0 + way**0.5 / 10.0))


def _group_starts(statements: Sequence[Statement]) -> list[bool]:
    """Whether a comment, a fold or an empty line stands above each statement: an inline form begins there."""
    lines = [-1, *(statement.line for statement in statements)]
    return [line > before + 1 for before, line in pairwise(lines)]


def _pair_written(old: Part, new: Part) -> DataPair:
    """Pair the declarations that are written the same; an order is kept where the same text occurs again."""
    waiting: dict[str, list[int]] = {}
    for index, statement in enumerate(old.data):
        waiting.setdefault(statement.source, []).append(index)
    for found in waiting.values():
        found.reverse()
    made = DataPair(old, new)
    for index, statement in enumerate(new.data):
        places = waiting.get(statement.source)
        if places:
            made.same.append((places.pop(), index))
        else:
            made.added.append(statement)
    left = sorted(index for places in waiting.values() for index in places)
    made.removed = [old.data[index] for index in left]
    return made
