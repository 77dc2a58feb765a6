"""What `respot convert` costs beside `respot check -j 1`, on made-up backups, in one run, and how much memory it takes.

Usage: ``python tests/bench/bench_convert.py [--megabytes 20] [--repeat 3]``

A backup of 20 MB has 600 programs of 100 targets. It is converted by a theory (the fit of 2000 spots is part of it), and
by a calibration with an effect of the arm that was fitted to it before: every target is solved for through inverse
kinematics. All are run as a user runs them, in processes of their own, one after the other; the fastest of each counts, in
seconds of processor time, so that other work on the machine does not. Memory is the most that is resident at once. The
promises are 3 times the check, and 1000 MB.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from made_up_welding import draw, measured, theory, write

_PROGRAMS_A_MEGABYTE = 30
_FIT = ("fit", "backup", "--measured", "measured.csv", "--effects", "joint_zero", "--noise", "0.05", "-o", "cal.json")
_COMMANDS = {
    "check": ("check", "-j", "1", "backup"),
    "convert --theory": ("convert", "backup", "--theory", "theory.csv", "-o", "out"),
    "convert -c": ("convert", "backup", "-c", "cal.json", "-o", "out"),
}


def main() -> None:
    """Print ratios and memory for both languages."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--megabytes", type=float, default=20.0)
    parser.add_argument("--repeat", type=int, default=3)
    options = parser.parse_args()
    for language in ("krl", "rapid"):
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            welding = draw(language, max(1, round(options.megabytes * _PROGRAMS_A_MEGABYTE)))
            write(welding, folder / "backup")
            (folder / "theory.csv").write_text(theory(welding, 2000), encoding="utf-8")
            (folder / "measured.csv").write_text(measured(welding, 150), encoding="utf-8")
            _run(_FIT, folder)
            size = sum(file.stat().st_size for file in (folder / "backup").rglob("*") if file.is_file())
            print(f"{language}: {size / 1e6:.1f} MB, {len(welding)} targets", flush=True)
            _measure(folder, options.repeat)


def _measure(folder: Path, repeat: int) -> None:
    spent: dict[str, float] = {}
    memory: dict[str, float] = {}
    for _ in range(repeat):
        for what, command in _COMMANDS.items():
            seconds, megabytes = _run(command, folder)
            spent[what] = min(seconds, spent.get(what, seconds))
            memory[what] = max(megabytes, memory.get(what, 0.0))
            shutil.rmtree(folder / "out", ignore_errors=True)
    for what in _COMMANDS:
        ratio = spent[what] / spent["check"]
        print(f"  {what}: {spent[what]:.1f} s, {ratio:.2f} times the check, {memory[what]:.0f} MB", flush=True)


def _run(arguments: tuple[str, ...], folder: Path) -> tuple[float, float]:
    """Seconds of processor time and most resident memory [MB] of a command."""
    with subprocess.Popen(
        [sys.executable, "-m", "respot", *arguments], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
    ) as process:
        said = process.stderr.read() if process.stderr is not None else b""
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode > 1:
        raise SystemExit(said.decode(errors="replace"))
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


if __name__ == "__main__":
    main()
