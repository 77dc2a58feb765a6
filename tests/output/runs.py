"""Backups that are converted, killed and taken back, and the warmed process that does it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from typer.testing import CliRunner

from respot.calibration.calibration import Calibration
from respot.cli import app
from tests.correction.small import SHIFT, SPOTS, TURN

DRIVER = Path(__file__).parent / "driver.py"
SAMPLES = Path(__file__).parents[2] / "samples" / "rear_door"


@dataclass(frozen=True)
class Ended:
    """How a run ended."""

    code: int
    out: str
    err: str
    seconds: float
    begun: float | None
    steps: list[str] = field(default_factory=list)
    left: list[str] = field(default_factory=list)
    mounted: bool = False

    @property
    def killed(self) -> bool:
        return self.code == -9

    @property
    def json(self) -> dict:
        return json.loads(self.out)


class Runner:
    """Runs respot in children of one warmed process."""

    def __init__(self, process: subprocess.Popen, folder: Path) -> None:
        self._process = process
        self._folder = folder

    def __call__(self, *arguments: object, **how: object) -> Ended:
        request = {"arguments": [str(argument) for argument in arguments], "folder": str(self._folder), **how}
        self._process.stdin.write(json.dumps(request) + "\n")
        self._process.stdin.flush()
        answer = json.loads(self._process.stdout.readline())
        return Ended(**{name: value for name, value in answer.items() if name in Ended.__dataclass_fields__})


@contextmanager
def warmed(*warm: object) -> Iterator[subprocess.Popen]:
    """Start the driver; ``warm`` is a command that imports and caches what later ones need."""
    import respot

    path = os.pathsep.join([str(Path(respot.__file__).parents[1]), str(Path(__file__).parents[2])])
    process = subprocess.Popen(
        [sys.executable, str(DRIVER)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": path, "OPENBLAS_NUM_THREADS": "1", "PYTHONDONTWRITEBYTECODE": "1"},
    )
    try:
        process.stdin.write(json.dumps({"warm": True, "arguments": [str(argument) for argument in warm]}) + "\n")
        process.stdin.flush()
        assert json.loads(process.stdout.readline()) == {"code": 0}
        yield process
    finally:
        process.stdin.close()
        process.wait(timeout=60)
        process.stdout.close()


def write(folder: Path, files: dict[str, str]) -> Path:
    for path, text in files.items():
        place = folder / path
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_bytes(text.replace("\n", "\r\n").encode("latin-1"))
    return folder


def calibration(path: Path, further: float = 0.0) -> Path:
    """A calibration of the small backups; another one for each ``further``."""
    Calibration(TURN, SHIFT + further, "theory", "same", tuple(SPOTS)).save(path)
    return path


#: A file as it lies on the disk: bytes, rights, time of the last change in nanoseconds.
State = dict[str, tuple[bytes, int, int]]


def state(folder: Path, times: bool = True) -> State:
    """Everything that lies in a folder; a folder in it has no bytes."""
    found = {}
    for path in sorted(folder.rglob("*")):
        about = path.stat()
        data = b"" if path.is_dir() else path.read_bytes()
        found[path.relative_to(folder).as_posix()] = (data, about.st_mode, about.st_mtime_ns if times else 0)
    return found


@dataclass(frozen=True)
class Result:
    """What a command in this process said."""

    code: int
    out: str
    err: str

    @property
    def json(self) -> dict:
        return json.loads(self.out)


CLI = Callable[..., Result]


def in_process(*arguments: object) -> Result:
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    return Result(result.exit_code, result.stdout, result.stderr)
