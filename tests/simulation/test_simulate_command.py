"""``respot simulate``: its files, and that the engine reads them and finds the line as it was made."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest
from typer.testing import CliRunner

from respot.cli import app
from respot.kinematics.robot_file import read_robot_file
from respot.simulation import simulate
from respot.simulation.line import rms
from respot.spots import read_source


def respot(*arguments):
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("simulated") / "line"
    options = ("--spots", 40, "--seed", 12, "--effect", "link_length@a2:1.5", "--layout", "hard", "--noise", 0.2)
    result = respot("simulate", folder, *options)
    assert result.exit_code == 0, result.stderr
    assert str(folder / "measured.csv") in result.stdout
    return folder


@pytest.fixture(scope="module")
def line():
    return simulate(spots=40, seed=12, effects=["link_length@a2:1.5"], layout="hard", noise=0.2)


def rows(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_the_folder(made):
    assert sorted(path.name for path in made.iterdir()) == [
        "backup", "measured.csv", "programmed.csv", "robot.toml", "truth.json",
    ]  # fmt: skip
    assert not [path for path in made.parent.iterdir() if path != made]


def test_only_the_truth_knows(made):
    truth = json.loads((made / "truth.json").read_text())
    assert [effect["name"] for effect in truth["effects"]] == ["link_length"]
    assert truth["effects"][0]["where"] == {"parameter": "a2"}
    assert truth["effects"][0]["left_rms"] == pytest.approx(1.5, rel=0.02)
    for path in made.rglob("*"):
        if path.is_file() and path.name != "truth.json":
            content = path.read_bytes().lower()
            assert not [word for word in (b"link_length", b"truth", b"effect") if word in content], path


def test_the_backup_is_the_programmed_line(made, line):
    source = read_source(made / "backup")
    assert source.robot is not None
    assert source.robot.name.startswith("ST")
    assert not [issue for issue in source.issues if issue.level != "info"], source.issues
    assert sorted(source.spots.ids) == sorted(line.ids)
    named = [line.ids.index(spot) for spot in source.spots.ids]
    assert source.spots.positions == pytest.approx(line.positions[named], abs=1e-3)
    assert np.degrees((source.spots.rotations.inv() * line.rotations[named]).magnitude()).max() < 1e-4
    assert [move.target.name for move in source.spots.moves] == [f"X{spot}" for spot in source.spots.ids]


def test_the_engine_reads_the_robot_and_the_joints(made, line):
    robot = read_robot_file(made / "robot.toml")
    flange = robot.forward(line.joints)
    tool = line.flange2tool[:3, 3]
    assert flange.translation + flange.rotation.apply(tool) == pytest.approx(line.positions, abs=1e-6)
    for row in rows(made / "programmed.csv"):
        here = line.ids.index(row["id"])
        assert [float(row[f"j{k}"]) for k in range(1, 7)] == pytest.approx(line.joints[here], abs=1e-4)
        assert [float(row[k]) for k in "xyz"] == pytest.approx(line.positions[here], abs=1e-3)


def test_the_measured_table(made, line):
    table = rows(made / "measured.csv")
    minutes = [float(row["time_min"]) for row in table]
    assert minutes == sorted(minutes)
    for row in table:
        here = line.ids.index(row["id"])
        assert [float(row[k]) for k in "xyz"] == pytest.approx(line.measured[here], abs=1e-3)
        assert row["station"] == line.columns["station"][here]
        assert float(row["force_n"]) == line.columns["force_n"][here]
    assert {"j1", "jm6", "approach_a6", "humidity_pct"} <= set(table[0])
    assert "a" not in table[0]


def test_fit_leaves_what_was_asked_for(made):
    result = respot(
        "fit", made / "backup", "--measured", made / "measured.csv", "--effects", "none", "--noise", 0.2, "--json"
    )
    assert result.exit_code == 0, result.stderr
    record = json.loads(result.stdout)
    assert record["n_matched"] == 40
    assert record["before"]["rms"] == pytest.approx(np.hypot(1.5, 0.2 * np.sqrt(3)), rel=0.1)


def test_every_file_of_the_backup_is_understood(made):
    record = json.loads(respot("check", made / "backup", "--json").stdout)
    assert record["totals"]["opaque"] == 0
    assert record["totals"]["roundtrip_failures"] == 0
    assert record["totals"]["files"] >= 6


def test_status_and_turn_are_those_of_the_joints(made, tmp_path):
    """The engine moves every target with the joints that its status and turn name; a wrong bit would refuse it."""
    theory = tmp_path / "theory.csv"
    lines = ["id,x,y,z"]
    lines += [",".join([row["id"], *(str(float(row[k]) + 2) for k in "xyz")]) for row in rows(made / "programmed.csv")]
    theory.write_text("\n".join(lines) + "\n")
    result = respot("convert", made / "backup", "--theory", theory, "-o", tmp_path / "out", "--json")
    assert result.exit_code == 0, result.stdout[-500:] + result.stderr
    record = json.loads(result.stdout)
    assert record["refused"] == []
    assert len(record["edits"]) >= 80


@pytest.mark.parametrize("robot", ["irb6640_185_280", "irb6700_200_260", "irb6700_235_265"])
def test_an_abb_backup_is_the_programmed_line(tmp_path, robot):
    folder = tmp_path / "line"
    assert respot("simulate", folder, "--robot", robot, "--spots", 60, "--seed", 5).exit_code == 0
    made = simulate(robot, spots=60, seed=5)
    source = read_source(folder / "backup", reference_ids=made.ids)
    assert not source.issues
    named = [made.ids.index(spot) for spot in source.spots.ids]
    assert sorted(named) == list(range(60))
    assert source.spots.positions == pytest.approx(made.positions[named], abs=1e-5)
    assert np.degrees((source.spots.rotations.inv() * made.rotations[named]).magnitude()).max() < 1e-6
    theory = tmp_path / "theory.csv"
    rows_ = [[spot, *(f"{value + 2:.4f}" for value in xyz)] for spot, xyz in zip(made.ids, made.positions, strict=True)]
    theory.write_text("\n".join(",".join(row) for row in [["id", "x", "y", "z"], *rows_]) + "\n")
    result = respot("convert", folder / "backup", "--theory", theory, "-o", tmp_path / "out", "--json")
    assert result.exit_code == 0, result.stderr  # confdata and joint bounds are understood
    assert len(json.loads(result.stdout)["edits"]) >= 120


def test_a_rail_is_read_with_its_axis(tmp_path):
    assert respot("simulate", tmp_path / "line", "--spots", 30, "--rail", "--seed", 2).exit_code == 0
    source = read_source(tmp_path / "line" / "backup")
    made = simulate(spots=30, seed=2, rail=True)
    named = [made.ids.index(spot) for spot in source.spots.ids]
    assert source.spots.positions == pytest.approx(made.positions[named], abs=1e-2)
    first = rows(tmp_path / "line" / "measured.csv")[0]
    assert float(first["e1"]) == pytest.approx(made.external_axes[made.ids.index(first["id"]), 0], abs=1e-3)


def test_exchanged_names_take_joints_along_but_no_place(tmp_path):
    folder = tmp_path / "line"
    assert respot("simulate", folder, "--spots", 30, "--effect", "swapped_ids", "--seed", 1).exit_code == 0
    programmed = {row["id"]: row for row in rows(folder / "programmed.csv")}
    for row in rows(folder / "measured.csv"):
        assert row["j2"] == programmed[row["id"]]["j2"]
    swapped = json.loads((folder / "truth.json").read_text())["effects"][0]["where"]["ids"]
    table = json.loads((folder / "truth.json").read_text())["measured_true"]
    assert {row["listed_as"] for row in table if row["listed_as"] != row["is"]} == set(swapped)


def test_the_same_command_writes_the_same_bytes(made, tmp_path):
    options = ("--spots", 40, "--seed", 12, "--effect", "link_length@a2:1.5", "--layout", "hard", "--noise", 0.2)
    (tmp_path / "again").mkdir()  # an empty folder is welcome
    assert respot("simulate", tmp_path / "again", *options).exit_code == 0
    files = {path.relative_to(made): path.read_bytes() for path in made.rglob("*") if path.is_file()}
    again = tmp_path / "again"
    assert {path.relative_to(again): path.read_bytes() for path in again.rglob("*") if path.is_file()} == files


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--effect", "joint_zer"], "did you mean joint_zero"),
        (["--robot", "kr210_r2700_extr"], "did you mean kr210_r2700_extra"),
        (["--robot", "irb6640_185_280", "--rail"], "take a KUKA robot"),
        (["--layout", "medium"], "easy or hard"),
        (["--effect", "gear:0"], "no size"),
    ],
)
def test_bad_wishes_write_nothing(tmp_path, options, message):
    result = respot("simulate", tmp_path / "line", *options)
    assert result.exit_code == 2
    assert message in result.stderr
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_holds_something_stays_as_it_is(tmp_path):
    (tmp_path / "mine.txt").write_text("mine")
    result = respot("simulate", tmp_path)
    assert result.exit_code == 2
    assert "OUTPUT_EXISTS" in result.stderr
    assert respot("simulate", tmp_path / "mine.txt").exit_code == 2
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


def test_json(tmp_path):
    record = json.loads(respot("simulate", tmp_path / "line", "--spots", 20, "--json").stdout)
    assert record["schema"] == "respot.simulate/1"
    assert record["spots"] == 20
    assert "truth.json" in record["files"]
    assert "effects" not in record


def test_noise_is_what_fit_is_told():
    clean, noisy = (simulate(spots=300, seed=1, noise=noise) for noise in (0.0, 0.2))
    assert rms(clean.measured - clean.measured_true) == 0
    assert rms(noisy.measured - noisy.measured_true) == pytest.approx(0.2 * np.sqrt(3), rel=0.05)
