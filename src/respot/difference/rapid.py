"""RAPID as a comparison sees it (facts: rapid.md sections 1, 2 and 3)."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence

from respot.difference.canonical import plain_tokens
from respot.difference.dialect import Datum, Dialect, FrameValue, Path, ranked
from respot.languages.rapid.calls import read_lines
from respot.languages.rapid.forms import FORMS, InstructionForm, instruction_form
from respot.languages.rapid.machine import read_tool, read_work_object
from respot.languages.rapid.records import BUILT_IN, Fields
from respot.languages.rapid.symbols import Aggregate, Symbol, Value, data_symbol
from respot.languages.rapid.syntax import AFTER_MODULE, COMMENT
from respot.program.robot import Robot
from respot.program.statement import OPAQUE, Statement
from respot.program.targets import Number

_FLOW = frozenset(
    [
        "if_", "elseif", "else_", "end_if", "for_", "end_for", "while_", "end_while", "test", "case", "default",
        "end_test", "label", "goto", "return_", "raise_", "exit_", "retry", "trynext", "connect", "compact_if", "error",
        "undo", "backward", "procedure", "end_procedure", "function", "end_function", "trap", "end_trap", "module",
        "end_module",
    ]
)  # fmt: skip
_TYPES = {
    "speeddata": "speed", "zonedata": "zone", "stoppointdata": "zone", "spotdata": "weld", "gundata": "weld",
    "gunnum": "weld", "forcedata": "weld", "simdata": "weld", "welddata": "weld", "seamdata": "weld",
    "weavedata": "weld", "trackdata": "weld", "robtarget": "target", "jointtarget": "target", "o_robtarget": "target",
    "o_jointtarget": "target", "tooldata": "frame", "wobjdata": "frame", "loaddata": "frame", "pose": "frame",
}  # fmt: skip
#: Fields that a pose is made of: it is compared as a whole.
_PLACES = ("tframe.", "uframe.", "oframe.", "trans.", "rot.")
_FRAMES = {"tooldata": "tool", "wobjdata": "base", "loaddata": "load", "pose": "frame"}
_IO = re.compile(r"(?:Set|Reset|Invert|Pulse)(?:[DAG][OI])?|Wait[DAG][IO]|(?:Alias|Signal)IO\w*", re.IGNORECASE)
_WAIT = frozenset(("waittime", "waituntil", "waitrob", "waitsynctask"))
_SPEED = frozenset(("accset", "velset", "worldacclim", "pathaccclim", "pathacclim", "speedrefresh"))
_MOTION_STATE = frozenset(
    ("confl", "confj", "singarea", "pdispon", "pdispset", "pdispoff", "eoffson", "eoffsset", "eoffsoff", "motionsup")
)
_WELDS = re.compile(r"Spot|Arc|Calib|SetForce|IndGun|Swi?tch|Solda|Weld|Stud", re.IGNORECASE)
#: Options of a motion -> what they are about.
_OPTIONS = {
    "wobj": "frame", "tload": "frame", "v": "speed", "t": "speed", "z": "zone", "inpos": "zone",
    "id": "motion", "conc": "motion", "noeoffs": "motion", "corr": "motion",
}  # fmt: skip
_ORDER = ("motion", "target", "speed", "zone", "weld", "frame", "io", "call")
#: Left of ``:=``, unless it names an argument, and what RobotWare's counting instructions count.
_LEFT_SIDE = re.compile(
    r"\b(?:Add|Incr|Decr|Clear|BitSet|BitClear)\s+([^\W\d]\w*(?:\s*\{[^}]*\}|\s*\.\s*\w+)*)"
    r"|(?<![\w.\\])([^\W\d]\w*(?:\s*\{[^}]*\}|\s*\.\s*\w+)*)\s*:=",
    re.IGNORECASE,
)
#: A blank after a comma of a value: a controller that saves a persistent datum writes none.
_TYPED = re.compile(r",[ \t]")


def _name_of(statement: Statement) -> str:
    tokens = plain_tokens(statement)
    for index, token in enumerate(tokens):
        if token.upper() in ("PROC", "TRAP", "RECORD") and index + 1 < len(tokens):
            return tokens[index + 1]
        if token.upper() == "FUNC" and index + 2 < len(tokens):
            return tokens[index + 2]
    return ""


def _symbol(path: str, statement: Statement) -> Symbol | None:
    return data_symbol(path, statement) if statement.kind == "data" else None


def _declared(path: str, statement: Statement) -> Sequence[Datum]:
    symbol = _symbol(path, statement)
    if symbol is not None:
        return [Datum(symbol.name.upper(), symbol.type.upper())]
    tokens = plain_tokens(statement) if statement.kind == "alias" else []
    return [Datum(tokens[-2].upper(), "ALIAS")] if len(tokens) > 2 else []


def _frames(path: str, statement: Statement) -> Sequence[FrameValue]:
    symbol = _symbol(path, statement)
    kind = None if symbol is None else _FRAMES.get(symbol.type)
    value = None if symbol is None or kind is None else symbol.value
    if symbol is None or kind is None or not isinstance(value, Aggregate):
        return []
    name, line = symbol.name, symbol.line
    if symbol.type == "tooldata":
        pose = read_tool(name, value, symbol.path, line).pose
    elif symbol.type == "wobjdata":
        pose = read_work_object(name, value, symbol.path, line).pose
    elif symbol.type == "pose":  # read as the frame of a tool without its load
        pose = read_tool(name, Aggregate(["TRUE", value, ""], value.span), symbol.path, line).pose
    else:
        pose = None
    fields = dict(_flat(value, symbol.type, ""))
    if pose is not None:
        fields = {place: item for place, item in fields.items() if not place.startswith(_PLACES)}
    return [FrameValue(kind, name, pose, value.span, fields)]


def _flat(value: Value, kind: str, prefix: str) -> Iterator[tuple[str, float | str]]:
    """Yield every value of a record with its name: ``tload.mass``."""
    if isinstance(value, Aggregate):
        known = BUILT_IN.get(kind, ())
        names = known if len(known) == len(value.items) else [("", str(index + 1)) for index in range(len(value.items))]
        for item, (inner, name) in zip(value.items, names, strict=True):
            yield from _flat(item, inner, f"{prefix}{name}.")
    else:
        yield prefix.rstrip("."), float(value.value) if isinstance(value, Number) else str(value).upper()


def _values(path: str, statement: Statement, records: Mapping[str, Sequence[tuple[str, str]]]) -> Mapping[Path, str]:
    symbol = _symbol(path, statement)
    if symbol is None or symbol.value is None:
        return {}
    found: dict[Path, str] = {}
    waiting: list[tuple[Path, Value, str, int]] = [
        ((symbol.name.upper(),), symbol.value, symbol.type, symbol.dimensions)
    ]
    while waiting:
        place, value, kind, dimensions = waiting.pop()
        if not isinstance(value, Aggregate):
            found[place] = str(float(value.value)) if isinstance(value, Number) else str(value)
            continue
        known = () if dimensions else BUILT_IN.get(kind) or records.get(kind, ())
        for index, item in enumerate(value.items):
            inner, name = known[index] if len(known) == len(value.items) else (kind if dimensions else "", "")
            step = name.upper() or (str(index + 1) if dimensions else f"#{index + 1}")
            waiting.append(((*place, step), item, inner, max(0, dimensions - 1)))
    return found


def _records(robot: Robot) -> Mapping[str, Fields]:
    """Return type and name of each field of the records that the modules of a robot declare, by name in lower case."""
    found: dict[str, Fields] = {}
    for file in robot.files.values():
        if "RECORD" not in file.source.text.upper():
            continue
        name, fields = "", list[tuple[str, str]]()
        for statement in file.statements:
            if statement.kind == "record":
                name, fields = _name_of(statement).lower(), []
            elif statement.kind == "end_record":
                found[name], name = tuple(fields), ""
            elif name and statement.kind != COMMENT:
                tokens = plain_tokens(statement)
                fields.append((tokens[0].lower(), tokens[1] if len(tokens) > 1 else ""))
    return found


def _noise(statement: Statement, declared: Sequence[Datum]) -> str:
    del statement, declared
    return ""


def _about(statement: Statement) -> str:
    kind = statement.kind
    if kind in _FLOW:
        return "flow"
    if kind == "data":
        symbol = data_symbol("", statement)
        if symbol is None:
            return "data"
        return "io" if symbol.type.startswith("signal") else _TYPES.get(symbol.type, "data")
    if kind == "call":
        return _about_call(plain_tokens(statement)[0])
    return {"opaque": "unread", "header": "header"}.get(kind, "data")


def _about_call(name: str) -> str:
    lower = name.lower()
    if instruction_form(name) is not None or FORMS.wrapper(name) is not None or lower in _MOTION_STATE:
        return "motion"
    if _IO.fullmatch(name):
        return "io"
    if lower in _WAIT:
        return "wait"
    if lower in _SPEED:
        return "speed"
    return "weld" if FORMS.welds(name) or _WELDS.match(name) else "call"


def _aspects(old: Statement, new: Statement) -> tuple[str, ...]:
    abouts = (_about(old), _about(new))
    if abouts != ("motion", "motion") or {old.kind, new.kind} != {"call"}:
        return ranked(abouts)
    names = [plain_tokens(statement)[0] for statement in (old, new)]
    forms = [instruction_form(name) for name in names]
    parts = [_motion_parts(statement, form) for statement, form in zip((old, new), forms, strict=True)]
    differing = {
        about for about in {*parts[0], *parts[1]} if parts[0].get(about, []) != parts[1].get(about, [])
    }  # fmt: skip
    if names[0].lower() != names[1].lower():
        differing.add("motion")
    return tuple(about for about in _ORDER if about in differing) or ("motion",)


def _motion_parts(statement: Statement, form: InstructionForm | None) -> dict[str, list[str]]:
    """Arguments of a motion by what they are about."""
    calls = read_lines([statement])[0].calls
    parts: dict[str, list[str]] = {}
    if not calls:
        return parts
    arguments = calls[0].arguments()
    places = [argument for argument in arguments if argument.kind == "argument"]
    welds = FORMS.is_weld_instruction(calls[0].name) or bool(_WELDS.match(calls[0].name))
    for argument in arguments:
        text = "" if argument.value is None else "".join(argument.value.text.split()).upper()
        about = _OPTIONS.get(argument.name, "weld" if welds else "call") if argument.name else ""
        if not about:
            about = _place_about(places.index(argument), len(places), form, welds)
        parts.setdefault(about, []).append(f"{argument.name}={text}" if argument.name else text)
    return parts


def _place_about(place: int, count: int, form: InstructionForm | None, welds: bool) -> str:
    if form is None:
        return "motion"
    if place in form.targets:
        return "target"
    if place == max(form.targets) + 1:
        return "speed"
    if form.tool is not None and place == form.tool % count:
        return "frame"
    return "weld" if welds else "zone" if place == max(form.targets) + 2 else "motion"


def _companions(name: str) -> Sequence[str]:
    """Name of what keeps the original of a target that was touched up."""
    return [f"O_{name}"]


def _persistent(statement: Statement) -> bool:
    symbol = data_symbol("", statement) if statement.kind == "data" else None
    return symbol is not None and symbol.storage == "PERS"


def _typed(statement: Statement) -> bool:
    source = statement.source
    return bool(_TYPED.search(source, source.find(":=")))


RAPID = Dialect(
    heads=frozenset(("procedure", "function", "trap", "record")),
    ends=frozenset(("end_procedure", "end_function", "end_trap", "end_record")),
    data=frozenset(("data", "alias")),
    data_heads=frozenset(),
    comments=frozenset((COMMENT, AFTER_MODULE)),
    folds=frozenset(),
    name_of=_name_of,
    declared=_declared,
    frames=_frames,
    noise=_noise,
    about=_about,
    aspects=_aspects,
    companions=_companions,
    persistent=_persistent,
    typed=_typed,
    values=_values,
    records=_records,
    local_data=frozenset(("data",)),
    writing=frozenset(("assignment", "compact_if", "call", OPAQUE)),
    left=_LEFT_SIDE,
    precise=True,
)
