"""Which folders respot writes, and which it leaves alone: the source, what a person made, what cannot be replaced."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from respot.archives import is_own
from respot.correction.conversion import RECORD
from respot.issues import BadInputError
from respot.output.disk import cannot_write


def check_output(folder: Path, force: bool, inputs: Sequence[Path] = ()) -> None:
    """Refuse an output folder that would lose something: the source, or what is in it.

    Raises
    ------
    BadInputError
        ``OUTPUT_EXISTS`` if it is a file, holds an input or lies in one, or holds anything: ``force`` replaces only
        what respot wrote itself. ``CANNOT_WRITE`` if it can be seen that nothing can be put there.
    """
    for source in inputs:
        if _within(source, folder):
            raise BadInputError("OUTPUT_EXISTS", f"holds {source} or lies in it; name another folder", str(folder))
    try:
        if folder.is_symlink() or (folder.exists() and not folder.is_dir()):
            raise BadInputError("OUTPUT_EXISTS", "is not a folder; name another one with -o", str(folder))
        above = next(each for each in folder.absolute().parents if each.exists())
        if not above.is_dir():
            raise BadInputError("CANNOT_WRITE", f"{above} is a file; name another folder with -o", str(folder))
        if not folder.is_dir():
            return
        refuse_fixed(folder, "name a new folder in it with -o")
        if not any(folder.iterdir()):
            return
    except OSError as error:
        raise cannot_write(error, folder) from error
    if not force:
        message = "exists and is not empty; name another one with -o, or replace it with --force"
        raise BadInputError("OUTPUT_EXISTS", message, str(folder))
    strange = not_ours(folder)
    if strange:
        message = f"{strange}: --force replaces only what respot wrote; name another folder with -o"
        raise BadInputError("OUTPUT_EXISTS", message, str(folder))


def refuse_fixed(folder: Path, advice: str) -> None:
    """Refuse a folder that cannot be replaced by another one under the feet of those who use it.

    Raises
    ------
    BadInputError
        ``CANNOT_WRITE``: it is where a disk is mounted, or this process works in it.
    """
    own = folder.resolve()
    if os.path.ismount(own):  # before Python 3.12 that of a path knows no Windows
        message = f"is where a disk is mounted, and cannot be replaced as a whole: {advice}"
        raise BadInputError("CANNOT_WRITE", message, str(folder))
    here = Path.cwd()
    if own == here or own in here.parents:
        message = "is where you are, and is replaced as a whole: leave it (cd ..), and name it from outside"
        raise BadInputError("CANNOT_WRITE", message, str(folder))


def read_record(folder: Path) -> Mapping[str, Any] | None:
    """Read the record of a conversion in a folder; None if there is none that can be read."""
    try:
        record = json.loads((folder / RECORD).read_bytes())
    except (OSError, ValueError):
        return None
    return record if isinstance(record, dict) else None


def not_ours(folder: Path) -> str:
    """Say what a folder holds that its record does not know, or knows otherwise; empty if there is nothing."""
    record = read_record(folder)
    if record is None:
        return f"holds no {RECORD}"
    contents = record.get("contents")
    files = {path.relative_to(folder).as_posix(): path for path in sorted(folder.rglob("*")) if not path.is_dir()}
    if any(is_own(name) for name in files):
        return "holds originals of a conversion in place"
    for name, path in files.items():
        if name == RECORD:
            continue
        if not isinstance(contents, dict) or contents.get(name) != sha256(path.read_bytes()):
            return f"holds {name}, which respot did not write, or not so"
    return ""


def sha256(data: bytes) -> str:
    """Hash of a file's bytes."""
    return hashlib.sha256(data).hexdigest()


def _within(source: Path, folder: Path) -> bool:
    own, other = source.resolve(), folder.resolve()
    return own == other or own in other.parents or other in own.parents
