"""The hidden folder beside a target in which everything is made before it goes into place in one step.

``.NAME.respot`` holds a lock, which the system lets go when its process ends however it ends; what a killed run left is
cleaned away by the next one. Where two folders cannot change places in one step, a killed run may leave the target
absent and its old state here: the next run puts it back.
"""

from __future__ import annotations

import errno
import json
import os
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path

from respot.archives import workplace_of
from respot.issues import BadInputError
from respot.output.disk import cannot_write, exchange, remove, sync_folder

if sys.platform == "win32":
    import msvcrt
else:
    import fcntl

_LOCK = "lock"
#: Where the lock of Windows lies: beyond what others read of the file.
_BEYOND = 1 << 30
#: How often a workplace may go away under a run before it gives up.
_MOST_TRIES = 100


class Workplace:
    """Where a folder is made.

    Parameters
    ----------
    target : Path
        The folder that is going to be written, absolute.

    Attributes
    ----------
    new : Path
        What is going to be the folder.
    """

    def __init__(self, target: Path) -> None:
        self.target = target
        self.root = workplace_of(target)
        self.new = self.root / "new"
        self._old = self.root / "old"
        self._rest = self.root / "rest"

    def put(self) -> None:
        """Let ``new`` become the target; what was there goes away only when it has."""
        if not os.path.lexists(self.target):
            self.new.rename(self.target)
        elif not exchange(self.new, self.target):
            self.target.rename(self._old)
            try:
                self.new.rename(self.target)
            except BaseException:
                if not self.target.exists():
                    self._old.rename(self.target)
                raise
            self._old.rename(self._rest)
        with suppress(OSError):  # it is in place, whatever is said about when that reaches the disk
            sync_folder(self.target.parent)

    def take(self) -> None:
        """Let the target go."""
        self.target.rename(self._rest)
        with suppress(OSError):
            sync_folder(self.target.parent)

    def clean(self) -> None:
        """Put back what a killed run took away, and remove what it left."""
        if self._old.exists() and not os.path.lexists(self.target):
            self._old.rename(self.target)
        for left in (self.new, self._old, self._rest):
            if left.exists():
                remove(left)

    def shown(self, path: Path) -> Path:
        """Name of a file for people: where it was going to lie."""
        if self.new in path.parents:
            return self.target / path.relative_to(self.new)
        return self.target if self.root in (path, *path.parents) else path


@contextmanager
def workplace(target: Path) -> Iterator[Workplace]:
    """Work on a folder, alone; nothing is left beside it at the end.

    Parameters
    ----------
    target : Path
        The folder, absolute. Missing folders above it are made, and removed again if nothing is put there.

    Raises
    ------
    BadInputError
        ``IN_USE`` while another process works on it; ``CANNOT_WRITE`` for whatever the disk refuses.
    """
    place = Workplace(target)
    try:
        made = _make_parents(target.parent)
        try:
            handle = _lock(place.root)
            try:
                place.clean()
                yield place
            finally:
                with suppress(OSError):  # what cannot be removed now is removed by the next run
                    place.clean()
                _unlock(place.root, handle)
        finally:
            with suppress(OSError):
                for folder in made:
                    folder.rmdir()
    except OSError as error:
        named = error.filename if isinstance(error.filename, str) else None
        raise cannot_write(error, place.shown(Path(named)) if named else target) from error


def is_cut_short(target: Path) -> bool:
    """Whether a folder is missing since a run was killed between two renames."""
    return not os.path.lexists(target) and (workplace_of(target) / "old").is_dir()


def restore(target: Path) -> None:
    """Put a folder back that a killed run took away.

    Raises
    ------
    BadInputError
        As `workplace`.
    """
    if is_cut_short(target):
        with workplace(target):
            pass


def _make_parents(folder: Path) -> list[Path]:
    """Make a folder and those above it; returns what was made, the innermost first."""
    missing = [each for each in (folder, *folder.parents) if not each.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    return missing


def _lock(root: Path) -> int:
    """Lock a workplace for this process."""
    for _ in range(_MOST_TRIES):
        with suppress(FileExistsError):
            root.mkdir()
        if _LOCK not in (names := _names(root)) and names:
            message = f"{root} is in the way, and not of respot: move it, or name another folder. Nothing was changed"
            raise BadInputError("CANNOT_WRITE", message, str(root))
        try:
            handle = os.open(root / _LOCK, os.O_RDWR | os.O_CREAT, 0o644)
        except FileNotFoundError:
            continue  # the run before this one has just removed its workplace
        try:
            _claim(handle, root)
            if _is(handle, root / _LOCK):
                started = datetime.now(UTC).isoformat(timespec="seconds")
                text = json.dumps({"process": os.getpid(), "host": socket.gethostname(), "started": started})
                os.ftruncate(handle, 0)
                os.write(handle, text.encode())
                return handle
        except BaseException:
            os.close(handle)
            raise
        os.close(handle)
    raise _in_use(root)


def _names(root: Path) -> list[str]:
    """Names in a workplace; none if it has just gone."""
    try:
        return [path.name for path in root.iterdir()]
    except FileNotFoundError:
        return []


def _claim(handle: int, root: Path) -> None:
    """Take the lock of an open file.

    Raises
    ------
    BadInputError
        ``IN_USE``.
    """
    try:
        if sys.platform == "win32":
            os.lseek(handle, _BEYOND, os.SEEK_SET)
            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
            os.lseek(handle, 0, os.SEEK_SET)
        else:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        if error.errno not in (errno.EWOULDBLOCK, errno.EACCES, errno.EDEADLK):
            error.filename = str(root)
            raise
        raise _in_use(root) from error


def _in_use(root: Path) -> BadInputError:
    target = root.parent / root.name[1 : -len(".respot")]
    message = f"{_owner(root)} is writing there: wait until it is done. Nothing was changed"
    return BadInputError("IN_USE", message, str(target))


def _owner(root: Path) -> str:
    """Who holds a lock, in words."""
    try:
        owner = json.loads((root / _LOCK).read_bytes())
        return f"process {owner['process']} on {owner['host']} (since {owner['started']})"
    except (OSError, ValueError, LookupError, TypeError):  # it has not said so yet
        return "another process"


def _is(handle: int, path: Path) -> bool:
    """Whether an open file is still the one of its name."""
    try:
        return os.path.samestat(os.fstat(handle), path.stat())
    except FileNotFoundError:
        return False


def _unlock(root: Path, handle: int) -> None:
    """Let a workplace go: its name first, so that nobody takes a lock that is no longer seen.

    What could not be removed keeps its lock file, by which the next run knows whose it is.
    """
    if sys.platform == "win32":  # an open file cannot be removed there
        os.close(handle)
    with suppress(OSError):
        if _names(root) == [_LOCK]:
            (root / _LOCK).unlink()
    if sys.platform != "win32":
        os.close(handle)
    with suppress(OSError):
        root.rmdir()
