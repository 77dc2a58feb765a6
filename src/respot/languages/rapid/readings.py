r"""Where RAPID code takes the value of a tool or work object, other than to move under it.

A motion's own tool and ``\WObj`` are no readings, nor is what a routine is handed that only moves under it. Anything
else is: a field that is looked at, a copy, ``CalcJointT``, a name in a text that ``GetDataVal`` gets. What is in force
is read by ``CRobT`` and ``CPos`` without arguments, ``CTool``, ``CWObj`` and ``GetSysData``.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from respot.languages.rapid.blocks import Routine as Block
from respot.languages.rapid.calls import Invocation
from respot.languages.rapid.frames import Frames
from respot.languages.rapid.records import BUILT_IN
from respot.languages.rapid.references import Datum, resolve, whole
from respot.languages.rapid.run_time import bound, literal_start
from respot.languages.rapid.symbols import Module, Symbol, Task
from respot.program.frames import Frame, FrameReading, Role
from respot.program.robot import ProgramFile
from respot.program.statement import OPAQUE, Node, Statement

_ROLES: Mapping[str, Role] = {"wobjdata": "base", "tooldata": "tool"}
_IN_FORCE: Mapping[str, Sequence[Role]] = {"cwobj": ("base",), "ctool": ("tool",), "getsysdata": ("base", "tool")}
#: Where the robot is: seen from what is in force, unless they are told from what.
_PLACES = frozenset(("crobt", "cpos"))
_TOLD: Sequence[tuple[Role, str]] = (("base", "wobj"), ("tool", "tool"))
_LOADING = frozenset(("load", "startload"))
_READS = "code reads it"
_DEEPEST = 8


@dataclass(frozen=True)
class _Handed:
    """A frame that a routine is handed: as ``parameter``, by ``caller``, which may have it from its own caller."""

    caller: Block | None
    datum: Datum
    line: int
    path: str


@dataclass
class _Seen:
    """What is known of a task so far."""

    readings: list[FrameReading] = field(default_factory=list)
    #: by routine and parameter
    handed: dict[tuple[int, str], list[_Handed]] = field(default_factory=dict)
    read: set[tuple[int, str]] = field(default_factory=set)
    #: places of arguments that are handed on: the routine that gets them decides
    decided: set[tuple[str, int]] = field(default_factory=set)


class TaskReadings:
    """Readings of one task.

    Parameters
    ----------
    task : Task
    frames : Frames
        Its tools and work objects, as its motions use them.
    files : mapping of str to ProgramFile
        Its modules by path.
    """

    def __init__(self, task: Task, frames: Frames, files: Mapping[str, ProgramFile]) -> None:
        self._task = task
        self._frames = frames
        self._files = files

    def find(self, unread: Mapping[str, bytes], loadable: Mapping[str, bytes]) -> list[FrameReading]:
        """Return every reading of a tool or work object.

        Parameters
        ----------
        unread : mapping of str to bytes
            Module files of the task that cannot be read.
        loadable : mapping of str to bytes
            Module files that are in no task, and that code may load.
        """
        seen = _Seen()
        loads = False
        for module in self._task.modules:
            for block in module.routines.values():
                for line in module.lines(block):
                    for call in line.calls:
                        loads |= call.name.lower() in _LOADING
                        self._in_call(seen, call, block, module)
        for module in self._task.modules:
            self._in_module(seen, module)
        self._follow(seen)
        for path, data in {**unread, **(loadable if loads else {})}.items():
            seen.readings += self._in_text(path, data)
        return seen.readings

    # ------------------------------------------------------------------------------------------------------- calls

    def _in_call(self, seen: _Seen, call: Invocation, block: Block, module: Module) -> None:
        name, path = call.name.lower(), module.path
        callee = self._task.routine(call.name, module) if name else None
        if callee is not None:
            self._in_arguments(seen, call, callee[0], block, module)
            return
        if call.is_function:  # \WObj?WObj
            seen.read |= {(id(block), item.given) for item in call.arguments() if item.given}
        if name in _PLACES:
            given = {item.name for item in call.arguments()}
            roles = [role for role, option in _TOLD if option not in given]
            seen.readings += _in_force(call, roles, path)
        elif name in _IN_FORCE:
            seen.readings += _in_force(call, _IN_FORCE[name], path)
        elif name == "getdataval":
            values = [item.value for item in call.arguments() if item.value is not None]
            start = literal_start(values[0]).lower() if values else ""
            exact = bool(values) and values[0].kind == "string"
            for frame, role in self._frames.all():
                word = _datum_of(frame)
                if word == start if exact else word.startswith(start):
                    seen.readings.append(FrameReading(frame, role, f"{call.name} may read it", path, call.line))

    def _in_arguments(self, seen: _Seen, call: Invocation, callee: Block, block: Block, module: Module) -> None:
        local = self._task.locals(block, module)
        for parameter, argument in bound(self._task.parameters(callee), call.arguments()):
            if self._role(parameter.type, module) is None and not self._holds(parameter.type, module):
                continue
            datum = None
            if argument.given:
                symbol = local.get(argument.given)
                datum = None if symbol is None else whole(symbol, self._task, module)
            elif argument.value is not None and argument.value.kind == "reference":
                datum = resolve(argument.value, self._task, module, local)
                seen.decided.add((module.path, argument.value.span[0]))
            if datum is not None:
                handed = _Handed(block, datum, call.line, module.path)
                seen.handed.setdefault((id(callee), parameter.name.lower()), []).append(handed)

    def _follow(self, seen: _Seen) -> None:
        """Carry what routines read of their parameters to where they get it from."""
        pending = list(seen.read)
        while pending:
            for handed in seen.handed.get(pending.pop(), ()):
                symbol = handed.datum.symbol
                if symbol.storage != "parameter":
                    what = "a routine that gets it reads it"
                    seen.readings += self._of_datum(handed.datum, what, handed.path, handed.line)
                    continue
                key = (id(handed.caller), symbol.name.lower())
                if key not in seen.read:
                    seen.read.add(key)
                    pending.append(key)

    # ---------------------------------------------------------------------------------------------------- mentions

    def _in_module(self, seen: _Seen, module: Module) -> None:
        file = self._files[module.path]
        names = self._names(module)
        if not names:
            return
        starts = [statement.start for statement in file.statements]
        blocks = sorted(module.routines.values(), key=lambda block: block.head.start)
        heads = [block.head.start for block in blocks]
        used = self._frames.used.get(module.path, ())
        for match in names.finditer(file.source.text):
            row = bisect_right(starts, match.start()) - 1
            statement = file.statements[row] if row >= 0 else None
            if statement is None or match.start() >= statement.end or statement.kind == "comment":
                continue
            if (module.path, match.start()) in seen.decided or match.start() in used:
                continue
            at = bisect_right(heads, match.start()) - 1
            inside = at >= 0 and bool(blocks[at].body) and match.start() < blocks[at].body[-1].end
            self._mention(seen, match, statement, module, blocks[at] if inside else None)

    def _mention(
        self, seen: _Seen, match: re.Match[str], statement: Statement, module: Module, block: Block | None
    ) -> None:
        local = {} if block is None else self._task.locals(block, module)
        if statement.kind == OPAQUE:
            symbol = self._task.find(match[0], module, local)
            datum = None if symbol is None else whole(symbol, self._task, module)
        else:
            node = _reference_at(statement, match.start())
            datum = None if node is None else resolve(node, self._task, module, local)
        if datum is None:
            return
        if datum.symbol.storage == "parameter":
            if block is not None:
                seen.read.add((id(block), datum.symbol.name.lower()))
            return
        seen.readings += self._of_datum(datum, _READS, module.path, statement.line)

    def _names(self, module: Module) -> re.Pattern[str] | None:
        """Find names of data that are frames, or hold one."""
        found: set[str] = set()
        for other in self._task.modules:
            for symbol in other.symbols.values():
                if self._is_of_frames(symbol, other):
                    found.add(symbol.name)
        for block in module.routines.values():
            found |= {s.name for s in self._task.locals(block, module).values() if self._is_of_frames(s, module)}
        words = "|".join(sorted(map(re.escape, found), key=len, reverse=True))
        return re.compile(rf"(?<![\w.\\])(?:{words})(?!\w)", re.IGNORECASE) if words else None

    def _is_of_frames(self, symbol: Symbol, module: Module) -> bool:
        return self._role(symbol.type, module) is not None or self._holds(symbol.type, module)

    def _role(self, kind: str, module: Module) -> Role | None:
        return _ROLES.get(self._task.type_of(kind, module))

    def _holds(self, kind: str, module: Module, depth: int = 0) -> bool:
        """Whether a record type has a field that is a frame."""
        kind = self._task.type_of(kind, module)
        if kind in BUILT_IN or depth > _DEEPEST:
            return kind in _ROLES
        fields = self._task.fields(kind, module)
        return fields is not None and any(self._holds(inner, module, depth + 1) for inner, _ in fields)

    def _of_datum(self, datum: Datum, what: str, path: str, line: int) -> Iterator[FrameReading]:
        """Yield a reading of every frame that is a datum, a part of it, or has it as a part."""
        for keys, frame, role in self._frames.of_symbol(datum.symbol):
            shared = min(len(keys), len(datum.keys))
            if datum.unknown or keys[:shared] == datum.keys[:shared]:
                yield FrameReading(frame, role, what, path, line)

    def _in_text(self, path: str, data: bytes) -> Iterator[FrameReading]:
        """Yield frames that a file which is not read names."""
        words = {word.lower() for word in re.findall(r"[^\W\d]\w*", data.decode("latin-1"))}
        for frame, role in self._frames.all():
            if _datum_of(frame) in words:
                yield FrameReading(frame, role, "a file that is no part of the programs names it", path, 1)


def _datum_of(frame: Frame) -> str:
    """Name, in lower case, of the datum that a frame is, or is a part of."""
    return re.split(r"[{.]", frame.name)[0].lower()


def _in_force(call: Invocation, roles: Iterable[Role], path: str) -> Iterator[FrameReading]:
    for role in roles:
        yield FrameReading(None, role, f"code reads {call.name}, which depends on it", path, call.line)


def _reference_at(statement: Statement, start: int) -> Node | None:
    """Reference that begins at a place, unless only its presence is asked for."""
    for call in statement.find("function_call"):
        asked = call.tokens("NAME")
        if asked and asked[0].text.lower() == "present" and call.span[0] < start < call.span[1]:
            return None
    return next((node for node in statement.find("reference") if node.span[0] == start), None)
