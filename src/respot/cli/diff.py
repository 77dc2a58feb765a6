"""``respot diff``."""

from __future__ import annotations

import os
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from respot.cli import options
from respot.cli.display import is_terminal
from respot.cli.files import check_free, write_text
from respot.cli.outcome import Outcome
from respot.cli.outcome import run as run_command
from respot.issues import BadInputError

if TYPE_CHECKING:
    from respot.difference import Tolerance

HELP = "Show what changed between two states of a robot: what moved, and whether anything else is different."


class Colour(StrEnum):
    """When code is coloured."""

    AUTO = "auto"
    ALWAYS = "always"
    NEVER = "never"


def run(
    old: Annotated[Path, typer.Argument(help="Old backup (folder or zip) or program.", show_default=False)],
    new: Annotated[Path, typer.Argument(help="New backup or program.", show_default=False)],
    tolerance: Annotated[
        str,
        typer.Option(
            "--tolerance",
            metavar="MM[,DEG]",
            help="Smaller shifts and turns are noise; without DEG the turn that moves the end of a 1 m lever by MM.",
        ),
    ] = "0",
    noise: Annotated[bool, typer.Option("--noise", help="List the noise too, not only its counts.")] = False,
    everything: Annotated[bool, typer.Option("--all", help="Show every row and line, however many.")] = False,
    colour: Annotated[Colour, typer.Option("--color", help="Colour the code.")] = Colour.AUTO,
    html: Annotated[Path | None, typer.Option("--html", help="Write a page to pass on.", show_default=False)] = None,
    force: options.Force = False,
    robot_name: options.RobotName = None,
    profile: options.Profiles = None,
    as_json: options.AsJson = False,
    strict: options.Strict = False,
) -> None:
    """Run the command."""

    def work() -> Outcome:
        from respot.cli.show_diff import Show, show_comparison
        from respot.difference import compare
        from respot.difference.record import as_record
        from respot.languages.profile_file import read_profile

        limits = read_tolerance(tolerance)
        check_free(html, "--html", [old, new], force)
        comparison = compare(old, new, limits, robot_name, [read_profile(path) for path in profile or ()])
        record = as_record(comparison)
        if html is not None:
            from respot.figures.diff_page import diff_page

            told = [issue.as_json() for issue in comparison.issues]
            write_text(html, diff_page(record, tolerance=(limits.mm, limits.deg), issues=told))
        look = Show(noise, everything, is_coloured(colour))
        return Outcome(
            "diff",
            record,
            lambda: show_comparison(record, look),
            list(comparison.issues),
            answer_is_no=not comparison.same,
        )

    run_command(work, as_json, strict)


def is_coloured(colour: Colour) -> bool:
    """Whether to colour: on a terminal, unless ``NO_COLOR`` is set (https://no-color.org)."""
    if colour is Colour.AUTO:
        return is_terminal() and not os.environ.get("NO_COLOR")
    return colour is Colour.ALWAYS


def read_tolerance(text: str) -> Tolerance:
    """Read ``MM[,DEG]``.

    Raises
    ------
    BadInputError
        The text is not one or two numbers of 0 or more.
    """
    from respot.difference import Tolerance

    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in (1, 2) or not all(0.0 <= number < float("inf") for number in numbers):
        raise BadInputError("BAD_OPTION", f"--tolerance is MM or MM,DEG, not {text!r}")
    return Tolerance.of(*numbers)
