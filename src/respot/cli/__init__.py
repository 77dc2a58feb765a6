"""The command line: one file a command, each thin: parse arguments, call one function, print one `Outcome`.

Nothing heavy is imported before a command runs, so that ``--help`` and completion stay quick.
"""

from __future__ import annotations

from typing import Annotated

import typer

from respot import __version__
from respot.cli import (
    check,
    convert,
    demo,
    diff,
    fit,
    inspect,
    migrate,
    plan,
    predict,
    robots,
    simulate,
    undo,
    validate,
)

app = typer.Typer(
    name="respot",
    help="From legacy KUKA and ABB backups to calibrated, production-ready robot programs.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
_COMMANDS = {
    "demo": demo,
    "inspect": inspect,
    "fit": fit,
    "predict": predict,
    "validate": validate,
    "plan": plan,
    "convert": convert,
    "undo": undo,
    "diff": diff,
    "migrate": migrate,
    "check": check,
    "robots": robots,
    "simulate": simulate,
}
for name, command in _COMMANDS.items():
    app.command(name, help=command.HELP)(command.run)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"respot {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    pass


def main() -> None:
    """Run the command line."""
    app()
