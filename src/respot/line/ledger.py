"""The ledger of a line: what is done, of which inputs and options, with what outcome; SQLite in the output folder.

One process writes it, any number may read. Clock times stand here and in no other file of the output folder.
"""

from __future__ import annotations

import json
import os
import socket
import sqlite3
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote

from respot.issues import BadInputError
from respot.line.jobs import Job, JobResult
from respot.line.schema import APPLICATION, SCHEMA, VERSION

LEDGER, LOCK = "ledger.sqlite", ".lock"
_BUSY_SECONDS = 10.0


@dataclass(frozen=True)
class Known:
    """What the ledger knows of a robot.

    Parameters
    ----------
    state : str
        ``waiting``, ``running``, ``done`` or ``failed``.
    identity : (str, str, str)
        Hashes of inputs and options, and the version of respot, of the last attempt.
    """

    state: str
    identity: tuple[str, str, str]


@dataclass(frozen=True)
class Run:
    """A run over the line: whose, and since when."""

    process: int
    host: str
    started: float
    ended: float | None

    def __str__(self) -> str:
        since = time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(self.started))
        return f"process {self.process} on {self.host}, started {since}"


class Ledger:
    """The ledger, open.

    Parameters
    ----------
    folder : Path
        Output folder.
    readonly : bool
        For looking at a line while it runs.

    Raises
    ------
    BadInputError
        ``BAD_LEDGER``: it is none of ours, is damaged, or newer than this respot.
    """

    def __init__(self, folder: Path, *, readonly: bool = False) -> None:
        self.path = folder / LEDGER
        try:
            self._db = _connect(self.path, readonly)
            self._prepare(readonly)
        except sqlite3.Error as error:
            raise BadInputError("BAD_LEDGER", _reason(error), str(self.path)) from error

    def _prepare(self, readonly: bool) -> None:
        application = self._db.execute("PRAGMA application_id").fetchone()[0]
        version = self._db.execute("PRAGMA user_version").fetchone()[0]
        empty = self._db.execute("SELECT count(*) FROM sqlite_master").fetchone()[0] == 0
        if empty and not readonly:
            self._db.execute("PRAGMA journal_mode=WAL")  # where the file system has none it stays as it was
            with self._all_or_nothing():
                for statement in SCHEMA:
                    self._db.execute(statement)
                self._db.execute(f"PRAGMA application_id={APPLICATION}")
                self._db.execute(f"PRAGMA user_version={VERSION}")
            return
        if application != APPLICATION:
            raise BadInputError("BAD_LEDGER", "is no ledger of respot: name another output folder", str(self.path))
        if version > VERSION:
            message = f"was written by a newer respot (schema {version}, this one knows {VERSION}): update respot"
            raise BadInputError("BAD_LEDGER", message, str(self.path))
        if version < VERSION:
            message = (
                f"was written by an older respot (schema {version}, this one needs {VERSION}): take a new output "
                "folder, or go on with the respot that began"
            )
            raise BadInputError("BAD_LEDGER", message, str(self.path))

    def close(self) -> None:
        """Close it; what was written is in one file again."""
        self._db.close()

    # the line

    def line(self) -> tuple[str, str] | None:
        """Name and file of the line that the folder belongs to; None where none has claimed it."""
        rows = dict(self._db.execute("SELECT key, value FROM meta WHERE key IN ('line', 'file')"))
        return (rows["line"], rows.get("file", "")) if "line" in rows else None

    def claim(self, line: str, file: str) -> None:
        """Say which line the folder belongs to."""
        with self._all_or_nothing():
            self._db.executemany("INSERT OR REPLACE INTO meta VALUES (?, ?)", [("line", line), ("file", file)])

    def start_run(self, version: str) -> None:
        """Note who is at work."""
        with self._all_or_nothing():
            self._db.execute(
                "INSERT INTO runs (process, host, started, version) VALUES (?, ?, ?, ?)",
                (os.getpid(), socket.gethostname(), time.time(), version),
            )

    def end_run(self) -> None:
        """Note that the last run came to its end."""
        with self._all_or_nothing():
            self._db.execute("UPDATE runs SET ended = ? WHERE id = (SELECT max(id) FROM runs)", (time.time(),))

    def last_run(self) -> Run | None:
        """Return the run that started last."""
        row = self._db.execute("SELECT process, host, started, ended FROM runs ORDER BY id DESC LIMIT 1").fetchone()
        return None if row is None else Run(*row)

    # jobs

    def known(self) -> dict[str, Known]:
        """Every robot that the ledger knows, by name."""
        rows = self._db.execute("SELECT robot, state, input_hash, option_hash, version FROM jobs")
        return {row[0]: Known(row[1], (row[2], row[3], row[4])) for row in rows}

    def plan(self, jobs: Sequence[Job], waiting: Iterable[str]) -> None:
        """Enter the robots of a run in their order, and forget the outcome of those that are to be done."""
        todo = set(waiting)
        with self._all_or_nothing():
            self._db.execute("UPDATE jobs SET position = NULL")
            for position, job in enumerate(jobs):
                traits = json.dumps({"group": job.robot.group, **job.robot.traits})
                self._db.execute(
                    "INSERT INTO jobs (robot, position, traits) VALUES (?, ?, ?) "
                    "ON CONFLICT (robot) DO UPDATE SET position = excluded.position, traits = excluded.traits",
                    (job.name, position, traits),
                )
                if job.name in todo:
                    self._forget(job.name)
                    self._db.execute(
                        "UPDATE jobs SET state = 'waiting', input_hash = ?, option_hash = ?, version = ?, code = '', "
                        "error = '', details = '', figures = '{}' WHERE robot = ?",
                        (*job.identity, job.name),
                    )

    def start(self, name: str) -> None:
        """Note that the work on a robot begins."""
        with self._all_or_nothing():
            self._db.execute(
                "UPDATE jobs SET state = 'running', attempts = attempts + 1, started = ?, ended = NULL WHERE robot = ?",
                (time.time(), name),
            )

    def finish(self, result: JobResult, seconds: float) -> None:
        """Note what came of a robot, all of it or nothing."""
        with self._all_or_nothing():
            self._forget(result.name)
            self._db.execute(
                "UPDATE jobs SET state = ?, code = ?, error = ?, details = ?, figures = ?, ended = ?, seconds = ?, "
                "cpu_seconds = ? WHERE robot = ?",
                (
                    result.state,
                    result.code,
                    result.error,
                    result.details,
                    json.dumps(result.figures),
                    time.time(),
                    seconds,
                    result.cpu_seconds,
                    result.name,
                ),
            )
            fit = result.figures
            if "spots" in fit:
                self._db.execute(
                    "INSERT INTO fits VALUES (?, ?, ?, ?, ?, ?, ?)",
                    (result.name, *(fit[key] for key in ("kind", "spots", "inliers", "before", "after", "heldout"))),
                )
            self._db.executemany(
                "INSERT INTO effects VALUES (?, ?, ?, ?, ?)",
                [
                    (result.name, number, effect["name"], bool(effect["named"]), json.dumps(effect))
                    for number, effect in enumerate(result.effects)
                ],
            )
            self._db.executemany(
                "INSERT INTO edits VALUES (?, ?, ?, ?, ?, ?, ?)",
                [
                    (result.name, *(edit[key] for key in ("path", "line", "target", "depth", "shift_mm", "turn_deg")))
                    for edit in result.edits
                ],
            )
            self._db.executemany(
                "INSERT INTO outputs VALUES (?, ?, ?, ?)",
                [(result.name, path, sha256, size) for path, (sha256, size) in result.outputs.items()],
            )

    def _forget(self, name: str) -> None:
        for table in ("fits", "effects", "edits", "outputs"):
            self._db.execute(f"DELETE FROM {table} WHERE robot = ?", (name,))  # noqa: S608 - names of our own

    def outputs(self, name: str) -> dict[str, tuple[str, int]]:
        """Hash and size of each file of a robot's folder, by path."""
        rows = self._db.execute("SELECT path, sha256, bytes FROM outputs WHERE robot = ?", (name,))
        return {path: (sha256, size) for path, sha256, size in rows}

    def rows(self) -> Iterator[dict[str, Any]]:
        """What is known of each robot of the line, in its order: state, figures, effects, times."""
        found = self._db.execute(
            "SELECT robot, state, attempts, code, error, figures, traits, seconds, cpu_seconds, started FROM jobs "
            "WHERE position IS NOT NULL ORDER BY position"
        ).fetchall()
        for robot, state, attempts, code, error, figures, traits, seconds, cpu_seconds, started in found:
            effects = self._db.execute("SELECT record FROM effects WHERE robot = ? ORDER BY number", (robot,))
            yield {
                "name": robot,
                "state": state,
                "attempts": attempts,
                "code": code,
                "error": error,
                "seconds": seconds,
                "cpu_seconds": cpu_seconds,
                "started": started,
                "traits": json.loads(traits),
                "figures": json.loads(figures),
                "effects": [json.loads(record) for (record,) in effects],
            }

    def left(self) -> list[str]:
        """Robots that were once of the line and are no more."""
        rows = self._db.execute("SELECT robot FROM jobs WHERE position IS NULL ORDER BY robot")
        return [robot for (robot,) in rows]

    @contextmanager
    def _all_or_nothing(self) -> Iterator[None]:
        """One transaction.

        Raises
        ------
        BadInputError
            ``LEDGER_STOPPED``: what cannot be remembered is not done.
        """
        try:
            self._db.execute("BEGIN IMMEDIATE")
            try:
                yield
            except BaseException:
                self._db.execute("ROLLBACK")
                raise
            self._db.execute("COMMIT")
        except sqlite3.Error as error:
            message = f"{_reason(error)}: what is done is kept; make room, and run the line again"
            raise BadInputError("LEDGER_STOPPED", message, str(self.path)) from error


class Lock:
    """Holds an output folder for one process; the system lets go of it when the process ends, however it ends.

    Parameters
    ----------
    folder : Path
        Output folder.
    """

    def __init__(self, folder: Path) -> None:
        self._path = folder / LOCK
        self._db: sqlite3.Connection | None = None

    def take(self) -> bool:
        """Take it, unless another process has it.

        Raises
        ------
        BadInputError
            ``CANNOT_WRITE``: the folder, or its file system, lets nobody have it.
        """
        db = None
        try:
            db = sqlite3.connect(self._path, timeout=0.0, isolation_level=None, check_same_thread=False)
            db.execute("BEGIN EXCLUSIVE")
        except sqlite3.Error as error:
            if db is not None:
                db.close()
            if error.sqlite_errorcode == sqlite3.SQLITE_BUSY:
                return False
            raise BadInputError("CANNOT_WRITE", f"cannot be locked: {error}", str(self._path)) from error
        self._db = db
        return True

    def release(self) -> None:
        """Let go of it."""
        if self._db is not None:
            self._db.close()
            self._db = None


def _connect(path: Path, readonly: bool) -> sqlite3.Connection:
    name = f"file:{quote(str(path.absolute()))}?mode={'ro' if readonly else 'rwc'}"
    db = sqlite3.connect(name, uri=True, timeout=_BUSY_SECONDS, isolation_level=None, check_same_thread=False)
    if not readonly:
        db.execute("PRAGMA synchronous=NORMAL")
    return db


def _reason(error: sqlite3.Error) -> str:
    return f"cannot be used: {error}"
