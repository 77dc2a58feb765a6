"""``respot inspect``."""

from __future__ import annotations

from typing import Annotated

import typer

from respot.cli import options
from respot.cli.outcome import Outcome
from respot.cli.outcome import run as run_command

HELP = "Show the robots, programs, frames and targets of a source."


def run(
    source: options.Source,
    robot_name: options.RobotName = None,
    spot_id: options.SpotId = None,
    profile: options.Profiles = None,
    forms: Annotated[
        bool, typer.Option("--forms", help="Compare the copies in every inline form, however many there are.")
    ] = False,
    as_json: options.AsJson = False,
    strict: options.Strict = False,
) -> None:
    """Run the command."""

    def work() -> Outcome:
        from respot.backups import open_backup
        from respot.cli.show_inspect import show_robots, show_table
        from respot.inspection import form_issues, inspect_robot, inspect_table
        from respot.languages.profile_file import read_profile
        from respot.spots import is_backup, spots_of_robot
        from respot.tables import read_table

        if not is_backup(source):
            table = read_table(source)
            made = inspect_table(table)
            return Outcome("inspect", {"robots": [], "table": made}, lambda: show_table(made), list(table.issues))
        backup = open_backup(source, [read_profile(path) for path in profile or ()])
        robots = [backup.robot(robot_name)] if robot_name or not backup.robots else list(backup.robots)
        spots = [spots_of_robot(robot, (), spot_id) for robot in robots]
        records = [inspect_robot(robot, own) for robot, own in zip(robots, spots, strict=True)]
        issues = [*backup.issues, *(issue for robot in robots for issue in robot.issues)]
        issues += [issue for own in spots for issue in own.issues]
        issues += [issue for robot in robots for issue in form_issues(robot, forms)]
        return Outcome("inspect", {"robots": records}, lambda: show_robots(records), list(dict.fromkeys(issues)))

    run_command(work, as_json, strict)
