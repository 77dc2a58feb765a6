"""A line whose main process, or whose workers, are killed over and over comes to the very bytes of an undisturbed run."""

from __future__ import annotations

import json
import os
import signal
import sqlite3
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import pytest

from respot.line.line_file import read_line
from respot.line.run import Workers, run_line
from tests.line.lines import contents, make_line

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="forks, and looks for processes in /proc")
ROOT = Path(__file__).parents[2]
ROBOTS, KILLS = 60, 30


@pytest.fixture(scope="module")
def line(tmp_path_factory) -> Path:
    return make_line(tmp_path_factory.mktemp("line"), ROBOTS)


@pytest.fixture(scope="module")
def undisturbed(line, tmp_path_factory) -> dict[str, bytes]:
    out = tmp_path_factory.mktemp("undisturbed") / "out"
    run_line(read_line(line), out, Workers(0), retry=False, watch=lambda event: None)
    return contents(out)


def test_the_main_process_killed_at_thirty_moments(line, undisturbed, tmp_path):
    told = {"line": str(line), "out": str(tmp_path / "out"), "kills": KILLS, "pooled": 3, "delay": 0.4, "seed": 7}
    command = [sys.executable, "-m", "tests.line.driver"]
    done = subprocess.run(command, input=json.dumps(told), capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["killed"] == KILLS
    assert contents(tmp_path / "out") == undisturbed
    assert sum(name.startswith("robots/") and name.endswith("respot.json") for name in undisturbed) > 10
    with closing(sqlite3.connect(tmp_path / "out" / "ledger.sqlite")) as ledger:
        assert ledger.execute("SELECT max(attempts) FROM jobs").fetchone()[0] > 1


def workers_of(process: int) -> list[int]:
    found = []
    for place in Path("/proc").glob("[0-9]*"):
        try:
            parent = int(place.joinpath("stat").read_text().rpartition(")")[2].split()[1])
            if parent == process and b"respot.parallel.child" in place.joinpath("cmdline").read_bytes():
                found.append(int(place.name))
        except (OSError, ValueError):  # it has just ended
            pass
    return sorted(found)


def test_workers_killed_while_they_work(line, undisturbed, tmp_path):
    out = tmp_path / "out"
    command = [sys.executable, "-m", "respot", "migrate", str(line), "-o", str(out), "-j", "2", "--json"]
    killed = 0
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as running:
        for event in running.stderr:
            done, workers = json.loads(event)["done"], workers_of(running.pid)
            if done % 9 == 4 and killed < 4 and len(workers) == 2:
                os.kill(workers[done % 2], signal.SIGKILL)
                killed += 1
    assert running.returncode == 1
    assert killed == 4
    with closing(sqlite3.connect(out / "ledger.sqlite")) as ledger:
        lost = ledger.execute("SELECT robot, error FROM jobs WHERE code = 'WORKER_LOST'").fetchall()
    assert len(lost) == 4  # each took one robot along, and no other
    assert all("killed by signal 9" in error for _, error in lost)
    assert not any((out / "robots" / robot).exists() for robot, _ in lost)
    run_line(read_line(line), out, Workers(0), retry=True, watch=lambda event: None)
    assert contents(out) == undisturbed
