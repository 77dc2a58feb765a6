"""A bar on stderr while work goes on; nothing where nobody looks at it."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def progress(title: str, *, shown: bool = True) -> Iterator[Callable[[], None]]:
    """Yield a function to call as the work goes on.

    How much there is to do is not known before: the bar says that something moves, and for how long already.

    Parameters
    ----------
    title : str
        What is being done.
    shown : bool
        Whether to show it at all; it is not shown where stderr is no terminal.
    """
    if not shown or not sys.stderr.isatty():
        yield lambda: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    columns = (SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task(title, total=None)
        yield lambda: bar.advance(task)
