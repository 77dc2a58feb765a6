"""`respot plan`: which further spots to measure."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from respot.calibration.calibration import Calibration
from respot.cli import app
from respot.simulation import files_of, simulate
from tests.cli.conftest import SAMPLES

COUNT = 6
NOISE = 0.25


@pytest.fixture(scope="module")
def corner(tmp_path_factory) -> Path:
    """A line with axis 3 mastered wrong, 14 spots of one corner measured and fitted: ``cal.json``."""
    folder = tmp_path_factory.mktemp("corner")
    line = simulate("kr210_r2700_extra", 100, NOISE, ["joint_zero@3:0.7"], 8, "hard", columns=False)
    chance = np.random.default_rng(8)
    near = np.argsort(np.linalg.norm(line.positions - line.positions[chance.integers(line.n)], axis=1))[:30]
    wanted = {line.ids[row] for row in chance.permutation(near)[:14]}
    for path, content in files_of(line).items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_bytes(content)
    subset(folder, wanted, "first.csv")
    ran("fit", folder / "backup", "--measured", folder / "first.csv", "--noise", NOISE, "-o", folder / "cal.json")
    return folder


@pytest.fixture(scope="module")
def plan(corner) -> dict:
    return planned(corner)


def ran(*arguments: object) -> str:
    done = CliRunner().invoke(app, [str(argument) for argument in arguments])
    assert done.exit_code == 0, done.stderr
    return done.stdout


def planned(corner: Path, *more: object, count: int = COUNT) -> dict:
    return json.loads(ran("plan", corner / "backup", "-c", corner / "cal.json", "--count", count, "--json", *more))


def subset(folder: Path, names: set[str], file: str) -> None:
    head, *rows = (folder / "measured.csv").read_text().splitlines()
    kept = [row for row in rows if row.split(",")[0] in names]
    assert len(kept) == len(names)
    (folder / file).write_text("\n".join([head, *kept]) + "\n")


def first_of(folder: Path) -> set[str]:
    return {row.split(",")[0] for row in (folder / "first.csv").read_text().splitlines()[1:]}


def codes(record: dict) -> list[str]:
    return [issue["code"] for issue in record["issues"]]


def test_the_plan_names_spots_that_were_not_measured_in_the_order_of_what_they_buy(corner, plan):
    assert plan["schema"] == "respot.plan/1"
    names = [spot["id"] for spot in plan["spots"]]
    assert len(set(names)) == COUNT
    assert [spot["order"] for spot in plan["spots"]] == list(range(1, COUNT + 1))
    assert not set(names) & first_of(corner)
    assert (plan["measured"], plan["candidates"]) == (14, 86)
    assert plan["pairs"]
    for pair in plan["pairs"]:
        assert pair["names"][0] == "joint_zero axis 3"
        assert 0.0 <= pair["before"] <= pair["after"] <= pair["with_all"] + 1e-9
    separated = [tuple(names) for spot in plan["spots"] for names in spot["separates"]]
    assert sorted(separated) == sorted(tuple(pair["names"]) for pair in plan["pairs"] if pair["separated"])
    assert separated
    for each in plan["parameters"]:
        assert 0.0 < each["after"] < each["before"]
    assert plan["worst"]["after"] < plan["worst"]["before"]
    assert plan["noise_known"] is True


def test_what_was_promised_is_separated_once_it_is_measured(corner, plan):
    subset(corner, first_of(corner) | {spot["id"] for spot in plan["spots"]}, "more.csv")
    again = ("fit", corner / "backup", "--measured", corner / "more.csv", "--noise", NOISE, "-o", corner / "then.json")
    ran(*again)
    left = Calibration.load(corner / "then.json").information
    near = set() if left is None else {rival.term.label for rival in left.rivals}
    promised = {pair["names"][1] for pair in plan["pairs"] if pair["separated"]}
    before = {rival.term.label for rival in Calibration.load(corner / "cal.json").information.rivals}
    assert promised <= before
    assert not promised & near


def test_planned_spots_promise_more_than_others(corner, plan):
    """What the planned spots are expected to tell, against spots drawn at random as the only ones of the program."""
    worst = min(pair["after"] for pair in plan["pairs"] if pair["separable"])
    rows = (corner / "programmed.csv").read_text().splitlines()
    rest = [row for row in rows[1:] if row.split(",")[0] not in first_of(corner)]
    chance = np.random.default_rng(0)
    others = []
    for _ in range(5):
        some = chance.choice(rest, COUNT, replace=False)
        (corner / "some.csv").write_text("\n".join([rows[0], *some]) + "\n")
        command = ("plan", corner / "some.csv", "-c", corner / "cal.json", "--count", COUNT, "--json")
        told = json.loads(ran(*command, "--robot", "kr210_r2700_extra"))
        assert {spot["id"] for spot in told["spots"]} == {row.split(",")[0] for row in some}
        others.append(min(pair["after"] for pair in told["pairs"]))
    assert worst > max(others)


def test_the_order_of_a_list_does_not_matter(corner):
    """Not even where every spot has a twin that is worth the same."""
    rows = (corner / "programmed.csv").read_text().splitlines()
    rows += [f"twin_of_{row}" for row in rows[1:]]
    told = []
    for number, order in enumerate((rows[1:], rows[:0:-1])):
        (corner / f"list{number}.csv").write_text("\n".join([rows[0], *order]) + "\n")
        command = ("plan", corner / f"list{number}.csv", "-c", corner / "cal.json", "--count", 4, "--json")
        told.append(json.loads(ran(*command, "--robot", "kr210_r2700_extra"))["spots"])
    assert [spot["id"] for spot in told[0]] == [spot["id"] for spot in told[1]]


def test_fit_points_to_it_where_causes_are_not_separated(corner):
    text = ran("fit", corner / "backup", "--measured", corner / "first.csv", "--noise", NOISE)
    assert "respot plan SOURCE -c CAL.json" in text


def test_the_terminal_says_the_same(corner, plan):
    text = ran("plan", corner / "backup", "-c", corner / "cal.json", "--count", COUNT)
    places = [text.index(spot["id"]) for spot in plan["spots"]]
    assert places == sorted(places)
    assert f"{sum(pair['separated'] for pair in plan['pairs'])} of {len(plan['pairs'])} pairs" in text
    assert "joint_zero axis 3" in text


def test_more_than_there_are(corner):
    told = planned(corner, count=500)
    assert len(told["spots"]) == told["candidates"] == 86
    assert "FEW_CANDIDATES" in codes(told)
    for pair in told["pairs"]:
        assert pair["after"] == pytest.approx(pair["with_all"])


def test_what_no_spot_tells_is_said_with_what_would(corner, tmp_path):
    """Axis 6 wrong by a constant is a tool offset: no spot tells the two apart."""
    line = simulate("kr210_r2700_extra", 60, 0.1, ["joint_zero@6:1"], 3, columns=False)
    for path, content in files_of(line).items():
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_bytes(content)
    subset(tmp_path, set(line.ids[:20]), "first.csv")
    ran("fit", tmp_path / "backup", "--measured", tmp_path / "first.csv", "--noise", 0.1, "-o", tmp_path / "cal.json")
    told = planned(tmp_path, count=4)
    alias = next(pair for pair in told["pairs"] if pair["names"] == ["tool_offset frame tool", "joint_zero axis 6"])
    assert not alias["separable"]
    said = next(issue["message"] for issue in told["issues"] if issue["code"] == "NOT_SEPARABLE")
    assert "joint_zero axis 6" in said
    assert "TCP measured at a fixed tip" in said


def test_a_column_that_is_not_known_of_the_spots(tmp_path):
    """Worn tips follow the welds since the last cap, which only the measured list tells."""
    line = simulate("kr210_r2700_extra", 60, 0.1, ["tip_wear:0.4"], 5)
    for path, content in files_of(line).items():
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_bytes(content)
    subset(tmp_path, set(line.ids[:18]), "first.csv")
    ran("fit", tmp_path / "backup", "--measured", tmp_path / "first.csv", "-o", tmp_path / "cal.json")
    told = planned(tmp_path, count=3)
    assert Calibration.load(tmp_path / "cal.json").information.rivals
    assert told["pairs"] == []
    assert told["not_planned"]
    assert "NOT_PLANNED" in codes(told)
    assert len(told["spots"]) == 3
    assert told["noise_known"] is False
    with_columns = planned(tmp_path, "--covariates", tmp_path / "measured.csv", count=3)
    assert with_columns["pairs"]
    assert with_columns["not_planned"] == []


# --- calibrations without rivals


def test_rivals_that_lose_clearly_already(tmp_path):
    line = simulate("kr210_r2700_extra", 60, 0.1, ["gun_sag:2"], 3, columns=False)
    for path, content in files_of(line).items():
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_bytes(content)
    subset(tmp_path, set(line.ids[:40]), "first.csv")
    ran("fit", tmp_path / "backup", "--measured", tmp_path / "first.csv", "--noise", 0.1, "-o", tmp_path / "cal.json")
    told = planned(tmp_path, count=3)
    said = [issue["message"] for issue in told["issues"] if issue["code"] == "NOTHING_TO_SEPARATE"]
    assert "loses clearly already" in said[0]
    assert len(told["spots"]) == 3
    assert told["parameters"]


def test_every_spot_is_measured_already(respot, theory):
    respot("fit", SAMPLES / "kuka", "--theory", theory, "-o", "cal.json")
    told = respot("plan", SAMPLES / "kuka", "-c", "cal.json", "--count", 3, "--json")
    assert told.code == 0, told.err
    assert told.json["spots"] == []
    assert codes(told.json) == ["FEW_CANDIDATES", "NOTHING_TO_SEPARATE"]
    text = respot("plan", SAMPLES / "kuka", "-c", "cal.json", "--count", 3)
    assert "0 of 0 spots" in text.out
    assert "shrinks" not in text.out
    assert "measured again" in text.err


def test_a_rigid_calibration_gets_the_spots_that_make_it_surer(respot, theory, tmp_path):
    """Six spots side by side are known; the far end of the door is where the transform is least sure."""
    rows = theory.read_text().splitlines()
    names = [line.split(",") for line in rows[1:]]
    near = sorted(names, key=lambda cells: float(cells[1]))[:6]
    (tmp_path / "near.csv").write_text("\n".join([rows[0], *(",".join(cells) for cells in near)]) + "\n")
    respot("fit", SAMPLES / "kuka", "--theory", "near.csv", "--effects", "none", "-o", "cal.json")
    told = respot("plan", SAMPLES / "kuka", "-c", "cal.json", "--count", 1, "--json").json
    assert "NOTHING_TO_SEPARATE" in codes(told)
    assert told["pairs"] == []
    predicted = respot("predict", SAMPLES / "kuka", "-c", "cal.json", "--json").json["spots"]
    worst = max(predicted, key=lambda spot: spot["ci95"])
    assert told["worst"]["id"] == worst["id"]
    assert told["worst"]["before"] == pytest.approx(worst["ci95"])
    assert told["worst"]["after"] < 0.8 * told["worst"]["before"]
    rank = sorted(predicted, key=lambda spot: -spot["ci95"])
    assert told["spots"][0]["id"] in {spot["id"] for spot in rank[:4]}


def test_a_calibration_of_an_older_version(corner, tmp_path, respot):
    record = json.loads((corner / "cal.json").read_text())
    del record["information"], record["information_hash"]
    (tmp_path / "old.json").write_text(json.dumps(record))
    told = respot("plan", corner / "backup", "-c", "old.json", "--count", 2, "--json").json
    said = [issue["message"] for issue in told["issues"] if issue["code"] == "NOTHING_TO_SEPARATE"]
    assert "keeps no rivals" in said[0]
    assert len(told["spots"]) == 2
    del record["precision"], record["precision_hash"]
    (tmp_path / "old.json").write_text(json.dumps(record))
    refused = respot("plan", corner / "backup", "-c", "old.json", "--count", 2)
    assert refused.code == 2
    assert "how sure it is" in refused.err


def test_what_is_kept_of_the_rivals_is_read_back_and_guarded(corner, tmp_path, respot):
    text = (corner / "cal.json").read_text()
    assert Calibration.from_json(text).to_json() == text
    record = json.loads(text)
    record["information"]["rivals"][0]["apart"] += 1.0
    (tmp_path / "changed.json").write_text(json.dumps(record))
    refused = respot("plan", corner / "backup", "-c", "changed.json", "--count", 2)
    assert refused.code == 2
    assert "was changed" in refused.err
    record["information"]["gram"][0].pop()
    (tmp_path / "changed.json").write_text(json.dumps(record))
    assert respot("plan", corner / "backup", "-c", "changed.json", "--count", 2).code == 2


# --- what does not belong together


def test_another_robot_is_refused(corner, respot):
    refused = respot("plan", SAMPLES / "kuka", "-c", corner / "cal.json", "--count", 2)
    assert refused.code == 2
    assert "ANOTHER_ROBOT" in refused.err


@pytest.mark.parametrize("count", ["0", "-3", "many"])
def test_a_count_that_is_none(corner, respot, count):
    assert respot("plan", corner / "backup", "-c", corner / "cal.json", "--count", count).code == 2
