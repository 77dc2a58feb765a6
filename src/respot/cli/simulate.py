"""``respot simulate``."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any

import typer

from respot.cli import options
from respot.cli.outcome import Outcome
from respot.cli.outcome import run as run_command
from respot.issues import BadInputError

HELP = "Make a line with hidden effects to practise on: a backup, a measured table, and the truth in a file apart."
_ROBOT = "kr210_r2700_extra"


def run(
    outdir: Annotated[Path, typer.Argument(help="New folder for the line.", show_default=False)],
    robot: Annotated[
        str, typer.Option("--robot", help="One of the robots that can be simulated; a wrong name lists them.")
    ] = _ROBOT,
    spots: Annotated[int, typer.Option("--spots", min=8, max=5000, help="How many weld spots.")] = 120,
    noise: Annotated[float, typer.Option("--noise", min=0.0, help="Noise of the tracker per coordinate, mm.")] = 0.1,
    effect: Annotated[
        list[str] | None,
        typer.Option(
            "--effect",
            help="NAME[@PLACE][:SIZE], such as tip_wear or joint_zero@3:0.8: SIZE is the RMS that it leaves after the "
            "best rigid fit, mm (default 1). May repeat.",
            show_default=False,
        ),
    ] = None,
    seed: options.Seed = 0,
    layout: Annotated[
        str,
        typer.Option(
            "--layout",
            help="easy, or hard: stations in clusters, time in path order, noise not the same along all axes.",
        ),
    ] = "easy",
    rail: Annotated[bool, typer.Option("--rail", help="The robot travels on a rail.")] = False,
    line_of: Annotated[
        int | None,
        typer.Option(
            "--line",
            min=8,
            max=5000,
            help="A line of this many robots for respot migrate, KUKA and ABB, of which three go wrong.",
            show_default=False,
        ),
    ] = None,
    as_json: options.AsJson = False,
) -> None:
    """Run the command."""

    def work() -> Outcome:
        from respot.simulation import files_of, plant_files, simulate

        _check(outdir)
        if line_of is not None:
            if effect or rail or layout != "easy" or robot != _ROBOT:
                message = "--robot, --effect, --layout and --rail are of one robot; those of a --line are drawn"
                raise BadInputError("BAD_OPTION", message)
            _write(outdir, plant_files(line_of, spots, noise, seed))
            return _line_made(outdir, line_of, spots, noise, seed)
        try:
            line = simulate(robot, spots, noise, effect or (), seed, layout, rail=rail)
            files = files_of(line)
        except ValueError as error:
            raise BadInputError("BAD_OPTION", str(error)) from error
        _write(outdir, files.items())
        data: dict[str, Any] = {
            "folder": str(outdir),
            "robot": robot,
            "spots": spots,
            "noise": noise,
            "seed": seed,
            "layout": layout,
            "files": sorted(files),
        }

        def show() -> None:
            typer.echo(f"{outdir}: {spots} spots, noise {noise:g} mm per coordinate, seed {seed}")
            typer.echo("  backup/         what the robot has: programs, frames, machine data")
            typer.echo("  programmed.csv  the same spots as a table, with joints")
            typer.echo(
                "  measured.csv    where they really are, in the tracker's own frame, and what the plant recorded"
            )
            typer.echo("  robot.toml      the robot's nominal lengths")
            typer.echo("  truth.json      what is hidden: look last")
            typer.echo("\nFind it with:")
            typer.echo(f"  respot fit {outdir / 'backup'} --measured {outdir / 'measured.csv'} --noise {noise:g}")

        return Outcome("simulate", data, show)

    run_command(work, as_json)


def _line_made(outdir: Path, robots: int, spots: int, noise: float, seed: int) -> Outcome:
    data = {"folder": str(outdir), "robots": robots, "spots": spots, "noise": noise, "seed": seed}

    def show() -> None:
        typer.echo(f"{outdir}: {robots} robots of about {spots} spots, noise {noise:g} mm per coordinate, seed {seed}")
        typer.echo("  line.toml    the robots, their backups and references")
        typer.echo("  backups/     what each robot has, as a folder or a zip; two are broken")
        typer.echo("  references/  where the spots should be, or really went; one is of other spots")
        typer.echo("  truth.json   what is hidden: look last")
        typer.echo("\nDo the whole line with:")
        typer.echo(f"  respot migrate {outdir / 'line.toml'} -o {outdir.with_name(outdir.name + '_done')}")

    return Outcome("simulate", data, show)


def _check(folder: Path) -> None:
    """Refuse a folder that holds anything."""
    if folder.is_symlink() or (folder.exists() and not folder.is_dir()):
        raise BadInputError("OUTPUT_EXISTS", "is not a folder; name another one", str(folder))
    if folder.is_dir() and any(folder.iterdir()):
        raise BadInputError("OUTPUT_EXISTS", "exists and is not empty; name a new folder", str(folder))


def _write(folder: Path, files: Iterable[tuple[str, bytes]]) -> None:
    """Write all files or none: beside the folder first, then in one step into place."""
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        staging = Path(tempfile.mkdtemp(prefix=f".{folder.name}-", dir=folder.parent))
    except OSError as error:
        raise _cannot(folder, error) from error
    try:
        for path, content in files:
            target = staging / "line" / path
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(content)
        if folder.is_dir():
            folder.rmdir()
        (staging / "line").rename(folder)
    except OSError as error:
        raise _cannot(folder, error) from error
    finally:
        shutil.rmtree(staging, ignore_errors=True)


def _cannot(folder: Path, error: OSError) -> BadInputError:
    return BadInputError("CANNOT_WRITE", f"cannot be written: {error.strerror or error}", str(folder))
