"""Evidence that spots carry each other's names.

Candidates: a robust fit over the pairs as named; its outliers are assigned anew to the places of the outliers
(linear sum assignment); the permutation falls into cycles: two spots exchanged, or three and more passed round.

A cycle is accepted only if all of these hold, judged by the least-squares fit over the inliers *without* the cycle's
own members, so that none of them takes part in its own trial (a held-out prediction; t is the inliers' threshold,
99.9 % of F, widened by each member's leverage):

1. as named, every member misses its place by more than t, and by more than t would be if noise along every axis were
   that of the inliers' widest (spots are spaced by hand along a flange: near neighbours must not pass for exchanged);
2. with the names repaired, every member meets its place within t, or (noise is rarely the same along all axes) within
   2 t and a quarter of what it missed as named;
3. the RMS over the members falls to `GAIN` or less of what it was;
4. the leave-one-out RMS of the members and all that agree with the model (least squares) falls;
5. at least `WITNESSES` other inliers, not on a line, are left to judge by.

Spots nearer to each other than t cannot be told apart, and are left as they are named.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import linear_sum_assignment

from respot.registration.covariance import leverage
from respot.registration.errors import RegistrationError
from respot.registration.leave_one_out import leave_one_out
from respot.registration.permutation import placement_p_value
from respot.registration.rigid import check_pairs, fit_rigid
from respot.registration.robust import INLIER_CHI, RobustFit, fit_robust, judged_by_direction
from respot.registration.row_order import own_order
from respot.registration.statistics import residual_directions, rms

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

GAIN = 0.5
CLEAR_GAIN, CLEAR_REACH = 0.25, 2.0
WITNESSES = 4
_ROUNDS = 10


@dataclass(frozen=True)
class Exchange:
    """One cycle of names, with its evidence.

    Attributes
    ----------
    ids : tuple of str
        The spot that the source calls ``ids[k]`` lies where the reference has ``ids[k + 1]`` (the last: ``ids[0]``).
    rows : tuple of int
        Their rows in the table of pairs.
    loo_before, loo_after : float
        Leave-one-out RMS of the members and all that agree with the model [mm]: every other accepted cycle repaired,
        this one as named and repaired.
    members_before, members_after : float
        RMS over the members, held out together, as named and repaired [mm].
    worst_before, worst_after : float
        Largest of these distances [mm].
    threshold : float
        What an inlier may miss its place by, before the widening by leverage [mm].
    p_value : float
        Chance that the same residual vectors, laid on spots drawn at random, could be explained by a renaming as well;
        no smaller than 1 / 1000, and no smaller than the number of spots lets it be. Not part of the acceptance.
    """

    ids: tuple[str, ...]
    rows: tuple[int, ...]
    loo_before: float
    loo_after: float
    members_before: float
    members_after: float
    worst_before: float
    worst_after: float
    threshold: float
    p_value: float


@dataclass(frozen=True, eq=False)
class ExchangeResult:
    """What was found, and the pairs with names repaired.

    Attributes
    ----------
    cycles : tuple of Exchange
    permutation : (n,) int array
        Source row i belongs to reference row ``permutation[i]`` of the table of pairs.
    robust : RobustFit
        Robust fit over the repaired pairs.
    """

    cycles: tuple[Exchange, ...]
    permutation: Rows
    robust: RobustFit


def find_exchanged(ids: Sequence[str], source: ArrayLike, reference: ArrayLike, *, seed: int = 0) -> ExchangeResult:
    """Look for exchanged and cycled names among paired spots.

    Parameters
    ----------
    ids : sequence of n str
    source, reference : (n, 3) arrays, n >= 4
        Pairs as named [mm].
    seed : int
        Of the robust fit's consensus start and of the p value's draws.

    Raises
    ------
    RegistrationError
        As `fit_robust`.
    """
    first, second = check_pairs(source, reference, minimum=4)
    permutation = np.arange(len(first), dtype=np.intp)
    robust = fit_robust(first, second, seed=seed, by_direction=False)
    accepted: list[Rows] = []
    for _ in range(_ROUNDS):
        found = [
            cycle
            for cycle in _candidates(first, second[permutation], robust)
            if _judge(first, second[permutation], robust, cycle) is not None
        ]
        if not found:
            break
        for cycle in found:
            permutation[cycle] = permutation[np.roll(cycle, -1)]
        accepted = _cycles(permutation)
        robust = fit_robust(first, second[permutation], seed=seed, by_direction=False)
    evidence = tuple(_evidence(ids, first, second, permutation, robust, cycle, seed) for cycle in accepted)
    # last: along a flange, names of neighbours would pass for noise of that direction
    return ExchangeResult(evidence, permutation, judged_by_direction(robust, first, second[permutation], seed=seed))


def _candidates(source: Array, reference: Array, robust: RobustFit) -> list[Rows]:
    """Cycles of the assignment of outliers to outliers' places; a miss costs no more than the threshold."""
    suspects = np.flatnonzero(~robust.inliers)
    if len(suspects) < 2:
        return []
    predicted = robust.rigid.predict(source[suspects])
    squares = np.sum((predicted[:, None, :] - reference[suspects][None, :, :]) ** 2, axis=-1)
    limit = (CLEAR_REACH * robust.threshold) ** 2  # the trial that follows is the strict one
    cost = np.minimum(squares, limit)
    np.fill_diagonal(cost, np.minimum(np.diag(squares), 0.99 * limit))  # a tie keeps its name
    _, columns = linear_sum_assignment(cost)
    return [suspects[cycle] for cycle in _cycles(np.asarray(columns, dtype=np.intp))]


def _cycles(permutation: Rows) -> list[Rows]:
    """Cycles of length 2 and more; each starts at its lowest row and goes row -> permutation[row]."""
    seen: set[int] = set()
    cycles: list[Rows] = []
    for start in np.flatnonzero(permutation != np.arange(len(permutation))):
        row, cycle = int(start), []
        while row not in seen:
            seen.add(row)
            cycle.append(row)
            row = int(permutation[row])
        if cycle:
            cycles.append(np.array(cycle, dtype=np.intp))
    return cycles


@dataclass(frozen=True, eq=False)
class _Trial:
    before: Array  # (k,) distances of the members, held out, as named [mm]
    after: Array  # (k,) the same with names repaired
    loo_before: float
    loo_after: float


def _judge(source: Array, reference: Array, robust: RobustFit, cycle: Rows) -> _Trial | None:
    """Try one cycle by the five conditions of the module's head; None if it fails one."""
    trial = _try(source, reference, robust, cycle)
    if trial is None:
        return None
    witnesses = robust.inliers.copy()
    witnesses[cycle] = False
    fitted = robust.rigid.predict(source[witnesses])
    limits = robust.threshold * np.sqrt(1.0 + leverage(robust.rigid.predict(source[cycle]), fitted))
    widest = INLIER_CHI * float(residual_directions(robust.rigid.residuals[witnesses]).sd[0])
    reach = np.maximum(limits, np.minimum(CLEAR_REACH * limits, CLEAR_GAIN * trial.before))
    clear = (
        bool(np.all(trial.before > np.maximum(limits, widest)))
        and bool(np.all(trial.after <= reach))
        and float(np.linalg.norm(trial.after)) <= GAIN * float(np.linalg.norm(trial.before))
        and trial.loo_after < trial.loo_before
    )
    return trial if clear else None


def _try(source: Array, reference: Array, robust: RobustFit, cycle: Rows) -> _Trial | None:
    """Held-out distances of a cycle's members as named and repaired; None with too few witnesses."""
    witnesses = robust.inliers.copy()
    witnesses[cycle] = False
    if int(witnesses.sum()) < WITNESSES:
        return None
    try:
        held_out = fit_rigid(source[witnesses], reference[witnesses])
    except RegistrationError:
        return None
    places = np.roll(cycle, -1)
    predicted = held_out.predict(source[cycle])
    repaired = reference.copy()
    repaired[cycle] = reference[places]
    judged = witnesses.copy()  # another wrong spot, perhaps a kilometre off, says nothing about this cycle
    judged[cycle] = True
    return _Trial(
        before=np.linalg.norm(predicted - reference[cycle], axis=1),
        after=np.linalg.norm(predicted - reference[places], axis=1),
        loo_before=rms(leave_one_out(source[judged], reference[judged])),
        loo_after=rms(leave_one_out(source[judged], repaired[judged])),
    )


def _evidence(
    ids: Sequence[str], source: Array, reference: Array, permutation: Rows, robust: RobustFit, cycle: Rows, seed: int
) -> Exchange:
    """Record an accepted cycle, with every other accepted cycle repaired."""
    others = permutation.copy()
    others[cycle] = cycle
    trial = _try(source, reference[others], robust, cycle)
    if trial is None:  # a later repair took the witnesses away; the residuals of the final fit stand in
        predicted = robust.rigid.predict(source[cycle])
        trial = _Trial(
            before=np.linalg.norm(predicted - reference[cycle], axis=1),
            after=np.linalg.norm(predicted - reference[permutation[cycle]], axis=1),
            loo_before=rms(leave_one_out(source, reference[others])),
            loo_after=rms(leave_one_out(source, reference[permutation])),
        )
    return Exchange(
        ids=tuple(str(ids[row]) for row in cycle),
        rows=tuple(int(row) for row in cycle),
        loo_before=trial.loo_before,
        loo_after=trial.loo_after,
        members_before=rms(trial.before[:, None]),
        members_after=rms(trial.after[:, None]),
        worst_before=float(trial.before.max()),
        worst_after=float(trial.after.max()),
        threshold=robust.threshold,
        p_value=_placement(robust.rigid.predict(source), reference, permutation, cycle, seed),
    )


def _placement(predicted: Array, reference: Array, permutation: Rows, cycle: Rows, seed: int) -> float:
    """`placement_p_value` with rows in an order of their own, so that the order of the table plays no part."""
    order = own_order(predicted, reference)
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    members = place[cycle]
    first = int(np.argmin(members))
    return placement_p_value(
        predicted[order], reference[order], place[permutation[order]], np.roll(members, -first), seed=seed
    )
