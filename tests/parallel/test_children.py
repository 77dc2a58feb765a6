"""A pool whose processes may die, hang or run out of memory: each takes its own piece of work along, and no other."""

from __future__ import annotations

import math
import os
import pickle
import signal
import sys
import time
from concurrent.futures import wait
from pathlib import Path

import pytest

from respot.parallel import ChildPool, JobTimeoutError, SerialExecutor, WorkerLostError, share_of_memory

posix = pytest.mark.skipif(os.name != "posix", reason="signals and limits of POSIX")


def test_results_and_exceptions_come_back():
    with ChildPool(2) as pool:
        good, bad = pool.submit(math.sqrt, 16.0), pool.submit(math.sqrt, -1.0)
        assert good.result() == 4.0
        with pytest.raises(ValueError, match="math domain error"):
            bad.result()


def test_each_process_does_one_piece_after_the_other_and_is_not_this_one():
    with ChildPool(1) as pool:
        first, second = pool.submit(os.getpid), pool.submit(os.getpid)
        assert first.result() == second.result() != os.getpid()


@posix
def test_a_killed_process_takes_its_own_work_along_and_no_other():
    with ChildPool(2) as pool:
        lost = pool.submit(signal.raise_signal, signal.SIGKILL)
        others = [pool.submit(math.sqrt, float(n)) for n in range(20)]
        with pytest.raises(WorkerLostError, match="killed by signal 9") as caught:
            lost.result()
        assert caught.value.code == -9
        assert [future.result() for future in others] == [math.sqrt(n) for n in range(20)]


def test_a_process_that_ends_by_itself_says_how():
    with ChildPool(1) as pool:
        with pytest.raises(WorkerLostError, match="ended with 3"):
            pool.submit(os._exit, 3).result()
        assert pool.submit(math.sqrt, 4.0).result() == 2.0


def test_what_takes_too_long_is_ended_and_the_rest_is_done():
    with ChildPool(1, timeout=0.5) as pool:
        slow, quick = pool.submit(time.sleep, 600), pool.submit(math.sqrt, 4.0)
        with pytest.raises(JobTimeoutError, match=r"more than 0\.5 s"):
            slow.result()
        assert quick.result() == 2.0


@pytest.mark.skipif(sys.platform != "linux", reason="limits of address space hold on Linux")
def test_what_takes_too_much_memory_fails_alone():
    with ChildPool(1, memory_mb=500) as pool:
        with pytest.raises(MemoryError):
            pool.submit(bytearray, 10**9).result()
        assert pool.submit(math.sqrt, 4.0).result() == 2.0


def test_cancelling_ends_work_in_its_middle():
    pool = ChildPool(1)
    running, queued = pool.submit(time.sleep, 600), pool.submit(math.sqrt, 4.0)
    while not running.running():
        time.sleep(0.01)
    pool.shutdown(cancel_futures=True)
    assert queued.cancelled()
    assert isinstance(running.exception(), WorkerLostError)


def test_what_work_prints_does_not_get_between_results(capfd):
    with ChildPool(1) as pool:
        pool.submit(print, "a library talks").result()
        assert pool.submit(math.sqrt, 4.0).result() == 2.0
    assert capfd.readouterr().out == ""


def test_a_result_that_cannot_travel_is_an_error():
    with ChildPool(1) as pool:
        with pytest.raises(RuntimeError, match="pickle"):
            pool.submit(eval, "lambda: 1").result()
        assert pool.submit(math.sqrt, 4.0).result() == 2.0


def is_gone(process: int) -> bool:
    try:
        os.kill(process, 0)
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except (ProcessLookupError, FileNotFoundError):
        return True


@posix
def test_workers_end_with_their_parent(tmp_path):
    import subprocess

    script = (
        "import time, os\nfrom respot.parallel import ChildPool\npool = ChildPool(1)\n"
        f"pool.submit(os.mkdir, {str(tmp_path / 'started')!r}).result()\n"
        "print(pool.submit(os.getpid).result(), flush=True)\npool.submit(time.sleep, 600).result()\n"
    )
    parent = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    worker = int(parent.stdout.readline())
    parent.kill()
    parent.wait()
    parent.stdout.close()
    for _ in range(6000):  # it has slept for the tenth part of its ten minutes by then
        if is_gone(worker):
            break
        time.sleep(0.01)
    assert is_gone(worker)


@pytest.mark.parametrize("error", [WorkerLostError(-9), JobTimeoutError(2.5)])
def test_errors_travel(error):
    again = pickle.loads(pickle.dumps(error))  # noqa: S301 - our own
    assert (str(again), vars(again)) == (str(error), vars(error))


def test_the_serial_executor_keeps_exceptions():
    future = SerialExecutor().submit(math.sqrt, -1.0)
    wait([future])
    assert isinstance(future.exception(), ValueError)


def test_shares_of_memory_add_up_to_no_more_than_there_is():
    one, four = share_of_memory(1), share_of_memory(4)
    assert one is None or (four is not None and 2048 <= four <= one)
