"""Tables and lines for people: rich on a terminal, plain text when piped."""

from __future__ import annotations

import sys
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass

import typer

from respot.cli.outcome import printable


@dataclass(frozen=True)
class Column:
    """A column of a table: its title, and whether it holds numbers."""

    title: str
    number: bool = True


def is_terminal() -> bool:
    """Whether stdout is a terminal."""
    return sys.stdout.isatty()


def terminal_width() -> int:
    """Width of the terminal; without limit when piped."""
    if not is_terminal():
        return 10_000
    from rich.console import Console

    return Console().width


def heading(text: str) -> None:
    """Print a heading."""
    typer.echo()
    typer.secho(printable(text), bold=True)


def line(text: str = "") -> None:
    """Print a line; on a terminal it is wrapped, with its own indent and two more."""
    if is_terminal():
        while text.startswith("\n"):  # wrapping would eat it
            typer.echo()
            text = text[1:]
        indent = " " * (len(text) - len(text.lstrip()) + 2)
        text = textwrap.fill(text, terminal_width(), subsequent_indent=indent, break_on_hyphens=False)
    typer.echo(printable(text))


Branches = Sequence["str | tuple[str, Branches]"]


def tree(title: str, branches: Branches) -> None:
    """Print a tree: each branch is a text, or a text with branches of its own."""
    from rich.console import Console
    from rich.text import Text
    from rich.tree import Tree

    def grow(parent: Tree, children: Branches) -> None:
        for child in children:
            text, below = (child, ()) if isinstance(child, str) else child
            grow(parent.add(Text(printable(text))), below)

    root = Tree(
        Text(printable(title), style="bold" if is_terminal() else ""), guide_style="dim" if is_terminal() else ""
    )
    grow(root, branches)
    Console(width=terminal_width(), soft_wrap=not is_terminal()).print(root)


def table(columns: Sequence[Column], rows: Sequence[Sequence[str]], marked: Sequence[bool] = ()) -> None:
    """Print a table; marked rows stand out on a terminal."""
    if is_terminal():
        _rich(columns, rows, marked)
    else:
        _plain(columns, rows)


def table_width(columns: Sequence[Column], rows: Sequence[Sequence[str]]) -> int:
    """Columns of a terminal that a table takes if nothing is cut."""
    widths = [
        max(len(row[index]) for row in ([column.title for column in columns], *rows)) for index in range(len(columns))
    ]
    return sum(widths) + 3 * len(widths) - 1


def _plain(columns: Sequence[Column], rows: Sequence[Sequence[str]]) -> None:
    cells = [[column.title for column in columns], *rows]
    widths = [max(len(row[index]) for row in cells) for index in range(len(columns))]
    for row in cells:
        parts = [
            cell.rjust(width) if column.number else cell.ljust(width)
            for cell, width, column in zip(row, widths, columns, strict=True)
        ]
        typer.echo(printable("  ".join(parts).rstrip()))


def _rich(columns: Sequence[Column], rows: Sequence[Sequence[str]], marked: Sequence[bool]) -> None:
    from rich import box
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    made = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for column in columns:
        made.add_column(Text(column.title), justify="right" if column.number else "left", no_wrap=True)
    for index, row in enumerate(rows):
        style = "yellow" if index < len(marked) and marked[index] else ""
        made.add_row(*(Text(printable(cell), style=style) for cell in row))
    Console().print(made)
