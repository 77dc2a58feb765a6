"""Executors: the same work one after the other, on all cores, or on other machines.

`run_each` is for many small pieces of which none is expected to fail. The executors, with the interface of
`concurrent.futures` (`SerialExecutor`, `ChildPool`, `respot.parallel.cluster`), are for few large ones: each may fail,
hang, take all memory or lose its process, and must not take the others along.
"""

from respot.parallel.children import Child, ChildPool, JobTimeoutError, WorkerLostError
from respot.parallel.each import cores, run_each
from respot.parallel.memory import share_of_memory
from respot.parallel.serial import SerialExecutor

__all__ = [
    "Child",
    "ChildPool",
    "JobTimeoutError",
    "SerialExecutor",
    "WorkerLostError",
    "cores",
    "run_each",
    "share_of_memory",
]
