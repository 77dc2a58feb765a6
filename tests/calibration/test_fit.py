from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from respot.calibration import fit_spots, fit_tables
from respot.calibration.effects import EFFECTS
from respot.calibration.effects.naming import naming_evidence
from respot.calibration.report import report
from respot.registration.errors import RegistrationError

SEEDS = st.integers(0, 2**32 - 1)


def near(*values):
    return pytest.approx(values, abs=0.002)


def test_the_numbers_that_must_come_out(points):
    ids, source, reference = points.rear_door()
    order = np.random.default_rng(0).permutation(14)
    result = report(fit_tables(ids, source, [ids[k] for k in order], reference[order]))
    json.dumps(result, allow_nan=False)
    figures = {name: result[name] for name in ("as_found", "before", "after", "after_all")}
    assert (figures["as_found"]["mean"], figures["as_found"]["max"]) == near(76.190, 95.622)
    before, after = figures["before"], figures["after"]
    assert (before["rms"], before["mean"], before["max"]) == near(14.435, 8.875, 40.323)
    assert (after["rms"], after["mean"], after["max"], after["n"]) == near(5.163, 4.488, 9.662, 14)
    assert result["after_all"] == after
    assert result["affine_12"]["rms"] == pytest.approx(14.111, abs=0.002)
    only = result["translation_only"]
    assert (only["rms"], only["max"], only["leave_one_out"]) == near(5.255, 9.239, 5.659)
    assert result["leave_one_out"]["before"] == pytest.approx(16.50, abs=0.005)
    assert result["leave_one_out"]["after"] == pytest.approx(5.78, abs=0.005)
    assert result["n_inliers"] == result["n_matched"] == 14
    assert all(spot["after"] < 10 for spot in result["spots"])
    assert not result["rotation_support"]["supported"]
    assert (result["kind"], result["frame"]) == ("theory", "same")
    assert result["heldout"]["repaired_ids"] == list(points.SWAPPED)


def test_the_exchange_is_one_named_effect_with_its_remedy(points):
    (effect,) = report(fit_spots(*points.rear_door()))["effects"]
    assert effect["name"] == "swapped_ids"
    assert effect["name"] in EFFECTS
    assert effect["where"] == {"ids": list(points.SWAPPED)}
    assert effect["named"] is True
    assert effect["heldout_gain"] == pytest.approx(16.50 - 5.78, abs=0.01)
    assert effect["rivals"][0]["heldout_rms"] > 30
    assert effect["remedy"]["where"] == "spot_list"
    assert "robot programs" in effect["remedy"]["text"]
    assert "not proof" in effect["remedy"]["text"]
    assert "weld schedules" in effect["remedy"]["text"]
    assert effect["evidence"]["wrong_list"] == "source"


def test_a_spot_keeps_its_name_and_its_coordinates(points):
    ids, source, reference = points.rear_door()
    fit = fit_spots(ids, source, reference)
    rows = {spot["id"]: spot for spot in report(fit)["spots"]}
    spot = rows["P02WP1615442"]
    assert spot["reference_id"] == "P02WP1609713"
    assert spot["repaired"]
    calibrated = fit.calibration.rotation @ source[12] + fit.calibration.translation
    np.testing.assert_allclose([spot["x"], spot["y"], spot["z"]], calibrated, atol=1e-9)
    shift = calibrated - reference[13]
    np.testing.assert_allclose([spot["dx"], spot["dy"], spot["dz"]], shift, atol=1e-9)
    assert spot["after"] == pytest.approx(np.linalg.norm(shift))
    assert spot["a"] is None


def test_orientations_turn_with_the_points(points):
    ids, source, reference = points.repaired()
    rotation = points.turn((0, 0, 1), 30)
    reference = points.move(source, rotation, (1, 2, 3))
    tools = Rotation.from_euler("ZYX", [[10, 20, 30]] * 14, degrees=True)
    spot = report(fit_spots(ids, source, reference, source_rotations=tools))["spots"][4]
    assert (spot["a"], spot["b"], spot["c"]) == near(40, 20, 30)
    np.testing.assert_allclose(report(fit_spots(ids, source, reference))["transform"]["abc"], [30, 0, 0], atol=1e-8)


@settings(max_examples=15, deadline=None)
@given(SEEDS)
def test_moving_the_table_and_exchanging_another_pair(points, seed):
    rng = np.random.default_rng(seed)
    ids, source, reference = points.repaired()
    i, j = (int(k) for k in rng.choice(14, 2, replace=False))
    reference = points.move(reference, *points.random_motion(rng))
    reference[[i, j]] = reference[[j, i]]
    result = report(fit_spots(ids, source, reference, kind="measured"))
    assert [set(effect["where"]["ids"]) for effect in result["effects"]] == [{ids[i], ids[j]}]
    assert result["after"]["rms"] == pytest.approx(5.163, abs=0.002)
    assert result["frame"] == "free"


def test_outliers_are_kept_out_and_still_reported(points):
    ids, source, reference = points.repaired()
    reference = reference.copy()
    reference[5] += [0, 0, 60]
    fit = fit_spots(ids, source, reference)
    result = report(fit)
    assert result["n_inliers"] == result["after"]["n"] == 13
    assert result["after_all"]["max"] > 50
    assert result["spots"][5]["inlier"] is False
    assert result["effects"] == []
    assert result["heldout"]["after"]["n"] == 14
    assert result["heldout"]["after"]["max"] > 50 > result["leave_one_out"]["after"]


@pytest.mark.parametrize("n", [8, 14])
def test_95_percent_intervals_hold_the_truth_95_times_in_100(points, n):
    rng = np.random.default_rng(12)
    source = rng.uniform(-1, 1, (n, 3)) * [800, 400, 600]
    rotation = points.turn((1, 1, 0), 40)
    true = points.move(source, rotation, (100, 200, 300))
    held = np.zeros(6)
    runs = 400
    for _ in range(runs):
        fit = fit_spots([str(k) for k in range(n)], source, true + rng.normal(size=true.shape))
        sure = fit.uncertainty
        at = (sure.centroid - fit.calibration.translation) @ fit.calibration.rotation  # that centroid, in the source
        shift = rotation @ at + (100, 200, 300) - sure.centroid
        turn = Rotation.from_matrix(rotation @ fit.calibration.rotation.T).as_rotvec(degrees=True)
        held += np.abs(np.concatenate([shift, turn])) <= sure.half_width
    assert (held / runs > 0.90).all()
    assert (held / runs < 0.985).all()


def test_coplanar_spots_have_no_affine_solution(points):
    ids, source, _ = points.repaired()
    flat = source * [0, 1, 1]
    assert report(fit_spots(ids, flat, flat + 1.0))["affine_12"] is None


def test_the_same_table_twice_is_the_identity(points):
    ids, source, _ = points.repaired()
    result = report(fit_spots(ids, source, source))
    assert result["after"]["max"] < 1e-9
    np.testing.assert_allclose(result["transform"]["rotation"], np.eye(3), atol=1e-12)


def code_of(*arguments, **options):
    with pytest.raises(RegistrationError) as caught:
        fit_tables(*arguments, **options)
    assert str(caught.value)
    return caught.value


def test_bad_tables_have_codes(points):
    ids, source, reference = points.rear_door()
    assert code_of(ids[:3], source[:3], ids, reference).code == "TOO_FEW_PAIRS"
    other = [f"Q{row}" for row in range(14)]
    assert code_of(ids, source, other, reference, matching="id").code == "NO_COMMON_IDS"
    assert code_of(ids, source, other, reference * [1, 2, 3]).code == "NO_COMMON_IDS"
    twice = [*ids[:-1], ids[0]]
    error = code_of(twice, source, ids, reference)
    assert (error.code, error.ids) == ("DUPLICATE_ID", (ids[0],))
    assert "source" in str(error)
    assert "reference" in str(code_of(ids, source, twice, reference))
    broken = reference.copy()
    broken[4, 1] = np.nan
    error = code_of(ids, source, ids, broken)
    assert (error.code, error.ids) == ("NOT_A_NUMBER", (ids[4],))
    assert ids[4] in str(error)
    assert code_of(ids, source, other, broken).code == "NOT_A_NUMBER"
    assert code_of(ids, source, ids, broken, matching="geometry").code == "NOT_A_NUMBER"
    assert code_of(ids, source[:5], ids, reference).code == "SHAPE_MISMATCH"


@pytest.mark.parametrize("stray", [0.0, 0.3, 1.0])
def test_spots_on_a_noisy_line_are_refused(stray):
    rng = np.random.default_rng(3)
    line = np.linspace(0, 900, 10)[:, None] * np.array([[0, 1.0, 0]])
    ids = [str(k) for k in range(10)]
    error = code_of(ids, line + stray * rng.normal(size=line.shape), ids, line + stray * rng.normal(size=line.shape))
    assert error.code == "COLLINEAR_SPOTS"
    assert "not determined" in str(error)


def test_naming_evidence_turns_round_and_stays_silent_without_symmetry(points):
    ids, _, reference = points.rear_door()
    assert naming_evidence((12, 13), ids, reference).wrong_list == "source"
    exchanged = reference.copy()
    exchanged[[12, 13]] = exchanged[[13, 12]]
    assert naming_evidence((12, 13), ids, exchanged).wrong_list == "reference"
    skew = points.move(reference, points.turn((1, 2, 3), 25), (0, 0, 0))
    assert naming_evidence((12, 13), ids, skew).wrong_list == "either"
    assert naming_evidence((12, 13), [f"spot{k}x" for k in range(14)], reference).wrong_list == "either"


def test_without_evidence_the_remedy_says_either_list(points):
    ids, source, reference = points.rear_door()
    moved = points.move(reference, points.turn((1, 2, 3), 25), (0, 0, 0))
    (effect,) = fit_spots(ids, source, moved, kind="measured").effects
    assert "cannot tell which list" in effect.remedy.text
