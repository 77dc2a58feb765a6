"""``respot fit``."""

from __future__ import annotations

import shlex
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, TypedDict

import typer

from respot.cli import options
from respot.cli.files import check_free, write_text
from respot.cli.outcome import Outcome
from respot.cli.outcome import run as run_command
from respot.issues import BadInputError

if TYPE_CHECKING:
    from respot.calibration.calibration import Kind
    from respot.calibration.effects.search import Effects
    from respot.calibration.source_fit import FitOptions
    from respot.calibration.spot_fit import Method, Orientations, Weights
    from respot.registration.matching import Matching

HELP = "Fit the spots of a backup to a reference, say what is left and why."


class RigidPart(TypedDict):
    """Options of the rigid part."""

    weights: Weights
    orientations: Orientations


def run(
    source: options.Source,
    theory: options.Theory = None,
    measured: options.Measured = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Save the calibration as JSON.", show_default=False)
    ] = None,
    method: options.MethodOption = "robust",
    tau: options.Tau = None,
    n_min: options.NMin = None,
    match: options.Match = "auto",
    effects: options.EffectsOption = "auto",
    holdout: options.Holdout = None,
    weights: options.WeightsOption = "even",
    orientations: options.OrientationsOption = "compare",
    frame: options.FrameOption = None,
    robot: options.RobotModel = None,
    robot_name: options.RobotName = None,
    spot_id: options.SpotId = None,
    profile: options.Profiles = None,
    noise: options.Noise = None,
    tolerance: options.Tolerance = 10.0,
    report_file: Annotated[
        Path | None, typer.Option("--report", help="Write the result as an HTML page.", show_default=False)
    ] = None,
    seed: options.Seed = 0,
    force: options.Force = False,
    as_json: options.AsJson = False,
    strict: options.Strict = False,
) -> None:
    """Run the command."""

    def work() -> Outcome:
        from respot.calibration.final_model import precise
        from respot.calibration.report import report
        from respot.calibration.source_fit import fit_source
        from respot.cli.progress import progress
        from respot.cli.show_fit import describe, show_fit
        from respot.figures.fit_page import fit_page
        from respot.kinematics.robot_file import robot_of

        reference, chosen = reference_of(
            theory, measured, frame, robot_name, spot_id, noise, seed, method, tau, n_min, match
        )
        chosen = replace(chosen, **rigid_part_of(method, weights, orientations), holdout=holdout_of(holdout))
        looked_for = effects_named(effects)
        if output is not None and method == "affine":
            message = "--method affine is for comparison only and makes no calibration to save: leave -o out"
            raise BadInputError("BAD_OPTION", message)
        inputs = [source, reference, *([chosen.holdout] if isinstance(chosen.holdout, Path) else [])]
        for option, path in (("-o", output), ("--report", report_file)):
            check_free(path, option, inputs, force)
        model = None if robot is None else robot_of(robot)
        chosen = replace(chosen, profiles=tuple(profile or ()), effects=looked_for, robot=model)
        with progress("looking for effects", shown=looked_for != () and not as_json) as step:
            fitted = fit_source(source, reference, replace(chosen, progress=step))
        content_hash = None if method == "affine" else fitted.fit.calibration.content_hash
        data = {**report(fitted.fit), "calibration_hash": content_hash, "seed": seed}
        if output is not None:
            if fitted.fit.rereads_source:
                message = (
                    "its orientations are written in another convention than they are read in, and the calibration is "
                    "fitted to them as they are meant: write the list anew (the message of the effect convention says "
                    "how), then fit and save"
                )
                raise BadInputError("BAD_OPTION", message, str(source))
            write_text(output, precise(fitted.fit).to_json())
        if report_file is not None:
            page = fit_page(
                data,
                title=describe(fitted.source),
                source=str(source),
                reference=str(reference),
                tolerance=tolerance,
                command=shlex.join(["respot", *sys.argv[1:]]),
                issues=[issue.as_json() for issue in fitted.issues],
                seed=seed,
            )
            write_text(report_file, page)
        shown = lambda: show_fit(fitted, data, tolerance, output, report_file)  # noqa: E731
        return Outcome("fit", data, shown, list(fitted.issues))

    run_command(work, as_json, strict)


def holdout_of(text: str | None) -> float | Path | None:
    """Read a fraction, or the name of a table.

    Raises
    ------
    BadInputError
        ``BAD_OPTION`` for what is neither.
    """
    if text is None:
        return None
    try:
        return float(text)
    except ValueError:
        path = Path(text)
    if not Path(text.rpartition("#")[0] or text).exists() and not path.exists():
        message = f"--holdout is a share of the spots, above 0 and up to 0.5, or a spot table; {text!r} is neither"
        raise BadInputError("BAD_OPTION", message)
    return path


def rigid_part_of(method: str, weights: str, orientations: str) -> RigidPart:
    """Read how the rigid part weighs what it is fitted to.

    Raises
    ------
    BadInputError
        ``BAD_OPTION`` for an unknown word, or for words that do not go together.
    """
    all_weights: dict[str, Weights] = {"even": "even", "direction": "direction"}
    if weights not in all_weights:
        raise BadInputError("BAD_OPTION", f"--weights is even or direction, not {weights}")
    ways: dict[str, Orientations] = {"compare": "compare", "fit": "fit"}
    if orientations not in ways:
        raise BadInputError("BAD_OPTION", f"--orientations is compare or fit, not {orientations}")
    if method != "robust" and (weights, orientations) != ("even", "compare"):
        message = f"--weights and --orientations belong to --method robust: {method} has a transform of its own"
        raise BadInputError("BAD_OPTION", message)
    if (weights, orientations) == ("direction", "fit"):
        raise BadInputError("BAD_OPTION", "--weights direction and --orientations fit are two transforms: choose one")
    return {"weights": all_weights[weights], "orientations": ways[orientations]}


def effects_named(text: str) -> Effects:
    """Read ``auto``, ``none`` or names with commas.

    Raises
    ------
    BadInputError
        ``BAD_OPTION`` for a name that no effect has.
    """
    from respot.calibration.causes import names_of
    from respot.registration.errors import RegistrationError

    if text == "auto":
        return "auto"
    names = () if text == "none" else tuple(dict.fromkeys(name.strip() for name in text.split(",")))
    try:
        return names_of(names)
    except RegistrationError as error:
        raise BadInputError("BAD_OPTION", f"--effects is auto, none or names with commas: {error}") from error


def reference_of(
    theory: Path | None,
    measured: Path | None,
    frame: str | None,
    robot_name: str | None,
    spot_id: str | None,
    noise: float | None,
    seed: int,
    method: str = "robust",
    tau: float | None = None,
    n_min: int | None = None,
    match: str = "auto",
) -> tuple[Path, FitOptions]:
    """Return the reference and the options of a fit.

    Raises
    ------
    BadInputError
        Not exactly one of ``--theory`` and ``--measured``, an unknown frame, method or way to match, or an option of a
        method that was not asked for.
    """
    from respot.calibration.source_fit import FitOptions

    reference = theory or measured
    if reference is None or (theory and measured):
        raise BadInputError("BAD_OPTION", "give either --theory REF or --measured REF: it decides what the fit means")
    frames: dict[str | None, Literal["same", "free"] | None] = {None: None, "same": "same", "free": "free"}
    if frame not in frames:
        raise BadInputError("BAD_OPTION", f"--frame is same or free, not {frame}")
    methods: dict[str, Method] = {"robust": "robust", "paper": "paper", "affine": "affine"}
    if method not in methods:
        raise BadInputError("BAD_OPTION", f"--method is robust, paper or affine, not {method}")
    if method != "paper" and (tau is not None or n_min is not None):
        raise BadInputError("BAD_OPTION", "--tau and --n-min belong to the paper's method: add --method paper")
    ways: dict[str, Matching] = {"auto": "auto", "id": "id", "geometry": "geometry"}
    if match not in ways:
        raise BadInputError("BAD_OPTION", f"--match is auto, id or geometry, not {match}")
    kind: Kind = "theory" if theory else "measured"
    return reference, FitOptions(
        kind, frames[frame], robot_name, spot_id, noise, seed, methods[method], tau, n_min, ways[match]
    )
