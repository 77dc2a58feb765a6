"""``respot convert``."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from respot.cli import options
from respot.cli.fit import effects_named, reference_of
from respot.cli.outcome import Outcome
from respot.cli.outcome import run as run_command
from respot.issues import BadInputError

if TYPE_CHECKING:
    from respot.calibration.source_fit import FitOptions
    from respot.correction.options import CorrectionOptions

HELP = "Write the programs of a backup corrected: proved, reversible, in a new folder."


def run(
    source: options.Source,
    theory: options.Theory = None,
    measured: options.Measured = None,
    calibration: Annotated[
        Path | None, typer.Option("-c", "--calibration", help="A calibration that fit saved.", show_default=False)
    ] = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="New folder for the backup.", show_default=False)
    ] = None,
    method: options.MethodOption = "robust",
    tau: options.Tau = None,
    n_min: options.NMin = None,
    match: options.Match = "auto",
    effects: Annotated[
        str | None,
        typer.Option(
            "--effects",
            help="What to look for beside the rigid part: auto, none, or names with commas, such as "
            "swapped_ids,joint_zero. Without it swapped_ids for --theory, auto for --measured.",
            show_default=False,
        ),
    ] = None,
    inverse: Annotated[
        bool,
        typer.Option(
            "--inverse",
            help="The other way round: simulation programs to the floor with a theory calibration; with a measured one "
            "a compensation is undone.",
        ),
    ] = False,
    apply: Annotated[
        str | None,
        typer.Option(
            "--apply",
            help="points or frames: whether what a whole base or tool is off goes into its data instead of into every "
            "point. The flange goes to the same places. A frame that other programs use stays.",
            show_default="points",
        ),
    ] = None,
    snap: Annotated[
        bool,
        typer.Option(
            "--snap",
            help="Put each weld exactly onto its theoretical position, and blend the path between: for --theory, with "
            "every weld of a program named. Spots no longer keep their distances.",
        ),
    ] = False,
    bases: Annotated[
        str,
        typer.Option(
            "--bases",
            help="kept or remeasured. A tracker that stands anywhere cannot tell a rigid motion of all points under a "
            "base from its own place, so that motion is not written into points (kept); where bases are measured anew "
            "by the tracker it is (remeasured).",
        ),
    ] = "kept",
    frame: options.FrameOption = None,
    robot_name: options.RobotName = None,
    robot: options.RobotModel = None,
    spot_id: options.SpotId = None,
    profile: options.Profiles = None,
    noise: options.Noise = None,
    programs: Annotated[
        str | None, typer.Option("--programs", help="Glob of the programs in scope.", show_default=False)
    ] = None,
    max_shift: Annotated[
        str | None,
        typer.Option(
            "--max-shift",
            help="No target moves further: MM[,DEG]. Without it 150,5 for theory and 10,1 for measured.",
            show_default=False,
        ),
    ] = None,
    max_residual: Annotated[
        float,
        typer.Option("--max-residual", min=0.0, help="No target leaves the rigid motion of its path further, mm."),
    ] = 15.0,
    covariates: Annotated[
        Path | None,
        typer.Option(
            "--covariates", help="Table of columns that effects follow, joined by id; with -c.", show_default=False
        ),
    ] = None,
    keep_config: Annotated[
        bool, typer.Option("--keep-config", help="Keep status/turn and confdata that cannot be computed.")
    ] = False,
    partial: Annotated[
        bool, typer.Option("--partial", help="Correct what can be corrected of a refused program.")
    ] = False,
    templates: Annotated[
        Path | None, typer.Option("--templates", help="Folder of templates laid over ours.", show_default=False)
    ] = None,
    in_place: Annotated[
        bool,
        typer.Option(
            "--in-place", help="Change the backup's own folder; it keeps the originals, `respot undo` restores them."
        ),
    ] = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Do everything but write.")] = False,
    tolerance: options.Tolerance = 10.0,
    seed: options.Seed = 0,
    force: Annotated[
        bool,
        typer.Option(
            "--force",
            help="Replace an output folder that is not empty; use a calibration of another robot, or of another state "
            "of the backup.",
        ),
    ] = False,
    as_json: options.AsJson = False,
    strict: options.Strict = False,
) -> None:
    """Run the command."""

    def work() -> Outcome:
        from respot.correction.options import CorrectionOptions
        from respot.kinematics.robot_file import robot_of

        if method == "affine":
            message = (
                "--method affine stretches and shears the part: 12 free parameters are no rigid motion, and no program "
                "may be corrected by them; use --method robust, or fit --method affine to look at them"
            )
            raise BadInputError("BAD_OPTION", message)
        if bases not in ("kept", "remeasured"):
            raise BadInputError("BAD_OPTION", f"--bases is kept or remeasured, not {bases}")
        if apply not in (None, "points", "frames"):
            raise BadInputError("BAD_OPTION", f"--apply is points or frames, not {apply}")
        if apply == "frames" and partial:
            message = "--partial leaves targets behind, and a base or tool that changes takes all of them along"
            raise BadInputError("BAD_OPTION", f"--apply frames: {message}")
        looked_for = effects_named(effects or ("auto" if measured else "swapped_ids"))
        model = None if robot is None else robot_of(robot)
        chosen = CorrectionOptions(
            programs,
            None if max_shift is None else shift_limits(max_shift),
            keep_config,
            partial,
            templates,
            model,
            inverse,
            "kept" if bases == "kept" else "remeasured",
            max_residual,
            force,
            covariates,
            "frames" if apply == "frames" else "points" if apply == "points" else None,
            snap,
        )
        if calibration is not None:
            if theory or measured:
                raise BadInputError("BAD_OPTION", "give either -c CAL.json or a reference to fit to, not both")
            if (method, tau, n_min, match, effects) != ("robust", None, None, "auto", None):
                message = (
                    "--method, --tau, --n-min, --match and --effects belong to a fit; the calibration of -c is fitted "
                    "already"
                )
                raise BadInputError("BAD_OPTION", message)
            from respot.calibration.source_fit import FitOptions

            fit_options, reference = FitOptions(robot_name=robot_name, spot_id=spot_id), None
        else:
            reference, fit_options = reference_of(
                theory, measured, frame, robot_name, spot_id, noise, seed, method, tau, n_min, match
            )
            if measured:
                fit_options = replace(fit_options, robot=model)
        fit_options = replace(fit_options, profiles=tuple(profile or ()), effects=looked_for)
        return convert_to(
            source, reference, calibration, fit_options, chosen, output, dry_run, force, tolerance, in_place
        )

    run_command(work, as_json, strict)


def convert_to(
    source: Path,
    reference: Path | None,
    calibration: Path | None,
    fit_options: FitOptions,
    chosen: CorrectionOptions,
    output: Path | None,
    dry_run: bool,
    force: bool,
    tolerance: float,
    in_place: bool = False,
) -> Outcome:
    """Convert and write, unless it is a dry run."""
    from respot.cli.show_convert import show_conversion
    from respot.correction.conversion import convert, record_of
    from respot.output import check_in_place, check_output, rehearse, write_backup, write_in_place

    if output is not None and in_place:
        raise BadInputError("BAD_OPTION", "give a new folder with -o OUTDIR, or --in-place, not both")
    if output is None and not in_place and not dry_run:
        message = "give the new folder with -o OUTDIR; or --in-place to change the backup itself, or --dry-run"
        raise BadInputError("BAD_OPTION", message)
    if in_place:
        check_in_place(source)
    if output is not None:
        check_output(
            output, force, [path for path in (source, reference, calibration, chosen.covariates) if path is not None]
        )
    conversion = convert(source, reference, calibration, fit_options, chosen)
    files, correction = conversion.files, conversion.correction
    written = None if dry_run else output
    if dry_run or chosen.templates is not None:  # a plant's template is proved before anything is written
        rehearse(files, correction, chosen.templates)
    if written is not None:
        write_backup(written, files, correction, record_of(conversion), force)
    elif in_place and not dry_run and correction.files and conversion.source.backup is not None:
        written = source
        write_in_place(source, conversion.source.backup.files, files, correction, record_of(conversion))
    data = {
        **conversion.as_json(),
        "verified": True,
        "output": None if written is None else str(written),
        "in_place": in_place and written is not None,
    }
    return Outcome(
        "convert",
        data,
        lambda: show_conversion(conversion, tolerance, written, in_place),
        list(conversion.issues),
        answer_is_no=bool(conversion.correction.refused),
    )


def shift_limits(text: str) -> tuple[float, float | None]:
    """Read ``MM[,DEG]``.

    Raises
    ------
    BadInputError
        The text is not one or two positive numbers.
    """
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in (1, 2) or not all(0.0 <= number < float("inf") for number in numbers):
        raise BadInputError("BAD_OPTION", f"--max-shift is MM or MM,DEG, not {text!r}")
    return numbers[0], numbers[1] if len(numbers) == 2 else None
