"""Laws of terms and of the joint fit: derivatives, order of rows, frames, models that are saved."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from respot.calibration.calibration import Calibration, CalibrationError
from respot.calibration.discovery.discover import discover
from respot.calibration.discovery.joint_fit import fit_jointly
from respot.calibration.effects.catalogue import MECHANISMS, terms_of
from respot.calibration.effects.moved import moved, unmoved
from respot.calibration.effects.term import Term
from respot.registration.rigid import fit_rigid
from respot.simulation import simulate
from tests.discovery.lines import NOISE, look, observations_of

LINE = simulate("kr210_r2700_extra", 30, NOISE, (), 3, rail=True)
SEEN = observations_of(LINE)


def one_of_each() -> list[Term]:
    """The first term of each effect and form."""
    found: dict[tuple[object, ...], Term] = {}
    for term in terms_of(SEEN):
        shape = tuple(sorted((key, value) for key, value in term.form.items() if isinstance(value, str)))
        found.setdefault((term.effect, len(term.parameters), shape), term)
    return list(found.values())


@pytest.mark.parametrize("term", one_of_each(), ids=lambda term: f"{term.label} {len(term.parameters)}")
def test_columns_are_the_derivative_of_the_motion(term):
    shifts = MECHANISMS[term.effect].shifts(SEEN, term)
    assert shifts.shape == (30, 3, len(term.parameters))
    for column, parameter in enumerate(term.parameters):
        step = np.zeros(len(term.parameters))
        step[column] = 1e-3 * parameter.prior
        ahead, behind = (moved(SEEN, [term], [sign * step])[0] for sign in (1.0, -1.0))
        slope = (ahead - behind) / (2.0 * step[column])
        assert np.abs(slope - shifts[:, :, column]).max() < 1e-4 * max(1.0, np.abs(slope).max())


@pytest.mark.parametrize("term", one_of_each(), ids=lambda term: f"{term.label} {len(term.parameters)}")
def test_nothing_moves_by_zero_and_back_is_back(term):
    still, _ = moved(SEEN, [term], [np.zeros(len(term.parameters))])
    assert np.abs(still - SEEN.positions).max() < 1e-9
    dice = np.random.default_rng(1)
    value = dice.normal(size=len(term.parameters)) * 0.1 * np.array([p.prior for p in term.parameters])
    there, _ = moved(SEEN, [term], [value])
    back = unmoved(SEEN, [term], [value], there)
    again, _ = moved(replace(SEEN, positions=back), [term], [value])
    assert np.abs(again - there).max() < 1e-9


def test_effects_that_are_too_large_to_undo_are_said():
    term = next(term for term in terms_of(SEEN) if term.effect == "scale")
    with pytest.raises(ValueError, match="so large"):
        unmoved(SEEN, [term], [np.array([2500.0])], SEEN.positions)


def test_a_joint_that_stands_wrong_moves_the_tool_as_the_arm_does():
    term = next(term for term in terms_of(SEEN) if term.effect == "joint_zero" and term.where == {"axis": 3})
    points, rotations = moved(SEEN, [term], [np.array([5.0])])
    assert SEEN.robot is not None and SEEN.joints is not None and rotations is not None
    tool = SEEN.flange2base.inv() * __import__(
        "scipy.spatial.transform", fromlist=["RigidTransform"]
    ).RigidTransform.from_components(SEEN.points_in_base, SEEN.rotations)
    turned = SEEN.joints + np.array([0.0, 0.0, 5.0, 0.0, 0.0, 0.0])
    there = SEEN.base2source * SEEN.robot.forward(turned) * tool
    assert np.abs(np.asarray(there.translation) - points).max() < 1e-9
    assert np.abs((there.rotation.inv() * rotations).magnitude()).max() < 1e-9


def test_the_order_of_rows_changes_nothing():
    line = simulate("kr210_r2700_extra", 70, NOISE, ("joint_zero@3:1", "tip_wear:1"), 9)
    seen = observations_of(line)
    order = np.random.default_rng(4).permutation(70)
    one = discover(seen, line.measured, noise=NOISE, draws=199, nested=False)
    other = discover(seen.rows(order), line.measured[order], noise=NOISE, draws=199, nested=False)
    assert [each.term.label for each in one.accepted] == [each.term.label for each in other.accepted]
    for mine, theirs in zip(one.accepted, other.accepted, strict=True):
        assert np.allclose(mine.values, theirs.values, rtol=1e-6, atol=1e-9)


def test_the_frame_of_the_reference_changes_nothing():
    line = simulate("kr210_r2700_extra", 70, NOISE, ("joint_zero@3:1", "group_shift@station:1"), 9)
    seen = observations_of(line)
    turn = Rotation.from_euler("ZYX", [70.0, -20.0, 130.0], degrees=True)
    one = discover(seen, line.measured, noise=NOISE, draws=199, nested=False)
    other = discover(seen, turn.apply(line.measured) + [500.0, -9000.0, 40.0], noise=NOISE, draws=199, nested=False)
    assert [each.term.label for each in one.accepted] == [each.term.label for each in other.accepted]
    for mine, theirs in zip(one.accepted, other.accepted, strict=True):
        assert np.allclose(mine.values, theirs.values, rtol=1e-5, atol=1e-7)


def test_without_effects_the_joint_fit_is_least_squares():
    inliers = np.ones(30, dtype=bool)
    fit = fit_jointly(SEEN, LINE.measured, (), inliers)
    rigid = fit_rigid(SEEN.positions, LINE.measured)
    assert np.allclose(fit.rotation, rigid.rotation, atol=1e-9)
    assert np.allclose(fit.translation, rigid.translation, atol=1e-6)
    assert fit.free == pytest.approx(84.0)


def test_intervals_scale_with_the_noise():
    seen = look("joint_zero@3:1", seed=31)
    fit = seen.found.fit
    quiet = fit.moved @ fit.rotation.T + fit.translation - 0.5 * fit.residuals
    half = fit_jointly(seen.observations, quiet, fit.terms, fit.inliers)
    assert half.value_sd[0][0] == pytest.approx(0.5 * fit.value_sd[0][0], rel=0.01)


def calibration_of(seen) -> Calibration:
    fit = seen.found.fit
    from respot.kinematics.robot_file import robot_record

    return Calibration(
        fit.rotation,
        fit.translation,
        "measured",
        "free",
        seen.line.ids,
        terms=fit.terms,
        values=fit.values,
        robot=robot_record(seen.observations.robot),
    )


@pytest.fixture(scope="module")
def calibrated():
    seen = look("joint_zero@3:1", "tip_wear:1", seed=12)
    return seen, calibration_of(seen)


def test_a_calibration_with_effects_comes_back_from_its_file(calibrated, tmp_path):
    seen, model = calibrated
    model.save(tmp_path / "cal.json")
    again = Calibration.load(tmp_path / "cal.json")
    assert again.content_hash == model.content_hash
    at = seen.observations
    mine, theirs = (m.predict(at.positions, at.rotations, at)[0] for m in (model, again))
    assert np.array_equal(mine, theirs)
    assert json.loads((tmp_path / "cal.json").read_text())["schema"] == "respot.calibration/3"


def test_prediction_and_back(calibrated):
    seen, model = calibrated
    at = seen.observations
    there, turned = model.predict(at.positions, at.rotations, at)
    assert np.sqrt(np.mean(np.sum((there - seen.line.measured_true) ** 2, axis=1))) < 0.08
    assert turned is not None
    assert np.abs(model.unpredict(there, at.rotations, at) - at.positions).max() < 1e-9


def test_what_a_calibration_with_effects_cannot_do_is_refused(calibrated, tmp_path):
    seen, model = calibrated
    for wrong in (model.inverse, lambda: model.compose(model), lambda: model.predict(seen.line.positions)):
        with pytest.raises(CalibrationError) as caught:
            wrong()
        assert caught.value.code == "CALIBRATION_EFFECTS"
    blind = replace(seen.observations, columns={})
    with pytest.raises(CalibrationError, match="welds_since_cap"):
        model.predict(blind.positions, blind.rotations, blind)
    record = json.loads(model.to_json())
    record["effects"][0]["values"][0] += 0.001
    with pytest.raises(CalibrationError) as caught:
        Calibration.from_json(json.dumps(record))
    assert caught.value.code == "CALIBRATION_CHANGED"
    record = json.loads(model.to_json())
    record["effects"][0]["effect"] = "witchcraft"
    with pytest.raises(CalibrationError):
        Calibration.from_json(json.dumps(record))


def test_an_effect_can_be_left_out(calibrated):
    seen, model = calibrated
    wear = [term for term in model.terms if term.effect == "tip_wear"]
    bare = model.without(wear)
    assert [term.effect for term in bare.terms] == ["joint_zero"]
    blind = replace(seen.observations, columns={})
    bare.predict(blind.positions, blind.rotations, blind)


@pytest.mark.parametrize("effect", ["group_shift", "drift", "warmup", "link_geometry"])
def test_a_body_that_turns_takes_its_tools_along(effect):
    """Two points of one tool move as the turned tool says."""
    term = next(t for t in terms_of(SEEN) if t.effect == effect and len(t.parameters) > 5)
    dice = np.random.default_rng(2)
    value = 1e-2 * dice.normal(size=len(term.parameters)) * np.array([p.prior for p in term.parameters])
    tip = np.array([0.0, 0.0, 100.0])
    points, rotations = moved(SEEN, [term], [value])
    assert SEEN.rotations is not None and rotations is not None
    ahead = replace(SEEN, positions=SEEN.positions + SEEN.rotations.apply(tip))
    there, _ = moved(ahead, [term], [value])
    assert np.abs(there - points - rotations.apply(tip)).max() < 1e-3
