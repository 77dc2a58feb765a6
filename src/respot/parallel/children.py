"""A pool of processes of which each does one piece of work at a time, and may be killed for it.

The pool of `concurrent.futures` breaks as a whole when a process dies, does not say which piece of work was to blame,
and cannot end one that takes too long. Here each process belongs to one thread of this process: its death is that of
the work it had, the others go on, and a new process takes its place.
"""

from __future__ import annotations

import pickle
import queue
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, Future
from contextlib import suppress
from typing import Any, ParamSpec, TypeVar

_P = ParamSpec("_P")
_T = TypeVar("_T")
#: A process that closed its end has this long to end by itself, so that its own exit code is known [s].
_TO_END = 5.0


class WorkerLostError(Exception):
    """A process ended while it worked.

    Parameters
    ----------
    code : int
        What it ended with: a positive exit code, or minus the number of the signal that killed it.
    """

    def __init__(self, code: int) -> None:
        self.code = code
        super().__init__(f"its process was killed by signal {-code}" if code < 0 else f"its process ended with {code}")

    def __reduce__(self) -> tuple[type[WorkerLostError], tuple[int]]:
        return WorkerLostError, (self.code,)


class JobTimeoutError(Exception):
    """A piece of work took too long, and was ended.

    Parameters
    ----------
    seconds : float
        How long it was given.
    """

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds
        super().__init__(f"took more than {seconds:g} s")

    def __reduce__(self) -> tuple[type[JobTimeoutError], tuple[float]]:
        return JobTimeoutError, (self.seconds,)


class Child:
    """A process for work of one kind.

    Parameters
    ----------
    preload : sequence of str
        Modules to import before the first work: the time for it counts to none.
    memory_mb : int, optional
        Most address space of the process [MB], where the system can limit it.
    timeout : float, optional
        Longest time for a piece of work [s].
    """

    def __init__(self, preload: Sequence[str] = (), memory_mb: int | None = None, timeout: float | None = None) -> None:
        self._settings = (tuple(preload), memory_mb)
        self._timeout = timeout
        self._process: subprocess.Popen[bytes] | None = None
        self._closed = False

    def call(self, work: Callable[..., _T], *arguments: Any) -> _T:
        """Do a piece of work in the process, which is started if there is none.

        Raises
        ------
        WorkerLostError, JobTimeoutError
            The process died, or was killed since it took too long.
        Exception
            What the work raised.
        """
        if self._process is None:
            self._process = self._started()
        process = self._process
        assert process.stdin is not None  # noqa: S101 - it is a pipe
        timed_out = threading.Event()
        timer = None
        if self._timeout is not None:
            timer = threading.Timer(self._timeout, _end, (process, timed_out))
            timer.daemon = True
            timer.start()
        try:
            with suppress(OSError):  # it is dead: reading says so
                process.stdin.write(pickle.dumps((work, arguments), pickle.HIGHEST_PROTOCOL))
                process.stdin.flush()
            return self._answer(process)  # type: ignore[no-any-return]
        except WorkerLostError:
            if timed_out.is_set() and self._timeout is not None:
                raise JobTimeoutError(self._timeout) from None
            raise
        finally:
            if timer is not None:
                timer.cancel()
                timer.join()
            if timed_out.is_set():  # also where the answer came in the same moment
                self._forget()

    def kill(self) -> None:
        """End the process from any thread, whatever it does; `call` raises where it waits."""
        self._closed = True
        if self._process is not None:
            self._process.kill()

    def close(self) -> None:
        """End the process and clear it away; in the thread that calls."""
        self.kill()
        self._forget()

    def _started(self) -> subprocess.Popen[bytes]:
        # -P: no file of the folder it starts in may pass for a module; a session of its own: Ctrl-C is for the parent
        command = [sys.executable, "-P", "-m", "respot.parallel.child"]
        process = subprocess.Popen(  # noqa: S603 - ourselves
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True
        )
        self._process = process
        if self._closed:
            process.kill()
        assert process.stdin is not None  # noqa: S101 - it is a pipe
        with suppress(OSError):  # it is dead: reading says so
            process.stdin.write(pickle.dumps(self._settings))
            process.stdin.flush()
        self._answer(process)
        return process

    def _answer(self, process: subprocess.Popen[bytes]) -> Any:
        assert process.stdout is not None  # noqa: S101 - it is a pipe
        try:
            good, value = pickle.load(process.stdout)  # noqa: S301 - from our own process
        except (EOFError, OSError, pickle.UnpicklingError):
            try:
                process.wait(_TO_END)
            except subprocess.TimeoutExpired:
                process.kill()
            code = process.wait()
            self._forget()
            raise WorkerLostError(code) from None
        if not good:
            raise value
        return value

    def _forget(self) -> None:
        """Clear a dead process away: the next work starts another."""
        process, self._process = self._process, None
        if process is None:
            return
        process.wait()
        for stream in (process.stdin, process.stdout):
            with suppress(OSError):  # what was left to be written to it
                assert stream is not None  # noqa: S101 - it is a pipe
                stream.close()


def _end(process: subprocess.Popen[bytes], timed_out: threading.Event) -> None:
    timed_out.set()
    process.kill()


class ChildPool(Executor):
    """Processes that do one piece of work at a time each; the death of one is that of its work alone.

    Parameters
    ----------
    processes : int
        How many.
    preload, memory_mb, timeout :
        Of each, as of `Child`.
    """

    def __init__(
        self,
        processes: int,
        preload: Sequence[str] = (),
        memory_mb: int | None = None,
        timeout: float | None = None,
    ) -> None:
        self._queue: queue.SimpleQueue[tuple[Future[Any], Callable[..., Any], tuple[Any, ...]] | None] = (
            queue.SimpleQueue()
        )
        self._children = [Child(preload, memory_mb, timeout) for _ in range(processes)]
        self._threads = [threading.Thread(target=self._serve, args=(child,), daemon=True) for child in self._children]
        self._shut = False
        for thread in self._threads:
            thread.start()

    def submit(self, fn: Callable[_P, _T], /, *args: _P.args, **kwargs: _P.kwargs) -> Future[_T]:
        """Queue a piece of work: a function at the top of a module, and arguments that can be pickled."""
        if kwargs:
            raise TypeError("work takes positional arguments alone")
        if self._shut:
            raise RuntimeError("the pool is shut down")
        future: Future[_T] = Future()
        self._queue.put((future, fn, args))
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the processes: after all that is queued, or at once, in the middle of their work, to cancel it."""
        self._shut = True
        if cancel_futures:
            while not self._queue.empty():
                item = self._queue.get()
                if item is not None:
                    item[0].cancel()
            for child in self._children:
                child.kill()
        for _ in self._threads:
            self._queue.put(None)
        if wait:
            for thread in self._threads:
                thread.join()

    def _serve(self, child: Child) -> None:
        while True:
            item = self._queue.get()
            if item is None:
                child.close()
                return
            future, work, arguments = item
            if not future.set_running_or_notify_cancel():
                continue
            try:
                future.set_result(child.call(work, *arguments))
            except BaseException as error:
                future.set_exception(error)
