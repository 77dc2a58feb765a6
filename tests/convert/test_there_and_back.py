"""``--inverse`` of a theory calibration: simulation programs to the floor, and back to the very numbers."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform
from typer.testing import CliRunner

from respot.calibration.calibration import Calibration
from respot.calibration.effects.term import Parameter, Term
from respot.cli import app
from respot.geometry import distance_mm, turn_deg
from respot.spots import read_source
from tests.correction.small import SPOTS, krl, moved
from tests.difference.witness import assert_witnessed

SAMPLES = Path(__file__).parents[2] / "samples" / "rear_door"
_NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")


def respot(*arguments: object):
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    assert result.exit_code == 0, result.stderr
    return json.loads(result.stdout)


def numbers(folder: Path) -> list[list[str]]:
    files = sorted(path for path in folder.rglob("*") if path.suffix.lower() in (".dat", ".src", ".mod", ".sys"))
    lines = [line for file in files for line in file.read_bytes().decode("latin-1").splitlines()]
    return [_NUMBER.findall(line) for line in lines if "respot:" not in line]


def restored(old: Path, new: Path) -> None:
    """Every number is what it was within its last digit, or half that of the coarsest number beside it."""
    for was, now in zip(numbers(old), numbers(new), strict=True):
        digits = [10.0 ** -len(number.partition(".")[2]) if "e" not in number.lower() else 1e-9 for number in now]
        coarsest = max((digit for digit in digits if digit < 0.05), default=0.0)
        for number, again, digit in zip(was, now, digits, strict=True):
            assert abs(float(number) - float(again)) <= max(digit, 0.5 * coarsest) * 1.001, (was, now)


@pytest.mark.parametrize("robot", ["kuka", "abb"])
def test_floor_to_simulation_and_back(tmp_path, robot):
    up, back, model = tmp_path / "up", tmp_path / "back", tmp_path / "cal.json"
    respot("fit", SAMPLES / robot, "--theory", SAMPLES / "theory.csv", "--effects", "none", "-o", model, "--json")
    aligned = respot("convert", SAMPLES / robot, "-c", model, "-o", up, "--json")
    floor = respot("convert", up, "-c", model, "--inverse", "-o", back, "--json")
    assert (aligned["direction"], floor["direction"]) == ("align", "compensate")
    assert len(floor["edits"]) == len(aligned["edits"]) > 5
    assert_witnessed(floor["edits"], up, back)
    restored(SAMPLES / robot, back)
    (changed, *_) = [path for path in back.rglob("*") if path.is_file() and b"respot: " in path.read_bytes()]
    assert b"compensate theory, for the real cell" in changed.read_bytes()
    again = CliRunner().invoke(app, ["convert", str(back), "-c", str(model), "--inverse", "-o", str(tmp_path / "no")])
    assert again.exit_code == 2
    assert "ALREADY_APPLIED" in again.stderr


@pytest.mark.parametrize("robot", ["kuka", "abb"])
def test_a_retrofit_takes_the_old_calibration_up_and_the_new_one_down(tmp_path, robot):
    """Floor programs of the old line -> simulation -> floor programs of the new line."""
    old, new = tmp_path / "old.json", tmp_path / "new.json"
    respot("fit", SAMPLES / robot, "--theory", SAMPLES / "theory.csv", "--effects", "none", "-o", old, "--json")
    model = Calibration.load(old)
    turn = np.array([[np.cos(0.01), -np.sin(0.01), 0.0], [np.sin(0.01), np.cos(0.01), 0.0], [0.0, 0.0, 1.0]])
    other = Calibration(turn, np.array([12.0, -7.0, 3.0]), "theory", "same", model.ids)
    other.save(new)
    respot("convert", SAMPLES / robot, "-c", old, "-o", tmp_path / "up", "--json")
    respot("convert", tmp_path / "up", "-c", new, "--inverse", "-o", tmp_path / "down", "--json")
    floor, down = (read_source(folder, model.ids).spots for folder in (SAMPLES / robot, tmp_path / "down"))
    assert floor.ids == down.ids
    first = model.source2reference * RigidTransform.from_components(floor.positions, floor.rotations)
    second = other.source2reference * RigidTransform.from_components(down.positions, down.rotations)
    assert float(distance_mm(first, second).max()) < 4e-3
    assert float(turn_deg(first, second).max()) < 1e-3


@pytest.mark.parametrize("frame", ["same", "free"])
def test_effects_of_a_theory_calibration_are_applied_on_the_way_up_and_solved_for_on_the_way_down(tmp_path, frame):
    """The floor grows by 2 mm/m: the simulation's programs must be told to go less far there."""
    scale = Term("scale", {}, (Parameter("growth", "mm/m", 2.0),), {"centre": [0.0, 0.0, 0.0]})
    spots = read_source(SAMPLES / "kuka", ()).spots
    shift = np.array([5.0, -3.0, 2.0])
    model = Calibration(np.eye(3), shift, "theory", frame, tuple(spots.ids), terms=(scale,), values=(np.array([2.0]),))
    model.save(tmp_path / "cal.json")
    there = tmp_path / "down"
    made = respot("convert", SAMPLES / "kuka", "-c", tmp_path / "cal.json", "--inverse", "-o", there, "--json")
    assert made["direction"] == "compensate"
    assert made["effects_written"] == ["scale"]
    assert made["left_to_registration"] == []
    down = read_source(there, spots.ids).spots
    assert down.positions * 1.002 + shift == pytest.approx(spots.positions, abs=2e-3)
    aligned = respot(
        "convert", SAMPLES / "kuka", "-c", tmp_path / "cal.json", "-o", tmp_path / "up", "--force", "--json"
    )
    assert aligned["direction"] == "align"
    up = read_source(tmp_path / "up", spots.ids).spots
    assert up.positions == pytest.approx(spots.positions * 1.002 + shift, abs=2e-3)


@pytest.mark.parametrize("record", ["kept", "lost"])
def test_a_calibration_that_was_turned_back_may_be_applied_again_once(tmp_path, record):
    """The robot hands programs back without our record: the headers alone must tell it too."""
    model, folder = tmp_path / "cal.json", SAMPLES / "abb"
    respot("fit", folder, "--theory", SAMPLES / "theory.csv", "--effects", "none", "-o", model, "--json")
    for name, options in (("up", ()), ("back", ("--inverse",)), ("again", ())):
        respot("convert", folder, "-c", model, *options, "-o", tmp_path / name, "--json")
        folder = tmp_path / name
        if record == "lost":
            (folder / "respot.json").unlink()
    restored(tmp_path / "up", tmp_path / "again")
    once_more = CliRunner().invoke(app, ["convert", str(folder), "-c", str(model), "-o", str(tmp_path / "no")])
    assert once_more.exit_code == 2
    assert "ALREADY_APPLIED" in once_more.stderr


def test_programs_that_name_a_calibration_are_its_robots_whatever_their_folder_is_called(tmp_path):
    """A backup that does not tell the robot's name has that of its folder, and converted it lies in another."""
    for path, text in krl().items():
        (tmp_path / "020R01" / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "020R01" / path).write_bytes(text.replace("\n", "\r\n").encode())
    rows = [f"{name};{x:.4f};{y:.4f};{z:.4f}" for name, (x, y, z) in ((name, moved(SPOTS[name])) for name in SPOTS)]
    (tmp_path / "theory.csv").write_text("\n".join(["id;x;y;z", *rows]) + "\n")
    model = tmp_path / "cal.json"
    respot("fit", tmp_path / "020R01", "--theory", tmp_path / "theory.csv", "-o", model, "--json")
    respot("convert", tmp_path / "020R01", "-c", model, "-o", tmp_path / "up", "--json")
    back = respot("convert", tmp_path / "up", "-c", model, "--inverse", "-o", tmp_path / "back", "--json")
    assert not [issue for issue in back["issues"] if issue["code"] in ("ANOTHER_ROBOT", "ANOTHER_SOURCE")]
    restored(tmp_path / "020R01", tmp_path / "back")
    dat = tmp_path / "020R01" / "KRC/R1/Program/weld.dat"
    dat.write_bytes(dat.read_bytes().replace(b"ENDDAT", b";\r\nENDDAT"))  # not the very files that it was fitted to
    (tmp_path / "020R01").rename(tmp_path / "020R02")
    other = CliRunner().invoke(app, ["convert", str(tmp_path / "020R02"), "-c", str(model), "-o", str(tmp_path / "no")])
    assert other.exit_code == 2
    assert "ANOTHER_ROBOT" in other.stderr
