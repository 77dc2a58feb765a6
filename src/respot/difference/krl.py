"""KRL as a comparison sees it (facts: krl.md sections 5, 6 and 8)."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence

from respot.difference.dialect import Datum, Dialect, FrameValue, Path, path_of, ranked
from respot.geometry import pose, rotation_from_abc
from respot.languages.krl.forms import FORMS
from respot.languages.krl.symbols import Aggregate, Symbol, read_symbols
from respot.languages.krl.syntax import COMMENT, END_FOLD, FOLD
from respot.program.statement import OPAQUE, Statement
from respot.program.targets import Number

_POSE = ("X", "Y", "Z", "A", "B", "C")
_DATA = re.compile(r"(TOOL|BASE|LOAD)_DATA\[")
_WELD_TYPE = re.compile(r"SPOT|WELD|RIVET|RVT|SWP|GUN|GLUE|STUD|NUT|ARC_|SEAM|KLEB|KLB", re.IGNORECASE)
_FLOW = frozenset(
    [
        "if_", "else_", "end_if", "for_", "end_for", "while_", "end_while", "repeat", "until", "loop", "end_loop",
        "switch", "case", "default", "end_switch", "exit_", "goto", "label", "return_", "halt", "continue_", "routine",
        "function", "end_routine", "data_list", "end_data_list", "interrupt_declaration", "interrupt", "brake",
        "resume", "confirm", "on_error",
    ]
)  # fmt: skip
_MOTION = frozenset(
    [
        "motion", "relative_motion", "circular_motion", "touch_up_motion", "spline", "end_spline", "time_block",
        "const_vel", "stop_when", "asyptp", "asycancel",
    ]
)  # fmt: skip
#: Begin of the left side of an assignment -> what it is about.
_LEFT = (
    (re.compile(r"\$(?:VEL|ACC|OV_PRO|OV_JOG)|[PL]DAT_ACT"), "speed"),
    (re.compile(r"\$APO"), "zone"),
    (re.compile(r"\$(?:OUT|ANOUT|IN\b|DIGOUT|CYCFLAG)"), "io"),
    (re.compile(r"\$(?:TOOL|BASE|LOAD|IPO_MODE)|FDAT_ACT"), "frame"),
    (re.compile(r"S_ACT|S_READY"), "weld"),
)
_TYPES = {"PDAT": "speed", "LDAT": "speed", "FDAT": "frame", "LOAD": "frame", "FRAME": "frame"}
_POINTS = frozenset(("POS", "E6POS", "E3POS", "AXIS", "E6AXIS", "E3AXIS"))
_IO = re.compile(r"\$(?:IN|OUT|ANIN|ANOUT|DIGIN|DIGOUT)\b|\bPULSE\b", re.IGNORECASE)
_ZONES = frozenset(("C_PTP", "C_DIS", "C_ORI", "C_VEL", "C_SPL"))
_COUNTER = re.compile(r"&\s*(?:REL|COMMENT)\b", re.IGNORECASE)
_LEFT_SIDE = re.compile(r"(?<![\w$.#])([\w$]+(?:\s*\[[^\]]*\]|\s*\.\s*\w+)*)\s*=(?!=)")
#: What a point X10 is named with: tool and base, velocity of PTP and of CP.
_COMPANIONS = ("F", "PP", "LL", "P", "L")


def _name_of(statement: Statement) -> str:
    names = statement.node.tokens("NAME")
    return names[-1].text


def _symbols(path: str, statement: Statement) -> list[Symbol]:
    return list(read_symbols(path, [statement], "", everywhere=True).symbols.values())


def _declared(path: str, statement: Statement) -> Sequence[Datum]:
    return [Datum(symbol.name.upper(), symbol.type) for symbol in _symbols(path, statement)]


def _frames(path: str, statement: Statement) -> Sequence[FrameValue]:
    found = []
    for symbol in _symbols(path, statement):
        value = symbol.value
        if not isinstance(value, Aggregate):
            continue
        numbered = _DATA.match(symbol.name.upper())
        kind = numbered[1].lower() if numbered else _TYPES.get(symbol.type, "") and symbol.type.lower()
        if not kind and not symbol.type and set(value.members) == set(_POSE):
            kind = "frame"
        if kind not in ("tool", "base", "load", "frame"):
            continue
        numbers = [value.number(name) for name in _POSE]
        known = [number for number in numbers if number is not None]
        place = pose(known[:3], rotation_from_abc(known[3:])) if len(known) == 6 and kind != "load" else None
        fields = {name: text for name, text in _flat(value, "") if place is None or name not in _POSE}
        found.append(FrameValue(kind, symbol.name, place, value.span, fields))
    return found


def _flat(value: Aggregate, prefix: str) -> Iterator[tuple[str, float | str]]:
    for name, member in value.members.items():
        if isinstance(member, Aggregate):
            yield from _flat(member, f"{prefix}{name}.")
        else:
            yield prefix + name, float(member.value) if isinstance(member, Number) else member


def _values(path: str, statement: Statement, records: Mapping[str, object]) -> Mapping[Path, str]:
    del records  # members have their names in the value
    found: dict[Path, str] = {}
    for symbol in _symbols(path, statement):
        start = path_of(symbol.name)
        value = symbol.value
        if isinstance(value, Aggregate):
            found.update({(*start, *name.upper().split(".")): str(item) for name, item in _flat(value, "")})
        elif value is not None:
            found[start] = str(float(value.value)) if isinstance(value, Number) else str(value)
    return found


def _noise(statement: Statement, declared: Sequence[Datum]) -> str:
    if statement.kind == "header":
        return "header" if _COUNTER.match(statement.source) else ""
    return "last_used" if declared and all(datum.name.startswith("LAST_") for datum in declared) else ""


def _about(statement: Statement) -> str:
    kind = statement.kind
    if kind in _MOTION:
        return "motion"
    if kind in _FLOW:
        return "flow"
    if kind == "call":
        return _about_call(statement)
    if kind == "assignments":
        return _about_assignment(statement)
    if kind == "declaration":
        return _about_declaration(statement)
    if kind in ("trigger", "anout", "anin", "signal"):
        return "io"
    if kind in ("wait_for", "wait_sec"):
        return "io" if _IO.search(statement.source) else "wait"
    return {"header": "header", "opaque": "unread"}.get(kind, "data")


def _about_call(statement: Statement) -> str:
    source = statement.source.lstrip()
    name, _, rest = source.partition("(")
    name = name.strip().upper()
    if name == "BAS":
        command = rest.upper()
        return "frame" if command.startswith(("#TOOL", "#BASE", "#FRAMES")) else "speed"
    if name == "PULSE":
        return "io"
    arguments = tuple(part.strip() for part in rest.rpartition(")")[0].split(","))
    return "weld" if FORMS.welds(name, arguments) else "call"


def _about_assignment(statement: Statement) -> str:
    left = "".join(statement.node.all("assignment")[0].nodes[0].text.split()).upper()
    if _DATA.match(left):
        return "frame"
    return next((about for pattern, about in _LEFT if pattern.match(left)), "data")


def _about_declaration(statement: Statement) -> str:
    kind = statement.node.tokens("NAME")[0].text.upper()
    if kind in _POINTS:
        return "target"
    return _TYPES.get(kind, "weld" if _WELD_TYPE.search(kind) else "data")


def _aspects(old: Statement, new: Statement) -> tuple[str, ...]:
    abouts = (_about(old), _about(new))
    if abouts != ("motion", "motion") or old.kind != new.kind:
        return ranked(abouts)
    parts = [_motion_parts(statement) for statement in (old, new)]
    found = [name for name in ("motion", "target", "zone", "speed") if parts[0][name] != parts[1][name]]
    return tuple(found) or ("motion",)


def _motion_parts(statement: Statement) -> dict[str, list[str]]:
    """Tokens of a motion: its instruction, its goal, how it is approximated, and its WITH list."""
    parts: dict[str, list[str]] = {"motion": [], "target": [], "zone": [], "speed": []}
    part = "motion"
    for start, end in statement.tokens():
        word = statement.text[start:end].upper()
        if word in _ZONES:
            parts["zone"].append(word)
            continue
        if word == "WITH":
            part = "speed"
        parts[part].append(word)
        if part == "motion":
            part = "target"
    return parts


def _companions(name: str) -> Sequence[str]:
    """Names of the FDAT, PDAT and LDAT that inline forms give a point."""
    return [prefix + name[1:] for prefix in _COMPANIONS] if name.startswith("X") else []


KRL = Dialect(
    heads=frozenset(("routine", "function", "data_list")),
    ends=frozenset(("end_routine", "end_data_list")),
    data=frozenset(("declaration", "assignments")),
    data_heads=frozenset(("data_list",)),
    comments=frozenset((COMMENT,)),
    folds=frozenset((FOLD, END_FOLD)),
    name_of=_name_of,
    declared=_declared,
    frames=_frames,
    noise=_noise,
    about=_about,
    aspects=_aspects,
    companions=_companions,
    persistent=lambda _: True,  # a data list is the controller's own memory
    typed=lambda _: False,
    values=_values,
    records=lambda _: {},
    local_data=frozenset(("declaration",)),
    writing=frozenset(("assignments", "trigger", "interrupt_declaration", "for_", OPAQUE)),
    left=_LEFT_SIDE,
    precise=False,  # what is handed to a routine that is not there counts as changed
    writers=frozenset(("CREAD", "SREAD", "SWRITE", "CAST_FROM", "CAST_TO", "MBX_REC", "MD_GETSTATE")),
    first_is_main=True,
)
