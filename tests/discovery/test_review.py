"""What a hostile reading of discovery found: columns that change their kind or leave their range, files with errors."""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace

import numpy as np
import pytest

from respot.calibration.calibration import Calibration, CalibrationError
from respot.calibration.covariates import Covariate, covariates_of
from respot.calibration.discovery.discover import discover
from respot.calibration.effects.catalogue import terms_of
from respot.calibration.effects.moved import beyond, missing
from respot.calibration.observations import Observations
from respot.calibration.prediction import predict_spots
from respot.simulation import simulate
from tests.discovery.lines import NOISE, observations_of

LINE = simulate("kr210_r2700_extra", 30, NOISE, (), 3, rail=True)
SEEN = observations_of(LINE)


def first(effect, **form):
    return next(t for t in terms_of(SEEN) if t.effect == effect and form.items() <= t.form.items())


def column(name, role, values=None, labels=None):
    columns = {**SEEN.columns, name: Covariate(name, role, values, labels)}
    return replace(SEEN, columns=columns)


@pytest.mark.parametrize("role", ["other", "counter", "force", "temperature", "group", "time"])
@pytest.mark.parametrize("value", [0.0, 3.0])
def test_column_that_is_the_same_at_all_pairs_is_not_tried(role, value):
    columns = {"k": Covariate("k", role, np.full(30, value), None)}
    plain = Observations(SEEN.positions, SEEN.rotations, columns=columns)
    assert not [term for term in terms_of(plain) if term.own == "k"]
    discover(plain, LINE.measured, noise=NOISE, draws=19, nested=False)


def test_long_whole_numbers_stay_apart():
    values = np.repeat([1234567.0, 1234568.0], 5)
    found, _ = covariates_of({"program": [f"{v:.0f}" for v in values]}, {"program": values}, ())
    assert found["program"].levels == ("1234567", "1234568")


def test_measured_joints_of_another_number_of_axes_are_not_used():
    seven = replace(SEEN, measured_joints=np.zeros((30, 7)))
    assert not [term for term in terms_of(seven) if term.effect == "readback_lag"]
    assert missing(seven, first("readback_lag")) == "measured joints"


def test_what_a_term_needs_must_be_known_at_every_spot():
    holes = SEEN.measured_joints.copy()
    holes[4] = np.nan
    assert missing(replace(SEEN, measured_joints=holes), first("readback_lag"))
    travel = SEEN.external_axes.copy()
    travel[:, 0] = np.nan
    assert missing(replace(SEEN, external_axes=travel), first("rail"))
    backlash = first("backlash")
    others = {name: each for name, each in SEEN.columns.items() if name != backlash.own}
    assert missing(replace(SEEN, columns=others), backlash) == f"the column {backlash.own}"


def test_column_of_another_kind_is_missing():
    shift, wear = first("group_shift"), first("tip_wear")
    assert "as groups" in missing(column(shift.where["column"], "group", np.arange(30.0)), shift)
    assert "as numbers" in missing(column(wear.where["column"], "counter", None, ("x",) * 30), wear)


@pytest.mark.parametrize("effect", ["drift", "warmup", "tip_wear", "gun_deflection"])
def test_column_outside_its_range_is_extrapolated(effect):
    term = first(effect)
    assert not beyond(SEEN, term).any()
    name = term.where["column"]
    values = SEEN.columns[name].values + 0.0
    values[7] -= 1e5
    far = column(name, SEEN.columns[name].role, values)
    assert np.flatnonzero(beyond(far, term)).tolist() == [7]


def test_angles_and_travel_outside_their_range_are_extrapolated():
    profile, rail = first("joint_profile", powers=4), first("rail")
    assert not beyond(SEEN, profile).any() and not beyond(SEEN, rail).any()
    assert beyond(replace(SEEN, joints=SEEN.joints + 400.0), profile).all()
    assert beyond(replace(SEEN, external_axes=SEEN.external_axes + 1e5), rail).all()


def test_prediction_says_which_spots_are_extrapolated():
    time = np.arange(30.0)
    seen = Observations(SEEN.positions, columns={"time": Covariate("time", "time", time, None)})
    measured = SEEN.positions + np.outer(time, [0.1, 0.0, 0.0])
    found = discover(seen, measured, noise=NOISE, draws=199, nested=False, effects=frozenset({"drift"}))
    assert [each.term.effect for each in found.accepted] == ["drift"]
    from respot.calibration.precision import Precision

    size = 6 + len(found.fit.priors)
    sure = Precision(np.eye(size) * 1e-4, np.zeros(3), np.eye(3) * NOISE**2, 30.0, (SEEN.positions,))
    model = Calibration(
        found.fit.rotation,
        found.fit.translation,
        "measured",
        "free",
        terms=found.fit.terms,
        values=found.fit.values,
        precision=sure,
    )
    late = replace(seen, columns={"time": Covariate("time", "time", time + 60.0 * (time > 20), None)})
    ids = [str(number) for number in range(30)]
    assert not predict_spots(model, ids, seen.positions, None, seen).extrapolated.any()
    assert predict_spots(model, ids, seen.positions, None, late).extrapolated.tolist() == (time > 20).tolist()


def with_effects(**changes):
    term = first("joint_zero")
    model = Calibration(np.eye(3), np.zeros(3), "measured", "free", terms=(term,), values=(np.array([0.1]),))
    return {**json.loads(model.to_json()), **changes}


@pytest.mark.parametrize("robot", ["abc", 3, [1], float("nan"), {"convention": "opw"}, {"a1": float("nan")}])
def test_robot_that_was_changed_by_hand_is_refused(robot):
    with pytest.raises(CalibrationError) as caught:
        Calibration.from_json(json.dumps(with_effects(robot=robot)))
    assert caught.value.code in ("CALIBRATION_INCOMPLETE", "CALIBRATION_CHANGED")


def test_robot_that_is_none_is_refused_though_its_hash_is_right():
    record = with_effects(robot={"convention": "dh", "link": []})
    content = {key: record[key] for key in ("effects", "robot", "schema", "kind", "frame", "rotation", "translation")}
    text = json.dumps({**content, "ids": []}, sort_keys=True, separators=(",", ":"))
    record["hash"] = hashlib.sha256(text.encode()).hexdigest()
    with pytest.raises(CalibrationError) as caught:
        Calibration.from_json(json.dumps(record))
    assert caught.value.code == "CALIBRATION_INCOMPLETE"


def test_effect_with_numbers_that_are_none_is_refused():
    record = with_effects()
    record["effects"][0]["parameters"][0]["prior"] = float("nan")
    with pytest.raises(CalibrationError) as caught:
        Calibration.from_json(json.dumps(record))
    assert caught.value.code == "CALIBRATION_INCOMPLETE"
