"""Finds the controllers in a tree of files: where each has its root, and which of its program files are live.

KUKA: ``KRC/R1`` with ``KRC/STEU``; a bare ``R1``; ``System`` and ``Mada`` of half a backup. ABB: ``RAPID`` with
``TASK1`` or ``PROGMOD``; ``TASK1/SYSMOD`` alone. All in any case and under any folders (facts: krl.md 7, rapid.md 4.1).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from respot.issues import Issue
from respot.languages import LANGUAGES, Language
from respot.languages.layout import live_programs

_TASK = re.compile(r"task\d+|t_\w+", re.IGNORECASE)
_R = re.compile(r"r\d|steu")
#: Files that only a robot has, and their folder.
_MARKS = {"$config.dat": "system", "$machine.dat": "mada"}
_MODULES = frozenset(("progmod", "sysmod"))
#: Folders of a KUKA robot's own folder; VKRC has its own names.
_R1 = frozenset(("program", "system", "mada", "tp", "folgen", "ups", "makros", "bmw_program", "cell.src"))
#: Folders above ``KRC`` on a controller's own disk.
_DRIVE = frozenset(("c", "d", "krc", "roboter"))
#: Folders that only a controller makes; a tree inside one is no backup of its own.
_OWN = {
    "krl": frozenset(("krc", "r1", "steu", "c", "d")),
    "rapid": frozenset(("rapid", "home", "syspar", "backinfo", "cs", "intern")),
}
#: Files without which a backup is half one, and what that costs.
_PARTS: dict[str, Sequence[tuple[str, str]]] = {
    "krl": (
        ("$config.dat", "numbered tools and bases are not known"),
        ("$machine.dat", "the robot's kinematics and limits are not known"),
    ),
    "rapid": (
        ("moc.cfg", "the robot's type, place and limits are not known"),
        ("sys.cfg", "which task moves which robot is not known"),
        ("backinfo.txt", "names of tasks, RobotWare and options are not known"),
    ),
}


@dataclass(frozen=True)
class Controller:
    """A controller in a tree.

    Parameters
    ----------
    language : Language
        What its programs are written in.
    root : str
        Its folder, with a trailing ``/`` unless it is the whole tree.
    """

    language: Language
    root: str

    @property
    def folder(self) -> str:
        """Name of the folder that a person gave it; empty if it is the whole tree."""
        names = [name for name in self.root.split("/") if name and name.lower() not in _DRIVE]
        return names[-1] if names else ""


def find_controllers(files: Mapping[str, bytes]) -> list[Controller]:
    """Return the controllers of a tree, in the order of its files.

    A tree without any folder that a controller makes is one robot to a language, if it holds programs of it.
    """
    roots: dict[tuple[str, str], list[str]] = {}
    for name in files:
        found = _root_of(name)
        if found is not None:
            roots.setdefault(found, []).append(name)
    outer = [
        Controller(LANGUAGES[language], root)
        for (language, root), names in roots.items()
        if not _inside(root, roots) and _holds(LANGUAGES[language], {name: files[name] for name in names})
    ]
    return outer or [Controller(language, "") for language in LANGUAGES.values() if _holds(language, files)]


def files_below(files: Mapping[str, bytes], root: str, roots: Iterable[str]) -> dict[str, bytes]:
    """Return the files under a root, without those of other roots below it."""
    inner = tuple(other for other in roots if other != root and other.startswith(root))
    return {name: data for name, data in files.items() if name.startswith(root) and not name.startswith(inner)}


def strays(files: Mapping[str, bytes], controllers: Sequence[Controller]) -> list[Issue]:
    """Say which programs and which halves of backups belong to none of the controllers."""
    roots = tuple(controller.root for controller in controllers)
    suffixes = tuple(suffix for language in LANGUAGES.values() for suffix in language.suffixes)
    issues = []
    loose = [name for name in files if not name.startswith(roots) and name.lower().endswith(suffixes)]
    if controllers and loose:
        shown = ", ".join(loose[:3])
        message = f"{len(loose)} program files belong to no robot that was found, e.g. {shown}: they are not read"
        issues.append(Issue("NOT_IN_A_ROBOT", message))
    for root in _empty_roots(files, roots):
        message = "SYSPAR and BACKINFO of a controller without modules under RAPID: nothing to read in this half"
        issues.append(Issue("HALF_BACKUP", message, root.rstrip("/") or None))
    return issues


def missing_parts(controller: Controller, files: Iterable[str]) -> Issue | None:
    """Say what a controller's backup lacks and what that costs; None if it is whole.

    Parameters
    ----------
    controller : Controller
        The controller.
    files : iterable of str
        Its files.
    """
    live = {name.rpartition("/")[2].lower() for name in files if "/home/" not in f"/{name.lower()}"}
    folders = {
        name[len(controller.root) :].lower().split("/")[1]
        for name in files
        if name.count("/", len(controller.root)) > 1
    }
    if sum(folder.startswith("task") for folder in folders) < 2:
        live.add("sys.cfg")  # the one task there is moves the robot
    missing = [f"no {part} ({cost})" for part, cost in _PARTS[controller.language.name] if part not in live]
    if not missing:
        return None
    message = f"half a backup: {', '.join(missing)}; the rest is read"
    return Issue("HALF_BACKUP", message, controller.root.rstrip("/") or None)


def not_live(controller: Controller, files: Iterable[str]) -> Issue | None:
    """Say which program files the controller does not run from where they lie."""
    language, names = controller.language, list(files)
    live = live_programs(language.name, language.suffixes, controller.root, names)
    copies = [name for name in names if name.lower().endswith(tuple(language.suffixes)) and name not in live]
    if not copies:
        return None
    folders = list(dict.fromkeys(name[len(controller.root) :].partition("/")[0] for name in copies))
    message = f"{len(copies)} program files in {', '.join(folders[:5])} are not live; they are copied as they are"
    return Issue("NOT_LIVE", message, copies[0])


def _root_of(name: str) -> tuple[str, str] | None:
    """Language and root of the controller that a file gives away by its path; None if it does not."""
    parts = name.split("/")
    lower = [part.lower() for part in parts]
    suffix = f".{lower[-1].rpartition('.')[2]}"
    if suffix in LANGUAGES["rapid"].suffixes:
        index = _rapid_index(lower, suffix)
        return None if index is None else ("rapid", _folder(parts, index))
    if suffix in LANGUAGES["krl"].suffixes:
        index = _krl_index(lower)
        return None if index is None else ("krl", _folder(parts, index))
    return None


def _rapid_index(lower: Sequence[str], suffix: str) -> int | None:
    """Position of the root's own folder: of ``RAPID`` above tasks or modules, else of ``TASK1`` above modules."""
    for index, part in enumerate(lower[:-1]):
        child = lower[index + 1]
        if part == "rapid" and (_TASK.fullmatch(child) or child in _MODULES or index + 2 == len(lower)):
            before = index > 0 and re.fullmatch(r"task\d+", lower[index - 1])
            return index - 1 if before else index
        if re.fullmatch(r"task\d+", part) and (child in _MODULES or (index + 2 == len(lower) and suffix != ".prg")):
            return index
    return None


def _krl_index(lower: Sequence[str]) -> int | None:
    """Position of the root's own folder: of ``KRC``, else ``R1``, else ``System`` or ``Mada``."""
    found = [index for index, part in enumerate(lower[:-1]) if part == "krc"]
    whole = [index for index in found if _R.fullmatch(lower[index + 1])]
    if found:
        return (whole or found)[0]
    for index, part in enumerate(lower[:-1]):
        if (part == "r1" and lower[index + 1] in _R1) or (part == "steu" and lower[-1] in _MARKS):
            return index
    return len(lower) - 2 if len(lower) > 1 and _MARKS.get(lower[-1]) == lower[-2] else None


def _folder(parts: Sequence[str], index: int) -> str:
    return "".join(f"{part}/" for part in parts[:index])


def _inside(root: str, roots: Iterable[tuple[str, str]]) -> bool:
    """Whether a root lies in a folder that another controller made: a copy in HOME is no robot."""
    for language, other in roots:
        if root != other and root.startswith(other):
            below = root[len(other) :].lower().split("/")
            if below[0] in _OWN[language]:
                return True
    return False


def _empty_roots(files: Iterable[str], roots: Sequence[str]) -> list[str]:
    """Roots of ABB backups that have everything but modules."""
    found: dict[str, set[str]] = {}
    for name in files:
        folder, _, last = name.lower().rpartition("/")
        kind = folder.rpartition("/")[2]
        if (kind, last) in (("backinfo", "backinfo.txt"), ("syspar", "moc.cfg"), ("syspar", "sys.cfg")):
            root = name[: len(folder) - len(kind)]
            found.setdefault(root, set()).add(kind)
    return [root for root, kinds in found.items() if root not in roots and len(kinds) == 2]


def _holds(language: Language, files: Mapping[str, bytes]) -> bool:
    """Whether a tree holds a program of a language."""
    programs = (data for name, data in files.items() if name.lower().endswith(tuple(language.suffixes)))
    return any(language.recognise(data) in (language.name, "binary") for data in programs)
