"""How a program file is divided: routines, whose statements are in order, and data, whose order says nothing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from respot.difference.canonical import Key, key
from respot.difference.dialect import Dialect
from respot.program.robot import ProgramFile
from respot.program.statement import Statement


@dataclass(eq=False)
class Part:
    """A routine, a record type, a data list, or what stands outside of all.

    Parameters
    ----------
    name : str
        Its name in upper case with its ordinal where the name occurs again; empty outside.
    title : str
        Its name as written.
    head : Statement or None
        Its first statement, which is also the first of ``code``.
    code : list of Statement
        Statements whose order counts, without comments.
    data : list of Statement
        Declarations whose order does not.
    remarks : list of Statement
        Comments and folds.
    """

    name: str = ""
    title: str = ""
    head: Statement | None = None
    code: list[Statement] = field(default_factory=list)
    data: list[Statement] = field(default_factory=list)
    remarks: list[Statement] = field(default_factory=list)

    @property
    def size(self) -> int:
        """How many statements it has."""
        return len(self.code) + len(self.data)

    def body_key(self, names: Mapping[str, str]) -> tuple[Key, ...]:
        """Return what its statements say, its head left out: the same for a routine that was only renamed."""
        return tuple(key(statement, names=names) for statement in (*self.code[1:], *self.data))


def parts_of(file: ProgramFile, dialect: Dialect) -> dict[str, Part]:
    """Return the parts of a file by name, in order; the first is what stands outside."""
    outside = Part()
    found = {"": outside}
    current = outside
    for statement in file.statements:
        kind = statement.kind
        if kind in dialect.comments or kind in dialect.folds:
            current.remarks.append(statement)
        elif kind in dialect.heads:
            title = dialect.name_of(statement)
            name = kind if kind in dialect.data_heads else title.upper()
            count = 1
            while (unique := name if count == 1 else f"{name}#{count}") in found:
                count += 1
            current = found[unique] = Part(unique, title, statement, [statement])
        elif kind in dialect.ends:
            current.code.append(statement)
            current = outside
        elif kind in dialect.data and (current is outside or current.head is None or _is_data(current, dialect)):
            current.data.append(statement)
        else:
            current.code.append(statement)
    return found


def _is_data(part: Part, dialect: Dialect) -> bool:
    return part.head is not None and part.head.kind in dialect.data_heads


def texts(statements: Sequence[Statement]) -> list[str]:
    """Return the statements as written."""
    return [statement.source for statement in statements]
