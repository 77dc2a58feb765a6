"""Files that a command writes beside its answer: a report, a calibration."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from respot.issues import BadInputError


def check_free(path: Path | None, option: str, inputs: Sequence[Path], force: bool) -> None:
    """Refuse to write over a file, or into what is read.

    Raises
    ------
    BadInputError
        ``OUTPUT_EXISTS``.
    """
    if path is None:
        return
    if path.exists() and not force:
        message = f"exists; name another file with {option}, or replace it with --force"
        raise BadInputError("OUTPUT_EXISTS", message, str(path))
    if any(holds(read, path) for read in inputs):
        message = f"lies in what is read; name another file with {option}"
        raise BadInputError("OUTPUT_EXISTS", message, str(path))


def write_text(path: Path, text: str) -> None:
    """Write a text file whole, or not at all.

    Raises
    ------
    BadInputError
        ``CANNOT_WRITE``.
    """
    from respot.output.disk import replacing

    with replacing(path) as part:
        part.write_text(text, encoding="utf-8", newline="\n")


def holds(source: Path, output: Path) -> bool:
    """Whether writing ``output`` would change ``source``: the file itself, its data list, or a file in its folder."""
    own, other = source.resolve(), output.resolve()
    one_program = {own.suffix.lower(), other.suffix.lower()} <= {".src", ".dat"}
    return own == other or own in other.parents or (one_program and own.with_suffix("") == other.with_suffix(""))
