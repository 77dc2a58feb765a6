"""Every fixture, converted by a known transform and back, judged by readers that share nothing with respot."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from respot.calibration.calibration import Calibration
from respot.cli import app
from tests.convert import laws
from tests.convert.independent import SAMPLES
from tests.convert.known_transform import transform_about


def save_calibration(path: Path, transform: np.ndarray, ids: tuple[str, ...]) -> None:
    path.write_text(Calibration(transform[:3, :3], transform[:3, 3], "theory", "same", ids).to_json())


def respot(*arguments: object) -> tuple[int, dict, str]:
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    return result.exit_code, json.loads(result.stdout) if result.stdout.startswith("{") else {}, result.stderr


def spots_of(backup: Path, *options: str) -> dict[str, np.ndarray]:
    """IDs and world (or part) positions of the weld spots as inspect lists them: only to pick a centre and names."""
    code, record, err = respot("inspect", backup, "--json", *options)
    assert code == 0, err
    found = {}
    for robot in record["robots"]:
        for target in robot["targets"]:
            place = target.get("world") or target.get("part")
            if target["weld"] and target["spot_id"] and place:
                found[target["spot_id"]] = np.array([place["x"], place["y"], place["z"]])
    return found


SAMPLES_ROOT = SAMPLES.parent
FIXTURES = [
    *(SAMPLES / name for name in ("kuka", "abb")),
    *(SAMPLES_ROOT / "undeclared" / line / "backup" for line in ("line_a", "line_b", "line_c")),
]


@pytest.mark.parametrize("backup", FIXTURES, ids=lambda path: str(path.relative_to(SAMPLES_ROOT)))
def test_a_known_transform_there_and_back(backup, tmp_path):
    spots = spots_of(backup)
    transform = transform_about(np.mean(list(spots.values()), axis=0))
    save_calibration(tmp_path / "cal.json", transform, tuple(spots))
    code, record, err = respot("convert", backup, "-c", tmp_path / "cal.json", "-o", tmp_path / "out", "--json")
    print(err[:3000])
    old, new = laws.files_of(backup), laws.files_of(tmp_path / "out")
    found = laws.judge(old, new, transform, record)
    print(code, found.moved, found.offsets, len(found.unseen), len(record["edits"]), len(record["refused"]))
    assert not found.wrong
    assert not found.unseen
    code, _, err = respot(
        "convert", tmp_path / "out", "-c", tmp_path / "cal.json", "--inverse", "-o", tmp_path / "back", "--json"
    )
    assert code in (0, 1), err
    back = laws.judge_back(old, laws.files_of(tmp_path / "back"), record["edits"])
    assert not back.wrong
