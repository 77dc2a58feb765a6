"""What is asked of a disk: files that survive a power cut, links instead of copies, two folders that change places."""

from __future__ import annotations

import ctypes
import errno
import os
import shutil
import stat
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path

from respot.issues import BadInputError

#: What a person can do about what a disk refuses.
_ADVICE = {
    errno.ENOSPC: "the disk is full: free some space, or name a folder on another disk",
    errno.EDQUOT: "the share of this account is used up: free some space, or name a folder on another disk",
    errno.EFBIG: "a file may not become so large here: lift the limit, or name a folder on another disk",
    errno.EROFS: "the disk is read-only: name a folder on another one, or have it mounted for writing",
    errno.EACCES: "this account may not write there: get the right to, or name another folder",
    errno.EPERM: "this account may not write there: get the right to, or name another folder",
    errno.ENAMETOOLONG: "the path is too long: name a folder with a shorter path",
    errno.EBUSY: "the system holds it (a mount point, or a program that has it open): close it, or name another folder",
    errno.EXDEV: "it cannot be moved in one step here: write into a new folder with -o",
    errno.ENOTDIR: "a part of its path is a file: name another folder",
    errno.EEXIST: "a part of its path is a file: name another folder",
    errno.ENOLCK: "the disk has no locks, so that two runs could write at once: name a folder on another disk",
    errno.EOPNOTSUPP: "the disk has no locks, so that two runs could write at once: name a folder on another disk",
}
_RENAME_EXCHANGE = _RENAME_SWAP = 2
_AT_FDCWD = -100


def cannot_write(error: OSError, path: Path) -> BadInputError:
    """Say which file a disk refused, why, and what a person can do.

    Parameters
    ----------
    error : OSError
        What happened.
    path : Path
        The file or folder, as a person knows it.
    """
    advice = _ADVICE.get(error.errno or 0)
    reason = error.strerror or str(error)
    message = f"cannot be written: {reason}" + (f"; {advice}" if advice else "") + ". Nothing was changed"
    return BadInputError("CANNOT_WRITE", message, str(path))


def write(path: Path, data: bytes) -> None:
    """Write a file and the folders above it; an error names the file."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    except OSError as error:
        error.filename = str(path)
        raise


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Write one file whole or not at all: it is written beside its place, under the name that this yields.

    Raises
    ------
    BadInputError
        ``CANNOT_WRITE``; what was there is as it was.
    """
    place = path.resolve()  # a link stays one
    if place.exists() and not place.is_file():  # a pipe or a terminal has no place to move to
        yield path
        return
    part = place.with_name(f".{place.stem}.part{place.suffix}")
    try:
        try:
            yield part
            _sync(part, os.O_RDWR if sys.platform == "win32" else os.O_RDONLY)
            part.replace(place)
        finally:
            part.unlink(missing_ok=True)
    except OSError as error:
        raise cannot_write(error, path) from error
    except BadInputError as error:
        raise BadInputError(error.issue.code, error.issue.message, str(path)) from error


def flush(folder: Path) -> None:
    """Wait until all files and folders below a folder are on the disk: no power cut leaves an empty file."""
    if sync_disk(folder):
        return
    for here, _, names in os.walk(folder, topdown=False):
        for name in names:
            _sync(Path(here, name), os.O_RDWR if sys.platform == "win32" else os.O_RDONLY)
        sync_folder(Path(here))


def sync_disk(folder: Path) -> bool:
    """Wait once for the whole disk of a folder, which thousands of files reach sooner than one by one.

    Returns
    -------
    bool
        Whether it was done; False where the system has no such call.
    """
    wait = getattr(ctypes.CDLL(None, use_errno=True), "syncfs", None) if sys.platform == "linux" else None
    if wait is None:
        return False
    handle = os.open(folder, os.O_RDONLY)
    try:
        if wait(handle) == 0:
            return True
    finally:
        os.close(handle)
    number = ctypes.get_errno()
    if number == errno.ENOSYS:
        return False
    raise OSError(number, os.strerror(number), str(folder))


def sync_folder(folder: Path) -> None:
    """Wait until the names in a folder are on the disk."""
    if sys.platform != "win32":  # it has no handle of a folder to wait for
        _sync(folder, os.O_RDONLY)


def _sync(path: Path, flags: int) -> None:
    try:
        handle = os.open(path, flags)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
    except OSError as error:
        error.filename = str(path)
        raise


def read(path: Path) -> bytes:
    """Read a file that was flushed: from the disk, not from what memory still holds of it."""
    with path.open("rb") as file:
        if sys.platform == "linux":
            os.posix_fadvise(file.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)
        return file.read()


def read_all(folder: Path) -> dict[str, bytes]:
    """Read every file below a folder, as `read`, by its path there with ``/``."""
    files = [Path(here, name) for here, _, names in os.walk(folder) for name in names]
    return {file.relative_to(folder).as_posix(): read(file) for file in files}


def mirror(old: Path, new: Path) -> None:
    """Make a folder of the same files: hard links where the disk has them, copies elsewhere.

    A link costs nothing and is the file itself: bytes, times, rights. What changes must be put in as a new file.

    Raises
    ------
    BadInputError
        ``UNSAFE_ARCHIVE`` for a link inside; ``CANNOT_WRITE`` where another disk is mounted inside.
    """
    device = old.stat().st_dev
    for here, folders, names in os.walk(old, onerror=_raise):
        below = Path(here)
        there = new / below.relative_to(old)
        there.mkdir()
        for name in (*folders, *names):
            if (below / name).is_symlink():
                message = "is a link: what is written through it would land elsewhere. Nothing was changed"
                raise BadInputError("UNSAFE_ARCHIVE", message, str(below / name))
        for name in folders:
            if (below / name).stat().st_dev != device:
                message = "is another disk inside the backup; copy the backup to one disk. Nothing was changed"
                raise BadInputError("CANNOT_WRITE", message, str(below / name))
        for name in names:
            link(below / name, there / name)


def link(file: Path, other: Path) -> None:
    """Make a hard link of a file, or a copy with its times and rights where there can be none."""
    try:
        os.link(file, other)
    except OSError:
        shutil.copy2(file, other)
        own(file, other)


def look_alike(old: Path, new: Path) -> None:
    """Give the folders of ``new`` the times, rights and owners of those in ``old``, from the inside out."""
    for here, _, _ in os.walk(new, topdown=False):
        before = old / Path(here).relative_to(new)
        if before.is_dir():
            own(before, Path(here))
            shutil.copystat(before, here)


def own(old: Path, new: Path) -> None:
    """Give a file the owner of another one, where this account may."""
    if sys.platform != "win32":
        before, after = old.stat(), new.stat()
        if (before.st_uid, before.st_gid) != (after.st_uid, after.st_gid):
            with suppress(PermissionError):
                os.chown(new, before.st_uid, before.st_gid)


def remove(folder: Path) -> None:
    """Remove a folder with all that is in it; folders that may not be written are opened first."""
    for here, folders, _ in os.walk(folder):
        for name in folders:
            place = Path(here, name)
            if not place.is_symlink():
                with suppress(OSError):
                    place.chmod(place.stat().st_mode | stat.S_IRWXU)
    shutil.rmtree(folder)


def exchange(first: Path, second: Path) -> bool:
    """Let two folders of one disk change places in one step: no reader ever finds neither.

    Returns
    -------
    bool
        Whether it was done; False where the system or the disk has no such step.

    Raises
    ------
    OSError
        The system has it and refuses.
    """
    swap = _swap()
    if swap is None or swap(os.fsencode(first), os.fsencode(second)) == 0:
        return swap is not None
    number = ctypes.get_errno()
    if number in (errno.ENOSYS, errno.EINVAL, errno.EOPNOTSUPP):
        return False
    raise OSError(number, os.strerror(number), str(second))


@cache
def _swap() -> Callable[[bytes, bytes], int] | None:
    """The system's own exchange of two names; None where it has none."""
    if sys.platform == "linux":
        function = getattr(ctypes.CDLL(None, use_errno=True), "renameat2", None)
        if function is not None:
            return lambda first, second: int(function(_AT_FDCWD, first, _AT_FDCWD, second, _RENAME_EXCHANGE))
    if sys.platform == "darwin":
        function = getattr(ctypes.CDLL(None, use_errno=True), "renamex_np", None)
        if function is not None:
            return lambda first, second: int(function(first, second, _RENAME_SWAP))
    return None


def _raise(error: OSError) -> None:
    raise error
