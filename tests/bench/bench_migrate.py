"""How much a line costs beside its work: ``python tests/bench/bench_migrate.py [PART ...]``.

``share``: CPU of the main process as a share of the workers', robots of 1 MB. ``two``: two processes against one, median
of alternating pairs. ``memory``: most memory of the main process over many small robots. ``dask``: two Dask workers
against a pool of two. ``--robots`` and ``--pairs`` make it smaller; a machine that others use tells less.
"""

from __future__ import annotations

import argparse
import os
import re
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
import zipfile
from pathlib import Path

from respot.simulation import plant_files

SIZE = 1024**2


def line_of(folder: Path, robots: int, spots: int, size: int, effects: str) -> Path:
    """Write a line; each folder or zip is filled up to a size with a log: the main process hashes it as well."""
    for path, data in plant_files(robots, spots, 0.1, 11, {"effects": f'"{effects}"'} if effects else {}):
        place = folder / path
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_bytes(data)
    if size:
        text = "".join(f"2026-03-01 10:{n % 60:02d} KSS15{n:05d} message {n * 7919}\n" for n in range(size // 40))
        for backup in sorted((folder / "backups").iterdir()):
            if backup.is_dir():
                (backup / "KRCLog.log").write_text(text)
            elif zipfile.is_zipfile(backup):
                with zipfile.ZipFile(backup, "a") as archive:
                    archive.writestr("KRCLog.log", text)
    return folder / "line.toml"


def migrate(line: Path, out: Path, *more: str) -> tuple[float, float, float, int]:
    """Wall time, CPU of the main process, CPU of its children [s], and most memory of the main process [kB]."""
    script = (
        "import resource, sys, time\n"
        "from respot.cli import main\n"
        "try:\n    main()\nexcept SystemExit as end:\n    code = end.code or 0\n"
        "own, below = resource.getrusage(resource.RUSAGE_SELF), resource.getrusage(resource.RUSAGE_CHILDREN)\n"
        "print('cost', own.ru_utime + own.ru_stime, below.ru_utime + below.ru_stime, own.ru_maxrss, file=sys.stderr)\n"
        "sys.exit(code)\n"
    )
    shutil.rmtree(out, ignore_errors=True)
    started = time.perf_counter()
    command = [sys.executable, "-c", script, "migrate", str(line), "-o", str(out), "--json", *more]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    wall = time.perf_counter() - started
    if done.returncode not in (0, 1):
        raise SystemExit(done.stderr)
    _, own, below, memory = done.stderr.splitlines()[-1].split()
    return wall, float(own), float(below), int(memory)


def share(folder: Path, robots: int) -> None:
    """Main process against workers, robots of 1 MB with real fits."""
    line = line_of(folder / "share", robots, 40, SIZE, "")
    wall, own, below, _ = migrate(line, folder / "out", "-j", "2")
    print(f"share: {robots} robots of 1 MB in {wall:.1f} s: main {own:.2f} s, workers {below:.2f} s: {own / below:.1%}")


def two(folder: Path, robots: int, pairs: int) -> None:
    """Two processes against one."""
    line = line_of(folder / "two", robots, 40, SIZE, "")
    ratios = []
    for _ in range(pairs):
        one = migrate(line, folder / "out", "-j", "1")[0]
        both = migrate(line, folder / "out", "-j", "2")[0]
        ratios.append(one / both)
        print(f"  one {one:.1f} s, two {both:.1f} s: {ratios[-1]:.2f}", flush=True)
    print(
        f"two: {robots} robots, median of {pairs} pairs {statistics.median(ratios):.2f}, load {os.getloadavg()[0]:.1f}"
    )


def memory(folder: Path, robots: int) -> None:
    """Most memory of the main process."""
    line = line_of(folder / "memory", robots, 8, 0, "none")
    wall, own, below, most = migrate(line, folder / "out", "-j", "2")
    print(
        f"memory: {robots} robots in {wall:.0f} s: main {most / 1024:.0f} MB; CPU main {own:.1f} s, workers {below:.1f} s"
    )


def dask(folder: Path, robots: int, pairs: int) -> None:
    """Two Dask workers against a pool of two."""
    line = line_of(folder / "dask", robots, 40, SIZE, "")
    base = [sys.executable, "-m"]
    command = [*base, "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard"]
    scheduler = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    workers: list[subprocess.Popen[bytes]] = []
    try:
        assert scheduler.stderr is not None
        address = next(found[0] for text in scheduler.stderr if (found := re.search(r"tcp://127\.0\.0\.1:\d+", text)))
        command = [*base, "distributed.cli.dask_worker", address, "--nthreads", "1", "--no-dashboard"]
        command += ["--local-directory", str(folder)]
        workers += [subprocess.Popen(command, stderr=subprocess.DEVNULL) for _ in range(2)]
        time.sleep(10)
        ratios = []
        for _ in range(pairs):
            pool = migrate(line, folder / "out", "-j", "2")[0]
            cluster = migrate(line, folder / "out", "--scheduler", address)[0]
            ratios.append(cluster / pool)
            print(f"  pool {pool:.1f} s, two Dask workers {cluster:.1f} s: {ratios[-1]:.2f}", flush=True)
        print(
            f"dask: {robots} robots, median of {pairs} pairs {statistics.median(ratios):.2f}, load {os.getloadavg()[0]:.1f}"
        )
    finally:
        for process in (*workers, scheduler):
            process.kill()
            process.wait()


def main() -> None:
    """Run the parts that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", default=["share", "two", "memory", "dask"])
    parser.add_argument("--robots", type=int, default=200)
    parser.add_argument("--many", type=int, default=2000, help="robots of the part memory")
    parser.add_argument("--pairs", type=int, default=5)
    told = parser.parse_args()
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for part in told.parts:
            if part == "share":
                share(folder, told.robots)
            elif part == "two":
                two(folder, told.robots, told.pairs)
            elif part == "memory":
                memory(folder, told.many)
            elif part == "dask":
                dask(folder, told.robots, told.pairs)


if __name__ == "__main__":
    main()
