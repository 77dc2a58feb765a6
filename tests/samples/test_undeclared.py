"""The undeclared samples: what is found is what the truth file says, and what the README says."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from respot.calibration.report import report
from respot.calibration.source_fit import FitOptions, fit_source

FOLDER = Path(__file__).parents[2] / "samples" / "undeclared"
LINES = ("line_a", "line_b", "line_c")


@pytest.fixture(scope="module", params=LINES)
def line(request):
    folder = FOLDER / request.param
    options = FitOptions(kind="measured", effects="auto", noise=0.1)
    fitted = fit_source(folder / "backup", folder / "measured.csv", options)
    truth = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
    return request.param, truth, report(fitted.fit)


def test_the_hidden_effects_are_named_and_nothing_else(line):
    _, truth, record = line
    real = sorted(effect["name"] for effect in truth["effects"])
    assert sorted(effect["name"] for effect in record["effects"]) == real
    assert all(effect["named"] for effect in record["effects"])
    where = {effect["name"]: effect["where"] for effect in record["effects"]}
    for effect in truth["effects"]:
        assert where[effect["name"]] == effect["where"]


def test_the_readme_tells_the_errors(line):
    name, _, record = line
    row = next(text for text in (FOLDER / "README.md").read_text(encoding="utf-8").splitlines() if f"`{name}`" in text)
    told = [float(text) for text in re.findall(r"\d+\.\d\d(?= \|)", row)]
    heldout = record["heldout"]["after"]["rms"]
    assert told == [round(record["before"]["rms"], 2), round(record["after"]["rms"], 2), round(heldout, 2)]


def test_no_file_but_the_truth_tells(line):
    name, truth, _ = line
    for path in (FOLDER / name).rglob("*"):
        if path.is_file() and path.name != "truth.json":
            text = path.read_bytes().decode("latin-1").lower()
            for effect in truth["effects"]:
                assert effect["name"] not in text
