"""What a RAPID module is made of: its routines, records and data, and the blocks that do not close.

One pass over the statements. RAPID has two kinds of blocks: those of the module (MODULE, RECORD, PROC, FUNC, TRAP) and
those of a routine (IF, FOR, WHILE, TEST). ERROR, UNDO and BACKWARD begin sections of a routine and close with it; a
compact IF is a simple statement.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from respot.issues import Issue
from respot.program.statement import OPAQUE, Statement

#: Heads of routines and what closes them.
ROUTINES = {"procedure": "end_procedure", "function": "end_function", "trap": "end_trap"}
#: Heads of blocks within a routine and what closes them.
BLOCKS = {"if_": "end_if", "for_": "end_for", "while_": "end_while", "test": "end_test"}
#: Statements that divide a block: the block they need.
DIVIDERS = {"elseif": "if_", "else_": "if_", "case": "test", "default": "test"}
#: Statements that begin a section of a routine.
SECTIONS = frozenset(("error", "undo", "backward"))

_ROUTINE_ENDS = {end: head for head, end in ROUTINES.items()}
_BLOCK_ENDS = {end: head for head, end in BLOCKS.items()}
#: What stands in a module outside its routines; calls are fields of a record.
_DECLARATIONS = frozenset(("data", "alias", "header", "comment", "after_module", "placeholder", OPAQUE))
_WORDS = {
    "module": "MODULE", "end_module": "ENDMODULE", "record": "RECORD", "end_record": "ENDRECORD",
    "procedure": "PROC", "end_procedure": "ENDPROC", "function": "FUNC", "end_function": "ENDFUNC",
    "trap": "TRAP", "end_trap": "ENDTRAP", "if_": "IF", "end_if": "ENDIF", "for_": "FOR", "end_for": "ENDFOR",
    "while_": "WHILE", "end_while": "ENDWHILE", "test": "TEST", "end_test": "ENDTEST",
    "elseif": "ELSEIF", "else_": "ELSE", "case": "CASE", "default": "DEFAULT",
}  # fmt: skip
_OPAQUE_HEAD = re.compile(
    r"(?P<local>LOCAL\s+)?(?:PROC\s+(?P<procedure>\w+)|FUNC\s+\w+\s+(?P<function>\w+)|TRAP\s+(?P<trap>\w+))",
    re.IGNORECASE,
)
_OPAQUE_BLOCK = re.compile(r"(IF\b(?=.*\bTHEN\s*\Z)|(?:FOR|WHILE|TEST|RECORD)\b)", re.IGNORECASE | re.DOTALL)
_FIRST_WORD = {"if": "if_", "for": "for_", "while": "while_", "test": "test", "record": "record"}


@dataclass
class Routine:
    """A procedure, function or trap.

    Parameters
    ----------
    kind : str
        ``procedure``, ``function`` or ``trap``.
    name : str
        As its head writes it; names differ by more than case.
    local : bool
        Declared LOCAL: known in its module only.
    head : Statement
        Its first statement; opaque where the head is broken.
    body : list of Statement
        Everything up to its end: data, comments, statements of all its sections.
    end : Statement or None
        None where it is not closed.
    """

    kind: str
    name: str
    local: bool
    head: Statement
    body: list[Statement] = field(default_factory=list)
    end: Statement | None = None


@dataclass(frozen=True)
class Field:
    """A component of a record: its type, its name and where it stands."""

    type: str
    name: str
    statement: Statement


@dataclass
class Record:
    """A record type that the module defines."""

    name: str
    local: bool
    head: Statement
    fields: list[Field] = field(default_factory=list)
    end: Statement | None = None


@dataclass
class Layout:
    """What a file holds.

    Parameters
    ----------
    modules : list of Statement
        Heads of its modules: one, none in a fragment, several in rare program files.
    data : list of Statement
        Data declarations and aliases outside the routines.
    records : list of Record
        Record types.
    routines : list of Routine
        Routines in order.
    """

    modules: list[Statement] = field(default_factory=list)
    data: list[Statement] = field(default_factory=list)
    records: list[Record] = field(default_factory=list)
    routines: list[Routine] = field(default_factory=list)

    @property
    def name(self) -> str | None:
        """Name of the first module; None in a fragment without a MODULE line."""
        return _names(self.modules[0])[0] if self.modules else None


@dataclass(frozen=True)
class _Fault:
    """A block that does not close, or closes nothing."""

    statement: Statement
    message: str


def layout(statements: Iterable[Statement]) -> Layout:
    """Read what a file is made of; broken blocks are closed where the next routine begins."""
    return _Pass(statements).layout


def routines(statements: Iterable[Statement]) -> list[Routine]:
    """Return the routines of a file, in order."""
    return layout(statements).routines


def records(statements: Iterable[Statement]) -> list[Record]:
    """Return the record types that a file defines, in order."""
    return layout(statements).records


def module_name(statements: Iterable[Statement]) -> str | None:
    """Return the name of the first module of a file, None if no MODULE line stands in it."""
    return next((_names(statement)[0] for statement in statements if statement.kind == "module"), None)


def block_issues(path: str, statements: Sequence[Statement]) -> list[Issue]:
    """Issues of all blocks that are opened and not closed, or closed and not opened, by line.

    Parameters
    ----------
    path : str
        File the statements are from.
    statements : sequence of Statement
        All its statements.
    """
    done = _Pass(statements)
    faults = done.faults
    for routine in done.layout.routines:
        faults += _unbalanced(routine.body)
    faults += _unbalanced(done.stray)
    faults.sort(key=lambda fault: fault.statement.start)
    return [_issue(path, fault) for fault in faults]


class _Pass:
    """The pass over the module's own blocks; those of a routine are matched within its body."""

    def __init__(self, statements: Iterable[Statement]) -> None:
        self.layout = Layout()
        self.faults: list[_Fault] = []
        #: Statements that stand in a module but in no routine
        self.stray: list[Statement] = []
        self._module: Statement | None = None
        self._routine: Routine | None = None
        self._record: Record | None = None
        self._idle = True
        for statement in statements:
            self._take(statement)
        self._leave_routine()
        self._leave_record()
        self._leave_module()

    def _take(self, statement: Statement) -> None:
        kind = statement.kind
        if kind == OPAQUE:
            kind = _opaque_kind(statement)
        if kind in ROUTINES:
            self._enter_routine(kind, statement)
        elif kind in _ROUTINE_ENDS:
            self._close_routine(_ROUTINE_ENDS[kind], statement)
        elif kind == "module":
            self._leave_all()
            self._module = statement
            self.layout.modules.append(statement)
        elif kind == "end_module":
            self._close_module(statement)
        elif self._routine is not None:
            self._routine.body.append(statement)
        else:
            self._declare(kind, statement)

    def _declare(self, kind: str, statement: Statement) -> None:
        """Take a statement that stands outside the routines."""
        if kind == "record":
            self._leave_record()
            self._record = Record(_record_name(statement), _is_local(statement), statement)
            self.layout.records.append(self._record)
        elif kind == "end_record":
            if self._record is None:
                self.faults.append(_Fault(statement, "ENDRECORD closes nothing"))
            else:
                self._record.end = statement
                self._record = None
        elif self._record is not None and kind == "call":
            self._record.fields += _fields(statement)
        elif kind in ("data", "alias"):
            self._leave_record()
            self.layout.data.append(statement)
        elif kind not in _DECLARATIONS:
            self._leave_record()
            if self._idle and self._module is not None:
                self.faults.append(_Fault(statement, "this stands in no routine: is the line of its PROC missing?"))
            self._idle = False
            self.stray.append(statement)

    def _enter_routine(self, kind: str, statement: Statement) -> None:
        self._leave_routine()
        self._leave_record()
        self._idle = True
        name, local = _routine_name(kind, statement)
        self._routine = Routine(kind, name, local, statement)
        self.layout.routines.append(self._routine)

    def _close_routine(self, kind: str, statement: Statement) -> None:
        self._leave_record()
        routine, self._routine = self._routine, None
        self._idle = True
        if routine is None:
            self.faults.append(_Fault(statement, f"{_WORDS[statement.kind]} closes nothing"))
            return
        routine.end = statement
        if routine.kind != kind:
            message = f"{_WORDS[statement.kind]} closes the {_WORDS[routine.kind]} of line {routine.head.line}"
            self.faults.append(_Fault(statement, message))

    def _close_module(self, statement: Statement) -> None:
        self._leave_routine()
        self._leave_record()
        if self._module is None:
            self.faults.append(_Fault(statement, "ENDMODULE closes nothing"))
        self._module = None
        self._idle = True

    def _leave_all(self) -> None:
        self._leave_routine()
        self._leave_record()
        self._leave_module()
        self._idle = True

    def _leave_routine(self) -> None:
        if self._routine is not None:
            self.faults.append(_not_closed(self._routine.head, ROUTINES[self._routine.kind]))
        self._routine = None

    def _leave_record(self) -> None:
        if self._record is not None:
            self.faults.append(_not_closed(self._record.head, "end_record"))
        self._record = None

    def _leave_module(self) -> None:
        if self._module is not None:
            self.faults.append(_not_closed(self._module, "end_module"))
        self._module = None


def _unbalanced(body: list[Statement]) -> list[_Fault]:
    """Faults of the blocks of one routine.

    Counting alone blames the outermost block for an inner one that lost its end. Where the count is wrong, a second
    look believes the indentation, as a reader would.
    """
    blocks = [(kind, statement) for statement in body if (kind := _block_kind(statement))]
    faults = _match(blocks, indented=False)
    if not faults:
        return faults
    by_indentation = _match(blocks, indented=True)
    return by_indentation if len(by_indentation) <= len(faults) else faults


def _match(blocks: list[tuple[str, Statement]], indented: bool) -> list[_Fault]:
    faults: list[_Fault] = []
    opened: list[tuple[str, Statement]] = []
    last: set[int] = set()  # blocks that have had their ELSE or DEFAULT, by the start of their head
    compact: list[Statement] = []
    for kind, statement in blocks:
        if kind in BLOCKS:
            opened.append((kind, statement))
        elif kind == "compact_if":
            compact.append(statement)
        elif kind in SECTIONS:
            faults += [_not_closed(head, BLOCKS[opener]) for opener, head in opened]
            opened.clear()
        else:
            closing = kind in _BLOCK_ENDS
            wanted = _BLOCK_ENDS[kind] if closing else DIVIDERS[kind]
            index = _partner(opened, wanted, statement, indented)
            if index is None and wanted == "if_" and (meant := _without_then(compact, statement)) is not None:
                faults.append(_Fault(meant, "IF without THEN"))
                if not closing:
                    opened.append((wanted, meant))
                continue
            if index is None:
                faults.append(_Fault(statement, f"{_WORDS[kind]} without {_WORDS[wanted]}"))
                continue
            faults += [_not_closed(head, BLOCKS[opener]) for opener, head in opened[index + 1 :]]
            del opened[index + 1 :]
            if closing:
                opened.pop()
                continue
            head = opened[-1][1].start
            if head in last:
                faults.append(_Fault(statement, f"{_WORDS[kind]} after the last branch of its block"))
            if kind in ("else_", "default"):
                last.add(head)
    return faults + [_not_closed(head, BLOCKS[opener]) for opener, head in opened]


def _partner(opened: list[tuple[str, Statement]], wanted: str, statement: Statement, indented: bool) -> int | None:
    """Index of the open block that a statement closes or divides."""
    candidates = [index for index, (kind, _) in enumerate(opened) if kind == wanted]
    if not candidates:
        return None
    if not indented:
        return candidates[-1]
    column = _indentation(statement)
    columns = {index: _indentation(opened[index][1]) for index in candidates}
    same = [index for index in candidates if columns[index] == column]
    if same:
        return same[-1]
    return None if column > columns[candidates[-1]] else candidates[-1]


def _without_then(compact: list[Statement], statement: Statement) -> Statement | None:
    """Return the compact IF over several lines that is meant as the head of a block: what needs it stands below it."""
    column = _indentation(statement)
    found = next((head for head in reversed(compact) if _indentation(head) == column), None)
    if found is not None:
        compact.remove(found)
    return found


def _indentation(statement: Statement) -> int:
    text, start = statement.text, statement.start
    begin = max(text.rfind("\n", 0, start), text.rfind("\r", 0, start)) + 1
    return len(text[begin:start].expandtabs(4))


def _block_kind(statement: Statement) -> str:
    """Kind of a statement that opens, divides or closes a block of a routine; empty for any other."""
    kind = statement.kind
    if kind == OPAQUE:
        kind = _opaque_kind(statement)
    if kind == "compact_if":
        return kind if "\n" in statement.source or "\r" in statement.source else ""
    return kind if kind in BLOCKS or kind in _BLOCK_ENDS or kind in DIVIDERS or kind in SECTIONS else ""


def _opaque_kind(statement: Statement) -> str:
    """Return what a broken statement seems to open: one broken head shall not unbalance all that follows."""
    source = statement.source[:65536]
    head = _OPAQUE_HEAD.match(source)
    if head is not None:
        return next(kind for kind in ROUTINES if head.group(kind))
    block = _OPAQUE_BLOCK.match(source)
    return OPAQUE if block is None else _FIRST_WORD[block.group(1).lower()]


def _routine_name(kind: str, head: Statement) -> tuple[str, bool]:
    found = _OPAQUE_HEAD.match(head.source) if head.kind == OPAQUE else None
    if found is not None:
        return found.group(kind), found.group("local") is not None
    return _names(head)[-1], _is_local(head)


def _record_name(head: Statement) -> str:
    return _names(head)[0] if head.kind != OPAQUE else ""


def _names(head: Statement) -> list[str]:
    return [node.text for node in head.node.all("name")]


def _is_local(head: Statement) -> bool:
    return head.kind != OPAQUE and bool(head.node.tokens("LOCAL"))


def _fields(statement: Statement) -> list[Field]:
    """Return the field that a statement of a record declares; ``num x;`` reads like a call with one argument."""
    words = [statement.text[start:end] for start, end in statement.tokens()]
    return [Field(words[0], words[1], statement)] if len(words) == 3 else []


def _not_closed(head: Statement, end: str) -> _Fault:
    word = _WORDS[_BLOCK_ENDS.get(end) or _ROUTINE_ENDS.get(end) or end.removeprefix("end_")]
    return _Fault(head, f"{word} without {_WORDS[end]}")


def _issue(path: str, fault: _Fault) -> Issue:
    statement = fault.statement
    text, start = statement.text, statement.start
    begin = max(text.rfind("\n", 0, start), text.rfind("\r", 0, start)) + 1
    end = min(at for at in (text.find("\r", start), text.find("\n", start), len(text)) if at >= 0)
    excerpt = text[begin : min(end, begin + 200)]
    return Issue("UNBALANCED_BLOCK", fault.message, path, statement.line, start - begin + 1, excerpt)
