"""The search for a set of terms: forward steps judged by permutations, then exchanges, merges, backward steps."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from respot.calibration.discovery.bank import Bank, Gains, Span
from respot.calibration.discovery.significance import ALPHA, Chance, by_chance, normal_score, p_value
from respot.calibration.effects.catalogue import MECHANISMS

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

MOST_EFFECTS, SPOTS_FOR_AN_EFFECT = 12, 12
_USED = 0.5
"""Share of the coordinates that directions of the model may use up: with more there is no noise left to judge by."""
_LAST = 10.0
"""A term that only describes must be better by this much (as `Selection.criterion`) than one that may be a cause."""
_POINTS = 8.0
"""The same for a term that only tells where to look: a covariate."""
_EACH = 4.0
"""What each effect costs beside its parameters: one cause before two."""
_BETTER = 0.5
_AKAIKE = 2.0
_KEPT = 200
_LARGE = 5
"""Terms with more directions than this may stand for several causes at once."""
_CANDIDATES = 12
_NEEDED = 50.0
"""What makes the criterion so much smaller is not left out, whatever its chance beside terms that hold much of it."""
OBVIOUS = 12.0
"""Scores beyond this never come by chance: where only yes or no is asked, no permutations are needed."""
_ROUNDS = 6
_MOST_PERMUTED = 400
"""Of more spots as many are drawn: what chance gains at best hardly depends on their number."""


@dataclass(frozen=True, eq=False)
class State:
    """A model of some terms.

    Attributes
    ----------
    span : Span
        Its terms' directions.
    shares : (a,) array
        What is wanted along each [mm].
    products : (all columns,) array
        Products of all columns with the residual.
    square_sum : float
        Of the residual [mm^2].
    criterion : float
        Smaller is better.
    cost : float
        Part of the criterion that stands for parameters far from plausible, and for terms that only describe.
    """

    span: Span
    shares: Array
    products: Array
    square_sum: float
    criterion: float
    cost: float

    @property
    def chosen(self) -> tuple[int, ...]:
        """Indices in the bank."""
        return self.span.chosen

    @property
    def rank(self) -> int:
        """Number of directions."""
        return len(self.shares)


class Selection:
    """Search over the terms of a bank for what explains ``wanted``.

    Parameters
    ----------
    bank : Bank
    wanted : (3m,) array
        Shifts that the source needs, without their rigid part [mm].
    noise : float or None
        Known noise per coordinate [mm].
    allowed : (terms,) bool array
        Terms that may be chosen.
    draws, seed : int
        Of the permutations.
    step : callable
        Called after each forward step.
    """

    def __init__(
        self,
        bank: Bank,
        wanted: Array,
        noise: float | None,
        allowed: Mask,
        *,
        draws: int,
        seed: int,
        step: Callable[[], None] = lambda: None,
    ) -> None:
        self.bank, self.wanted, self.noise = bank, wanted, noise
        self.allowed, self.draws, self.seed, self._step = allowed, draws, seed, step
        self._gains: dict[tuple[int, ...], tuple[State, Gains]] = {}
        self._states: dict[tuple[tuple[int, ...], float], State] = {}
        kinds = [MECHANISMS[term.effect] for term in bank.terms]
        self.handicap = np.array([_EACH + _LAST * kind.describes + _POINTS * kind.points for kind in kinds])
        self._keys = [term.key for term in bank.terms]
        numbers: dict[str, int] = {}
        self._effects = np.array([numbers.setdefault(t.effect, len(numbers)) for t in bank.terms], dtype=np.intp)

    @property
    def count(self) -> int:
        """Number of coordinates."""
        return len(self.wanted)

    def free(self, state: State) -> int:
        """Degrees of freedom of a state's residual."""
        return max(self.count - 6 - state.rank, 1)

    def sigma(self, state: State) -> float:
        """Noise per coordinate that a state leaves [mm]; the known one where there is one and it is less."""
        own = float(np.sqrt(state.square_sum / self.free(state)))
        return own if self.noise is None else min(own, self.noise)

    def criterion(
        self, square_sum: Array | float, rank: NDArray[Any] | int, cost: Array | float, each: float | None = None
    ) -> Array:
        """Schwarz's criterion, plus what implausible parameters cost; or with another price for each direction."""
        variance = np.maximum(np.asarray(square_sum) / self.count, 1e-12)
        price = np.log(self.count) if each is None else each
        return np.asarray(self.count * np.log(variance) + np.asarray(rank) * price + cost)

    def state(self, chosen: Sequence[int], sigma: float) -> State:
        """Model of some terms."""
        key = (tuple(chosen), sigma)
        found = self._states.get(key)
        if found is None:
            if len(self._states) > _KEPT:
                self._states.clear()
            found = self._states[key] = self._made(key[0], sigma)
        return found

    def _made(self, chosen: tuple[int, ...], sigma: float) -> State:
        span = self.bank.span(chosen, sigma)
        whole = self._wanted_products
        own = [whole[self.bank.slices[index]] for index in chosen]
        shares = span.coefficients @ np.concatenate(own) if own else np.zeros(0)
        square_sum = max(float(self.wanted @ self.wanted - shares @ shares), 0.0)
        values = shares @ span.coefficients
        cost = float(self.handicap[list(chosen)].sum() + values @ values)
        criterion = float(self.criterion(square_sum, len(shares), cost))
        return State(span, shares, whole - shares @ span.seen, square_sum, criterion, cost)

    @cached_property
    def _wanted_products(self) -> Array:
        return np.asarray(self.bank.columns.T @ self.wanted)

    def gains(self, state: State) -> Gains:
        """What each term explains beside a state."""
        found = self._gains.get(state.chosen)
        if found is None or found[0] is not state:
            if len(self._gains) > _KEPT:
                self._gains.clear()
            found = self._gains[state.chosen] = (state, self.bank.gains(state.span, state.products, self.sigma(state)))
        return found[1]

    def scores(self, state: State, gains: Gains) -> Array:
        """Normal scores (terms,) of what each term explains beside a state."""
        return normal_score(gains.squares, gains.ranks, state.square_sum, self.free(state))

    def apart(self, rest: State, index: int) -> Array:
        """By how much each term in the place of one explains a state's rest worse than it does, (terms,).

        As `criterion`, but with Akaike's price of a direction: that another explanation needs more parameters is a
        reason to prefer this one, none to call it proved.
        """
        gains = self.gains(rest)
        after = np.maximum(rest.square_sum - gains.squares, 0.0)
        found = self.criterion(after, gains.ranks, gains.sizes, _AKAIKE)
        usable = self._usable(rest, gains)
        return np.where(usable, found - found[index], np.inf)

    def beside(self, state: State) -> Array:
        """Criterion (terms,) of a state with each term added; infinite for terms that may not be, or add nothing."""
        gains = self.gains(state)
        after = np.maximum(state.square_sum - gains.squares, 0.0)
        cost = state.cost + self.handicap + gains.sizes
        found = self.criterion(after, gains.ranks + state.rank, cost)
        return np.where(self._usable(state, gains), found, np.inf)

    def _usable(self, state: State, gains: Gains) -> Mask:
        """Terms that may be added to a state, say something beside it, and leave enough to judge by."""
        room = int(_USED * self.count) - 6 - state.rank
        return np.asarray(self.allowed & (gains.ranks > 0) & (gains.ranks <= room) & ~self._taken(state))

    def _taken(self, state: State) -> Mask:
        """Terms that are in a state, in any form, and covariates whose column a cause in it follows already."""
        keys = {self._keys[index] for index in state.chosen}
        terms = [self.bank.terms[index] for index in state.chosen]
        owned = {term.own for term in terms if term.own and term.effect != "covariate"}
        return np.array(
            [
                key in keys or (term.effect == "covariate" and term.own in owned)
                for key, term in zip(self._keys, self.bank.terms, strict=True)
            ],
            dtype=np.bool_,
        )

    @property
    def most(self) -> int:
        """Number of effects at most: one for each dozen of spots."""
        return int(np.clip(self.bank.spots // SPOTS_FOR_AN_EFFECT, 3, MOST_EFFECTS))

    def search(self, start: Sequence[int] = ()) -> State:
        """Find the set of terms, beginning with some."""
        sigma = self.sigma(self.state((), 0.0))
        state = self.state(start, sigma)
        for _ in range(_ROUNDS):
            grown = self._split(self._improve(self._grow(state)))
            better = self._prune(grown)
            if set(better.chosen) == set(state.chosen):
                return better
            state = better
        return state

    def _grow(self, state: State, among: Mask | None = None) -> State:
        """Forward steps, as long as the best term beats what the best of all gains by chance."""
        while len(state.chosen) < self.most:
            found = self._next(state, among)
            if found is None:
                break
            state = self.state((*state.chosen, found), self.sigma(state))
            state = self._exchange(state, among)
            self._step()
        return state

    def _next(self, state: State, among: Mask | None) -> int | None:
        gains = self.gains(state)
        allowed = self._usable(state, gains)
        if among is not None:
            allowed &= among
        if not allowed.any():
            return None
        score = np.where(allowed, self.scores(state, gains), -np.inf)
        limit = OBVIOUS / 2.0
        if float(score.max()) < OBVIOUS:
            chance = self._chance(state, allowed)
            score = chance.scores(score, self._effects)
            if p_value(float(score.max()), chance) > ALPHA:
                return None
            limit = chance.limit(ALPHA)
        criteria = np.where(score >= limit, self.beside(state), np.inf)
        return int(np.argmin(criteria)) if np.isfinite(criteria.min()) else None

    def _chance(self, state: State, allowed: Mask) -> Chance:
        """What chance gains beside a state; of very many spots on a sample of them."""
        small, rows = self._small
        basis = self.bank.basis(state.span)
        left = self.wanted - basis @ state.shares
        span = state.span
        if small is not self.bank:
            span = small.span(state.chosen, self.sigma(state))
            basis = small.basis(span)
            left = small.project(left.reshape(-1, 3)[rows].ravel())
            left = left - basis @ (basis.T @ left)
        free = max(len(left) - 6 - basis.shape[1], 1)
        gains = small.gains(span, small.columns.T @ left, self.sigma(state))
        return by_chance(small, basis, left, gains, allowed, self._effects, free, draws=self.draws, seed=self.seed)

    @cached_property
    def _small(self) -> tuple[Bank, NDArray[np.intp]]:
        return self.bank.sample(_MOST_PERMUTED, self.seed)

    def chance_of(self, state: State, index: int) -> float:
        """P value of one term of a state, the others given."""
        rest = self.state([i for i in state.chosen if i != index], self.sigma(state))
        gains = self.gains(rest)
        score = self.scores(rest, gains)
        if score[index] >= OBVIOUS:
            return 1.0 / (1.0 + self.draws)
        chance = self._chance(rest, self._usable(rest, gains))
        return p_value(float(chance.scores(score, self._effects)[index]), chance)

    def chances(self, state: State) -> Array:
        """P value (terms,) of each term that is not in a state, were it added; 1 for those that cannot be."""
        gains = self.gains(state)
        allowed = self._usable(state, gains)
        if not allowed.any():
            return np.ones(len(self.bank))
        chance = self._chance(state, allowed)
        largest = np.sort(chance.largest)
        score = chance.scores(self.scores(state, gains), self._effects)
        above = len(largest) - np.searchsorted(largest, score, side="left")
        return np.where(allowed, (1.0 + above) / (1.0 + len(largest)), 1.0)

    def _exchange(self, state: State, among: Mask | None = None) -> State:
        """Replace one term by another as long as the criterion falls."""
        for _ in range(4 * self.most):
            best, changed = state, False
            for index in state.chosen:
                rest = self.state([i for i in state.chosen if i != index], self.sigma(state))
                criteria = self.beside(rest)
                if among is not None:
                    criteria = np.where(among, criteria, np.inf)
                other = int(np.argmin(criteria))
                if other != index and criteria[other] < best.criterion - _BETTER:
                    trial = self.state((*rest.chosen, other), self.sigma(state))
                    if trial.criterion < best.criterion - _BETTER:
                        best, changed = trial, True
            if not changed:
                return state
            state = best
        return state

    def _improve(self, state: State) -> State:
        """Add a term and drop those that it makes needless: one cause in the place of several."""
        if len(state.chosen) < 2:
            return state
        criteria = self.beside(state)
        alone = self.beside(self.state((), self.sigma(state)))
        candidates = dict.fromkeys(
            [*np.argsort(alone)[:_CANDIDATES].tolist(), *np.argsort(criteria)[:_CANDIDATES].tolist()]
        )
        best = state
        for index in candidates:
            if not np.isfinite(alone[index]) or index in state.chosen:
                continue
            kept = [i for i in state.chosen if self._keys[i] != self._keys[index]]
            trial = self._drop(self.state((index, *kept), self.sigma(state)), keep=index)
            if trial.criterion < best.criterion - _BETTER:
                best = trial
        return self._exchange(best) if best is not state else state

    def _split(self, state: State) -> State:
        """Put several causes in the place of one term with many parameters, where that is better."""
        for index in state.chosen:
            rest = self.state([i for i in state.chosen if i != index], self.sigma(state))
            if state.rank - rest.rank <= _LARGE:
                continue
            small = np.array([len(term.parameters) <= _LARGE + 1 for term in self.bank.terms])
            trial = self._grow(rest, among=small & np.array([key != self._keys[index] for key in self._keys]))
            if trial.criterion < state.criterion - _BETTER:
                return trial
        return state

    def _drop(self, state: State, keep: int) -> State:
        """Leave out terms as long as the criterion falls."""
        while len(state.chosen) > 1:
            trials = [
                self.state([i for i in state.chosen if i != index], self.sigma(state))
                for index in state.chosen
                if index != keep
            ]
            best = min(trials, key=lambda trial: trial.criterion)
            if best.criterion >= state.criterion:
                return state
            state = best
        return state

    def _prune(self, state: State) -> State:
        """Leave out terms that chance explains, the others given."""
        while state.chosen:
            worst, worst_p = None, ALPHA
            for index in state.chosen:
                rest = self.state([i for i in state.chosen if i != index], self.sigma(state))
                certain = self.scores(rest, self.gains(rest))[index] >= OBVIOUS
                if certain or rest.criterion > state.criterion + _NEEDED:
                    continue
                chance = self.chance_of(state, index)
                if chance > worst_p:
                    worst, worst_p = index, chance
            if worst is None:
                return state
            state = self.state([i for i in state.chosen if i != worst], self.sigma(state))
        return state
