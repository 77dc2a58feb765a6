"""Two robots weld in one fixture that moved: each finds the shift by itself, and together they tell it better."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from respot.cli import app
from respot.simulation import backup_files, simulate
from respot.simulation.tables import measured_csv

SHIFT = np.array([1.5, -1.0, 2.0])


@pytest.fixture(scope="module")
def out(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("shared")
    text = '[line]\nname = "one fixture"\n[defaults]\neffects = "group_shift"\nnoise = 0.1\n'
    for name, model, seed in (("A", "kr210_r2700_extra", 21), ("B", "irb6700_235_265", 22)):
        line = simulate(model, 60, 0.1, (), seed)
        moved = (line.columns["fixture"] == "FX2")[:, None] * SHIFT
        line = replace(line, measured=line.measured + moved @ line.world2tracker[:3, :3].T)
        for path, data in backup_files(line).items():
            place = folder / name / path
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_bytes(data)
        (folder / f"{name}.csv").write_text(measured_csv(line))
        text += f'[[robot]]\nname = "{name}"\nsource = "{name}"\nmeasured = "{name}.csv"\ngroup = "fixture 2"\n'
    (folder / "line.toml").write_text(text)
    done = CliRunner().invoke(app, ["migrate", str(folder / "line.toml"), "-o", str(folder / "out"), "-j", "0"])
    assert done.exit_code == 0, done.stderr
    return folder / "out"


def test_the_common_shift_is_surer_than_that_of_each_robot(out):
    record = json.loads((out / "line.json").read_bytes())
    alone = [robot["effects"][0]["parameters"] for robot in record["robots"]]
    ((common,),) = [group["effects"] for group in record["groups"]]
    assert common["effect"] == {"name": "group_shift", "where": {"column": "fixture", "level": "FX2"}}
    assert (common["robots"], common["agree"]) == (["A", "B"], True)
    for axis, truth in zip("xyz", SHIFT, strict=True):
        held = common["parameters"][axis]
        low, high = held["ci95"]
        assert low - 0.05 < truth < high + 0.05
        assert high - low < min(np.diff(parameters[axis]["ci95"])[0] for parameters in alone)


def test_the_page_says_it(out):
    page = (out / "index.html").read_text()
    assert "fixture 2" in page
    assert "a shift of fixture FX2 as a body" in page
