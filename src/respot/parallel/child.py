"""The other end of `respot.parallel.children`: a process that does what it is told, one piece of work after the other.

Messages are pickles: work comes on standard input, results go out on what was standard output. What libraries print
goes to standard error, so that it cannot get between them.
"""

from __future__ import annotations

import gc
import importlib
import os
import pickle
import queue
import signal
import threading
import traceback
from collections.abc import Callable
from typing import Any, BinaryIO

#: Libraries of linear algebra start threads of their own; one process for each core has enough.
_ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


def main() -> None:
    """Read settings, say that all is imported, then work until the input ends."""
    incoming, outgoing = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    preload, memory_mb = pickle.load(incoming)  # noqa: S301 - from the parent alone
    for name in _ONE_THREAD:
        os.putenv(name, "1")
    for module in preload:
        importlib.import_module(module)
    gc.freeze()  # what is imported is no garbage: looking it over after each piece of work takes long
    if memory_mb is not None:
        limit_memory(memory_mb)
    _send(outgoing, (True, None))
    work: queue.Queue[tuple[Callable[..., Any], tuple[Any, ...]]] = queue.Queue()
    threading.Thread(target=_listen, args=(incoming, work), daemon=True).start()
    while True:
        call, arguments = work.get()
        _send(outgoing, _outcome(call, arguments))


def limit_memory(memory_mb: int) -> None:
    """Let the process have no more address space than this, where the system can hold it to that."""
    try:
        import resource
    except ImportError:  # Windows has no such limit
        return
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    wanted = memory_mb * 1024**2
    resource.setrlimit(resource.RLIMIT_AS, (wanted if hard == resource.RLIM_INFINITY else min(wanted, hard), hard))


def _listen(incoming: BinaryIO, work: queue.Queue[Any]) -> None:
    """Queue what comes; where nothing more can come nobody wants the result, and the process ends, whatever it does."""
    while True:
        try:
            message = pickle.load(incoming)  # noqa: S301 - from the parent alone
        except (EOFError, OSError):
            os.kill(os.getpid(), signal.SIGTERM)
            return
        work.put(message)


def _outcome(call: Callable[..., Any], arguments: tuple[Any, ...]) -> tuple[bool, Any]:
    try:
        return True, call(*arguments)
    except BaseException as error:
        error.add_note(traceback.format_exc())
        return False, error


def _send(outgoing: BinaryIO, message: tuple[bool, Any]) -> None:
    try:
        data = pickle.dumps(message, pickle.HIGHEST_PROTOCOL)
    except Exception as error:  # a result, or an exception, that cannot travel
        data = pickle.dumps((False, RuntimeError(f"{type(error).__name__}: {error}; {message[1]!r:.500}")))
    outgoing.write(data)
    outgoing.flush()


if __name__ == "__main__":
    main()
