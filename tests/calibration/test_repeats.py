"""Noise from spots that were measured more than once."""

from __future__ import annotations

import numpy as np
import pytest

from respot.calibration.repeats import noise_from_repeats
from respot.registration.errors import RegistrationError


def test_by_hand():
    """a: twice, 2 apart in x; b: once; c: three times, 0, 3, 6 in z. Squares 2 and 18 over 3 repeats, 9 coordinates."""
    ids = ["a", "c", "b", "A", "c", "c"]
    points = [[1.0, 0, 0], [0, 0, 0], [5, 5, 5], [3.0, 0, 0], [0, 0, 3], [0, 0, 6]]
    found = noise_from_repeats(ids, points)
    assert found.ids == ("a", "c", "b")
    assert found.counts.tolist() == [2, 3, 1]
    assert found.positions.tolist() == [[2, 0, 0], [0, 0, 3], [5, 5, 5]]
    assert found.degrees_of_freedom == 9
    assert found.sigma == pytest.approx((20 / 9) ** 0.5)
    np.testing.assert_allclose(found.sigma_xyz, [(2 / 3) ** 0.5, 0, 6**0.5])
    assert found.sigma_of_mean == pytest.approx(found.sigma * ((1 / 2 + 1 / 3 + 1) / 3) ** 0.5)


def test_without_repeats_nothing_is_said():
    found = noise_from_repeats(["a", "b"], [[1.0, 2, 3], [4, 5, 6]])
    assert (found.sigma, found.degrees_of_freedom, found.interval(), found.sigma_of_mean) == (None, 0, None, None)
    assert found.positions.tolist() == [[1, 2, 3], [4, 5, 6]]
    assert noise_from_repeats([], np.zeros((0, 3))).ids == ()


def test_the_interval_holds_the_truth():
    """500 tables of 6 spots, 3 times each, 0.2 mm: 95 % within 3 standard errors; where spots lie does not count."""
    rng = np.random.default_rng(4)
    ids = [f"P{n}" for n in range(6)] * 3
    held, sigmas = 0, []
    for _ in range(500):
        places = np.tile(rng.uniform(-1e4, 1e4, (6, 3)), (3, 1))
        found = noise_from_repeats(ids, places + 0.2 * rng.normal(size=places.shape))
        low, high = found.interval()
        held += low < 0.2 < high
        sigmas.append(found.sigma)
    assert held / 500 == pytest.approx(0.95, abs=0.03)
    assert np.mean(np.square(sigmas)) == pytest.approx(0.04, rel=0.03)


def test_bad_numbers_and_shapes():
    with pytest.raises(RegistrationError, match="b is not a finite"):
        noise_from_repeats(["a", "b"], [[1.0, 2, 3], [4, np.nan, 6]])
    with pytest.raises(RegistrationError):
        noise_from_repeats(["a"], [[1.0, 2, 3], [4, 5, 6]])
