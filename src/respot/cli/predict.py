"""``respot predict``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from respot.cli import options
from respot.cli.files import holds
from respot.cli.outcome import Outcome
from respot.cli.outcome import run as run_command
from respot.issues import BadInputError

if TYPE_CHECKING:
    from respot.calibration.prediction import Prediction

HELP = (
    "Say where each spot will be in the reference frame, with a 95 % interval. The source may be another program or a "
    "newer backup of the robot that the calibration was fitted to, and then a warning names both; another robot is "
    "refused. ci95 is the radius of the ball around the place that the model would have with perfect measurements, "
    "ci95_new around one new measurement."
)

Stored = Annotated[
    Path, typer.Option("-c", "--calibration", help="Calibration of `respot fit -o`.", show_default=False)
]
AnyRobot = Annotated[
    bool,
    typer.Option("--any-robot", help="Use the calibration though it names another robot: you know it is the same."),
]


def run(
    source: options.Source,
    calibration: Stored,
    covariates: Annotated[
        Path | None,
        typer.Option("--covariates", help="Table of columns that effects follow, joined by ID.", show_default=False),
    ] = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Write the spots as CSV or XLSX.", show_default=False)
    ] = None,
    robot: options.RobotModel = None,
    robot_name: options.RobotName = None,
    spot_id: options.SpotId = None,
    profile: options.Profiles = None,
    any_robot: AnyRobot = False,
    bootstrap: Annotated[
        int,
        typer.Option("--bootstrap", min=0, help="Intervals from this many refits to redrawn residuals (0: none)."),
    ] = 0,
    seed: options.Seed = 0,
    force: options.Force = False,
    as_json: options.AsJson = False,
    strict: options.Strict = False,
) -> None:
    """Run the command."""

    def work() -> Outcome:
        from respot.calibration.prediction import UseOptions, predict_source
        from respot.cli.show_predict import show_prediction
        from respot.kinematics.robot_file import robot_of

        if 0 < bootstrap < 100:
            raise BadInputError("BAD_OPTION", f"--bootstrap {bootstrap} draws tell no 95 %; take 100 or more")
        if output is not None:
            _check(output, force, [path for path in (source, calibration, covariates) if path is not None])
        model = None if robot is None else robot_of(robot)
        chosen = UseOptions(robot_name, spot_id, tuple(profile or ()), model, any_robot)
        predicted = predict_source(source, calibration, chosen, covariates=covariates, bootstrap=bootstrap, seed=seed)
        if output is not None:
            write(output, predicted.prediction)
        data = {
            "kind": predicted.calibration.kind,
            "frame": predicted.calibration.frame,
            "calibration_hash": predicted.calibration.content_hash,
            "intervals": None if predicted.prediction.ci95 is None else "bootstrap" if bootstrap else "covariance",
            "n": len(predicted.prediction.ids),
            "spots": predicted.prediction.to_dict(),
        }
        return Outcome("predict", data, lambda: show_prediction(predicted, output), list(predicted.issues))

    run_command(work, as_json, strict)


def _check(output: Path, force: bool, read: list[Path]) -> None:
    if output.suffix.lower() not in (".csv", ".xlsx"):
        raise BadInputError("BAD_OPTION", "name a table, .csv or .xlsx, with -o", str(output))
    if any(holds(path, output) for path in read if path.is_dir() or path.resolve() == output.resolve()):
        raise BadInputError("OUTPUT_EXISTS", "lies in what is read; name another file with -o", str(output))
    if output.exists() and not force:
        message = "exists; name another file with -o, or replace it with --force"
        raise BadInputError("OUTPUT_EXISTS", message, str(output))


def write(path: Path, prediction: Prediction) -> None:
    """Write a prediction as a spot table; `respot.tables.read_table` reads it back.

    Raises
    ------
    BadInputError
        ``CANNOT_WRITE``; as `respot.tables.write_table`.
    """
    from respot.output.disk import replacing
    from respot.tables import write_table

    rows = prediction.to_dict()
    columns: dict[str, list[str | float | int | None]] = {
        name: [None if row[name] is None else round(float(row[name]), 4) for row in rows]
        for name in ("ci95", "ci95_new", "leverage")
    }
    columns["extrapolated"] = [None if row["extrapolated"] is None else int(row["extrapolated"]) for row in rows]
    with replacing(path) as part:
        write_table(part, prediction.ids, prediction.positions, prediction.rotations, columns=columns)
