"""Constants inside forms: a time constant between those that the search tries is found, and nothing beside."""

from __future__ import annotations

import numpy as np
import pytest

from respot.calibration.discovery.joint_fit import fit_jointly
from respot.calibration.discovery.refinement import refined
from respot.calibration.effects.catalogue import columns_of, terms_of
from respot.simulation import simulate
from tests.discovery.lines import NOISE, ROBOT, look, observations_of

LINE = simulate(ROBOT, 120, NOISE, (), 21, "easy")
SEEN = observations_of(LINE)
EVERY = np.ones(120, dtype=bool)


def rising(constant: float) -> np.ndarray:
    """Spots that rise by 6 mm along x and 3 mm along z, by own arithmetic [mm]."""
    minutes = SEEN.columns["time_min"].values
    risen = 1.0 - np.exp(-(minutes - minutes.min()) / constant)
    noise = np.random.default_rng(4).normal(scale=0.05, size=(120, 3))
    return SEEN.positions + risen[:, None] * np.array([6.0, 0.0, 3.0]) + noise


def warmup(share: float):
    return min(
        (t for t in terms_of(SEEN) if t.effect == "warmup" and t.form["moves"] == "shift"),
        key=lambda t: abs(t.form["time_constant"] / t.form["span"] - share),
    )


@pytest.mark.parametrize("factor", [0.8, 1.0, 1.25])
def test_a_time_constant_between_two_is_found(factor):
    term = warmup(0.18)
    truth = factor * term.form["time_constant"]
    reference = rising(truth)
    fit = fit_jointly(SEEN, reference, [term], EVERY)
    better = refined(fit, SEEN)
    after = fit_jointly(SEEN, reference, better, EVERY)
    assert better[0].key == term.key
    assert better[0].form["time_constant"] == pytest.approx(truth, rel=0.06)
    assert after.sigma == pytest.approx(0.05, rel=0.15)
    if factor == 1.0:  # where it is right, noise may move it a little, or not at all
        assert after.sigma <= fit.sigma
    else:
        assert after.sigma < 0.9 * fit.sigma


def test_terms_without_constants_stay_as_they_are():
    term = next(t for t in terms_of(SEEN) if t.effect == "joint_zero")
    fit = fit_jointly(SEEN, rising(100.0), [term], EVERY)
    assert refined(fit, SEEN) == fit.terms


def test_a_refined_term_is_what_its_columns_say():
    term = warmup(0.18)
    fit = fit_jointly(SEEN, rising(0.8 * term.form["time_constant"]), [term], EVERY)
    better = refined(fit, SEEN)
    after = fit_jointly(SEEN, rising(0.8 * term.form["time_constant"]), better, EVERY)
    assert np.allclose(after.columns[:, :, 6:], columns_of(SEEN, better))


def test_a_large_warm_up_leaves_nothing_behind():
    seen = look("warmup:4", seed=17, spots=100)
    assert seen.effects == ["warmup"]
    assert seen.found.fit.sigma == pytest.approx(NOISE, rel=0.12)
