"""Values that a program itself writes while it runs, and a controller saves: which parts of a datum these are.

What differs in another part, in the type or in the size of a datum was changed by somebody.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cached_property

from respot.difference.dialect import ANY, Dialect, Path, path_of
from respot.program.robot import Robot
from respot.program.statement import Statement

_STRING = re.compile(r'"[^"\r\n]*"')
_WORD = re.compile(r"[^\W\d][\w$]*|\$\w+")
_LAST_USED = re.compile(r"(?<![\w$])LAST_\w+", re.IGNORECASE)
_CALLED = re.compile(r"([^\W\d][\w$]*)\s*\(")


class Writes:
    """What the code of a robot is seen to write.

    Parameters
    ----------
    robot : Robot
        The robot.
    dialect : Dialect
        Its language.
    """

    def __init__(self, robot: Robot, dialect: Dialect) -> None:
        self._robot = robot
        self._dialect = dialect
        self._seen: dict[str, list[tuple[str, Path]]] | None = None
        self._declaring: dict[tuple[str, str], bool] = {}
        #: routines that write a parameter of theirs
        self._giving: set[str] = set()

    def parts(self, path: str, name: str) -> list[Path]:
        """Return the parts of a datum, declared in a file, that code writes; the datum itself where it may be any part.

        Parameters
        ----------
        path : str
            File.
        name : str
            Name in upper case, perhaps with an index.
        """
        if not self._robot.writes(path, name):
            return []
        if self._seen is None:
            self._seen = {}
            self._read()
        bare = name.partition("[")[0]
        program = self._robot.files[path].program
        found = [
            part
            for other, part in self._seen.get(bare, ())
            if other == program or not self._declares(other, bare)
        ]  # fmt: skip
        if found:
            return found
        whole = self._dialect.precise or bare in self._handed
        return [(bare,)] if whole else []

    @cached_property
    def records(self) -> Mapping[str, Sequence[tuple[str, str]]]:
        """Type and name of the fields of each record that the programs declare."""
        return self._dialect.records(self._robot)

    @cached_property
    def last_used(self) -> frozenset[str]:
        """Names like those of last used values, in upper case, that the code itself reads or writes."""
        found: set[str] = set()
        dialect = self._dialect
        for file in self._robot.files.values():
            if _LAST_USED.search(file.source.text) is None:
                continue
            head = ""
            for statement in file.statements:
                kind = statement.kind
                head = kind if kind in dialect.heads else "" if kind in dialect.ends else head
                if head not in dialect.data_heads and kind not in dialect.comments | dialect.folds:
                    text = _STRING.sub('""', statement.source)
                    found.update(word.upper() for word in _LAST_USED.findall(text))
        return frozenset(found)

    def _read(self) -> None:
        """Note the left side of every assignment, unless it is a name of the routine's own."""
        dialect = self._dialect
        for file in self._robot.files.values():
            routine, own, handed = "", frozenset[str](), frozenset[str]()
            for statement in file.statements:
                kind = statement.kind
                if kind in dialect.heads and kind not in dialect.data_heads:
                    routine = dialect.name_of(statement).upper()
                    own = handed = _words(statement.source.partition("(")[2])
                elif kind in dialect.ends:
                    routine = ""
                elif routine and kind in dialect.local_data:
                    own |= _words(statement.source)
                elif routine and kind in dialect.writing:
                    for part in self._left(statement):
                        if part[0] in handed:
                            self._giving.add(routine)
                        elif part[0] not in own:
                            assert self._seen is not None  # noqa: S101 - made by the caller
                            self._seen.setdefault(part[0], []).append((file.program, part))

    def _left(self, statement: Statement) -> Iterator[Path]:
        for match in self._dialect.left.finditer(_STRING.sub('""', statement.source)):
            yield path_of(match[0] if match.lastindex is None else match[match.lastindex])

    def _declares(self, program: str, name: str) -> bool:
        """Whether a program has a datum of its own of this name."""
        known = self._declaring.get((program, name))
        if known is None:
            known = self._declaring[program, name] = self._has(program, name)
        return known

    def _has(self, program: str, name: str) -> bool:
        word = re.compile(rf"(?<![\w$]){re.escape(name)}(?![\w$])", re.IGNORECASE)
        return any(
            statement.kind in self._dialect.local_data and word.search(statement.source) is not None
            for file in self._robot.files.values()
            if file.program == program and word.search(file.source.text) is not None
            for statement in file.statements
        )

    @cached_property
    def _handed(self) -> frozenset[str]:
        """Names that stand where a routine is called that writes what it is handed.

        Nobody knows that of a routine outside of the backup.
        """
        writing = self._giving | self._dialect.writers
        found: set[str] = set()
        for file in self._robot.files.values():
            for statement in file.statements if writing else ():
                if "(" in statement.source and statement.kind not in self._dialect.comments:
                    text = _STRING.sub('""', statement.source).upper()
                    if not writing.isdisjoint(_CALLED.findall(text)):
                        found |= _words(text)
        return frozenset(found)


def covered(leaf: Path, parts: Iterable[Path]) -> bool:
    """Whether a value belongs to one of the parts, or is one whose own parts these are."""
    return any(
        all(there in (ANY, here) or here == ANY for here, there in zip(leaf, part, strict=False)) for part in parts
    )


def differing(dialect: Dialect, sides: Sequence[tuple[str, Statement, Writes]]) -> list[Path] | None:
    """Return which values of two declarations differ; None where more than values does, such as a type or a size."""
    heads, leaves = [], []
    for path, statement, writes in sides:
        tokens = [statement.text[start:end] for start, end in statement.tokens()]
        at = next((index for index, token in enumerate(tokens) if token in ("=", ":=")), None)
        heads.append(None if at is None else [token.upper() for token in tokens[:at]])
        leaves.append(dialect.values(path, statement, writes.records))
    if heads[0] is None or heads[0] != heads[1] or leaves[0].keys() != leaves[1].keys():
        return None
    return [leaf for leaf, value in leaves[0].items() if value != leaves[1][leaf]]


def _words(text: str) -> frozenset[str]:
    return frozenset(word.upper() for word in _WORD.findall(text))
