"""Other explanations of each accepted effect: what they would leave, held out too, and whether they clearly lose."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from respot.calibration.discovery.heldout import HeldOut, heldout
from respot.calibration.discovery.joint_fit import JointFit, fit_jointly
from respot.calibration.discovery.selection import Selection, State
from respot.calibration.effects.term import Term
from respot.calibration.observations import Observations

Array = NDArray[np.float64]

CLEAR = 10.0
"""A rival loses clearly when its criterion is larger by this: odds of 150 to 1, were both as likely before."""
_SHOWN = 6
_CONTAINED = 1e-3


@dataclass(frozen=True, eq=False)
class RivalTable:
    """What stands against one accepted term.

    Attributes
    ----------
    term : Term
    rivals : tuple of (Term, HeldOut, float, bool)
        The best others: term, held-out errors, by how much the criterion is larger, and whether it clearly loses.
    without : HeldOut
        Held-out errors of the model without the term.
    """

    term: Term
    rivals: tuple[tuple[Term, HeldOut, float, bool], ...]
    without: HeldOut

    @property
    def not_separated(self) -> tuple[Term, ...]:
        """Rivals that do not clearly lose."""
        return tuple(term for term, _, _, loses in self.rivals if not loses)


def rival_table(
    selection: Selection,
    state: State,
    index: int,
    observations: Observations,
    reference: Array,
    fit: JointFit,
    folds: Mapping[str, NDArray[np.intp]],
    skip: frozenset[str],
) -> RivalTable:
    """Refit the model with each of the best other terms in the place of one.

    A term that holds all of this one's columns and more is no other explanation, and is not listed.

    Parameters
    ----------
    selection : Selection
    state : State
        The final model; ``index`` is one of its terms.
    observations, reference, fit : Observations, (n, 3) array, JointFit
        The final model over all n spots.
    folds, skip
        As `heldout`.
    """
    bank = selection.bank
    sigma = selection.sigma(state)
    rest = selection.state([i for i in state.chosen if i != index], sigma)
    criteria = selection.beside(rest)
    own = bank.terms[index]
    own_directions = bank.directions(index, rest.basis, sigma)
    # of the same finding the form does not matter
    seen = {own.key}
    found: list[tuple[Term, HeldOut, float, bool]] = []
    base = float(min(state.criterion, criteria[index]))
    for other in np.argsort(criteria).tolist():
        if not np.isfinite(criteria[other]) or len(found) == _SHOWN:
            break
        term = bank.terms[other]
        if term.key in seen:
            continue
        seen.add(term.key)
        apart = float(criteria[other] - base)
        if _holds(bank.directions(other, rest.basis, sigma), own_directions):
            continue
        others = [bank.terms[i] for i in rest.chosen] + [term]
        trial = fit_jointly(observations, reference, others, fit.inliers)
        found.append((term, heldout(trial, folds, skip), apart, apart > CLEAR))
    bare = fit_jointly(observations, reference, [bank.terms[i] for i in rest.chosen], fit.inliers)
    return RivalTable(own, tuple(found), heldout(bare, folds, skip))


def _holds(directions: Array, contained: Array) -> bool:
    """Whether the span of ``directions`` (3m, r) holds all of ``contained`` (3m, s) and is larger."""
    if directions.shape[1] <= contained.shape[1] or not contained.shape[1]:
        return False
    left = contained - directions @ (directions.T @ contained)
    return bool(np.linalg.norm(left) < _CONTAINED * np.sqrt(contained.shape[1]))
