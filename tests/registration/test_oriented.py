"""Positions and orientations fitted together: laws, other solvers, and what it brings where positions say little."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import optimize
from scipy.spatial.transform import Rotation

from respot.registration.errors import DegenerateError, RegistrationError
from respot.registration.oriented import fit_rigid_oriented
from respot.registration.rigid import fit_rigid

SEEDS = st.integers(0, 2**32 - 1)


def turns(rng, n, degrees):
    return Rotation.from_rotvec(np.radians(degrees) * rng.normal(size=(n, 3)))


def poses(rng, n, mm=0.3, degrees=0.2, size=(800, 400, 600)):
    """Source, reference, their orientations, and the true motion; noise on the reference's side."""
    source, own = rng.uniform(-1, 1, (n, 3)) * size + [3000, 0, 1000], Rotation.random(n, rng=rng)
    motion, shift = Rotation.random(rng=rng), rng.uniform(-2000, 2000, 3)
    reference = motion.apply(source) + shift + mm * rng.normal(size=(n, 3))
    return source, reference, own, turns(rng, n, degrees) * motion * own, (motion, shift)


def error(fit, source, motion):
    turned, shift = motion
    return np.linalg.norm(fit.rigid.predict(source) - turned.apply(source) - shift, axis=1).max()


def test_against_another_minimiser():
    """The sum of squares in geodesic turns, by a general solver: the same up to the fourth power of 0.2 degrees."""
    rng = np.random.default_rng(1)
    source, reference, own, other, _ = poses(rng, 6)
    fit = fit_rigid_oriented(source, reference, own, other, 0.3, 0.2)
    middle, start = source.mean(axis=0), Rotation.from_matrix(fit.rigid.rotation)

    def misses(x):
        turn = Rotation.from_rotvec(x[3:] / 1000) * start
        apart = turn.apply(source - middle) + x[:3] + reference.mean(axis=0) - reference
        return np.concatenate(
            [(apart / 0.3).ravel(), ((turn * own * other.inv()).as_rotvec() / np.radians(0.2)).ravel()]
        )

    best = optimize.least_squares(misses, np.zeros(6), xtol=1e-15, ftol=1e-15, gtol=1e-15)
    np.testing.assert_allclose(best.x, 0.0, atol=1e-4)  # mm, and thousandths of a radian
    known = np.linalg.inv(best.jac.T @ best.jac) / np.outer([1, 1, 1, 1e3, 1e3, 1e3], [1, 1, 1, 1e3, 1e3, 1e3])
    sizes = np.sqrt(np.outer(np.diag(known), np.diag(known)))
    np.testing.assert_allclose(fit.covariance / sizes, known / sizes, atol=1e-3)
    assert fit.degrees_of_freedom == 30
    assert (fit.sigma_mm, fit.sigma_deg) == (0.3, 0.2)


@settings(max_examples=25, deadline=None)
@given(SEEDS, st.sampled_from([1, 2, 3, 5, 14]), st.booleans())
def test_moving_and_reordering_move_the_answer(points, seed, n, known):
    rng = np.random.default_rng(seed)
    source, reference, own, other, _ = poses(rng, n)
    sigmas = (0.3, 0.2) if known or n < 4 else (None, None)
    (a, s), (b, t) = points.random_motion(rng), points.random_motion(rng)
    order = rng.permutation(n)
    fit = fit_rigid_oriented(source, reference, own, other, *sigmas)
    moved = fit_rigid_oriented(
        points.move(source, a, s)[order],
        points.move(reference, b, t)[order],
        (Rotation.from_matrix(a) * own)[order],
        (Rotation.from_matrix(b) * other)[order],
        *sigmas,
    )
    np.testing.assert_allclose(moved.rigid.rotation, b @ fit.rigid.rotation @ a.T, atol=1e-7)
    np.testing.assert_allclose(moved.rigid.residuals, fit.rigid.residuals[order] @ b.T, atol=1e-4)
    np.testing.assert_allclose(moved.turns, fit.turns[order] @ b.T, atol=1e-5)
    assert np.array_equal(moved.agree, fit.agree[order])
    assert (moved.sigma_mm, moved.sigma_deg) == pytest.approx((fit.sigma_mm, fit.sigma_deg), rel=1e-4)
    both = np.kron(np.eye(2), b)
    np.testing.assert_allclose(
        moved.covariance, both @ fit.covariance @ both.T, rtol=1e-3, atol=1e-6 * np.abs(fit.covariance).max()
    )


@settings(max_examples=25, deadline=None)
@given(SEEDS, st.integers(3, 30))
def test_orientations_without_weight_leave_least_squares(seed, n):
    rng = np.random.default_rng(seed)
    source, reference, own, _, _ = poses(rng, n)
    other = Rotation.random(n, rng=rng)  # anything at all
    plain = fit_rigid(source, reference)
    for fit in (
        fit_rigid_oriented(source, reference, own, other, sigma_deg=np.inf),
        fit_rigid_oriented(source, reference, own, other, 1e-3, 1e6),
    ):
        np.testing.assert_allclose(fit.rigid.rotation, plain.rotation, atol=1e-8)
        np.testing.assert_allclose(fit.rigid.translation, plain.translation, atol=1e-4)
        np.testing.assert_allclose(fit.rigid.residuals, plain.residuals, atol=1e-4)
        np.testing.assert_allclose(fit.rigid.spread, plain.spread, atol=1e-4)
        assert (fit.rigid.rank, fit.rigid.mirrored) == (plain.rank, plain.mirrored)
    free = fit_rigid_oriented(source, reference, own, other, sigma_deg=np.inf)
    assert free.sigma_mm == pytest.approx(np.sqrt(np.sum(plain.residuals**2) / (3 * n - 6)), rel=1e-6)
    assert free.degrees_of_freedom == 3 * n - 6
    assert not free.agree.any()


def test_positions_without_weight_leave_the_mean_turn():
    rng = np.random.default_rng(2)
    source, reference, own, other, _ = poses(rng, 9)
    fit = fit_rigid_oriented(source, reference, own, other, 1e9, 1.0)
    mean = (other * own.inv()).mean()
    assert np.degrees((mean.inv() * Rotation.from_matrix(fit.rigid.rotation)).magnitude()) < 1e-6


@pytest.mark.parametrize("n", [1, 2, 5])
def test_spots_on_a_line_are_enough(n):
    rng = np.random.default_rng(3)
    source, reference, own, other, motion = poses(rng, n, mm=0.05, degrees=0.02, size=(0, 0, 0))
    along = np.outer(np.arange(n), [100.0, 30.0, 20.0])
    source, reference = source + along, reference + motion[0].apply(along)
    with pytest.raises(RegistrationError):
        fit_rigid(source, reference)
    fit = fit_rigid_oriented(source, reference, own, other)
    turn = Rotation.from_matrix(fit.rigid.rotation)
    assert np.degrees((turn.inv() * motion[0]).magnitude()) < 0.1
    assert error(fit, source, motion) < 0.3
    assert fit.rigid.rank == min(n - 1, 1)
    assert np.isfinite(fit.covariance).all()
    with pytest.raises(RegistrationError):
        fit_rigid_oriented(source, reference, own, other, sigma_deg=np.inf)


def test_wrong_orientations_are_told_and_change_nothing():
    rng = np.random.default_rng(4)
    for n, wrong in ((5, 1), (14, 4), (60, 24)):
        for _ in range(20):
            source, reference, own, other, motion = poses(rng, n)
            spoilt = Rotation.concatenate([Rotation.random(wrong, rng=rng), other[wrong:]])
            fit = fit_rigid_oriented(source, reference, own, spoilt)
            far = np.degrees((spoilt * other.inv()).magnitude()) > 5.0
            assert not fit.agree[far].any()
            assert fit.agree[wrong:].mean() > 0.9
            assert error(fit, source, motion) < 1.0


def test_wrong_orientations_of_spots_on_a_line():
    rng = np.random.default_rng(5)
    for _ in range(20):
        source, reference, own, other, motion = poses(rng, 8, size=(800, 0, 0))
        spoilt = Rotation.concatenate([Rotation.random(2, rng=rng), other[2:]])
        fit = fit_rigid_oriented(source, reference, own, spoilt)
        assert fit.agree[2:].all()
        assert np.degrees((Rotation.from_matrix(fit.rigid.rotation).inv() * motion[0]).magnitude()) < 0.5


def test_noise_is_estimated():
    rng = np.random.default_rng(6)
    found = np.array(
        [
            (fit.sigma_mm, fit.sigma_deg)
            for n in (5, 14)
            for _ in range(150)
            for fit in [fit_rigid_oriented(*poses(rng, n, 0.4, 0.15)[:4])]
        ]
    ).reshape(2, 150, 2)
    squares = np.mean(found**2, axis=1)
    np.testing.assert_allclose(squares[0], [0.4**2, 0.15**2], rtol=0.15)
    np.testing.assert_allclose(squares[1], [0.4**2, 0.15**2], rtol=0.08)


@pytest.mark.parametrize(("n", "size"), [(14, (800, 400, 600)), (14, (400, 3, 3)), (6, (60, 60, 60))])
def test_intervals_hold(n, size):
    rng = np.random.default_rng(7)
    held = []
    for _ in range(400):
        source, reference, own, other, (turn, shift) = poses(rng, n, 0.3, 0.1, size)
        fit = fit_rigid_oriented(source, reference, own, other)
        back = turn.as_matrix() @ fit.rigid.rotation.T
        moved = turn.apply(source.mean(axis=0)) + shift - fit.centroid
        held.append(np.abs([*moved, *np.degrees(Rotation.from_matrix(back).as_rotvec())]) <= fit.half_width)
    assert 0.92 <= np.mean(held) <= 0.97
    assert np.mean(held, axis=0).min() > 0.90


def test_it_pays_where_positions_say_little_and_costs_nothing_elsewhere():
    """A flange of 300 mm, 5 mm broad; new spots up to 500 mm beside it. And a box, where orientations are 2 degrees off."""
    rng = np.random.default_rng(8)
    ratio = []
    for size, degrees in (((150, 5, 5), 0.1), ((800, 400, 600), 2.0)):
        squares = np.zeros(2)
        for _ in range(150):
            source, reference, own, other, (turn, shift) = poses(rng, 10, 0.3, degrees, size)
            new = source + rng.uniform(-500, 500, (10, 3))
            fits = (fit_rigid_oriented(source, reference, own, other).rigid, fit_rigid(source, reference))
            squares += [np.sum((fit.predict(new) - turn.apply(new) - shift) ** 2) for fit in fits]
        ratio.append(np.sqrt(squares[0] / squares[1]))
    assert ratio[0] < 0.1
    assert ratio[1] < 1.02


def test_a_constant_turn_of_the_tool_takes_the_weight_off_orientations():
    rng = np.random.default_rng(9)
    source, reference, own, other, motion = poses(rng, 14, 0.1, 0.02)
    fit = fit_rigid_oriented(source, reference, own, other * Rotation.from_euler("z", 3.0, degrees=True))
    assert fit.sigma_deg > 1.0
    assert error(fit, source, motion) < 0.3


def test_exact_and_bad_input():
    rng = np.random.default_rng(10)
    source, reference, own, other, motion = poses(rng, 6, 0.0, 0.0)
    fit = fit_rigid_oriented(source, reference, own, other)
    assert error(fit, source, motion) < 1e-8
    assert fit.agree.all()
    with pytest.raises(RegistrationError, match="one for each"):
        fit_rigid_oriented(source, reference, own[:5], other)
    with pytest.raises(RegistrationError, match="one for each"):
        fit_rigid_oriented(source[:1], reference[:1], own[0], other[0])
    for bad in (0.0, -1.0, np.nan):
        with pytest.raises(RegistrationError, match="positive"):
            fit_rigid_oriented(source, reference, own, other, sigma_deg=bad)
    with pytest.raises(DegenerateError, match="line"):
        line = np.outer(np.arange(6), [1.0, 2, 3])
        fit_rigid_oriented(line, line, own, other, sigma_deg=np.inf)
