"""Predicted spots: balls that hold what they say, in a simulation that shares no code with the engine."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from scipy.spatial.transform import Rotation

from respot.calibration import Calibration, CalibrationError, fit_spots
from respot.calibration.ball import ball_radius
from respot.calibration.precision import Precision, direction_share, precision_of, with_precision
from respot.calibration.prediction import extrapolated, predict_spots
from respot.calibration.region import outside
from respot.registration.rigid import fit_rigid


@pytest.mark.parametrize("free", [None, 2.0, 7.5, 36.0])
def test_balls_of_one_two_and_three_equal_axes_are_the_textbooks(free):
    """t, F with 2 and F with 3 degrees of freedom over the scale's own; 1.96 where the scale is known."""
    radii = ball_radius([np.diag([0, 0, 4.0]), np.diag([4.0, 0, 4.0]), 4.0 * np.eye(3), np.zeros((3, 3))], free)
    if free is None:
        wanted = [1.959964, math.sqrt(-2 * math.log(0.05)), 2.795483]
    else:
        wanted = [stats.t.ppf(0.975, free), *(math.sqrt(k * stats.f.ppf(0.95, k, free)) for k in (2, 3))]
    np.testing.assert_allclose(radii, [*(2 * w for w in wanted), 0.0], rtol=2e-6)


@pytest.mark.parametrize("free", [None, 6.0])
def test_a_ball_of_unequal_axes_holds_95_percent(free):
    rng = np.random.default_rng(3)
    root = rng.normal(size=(3, 3)) * [3.0, 0.5, 0.02]
    draws = rng.normal(size=(400_000, 3)) @ root.T
    if free is not None:
        draws /= np.sqrt(rng.chisquare(free, size=(len(draws), 1)) / free)
    (radius,) = ball_radius([root @ root.T], free)
    assert np.mean(np.linalg.norm(draws, axis=1) <= radius) == pytest.approx(0.95, abs=0.002)


def covered(points, n, spread, tables):
    """Shares of tables whose balls hold the true place, and a new measurement: spot of the table, centre, far corner."""
    rng = np.random.default_rng(n)
    spots = rng.uniform([-800, -400, -600], [800, 400, 600], (n, 3))
    asked = np.vstack([spots[:1], np.zeros((1, 3)), [[800.0, 400, 600]]])
    rotation, shift = points.random_motion(rng)
    truth, places = points.move(spots, rotation, shift), points.move(asked, rotation, shift)
    held, held_new = np.zeros(3), np.zeros(3)
    for _ in range(tables):
        fit = fit_rigid(spots, truth + rng.normal(size=truth.shape) * spread)
        sure = precision_of(spots, fit.predict(spots), fit.residuals)
        model = Calibration(fit.rotation, fit.translation, "measured", "free", precision=sure)
        found = predict_spots(model, ["a", "b", "c"], asked)
        held += np.linalg.norm(found.positions - places, axis=1) <= found.ci95
        fresh = places + rng.normal(size=places.shape) * spread
        held_new += np.linalg.norm(found.positions - fresh, axis=1) <= found.ci95_new
    return held / tables, held_new / tables


@pytest.mark.parametrize("n", [8, 14, 100])
@pytest.mark.parametrize("spread", [(0.3, 0.3, 0.3), (0.1, 1.0, 0.4)], ids=["alike", "one-way"])
def test_balls_hold_what_they_say(points, n, spread):
    """500 tables: one standard error is 1 %. With 8 spots balls may hold a little more: the noise's shape is a guess."""
    for shares in covered(points, n, np.array(spread), 500):
        assert np.all((shares > 0.92) & (shares < 0.99)), shares
        assert shares.mean() == pytest.approx(0.955, abs=0.02)


def test_1_96_sigma_would_not():
    """What a one-dimensional interval would hold of the same errors, so that the test above can fail."""
    assert stats.chi2.cdf(1.959964**2, 3) < 0.73


def test_direction_share_by_hand():
    assert direction_share(np.eye(3)) == 1.0
    assert direction_share(np.diag([0.0, 5.0, 0.0])) == pytest.approx(1 / 3)
    assert direction_share(np.diag([1.0, 1.0, 0.0])) == pytest.approx(4 / 6)
    assert direction_share(np.zeros((3, 3))) == 1.0


@pytest.fixture(scope="module")
def door(points):
    return with_precision(fit_spots(*points.repaired()))


def test_the_rear_door(points, door):
    """The scatter of 14 residuals over n - 2: 0.5 / 4.9 / 1.7 mm over n become what they are over n - 2."""
    ids, source, _ = points.repaired()
    found = predict_spots(door, ids, source)
    sd = np.sqrt(np.diag(door.precision.noise))
    np.testing.assert_allclose(sd, np.array([0.5, 4.9, 1.7]) * math.sqrt(14 / 12), atol=0.06)
    assert door.precision.heldout_rms == pytest.approx(5.777, abs=0.002)
    assert door.precision.heldout_n == 14
    assert not found.extrapolated.any()
    assert np.all(found.ci95 < found.ci95_new)
    assert np.all(found.ci95_new > 1.96 * sd[1])


def test_leverage_sums_to_a_third_of_the_parameters(points):
    rng = np.random.default_rng(5)
    spots = rng.uniform(-500, 500, (9, 3))
    fit = fit_rigid(spots, spots + rng.normal(size=spots.shape))
    residuals = rng.normal(size=(9, 3))
    alike = residuals @ np.linalg.inv(np.linalg.cholesky(residuals.T @ residuals)).T  # scatter: a multiple of 1
    sure = precision_of(spots, fit.predict(spots), alike)
    assert sure.leverage_of(sure.covariance_of(fit.predict(spots), None)).sum() == pytest.approx(2.0)
    assert sure.degrees_of_freedom == pytest.approx(21)
    assert sure.sigma**2 == pytest.approx(np.sum(alike**2) / 21)


def test_a_spot_far_from_the_fitted_ones_is_flagged(points, door):
    ids, source, _ = points.repaired()
    far = np.vstack([source[:1] + [0, 0, 700.0], source.mean(axis=0)])
    found = predict_spots(door, ["far", "centre"], far)
    assert found.extrapolated.tolist() == [True, False]
    assert found.ci95[0] > 1.5 * found.ci95[1]
    (issue,) = extrapolated(found)
    assert issue.code == "EXTRAPOLATED"
    assert "1 of 2" in issue.message
    assert "far" in issue.message
    assert extrapolated(predict_spots(door, ids, source)) == []


def test_the_hull_of_spots_in_a_plane_is_the_plane():
    square = np.array([[0, 0, 0], [100, 0, 0], [100, 100, 0], [0, 100, 0.0]])
    turned = Rotation.from_euler("xyz", [20, 30, 40], degrees=True)
    asked = np.array([[50, 50, 0], [0, 0, 0], [50, 50, 5], [101, 50, 0], [150, 50, 0.0]])
    for margin, wanted in ((0.0, [0, 0, 1, 1, 1]), (2.0, [0, 0, 1, 0, 1]), (6.0, [0, 0, 0, 0, 1])):
        assert outside(turned.apply(square) + 1e4, turned.apply(asked) + 1e4, margin).tolist() == wanted
    line = square[:2]
    assert outside(line, np.array([[50.0, 0, 0], [120, 0, 0], [50, 3, 0]])).tolist() == [False, True, True]
    assert outside(line[:1], np.array([[0.0, 0, 0], [1, 0, 0]])).tolist() == [False, True]
    cube = np.array([[x, y, z] for x in (0.0, 1) for y in (0.0, 1) for z in (0.0, 1)]) * 100
    assert outside(cube, np.array([[50.0, 50, 50], [100, 100, 100], [50, 50, 101]])).tolist() == [False, False, True]


def test_a_bootstrap_agrees_where_both_hold_and_is_seeded(points):
    rng = np.random.default_rng(7)
    spots = rng.uniform(-500, 500, (40, 3))
    fit = fit_rigid(spots, spots + 0.3 * rng.normal(size=spots.shape))
    sure = precision_of(spots, fit.predict(spots), fit.residuals)
    model = Calibration(fit.rotation, fit.translation, "measured", "free", precision=sure)
    asked, names = rng.uniform(-500, 500, (5, 3)), list("abcde")
    plain = predict_spots(model, names, asked)
    drawn, again, other = (predict_spots(model, names, asked, bootstrap=2000, seed=seed) for seed in (1, 1, 2))
    np.testing.assert_allclose(drawn.ci95, plain.ci95, rtol=0.08)
    np.testing.assert_allclose(drawn.ci95_new, plain.ci95_new, rtol=0.12)
    assert np.array_equal(drawn.ci95, again.ci95)
    assert not np.array_equal(drawn.ci95, other.ci95)
    with pytest.raises(CalibrationError, match="bootstrap needs"):
        predict_spots(replace(model, precision=None), names, asked, bootstrap=100)


def test_without_precision_there_is_no_interval(door):
    found = predict_spots(replace(door, precision=None), ["p"], [[1.0, 2, 3]])
    assert (found.ci95, found.ci95_new, found.leverage, found.extrapolated) == (None, None, None, None)
    assert found.to_dict()[0]["ci95"] is None
    assert extrapolated(found) == []


def test_a_tool_offset_is_part_of_the_prediction_and_of_its_ball(points):
    """500 fits of 9 parameters by lstsq, written out here: 95 % of the true places lie in their balls."""
    rng = np.random.default_rng(11)
    n, offset = 12, np.array([4.0, -3.0, 7.0])
    spots = rng.uniform(-600, 600, (n, 3))
    tools = Rotation.random(n, rng=rng).as_matrix()
    where, tool = np.array([[300.0, 900, -200]]), Rotation.random(1, rng=rng)
    truth = where[0] + tool.as_matrix()[0] @ offset
    rows = np.zeros((n, 3, 9))
    rows[:, :, :3], rows[:, :, 6:] = np.eye(3), tools
    for i, (x, y, z) in enumerate(spots):
        rows[i, :, 3:6] = [[0, z, -y], [-z, 0, x], [y, -x, 0]]
    held = 0
    for _ in range(500):
        measured = spots + tools @ offset + 0.2 * rng.normal(size=(n, 3))
        turn = np.zeros(3)
        for _ in range(4):  # Gauss-Newton: the turn is small, the columns hardly change
            seen = Rotation.from_rotvec(turn).as_matrix()
            step = np.linalg.lstsq(rows.reshape(-1, 9), (measured - spots @ seen.T).ravel(), rcond=None)[0]
            turn = turn + step[3:6]
        # the turn is a hundredth of a degree: offsets along the tools before and after it are the same
        model = Calibration(seen, step[:3], "measured", "free", tool_offset=step[6:])
        calibrated = model.predict(spots, Rotation.from_matrix(tools))[0]
        sure = precision_of(spots, calibrated, calibrated - measured, seen @ tools)
        found = predict_spots(replace(model, precision=sure), ["p"], where, tool)
        held += np.linalg.norm(found.positions[0] - truth) <= found.ci95[0]
    assert held / 500 == pytest.approx(0.955, abs=0.03)
    with pytest.raises(CalibrationError) as caught:
        predict_spots(model, ["p"], where)
    assert caught.value.code == "CALIBRATION_NEEDS_ORIENTATION"


@pytest.mark.parametrize(
    "wrong",
    [
        {"covariance": np.eye(5)},
        {"covariance": -np.eye(6)},
        {"covariance": np.triu(np.ones((6, 6)))},
        {"covariance": np.full((6, 6), np.nan)},
        {"centroid": np.zeros(2)},
        {"noise": np.diag([1.0, -1.0, 1.0])},
        {"noise": np.eye(2)},
        {"degrees_of_freedom": 0.0},
        {"regions": ()},
        {"regions": (np.zeros((0, 3)),)},
        {"residuals": np.zeros((1, 3))},
        {"heldout_rms": -1.0, "heldout_n": 4},
        {"heldout_rms": 1.0, "heldout_n": 0},
    ],
    ids=lambda wrong: " ".join(wrong),
)
def test_a_precision_that_is_none_is_refused(wrong):
    good = {"covariance": np.eye(6), "centroid": np.zeros(3), "noise": np.eye(3), "degrees_of_freedom": 6.0}
    Precision(**good, regions=(np.eye(3),))
    with pytest.raises(ValueError, match=r"must|not|negative"):
        Precision(**{**good, "regions": (np.eye(3),), **wrong})
