"""Questions of a plan: can each rival imitate what an effect does, and the effect what the rival does.

Of an effect X and a rival Y, X is taken for true as it was fitted, and everything but X, with Y, imitates it as well as
it can: the rigid part, the other effects, each within what is plausible. Then Y, as large as it had to be, is taken for
true, and everything but Y imitates it. What is left counts, and the smaller of the two is what is promised.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from respot.calibration.effects.catalogue import columns_of
from respot.calibration.effects.moved import at_tip, missing, moved
from respot.calibration.effects.term import Term
from respot.calibration.information import RIGID, Information, RivalColumns
from respot.calibration.observations import Observations
from respot.calibration.planning.design import Question, whitened
from respot.registration.covariance import jacobian

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

_WIDE = 4.0
"""An imitation may be so many times larger than what is plausible: as far as a cause may be named."""
_LEAST = 1e-12


@dataclass(frozen=True, eq=False)
class Pair:
    """An effect and a rival that the fitted spots do not tell from each other clearly.

    Attributes
    ----------
    effect, rival : Term
    apart : float
        By how much the rival's criterion is larger.
    questions : tuple of Question
        One or two.
    normal : (q, q) array
        Products of the model's and the rival's columns at the fitted spots.
    rows : (n, 3, q) array
        These columns at the candidates.
    parts : (slice, slice)
        Columns of the effect and of the rival.
    """

    effect: Term
    rival: Term
    apart: float
    questions: tuple[Question, ...]
    normal: Array
    rows: Array
    parts: tuple[slice, slice]

    @property
    def names(self) -> tuple[str, str]:
        """Labels of both."""
        return self.effect.label, self.rival.label

    def more_directions(self, chosen: Sequence[int]) -> int:
        """How many more directions than now the rival needs beyond those of the effect, with some candidates measured.

        A rival that has to be made up of more is less likely for it: the criterion counts two for each, of which one
        goes for the noise that each explains.
        """
        design = self.rows[list(chosen)].reshape(-1, len(self.normal))
        return self._needed(self.normal + design.T @ design) - self._needed(self.normal)

    def _needed(self, normal: Array) -> int:
        effect, rival = (
            _determined(normal, part, [other for other in self.parts if other != part]) for part in self.parts
        )
        return rival - effect


@dataclass(frozen=True, eq=False)
class Unasked:
    """A pair that cannot be planned for, and what is not known of the spots."""

    effect: Term
    rival: Term
    lacking: str


def pairs_of(information: Information, candidates: Observations) -> tuple[list[Pair], list[Unasked]]:
    """Pairs to separate, with their questions about n candidates.

    An effect of which the candidates cannot tell, and that is not of the pair, is taken not to act there.

    Parameters
    ----------
    information : Information
    candidates : Observations
        n spots that may be measured.
    """
    lacking = [missing(candidates, term) for term in information.terms]
    known = [place for place, what in enumerate(lacking) if not what]
    terms = [information.terms[place] for place in known]
    values = [information.values[place] for place in known]
    there = at_tip(candidates, terms, values)
    places, _ = moved(candidates, terms, values)
    rows = np.zeros((len(candidates), 3, len(information.gram)))
    rows[:, :, :RIGID] = jacobian((places - information.centre) / information.extent)
    for place in known:
        rows[:, :, information.slices[place]] = columns_of(there, [information.terms[place]])
    rows = np.einsum("ij,njk->nik", information.even, rows)
    pairs: list[Pair] = []
    unasked: list[Unasked] = []
    for rival in information.rivals:
        effect, what = information.terms[rival.effect], lacking[rival.effect] or missing(candidates, rival.term)
        if what:
            unasked.append(Unasked(effect, rival.term, what))
            continue
        own = np.einsum("ij,njk->nik", information.even, columns_of(there, [rival.term]))
        pairs.append(_pair(information, rival, rows, own))
    return pairs, unasked


def _pair(information: Information, rival: RivalColumns, rows: Array, own: Array) -> Pair:
    """Can the rival imitate the effect; can the effect imitate the rival, where this is no part of the model."""
    terms, width = information.terms, len(information.gram)
    part = information.slices[rival.effect]
    effect = np.arange(part.start, part.stop)
    others = np.setdiff1d(np.arange(width), effect)
    values = information.values[rival.effect] / [each.prior for each in terms[rival.effect].parameters]
    if rival.term in terms:
        beside = information.slices[terms.index(rival.term)]
        there, _ = _imitation(information.gram, rows, effect, others, values)
        questions: tuple[Question, ...] = (there,)
        normal, every = information.gram, rows
    else:
        beside = slice(width, width + len(rival.own))
        added = np.arange(beside.start, beside.stop)
        normal = np.block([[information.gram, rival.cross], [rival.cross.T, rival.own]])
        every = np.concatenate([rows, own], axis=2)
        there, answer = _imitation(normal, every, effect, np.concatenate([others, added]), values)
        back, _ = _imitation(normal, every, added, np.arange(width), answer[-len(added) :])
        questions = (there, back)
    return Pair(terms[rival.effect], rival.term, rival.apart, questions, normal, every, (part, beside))


def _determined(normal: Array, part: slice, without: Sequence[slice]) -> int:
    """Directions of a term that its prior moves by more than noise, beside all others but those that are left out."""
    every = np.arange(len(normal))
    own = every[part]
    beside = np.setdiff1d(every, np.concatenate([own, *(every[other] for other in without)]))
    soft = normal[np.ix_(beside, beside)] + np.diag(np.where(beside < RIGID, 0.0, 1.0))
    cross = normal[np.ix_(beside, own)]
    left = normal[np.ix_(own, own)] - cross.T @ np.linalg.solve(soft, cross)
    return int(np.count_nonzero(np.linalg.eigvalsh(left) > 1.0))


def _imitation(normal: Array, rows: Array, true: Rows, free: Rows, values: Array) -> tuple[Question, Array]:
    """Ask how well some parameters imitate others that have true values; and their own values as they do so."""
    soft = normal[np.ix_(free, free)] + np.diag(np.where(free < RIGID, 0.0, 1.0 / _WIDE**2))
    soft[np.diag_indices(RIGID)] *= 1.0 + _LEAST
    wanted = normal[np.ix_(free, true)] @ values
    turned, turn = whitened(soft, rows[:, :, free])
    answer = turn @ (turn.T @ wanted)
    left = float(values @ normal[np.ix_(true, true)] @ values - wanted @ answer)
    error = rows[:, :, true] @ values - rows[:, :, free] @ answer
    return Question(turned, error, max(left, 0.0)), answer
