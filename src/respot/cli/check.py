"""``respot check``."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from respot.cli import options
from respot.cli.outcome import Outcome
from respot.cli.outcome import run as run_command

if TYPE_CHECKING:
    from respot.checking import CheckedFile

HELP = "Read every program of files, folders and zips, and show that each can be written back byte for byte."


def run(
    paths: Annotated[list[Path], typer.Argument(help="Files, folders, zips.", show_default=False)],
    jobs: Annotated[int, typer.Option("-j", "--jobs", min=0, help="Processes; 0 takes all cores.")] = 0,
    as_json: options.AsJson = False,
    strict: options.Strict = False,
) -> None:
    """Run the command."""

    def work() -> Outcome:
        from respot.checking import check_file
        from respot.cli.show_check import show_files
        from respot.parallel import cores, run_each

        started = time.monotonic()
        items = [item for path in paths for item in _programs(path)]
        found: dict[int, CheckedFile] = {}
        done = 0
        for index, checked in run_each(check_file, items, jobs or cores()):
            found[index] = checked
            done += checked.bytes
            _progress(len(found), len(items), done, sum(len(data) for _, data in items), time.monotonic() - started)
        files = [found[index] for index in sorted(found)]
        totals = {
            "files": len(files),
            "bytes": sum(file.bytes for file in files),
            "statements": sum(file.statements for file in files),
            "opaque": sum(file.opaque for file in files),
            "roundtrip_failures": sum(not file.roundtrip for file in files),
            "seconds": time.monotonic() - started,
        }
        records = [{key: value for key, value in asdict(file).items() if key != "issues"} for file in files]
        issues = [issue for file in files for issue in file.issues]
        return Outcome(
            "check",
            {"files": records, "totals": totals},
            lambda: show_files(files, totals),
            issues,
            answer_is_no=bool(totals["roundtrip_failures"]),
        )

    run_command(work, as_json, strict)


def _programs(path: Path) -> Iterator[tuple[str, bytes]]:
    """Files of a path that a suffix promises to be programs, with the path that the user can find them under."""
    from respot.backups import read_files
    from respot.checking import language_of

    for name, data in read_files(path).items():
        if language_of(name) is not None:
            yield str(path / name) if path.is_dir() else f"{path}:{name}" if name != path.name else str(path), data


def _progress(done: int, count: int, read: int, size: int, seconds: float) -> None:
    """One line that is written over on a terminal; nothing elsewhere."""
    if not sys.stderr.isatty():
        return
    rate = read / max(seconds, 1e-6)
    left = (size - read) / max(rate, 1.0)
    end = "\n" if done == count else ""
    sys.stderr.write(f"\r{done}/{count} files, {rate / 1e6:.1f} MB/s, {left:.0f} s left \033[K{end}")
    sys.stderr.flush()
