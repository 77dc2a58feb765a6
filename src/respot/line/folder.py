"""The output folder of a line: one folder a robot, moved into place in one step; files over the line beside them.

Nothing is written in place: a robot's folder is made under ``.work`` and renamed. Whoever is killed at any moment
leaves either the old folder, none, or the new one, and the ledger says of which it knows.
"""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Mapping
from pathlib import Path
from uuid import uuid4

from respot.issues import BadInputError

ROBOTS, WORK = "robots", ".work"


class OutputFolder:
    """An output folder.

    Parameters
    ----------
    path : Path
        The folder; it is made if it does not exist.
    """

    def __init__(self, path: Path) -> None:
        self.path = path.absolute()
        self._own = self.path / WORK / uuid4().hex

    def staging(self, name: str) -> Path:
        """Begin of the path of a robot's new folder while it is made; unlike that of any other run."""
        return self._own / name

    def robot(self, name: str) -> Path:
        """Folder of a robot."""
        return self.path / ROBOTS / name

    def prepare(self) -> None:
        """Clear what an earlier run left half-done away, and make room for this one.

        Raises
        ------
        BadInputError
            ``CANNOT_WRITE``: nothing can be written there.
        """
        try:
            shutil.rmtree(self.path / WORK, ignore_errors=True)
            self._own.mkdir(parents=True)
        except OSError as error:
            raise BadInputError("CANNOT_WRITE", f"cannot be written: {error.strerror}", str(self.path)) from error

    def unpack(self, name: str, files: Mapping[str, bytes]) -> str:
        """Write a robot's new folder that came as bytes; return the name that it has until it is in place."""
        for path, data in files.items():
            place = self.staging(name) / path
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_bytes(data)
        return name

    def put(self, name: str, made: str) -> None:
        """Move a robot's new folder into place, by the name that it was made under; the old one goes."""
        self.remove(name)
        place = self.robot(name)
        place.parent.mkdir(exist_ok=True)
        self.staging(made).rename(place)

    def remove(self, name: str) -> None:
        """Take a robot's folder away."""
        place = self.robot(name)
        if place.is_dir():
            gone = self._own / f"{uuid4().hex}"
            place.rename(gone)
            shutil.rmtree(gone, ignore_errors=True)

    def holds(self, name: str, outputs: Mapping[str, tuple[str, int]]) -> bool:
        """Whether a robot's folder holds exactly what was written."""
        place = self.robot(name)
        there = {path.relative_to(place).as_posix() for path in place.rglob("*") if path.is_file()}
        if there != set(outputs):
            return False
        return all(_same(place / path, *outputs[path]) for path in there)

    def write(self, name: str, text: str) -> None:
        """Write a file over the line, in one step.

        Raises
        ------
        BadInputError
            ``CANNOT_WRITE``.
        """
        place = self._own / name
        try:
            place.write_text(text, encoding="utf-8", newline="\n")
            place.replace(self.path / name)
        except OSError as error:
            message = f"cannot be written: {error.strerror}; what is done is kept: run again"
            raise BadInputError("CANNOT_WRITE", message, str(self.path / name)) from error

    def clear(self) -> None:
        """Take the place for half-done work away."""
        shutil.rmtree(self.path / WORK, ignore_errors=True)


def _same(path: Path, sha256: str, size: int) -> bool:
    try:
        if path.stat().st_size != size:
            return False
        with path.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest() == sha256
    except OSError:
        return False
