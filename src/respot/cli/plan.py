"""``respot plan``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from respot.cli import options
from respot.cli.outcome import Outcome
from respot.cli.outcome import run as run_command
from respot.cli.predict import AnyRobot, Stored

HELP = (
    "Say which further spots to measure: those that tell the effects of a calibration from their rivals, and beside "
    "that make it surer; in which order, what each buys, and what no spot of the program can tell. Nothing is written."
)


def run(
    source: options.Source,
    calibration: Stored,
    count: Annotated[int, typer.Option("--count", min=1, help="How many spots can be measured.", show_default=False)],
    covariates: Annotated[
        Path | None,
        typer.Option(
            "--covariates",
            help="Table of columns that effects follow, as they will be when the spots are measured; joined by ID.",
            show_default=False,
        ),
    ] = None,
    robot: options.RobotModel = None,
    robot_name: options.RobotName = None,
    spot_id: options.SpotId = None,
    profile: options.Profiles = None,
    any_robot: AnyRobot = False,
    as_json: options.AsJson = False,
    strict: options.Strict = False,
) -> None:
    """Run the command."""

    def work() -> Outcome:
        from respot.calibration.planning import plan_source
        from respot.calibration.prediction import UseOptions
        from respot.cli.show_plan import show_plan
        from respot.kinematics.robot_file import robot_of

        model = None if robot is None else robot_of(robot)
        chosen = UseOptions(robot_name, spot_id, tuple(profile or ()), model, any_robot)
        found = plan_source(source, calibration, count, chosen, covariates=covariates)
        data = {"calibration_hash": found.calibration.content_hash, "count": count, **found.plan.to_dict()}
        return Outcome("plan", data, lambda: show_plan(found), list(found.issues))

    run_command(work, as_json, strict)
