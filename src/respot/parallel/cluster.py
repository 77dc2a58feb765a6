"""The executor of a Dask cluster: where one machine is not enough.

Each worker thread has a `Child` of its own, so that work is limited in time and memory there as it is here. What a lost
worker had goes to another one, a few times; then it is the work that is to blame.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import CancelledError, Executor, Future
from typing import Any, ParamSpec, TypeVar

from respot import __version__
from respot.issues import BadInputError
from respot.parallel.children import Child, WorkerLostError

_P = ParamSpec("_P")
_T = TypeVar("_T")
_Settings = tuple[tuple[str, ...], int | None, float | None]
_ANSWERS_WITHIN = "20s"
_local = threading.local()


class ClusterExecutor(Executor):
    """Runs work on the workers of a Dask scheduler.

    Parameters
    ----------
    address : str
        Of the scheduler, such as ``tcp://planning7:8786``.
    preload, memory_mb, timeout :
        Of the process that works, as of `Child`.

    Raises
    ------
    BadInputError
        ``NO_CLUSTER``: dask.distributed is not installed, nobody answers, there is no worker, or a worker has another
        respot.
    """

    def __init__(
        self,
        address: str,
        preload: tuple[str, ...] = (),
        memory_mb: int | None = None,
        timeout: float | None = None,
    ) -> None:
        self._settings = (preload, memory_mb, timeout)
        self._client = _client_of(address)
        try:
            versions = self._client.run(_version)
        except Exception as error:
            self._client.close()
            message = f"its workers cannot import respot {__version__}: install it there too ({error})"
            raise BadInputError("NO_CLUSTER", message, address) from error
        strangers = sorted({version for version in versions.values() if version != __version__})
        if not versions or strangers:
            self._client.close()
            message = (
                f"has workers with respot {', '.join(strangers)}, and this is {__version__}: install one everywhere"
                if strangers
                else "has no worker: start some with `dask worker ADDRESS --nthreads 1`"
            )
            raise BadInputError("NO_CLUSTER", message, address)
        self._executor = self._client.get_executor(pure=False)

    @property
    def threads(self) -> int:
        """Pieces of work that the cluster does at once."""
        return max(1, sum(int(number) for number in self._client.nthreads().values()))

    def on_each_worker(self, question: Callable[..., Any], *arguments: Any) -> dict[str, Any]:
        """Ask each worker something, by its address."""
        return dict(self._client.run(question, *arguments))

    def submit(self, fn: Callable[_P, _T], /, *args: _P.args, **kwargs: _P.kwargs) -> Future[_T]:
        """Queue a piece of work: a function at the top of a module, and arguments that can be pickled."""
        if kwargs:
            raise TypeError("work takes positional arguments alone")
        outer: Future[_T] = Future()
        inner: Future[_T] = self._executor.submit(_in_a_child, self._settings, fn, *args)

        def pass_on(done: Future[_T]) -> None:
            try:
                outer.set_result(done.result())
            except CancelledError as error:
                outer.set_exception(ConnectionError(f"the scheduler no longer knows of it: {error}"))
            except BaseException as error:
                outer.set_exception(_plain(error))

        inner.add_done_callback(pass_on)
        return outer

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Let the scheduler go; what is not done is given up there."""
        del wait, cancel_futures
        self._client.close()


def _client_of(address: str) -> Any:
    try:
        from distributed import Client
    except ImportError as error:
        message = "--scheduler needs dask.distributed: pip install 'respot[cluster]'"
        raise BadInputError("NO_CLUSTER", message) from error
    try:
        return Client(address, timeout=_ANSWERS_WITHIN, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        raise BadInputError("NO_CLUSTER", f"no scheduler answers there: {error}", address) from error


def _version() -> str:
    return __version__


def _in_a_child(
    settings: tuple[tuple[str, ...], int | None, float | None], work: Callable[..., Any], *args: Any
) -> Any:
    """Do work on a worker, in the process that belongs to this thread of it."""
    if getattr(_local, "settings", None) != settings:
        if hasattr(_local, "child"):
            _local.child.close()
        _local.settings, _local.child = settings, Child(*settings)
    return _local.child.call(work, *args)


def _plain(error: BaseException) -> BaseException:
    """What lost workers mean here: Dask has tried others in vain."""
    return WorkerLostError(-9) if type(error).__name__ == "KilledWorker" else error
