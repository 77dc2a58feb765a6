"""Files that are no programs: parameters of a controller, lists, logs, and what has no lines at all."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from pathlib import PurePosixPath

from respot.difference.alignment import align, gaps
from respot.difference.findings import CodeChange, Noise, Place
from respot.source import NEWLINE, SourceText

_PARAMETERS = (".cfg",)
#: What a controller writes anew at every backup, by the name of the file.
_STAMPS = {
    "am.ini": re.compile(r"^\s*(?:Date|ID|DiskNo|LastDisk|Name)\s*=.*", re.IGNORECASE),
    "version.xml": re.compile(r"<(Date|Time|CreationDate)\b[^<>]*>[^<>]*</\1\s*>", re.IGNORECASE),
    "backinfo.txt": re.compile(r"^\s*>>\s*(?:DATE|TIME).*", re.IGNORECASE),
}
_RECORD = "respot.json"
_SECTION = re.compile(r"([A-Z][A-Z0-9_]*):\s*$")
_QUOTED = re.compile(r'("[^"]*")')
_BLANKS = re.compile(r"\s+")
_NAME = re.compile(r'-name\s+"?([^"\s]+)"?', re.IGNORECASE)


def kind_of(path: str, *contents: bytes) -> str:
    """Return what a file is that is no program: ``parameters``, ``text`` or ``binary``."""
    if any(b"\0" in data[:100_000] for data in contents):
        return "binary"
    if any(data[:1] and data[0] >= 0xFC for data in contents):
        return "binary"  # an encoded module (facts: rapid.md 4.2)
    return "parameters" if PurePosixPath(path.lower()).suffix in _PARAMETERS else "text"


def is_own_record(path: str, data: bytes) -> bool:
    """Whether a file is the record that ``convert`` leaves beside what it wrote."""
    if PurePosixPath(path).name != _RECORD:
        return False
    try:
        schema = json.loads(data).get("schema", "")
    except (ValueError, AttributeError):
        return False
    return str(schema).startswith("respot.")


class TextComparison:
    """Two states of a text file, line by line.

    Parameters
    ----------
    path, old_path : str
        File on both sides.
    old, new : bytes
        Both states.

    Attributes
    ----------
    changes : list of CodeChange
        What differs.
    noise : list of Noise
        What does not matter: stamps, line ends, blanks, instances in another order.
    """

    def __init__(self, old_path: str, path: str, old: bytes, new: bytes) -> None:
        self._paths = (old_path, path)
        sources = [SourceText(name, data) for name, data in ((old_path, old), (path, new))]
        self.changes: list[CodeChange] = []
        self.noise: list[Noise] = []
        parameters = kind_of(path, old, new) == "parameters"
        rows = [(_instances if parameters else _lines)(source.text) for source in sources]
        self._kind = "parameters" if parameters else "text"
        stamp = _STAMPS.get(PurePosixPath(path).name.lower())
        if parameters:
            self._unordered(*rows)
        else:
            self._ordered(rows[0], rows[1], stamp)
        if not self.changes and not self.noise:
            self.noise += _layout(*sources)

    def _ordered(self, old: list[_Row], new: list[_Row], stamp: re.Pattern[str] | None) -> None:
        pairs = align([row[1] for row in old], [row[1] for row in new])
        for i0, i1, j0, j1 in gaps(pairs, len(old), len(new)):
            removed, added = old[i0:i1], new[j0:j1]
            if stamp is not None and _without(stamp, removed) == _without(stamp, added):
                line = added[0][0] if added else removed[0][0]
                texts = [" ".join(row[1] for row in rows) for rows in (removed, added)]
                self.noise.append(Noise("stamps", self._paths[1], line, texts[0], texts[1]))
            else:
                self._add(removed, added, "")

    def _unordered(self, old: list[_Row], new: list[_Row]) -> None:
        """Compare instances by section and name: a controller writes them in any order."""
        before = {_unique(row, index): row for index, row in _counted(old)}
        after = {_unique(row, index): row for index, row in _counted(new)}
        for name, row in after.items():
            partner = before.get(name)
            if partner is None:
                self._add([], [row], row[2])
            elif partner[1] != row[1]:
                self._add([partner], [row], row[2])
        for name, row in before.items():
            if name not in after:
                self._add([row], [], row[2])
        common = [[name for name in side if name in before and name in after] for side in (before, after)]
        if common[0] != common[1]:
            self.noise.append(Noise("order", self._paths[1]))

    def _add(self, removed: Sequence[_Row], added: Sequence[_Row], section: str) -> None:
        self.changes.append(
            CodeChange(
                path=self._paths[1],
                old_path=self._paths[0],
                kind=self._kind,
                routine=section,
                old_lines=[row[1] for row in removed],
                new_lines=[row[1] for row in added],
                old=Place(self._paths[0], removed[0][0]) if removed else None,
                new=Place(self._paths[1], added[0][0]) if added else None,
                aspects=(self._kind,),
            )
        )


def _without(stamp: re.Pattern[str], rows: Sequence[_Row]) -> list[str]:
    """Return what lines say beside stamps."""
    return [text for row in rows if (text := stamp.sub("", row[1]).strip())]


#: Line, text, section and name of a line or of an instance.
_Row = tuple[int, str, str, str]


def _lines(text: str) -> list[_Row]:
    return [(number, _bare(line), "", "") for number, line in enumerate(NEWLINE.split(text), 1) if line.strip()]


def _bare(line: str) -> str:
    """Return a line with single blanks outside of quotes."""
    parts = _QUOTED.split(line.strip())
    return "".join(part if index % 2 else _BLANKS.sub(" ", part) for index, part in enumerate(parts))


def _instances(text: str) -> list[_Row]:
    r"""Return the instances of a parameter file; one may go on over lines that end with ``\``."""
    found: list[_Row] = []
    section, begun, start = "", "", 0
    for number, line in enumerate(NEWLINE.split(text), 1):
        bare = line.strip()
        if not bare or bare == "#":
            continue
        start = start or number
        begun = f"{begun} {bare.removesuffix(chr(92)).strip()}".strip()
        if bare.endswith("\\"):
            continue
        head = _SECTION.fullmatch(begun)
        if head is not None:
            section = head[1]
        named = _NAME.search(begun)
        said = _bare(begun)
        found.append((start, said, section, named[1] if named else said))
        begun, start = "", 0
    if begun:
        found.append((start, begun, section, ""))
    return found


def _counted(rows: Sequence[_Row]) -> Iterator[tuple[int, _Row]]:
    """Yield rows with the number of those before that have the same section and name."""
    seen: dict[tuple[str, str], int] = {}
    for row in rows:
        count = seen.get(row[2:], 0)
        seen[row[2:]] = count + 1
        yield count, row


def _unique(row: _Row, count: int) -> tuple[str, str, int]:
    return row[2], row[3], count


def _layout(old: SourceText, new: SourceText) -> Iterator[Noise]:
    if old.newline != new.newline:
        yield Noise("line_ends", new.path)
    else:
        yield Noise("blanks", new.path)
