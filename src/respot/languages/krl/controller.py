"""What a KUKA archive says about its controller: ``am.ini`` and the machine data, each value with its place.

``[Archive] Name Config Date``, ``[Roboter] RobName IRSerialNr``, ``[Version] Version``, ``[TechPacks] TechPacks=A|B|``
with ``A=version`` below (facts: krl.md 7). Sections and keys come in any case.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import PurePosixPath

from respot.languages.krl.symbols import Scope
from respot.program.robot import Fact
from respot.source import SourceText

#: What a person asks for, by section and key of ``am.ini`` in lower case.
_KEYS = {
    ("roboter", "robname"): "controller",
    ("roboter", "irserialnr"): "serial",
    ("version", "version"): "version",
    ("archive", "name"): "archive",
    ("archive", "config"): "archive holds",
    ("archive", "date"): "saved",
    ("techpacks", "techpacks"): "tech packs",
}


def read_facts(root: str, files: Mapping[str, bytes], scopes: Iterable[Scope]) -> dict[str, Fact]:
    """Read what an archive says about its controller.

    Parameters
    ----------
    root : str
        Folder of the controller inside the backup.
    files : mapping of str to bytes
        Its files. Of several ``am.ini`` the one nearest to the root counts.
    scopes : iterable of Scope
        Its data lists, those of the robot's own folder first.
    """
    named = [path for path in files if PurePosixPath(path).name.lower() == "am.ini"]
    facts: dict[str, Fact] = {}
    if named:
        path = min(named, key=lambda path: (path.count("/"), len(path) - len(root)))
        facts = _archive_facts(SourceText(path, files[path]))
    for scope in scopes:
        for key, fact in _data_facts(scope):
            facts.setdefault(key, fact)
    return facts


def _archive_facts(source: SourceText) -> dict[str, Fact]:
    found = {(section, key): fact for section, key, fact in _entries(source)}
    facts = {name: found[key] for key, name in _KEYS.items() if key in found}
    packs = facts.get("tech packs")
    if packs is not None:
        names = [name.strip() for name in packs.value.split("|") if name.strip()]
        versions = {name: found.get(("techpacks", name.lower())) for name in names}
        listed = (name if (version := versions[name]) is None else f"{name} {version.value}" for name in names)
        facts["tech packs"] = Fact("; ".join(listed), packs.path, packs.line)
    return {name: fact for name, fact in facts.items() if fact.value}


def _entries(source: SourceText) -> Iterator[tuple[str, str, Fact]]:
    """Yield section and key in lower case, and the value with its place."""
    section = ""
    for number in range(1, len(source.line_starts) + 1):
        line = source.line_text(number).strip().replace("\0", "")
        if line.startswith("[") and line.endswith("]"):
            section = line[1:-1].strip().lower()
        elif "=" in line and not line.startswith((";", "#")):
            key, _, value = line.partition("=")
            yield section, key.strip().lower(), Fact(value.strip(), source.path, number)


def _data_facts(scope: Scope) -> Iterator[tuple[str, Fact]]:
    """Yield what machine data say: type of the robot, their own version, the switch of absolute accuracy."""
    for key, name in (("$TRAFONAME[]", "robot type"), ("$V_R1MADA[]", "machine data")):
        symbol = scope.symbols.get(key)
        if symbol is not None and isinstance(symbol.value, str):
            yield name, Fact(symbol.value.strip('" '), symbol.path, symbol.line)
    switch = scope.symbols.get("$DEACTIVATE_ABS_ACCUR")
    if switch is not None and isinstance(switch.value, str):
        off = switch.value.upper() == "TRUE"
        said = "switched off" if off else "not switched off; whether the robot has it stands on its RDC"
        yield "absolute accuracy", Fact(f"{said} ($DEACTIVATE_ABS_ACCUR)", switch.path, switch.line)
