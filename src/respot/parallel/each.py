"""Many small pieces of work, one after the other or on all cores, with progress, and clean at an interrupt."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from contextlib import contextmanager
from itertools import islice
from multiprocessing import get_context
from typing import TypeVar

_Item = TypeVar("_Item")
_Result = TypeVar("_Result")

#: Work that waits in a pool for each of its processes: enough to keep them busy, little to throw away.
_AHEAD = 4
#: Below this many items a pool costs more than it gives.
_WORTH_A_POOL = 20


def cores() -> int:
    """Number of processor cores that this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on every system
        return os.cpu_count() or 1


def run_each(work: Callable[[_Item], _Result], items: Sequence[_Item], jobs: int = 1) -> Iterator[tuple[int, _Result]]:
    """Run ``work`` on every item.

    Parameters
    ----------
    work : callable
        A function at the top of a module, so that a process pool finds it.
    items : sequence
        Its arguments.
    jobs : int
        Processes; 1 runs here, one after the other.

    Yields
    ------
    (int, result)
        Position of an item and its result, in the order in which they are done.
    """
    if jobs <= 1 or len(items) < _WORTH_A_POOL:
        for index, item in enumerate(items):
            yield index, work(item)
        return
    # a forked child would inherit locks that other threads hold
    pool = ProcessPoolExecutor(min(jobs, len(items)), mp_context=get_context("spawn"), initializer=_ignore_interrupt)
    try:
        yield from _drain(pool, work, enumerate(items), jobs * _AHEAD)
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _drain(
    pool: ProcessPoolExecutor, work: Callable[[_Item], _Result], items: Iterable[tuple[int, _Item]], ahead: int
) -> Iterator[tuple[int, _Result]]:
    pending: dict[Future[_Result], int] = {}
    queue = iter(items)
    while True:
        for index, item in islice(queue, ahead - len(pending)):
            with _without_interrupt():
                pending[pool.submit(work, item)] = index
        if not pending:
            return
        done, _ = wait(pending, return_when=FIRST_COMPLETED)
        for future in done:
            yield pending.pop(future), future.result()


@contextmanager
def _without_interrupt() -> Iterator[None]:
    """Hold Ctrl-C back while a worker is started: it would hit the worker before it can ignore it.

    The worker inherits the mask. The pool has threads of its own that do not, and through them Ctrl-C would still reach
    this thread between starting a worker and telling it what to do: so the handler waits as well.
    """
    if not hasattr(signal, "pthread_sigmask") or threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []
    handler = signal.signal(signal.SIGINT, lambda number, _: came.append(number))
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        signal.signal(signal.SIGINT, signal.SIG_DFL if handler is None else handler)
        if came:
            signal.raise_signal(signal.SIGINT)


def _ignore_interrupt() -> None:
    """Ignore Ctrl-C in the workers: it reaches the whole group, and the parent ends them."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
