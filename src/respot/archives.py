"""Reads the bytes of a folder, a zip or one program file safely.

Every file is kept as bytes under its path inside the backup, with ``/``; nothing is written, nothing inside another
archive is opened. What could be written outside its folder, or over another file, on any system is refused.
"""

from __future__ import annotations

import lzma
import os
import re
import struct
import unicodedata
import zipfile
import zlib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

from respot.issues import BadInputError, Issue

#: What unpacks to more is refused; the largest controller backups stay below 1 GB.
LARGEST_BACKUP = 4 * 1024**3
#: More entries than any controller has files.
MOST_ENTRIES = 200_000
#: Programs shrink to a tenth, logs to a fiftieth; Deflate cannot shrink further than to a thousandth.
LARGEST_RATIO = 200
#: Below this size no ratio is suspicious: an empty disk image of a tool is no attack.
_SMALL = 64 * 1024**2
_COMPANIONS = {".src": (".dat",), ".dat": (".src",)}
_ARCHIVES = (".zip", ".7z", ".rar", ".tar", ".tgz", ".gz", ".bz2", ".xz", ".cab")
_FOREIGN = (
    OSError, zipfile.BadZipFile, zipfile.LargeZipFile, RuntimeError, NotImplementedError, zlib.error, lzma.LZMAError,
    EOFError, ValueError, OverflowError, struct.error, IndexError, MemoryError,
)  # fmt: skip
#: Folders of ``respot.output``: originals that undo needs, and what is being written. They are no part of a backup.
_OWN_FOLDER = re.compile(r"\.(.+\.)?respot")
_LOCAL_HEADER = struct.Struct("<4s22xHH")
_UNICODE_PATH = 0x7075


@dataclass(frozen=True, eq=False)
class Tree:
    """The files of a source.

    Parameters
    ----------
    files : dict of str to bytes
        Every file by its path inside the backup.
    issues : list of Issue
        Archives inside it, and names that had to be decoded.
    single : bool
        One program, not a backup.
    """

    files: dict[str, bytes]
    issues: list[Issue] = field(default_factory=list)
    single: bool = False


def read_tree(path: Path) -> Tree:
    """Read every file of a folder or zip, or a program file with its data list.

    Parameters
    ----------
    path : Path
        Folder, zip or file.

    Raises
    ------
    BadInputError
        ``CANNOT_READ`` if the path is missing, unreadable, damaged or encrypted; ``UNSAFE_ARCHIVE`` if an entry would
        leave its folder, is a link or cannot lie beside another one, or if the whole is too large; ``NO_ROBOT`` for a
        file named ``.zip`` that is none.
    """
    try:
        if path.is_dir():
            return _with_issues(path, *_read_folder(path))
        if path.is_file():
            if zipfile.is_zipfile(path):
                return _with_issues(path, *_read_zip(path))
            if path.suffix.lower() == ".zip":
                message = "is no zip archive, or its end is missing: copy it from the controller again"
                raise BadInputError("NO_ROBOT", message, str(path))
            return Tree(_read_file(path), single=True)
    except _FOREIGN as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error) or "is damaged"
        named = error.filename if isinstance(error, OSError) and isinstance(error.filename, str) else path
        raise BadInputError("CANNOT_READ", reason, str(named)) from error
    if (workplace_of(path) / "old").is_dir():
        message = f"was moved away by a run of respot that was cut short; to put it back: respot undo {path}"
        raise BadInputError("CANNOT_READ", message, str(path))
    raise BadInputError("CANNOT_READ", "no such file or folder", str(path))


def read_files(path: Path) -> dict[str, bytes]:
    """Return the files of a source by path, as `read_tree` reads them."""
    return read_tree(path).files


def is_own_folder(name: str) -> bool:
    """Whether a folder of this name holds originals or work of respot, and no part of a backup."""
    return _OWN_FOLDER.fullmatch(name) is not None


def is_own(path: str) -> bool:
    """Whether a file of a backup, by its path with ``/``, lies in a folder of respot."""
    return any(is_own_folder(part) for part in path.split("/")[:-1])


def workplace_of(folder: Path) -> Path:
    """Hidden folder of respot beside a folder that it writes."""
    return folder.parent / f".{folder.name}.respot"


def _with_issues(path: Path, files: dict[str, bytes], issues: list[Issue]) -> Tree:
    _refuse_collisions(files, path)
    for name in files:
        if name.lower().endswith(_ARCHIVES):
            place = str(path / name) if path.is_dir() else f"{path}:{name}"
            message = "is an archive inside the backup and is not opened: name it itself, or unpack it first"
            issues.append(Issue("NESTED_ARCHIVE", message, place))
    return Tree(files, issues)


# -------------------------------------------------------------------------------------------------------------- folders


def _read_folder(path: Path) -> tuple[dict[str, bytes], list[Issue]]:
    found: list[Path] = []
    own: list[Path] = []
    size = 0
    for file in _below(path, own):
        if file.is_symlink():
            raise BadInputError("UNSAFE_ARCHIVE", "is a link; copy the backup without links", str(file))
        if file.is_file():
            found.append(file)
            size += file.stat().st_size
        elif not file.is_dir():
            raise BadInputError("UNSAFE_ARCHIVE", "is neither file nor folder; copy the backup without it", str(file))
    _check_size(path, len(found), size)
    files = {file.relative_to(path).as_posix(): file.read_bytes() for file in found}
    return files, [_own_issue(str(folder)) for folder in own]


def _own_issue(place: str) -> Issue:
    return Issue("OWN_FOLDER", "is a folder of respot itself, with what undo needs; it is not read", place)


def _below(path: Path, own: list[Path]) -> list[Path]:
    """Everything below a folder, sorted; a folder that may not be listed is an error, never an empty one.

    Folders of respot are left out and added to ``own``.
    """

    def refuse(error: OSError) -> None:
        raise BadInputError("CANNOT_READ", error.strerror or str(error), str(error.filename)) from error

    found: list[Path] = []
    for here, folders, files in os.walk(path, onerror=refuse):
        own += [Path(here, name) for name in folders if is_own_folder(name)]
        folders[:] = [name for name in folders if not is_own_folder(name)]
        found += [Path(here, name) for name in (*folders, *files)]
    return sorted(found)


def _read_file(path: Path) -> dict[str, bytes]:
    _check_size(path, 1, path.stat().st_size)
    files = {path.name: path.read_bytes()}
    wanted = {path.stem.lower() + suffix for suffix in _COMPANIONS.get(path.suffix.lower(), ())}
    for other in sorted(path.parent.iterdir()):
        if other.name.lower() in wanted and other.is_file():
            files[other.name] = other.read_bytes()
    return files


def _check_size(path: Path, count: int, size: int) -> None:
    if count > MOST_ENTRIES:
        raise BadInputError("UNSAFE_ARCHIVE", f"holds {count} files; no backup has more than {MOST_ENTRIES}", str(path))
    if size > LARGEST_BACKUP:
        message = f"holds {size / 1e9:.1f} GB; no backup has more than {LARGEST_BACKUP / 1e9:.1f} GB"
        raise BadInputError("UNSAFE_ARCHIVE", message, str(path))


# ----------------------------------------------------------------------------------------------------------------- zips


def _read_zip(path: Path) -> tuple[dict[str, bytes], list[Issue]]:
    files: dict[str, bytes] = {}
    own: list[str] = []
    with zipfile.ZipFile(path) as archive, path.open("rb") as stream:
        entries = archive.infolist()
        size = sum(entry.file_size for entry in entries)
        _check_size(path, len(entries), size)
        ratio = size / max(path.stat().st_size, 1)
        if size > _SMALL and ratio > LARGEST_RATIO:
            message = f"unpacks to {ratio:.0f} times its size, as no backup does; it is not unpacked"
            raise BadInputError("UNSAFE_ARCHIVE", message, str(path))
        names, issues = _names(entries, path)
        _refuse_overlaps(entries, archive.start_dir, stream, path)
        for entry, name in zip(entries, names, strict=True):
            if _is_folder(entry):
                continue
            if name in files:
                raise BadInputError("UNSAFE_ARCHIVE", f"holds {name} twice", str(path))
            if is_own(name):
                own.append(name)
            else:
                files[name] = _unpack(archive, entry, name, path)
        issues += [_own_issue(f"{path}:{own[0]}")] if own else []
    return files, issues


def _unpack(archive: zipfile.ZipFile, entry: zipfile.ZipInfo, name: str, path: Path) -> bytes:
    if entry.flag_bits & 0x41:
        message = f"{name} is encrypted: unpack the archive with its password and name the folder"
        raise BadInputError("CANNOT_READ", message, str(path))
    try:
        with archive.open(entry) as stream:
            data = stream.read(entry.file_size + 1)
    except _FOREIGN as error:
        reason = str(error) or "is damaged"
        raise BadInputError("CANNOT_READ", f"{name}: {reason}; copy the archive again", str(path)) from error
    if len(data) != entry.file_size:
        raise BadInputError("UNSAFE_ARCHIVE", f"{name} is not as large as the archive says", str(path))
    return data


def _is_folder(entry: zipfile.ZipInfo) -> bool:
    return entry.file_size == 0 and (entry.orig_filename.endswith(("/", "\\")) or bool(entry.external_attr & 0x10))


def _refuse_overlaps(entries: Sequence[zipfile.ZipInfo], end: int, stream: BinaryIO, path: Path) -> None:
    """Refuse entries that share bytes: few bytes could stand for many gigabytes."""
    position, last = 0, ""
    for entry in sorted(entries, key=lambda entry: entry.header_offset):
        if entry.header_offset < position:
            message = f"{printed(entry.filename)} and {printed(last)} share bytes of the archive"
            raise BadInputError("UNSAFE_ARCHIVE", message, str(path))
        stream.seek(entry.header_offset)
        header = stream.read(_LOCAL_HEADER.size)
        if len(header) < _LOCAL_HEADER.size or not header.startswith(b"PK\3\4"):
            raise BadInputError("CANNOT_READ", f"{printed(entry.filename)}: is damaged; copy it again", str(path))
        _, name, extra = _LOCAL_HEADER.unpack(header)
        position = entry.header_offset + _LOCAL_HEADER.size + name + extra + entry.compress_size
        last = entry.filename
    if position > end:
        raise BadInputError("UNSAFE_ARCHIVE", f"{printed(last)} runs over the archive's directory", str(path))


# ---------------------------------------------------------------------------------------------------------------- names


def _names(entries: Sequence[zipfile.ZipInfo], path: Path) -> tuple[list[str], list[Issue]]:
    """Safe names of the entries, and how those that are not ASCII were read."""
    raw = [_raw_name(entry) for entry in entries]
    undeclared = [name for name, entry in zip(raw, entries, strict=True) if not entry.flag_bits & 0x800]
    page = code_page(undeclared)
    names, decoded = [], []
    for name, entry in zip(raw, entries, strict=True):
        unicode_name = _unicode_path(entry.extra, name)
        text = name.decode("utf-8" if entry.flag_bits & 0x800 else page) if unicode_name is None else unicode_name
        if unicode_name is None and not entry.flag_bits & 0x800 and not name.isascii():
            decoded.append(text)
        names.append(_safe_name(entry, text, path))
    if not decoded:
        return names, []
    shown = ", ".join(printed(name) for name in decoded[:3])
    message = f"{len(decoded)} file names are not ASCII and the archive does not say how they are spelt"
    return names, [Issue("FILE_NAMES", f"{message}: read as {page}, e.g. {shown}", str(path))]


def _raw_name(entry: zipfile.ZipInfo) -> bytes:
    """Bytes of a name as they stand in the archive."""
    return entry.orig_filename.encode("utf-8" if entry.flag_bits & 0x800 else "cp437")


def code_page(names: Iterable[bytes]) -> str:
    """Code page of file names that do not say it: ``utf-8``, ``cp437`` or ``cp850``.

    The standard says cp437; tools on western European Windows write cp850, those of macOS UTF-8. One page is taken for
    a whole archive, so that a name goes back to its bytes with the same page. cp850 where it makes letters of what are
    box-drawing and other signs in cp437, and nowhere the other way round.
    """
    unusual = [name for name in names if not name.isascii()]
    try:
        return "utf-8" if [name.decode("utf-8") for name in unusual] else "cp437"
    except UnicodeDecodeError:
        pass
    codes = {bytes([code]) for name in unusual for code in name if code > 127}
    letters = {page: {code for code in codes if code.decode(page).isalpha()} for page in ("cp437", "cp850")}
    return "cp850" if letters["cp850"] > letters["cp437"] else "cp437"


def _unicode_path(extra: bytes, raw: bytes) -> str | None:
    """Name of an Info-ZIP Unicode Path field (0x7075) if it belongs to the name in the header."""
    while len(extra) >= 4:
        tag, size = struct.unpack_from("<HH", extra)
        field_, extra = extra[4 : 4 + size], extra[4 + size :]
        if tag == _UNICODE_PATH and len(field_) > 5 and field_[0] == 1:
            belongs = struct.unpack_from("<L", field_, 1)[0] == zlib.crc32(raw)
            return field_[5:].decode("utf-8") if belongs else None
    return None


def _safe_name(entry: zipfile.ZipInfo, text: str, path: Path) -> str:
    """Path inside the backup; of a folder it may be empty."""
    name = text.replace("\\", "/")
    kind = (entry.external_attr >> 16) & 0o170000
    if kind == 0o120000:
        message = f"entry {printed(text)} is a link; pack the backup without links"
        raise BadInputError("UNSAFE_ARCHIVE", message, str(path))
    parts = [part for part in name.split("/") if part not in ("", ".")]
    if "\0" in name:
        raise BadInputError("UNSAFE_ARCHIVE", f"entry {printed(text)} has a zero byte in its name", str(path))
    if name.startswith("/") or ".." in parts or ":" in name:
        raise BadInputError("UNSAFE_ARCHIVE", f"entry {printed(text)} would leave the folder", str(path))
    if not parts and not _is_folder(entry):
        raise BadInputError("UNSAFE_ARCHIVE", f"entry {printed(text)} has no name", str(path))
    return "/".join(parts)


def _refuse_collisions(names: Iterable[str], path: Path) -> None:
    """Refuse names that one system or another cannot hold beside each other."""
    files: dict[str, str] = {}
    folders: dict[str, str] = {}
    for name in names:
        key = _key(name)
        other = files.setdefault(key, name)
        if other != name:
            message = f"holds {printed(name)} and {printed(other)}: a controller has only one of them"
            raise BadInputError("UNSAFE_ARCHIVE", message, str(path))
        folders.update((folder, name) for folder in _folders(key))
    for key, name in files.items():
        if key in folders:
            message = f"{printed(name)} is a file, and the folder of {printed(folders[key])}"
            raise BadInputError("UNSAFE_ARCHIVE", message, str(path))


def _folders(name: str) -> Iterator[str]:
    position = name.find("/")
    while position >= 0:
        yield name[:position]
        position = name.find("/", position + 1)


def _key(name: str) -> str:
    """What two names have in common that Windows or macOS takes for one: case, form of accents, dots at the end."""
    plain = unicodedata.normalize("NFC", name).lower()
    return "/".join(part.rstrip(". ") or part for part in plain.split("/"))


def printed(name: str) -> str:
    """Name for a message: on one line, however strange."""
    return name if name.isprintable() else ascii(name)
