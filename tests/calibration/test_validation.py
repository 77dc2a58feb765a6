"""Fresh measurements against a calibration: tolerance, and the promise of the held-out error."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from respot.calibration import Calibration, fit_spots
from respot.calibration.precision import precision_of, with_precision
from respot.calibration.validation import promise_of, validate_spots
from respot.registration.errors import RegistrationError
from respot.registration.leave_one_out import leave_one_out
from respot.registration.rigid import fit_rigid


@pytest.fixture(scope="module")
def box(points):
    """A stored calibration of 20 spots at 0.3 mm noise, its spots and where they truly are."""
    rng = np.random.default_rng(1)
    spots = rng.uniform([-800, -400, -600], [800, 400, 600], (20, 3))
    rotation, shift = points.random_motion(rng)
    truth = points.move(spots, rotation, shift)
    ids = [f"P{n}" for n in range(20)]
    fit = fit_spots(ids, spots, truth + 0.3 * rng.normal(size=truth.shape), kind="measured")
    return with_precision(fit), ids, spots, truth


def test_figures_by_hand():
    model = Calibration(np.eye(3), np.array([10.0, 0, 0]), "theory", "same")
    source = [[0.0, 0, 0], [100, 0, 0], [0, 100, 0]]
    reference = [[10.0, 3, 4], [110, 0, 0], [10, 100, -12]]
    found = validate_spots(model, ["a", "b", "c"], source, reference, tolerance=5.0)
    record = found.to_dict()
    assert (record["n"], record["max"], record["out_of_tolerance"]) == (3, 12.0, ["c"])
    assert record["mean"] == pytest.approx(17 / 3)
    assert record["rms"] == pytest.approx(((25 + 144) / 3) ** 0.5)
    assert [spot["distance"] for spot in record["spots"]] == [5.0, 0.0, 12.0]
    assert (record["spots"][0]["dy"], record["spots"][0]["dz"]) == (-3.0, -4.0)
    assert (record["kept"], record["heldout_promise"]["rms"]) == (None, None)
    assert "no promise" in record["kept_test"]["verdict"]


def test_nothing_is_fitted(box):
    """The same shift on every spot, which a fit would take out, is an error here."""
    model, ids, spots, truth = box
    found = validate_spots(model, ids, spots, truth + [2.0, 0, 0], tolerance=1.0)
    assert len(found.out_of_tolerance) == 20
    assert found.figures.mean == pytest.approx(2.0, abs=0.3)
    assert found.promise.kept is False
    assert "NOT kept" in found.promise.verdict


def test_a_promise_is_broken_by_chance_as_seldom_as_said():
    """600 tables, and fresh measurements of the same spots under the same noise; 5 % is 30, and 3 sigma more is 46."""
    rng = np.random.default_rng(2)
    broken = 0
    spots = rng.uniform(-500, 500, (14, 3))
    for spread in ([0.3, 0.3, 0.3], [0.1, 1.0, 0.4]) * 300:
        reference = spots + rng.normal(size=spots.shape) * spread
        fit = fit_rigid(spots, reference)
        left_out = np.sqrt(np.mean(np.sum(leave_one_out(spots, reference) ** 2, axis=1)))
        sure = precision_of(spots, fit.predict(spots), fit.residuals)
        sure = replace(sure, heldout_rms=float(left_out), heldout_n=14)
        model = Calibration(fit.rotation, fit.translation, "measured", "free", precision=sure)
        fresh = spots + rng.normal(size=spots.shape) * spread
        broken += promise_of(model, model.predict(spots)[0] - fresh).kept is False
    assert 6 <= broken <= 46


def test_twice_the_noise_breaks_it(box):
    model, ids, spots, truth = box
    rng = np.random.default_rng(3)
    same, twice = (size * rng.normal(size=truth.shape) for size in (0.3, 0.6))
    assert validate_spots(model, ids, spots, truth + same).promise.kept is True
    kept = validate_spots(model, ids, spots, truth + twice).promise
    assert kept.kept is False
    assert kept.p_value < 0.001


def test_smaller_errors_keep_it(box):
    model, ids, spots, truth = box
    promise = validate_spots(model, ids, spots, truth).promise
    assert promise.kept is True
    assert promise.f_value < 1
    perfect = replace(model, precision=replace(model.precision, heldout_rms=0.0))
    assert promise_of(perfect, np.zeros((3, 3))).kept is True
    assert promise_of(perfect, np.ones((3, 3))).kept is False


def test_one_fresh_spot_is_enough(box):
    model, ids, spots, truth = box
    assert validate_spots(model, ids[:1], spots[:1], truth[:1]).promise.kept is True


def test_shapes_are_checked(box):
    model, ids, spots, truth = box
    for arguments in ((ids[:3], spots, truth), (ids, spots, truth[:3]), ([], np.zeros((0, 3)), np.zeros((0, 3)))):
        with pytest.raises(RegistrationError):
            validate_spots(model, *arguments)
