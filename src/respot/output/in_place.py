"""A conversion in place: the backup's own folder becomes the converted one, in one step, and keeps the originals.

A whole new folder is made beside it, of links to the files that do not change; then both change places. So there is no
moment at which half of the programs are old and half are new, whatever is pulled or killed.
"""

from __future__ import annotations

import shutil
import zipfile
from collections.abc import Mapping
from pathlib import Path

from respot.archives import is_own
from respot.correction.conversion import RECORD
from respot.correction.correction import Correction
from respot.correction.proof import VerifyError, prove
from respot.issues import BadInputError
from respot.output import kept
from respot.output.disk import flush, link, look_alike, mirror, own, read_all, write
from respot.output.folders import refuse_fixed, sha256
from respot.output.kept import Kept
from respot.output.new_folder import record_bytes
from respot.output.workplace import restore, workplace


def check_in_place(source: Path) -> None:
    """Refuse a source that cannot be changed in place; a folder that a killed run took away comes back.

    Raises
    ------
    BadInputError
        ``BAD_OPTION`` for a zip or a single program; ``CANNOT_WRITE`` for a folder that cannot be replaced.
    """
    restore(source.absolute())
    if source.is_file():
        what = "a zip stays as the controller gave it" if zipfile.is_zipfile(source) else "a program lies in a backup"
        message = (
            f"is no folder: {what}. --in-place changes the folder of a backup; else write a new one with -o OUTDIR"
        )
        raise BadInputError("BAD_OPTION", message, str(source))
    if source.is_dir():
        refuse_fixed(source, "write a new folder with -o OUTDIR")


def write_in_place(
    folder: Path,
    backup: Mapping[str, bytes],
    files: Mapping[str, bytes],
    correction: Correction,
    record: Mapping[str, object],
) -> None:
    """Change a backup itself, all or nothing, and keep the originals in it.

    Parameters
    ----------
    folder : Path
        The backup.
    backup : mapping of str to bytes
        All its files as they were read.
    files : mapping of str to bytes
        Those of them that belong to the robot.
    correction : Correction
        The changed files.
    record : mapping
        What becomes ``respot.json``; it gets the number of the conversion in addition, ``in_place``.

    Raises
    ------
    BadInputError
        ``SOURCE_CHANGED`` if a file is no longer what was read; ``CANNOT_WRITE``; ``IN_USE``.
    VerifyError
        What was written is not what was intended; the backup is as it was.
    """
    folder = folder.resolve()
    with workplace(folder) as place:
        number = max(kept.numbers(folder), default=0) + 1
        changed = {**correction.files, RECORD: record_bytes({**record, "in_place": number})}
        before = {path: None if (data := backup.get(path)) is None else sha256(data) for path in changed}
        replaced = Kept(
            number, correction.calibration_hash, {path: (before[path], sha256(data)) for path, data in changed.items()}
        )
        mirror(folder, place.new)
        for path, data in changed.items():
            if before[path] is not None:
                _keep(folder / path, place.new / replaced.original(path))
            _replace(folder / path, place.new / path, data)
        write(place.new / replaced.list_path, replaced.to_bytes())
        look_alike(folder, place.new)
        flush(place.new)
        _check(folder, place.new, backup, files, correction, changed, replaced)
        place.put()


def _keep(file: Path, place: Path) -> None:
    place.parent.mkdir(parents=True, exist_ok=True)
    link(file, place)


def _replace(old: Path, new: Path, data: bytes) -> None:
    """Put new bytes under a name that is still a link to the old file: the link goes first."""
    new.unlink(missing_ok=True)
    write(new, data)
    if old.exists():
        shutil.copymode(old, new)
        own(old, new)


def _check(
    folder: Path,
    staged: Path,
    backup: Mapping[str, bytes],
    files: Mapping[str, bytes],
    correction: Correction,
    changed: Mapping[str, bytes],
    replaced: Kept,
) -> None:
    """Read all that was made from the disk and compare it with what was read before and what is intended."""
    written = read_all(staged)
    programs = {path: data for path, data in written.items() if not is_own(path)}
    for path in sorted({*backup, *programs} - set(changed)):
        if programs.get(path) != backup.get(path):
            raise _changed(folder / path)
    for path, (before, after) in replaced.files.items():
        if before is not None and sha256(written.get(replaced.original(path), b"")) != before:
            raise _changed(folder / path)
        if path == RECORD and sha256(written[path]) != after:
            raise VerifyError(f"{path}: is not as it was written")
    prove(correction, files, {path: programs[path] if path != RECORD else files[path] for path in files})


def _changed(path: Path) -> BadInputError:
    message = "was changed while respot was reading the backup; run it again. Nothing was changed"
    return BadInputError("SOURCE_CHANGED", message, str(path))
