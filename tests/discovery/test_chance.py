"""What chance gains: an effect is judged by its own forms, all effects together by one question."""

from __future__ import annotations

import numpy as np
import pytest

from respot.calibration.discovery.bank import Bank
from respot.calibration.discovery.significance import by_chance, normal_score, p_value
from respot.calibration.effects.catalogue import columns_of, terms_of
from respot.simulation import simulate
from tests.discovery.lines import NOISE, ROBOT, observations_of

LINE = simulate(ROBOT, 60, NOISE, (), 5, "easy")
SEEN = observations_of(LINE)
TERMS = terms_of(SEEN)
BANK = Bank(TERMS, columns_of(SEEN, TERMS), SEEN.positions)
NUMBERS = {name: number for number, name in enumerate(dict.fromkeys(term.effect for term in TERMS))}
EFFECTS = np.array([NUMBERS[term.effect] for term in TERMS])


def chance_and_scores(seed: int, draws: int = 500):
    left = BANK.project(np.random.default_rng(seed).normal(scale=NOISE, size=3 * 60))
    gains = BANK.gains(BANK.span((), NOISE), BANK.columns.T @ left, NOISE)
    free = len(left) - 6
    allowed = gains.ranks > 0
    basis = np.zeros((len(left), 0))
    chance = by_chance(BANK, basis, left, gains, allowed, EFFECTS, free, draws=draws, seed=seed)
    scores = np.where(allowed, normal_score(gains.squares, gains.ranks, float(left @ left), free), -np.inf)
    return chance, chance.scores(scores, EFFECTS)


def test_an_effect_has_as_many_tries_as_its_forms_make():
    chance, _ = chance_and_scores(1)
    assert chance.tries[NUMBERS["scale"]] == pytest.approx(1.0, abs=0.3)
    assert chance.tries[NUMBERS["gear"]] > 20.0
    assert 2.0 < chance.tries[NUMBERS["joint_zero"]] <= 6.5


def test_scores_less_tries_keep_their_order_and_stay_finite():
    chance, _ = chance_and_scores(1)
    gear = np.full(6, NUMBERS["gear"])
    evened = chance.scores(np.array([-np.inf, 0.0, 3.0, 5.0, 12.0, 60.0]), gear)
    assert evened[0] == -np.inf
    assert np.all(np.diff(evened[1:]) > 0.0) and np.all(np.isfinite(evened[1:]))
    # of rare events k tries make k times the chance: little of a large score is lost, much of a small one
    assert evened[5] > 59.5 and evened[2] < 1.5


def test_where_there_is_nothing_one_answer_in_a_hundred_is_below_one_in_a_hundred():
    values = []
    for seed in range(200):
        chance, scores = chance_and_scores(seed, draws=199)
        values.append(p_value(float(scores.max()), chance))
    values = np.array(values)
    assert np.mean(values <= 0.05) < 0.11  # 4 sd above
    assert 0.35 < np.mean(values <= 0.5) < 0.65


def test_where_no_term_is_left_chance_gains_nothing():
    left = BANK.project(np.random.default_rng(2).normal(scale=NOISE, size=3 * 60))
    gains = BANK.gains(BANK.span((), NOISE), BANK.columns.T @ left, NOISE)
    none, basis = np.zeros(len(TERMS), dtype=bool), np.zeros((len(left), 0))
    chance = by_chance(BANK, basis, left, gains, none, EFFECTS, len(left) - 6, draws=20, seed=0)
    assert chance.largest.shape == (20,) and np.all(chance.largest == -np.inf)
    assert p_value(-1.0, chance) == 1.0 / 21.0
