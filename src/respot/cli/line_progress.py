"""Progress over a line, on stderr: a bar on a terminal, a line a robot elsewhere, an event a line for programs."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import typer

from respot.cli.outcome import printable

if TYPE_CHECKING:
    from respot.line.run import Event


@contextmanager
def line_progress(as_json: bool) -> Iterator[Callable[[Event], None]]:
    """Yield what is to be told of each robot that is through."""
    if as_json:
        yield _event
    elif not sys.stderr.isatty():
        yield lambda event: typer.echo(printable(_line(event)), err=True)
    else:
        from rich.console import Console
        from rich.markup import escape
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

        columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
        with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
            task = bar.add_task("robots", total=None)

            def watch(event: Event) -> None:
                bar.update(task, total=event.total, completed=event.done, description=escape(printable(_pace(event))))
                if event.result.state == "failed":
                    bar.console.print(escape(printable(_line(event))), style="red", highlight=False)

            yield watch


def _event(event: Event) -> None:
    result = event.result
    record = {
        "event": "robot",
        "name": result.name,
        "state": result.state,
        "code": result.code or None,
        "error": result.error or None,
        "spots": result.figures.get("spots"),
        "before": result.figures.get("before"),
        "after": result.figures.get("after"),
        "effects": [effect["name"] for effect in result.effects],
        "done": event.done,
        "total": event.total,
        "seconds": round(event.seconds, 3),
        "robots_per_minute": round(event.per_minute, 3),
        "remaining_seconds": round(event.remaining, 3),
    }
    typer.echo(printable(json.dumps(record, ensure_ascii=False)), err=True)


def _line(event: Event) -> str:
    return f"[{event.done}/{event.total}] {event.result.name} {_said(event)}; {_pace(event)}"


def _said(event: Event) -> str:
    result = event.result
    if result.state == "failed":
        return f"FAILED: {result.code} {result.error}"
    figures = result.figures
    if "spots" not in figures:
        return f"done, {figures['edits']} targets changed"
    found = ", ".join(str(effect["name"]) for effect in result.effects) or "no effect"
    return f"done, {figures['spots']} spots, {figures['before']:.3f} -> {figures['after']:.3f} mm, {found}"


def _pace(event: Event) -> str:
    left = int(event.remaining)
    time_left = f"{left // 3600} h {left % 3600 // 60:02d} min" if left >= 3600 else f"{left // 60}:{left % 60:02d} min"
    return f"{event.per_minute:.1f} robots a minute, {time_left} left"
