"""``respot validate``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from respot.cli import options
from respot.cli.outcome import Outcome
from respot.cli.outcome import run as run_command
from respot.cli.predict import AnyRobot, Stored
from respot.issues import BadInputError

if TYPE_CHECKING:
    from respot.calibration.calibration import Kind

HELP = (
    "Hold fresh measurements against a stored calibration: which spots are out of tolerance (exit 1), and is the error "
    "that the fit promised kept. Nothing is fitted, and names are taken as they are."
)


def run(
    source: options.Source,
    calibration: Stored,
    theory: options.Theory = None,
    measured: options.Measured = None,
    tolerance: options.Tolerance = 10.0,
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
        from respot.calibration.prediction import UseOptions
        from respot.calibration.validation import validate_source
        from respot.cli.show_validate import show_validation
        from respot.kinematics.robot_file import robot_of

        reference = theory or measured
        if reference is None or (theory and measured):
            message = "give either --theory REF or --measured REF: the kind that the calibration was fitted with"
            raise BadInputError("BAD_OPTION", message)
        kind: Kind = "theory" if theory else "measured"
        model = None if robot is None else robot_of(robot)
        chosen = UseOptions(robot_name, spot_id, tuple(profile or ()), model, any_robot)
        found = validate_source(source, reference, calibration, kind, chosen, tolerance)
        data = {"kind": kind, "calibration_hash": found.calibration.content_hash, **found.validation.to_dict()}
        return Outcome(
            "validate",
            data,
            lambda: show_validation(found),
            list(found.issues),
            answer_is_no=bool(found.validation.out_of_tolerance),
        )

    run_command(work, as_json, strict)
