"""Small backups, one trap each: the converted bytes are what they were, and right as readers without respot see them.

``python scripts/make_goldens.py`` writes them anew.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from respot.cli import app
from tests.convert import laws

ROOT = Path(__file__).parent
sys.path.insert(0, str(ROOT.parents[1] / "scripts"))
import make_goldens  # noqa: E402

GOLDENS = sorted(path.parent for path in ROOT.glob("*/in"))
#: Depth `frames` writes other numbers than those of the targets: it has tests of its own.
POINTS = [golden for golden in GOLDENS if "frames" not in golden.name]


def by_name(golden: Path) -> str:
    return golden.name


def run(*arguments: str) -> dict:
    result = CliRunner().invoke(app, list(arguments))
    assert result.exit_code in (0, 1), result.stderr
    return json.loads(result.stdout)


def transform_of(golden: Path) -> np.ndarray:
    own = golden / "calibration.json"
    model = json.loads((own if own.is_file() else ROOT / "calibration.json").read_text())
    made = np.eye(4)
    made[:3, :3], made[:3, 3] = model["rotation"], model["translation"]
    return made


@pytest.mark.parametrize("golden", GOLDENS, ids=by_name)
def test_the_same_bytes_come_out(golden, tmp_path):
    record = run(*make_goldens.command(golden, tmp_path / "out"))
    assert laws.files_of(tmp_path / "out") == laws.files_of(golden / "out")
    assert make_goldens.kept_record(record) == (golden / "record.json").read_text()


@pytest.mark.parametrize("golden", POINTS, ids=by_name)
def test_the_numbers_are_right_as_another_reader_sees_them(golden):
    """From the stored files alone: what respot does today plays no part."""
    record = json.loads((golden / "record.json").read_text())
    assert len(record["edits"]) >= 2
    found = laws.judge(laws.files_of(golden / "in"), laws.files_of(golden / "out"), transform_of(golden), record)
    assert not found.wrong
    assert not found.unseen
    assert found.moved + found.offsets == len(record["edits"])


@pytest.mark.parametrize("golden", POINTS, ids=by_name)
def test_the_way_back_restores_every_number(golden, tmp_path):
    record = json.loads((golden / "record.json").read_text())
    there = make_goldens.command(golden, tmp_path / "back")
    there[1] = str(golden / "out")
    run(*there, "--inverse")
    found = laws.judge_back(laws.files_of(golden / "in"), laws.files_of(tmp_path / "back"), record["edits"])
    assert not found.wrong
    assert found.restored >= 2


@pytest.mark.parametrize("golden", GOLDENS, ids=by_name)
def test_each_golden_says_its_trap_where_the_program_begins(golden):
    texts = [path.read_bytes().decode("latin-1") for path in (golden / "in").rglob("*") if path.is_file()]
    assert any(len(line) > 60 for text in texts for line in text.splitlines()[:8] if "golden: " in line)
