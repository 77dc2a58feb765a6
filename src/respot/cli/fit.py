"""``respot fit``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from respot.cli import options
from respot.cli.outcome import Outcome
from respot.cli.outcome import run as run_command
from respot.issues import BadInputError

if TYPE_CHECKING:
    from respot.calibration.source_fit import FitOptions

HELP = "Fit the spots of a backup to a reference, say what is left and why."


def run(
    source: options.Source,
    theory: options.Theory = None,
    measured: options.Measured = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Save the calibration as JSON.", show_default=False)
    ] = None,
    frame: options.FrameOption = None,
    robot_name: options.RobotName = None,
    spot_id: options.SpotId = None,
    noise: options.Noise = None,
    tolerance: options.Tolerance = 10.0,
    seed: options.Seed = 0,
    force: options.Force = False,
    as_json: options.AsJson = False,
    strict: options.Strict = False,
) -> None:
    """Run the command."""

    def work() -> Outcome:
        from respot.calibration.report import report
        from respot.calibration.source_fit import fit_source
        from respot.cli.show_fit import show_fit

        reference, chosen = reference_of(theory, measured, frame, robot_name, spot_id, noise, seed)
        if output is not None and output.exists() and not force:
            raise BadInputError(
                "OUTPUT_EXISTS", "exists; name another file with -o, or replace it with --force", str(output)
            )
        if output is not None and any(holds(path, output) for path in (source, reference)):
            message = "lies in the source or the reference; name another file with -o"
            raise BadInputError("OUTPUT_EXISTS", message, str(output))
        fitted = fit_source(source, reference, chosen)
        if output is not None:
            try:
                fitted.fit.calibration.save(output)
            except OSError as error:
                raise BadInputError("CANNOT_READ", f"cannot be written: {error.strerror}", str(output)) from error
        data = {**report(fitted.fit), "calibration_hash": fitted.fit.calibration.content_hash}
        return Outcome("fit", data, lambda: show_fit(fitted, tolerance, output), list(fitted.issues))

    run_command(work, as_json, strict)


def holds(source: Path, output: Path) -> bool:
    """Whether writing ``output`` would change ``source``: it is the same file, or the source is a folder around it."""
    own, other = source.resolve(), output.resolve()
    return own == other or own in other.parents or own.with_suffix("") == other.with_suffix("")


def reference_of(
    theory: Path | None,
    measured: Path | None,
    frame: str | None,
    robot_name: str | None,
    spot_id: str | None,
    noise: float | None,
    seed: int,
) -> tuple[Path, FitOptions]:
    """Return the reference and the options of a fit.

    Raises
    ------
    BadInputError
        Not exactly one of ``--theory`` and ``--measured``, or an unknown frame.
    """
    from respot.calibration.source_fit import FitOptions

    reference = theory or measured
    if reference is None or (theory and measured):
        raise BadInputError("BAD_OPTION", "give either --theory REF or --measured REF: it decides what the fit means")
    frames: dict[str | None, Literal["same", "free"] | None] = {None: None, "same": "same", "free": "free"}
    if frame not in frames:
        raise BadInputError("BAD_OPTION", f"--frame is same or free, not {frame}")
    return reference, FitOptions("theory" if theory else "measured", frames[frame], robot_name, spot_id, noise, seed)
