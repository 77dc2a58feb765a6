"""Robot data of an ABB backup as plain values: ``MOC.cfg``, ``system.xml``, tools and work objects."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import PurePosixPath

from scipy.spatial.transform import RigidTransform

from respot.geometry import pose, rotation_from_quaternion
from respot.languages.rapid.symbols import Aggregate, Symbol, Value
from respot.program.frames import Frame
from respot.program.robot import Machine
from respot.source import SourceText

TOOL0 = Frame("tool0", world=True, held=True)
WOBJ0 = Frame("wobj0", world=True)

#: ``-name "x" -attr 1 -flag`` with continuation lines already joined
_ATTRIBUTE = re.compile(r'-(\w+)(?:\s+("[^"]*"|(?!-[A-Za-z_])\S+))?')
_SYSTEM_NAME = re.compile(r"<SystemName>([^<]*)</SystemName>")

Configuration = dict[str, list[dict[str, str]]]


def read_configuration(text: str) -> Configuration:
    """Instances of a ``.cfg`` file by type: ``{"ROBOT": [{"use_robot_type": ..}]}`` (facts: rapid.md 4.3)."""
    found: Configuration = {}
    section = ""
    joined = re.sub(r"\\[ \t]*\r*\n", " ", text)
    for line in joined.splitlines():
        line = line.strip()
        if re.fullmatch(r"[A-Z][A-Z0-9_]*:", line):
            section = line[:-1]
            found.setdefault(section, [])
        elif line.startswith("-") and section:
            found[section].append({key: value.strip('"') for key, value in _ATTRIBUTE.findall(line)})
    return found


def read_machine(files: Mapping[str, bytes]) -> Machine:
    """Robot type and configuration of a backup's ``MOC.cfg``."""
    for path, data in files.items():
        if PurePosixPath(path).name.lower() == "moc.cfg":
            configuration = read_configuration(SourceText(path, data, ("latin-1",)).text)
            robots = configuration.get("ROBOT", [])
            model = robots[0].get("use_robot_type", "") if robots else ""
            return Machine(model, dict(configuration), (path,))
    return Machine()


def system_name(files: Mapping[str, bytes]) -> str:
    """Name of the system, from ``system.xml``; empty if there is none."""
    for path, data in files.items():
        if PurePosixPath(path).name.lower() == "system.xml":
            found = _SYSTEM_NAME.search(SourceText(path, data, ("latin-1",)).text)
            return found[1].strip() if found else ""
    return ""


def read_tool(symbol: Symbol) -> Frame:
    """Tool of a ``tooldata``: ``[robhold,[[x,y,z],[q1,q2,q3,q4]],[load]]``."""
    items: Sequence[Value] = symbol.value.items if isinstance(symbol.value, Aggregate) else ()
    found = _pose(items[1]) if len(items) == 3 else None
    unknown = "" if found is not None else "no literal tooldata"
    return Frame(symbol.name, "", found, unknown, symbol.path, symbol.line, held=_true(items[:1]))


def read_work_object(symbol: Symbol) -> Frame:
    """Base of a ``wobjdata``: ``[robhold,ufprog,ufmec,uframe,oframe]``; its pose is ``uframe * oframe``."""
    items: Sequence[Value] = symbol.value.items if isinstance(symbol.value, Aggregate) else ()
    user, work = (_pose(items[3]), _pose(items[4])) if len(items) == 5 else (None, None)
    held = _true(items[:1])
    if user is None or work is None:
        return Frame(symbol.name, "", None, "no literal wobjdata", symbol.path, symbol.line, held=held)
    if not _true(items[1:2]):
        unit = str(items[2]).strip('"') or "a mechanical unit"
        return Frame(
            symbol.name, "", None, f"its user frame moves with {unit}", symbol.path, symbol.line, held=held
        )  # fmt: skip
    return Frame(symbol.name, "", user * work, "", symbol.path, symbol.line, held=held)


def _pose(value: Value) -> RigidTransform | None:
    if not isinstance(value, Aggregate) or value.shape() != (3, 4):
        return None
    parts = [item.numbers() for item in value.items if isinstance(item, Aggregate)]
    if any(part is None for part in parts):
        return None
    position, quaternion = ([float(number.value) for number in part] for part in parts if part is not None)
    if not any(quaternion):
        return None
    return pose(position, rotation_from_quaternion(quaternion))


def _true(items: Sequence[Value]) -> bool:
    return bool(items) and str(items[0]).upper() == "TRUE"
