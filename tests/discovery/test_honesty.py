"""Nothing is claimed that the spots do not show."""

from __future__ import annotations

import numpy as np
import pytest

from respot.calibration.covariates import Covariate, covariates_of
from respot.calibration.discovery.discover import discover
from respot.calibration.discovery.records import effects_of, hidden_of, measure_next_of, questions_of
from respot.registration.robust import fit_robust
from respot.simulation import simulate
from tests.discovery.lines import NOISE, look, observations_of


@pytest.mark.parametrize("seed", range(4))
def test_nothing_there_is_said(seed):
    seen = look(seed=100 + seed, spots=60)
    assert seen.found.accepted == ()
    assert not seen.found.unexplained.present
    assert len(seen.found.tried) > 10


@pytest.mark.parametrize("effect", ["joint_zero@1", "link_length@c1", "joint_zero@6", "link_length@c4"])
def test_what_the_rigid_part_or_the_tool_swallows_is_never_named(effect):
    seen = look(f"{effect}:2", seed=7)
    name, _, place = effect.partition("@")
    assert not [each for each in seen.found.accepted if each.named]
    assert not [each for each in seen.found.accepted if each.term.effect == name]
    key = "axis" if name == "joint_zero" else "parameter"
    hidden = {(each["name"], str(each["where"].get(key))) for each in hidden_of(seen.found)}
    assert (name, place) in hidden


def test_a_tool_offset_is_not_told_from_the_last_axis():
    seen = look("joint_zero@6:1", seed=7)
    assert [each.term.effect for each in seen.found.accepted] == ["tool_offset"]
    assert {term.effect for term in seen.found.accepted[0].not_separated} >= {"joint_zero"}


def test_no_name_without_a_known_noise():
    seen = look("joint_zero@3:1", seed=31, noise=None)
    assert seen.effects == ["joint_zero"]
    assert not seen.found.accepted[0].named
    assert any("--noise" in text for text in measure_next_of(seen.found))


def test_no_name_where_the_floor_is_not_reached():
    seen = look("joint_zero@3:1", seed=31, noise=NOISE / 3.0)
    assert seen.found.unexplained.present
    assert not any(each.named for each in seen.found.accepted)


@pytest.mark.parametrize("effect", ["axis_scale", "gun_flex", "refraction", "hvac", "cable_drag", "floor"])
def test_an_effect_outside_of_the_catalogue_gets_no_wrong_name(effect):
    seen = look(f"{effect}:1.5", seed=3, spots=120)
    column = seen.line.truth[0]["where"].get("column")
    wrong = [each for each in seen.found.accepted if each.named and each.term.where.get("column") != column]
    assert not wrong
    right = column is not None and any(each.term.where.get("column") == column for each in seen.found.accepted)
    assert seen.found.unexplained.present or right


def test_columns_of_all_kinds_do_no_harm():
    line = simulate("kr210_r2700_extra", 60, NOISE, (), 41)
    dice = np.random.default_rng(5)
    count = len(line.ids)
    texts = {
        "constant": ["7"] * count,
        "mixed": [str(k) if k % 3 else "n/a?" for k in range(count)],
        "dates": [("2026-11-%02d", "%02d.11.2026", "11/%02d/2026")[k % 3] % (1 + k % 25) for k in range(count)],
        "timestamp": [f"2026-11-0{1 + k // 30} {8 + k % 12}:{k % 60:02d}" for k in range(count)],
        "number": [str(k + 1) for k in range(count)],
        "remark": [f"text {k}" for k in range(count)],
        "empty": [""] * count,
        "colour": [("red", "green")[k] for k in dice.integers(2, size=count)],
    }
    numbers = {"constant": np.full(count, 7.0), "number": np.arange(1.0, count + 1.0)}
    columns, unused = covariates_of(texts, numbers, ())
    assert set(columns) == {"timestamp", "number", "colour"}
    assert set(unused) == {"constant", "mixed", "dates", "remark", "empty"}
    assert "read in one way" in unused["dates"]
    assert columns["timestamp"].role == "time"
    seen = observations_of(line)
    from dataclasses import replace

    found = discover(replace(seen, columns=columns), line.measured, noise=NOISE, draws=199, nested=False)
    assert found.accepted == ()


def test_dates_are_minutes_however_they_are_written():
    columns, _ = covariates_of({"time": ["01.12.2026 06:00", "01.12.2026 07:30", "02.12.2026 06:00"]}, {}, ())
    assert np.diff(columns["time"].values).tolist() == [90.0, 1350.0]


def test_day_and_month_that_can_be_read_both_ways_are_refused():
    columns, unused = covariates_of({"date": ["01/02/2026", "03/04/2026", "05/06/2026"]}, {}, ())
    assert not columns
    assert "one way" in unused["date"]


def test_outliers_beside_an_effect():
    line = simulate("kr210_r2700_extra", 100, NOISE, ("joint_zero@3:1.2",), 17)
    seen, measured = observations_of(line), line.measured.copy()
    dice = np.random.default_rng(3)
    bad = dice.permutation(100)[:10]
    way = dice.normal(size=(10, 3))
    measured[bad] += way / np.linalg.norm(way, axis=1)[:, None] * dice.uniform(5.0, 40.0, 10)[:, None]
    start = fit_robust(seen.positions, measured).inliers
    found = discover(seen, measured, inliers=start, noise=NOISE, draws=199, nested=False)
    assert [each.term.effect for each in found.accepted] == ["joint_zero"]
    assert set(np.flatnonzero(~found.fit.inliers)) == set(bad)


@pytest.mark.parametrize("region", [False, True])
def test_missing_spots(region):
    line = simulate("kr210_r2700_extra", 100, NOISE, ("tip_wear:1.2",), 18)
    gone = line.positions[:, 1] > np.quantile(line.positions[:, 1], 0.7)
    if not region:
        gone = np.random.default_rng(2).permutation(gone)
    seen = look("tip_wear:1.2", seed=18, spots=100, rows=np.flatnonzero(~gone))
    assert seen.effects == ["tip_wear"]


def test_a_few_spots_are_told_how_many_are_missing():
    asked = questions_of(None, 7, None)
    assert asked[0]["missing"] == 3


def test_a_group_that_moved_far_is_no_crowd_of_outliers():
    seen = look("group_shift@station:6", seed=23, spots=120)
    assert seen.effects == ["group_shift"]
    assert seen.found.fit.inliers.sum() >= 118


def test_two_columns_that_say_the_same_are_rivals():
    line = simulate("kr210_r2700_extra", 90, NOISE, ("group_shift@station:1.5",), 29)
    seen = observations_of(line)
    station = seen.columns["station"]
    twin = Covariate("cell", "group", None, tuple(f"C{label}" for label in station.labels or ()))
    from dataclasses import replace

    both = replace(seen, columns={**seen.columns, "cell": twin})
    found = discover(both, line.measured, noise=NOISE, draws=199, nested=False)
    first = found.accepted[0]
    assert not first.named
    other = "cell" if first.term.where["column"] == "station" else "station"
    assert any(term.where.get("column") == other for term in first.not_separated)


def test_records_say_everything_a_report_needs():
    seen = look("joint_zero@3:1.0", seed=31)
    effect = effects_of(seen.found)[0].to_dict()
    assert effect["where"] == {"axis": 3}
    assert effect["parameters"]["offset"]["unit"] == "deg"
    low, high = effect["parameters"]["offset"]["ci95"]
    assert low < effect["parameters"]["offset"]["value"] < high
    assert effect["remedy"]["where"] == "robot"
    assert {"name", "heldout_rms"} == set(effect["rivals"][0])
    assert effect["heldout_gain"] > 0.3
