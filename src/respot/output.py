"""Staging, read back and prove, move into place.

Everything is written into a hidden folder beside the output folder, read again from there, compared with what was
intended, and renamed in one step. An interrupt or an error leaves no half-written folder.
"""

from __future__ import annotations

import hashlib
import json
import shutil
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from respot.correction.conversion import RECORD
from respot.correction.correction import Correction
from respot.correction.proof import prove
from respot.issues import BadInputError


def check_output(folder: Path, force: bool, inputs: Sequence[Path] = ()) -> None:
    """Refuse an output folder that would lose something: the source, or what is in it.

    Raises
    ------
    BadInputError
        ``OUTPUT_EXISTS`` if it is a file, holds an input or lies in one, or holds anything: ``force`` replaces only
        what respot wrote itself.
    """
    for source in inputs:
        if _within(source, folder):
            raise BadInputError("OUTPUT_EXISTS", f"holds {source} or lies in it; name another folder", str(folder))
    if folder.is_symlink() or (folder.exists() and not folder.is_dir()):
        raise BadInputError("OUTPUT_EXISTS", "is not a folder; name another one with -o", str(folder))
    if folder.is_dir() and any(folder.iterdir()) and not force:
        message = "exists and is not empty; name another one with -o, or replace it with --force"
        raise BadInputError("OUTPUT_EXISTS", message, str(folder))
    if folder.is_dir() and any(folder.iterdir()):
        strange = _not_ours(folder)
        if strange:
            message = f"{strange}: --force replaces only what respot wrote; name another folder with -o"
            raise BadInputError("OUTPUT_EXISTS", message, str(folder))


def _not_ours(folder: Path) -> str:
    """Say what a folder holds that its record does not know, or knows otherwise; empty if there is nothing."""
    try:
        contents = json.loads((folder / RECORD).read_bytes()).get("contents", {})
    except (OSError, ValueError, AttributeError):
        return f"holds no {RECORD}"
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder).as_posix()
        if path.is_dir() or name == RECORD:
            continue
        if not isinstance(contents, dict) or contents.get(name) != hashlib.sha256(path.read_bytes()).hexdigest():
            return f"holds {name}, which respot did not write, or not so"
    return ""


def _within(source: Path, folder: Path) -> bool:
    own, other = source.resolve(), folder.resolve()
    return own == other or own in other.parents or other in own.parents


def rehearse(files: Mapping[str, bytes], correction: Correction) -> None:
    """Prove a correction without writing it.

    Raises
    ------
    VerifyError
        What would be written is not what is intended.
    """
    prove(correction, files, {**files, **correction.files})


def write_backup(
    folder: Path, files: Mapping[str, bytes], correction: Correction, record: Mapping[str, object], force: bool = False
) -> None:
    """Write a whole backup with the corrected files in it, all or nothing.

    Parameters
    ----------
    folder : Path
        Output folder.
    files : mapping of str to bytes
        The backup as it was.
    correction : Correction
        Its changed files.
    record : mapping
        What becomes ``respot.json``.
    force : bool
        Replace a folder that exists.

    Raises
    ------
    BadInputError
        ``OUTPUT_EXISTS`` or ``CANNOT_READ`` (the folder cannot be written).
    VerifyError
        What was written is not what was intended; nothing is left behind.
    """
    check_output(folder, force)
    folder = folder.absolute()
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        staging = Path(tempfile.mkdtemp(prefix=f".{folder.name}.", dir=folder.parent))
    except OSError as error:
        raise BadInputError("CANNOT_READ", f"cannot be written: {error.strerror}", str(folder)) from error
    try:
        staging.chmod(0o755)
        for path, data in {**files, **correction.files}.items():
            place = staging / path
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_bytes(data)
        written = {path: (staging / path).read_bytes() for path in files}
        prove(correction, files, written)
        text = json.dumps(record, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
        # bytes of a file name that are no UTF-8 become escapes, as JSON spells them
        (staging / RECORD).write_bytes(text.encode("utf-8", "backslashreplace"))
        _move(staging, folder)
    except OSError as error:
        raise BadInputError("CANNOT_READ", f"cannot be written: {error.strerror}", str(folder)) from error
    finally:
        shutil.rmtree(staging, ignore_errors=True)


def _move(staging: Path, folder: Path) -> None:
    """Rename staging to the output folder; an old one goes away only when the new one is in place."""
    if not folder.exists():
        staging.replace(folder)
        return
    old = Path(tempfile.mkdtemp(prefix=f".{folder.name}.old.", dir=folder.parent))
    try:
        folder.replace(old)
        staging.replace(folder)
    except BaseException:
        if not folder.exists() and any(old.iterdir()):
            old.replace(folder)
        else:
            old.rmdir()
        raise
    shutil.rmtree(old, ignore_errors=True)
