"""Runs a line: plans what is missing or changed, has it done, enters what came of it. Nothing stops for one robot."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from respot import __version__
from respot.issues import BadInputError, Issue
from respot.line.folder import WORK, OutputFolder
from respot.line.inputs import read_inputs
from respot.line.jobs import Job, JobResult, job_of
from respot.line.ledger import LEDGER, LOCK, Known, Ledger, Lock, Run
from respot.line.line_file import LineFile
from respot.line.summary import write_summary
from respot.line.work import do_job
from respot.parallel import ChildPool, JobTimeoutError, SerialExecutor, WorkerLostError

#: What a process for the work imports before it begins.
PRELOAD = ("respot.line.work",)
#: Robots that wait for a free worker: so few that nearly all that are called running do run.
_AHEAD = 1


@dataclass(frozen=True)
class Workers:
    """Who does the work.

    Parameters
    ----------
    processes : int
        Processes here; 0 does it in this one, where nothing limits time and memory.
    scheduler : str, optional
        Address of a Dask scheduler, whose workers do it instead.
    ship : bool
        Send inputs to them, and results back, as bytes: they do not see our files.
    timeout : float, optional
        Longest time for a robot [s].
    memory_mb : int, optional
        Most memory for a robot [MB].
    """

    processes: int = 1
    scheduler: str | None = None
    ship: bool = False
    timeout: float | None = None
    memory_mb: int | None = None


@dataclass(frozen=True)
class Event:
    """Something happened to a robot.

    Parameters
    ----------
    result : JobResult
        What came of it.
    done, total : int
        Robots of this run that are through, and all of it.
    seconds : float
        Since the run began.
    """

    result: JobResult
    done: int
    total: int
    seconds: float

    @property
    def per_minute(self) -> float:
        """Robots a minute so far."""
        return 60.0 * self.done / max(self.seconds, 1e-9)

    @property
    def remaining(self) -> float:
        """Seconds that are left if it goes on like this."""
        return (self.total - self.done) * self.seconds / self.done


Watch = Callable[[Event], None]


@dataclass(frozen=True)
class Done:
    """What a run did.

    Parameters
    ----------
    worked : set of str
        Robots that it worked on; of the others the ledger had the outcome.
    rows : sequence of dict
        What the ledger knows of each robot now, as `Ledger.rows` gives it.
    issues : sequence of Issue
        About the line.
    """

    worked: frozenset[str]
    rows: Sequence[dict[str, Any]]
    issues: Sequence[Issue]


def run_line(line: LineFile, out: Path, workers: Workers, *, retry: bool, watch: Watch) -> Done:
    """Do what is missing or changed of a line.

    Parameters
    ----------
    line : LineFile
        The line.
    out : Path
        Output folder: new, or of an earlier run of the same line.
    workers : Workers
        Who does it.
    retry : bool
        Also what failed before.
    watch : callable
        Told of each robot that is through.

    Raises
    ------
    BadInputError
        ``IN_USE``, ``ANOTHER_LINE``, ``BAD_LEDGER``, ``LEDGER_STOPPED``, ``OUTPUT_EXISTS``, ``NO_CLUSTER``, or
        nothing can be written.
    """
    folder = OutputFolder(out)
    _check_place(folder.path, line)
    with _ledger_of(folder.path, line) as ledger:
        ledger.start_run(__version__)
        folder.prepare()
        jobs = [job_of(line, robot) for robot in line.robots]
        known = ledger.known()
        todo = [job for job in jobs if _is_open(job, known.get(job.name), ledger, folder, retry=retry)]
        ledger.plan(jobs, [job.name for job in todo])
        if todo:
            with _executor(workers, folder, line) as (executor, width):
                _work_through(todo, executor, width, ledger, folder, workers.ship, watch)
        rows = list(ledger.rows())
        write_summary(line, rows, folder)
        folder.clear()
        ledger.end_run()
        left = [folder.robot(name) for name in ledger.left()]
        message = "is of a robot that is no longer in the line; it is left as it is"
        issues = [Issue("ROBOT_LEFT_LINE", message, str(place)) for place in left if place.is_dir()]
    return Done(frozenset(job.name for job in todo), rows, issues)


def rehearse_line(line: LineFile, workers: Workers, *, watch: Watch) -> list[JobResult]:
    """Do everything for a line but write; the results are in the order of the file."""
    jobs = [job_of(line, robot) for robot in line.robots]
    results: dict[str, JobResult] = {}
    started = time.monotonic()
    with _executor(workers, None, line) as (executor, width):
        for job, result in _each(jobs, executor, width, lambda job: (job, None, _sent(job, workers.ship))):
            results[job.name] = result
            watch(Event(result, len(results), len(jobs), time.monotonic() - started))
    return [results[job.name] for job in jobs]


def _check_place(path: Path, line: LineFile) -> None:
    """Refuse a folder that holds what no line wrote, or what this one reads."""
    if path.is_symlink() or (path.exists() and not path.is_dir()):
        raise BadInputError("OUTPUT_EXISTS", "is not a folder; name another one with -o", str(path))
    # a run that was killed in its first moment leaves its lock
    strange = path.is_dir() and any(item.name not in (LOCK, WORK) for item in path.iterdir())
    if strange and not (path / LEDGER).exists():
        message = "is not empty and holds no ledger of a line; name another folder with -o"
        raise BadInputError("OUTPUT_EXISTS", message, str(path))
    own = path.resolve()
    for robot in line.robots:
        source = (line.folder / robot.source).resolve()
        if own == source or own in source.parents or source in own.parents:
            message = f"holds the backup of {robot.name} or lies in it; name another folder with -o"
            raise BadInputError("OUTPUT_EXISTS", message, str(path))


@contextmanager
def _ledger_of(path: Path, line: LineFile) -> Iterator[Ledger]:
    """Take the folder for this process and open its ledger."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInputError("CANNOT_WRITE", f"cannot be written: {error.strerror}", str(path)) from error
    lock = Lock(path)
    if not lock.take():
        raise BadInputError("IN_USE", f"{_who(path)} is at work on it: wait, or end it", str(path))
    try:
        ledger = Ledger(path)
        try:
            _claim(ledger, line, path)
            yield ledger
        finally:
            ledger.close()
    finally:
        lock.release()


def _who(path: Path) -> str:
    run = running(path)
    return "another process" if run is None else str(run)


def running(path: Path) -> Run | None:
    """Whose run is at work on a folder that somebody holds; None where the ledger does not know it yet."""
    try:
        ledger = Ledger(path, readonly=True)
    except BadInputError:  # it has only just begun
        return None
    try:
        run = ledger.last_run()
        return None if run is None or run.ended is not None else run
    finally:
        ledger.close()


def _claim(ledger: Ledger, line: LineFile, path: Path) -> None:
    owner, file = ledger.line(), str(line.path.absolute())
    if owner is None or owner[0] == line.name:
        ledger.claim(line.name, file)
        return
    message = f"belongs to the line {owner[0]!r} of {owner[1]}, and this is {line.name!r}: name another folder with -o"
    raise BadInputError("ANOTHER_LINE", message, str(path))


def _is_open(job: Job, known: Known | None, ledger: Ledger, folder: OutputFolder, *, retry: bool) -> bool:
    """Whether a robot is to be done: new, changed since, not in its folder as it was written, or to be retried."""
    if known is None or known.identity != job.identity or known.state not in ("done", "failed"):
        return True
    if known.state == "failed":
        return retry
    return not folder.holds(job.name, ledger.outputs(job.name))


@contextmanager
def _executor(workers: Workers, folder: OutputFolder | None, line: LineFile) -> Iterator[tuple[Executor, int]]:
    """Whoever does the work, and how many robots at once; what is not done at an error is given up."""
    executor: Executor
    if workers.scheduler is not None:
        from respot.parallel.cluster import ClusterExecutor

        executor = cluster = ClusterExecutor(workers.scheduler, PRELOAD, workers.memory_mb, workers.timeout)
        width = cluster.threads
        if not workers.ship:
            _check_shared(cluster.on_each_worker, [line.folder, *([] if folder is None else [folder.staging("")])])
    elif workers.processes == 0:
        executor, width = SerialExecutor(), 0
    else:
        executor = ChildPool(workers.processes, PRELOAD, workers.memory_mb, workers.timeout)
        width = workers.processes
    try:
        yield executor, width + _AHEAD
    except BaseException:
        executor.shutdown(wait=True, cancel_futures=True)
        raise
    executor.shutdown()


def _check_shared(ask: Callable[..., Mapping[str, bool]], folders: Sequence[Path]) -> None:
    """Refuse workers that do not see our folders."""
    for path in folders:
        blind = sorted(worker for worker, sees in ask(os.path.exists, str(path)).items() if not sees)
        if blind:
            message = f"workers {', '.join(blind)} do not see {path}: share it with them, or send files with --ship"
            raise BadInputError("NO_CLUSTER", message)


def _work_through(
    todo: Sequence[Job],
    executor: Executor,
    width: int,
    ledger: Ledger,
    folder: OutputFolder,
    ship: bool,
    watch: Watch,
) -> None:
    started, since = time.monotonic(), {}

    def begin(job: Job) -> tuple[Job, str, Mapping[str, bytes] | None]:
        ledger.start(job.name)
        since[job.name] = time.monotonic()
        return job, str(folder.staging(job.name)), _sent(job, ship)

    for done, (job, result) in enumerate(_each(todo, executor, width, begin), start=1):
        kept = _settle(result, folder)
        ledger.finish(kept, time.monotonic() - since.pop(job.name))
        watch(Event(kept, done, len(todo), time.monotonic() - started))


def _settle(result: JobResult, folder: OutputFolder) -> JobResult:
    """Move what a robot's work wrote into place; of a robot that failed nothing old may pass for its result."""
    try:
        if result.state != "done":
            folder.remove(result.name)
            return result
        made = result.made if result.files is None else folder.unpack(result.name, result.files)
        folder.put(result.name, made)
    except OSError as error:
        return JobResult(result.name, "failed", "CANNOT_WRITE", f"its folder cannot be written: {error.strerror}")
    return result


def _sent(job: Job, ship: bool) -> Mapping[str, bytes] | None:
    return read_inputs(Path(job.folder), job.inputs) if ship else None


def _each(
    jobs: Sequence[Job], executor: Executor, width: int, begin: Callable[[Job], tuple[object, ...]]
) -> Iterator[tuple[Job, JobResult]]:
    """Have jobs done, a few at a time; what comes of each in the order in which they are through."""
    waiting = iter(jobs)
    pending: dict[Future[JobResult], Job] = {}
    while True:
        for job in waiting:
            try:
                arguments = begin(job)
            except BadInputError as error:
                if error.issue.code == "LEDGER_STOPPED":
                    raise
                yield job, JobResult(job.name, "failed", error.issue.code, str(error))
                continue
            pending[executor.submit(do_job, *arguments)] = job  # type: ignore[arg-type]
            if len(pending) >= width:
                break
        if not pending:
            return
        done, _ = wait(pending, return_when=FIRST_COMPLETED)
        for future in done:
            job = pending.pop(future)
            yield job, _result(job, future)


def _result(job: Job, future: Future[JobResult]) -> JobResult:
    """Return a job's result, also of one whose process was lost."""
    error = future.exception()
    if error is None:
        return future.result()
    if isinstance(error, WorkerLostError):
        message = f"{error}: killed from outside, or by the system for want of memory; --retry tries again"
        return JobResult(job.name, "failed", "WORKER_LOST", message)
    if isinstance(error, JobTimeoutError):
        message = f"{error} and was ended: give it more with --timeout, and look what its backup holds"
        return JobResult(job.name, "failed", "TIMED_OUT", message)
    if isinstance(error, MemoryError):
        message = "needs more memory than it may have: raise --memory, or look what its backup holds"
        return JobResult(job.name, "failed", "OUT_OF_MEMORY", message)
    if isinstance(error, ConnectionError):
        raise BadInputError("NO_CLUSTER", f"{error}: what is done is kept; run again") from error
    message = f"{type(error).__name__}: {error}; please report it"
    return JobResult(job.name, "failed", "INTERNAL_FAULT", message, "\n".join(getattr(error, "__notes__", [])))
