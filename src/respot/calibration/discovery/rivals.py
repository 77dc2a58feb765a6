"""Other explanations of each accepted effect: what they would leave, held out too, and whether they clearly lose."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from respot.calibration.discovery.bank import Bank, Span
from respot.calibration.discovery.heldout import HeldOut, heldout
from respot.calibration.discovery.joint_fit import JointFit, fit_jointly
from respot.calibration.discovery.selection import Selection, State
from respot.calibration.effects.term import Term
from respot.calibration.observations import Observations

Array = NDArray[np.float64]

SEPARATED = 6.0
"""A rival is separated when its criterion is larger by this: odds of 20 to 1, were both as likely before."""
CLEAR = 10.0
"""It loses clearly, so that the cause may be named, when it is larger by this: 150 to 1."""
_SHOWN = 6
_MOST_NEAR = 16
_CONTAINED = 1e-3


@dataclass(frozen=True, eq=False)
class RivalTable:
    """What stands against one accepted term.

    Attributes
    ----------
    term : Term
    rivals : tuple of (Term, HeldOut, float, bool)
        The best others: term, held-out errors, by how much the criterion is larger, and whether they are separated.
    without : HeldOut
        Held-out errors of the model without the term.
    near : tuple of (Term, float)
        All that do not lose clearly, the nearest first, shown or not: term, and by how much the criterion is larger.
    """

    term: Term
    rivals: tuple[tuple[Term, HeldOut, float, bool], ...]
    without: HeldOut
    near: tuple[tuple[Term, float], ...] = ()

    @property
    def not_separated(self) -> tuple[Term, ...]:
        """Rivals that the spots do not tell from it."""
        return tuple(term for term, _, _, loses in self.rivals if not loses)

    @property
    def all_lose_clearly(self) -> bool:
        """Whether every rival does."""
        return all(apart > CLEAR for _, _, apart, _ in self.rivals)


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
    criteria = selection.apart(rest, index)
    own = bank.terms[index]
    own_rows = bank.span([*rest.chosen, index], sigma)
    # of the same finding the form does not matter
    seen = {own.key}
    found: list[tuple[Term, HeldOut, float, bool]] = []
    near: list[tuple[Term, float]] = []
    for other in np.argsort(criteria).tolist():
        more = len(near) < _MOST_NEAR and criteria[other] <= CLEAR
        if not np.isfinite(criteria[other]) or (len(found) == _SHOWN and not more):
            break
        term = bank.terms[other]
        if term.key in seen:
            continue
        seen.add(term.key)
        apart = float(criteria[other])
        if _holds(bank, bank.span([*rest.chosen, other], sigma), own_rows, rest.rank):
            continue
        if more:
            near.append((term, apart))
        if len(found) == _SHOWN:
            continue
        others = [bank.terms[i] for i in rest.chosen] + [term]
        trial = fit_jointly(observations, reference, others, fit.inliers)
        found.append((term, heldout(trial, folds, skip), apart, apart > SEPARATED))
    bare = fit_jointly(observations, reference, [bank.terms[i] for i in rest.chosen], fit.inliers)
    return RivalTable(own, tuple(found), heldout(bare, folds, skip), tuple(near))


def _holds(bank: Bank, span: Span, contained: Span, start: int) -> bool:
    """Whether one span holds all of another's directions beyond the ``start`` they share, and is larger."""
    wide, narrow = len(span.seen) - start, len(contained.seen) - start
    if wide <= narrow or not narrow:
        return False
    directions, inner = bank.basis(span)[:, start:], bank.basis(contained)[:, start:]
    left = inner - directions @ (directions.T @ inner)
    return bool(np.linalg.norm(left) < _CONTAINED * np.sqrt(narrow))
