"""Opens a backup safely: a folder, a zip, or one program file.

Every file is kept as bytes under its path inside the backup, with ``/``; nothing of it is executed and nothing is
written. Paths that would leave the folder are refused.
"""

from __future__ import annotations

import hashlib
import zipfile
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path, PurePosixPath

from respot.issues import BadInputError, Issue
from respot.languages import LANGUAGES, Language
from respot.program.robot import Robot

#: An archive that unpacks to more is refused; the largest controller backups stay below 1 GB.
LARGEST_BACKUP = 4 * 1024**3
_COMPANIONS = {".src": (".dat",), ".dat": (".src",)}
#: Folder that marks the robot's own folder, and what it is written in.
_MARKS = {"krc": "krl", "rapid": "rapid"}


@dataclass(frozen=True, eq=False)
class Backup:
    """A backup with its robots.

    Parameters
    ----------
    path : Path
        As the user named it.
    files : mapping of str to bytes
        Every file.
    robots : sequence of Robot
        What respot read from them.
    issues : sequence of Issue
        About the backup itself; those of a robot are with the robot.
    """

    path: Path
    files: Mapping[str, bytes]
    robots: Sequence[Robot]
    issues: Sequence[Issue]

    @cached_property
    def sha256(self) -> str:
        """Hash of all paths and bytes."""
        digest = hashlib.sha256()
        for path in sorted(self.files):
            data = self.files[path]
            digest.update(f"{path}\0{len(data)}\0".encode("utf-8", "surrogateescape"))
            digest.update(data)
        return digest.hexdigest()

    def files_of(self, robot: Robot) -> dict[str, bytes]:
        """Return the files of one robot; those of robots in folders below are not among them."""
        inner = [other.root for other in self.robots if other.root != robot.root and other.root.startswith(robot.root)]
        return {
            path: data
            for path, data in self.files.items()
            if path.startswith(robot.root) and not any(path.startswith(root) for root in inner)
        }

    def robot(self, name: str | None = None) -> Robot:
        """Return the one robot, or the robot of a name.

        Raises
        ------
        BadInputError
            There is none, more than one and no name, or none of that name.
        """
        if not self.robots:
            raise BadInputError(
                "NO_ROBOT",
                "holds no KUKA or ABB robot program; name the folder that holds KRC or RAPID",
                str(self.path),
            )
        names = ", ".join(robot.name for robot in self.robots)
        if name is None:
            if len(self.robots) > 1:
                raise BadInputError("SEVERAL_ROBOTS", f"holds {names}: pick one with --robot-name", str(self.path))
            return self.robots[0]
        for robot in self.robots:
            if robot.name.lower() == name.lower():
                return robot
        raise BadInputError("NO_ROBOT", f"holds no robot {name}; there is {names}", str(self.path))


def open_backup(path: Path) -> Backup:
    """Read a backup from a folder, a zip, or a program file with its data list.

    Raises
    ------
    BadInputError
        ``CANNOT_READ`` if the path is missing or unreadable, ``UNSAFE_ARCHIVE`` if an entry would leave its folder, is
        a link, differs from another in case only, or if the whole is too large.
    """
    files = read_files(path)
    robots = [language.read_robot(name, root, own) for language, root, name, own in _robots(path, files)]
    return Backup(path, files, robots, [])


def read_files(path: Path) -> dict[str, bytes]:
    """Return every file of a folder or zip, or a program file with its data list, by path with ``/``.

    Raises
    ------
    BadInputError
        As `open_backup`.
    """
    try:
        if path.is_dir():
            return _read_folder(path)
        if path.is_file():
            return _read_zip(path) if zipfile.is_zipfile(path) else _read_file(path)
    except (OSError, zipfile.BadZipFile, RuntimeError, NotImplementedError, zlib.error) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise BadInputError("CANNOT_READ", reason, str(path)) from error
    raise BadInputError("CANNOT_READ", "no such file or folder", str(path))


def _read_folder(path: Path) -> dict[str, bytes]:
    files: dict[str, bytes] = {}
    for file in sorted(path.rglob("*")):
        if file.is_symlink():
            raise BadInputError("UNSAFE_ARCHIVE", "is a link; copy the backup without links", str(file))
        if file.is_file():
            files[file.relative_to(path).as_posix()] = file.read_bytes()
    seen: dict[str, str] = {}
    for name in files:
        other = seen.setdefault(name.lower(), name)
        if other != name:
            message = f"holds {name} and {other}: a controller has only one of them"
            raise BadInputError("UNSAFE_ARCHIVE", message, str(path))
    return files


def _read_file(path: Path) -> dict[str, bytes]:
    files = {path.name: path.read_bytes()}
    wanted = {path.stem.lower() + suffix for suffix in _COMPANIONS.get(path.suffix.lower(), ())}
    for other in sorted(path.parent.iterdir()):
        if other.name.lower() in wanted and other.is_file():
            files[other.name] = other.read_bytes()
    return files


def _read_zip(path: Path) -> dict[str, bytes]:
    files: dict[str, bytes] = {}
    with zipfile.ZipFile(path) as archive:
        entries = [entry for entry in archive.infolist() if not entry.is_dir()]
        if sum(entry.file_size for entry in entries) > LARGEST_BACKUP:
            raise BadInputError("UNSAFE_ARCHIVE", "unpacks to more than 4 GB", str(path))
        seen: dict[str, str] = {}
        for entry in entries:
            name = _safe_name(entry, path)
            other = seen.setdefault(name.lower(), name)
            if name in files or other != name:
                raise BadInputError("UNSAFE_ARCHIVE", f"holds {name} twice, or {other} in other case", str(path))
            with archive.open(entry) as stream:
                files[name] = stream.read(entry.file_size + 1)
            if len(files[name]) != entry.file_size:
                raise BadInputError("UNSAFE_ARCHIVE", f"{name} is not as large as the archive says", str(path))
    return files


def _safe_name(entry: zipfile.ZipInfo, path: Path) -> str:
    name = entry.filename.replace("\\", "/")
    parts = PurePosixPath(name).parts
    link = (entry.external_attr >> 16) & 0o170000 == 0o120000
    if link or not parts or parts[0] in ("/", "..") or ".." in parts or ":" in parts[0]:
        raise BadInputError("UNSAFE_ARCHIVE", f"entry {entry.filename!r} would leave the folder", str(path))
    return "/".join(part for part in parts if part != ".")


def _robots(path: Path, files: Mapping[str, bytes]) -> Iterator[tuple[Language, str, str, dict[str, bytes]]]:
    """Language, root folder, name and files of each robot."""
    roots: dict[tuple[str, str], None] = {}
    for name in files:
        parts = name.split("/")
        for index, part in enumerate(parts[:-1]):
            if part.lower() in _MARKS:
                root = "".join(f"{folder}/" for folder in parts[:index])
                roots.setdefault((root, _MARKS[part.lower()]))
                break
    if not roots:
        for language in LANGUAGES.values():
            if any(name.lower().endswith(tuple(language.suffixes)) for name in files):
                yield language, "", path.resolve().stem, dict(files)
        return
    for root, language_name in roots:
        language = LANGUAGES[language_name]
        inner = [other for other, _ in roots if other != root and other.startswith(root)]
        own = {
            name: data
            for name, data in files.items()
            if name.startswith(root) and not any(name.startswith(other) for other in inner)
        }
        if any(name.lower().endswith(tuple(language.suffixes)) for name in own):
            yield language, root, root.rstrip("/").rsplit("/", 1)[-1] or path.resolve().stem, own
