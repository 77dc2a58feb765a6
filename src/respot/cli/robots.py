"""``respot robots``."""

from __future__ import annotations

from respot.cli import options
from respot.cli.outcome import Outcome
from respot.cli.outcome import run as run_command

HELP = "List the built-in robots: lengths, where they come from, and what to know about them."


def run(as_json: options.AsJson = False) -> None:
    """Run the command."""

    def work() -> Outcome:
        from respot.cli.show_robots import show_list
        from respot.kinematics.robots import built_in_robots, record_of

        records = [record_of(robot) for robot in built_in_robots().values()]
        return Outcome("robots", {"robots": records}, lambda: show_list(records))

    run_command(work, as_json)
