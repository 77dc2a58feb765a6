"""From paired spots to effects: search, outliers, gates, rivals, what is hidden, nested errors."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from respot.calibration.discovery.bank import Bank
from respot.calibration.discovery.evening import evening
from respot.calibration.discovery.heldout import HeldOut, folds_of, heldout
from respot.calibration.discovery.joint_fit import SCALE_FLOOR, JointFit, fit_jointly
from respot.calibration.discovery.outliers import judged, misfit, settled
from respot.calibration.discovery.refinement import refined
from respot.calibration.discovery.rivals import RivalTable, rival_table
from respot.calibration.discovery.selection import Selection, State
from respot.calibration.discovery.significance import DRAWS
from respot.calibration.discovery.unexplained import Unexplained, unexplained
from respot.calibration.effects import link_geometry, readback_lag, scale, tool_shift
from respot.calibration.effects.catalogue import MECHANISMS, columns_of, terms_of
from respot.calibration.effects.moved import moved, tip_of
from respot.calibration.effects.term import Term
from respot.calibration.observations import Observations
from respot.registration.robust import fit_robust

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

LEAST_SPOTS = 10
"""With fewer spots no effect beyond names and tool is looked for."""
_ROUNDS = 5
_INNER_DRAWS = 299
_ALL_FOLDS = 400
_ALIAS = 1e-6
_ALIAS_P = 0.01
_HIDDEN = 0.05
_FAR_MM, _CLEARLY = 20.0, 10.0
"""A tool that is wrong by more than this, and by so many times its standard deviation, is looked for from there."""


@dataclass(frozen=True, eq=False)
class Accepted:
    """One term of the final model with all that speaks for and against it."""

    term: Term
    values: Array
    sd: Array
    p_value: float
    table: RivalTable
    with_it: HeldOut
    aliases: tuple[Term, ...]
    named: bool

    @property
    def not_separated(self) -> tuple[Term, ...]:
        """Other explanations that these spots do not tell from it."""
        return (*self.table.not_separated, *self.aliases)


@dataclass(frozen=True, eq=False)
class Hidden:
    """An effect that these spots cannot show, and how much of it is seen beside what swallows it (0 to 1)."""

    term: Term
    share: float
    absorbed_by: str


@dataclass(frozen=True, eq=False)
class Discovery:
    """What was found.

    Attributes
    ----------
    fit : JointFit
        The final model.
    accepted : tuple of Accepted
        Its terms, the strongest first.
    tried : tuple of (Term, float, float)
        The best term of each effect that is not in the model: p value, and criterion beyond the final model.
    hidden : tuple of Hidden
    unexplained : Unexplained
    heldout : HeldOut
        Errors of the final structure by way to fold; the rigid part alone in ``heldout_before``.
    nested : (n, 3) array or None
        Errors of spots that took no part in choosing or fitting, with all that was chosen without them, reference frame
        [mm]; NaN where a spot was never held out.
    nested_folds : (n,) int array or None
        Which spots were held out together.
    """

    fit: JointFit
    accepted: tuple[Accepted, ...]
    tried: tuple[tuple[Term, float, float], ...]
    hidden: tuple[Hidden, ...]
    unexplained: Unexplained
    heldout: HeldOut
    heldout_before: HeldOut
    nested: Array | None = None
    nested_folds: NDArray[np.intp] | None = None


@dataclass(frozen=True, eq=False)
class _Search:
    """What a search needs, once for all spots; the columns are those of a tool that is ``tip`` (3,) off [mm]."""

    observations: Observations
    reference: Array
    terms: tuple[Term, ...]
    tip: Array
    columns: Array
    allowed: Mask
    aliases: tuple[int, ...]
    noise: float | None
    seed: int
    step: Callable[[], None] = field(default=lambda: None)

    def rows(self, rows: NDArray[np.intp]) -> _Search:
        """The same for some of the spots."""
        return replace(
            self,
            observations=self.observations.rows(rows),
            reference=self.reference[rows],
            columns=self.columns[rows],
        )

    def at(self, tip: Array) -> _Search:
        """The same with the columns of a tool that is so far off: levers reach to where the tool really ends."""
        columns = columns_of(self.observations.tipped(tip), self.terms)
        aliases, allowed = _choices(self.terms, columns, self.observations.positions)
        return replace(self, tip=tip, columns=columns, aliases=aliases, allowed=allowed)

    def refined(self, chosen: Sequence[int], fit: JointFit) -> _Search:
        """The same with the constants of some terms' forms as a fit of them has them; itself where they are near."""
        better = refined(fit, self.observations)
        if better == fit.terms:
            return self
        terms, columns = list(self.terms), self.columns.copy()
        stops = np.cumsum([0, *(len(term.parameters) for term in terms)])
        for index, term in zip(chosen, better, strict=True):
            if term != terms[index]:
                terms[index] = term
                own = columns_of(self.observations.tipped(self.tip), [term])
                columns[:, :, int(stops[index]) : int(stops[index + 1])] = own
        return replace(self, terms=tuple(terms), columns=columns)


@dataclass(frozen=True, eq=False)
class _Found:
    search: _Search
    selection: Selection
    state: State
    fit: JointFit


def discover(
    observations: Observations,
    reference: Array,
    *,
    inliers: Mask | None = None,
    noise: float | None = None,
    seed: int = 0,
    effects: frozenset[str] | None = None,
    draws: int = DRAWS,
    nested: bool = True,
    progress: Callable[[], None] = lambda: None,
) -> Discovery:
    """Look for effects among paired spots, names repaired.

    Parameters
    ----------
    observations : Observations
        n spots.
    reference : (n, 3) array
        Where they were found [mm].
    inliers : (n,) bool array, optional
        What a robust rigid fit keeps: one of the places to start from.
    noise : float, optional
        Standard deviation per coordinate, known independently [mm]. Nothing continuous is named without it.
    seed : int
        Of permutations.
    effects : set of str, optional
        Effects to look for; default all of the catalogue.
    draws : int
        Permutations for each question.
    nested : bool
        Also hold out a fifth of the spots five times and choose without them.
    progress : callable
        Called as the work goes on.
    """
    search = _prepared(observations, reference, noise, seed, effects, progress)
    starts = [np.ones(len(observations), dtype=np.bool_)]
    if inliers is not None and not inliers.all():
        starts.append(inliers)
    found = min((_settle(search, start, draws) for start in starts), key=lambda each: misfit(each.fit))
    search = found.search
    found = _gated(found)
    folds = folds_of(observations)
    accepted = _accepted(found, folds)
    left = unexplained(found.fit, observations, noise, seed)
    shaped = any(MECHANISMS[each.term.effect].describes for each in accepted)
    accepted = tuple(replace(each, named=_named(each, left, found.fit, noise, shaped)) for each in accepted)
    if not left.present and shaped:
        text = f"a smooth field over the part describes some of it, and what causes the field is not known; {left.text}"
        left = replace(left, present=True, text=text)
    before = fit_jointly(observations, reference, (), found.fit.inliers)
    progress()
    labels = folds["mixed"]
    return Discovery(
        found.fit,
        accepted,
        _tried(found),
        _hidden(search),
        left,
        heldout(found.fit, folds),
        heldout(before, folds),
        _nested(search, found.fit.inliers, labels, draws) if nested and accepted else None,
        labels,
    )


def _prepared(
    observations: Observations,
    reference: Array,
    noise: float | None,
    seed: int,
    effects: frozenset[str] | None,
    step: Callable[[], None],
) -> _Search:
    terms = tuple(terms_of(observations, effects))
    columns = columns_of(observations, terms)
    aliases, allowed = _choices(terms, columns, observations.positions)
    search = _Search(observations, reference, terms, np.zeros(3), columns, allowed, aliases, noise, seed, step)
    tip = _far_tip(search)
    return search if tip is None else search.at(tip)


def _choices(terms: Sequence[Term], columns: Array, points: Array) -> tuple[tuple[int, ...], Mask]:
    """Terms that move spots as a tool offset does, and which of all terms may be chosen."""
    bank = Bank(terms, columns, points)
    # directions that even the widest plausible error hides behind rounding
    whole = bank.gains(bank.span((), 0.0), np.zeros(columns.shape[2]), 0.0)
    aliases = _aliases_of_tool(terms, columns)
    allowed = whole.ranks > 0
    allowed[list(aliases)] = False
    return aliases, allowed


def _far_tip(search: _Search) -> Array | None:
    """Where the tool (3,) clearly ends far from where the poses have it: they are the flange's, or another tool's."""
    tools = [term for term in search.terms if term.effect == tool_shift.NAME]
    if not tools:
        return None
    fit = fit_jointly(search.observations, search.reference, tools, np.ones(len(search.reference), dtype=np.bool_))
    far = float(np.linalg.norm(fit.values[0]))
    clearly = far > _CLEARLY * float(np.linalg.norm(fit.value_sd[0]))
    return fit.values[0] if far > _FAR_MM and clearly else None


def _aliases_of_tool(terms: Sequence[Term], columns: Array) -> tuple[int, ...]:
    """Terms that move spots by a constant in the tool: the last axis's zero, the flange's length."""
    tool = [number for number, term in enumerate(terms) if term.effect == "tool_offset"]
    if not tool:
        return ()
    stops = np.cumsum([len(term.parameters) for term in terms])
    flat = columns.reshape(-1, columns.shape[2])
    span = np.linalg.qr(flat[:, stops[tool[0]] - 3 : stops[tool[0]]])[0]
    found = []
    for number, term in enumerate(terms):
        if MECHANISMS[term.effect].acts not in ("joints", "arm") or term.effect == "link_geometry":
            continue
        part = flat[:, stops[number] - len(term.parameters) : stops[number]]
        rest = part - span @ (span.T @ part)
        if np.linalg.norm(rest) < _ALIAS * max(float(np.linalg.norm(part)), 1e-300):
            found.append(number)
    return tuple(found)


def _settle(search: _Search, inliers: Mask, draws: int) -> _Found:
    """Search, fit, judge outliers by the model, and search again until nothing changes."""
    seen: list[tuple[bytes, tuple[Term, ...]]] = []
    # about a tool that is far off nothing is linear
    begin = [i for i, term in enumerate(search.terms) if term.effect == tool_shift.NAME and np.any(search.tip)]
    fit = fit_jointly(search.observations, search.reference, [search.terms[i] for i in begin], inliers)
    printing = fit.sigma <= SCALE_FLOOR  # what is finer than a micrometre has no cause
    found: _Found | None = None
    for _ in range(_ROUNDS):
        rows = np.flatnonzero(inliers)
        even = None if found is None else evening(fit.noise)
        selection = _selection(search, fit, draws, even)
        start = tuple(begin) if found is None else found.state.chosen
        judged = len(rows) >= LEAST_SPOTS and not printing
        state = selection.search(start) if judged else selection.state((), 0.0)
        chosen = tuple(sorted(state.chosen))
        fit = fit_jointly(search.observations, search.reference, [search.terms[i] for i in chosen], inliers)
        refining = search.refined(chosen, fit)
        if refining is not search:
            search = refining
            fit = fit_jointly(search.observations, search.reference, [search.terms[i] for i in chosen], inliers)
            selection = _selection(search, fit, draws, even)
        found = _Found(search, selection, selection.state(chosen, selection.sigma(state)), fit)
        inliers = settled(fit)
        key = (np.packbits(inliers).tobytes(), tuple(search.terms[i] for i in chosen))
        # once more where the noise turns out not to be alike along all axes
        tip = tip_of(fit.terms, fit.values)
        there = not np.any(tip) or float(np.abs(tip - search.tip).max()) <= _FAR_MM / 2.0
        if key in seen and (even is not None) == (fit.noise is not None) and there:
            break
        seen.append(key)
        if not there:
            search = search.at(tip)
        if not np.array_equal(inliers, fit.inliers):
            fit = fit_jointly(search.observations, search.reference, fit.terms, inliers, fit.values)
    assert found is not None  # noqa: S101 - at least one round
    return found


def _selection(search: _Search, fit: JointFit, draws: int, even: Array | None) -> Selection:
    """Make a search among a fit's inliers, linear about it."""
    rows = np.flatnonzero(fit.inliers)
    bank = Bank(search.terms, search.columns[rows], fit.moved[rows], even)
    wanted = bank.project(bank.evened(fit.linear[rows]).ravel())
    return Selection(bank, wanted, search.noise, search.allowed, draws=draws, seed=search.seed, step=search.step)


def _gated(found: _Found) -> _Found:
    """Leave out terms that do not help spots that were held out, by at least two ways to fold."""
    search = found.search
    while found.state.chosen:
        folds = folds_of(search.observations)
        failing = []
        for index in found.state.chosen:
            term = search.terms[index]
            without = [search.terms[i] for i in found.state.chosen if i != index]
            bare = fit_jointly(search.observations, search.reference, without, found.fit.inliers)
            skip = _skipped(search.observations, term)
            one, other = heldout(found.fit, folds, skip), heldout(bare, folds, skip)
            both = [scheme for scheme in one.rms if scheme in other.rms]
            gains = [other.rms[scheme] - one.rms[scheme] for scheme in both]
            better = sum(gain > 0.0 for gain in gains)
            if not gains:  # no way to fold is fair to it: each spot by all others is
                gains, better = [_one_by_one(bare) - _one_by_one(found.fit)], 2
            if better < min(2, len(both)) or sum(gains) <= 0.0:
                failing.append((sum(gains), index))
        if not failing:
            return found
        worst = min(failing)[1]
        chosen = tuple(i for i in found.state.chosen if i != worst)
        fit = fit_jointly(search.observations, search.reference, [search.terms[i] for i in chosen], found.fit.inliers)
        selection = _selection(search, fit, found.selection.draws, evening(fit.noise))
        found = _Found(search, selection, selection.state(chosen, found.fit.sigma), fit)
    return found


def _one_by_one(fit: JointFit) -> float:
    """RMS of the errors of single spots, each left out [mm]."""
    errors = judged(fit)[0][fit.inliers]
    return float(np.sqrt(np.mean(np.sum(errors**2, axis=1))))


def _skipped(observations: Observations, term: Term) -> frozenset[str]:
    """Ways to fold that a term's own column makes."""
    column = observations.columns.get(term.own)
    return frozenset({"time"}) if column is not None and column.role == "time" else frozenset()


def _accepted(found: _Found, folds: dict[str, NDArray[np.intp]]) -> tuple[Accepted, ...]:
    search, selection, fit = found.search, found.selection, found.fit
    state = selection.state(found.state.chosen, fit.sigma)
    made = []
    for place, index in enumerate(found.state.chosen):
        search.step()
        skip = _skipped(search.observations, search.terms[index])
        table = rival_table(selection, state, index, search.observations, search.reference, fit, folds, skip)
        one = Accepted(
            search.terms[index],
            fit.values[place],
            fit.value_sd[place],
            selection.chance_of(state, index),
            table,
            heldout(fit, folds, skip),
            _tool_aliases(found, index),
            named=False,
        )
        rest = selection.state([i for i in state.chosen if i != index], fit.sigma)
        made.append((rest.criterion - state.criterion, one))
    accepted = [one for _, one in sorted(made, key=lambda pair: -pair[0])]
    # a body that changes its shape grows as well, and of links that are all off the last one's errors are a tool
    # offset: how much of it is which, nobody knows
    shapes = tuple(one.term for one in accepted if MECHANISMS[one.term.effect].describes)
    links = tuple(one.term for one in accepted if one.term.effect == link_geometry.NAME)
    beside = {scale.NAME: shapes, tool_shift.NAME: links}
    return tuple(replace(one, aliases=(*one.aliases, *beside.get(one.term.effect, ()))) for one in accepted)


def _tool_aliases(found: _Found, index: int) -> tuple[Term, ...]:
    """Of a tool offset: single causes in the arm that explain it as well as the offset does."""
    search = found.search
    if search.terms[index].effect != "tool_offset":
        return ()
    others = [search.terms[i] for i in found.state.chosen if i != index]
    full = float(np.sum(found.fit.residuals[found.fit.inliers] ** 2))
    alike = []
    for alias in search.aliases:
        term = search.terms[alias]
        trial = fit_jointly(search.observations, search.reference, [*others, term], found.fit.inliers)
        extra = 3 - len(term.parameters)
        rest = float(np.sum(trial.residuals[trial.inliers] ** 2)) - full
        value = rest / extra / found.fit.sigma**2
        if float(stats.f.sf(value, extra, found.fit.free)) > _ALIAS_P:
            alike.append(term)
    return tuple(alike)


def _named(one: Accepted, left: Unexplained, fit: JointFit, noise: float | None, shaped: bool) -> bool:
    """Whether an effect may be called the cause: floor reached, nothing left, rivals lose, plausible.

    Beside a shape whose cause is not known, only what follows something that was written down: the rest may be part of
    the same cause.
    """
    if shaped and not one.term.own and one.term.effect != readback_lag.NAME:
        return False
    if noise is None or not left.reached or left.present or not _is_cause(one.term):
        return False
    priors = np.array([parameter.prior for parameter in one.term.parameters])
    plausible = bool(np.all(np.abs(one.values) <= 4.0 * priors))
    return not one.aliases and one.table.all_lose_clearly and plausible and len(fit.residuals) >= LEAST_SPOTS


def _is_cause(term: Term) -> bool:
    mechanism = MECHANISMS[term.effect]
    return not (mechanism.describes or mechanism.points or mechanism.many)


def _tried(found: _Found) -> tuple[tuple[Term, float, float], ...]:
    """The best term of each effect that is not in the model, with its chance beside the model."""
    selection, state = found.selection, found.state
    state = selection.state(state.chosen, found.fit.sigma)
    criteria = selection.beside(state)
    chances = selection.chances(state)
    best: dict[str, int] = {}
    for index in np.argsort(criteria).tolist():
        if np.isfinite(criteria[index]):
            best.setdefault(selection.bank.terms[index].effect, index)
    return tuple(
        (selection.bank.terms[index], float(chances[index]), float(criteria[index] - state.criterion))
        for index in best.values()
    )


def _hidden(search: _Search) -> tuple[Hidden, ...]:
    """Effects that the rigid part swallows whole, or nearly."""
    bank = Bank(search.terms, search.columns, search.observations.positions)
    shares = bank.shares
    seen: dict[tuple[object, ...], Hidden] = {}
    for number, term in enumerate(search.terms):
        if shares[number] < _HIDDEN:
            seen.setdefault(term.key, Hidden(term, float(shares[number]), "the rigid transform"))
        elif number in search.aliases:
            seen.setdefault(term.key, Hidden(term, 0.0, "tool_offset"))
    return tuple(seen.values())


def _nested(search: _Search, inliers: Mask, labels: NDArray[np.intp], draws: int) -> Array:
    """Errors (n, 3) of each fold of spots by a model that was chosen and fitted without it [mm]."""
    errors = np.full((len(search.observations), 3), np.nan)
    folds = int(labels.max()) + 1
    # a fifth of very many spots says enough, and each fold takes as long as the search itself
    for fold in range(folds if len(errors) <= _ALL_FOLDS else 1):
        rest, out = np.flatnonzero(labels != fold), np.flatnonzero(labels == fold)
        if len(rest) < LEAST_SPOTS:
            continue
        part = search.rows(rest)
        # what all spots together say of outliers is not known here
        start = np.ones(len(rest), dtype=np.bool_)
        if not inliers.all():
            start = fit_robust(part.observations.positions, part.reference, seed=search.seed).inliers
        found = _gated(_settle(part, start, min(draws, _INNER_DRAWS)))
        errors[out] = _errors(search, found.fit, out)
        search.step()
    return errors


def _errors(search: _Search, fit: JointFit, out: NDArray[np.intp]) -> Array:
    places, _ = moved(search.observations.rows(out), fit.terms, fit.values)
    return np.asarray(places @ fit.rotation.T + fit.translation - search.reference[out])
