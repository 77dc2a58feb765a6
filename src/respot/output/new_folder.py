"""A whole backup with corrected files goes into a new folder: staged, read back, proved, put there in one step."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

from respot.correction.conversion import RECORD
from respot.correction.correction import Correction
from respot.correction.proof import VerifyError, prove
from respot.issues import BadInputError
from respot.languages.overlay import overridden
from respot.output.disk import flush, read, write
from respot.output.folders import check_output
from respot.output.workplace import workplace


def rehearse(files: Mapping[str, bytes], correction: Correction, templates: Path | None = None) -> None:
    """Prove a correction without writing it.

    Parameters
    ----------
    files : mapping of str to bytes
        The backup as it was.
    correction : Correction
        Its changed files.
    templates : Path, optional
        A plant's own templates that wrote the changes.

    Raises
    ------
    BadInputError
        ``BAD_TEMPLATE``: what a plant's templates wrote is not what is intended.
    VerifyError
        The same without templates of a plant: a fault of ours.
    """
    try:
        prove(correction, files, {**files, **correction.files})
    except VerifyError as error:
        own = overridden(templates, correction.language.name) if templates is not None else []
        if not own:
            raise
        names = ", ".join(str(path) for path in own)
        message = f"written with {names} it would not be what is intended: {error}. Nothing was written"
        raise BadInputError("BAD_TEMPLATE", message, error.path, error.line) from error


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
        ``OUTPUT_EXISTS``, ``CANNOT_WRITE``, or ``IN_USE`` while another run writes there.
    VerifyError
        What was written is not what was intended; nothing is left behind.
    """
    with workplace(folder.absolute()) as place:
        check_output(folder, force)  # now that no other run writes there, and what a killed one took away is back
        said = record_bytes(record)
        for path, data in {**files, **correction.files, RECORD: said}.items():
            write(place.new / path, data)
        flush(place.new)
        prove(correction, files, {path: read(place.new / path) if path != RECORD else files[path] for path in files})
        if read(place.new / RECORD) != said:
            raise VerifyError(f"{RECORD}: is not as it was written")
        place.put()


def record_bytes(record: Mapping[str, object]) -> bytes:
    """Return the file of a record; bytes of a file name that are no UTF-8 become escapes, as JSON spells them."""
    text = json.dumps(record, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    return text.encode("utf-8", "backslashreplace")
