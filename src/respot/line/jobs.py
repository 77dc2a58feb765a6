"""The work on one robot, as a value that can be hashed, sent to another process, and compared with what was done."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from respot import __version__
from respot.line.inputs import input_hash, option_hash
from respot.line.line_file import LineFile, LineRobot
from respot.line.settings import FILES


@dataclass(frozen=True)
class Job:
    """What is to be done for a robot, and the state of what it is made of.

    Parameters
    ----------
    robot : LineRobot
        The robot.
    folder : str
        Folder of the line file: what paths are relative to.
    inputs : sequence of str
        Files and folders that the result depends on.
    input_hash, option_hash : str
        Of their bytes, and of the options.
    """

    robot: LineRobot
    folder: str
    inputs: Sequence[str]
    input_hash: str
    option_hash: str

    @property
    def name(self) -> str:
        """Name of the robot."""
        return self.robot.name

    @property
    def identity(self) -> tuple[str, str, str]:
        """What the result depends on; another one asks for the work again."""
        return self.input_hash, self.option_hash, __version__


@dataclass(frozen=True)
class JobResult:
    """What came of a job: plain values that can be sent and stored.

    Parameters
    ----------
    name : str
        The robot.
    state : str
        ``"done"`` or ``"failed"``.
    code, error : str
        Why it failed.
    details : str
        For whoever looks for a fault of ours; for no file that is compared.
    figures : mapping
        What line summaries show: kind, language, model, spots, before, after ...
    effects, edits : sequence of mapping
        As in the JSON of fit and convert.
    outputs : mapping of str to (str, int)
        Hash and size of each file of its folder, by path.
    cpu_seconds : float
        What it took.
    made : str
        Name of the folder that holds what was written, among those of all attempts.
    files : mapping of str to bytes, optional
        The folder itself, where the worker cannot write it.
    """

    name: str
    state: str
    code: str = ""
    error: str = ""
    details: str = ""
    figures: Mapping[str, Any] = field(default_factory=dict)
    effects: Sequence[Mapping[str, Any]] = ()
    edits: Sequence[Mapping[str, Any]] = ()
    outputs: Mapping[str, tuple[str, int]] = field(default_factory=dict)
    cpu_seconds: float = 0.0
    made: str = ""
    files: Mapping[str, bytes] | None = None


def job_of(line: LineFile, robot: LineRobot) -> Job:
    """Job of a robot, with the state of its inputs as they are now."""
    inputs = _inputs(robot)
    decided = {"source": robot.source, "kind": robot.kind, "reference": robot.reference}
    options = {**robot.options, **decided, "calibration": robot.calibration}
    return Job(robot, str(line.folder), inputs, input_hash(line.folder, inputs), option_hash(options))


def inputs_changed(job: Job) -> bool:
    """Whether the inputs are no longer what they were when the job was made."""
    return input_hash(Path(job.folder), job.inputs) != job.input_hash


def _inputs(robot: LineRobot) -> list[str]:
    paths = [robot.source, robot.reference, robot.calibration]
    for key in FILES:
        value = robot.options.get(key)
        paths += value if isinstance(value, list) else [value if isinstance(value, str) else None]
    return [path for path in dict.fromkeys(paths) if path is not None]
