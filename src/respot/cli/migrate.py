"""``respot migrate``."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from respot.cli import options
from respot.cli.outcome import Outcome
from respot.cli.outcome import run as run_command
from respot.issues import BadInputError, Issue

if TYPE_CHECKING:
    from respot.line.line_file import LineFile
    from respot.line.run import Workers

HELP = "Fit and convert every robot of a line; what is done is remembered, and a second run does what is missing."
#: A robot that takes longer is not worth the others' time [s].
_TIMEOUT = 3600.0


def run(
    line_file: Annotated[Path, typer.Argument(metavar="LINE.toml", help="The robots of the line.", show_default=False)],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Folder for all robots and the ledger.", show_default=False)
    ] = None,
    jobs: Annotated[
        int | None,
        typer.Option(
            "-j",
            "--jobs",
            min=0,
            help="Processes; without it all cores. 0 works in this process, without limits.",
            show_default=False,
        ),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option("--scheduler", help="Dask scheduler whose workers do it: tcp://HOST:PORT.", show_default=False),
    ] = None,
    ship: Annotated[
        bool, typer.Option("--ship", help="Send files to the workers of --scheduler: they do not share our folders.")
    ] = False,
    retry: Annotated[bool, typer.Option("--retry", help="Try robots again that failed before.")] = False,
    timeout: Annotated[
        float, typer.Option("--timeout", min=0.0, help="Longest time for a robot, seconds; 0 for no limit.")
    ] = _TIMEOUT,
    memory: Annotated[
        int | None,
        typer.Option(
            "--memory",
            min=0,
            help="Most memory for a robot, MB; without it a share of this machine, 0: no limit.",
            show_default=False,
        ),
    ] = None,
    status: Annotated[bool, typer.Option("--status", help="Say how the line stands; also while it runs.")] = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Do everything but write.")] = False,
    as_json: options.AsJson = False,
    strict: options.Strict = False,
) -> None:
    """Run the command."""
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")  # one thread for each process: there are as many processes as cores

    def work() -> Outcome:
        from respot.line.line_file import read_line

        if ship and scheduler is None:
            raise BadInputError("BAD_OPTION", "--ship sends files to the workers of --scheduler: give its address")
        line = read_line(line_file)
        if status:
            return _status(line, _given(output))
        workers = _workers(jobs, scheduler, ship, timeout, memory)
        if dry_run:
            return _rehearsed(line, workers, as_json)
        return _migrated(line, _given(output), workers, retry, as_json)

    run_command(work, as_json, strict)


def _given(output: Path | None) -> Path:
    if output is None:
        raise BadInputError("BAD_OPTION", "give the folder of the line with -o OUTDIR, or --dry-run")
    return output


def _workers(jobs: int | None, scheduler: str | None, ship: bool, timeout: float, memory: int | None) -> Workers:
    from respot.line.run import Workers
    from respot.parallel import cores, share_of_memory

    processes = cores() if jobs is None else jobs
    if memory is None:
        limit = None if scheduler is not None else share_of_memory(max(1, processes))
    else:
        limit = memory or None
    return Workers(processes, scheduler, ship, timeout or None, limit)


def _migrated(line: LineFile, output: Path, workers: Workers, retry: bool, as_json: bool) -> Outcome:
    from respot.cli.line_progress import line_progress
    from respot.line.run import run_line

    with line_progress(as_json) as watch:
        done = run_line(line, output, workers, retry=retry, watch=watch)
    return _outcome(line, output, done.rows, list(done.issues), done.worked)


def _status(line: LineFile, output: Path) -> Outcome:
    from respot.line.ledger import LEDGER, Ledger, Lock
    from respot.line.run import running

    if not (output / LEDGER).is_file():
        raise BadInputError("CANNOT_READ", "holds no ledger of a line: run it first", str(output))
    lock = Lock(output)
    free = lock.take()
    lock.release()
    run = None if free else running(output)
    ledger = Ledger(output, readonly=True)
    try:
        rows, owner = list(ledger.rows()), ledger.line()
    finally:
        ledger.close()
    if owner is not None and owner[0] != line.name:
        raise BadInputError("ANOTHER_LINE", f"belongs to the line {owner[0]!r} of {owner[1]}", str(output))
    if free:  # what was at work on them has ended
        rows = [{**row, "state": "waiting" if row["state"] == "running" else row["state"]} for row in rows]
    return _outcome(line, output, rows, [], None, None if free else str(run or "another process"))


def _outcome(
    line: LineFile,
    output: Path,
    rows: Sequence[dict[str, Any]],
    issues: list[Issue],
    worked: frozenset[str] | None,
    busy: str | None = None,
) -> Outcome:
    """What the ledger knows, with times; robots that a run did not have to touch are skipped ones."""
    from respot.cli.show_migrate import show_line
    from respot.line.summary import line_record

    record = line_record(line.name, rows)
    times = {row["name"]: row for row in rows}
    robots = [
        {
            **robot,
            "state": "skipped"
            if worked is not None and robot["name"] not in worked and robot["state"] == "done"
            else robot["state"],
            "seconds": times[robot["name"]]["seconds"],
            "cpu_seconds": times[robot["name"]]["cpu_seconds"],
            "attempts": times[robot["name"]]["attempts"],
        }
        for robot in record["robots"]
    ]
    data = {**_told(record, robots), "output": str(output), "running": busy}
    return Outcome("migrate", data, lambda: show_line(data, line, output), issues, _not_all(record))


def _rehearsed(line: LineFile, workers: Workers, as_json: bool) -> Outcome:
    from respot.cli.line_progress import line_progress
    from respot.cli.show_migrate import show_line
    from respot.line.run import rehearse_line
    from respot.line.summary import line_record, row_of

    with line_progress(as_json) as watch:
        results = rehearse_line(line, workers, watch=watch)
    record = line_record(line.name, [row_of(*pair) for pair in zip(line.robots, results, strict=True)])
    robots = [
        {**robot, "seconds": None, "cpu_seconds": result.cpu_seconds, "attempts": 1}
        for robot, result in zip(record["robots"], results, strict=True)
    ]
    data = {**_told(record, robots), "output": None, "running": None}
    return Outcome("migrate", data, lambda: show_line(data, line, None), [], _not_all(record))


def _told(record: dict[str, Any], robots: list[dict[str, Any]]) -> dict[str, Any]:
    return {**{key: record[key] for key in ("line", "totals", "fleet", "groups")}, "robots": robots}


def _not_all(record: dict[str, Any]) -> bool:
    return bool(record["totals"]["failed"] or record["totals"]["refused"])
