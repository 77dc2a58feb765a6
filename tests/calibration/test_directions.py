"""Intervals where the noise is not the same along all axes, as on the rear door (0.5 / 4.9 / 1.7 mm)."""

from __future__ import annotations

import numpy as np
import pytest

from respot.calibration.fit import fit_spots

FLANGE = np.array([60.0, 600.0, 300.0])


def table(dice, n, sd):
    source = dice.uniform(-0.5, 0.5, (n, 3)) * FLANGE * 2 + [4000.0, 0.0, 1000.0]
    return source, source + [10.0, -5.0, 3.0] + dice.normal(size=(n, 3)) * sd


def shift_error(fit):
    """Error of the predicted centre of the inliers: the true transform is a shift by (10, -5, 3)."""
    inliers = fit.robust.inliers
    true = (fit.source[inliers] + [10.0, -5.0, 3.0]).mean(axis=0)
    return np.abs(fit.calibrated[inliers].mean(axis=0) - true)


@pytest.mark.parametrize(("sd", "least"), [((0.5, 4.9, 1.7), 0.86), ((1.0, 1.0, 1.0), 0.92)])
def test_intervals_of_the_shift_hold_along_each_axis(sd, least):
    """With one noise for all axes the interval along y holds in 73 % of these tables.

    It is not yet 95 %: a good spot far along y is sometimes taken for an outlier, since outliers are judged by length.
    """
    held = np.zeros(3)
    tables = 120
    for number in range(tables):
        fit = fit_spots([f"S{n}" for n in range(14)], *table(np.random.default_rng(number), 14, sd), seed=number)
        held += shift_error(fit) <= fit.uncertainty.half_width[:3]
    assert (held / tables).min() >= least


def test_uneven_noise_is_said_and_even_noise_is_not():
    names = [f"S{n}" for n in range(20)]
    uneven = fit_spots(names, *table(np.random.default_rng(3), 20, (0.5, 4.9, 1.7)))
    assert uneven.uncertainty.by_direction and uneven.uncertainty.isotropy_p < 0.01
    assert uneven.uncertainty.half_width[1] > 3 * uneven.uncertainty.half_width[0]
    even = fit_spots(names, *table(np.random.default_rng(3), 20, (1.0, 1.0, 1.0)))
    assert not even.uncertainty.by_direction
    assert even.uncertainty.half_width[0] == pytest.approx(even.uncertainty.half_width[1], rel=0.5)
    assert even.uncertainty.degrees_of_freedom == 18  # each direction by itself all the same
