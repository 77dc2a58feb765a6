"""``respot inspect``."""

from __future__ import annotations

from respot.cli import options
from respot.cli.outcome import Outcome
from respot.cli.outcome import run as run_command

HELP = "Show the robots, programs, frames and targets of a source."


def run(
    source: options.Source,
    robot_name: options.RobotName = None,
    spot_id: options.SpotId = None,
    as_json: options.AsJson = False,
    strict: options.Strict = False,
) -> None:
    """Run the command."""

    def work() -> Outcome:
        from respot.backups import open_backup
        from respot.cli.show_inspect import show_robots
        from respot.inspection import inspect_robot

        backup = open_backup(source)
        robots = [backup.robot(robot_name)] if robot_name or not backup.robots else list(backup.robots)
        records = [inspect_robot(robot, spot_id) for robot in robots]
        issues = [*backup.issues, *(issue for robot in robots for issue in robot.issues)]
        return Outcome("inspect", {"robots": records}, lambda: show_robots(records), issues)

    run_command(work, as_json, strict)
