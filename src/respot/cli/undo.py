"""``respot undo``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from respot.cli import options
from respot.cli.outcome import Outcome
from respot.cli.outcome import run as run_command

if TYPE_CHECKING:
    from respot.output import Undone

HELP = "Take a conversion back: originals return byte for byte, or a folder that respot wrote goes."


def run(
    folder: Annotated[
        Path,
        typer.Argument(help="Folder that convert changed in place, or wrote; or its respot.json.", show_default=False),
    ],
    force: Annotated[
        bool,
        typer.Option(
            "--force",
            help="Bring originals back over files that were changed since, which are set aside; remove a folder whose "
            "source is gone.",
        ),
    ] = False,
    as_json: options.AsJson = False,
    strict: options.Strict = False,
) -> None:
    """Run the command."""

    def work() -> Outcome:
        from respot.output import undo

        done = undo(folder, force)
        return Outcome("undo", done.as_json(), lambda: _show(done), list(done.issues))

    run_command(work, as_json, strict)


def _show(done: Undone) -> None:
    from respot.cli.display import line

    if done.kind == "cut_short":
        line(f"{done.folder}: a run was cut short; the folder is back as it was before it")
    elif done.kind == "folder":
        line(
            f"{done.folder}: removed, all {len(done.removed)} files as respot wrote them; its source was never changed"
        )
    else:
        line(f"{done.folder}: {len(done.restored)} files are the originals again, byte for byte")
        for path in done.restored:
            line(f"  {path}")
    if done.left:
        line(f"  {done.left} earlier conversions in place can still be taken back, the last one first")
