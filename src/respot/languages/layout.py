"""Which program files of a controller are live, by where they lie.

A controller runs its modules from one place only: KUKA from ``KRC`` (or a bare ``R1``), ABB from ``RAPID`` (or bare
task folders). ``HOME`` of an ABB controller and the drives in a KUKA archive hold copies that may be years old.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

#: What a path below the root begins with if it is live; the first that any program matches counts.
_LIVE = {
    "krl": (
        (re.compile(r"krc/r\d/"), re.compile(r"krc/")),
        (re.compile(r"[a-z]/krc/"), re.compile(r"[a-z]/krc/")),
        (re.compile(r"r1/"), re.compile(r"(r1|steu)/")),
    ),
    "rapid": (
        (re.compile(r"rapid/"), re.compile(r"rapid/")),
        (re.compile(r"task\d+/"), re.compile(r"task\d+/")),
    ),
}
_NEVER = {"krl": (), "rapid": ("home/",)}


def live_programs(language: str, suffixes: Sequence[str], root: str, files: Iterable[str]) -> set[str]:
    """Return the live program files of a controller.

    Parameters
    ----------
    language : str
        ``"krl"`` or ``"rapid"``.
    suffixes : sequence of str
        Suffixes of its program files.
    root : str
        Folder of the controller inside the backup.
    files : iterable of str
        All its files.
    """
    below = {name: name[len(root) :].lower() for name in files if name.lower().endswith(tuple(suffixes))}
    for mark, live in _LIVE[language]:
        if any(mark.match(path) for path in below.values()):
            return {name for name, path in below.items() if live.match(path)}
    return {name for name, path in below.items() if not path.startswith(_NEVER[language])}
