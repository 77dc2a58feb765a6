"""All files of a simulated line: the backup of its robot, the tables, the truth."""

from __future__ import annotations

from respot.simulation.krl import kuka_files
from respot.simulation.line import Line
from respot.simulation.programs import templates
from respot.simulation.rapid import abb_files
from respot.simulation.tables import measured_csv, programmed_csv, truth_json


def files_of(line: Line) -> dict[str, bytes]:
    """All files of a line, by their paths: ``backup/...``, tables, robot and truth.

    Raises
    ------
    ValueError
        The backup cannot be written: an ABB robot on a rail.
    """
    backup = {f"backup/{path}": content for path, content in backup_files(line).items()}
    texts = {
        "measured.csv": measured_csv(line),
        "programmed.csv": programmed_csv(line),
        "robot.toml": templates().get_template("robot.toml.j2").render(name=line.robot["name"], robot=line.robot),
        "truth.json": truth_json(line),
    }
    return {**backup, **{path: text.encode("utf-8") for path, text in texts.items()}}


def backup_files(line: Line) -> dict[str, bytes]:
    """Files of the backup of the robot, as its maker's controller writes them.

    Raises
    ------
    ValueError
        An ABB robot on a rail: no backup is written for it.
    """
    return kuka_files(line) if line.robot["maker"] == "kuka" else abb_files(line)
