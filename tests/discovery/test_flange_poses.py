"""Poses of a flange, or of another tool: the arm's effects are those of the tip, wherever the poses are."""

from __future__ import annotations

import numpy as np
import pytest

from respot.calibration.discovery.discover import discover
from respot.calibration.effects.catalogue import MECHANISMS, terms_of
from respot.calibration.effects.moved import moved
from respot.simulation import simulate
from tests.discovery.lines import NOISE, ROBOT, observations_of

GUN = np.array([60.0, -40.0, 420.0])


def errors(found, line) -> float:
    """RMS of the distances from the places without noise [mm]."""
    there = found.fit.moved @ found.fit.rotation.T + found.fit.translation
    return float(np.sqrt(np.mean(np.sum((there - line.measured_true) ** 2, axis=1))))


def search(seen, line):
    return discover(seen, line.measured, noise=NOISE, draws=199, nested=False)


@pytest.mark.parametrize("effect", ["link_geometry:2", "gravity_sag:1.5"])
def test_poses_of_the_flange_explain_as_much_as_those_of_the_tip(effect):
    line = simulate(ROBOT, 80, NOISE, (effect,), 17, "easy")
    tip = observations_of(line)
    at_tip = search(tip, line)
    at_flange = search(tip.tipped(-GUN), line)
    offset = next(each for each in at_flange.accepted if each.term.effect == "tool_offset")
    assert np.abs(offset.values - GUN).max() < 6.0  # errors of links hold an offset of their own
    assert errors(at_flange, line) < 1.25 * errors(at_tip, line)


def test_a_mastering_error_is_found_from_the_flange():
    line = simulate(ROBOT, 80, NOISE, ("joint_zero@3:1.5",), 17, "easy")
    found = search(observations_of(line).tipped(-GUN), line)
    effects = {each.term.label: each for each in found.accepted}
    assert set(effects) == {"tool_offset frame tool", "joint_zero axis 3"}
    truth = line.truth[0]["parameters"]["zero_deg"]
    zero = effects["joint_zero axis 3"]
    assert abs(zero.values[0] - truth) < 4.0 * zero.sd[0]
    offset = effects["tool_offset frame tool"]
    assert np.all(np.abs(offset.values - GUN) < 4.0 * offset.sd)


@pytest.mark.parametrize("effect", ["link_geometry", "group_shift", "scale", "joint_zero"])
def test_a_term_beside_a_tool_offset_moves_the_tip_and_not_the_flange(effect):
    line = simulate(ROBOT, 30, NOISE, (), 3, "easy")
    tip = observations_of(line)
    flange = tip.tipped(-GUN)
    tool = next(term for term in terms_of(flange) if term.effect == "tool_offset")
    term = [term for term in terms_of(flange) if term.effect == effect][-1]
    value = 0.05 * np.array([each.prior for each in term.parameters])
    from_flange, _ = moved(flange, [tool, term], [GUN, value])
    from_tip, _ = moved(tip, [term], [value])
    assert np.abs(from_flange - from_tip).max() < 1e-9
    shift = MECHANISMS[effect].shifts(tip, term) @ value
    assert np.abs(shift).max() > 1e-3


@pytest.mark.parametrize("effect", ["deformation:4", "link_geometry:4", "rail:4", "gravity_sag:4"])
def test_a_third_of_what_was_measured_is_left_to_judge_by(effect):
    """With as many directions as coordinates the tool itself seems to come by chance, and is left out."""
    line = simulate(ROBOT, 60, NOISE, (effect,), 31, "hard", rail=effect.startswith("rail"))
    few = np.arange(0, 60, 4)
    fit = discover(observations_of(line).tipped(-GUN).rows(few), line.measured[few], draws=199, nested=False).fit
    assert "tool_offset" in {term.effect for term in fit.terms}
    assert fit.free >= int(fit.inliers.sum())
