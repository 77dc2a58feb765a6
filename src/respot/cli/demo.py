"""``respot demo``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from respot.cli import options
from respot.cli.outcome import Outcome
from respot.cli.outcome import run as run_command

HELP = "Convert the rear-door samples, a KUKA and an ABB backup, and show the result and the commands."

ROBOTS = ("kuka", "abb")


def run(
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder for the converted backups.")] = Path(
        "respot-demo"
    ),
    as_json: options.AsJson = False,
) -> None:
    """Run the command."""
    commands: list[str] = []

    def work() -> Outcome:
        from respot.calibration.source_fit import FitOptions
        from respot.cli.convert import convert_to
        from respot.correction.options import CorrectionOptions
        from respot.resources import resource

        _check(output)
        door = _shown(resource("samples", "rear_door"))
        theory = door / "theory.csv"
        outcomes = []
        for robot in ROBOTS:
            commands.append(f"respot convert {door / robot} --theory {theory} -o {output / robot}")
            outcomes.append(
                convert_to(
                    door / robot, theory, None, FitOptions(), CorrectionOptions(), output / robot, False, True, 10.0
                )
            )

        def show() -> None:
            for command, outcome in zip(commands, outcomes, strict=True):
                typer.secho(f"\n$ {command}", fg=typer.colors.CYAN, bold=True)
                outcome.show()
            typer.echo("\nThese two commands made it; try them on your own backup:")
            for command in commands:
                typer.echo(f"  {command}")

        data = {robot: outcome.data for robot, outcome in zip(ROBOTS, outcomes, strict=True)}
        issues = [issue for outcome in outcomes for issue in outcome.issues]
        refused = any(outcome.answer_is_no for outcome in outcomes)
        return Outcome("demo", {**data, "commands": commands}, show, issues, answer_is_no=refused)

    run_command(work, as_json)


def _check(output: Path) -> None:
    """A folder of an earlier demo may be replaced, no other."""
    from respot.correction.conversion import RECORD
    from respot.output import check_output

    if output.is_dir():
        ours = all((output / robot / RECORD).is_file() for robot in ROBOTS)
        if ours and {path.name for path in output.iterdir()} == set(ROBOTS):
            return
    check_output(output, force=False)


def _shown(path: Path) -> Path:
    """The path from here, where it is below here."""
    try:
        return path.relative_to(Path.cwd())
    except ValueError:
        return path
