"""Every fixture, converted by a known transform and back, judged by readers that share nothing with respot."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from respot.calibration.calibration import Calibration
from respot.cli import app
from tests.convert import laws
from tests.convert.independent import SAMPLES
from tests.convert.known_transform import transform_about
from tests.correction.small import krl


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
    assert_there_and_back(backup, tmp_path)


@pytest.mark.parametrize("robot", ["kr210_r2700_extra", "irb6700_235_265"])
def test_a_simulated_line_there_and_back(robot, tmp_path):
    code, _, err = respot("simulate", tmp_path / "line", "--robot", robot, "--spots", "25", "--seed", "5")
    assert code == 0, err
    assert_there_and_back(tmp_path / "line" / "backup", tmp_path)


def assert_there_and_back(backup: Path, folder: Path, least: int = 14) -> None:
    spots = spots_of(backup)
    assert len(spots) >= least
    transform = transform_about(np.mean(list(spots.values()), axis=0))
    calibration, out, back = folder / "cal.json", folder / "out", folder / "back"
    save_calibration(calibration, transform, tuple(spots))
    code, record, err = respot("convert", backup, "-c", calibration, "-o", out, "--json")
    assert code in (0, 1), err
    old = laws.files_of(backup)
    found = laws.judge(old, laws.files_of(out), transform, record)
    assert not found.wrong
    assert not found.unseen
    refused = {item["target"] for item in record["refused"]}
    assert found.moved + len(refused) >= len(spots)
    assert found.moved >= len(spots) / 2
    code, _, err = respot("convert", out, "-c", calibration, "--inverse", "-o", back, "--json")
    assert code in (0, 1), err
    came_back = laws.judge_back(old, laws.files_of(back), record["edits"])
    assert not came_back.wrong


def test_numbers_come_back_however_steep_b_is(tmp_path):
    """By the lock a lost digit of the pose is many of A and C: they are written with more digits there."""
    rng = np.random.default_rng(7)
    steep = np.degrees(np.arccos(10.0 ** rng.uniform(-2.0, 0.0, 120))) * rng.choice([-1.0, 1.0], 120)
    lines, ways = [], []
    for number, b in enumerate(steep):
        x, y, z, a, c = (*rng.uniform(-300.0, 300.0, 3), *rng.uniform(-180.0, 180.0, 2))
        lines.append(f"DECL FRAME XP{number}={{X {x:.3f},Y {y:.3f},Z {z:.3f},A {a:.4f},B {b:.4f},C {c:.4f}}}\n")
        ways.append(f"LIN XP{number}\n")
    files = krl("FDAT_ACT=FS1\nBAS(#CP_PARAMS,1)\n" + "".join(ways), "".join(lines))
    for path, text in files.items():
        (tmp_path / "in" / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "in" / path).write_bytes(text.replace("\n", "\r\n").encode("ascii"))
    assert_there_and_back(tmp_path / "in", tmp_path, least=4)


# ------------------------------------------------------------------------------------------- small backups with traps

TRAPS = sorted((Path(__file__).parents[1] / "difference" / "traps").glob("*/*/old"))
#: Every target whose name the reader finds is a spot, all programs are in scope, and what cannot be corrected stays.
WHOLE = ("--spot-id", r"^\w+$", "--programs", "*", "--keep-config", "--partial")


def trap(path: Path) -> str:
    return "/".join(path.parts[-3:-1])


def test_small_backups_with_traps_there_and_back(tmp_path):
    """They were written to mislead a comparison of two backups; here each side is converted as a whole."""
    judged, refused = 0, set()
    for number, backup in enumerate(TRAPS):
        old = laws.files_of(backup)
        uses = [
            use for use in laws.read(old).uses if use.literal.name and use.literal.complete and use.base is not None
        ]
        if not uses:
            continue
        centre = np.mean([(use.base @ use.literal.pose)[:3, 3] for use in uses], axis=0)
        transform, names = transform_about(centre), {use.literal.name.upper() for use in uses}
        calibration, out, back = (tmp_path / f"{number}{name}" for name in (".json", "out", "back"))
        save_calibration(calibration, transform, tuple(names))
        code, record, err = respot("convert", backup, "-c", calibration, "-o", out, "--json", *WHOLE)
        if code == 2:  # as a whole, with the reason
            refused.add((trap(backup), re.search(r"[A-Z]+(?:_[A-Z]+)+", err)[0]))
            continue
        found = laws.judge(old, laws.files_of(out), transform, record)
        assert not found.wrong, trap(backup)
        assert respot("convert", out, "-c", calibration, "--inverse", "-o", back, "--json", *WHOLE)[0] in (0, 1)
        came_back = laws.judge_back(old, laws.files_of(back), record["edits"], configurations=False)
        assert not came_back.wrong, trap(backup)
        judged += found.moved > 0
    print(judged, refused)
    assert judged >= 40
