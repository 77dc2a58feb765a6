"""A line on a Dask cluster of separate processes: the bytes are those of this machine, also when a worker is killed."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from respot.issues import BadInputError
from respot.line.line_file import read_line
from respot.line.run import Workers, run_line
from respot.parallel import WorkerLostError, cluster
from tests.line.lines import contents, make_line

pytest.importorskip("distributed")
pytestmark = pytest.mark.filterwarnings("default")  # what the cluster's own libraries warn of is theirs
ROBOTS = 16


@contextmanager
def started(*command: str) -> Iterator[subprocess.Popen]:
    """Run a part of the cluster as a process of its own; it is gone afterwards."""
    arguments = [sys.executable, "-m", *command]
    process = subprocess.Popen(arguments, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
    try:
        yield process
    finally:
        process.kill()
        process.wait()
        process.stderr.close()


@pytest.fixture(scope="module")
def scheduler() -> Iterator[str]:
    with started("distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard") as process:
        for text in process.stderr:
            found = re.search(r"tcp://127\.0\.0\.1:\d+", text)
            if found:
                yield found[0]
                return
    raise AssertionError("no scheduler came up")


@contextmanager
def worker(address: str, folder: Path, *more: str) -> Iterator[subprocess.Popen]:
    command = ("distributed.cli.dask_worker", address, "--nthreads", "1", "--no-dashboard", "--local-directory")
    with started(*command, str(folder), *more) as process:
        yield process


def wait_for(address: str, workers: int) -> None:
    from distributed import Client

    with Client(address, set_as_default=False) as client:
        client.wait_for_workers(workers, timeout=120)


@pytest.fixture(scope="module")
def line(tmp_path_factory) -> Path:
    return make_line(tmp_path_factory.mktemp("line"), ROBOTS)


@pytest.fixture(scope="module")
def here(line, tmp_path_factory) -> dict[str, bytes]:
    out = tmp_path_factory.mktemp("here") / "out"
    run_line(read_line(line), out, Workers(0), retry=False, watch=lambda event: None)
    return contents(out)


def test_two_workers_of_which_one_is_killed(line, here, scheduler, tmp_path):
    with worker(scheduler, tmp_path, "--no-nanny") as one, worker(scheduler, tmp_path, "--no-nanny"):
        wait_for(scheduler, 2)
        seen = []

        def watch(event):
            seen.append(event)
            if len(seen) == 4:
                os.kill(one.pid, signal.SIGKILL)

        run_line(read_line(line), tmp_path / "out", Workers(scheduler=scheduler), retry=False, watch=watch)
    assert len(seen) == ROBOTS
    assert not any(event.result.code == "WORKER_LOST" for event in seen)
    assert contents(tmp_path / "out") == here


def test_workers_that_see_no_file_of_ours_get_the_bytes(line, here, scheduler, tmp_path):
    shutil.copytree(line.parent, tmp_path / "line")
    with worker(scheduler, tmp_path):
        wait_for(scheduler, 1)
        workers = Workers(scheduler=scheduler, ship=True, timeout=300.0)
        run_line(
            read_line(tmp_path / "line" / "line.toml"), tmp_path / "out", workers, retry=False, watch=lambda e: None
        )
    assert contents(tmp_path / "out") == here


def test_nobody_answers(line, tmp_path, monkeypatch):
    monkeypatch.setattr(cluster, "_ANSWERS_WITHIN", "1s")
    with pytest.raises(BadInputError, match="NO_CLUSTER"):
        run_line(
            read_line(line), tmp_path / "out", Workers(scheduler="tcp://127.0.0.1:9"), retry=False, watch=lambda e: None
        )


def test_a_scheduler_without_workers(line, scheduler, tmp_path):
    while True:  # workers of other tests have just left
        with pytest.raises(BadInputError) as caught:
            run_line(read_line(line), tmp_path / "out", Workers(scheduler=scheduler), retry=False, watch=lambda e: None)
        if "no worker" in str(caught.value):
            break
        time.sleep(0.1)
    assert caught.value.issue.code == "NO_CLUSTER"


def test_a_killed_process_below_a_worker_is_that_of_one_job(scheduler, tmp_path):
    with worker(scheduler, tmp_path):
        wait_for(scheduler, 1)
        with cluster.ClusterExecutor(scheduler) as executor:
            lost, good = executor.submit(signal.raise_signal, signal.SIGKILL), executor.submit(abs, -3)
            assert isinstance(lost.exception(), WorkerLostError)
            assert good.result() == 3
