"""The three lines of ``samples/undeclared`` are what their script makes, and keep their secret."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from respot.simulation import EFFECTS

ROOT = Path(__file__).parents[2]
#: Effects whose names are words that files hold anyway.
WORDS = {"gear", "convention"}
LINES = ROOT / "samples" / "undeclared"


def test_the_samples_are_what_the_script_makes():
    script = ROOT / "scripts" / "make_undeclared.py"
    done = subprocess.run([sys.executable, script, "--check"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize("name", ["line_a", "line_b", "line_c"])
def test_each_line_hides_what_its_truth_says(name):
    truth = json.loads((LINES / name / "truth.json").read_text())
    assert 80 <= truth["spots"] <= 160
    assert truth["noise"] == 0.1
    assert len(truth["effects"]) == (2 if name == "line_b" else 1)
    assert all(0.8 <= effect["left_rms"] <= 2 for effect in truth["effects"])
    files = [path for path in (LINES / name).rglob("*") if path.is_file() and path.name != "truth.json"]
    assert {"measured.csv", "robot.toml", "am.ini", "$config.dat"} <= {path.name for path in files}
    for path in files:
        content = path.read_bytes().decode("cp1252").lower()
        assert not [effect for effect in EFFECTS if effect in content and effect not in WORDS], path
