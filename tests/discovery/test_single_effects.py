"""Each effect of the catalogue, alone on a line that is made without the engine."""

from __future__ import annotations

import numpy as np
import pytest

from tests.discovery.lines import look

PLACES = {
    "joint_zero@2": {"axis": 2},
    "joint_zero@3": {"axis": 3},
    "joint_zero@4": {"axis": 4},
    "joint_zero@5": {"axis": 5},
    "joint_profile@3": {"axis": 3},
    "gear@2": {"axis": 2},
    "backlash@3": {"axis": 3},
    "readback_lag": {},
    "link_length@a2": {"parameter": "a2"},
    "link_length@c3": {"parameter": "c3"},
    "link_geometry": {},
    "gravity_sag": {},
    "tool_offset": {"frame": "tool"},
    "gun_sag": {},
    "gun_deflection": {"column": "force_n"},
    "tip_wear": {"column": "welds_since_cap"},
    "scale": {},
    "drift": {"column": "time_min"},
    "warmup": {"column": "time_min"},
    "group_shift@station": {"column": "station"},
    "rail": {"external_axis": 1},
    "covariate@operator": {"column": "operator"},
    "covariate@humidity_pct": {"column": "humidity_pct"},
    "deformation": {},
}
FAMILY = {"warmup": "drift"}


@pytest.mark.parametrize("effect", PLACES)
def test_an_effect_is_found_first_at_its_place(effect):
    seen = look(f"{effect}:1.2", seed=11)
    name = effect.partition("@")[0]
    first = seen.found.accepted[0]
    assert FAMILY.get(first.term.effect, first.term.effect) == FAMILY.get(name, name)
    assert {key: first.term.where[key] for key in PLACES[effect]} == PLACES[effect]
    assert len(first.not_separated) <= 4
    assert first.p_value <= 0.01
    named = [each.term.effect for each in seen.found.accepted if each.named]
    assert set(named) <= {name, "drift", "warmup"}


@pytest.mark.parametrize("effect", ["joint_zero@3", "tip_wear", "group_shift@station"])
def test_the_error_reaches_the_noise(effect):
    seen = look(f"{effect}:1.5", seed=5)
    before = float(np.sqrt(np.mean([t["left_rms"] ** 2 for t in seen.line.truth])))
    assert before == pytest.approx(1.5, rel=0.05)
    assert seen.found.fit.sigma < 0.12
    assert seen.found.heldout.rms["mixed"] < 0.3 * seen.found.heldout_before.rms["mixed"]


def test_the_level_of_a_group_is_told():
    seen = look("group_shift@station:1.5", seed=21)
    truth = seen.line.truth[0]["where"]
    assert seen.found.accepted[0].term.where == {"column": truth["column"], "level": truth["level"]}


def test_values_hold_the_truth():
    seen = look("joint_zero@3:1.0", seed=31)
    value, sd = float(seen.found.accepted[0].values[0]), float(seen.found.accepted[0].sd[0])
    assert abs(value - seen.line.truth[0]["parameters"]["zero_deg"]) < 4.0 * sd
    assert sd < 0.01


def test_a_pair_is_found_and_nothing_else():
    seen = look("joint_zero@3:1.0", "tip_wear:0.8", seed=12)
    assert sorted(seen.effects) == ["joint_zero", "tip_wear"]


def test_three_at_once():
    seen = look("joint_zero@5:0.9", "tip_wear:0.9", "group_shift@station:0.9", seed=14, spots=120)
    assert sorted(seen.effects) == ["group_shift", "joint_zero", "tip_wear"]
