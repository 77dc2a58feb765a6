"""Data and routines that only got another name: recognised by their value and by their use.

A point is the same under another name if it stands at the same place, or near it, and the code goes there in the same
way. What the inline forms name after a point (FDAT, PDAT, LDAT) follows it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from operator import attrgetter

from respot.difference.canonical import Key, key
from respot.difference.dialect import Dialect
from respot.difference.findings import Place, Renamed
from respot.difference.programs import DataPair, FilePair, Side
from respot.program.robot import Robot
from respot.program.statement import Statement
from respot.program.targets import Target
from respot.tolerance import RENAMED_WITHIN_MM

_WORD = re.compile(r"[^\W\d][\w$]*|\$\w+")
_STRING = re.compile(r'"[^"\r\n]*"')
_HERE = "<name>"
_ROUTINES = (attrgetter("removed"), attrgetter("added"))
#: A use: the routine, what the statement says without the name.
_Use = tuple[str, Key]


@dataclass(eq=False)
class _Lone:
    """A declaration of one name that only one side has."""

    side: Side
    data: DataPair
    statement: Statement
    name: str
    type: str
    value: Key
    target: Target | None
    uses: list[_Use] = field(default_factory=list)

    @property
    def place(self) -> Place:
        return Place(self.side.path, self.statement.line)


class Renames:
    """What was renamed in a robot's programs.

    Parameters
    ----------
    files : iterable of FilePair
        Its files, their declarations paired by name.
    old, new : Robot
        Both states, with the files that did not change.
    """

    def __init__(self, files: Iterable[FilePair], old: Robot, new: Robot) -> None:
        self._files = list(files)
        #: what was found, in order
        self.found: list[Renamed] = []
        self._names: dict[str, str] = {}
        self._program: dict[str, str] = {}
        removed = [lone for file in self._files for lone in _lones(file, file.old, removed=True)]
        added = [lone for file in self._files for lone in _lones(file, file.new, removed=False)]
        routines = [[part.title.upper() for file in self._files for part in side(file)] for side in _ROUTINES]
        if not (removed and added) and not all(routines):
            return
        dialect = self._files[0].old.dialect
        names = {lone.name for lone in (*removed, *added)}.union(*routines)
        self._mentions = [_Mentions.of(robot, dialect, names) for robot in (old, new)]
        removed = [lone for lone in removed if not self._is_still_used(lone.name)]
        if removed and added:
            self._data(removed, added)
        self._routines()

    def names_for(self, file: FilePair) -> Mapping[str, str]:
        """Return what names mean in a file, new name by old name, both in upper case.

        A name of one program may be that of another datum in another program: it stands for the new one only where
        nothing else has either name.
        """
        program = file.new.file.program
        return {
            old: new
            for old, new in self._names.items()
            if self._program[old] == program
            or not any(
                mentions.declared.get(name, set()) - {self._program[old]}
                for mentions in self._mentions
                for name in (old, new)
            )
        }

    def _is_still_used(self, name: str) -> bool:
        """Whether the new programs use an old name that nothing there has: then it did not become another one."""
        new = self._mentions[1]
        return bool(new.used.get(name, set())) and not new.declared.get(name)

    def _data(self, removed: Sequence[_Lone], added: Sequence[_Lone]) -> None:
        _find_uses(removed, [file.old for file in self._files])
        _find_uses(added, [file.new for file in self._files])
        left_old, left_new = _Left(removed), _Left(added)
        points = [(lone for lone in left if lone.target is not None) for left in (left_old, left_new)]
        self._by_value(list(points[0]), list(points[1]), left_old, left_new)
        self._by_place(left_old, left_new)
        for old_name, new_name in list(self._names.items()):
            self._follow(old_name, new_name, left_old, left_new)
        # what is named after a point is renamed with it or not at all: its values are those of many
        forms = {
            name
            for lone in (*removed, *added)
            if lone.target is not None
            for name in self._files[0].old.dialect.companions(lone.name)
        }
        rest = [[lone for lone in left if lone.name not in forms] for left in (left_old, left_new)]
        self._by_value(rest[0], rest[1], left_old, left_new)

    def _by_value(self, removed: Sequence[_Lone], added: Sequence[_Lone], left_old: _Left, left_new: _Left) -> None:
        """Take for one what has the same type, the same value and the same uses; several of a kind in their order."""
        buckets: dict[tuple[object, ...], tuple[list[_Lone], list[_Lone]]] = {}
        for index, lones in enumerate((removed, added)):
            for lone in lones:
                if lone.target is None and not lone.uses:
                    continue  # equal numbers that nothing uses are no evidence
                signature = (lone.type, lone.value, tuple(sorted(lone.uses)))
                buckets.setdefault(signature, ([], []))[index].append(lone)
        for olds, news in buckets.values():
            if len(olds) == len(news):
                for old, new in zip(olds, news, strict=True):
                    self._take(old, new, left_old, left_new)

    def _by_place(self, left_old: _Left, left_new: _Left) -> None:
        """Take for one what is used in the same way and stands near: renamed and moved at once."""
        olds = [lone for lone in left_old if lone.target is not None and lone.uses]
        near_old, near_new = _Near(olds), _Near(lone for lone in left_new if lone.target is not None and lone.uses)
        for old in olds:
            found = [new for new in near_new.of(old) if new in left_new]
            if len(found) == 1 and sum(other in left_old for other in near_old.of(found[0])) == 1:
                self._take(old, found[0], left_old, left_new)

    def _follow(self, old_name: str, new_name: str, left_old: _Left, left_new: _Left) -> None:
        dialect = self._files[0].old.dialect
        pairs = zip(dialect.companions(old_name), dialect.companions(new_name), strict=True)
        for old, new in ((left_old.named(first), left_new.named(second)) for first, second in pairs):
            if old is not None and new is not None and old.type == new.type:
                self._take(old, new, left_old, left_new)

    def _take(self, old: _Lone, new: _Lone, left_old: _Left, left_new: _Left) -> None:
        left_old.drop(old)
        left_new.drop(new)
        self._names[old.name] = new.name
        self._program[old.name] = new.side.file.program
        old.data.removed = [item for item in old.data.removed if item is not old.statement]
        new.data.added = [item for item in new.data.added if item is not new.statement]
        new.data.pairs.append((old.statement, new.statement))
        names = [_written(lone) for lone in (old, new)]
        program = new.side.file.program
        self.found.append(Renamed(names[0], names[1], new.type.lower(), program, old.place, new.place))

    def _routines(self) -> None:
        for file in self._files:
            for old, new in file.rename_routines(self._names, self._is_still_used):
                assert old.head is not None and new.head is not None  # noqa: S101 - a part that is paired has one
                self._names[old.title.upper()] = new.title.upper()
                self._program[old.title.upper()] = file.new.file.program
                places = (Place(file.old.path, old.head.line), Place(file.new.path, new.head.line))
                self.found.append(Renamed(old.title, new.title, new.head.kind, file.new.file.program, *places))


@dataclass(frozen=True)
class _Mentions:
    """Which programs of a robot declare some names, and which use them, by the name in upper case."""

    declared: dict[str, set[str]]
    used: dict[str, set[str]]

    @classmethod
    def of(cls, robot: Robot, dialect: Dialect, names: set[str]) -> _Mentions:
        """Look for names in all statements that are no comments."""
        found = cls({}, {})
        for file in robot.files.values():
            if names.isdisjoint(_WORD.findall(file.source.text.upper())):
                continue
            head = ""
            for statement in file.statements:
                kind = statement.kind
                if kind in dialect.comments or kind in dialect.folds:
                    continue
                head = kind if kind in dialect.heads else "" if kind in dialect.ends else head
                words = names.intersection(_WORD.findall(_STRING.sub('""', statement.source).upper()))
                declares = kind in dialect.heads or kind in dialect.local_data or head in dialect.data_heads
                for word in words:
                    (found.declared if declares else found.used).setdefault(word, set()).add(file.program)
        return found


class _Left:
    """Declarations without a partner, in order."""

    def __init__(self, lones: Iterable[_Lone]) -> None:
        self._by_id = {id(lone): lone for lone in lones}
        self._names: dict[str, list[_Lone]] = {}
        for lone in self._by_id.values():
            self._names.setdefault(lone.name, []).append(lone)

    def __iter__(self) -> Iterator[_Lone]:
        return iter(list(self._by_id.values()))

    def __contains__(self, lone: _Lone) -> bool:
        return id(lone) in self._by_id

    def drop(self, lone: _Lone) -> None:
        self._by_id.pop(id(lone), None)

    def named(self, name: str) -> _Lone | None:
        """Return the one declaration of a name, None where there is none or more than one."""
        found = [lone for lone in self._names.get(name, ()) if id(lone) in self._by_id]
        return found[0] if len(found) == 1 else None


def _lones(file: FilePair, side: Side, removed: bool) -> list[_Lone]:
    found = []
    for data in file.data:
        for statement in data.removed if removed else data.added:
            declared = side.declared(statement)
            if len(declared) != 1:
                continue
            targets = side.index.targets_in(side.path, statement)
            name, kind = declared[0].name, declared[0].type
            value = key(statement, names={name: _HERE})
            found.append(_Lone(side, data, statement, name, kind, value, targets[0] if len(targets) == 1 else None))
    return found


def _find_uses(lones: Sequence[_Lone], sides: Sequence[Side]) -> None:
    """Find where the code names the declarations: a word of each statement is looked up, nothing more is read."""
    by_name: dict[str, list[_Lone]] = {}
    for lone in lones:
        by_name.setdefault(lone.name, []).append(lone)
    masked: Mapping[str, str] = dict.fromkeys(by_name, _HERE)
    for side in sides:
        for part in side.parts.values():
            for statement in part.code:
                words = {word.upper() for word in _WORD.findall(statement.source)} & by_name.keys()
                if words:
                    use = (part.title.upper(), key(statement, names=masked))
                    for word in words:
                        for lone in by_name[word]:
                            lone.uses.append(use)


class _Near:
    """Points by what they are used for and where they stand, in cells as wide as what counts as near."""

    def __init__(self, lones: Iterable[_Lone]) -> None:
        self._cells: dict[tuple[object, ...], list[_Lone]] = {}
        for lone in lones:
            if lone.target is not None and lone.target.components:
                self._cells.setdefault((_purpose(lone), *_cell(lone.target)), []).append(lone)

    def of(self, lone: _Lone) -> list[_Lone]:
        """Return the points near another one that are used in the same way."""
        if lone.target is None or not lone.target.components:
            return []
        place, purpose = lone.target.components[:3], _purpose(lone)
        around = product(*((index - 1, index, index + 1) for index in _cell(lone.target)))
        return [
            other
            for cell in around
            for other in self._cells.get((purpose, *cell), ())
            if other.target is not None and math.dist(place, other.target.components[:3]) <= RENAMED_WITHIN_MM
        ]


def _purpose(lone: _Lone) -> tuple[object, ...]:
    return lone.type, tuple(sorted(lone.uses))


def _cell(target: Target) -> tuple[int, ...]:
    return tuple(math.floor(max(-1e9, min(1e9, value)) / RENAMED_WITHIN_MM) for value in target.components[:3])


def _written(lone: _Lone) -> str:
    """Return the name as it is written."""
    source = lone.statement.source
    at = source.upper().find(lone.name)
    return source[at : at + len(lone.name)] if at >= 0 else lone.name
