"""What a conversion in place keeps: the originals of the files that it changed, and a list of them.

``.respot/0001/kept.json`` lists the files by their hashes before and after; ``.respot/0001/originals`` holds them under
their own paths with ``.original`` behind, so that nobody, robot or person, takes them for programs.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from respot.issues import BadInputError
from respot.output.folders import sha256

#: Folder in the backup.
FOLDER = ".respot"
_LIST = "kept.json"
_SCHEMA = "respot.kept/1"


@dataclass(frozen=True)
class Kept:
    """What one conversion in place replaced.

    Parameters
    ----------
    number : int
        Which conversion of the folder it was, counted from 1.
    calibration : str
        Hash of the calibration that was applied.
    files : mapping of str to tuple
        Hashes of each file before and after; before is None where there was none.
    """

    number: int
    calibration: str
    files: Mapping[str, tuple[str | None, str]]

    @property
    def folder(self) -> str:
        """Its folder in the backup."""
        return f"{FOLDER}/{self.number:04d}"

    def original(self, path: str) -> str:
        """Where the original of a file lies in the backup."""
        return f"{self.folder}/originals/{path}.original"

    def to_bytes(self) -> bytes:
        """Return the list as a file."""
        files = {path: {"before": before, "after": after} for path, (before, after) in self.files.items()}
        record = {"schema": _SCHEMA, "calibration": self.calibration, "files": files}
        return (json.dumps(record, indent=2, ensure_ascii=False) + "\n").encode("utf-8", "surrogateescape")

    @property
    def list_path(self) -> str:
        """Where the list lies in the backup."""
        return f"{self.folder}/{_LIST}"


def numbers(folder: Path) -> list[int]:
    """Return the numbers of the conversions in place that a folder remembers, in order."""
    kept = folder / FOLDER
    if not kept.is_dir():
        return []
    return sorted(int(path.name) for path in kept.iterdir() if path.is_dir() and path.name.isdecimal())


def load(folder: Path, number: int) -> Kept:
    """Read what a conversion in place kept, and check that all of it is there.

    Raises
    ------
    BadInputError
        ``ORIGINALS_LOST``: the list or an original is missing, damaged or no plain file.
    """
    empty = Kept(number, "", {})
    place = folder / empty.list_path
    try:
        record = json.loads(place.read_bytes().decode("utf-8", "surrogateescape"))
        files = {str(path): (each["before"], str(each["after"])) for path, each in record["files"].items()}
        calibration = str(record["calibration"])
        if record["schema"] != _SCHEMA or not all(_stays_inside(path) for path in files):
            raise ValueError
    except (OSError, ValueError, LookupError, TypeError, AttributeError) as error:
        raise _lost("cannot be read: the originals are not known", place) from error
    kept = Kept(number, calibration, files)
    for path, (before, _) in files.items():
        original = folder / kept.original(path)
        if before is not None and (not _is_plain(original, folder) or sha256(original.read_bytes()) != before):
            raise _lost(f"is missing or was changed: {path} cannot be restored", original)
    return kept


def _lost(message: str, path: Path) -> BadInputError:
    return BadInputError("ORIGINALS_LOST", f"{message}. Nothing was changed", str(path))


def _stays_inside(path: str) -> bool:
    parts = PurePosixPath(path).parts
    return bool(parts) and not path.startswith("/") and ".." not in parts and "\\" not in path and ":" not in parts[0]


def _is_plain(path: Path, folder: Path) -> bool:
    """Whether a path is a file that lies where it says, without links on the way."""
    return path.is_file() and path.resolve() == folder.resolve() / path.relative_to(folder)
