from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import pytest
from typer.testing import CliRunner

from respot.cli import app

SAMPLES = Path(__file__).parents[2] / "samples" / "rear_door"


@dataclass(frozen=True)
class Result:
    code: int
    out: str
    err: str

    @property
    def json(self) -> dict:
        return json.loads(self.out)


@pytest.fixture
def respot(tmp_path, monkeypatch):
    """Runs a command in an empty folder."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments: object) -> Result:
        result = CliRunner().invoke(app, [str(argument) for argument in arguments])
        return Result(result.exit_code, result.stdout, result.stderr)

    return run


@pytest.fixture(params=["kuka", "abb"])
def backup(request) -> Path:
    return SAMPLES / request.param


@pytest.fixture(scope="session")
def theory() -> Path:
    return SAMPLES / "theory.csv"
