"""Hidden effects from the command line: simulate, fit, keep, predict, validate, convert."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest


@pytest.fixture(scope="module")
def practice(tmp_path_factory):
    from typer.testing import CliRunner

    from respot.cli import app

    folder = tmp_path_factory.mktemp("line") / "practice"
    arguments = ["simulate", str(folder), "--spots", "44", "--seed", "5"]
    result = CliRunner().invoke(app, [*arguments, "--effect", "joint_zero@3:1.5", "--effect", "tip_wear:1.5"])
    assert result.exit_code == 0, result.stderr
    return folder


def codes(result) -> list[str]:
    return [issue["code"] for issue in result.json["issues"]]


def fitted(respot, practice: Path, *options: object):
    names = ["--effects", "swapped_ids,tool_offset,joint_zero,tip_wear"]
    measured = practice / "measured.csv"
    robot = practice / "robot.toml"
    return respot(
        "fit", practice / "programmed.csv", "--measured", measured, "--robot", robot, "--noise", "0.1", *names, *options
    )


def test_a_table_with_joints_and_a_robot(respot, practice, tmp_path):
    result = fitted(respot, practice, "-o", "cal.json", "--report", "page.html")
    assert result.code == 0, result.err
    assert "joint_zero axis 3 (named)" in result.out
    assert "tip_wear column welds_since_cap (named)" in result.out
    assert "spots that took no part falls" in result.out
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "Two causes were found" in page
    assert "<script" not in page
    robot = practice / "robot.toml"
    blind = respot("predict", practice / "programmed.csv", "-c", "cal.json", "--robot", robot, "--json")
    assert "EFFECT_LEFT_OUT" in codes(blind)
    seen = respot(
        "predict",
        practice / "programmed.csv",
        "-c",
        "cal.json",
        "--covariates",
        practice / "measured.csv",
        "--json",
    )
    assert "EFFECT_LEFT_OUT" not in codes(seen)
    wide, narrow = (max(spot["ci95"] for spot in each.json["spots"]) for each in (blind, seen))
    assert wide > 3.0 * narrow
    with (practice / "measured.csv").open(encoding="utf-8", newline="") as file:
        real = {row["id"]: [float(row[axis]) for axis in "xyz"] for row in csv.DictReader(file)}
    far = [
        sum((spot[axis] - there) ** 2 for axis, there in zip("xyz", real[spot["id"]], strict=True)) ** 0.5
        for spot in seen.json["spots"]
    ]
    assert max(far) < 0.5
    kept = respot("validate", practice / "backup", "--measured", practice / "measured.csv", "-c", "cal.json", "--json")
    assert kept.json["kept"] is True
    refused = respot("convert", practice / "backup", "-c", "cal.json", "-o", "out")
    assert refused.code == 2
    assert "ANOTHER_SOURCE" in refused.err  # it was fitted to the list of the same spots, not to the backup
    assert not (tmp_path / "out").exists()
    written = respot("convert", practice / "backup", "-c", "cal.json", "-o", "out", "--force", "--json")
    assert written.code == 0
    assert written.json["direction"] == "compensate"
    assert written.json["effects_written"] == ["joint_zero axis 3"]
    assert written.json["effects_not_written"] == ["tip_wear column welds_since_cap"]
    assert {"EFFECT_WRITTEN", "EFFECT_NOT_WRITTEN"} <= set(codes(written))


def test_json_says_what_was_tried_hidden_and_left(respot, practice):
    record = fitted(respot, practice, "--json").json
    assert {effect["name"] for effect in record["effects"]} == {"joint_zero", "tip_wear"}
    assert record["noise"]["reached"] is True
    assert record["heldout"]["after"]["rms"] < 0.3 * record["heldout"]["before"]["rms"]
    assert {"joint_zero"} <= {each["name"] for each in record["hidden"]}
    assert record["unexplained"]["present"] is False


def test_joints_of_another_robot_are_not_used(respot, practice):
    measured = practice / "measured.csv"
    result = respot(
        "fit",
        practice / "programmed.csv",
        "--measured",
        measured,
        "--robot",
        "kr16_2",
        "--effects",
        "joint_zero",
        "--json",
    )
    assert result.code == 0, result.err
    assert "JOINTS_NOT_USED" in codes(result)
    assert result.json["effects"] == []


def test_an_effect_without_what_it_needs_finds_nothing(respot, practice):
    with (practice / "programmed.csv").open(encoding="utf-8", newline="") as file:
        rows = [{key: row[key] for key in ("id", "x", "y", "z")} for row in csv.DictReader(file)]
    with Path("bare.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, ["id", "x", "y", "z"])
        writer.writeheader()
        writer.writerows(rows)
    result = respot("fit", "bare.csv", "--measured", practice / "measured.csv", "--effects", "joint_zero", "--json")
    assert result.code == 0, result.err
    assert result.json["effects"] == []
    assert any("arm" in question["text"] for question in result.json["questions"])


def test_a_report_is_not_written_over(respot, practice, tmp_path):
    (tmp_path / "page.html").write_text("mine", encoding="utf-8")
    result = fitted(respot, practice, "--report", "page.html")
    assert result.code == 2
    assert (tmp_path / "page.html").read_text(encoding="utf-8") == "mine"


def test_repeats_tell_the_noise(respot, practice, tmp_path):
    import random

    dice = random.Random(4)
    with (practice / "measured.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    with (tmp_path / "repeats.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["id", "repeat", "x", "y", "z"])
        for row in rows:
            for number in (1, 2):
                writer.writerow([row["id"], number, *(float(row[axis]) + dice.gauss(0.0, 0.05) for axis in "xyz")])
    result = respot(
        "fit", practice / "programmed.csv", "--measured", "repeats.csv", "--effects", "swapped_ids,scale", "--json"
    )
    assert result.code == 0, result.err
    assert result.json["noise"]["source"] == "repeats"
    assert 0.02 < result.json["noise"]["floor"] < 0.06


def test_a_source_in_another_convention_is_said_and_not_kept(respot, tmp_path):
    """What is fitted to orientations as they are meant would be used on them as they are written."""
    import numpy as np
    from scipy.spatial.transform import Rotation

    dice = np.random.default_rng(8)
    points = dice.uniform(-500.0, 500.0, (24, 3)) + [1500.0, 0.0, 800.0]
    tools = Rotation.from_euler("ZYX", dice.uniform(-60.0, 60.0, (24, 3)), degrees=True)
    turn = Rotation.from_euler("ZYX", [20.0, 5.0, -8.0], degrees=True)
    there, seen = turn.apply(points) + [100.0, 50.0, 20.0], turn * tools

    def write(name, places, angles):
        with (tmp_path / name).open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(["id", "x", "y", "z", "a", "b", "c"])
            for number, row in enumerate(np.hstack([places, angles])):
                writer.writerow([f"S{number}", *(f"{value:.4f}" for value in row)])

    moving = tools.as_euler("XYZ", degrees=True)[:, ::-1]  # C, B, A of moving x, y, z in the columns a, b, c
    write("poses.csv", points, moving)
    write("tracker.csv", there + dice.normal(size=(24, 3)) * 0.05, seen.as_euler("ZYX", degrees=True))
    arguments = ["fit", "poses.csv", "--measured", "tracker.csv", "--effects", "convention,tool_offset"]
    result = respot(*arguments, "--json")
    assert result.code == 0, result.err
    assert [effect["name"] for effect in result.json["effects"]] == ["convention"]
    assert result.json["effects"][0]["where"]["list"] == "source"
    assert result.json["effects"][0]["named"]
    refused = respot(*arguments, "-o", "cal.json")
    assert refused.code == 2
    assert "convention" in refused.err
    assert not (tmp_path / "cal.json").exists()


def test_a_calibration_is_not_used_with_the_arm_of_another_robot(respot, practice, tmp_path):
    assert fitted(respot, practice, "-o", "cal.json").code == 0
    own = (practice / "robot.toml").read_text(encoding="utf-8")
    line = next(line for line in own.splitlines() if line.startswith("c2"))
    other = tmp_path / "other.toml"
    other.write_text(own.replace(line, "c2 = 1160.0"), encoding="utf-8")
    predict = ("predict", practice / "programmed.csv", "-c", "cal.json", "--covariates", practice / "measured.csv")
    assert respot(*predict, "--robot", practice / "robot.toml").code == 0
    refused = respot(*predict, "--robot", other)
    assert refused.code == 2
    assert "ANOTHER_ROBOT" in refused.err and "the effects were fitted with the arm of" in refused.err
    warned = respot(*predict, "--robot", other, "--any-robot", "--json")
    assert warned.code == 0 and "ANOTHER_SOURCE" in codes(warned)
    measured = practice / "measured.csv"
    validate = ("validate", practice / "programmed.csv", "--measured", measured, "-c", "cal.json", "--robot", other)
    assert respot(*validate).code == 2


def test_a_column_that_cannot_be_used_is_said_with_the_reason(respot, practice, tmp_path):
    assert fitted(respot, practice, "-o", "cal.json").code == 0
    with (practice / "measured.csv").open(newline="") as stream:
        rows = list(csv.reader(stream))
    place = rows[0].index("welds_since_cap")
    for row in rows[1::2]:
        row[place] = "new cap"
    with (tmp_path / "mixed.csv").open("w", newline="") as stream:
        csv.writer(stream).writerows(rows)
    predict = ("predict", practice / "programmed.csv", "-c", "cal.json", "--covariates", "mixed.csv")
    result = respot(*predict, "--robot", practice / "robot.toml")
    assert "EFFECT_LEFT_OUT" in result.err and "mixed.csv: its column welds_since_cap " in result.err


def test_a_motor_out_of_true_is_told_by_the_ratio_in_the_machine_data(respot, tmp_path):
    made = respot("simulate", "line", "--spots", "70", "--seed", "8", "--effect", "gear@2xmotor:0.8")
    assert made.code == 0, made.err
    fit = ("--measured", "line/measured.csv", "--noise", "0.1", "--effects", "joint_zero,joint_profile,gear", "--json")
    found = respot("fit", "line/backup", *fit).json["effects"]
    assert [(each["name"], each["where"], each["named"]) for each in found] == [("gear", {"axis": 2}, True)]
    assert "every turn of its motor (235.12" in found[0]["remedy"]["text"]
    # a controller that does not tell its ratios: nothing, rather than another number of waves
    machine = next((tmp_path / "line" / "backup").rglob("$machine.dat"))
    lines = machine.read_bytes().splitlines(keepends=True)
    machine.write_bytes(b"".join(line for line in lines if b"RAT_MOT_AX" not in line))
    assert respot("fit", "line/backup", *fit).json["effects"] == []


def test_a_wheel_that_is_not_known_is_refused(respot):
    for place in ("gear@2xwheel", "gear@9xmotor"):
        assert respot("simulate", "line", "--effect", place).code == 2
