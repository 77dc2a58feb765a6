"""What a robot's result depends on: the files it is made of, as one hash; and their bytes, to send them elsewhere."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path, PurePath

from respot.issues import BadInputError
from respot.line.settings import Plain

_COMPANIONS = {".src": ".dat", ".dat": ".src"}
#: A table may name its sheet behind this sign.
_SHEET = "#"


def input_hash(folder: Path, paths: Sequence[str]) -> str:
    """SHA-256 (hex) over all inputs of a robot, by their names and bytes.

    Parameters
    ----------
    folder : Path
        What relative paths start from.
    paths : sequence of str
        Files, folders, names of files with a sheet; what is not there counts as missing.
    """
    digest = hashlib.sha256()
    for path in paths:
        files = list(_files(folder, path))
        digest.update(f"{path}\0{len(files)}\0".encode("utf-8", "surrogateescape"))
        for name, file in files:
            digest.update(f"{name}\0".encode("utf-8", "surrogateescape"))
            digest.update(_digest(file))
    return digest.hexdigest()


def option_hash(options: Mapping[str, Plain | None]) -> str:
    """SHA-256 (hex) of options."""
    return hashlib.sha256(json.dumps(options, sort_keys=True).encode()).hexdigest()


def read_inputs(folder: Path, paths: Sequence[str]) -> dict[str, bytes]:
    """Bytes of all inputs by their path below a folder.

    Raises
    ------
    BadInputError
        ``BAD_OPTION`` for a path that leaves the folder; ``CANNOT_READ``.
    """
    found: dict[str, bytes] = {}
    for path in paths:
        if PurePath(path).is_absolute() or ".." in PurePath(path).parts:
            message = "lies outside the folder of the line file: what is sent to workers must lie in it"
            raise BadInputError("BAD_OPTION", message, path)
        for _, file in _files(folder, path):
            try:
                found[file.relative_to(folder).as_posix()] = file.read_bytes()
            except OSError as error:
                raise BadInputError("CANNOT_READ", error.strerror or str(error), str(file)) from error
    return found


def _files(folder: Path, path: str) -> Iterator[tuple[str, Path]]:
    """Files that a path stands for, in a fixed order, each with a name."""
    whole = folder / path
    if not whole.exists() and _SHEET in path:
        whole = folder / path.rpartition(_SHEET)[0]
    if whole.is_dir():
        for place, folders, names in os.walk(whole):
            folders.sort()
            for name in sorted(names):
                file = Path(place, name)
                yield file.relative_to(whole).as_posix(), file
    elif whole.exists():
        yield "", whole
        companion = _COMPANIONS.get(whole.suffix.lower())
        if companion is not None:
            for file in sorted(whole.parent.glob(f"{whole.stem}.*")):
                if file.suffix.lower() == companion:
                    yield companion, file


def _digest(file: Path) -> bytes:
    """Hash of a file; of one that cannot be read, a word for that."""
    try:
        with file.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").digest()
    except OSError:
        return b"cannot be read"
