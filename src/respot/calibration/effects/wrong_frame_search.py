"""Evidence for the effect ``wrong_frame``: which listed frame puts which spots where the reference has them.

Every group of spots that name one tool or base (a program's, a level's of a column, or all of them) is tried with every
other listed frame in its place. There is nothing to fit in that, so a frame proves itself where it

- takes away most of what the group lies off, and far more than chance gives;
- leaves no motion of the group that its spots can tell from none, or one that is very small beside the exchange;
- is not met by chance: any of the m frames that were tried comes within ``e`` of a shift of the size ``r`` with a
  probability of about ``m (e / r)^3``, if it lies anywhere as far away (turns, which make it rarer, are not counted);
- has no rival: no other frame, and no other group, that explains all spots about as well. Of two groups that stand
  wrong against each other it is the frame's own numbers that tell which one, or nothing does.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from respot.calibration.effects.effect import Effect, Rival
from respot.calibration.effects.term import Term
from respot.calibration.effects.wrong_frame import (
    NAME,
    Exchange,
    at_frames,
    exchanges,
    joints_under,
    labels_of,
    moved_by,
    remedy_of,
    remedy_text,
    rows_of,
)
from respot.calibration.observations import Observations
from respot.calibration.spot_frames import FRAME_KINDS
from respot.registration.covariance import jacobian
from respot.registration.errors import RegistrationError
from respot.registration.leave_one_out import leave_one_out
from respot.registration.robust import RobustFit, fit_robust
from respot.registration.statistics import rms

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

LEAST_SPOTS, LEAST_OF_A_GROUP = 10, 3
CHANCE = 0.01
"""A frame that is met by chance more often than this is no proof."""
CLEAR = 10.0
"""A rival loses clearly where it leaves this much more, in squares of the noise: `discovery.rivals.CLEAR`."""
_AGREES = 0.01
_CLEARLY_MET = 1e-4  # so rarely met by chance that what is left of the group's motion is another cause's
_BETTER = 0.5
_GAIN = 10.0  # in squares of the noise
_CAP = 100.0  # of one spot, in squares of the noise
_LARGE = 0.02  # spots of a group may lie apart by this share of a large exchange, and are no outliers
_MOSTLY = 0.5  # of a group, and of all others, must follow the fit
_MOST = 4
_PLAUSIBLE_MM = 50.0  # of a whole cell against its theory
_FLOOR_MM = 1e-3
_RCOND = 1e-10


@dataclass(frozen=True, eq=False)
class FrameSearch:
    """What was found.

    Attributes
    ----------
    observations : Observations
        The spots where the frames found put them; without joints where these would be others by far.
    terms : tuple of Term
        Each exchange, in the order in which they were found.
    effects : tuple of Effect
        Their records.
    unproved : tuple of Term
        Exchanges that would explain what a group is off, where chance may meet it as well.
    """

    observations: Observations
    terms: tuple[Term, ...] = ()
    effects: tuple[Effect, ...] = ()
    unproved: tuple[Term, ...] = ()


@dataclass(frozen=True, eq=False)
class _Group:
    """Spots (n,) that name one frame, and the other frames to try."""

    place: Mapping[str, str]
    spots: Mask
    tried: tuple[Exchange, ...]


@dataclass(frozen=True, eq=False)
class _Try:
    """A frame in the place of another for a group, with the fit of all spots under it."""

    group: _Group
    exchange: Exchange
    points: Array
    fit: RobustFit

    @property
    def term(self) -> Term:
        return self.exchange.term(self.group.place)

    def cost(self, noise: float, same_frame: bool) -> float:
        return _cost(self.fit, self.points, noise, same_frame)


@dataclass(frozen=True, eq=False)
class _Left:
    """Motion of a group that is left beside an exchange.

    Attributes
    ----------
    size : float
        RMS over the group [mm].
    width : float
        Two standard deviations of the same [mm].
    p_value : float
        Chance of as much without any.
    shift, sd : (3,) arrays
        At the middle of the group, source frame; of a tool in its axes [mm].
    """

    size: float
    width: float
    p_value: float
    shift: Array
    sd: Array


@dataclass(frozen=True, eq=False)
class _Question:
    """Spots and what they are compared with; ``positions`` may hold what other effects do to them."""

    observations: Observations
    reference: Array
    same_frame: bool
    seed: int
    _kept: dict[bytes, RobustFit | None] = field(default_factory=dict)

    @cached_property
    def plain(self) -> RobustFit:
        return fit_robust(self.observations.positions, self.reference, seed=self.seed)

    def of_others(self, group: Mask) -> RobustFit | None:
        """Fit of the spots outside a group; None where they do not tell one."""
        key = np.packbits(group).tobytes()
        if key not in self._kept:
            try:
                rest = ~group
                self._kept[key] = fit_robust(self.observations.positions[rest], self.reference[rest], seed=self.seed)
            except RegistrationError:
                self._kept[key] = None
        return self._kept[key]


def find_wrong_frames(
    observations: Observations,
    reference: Array,
    *,
    same_frame: bool,
    seed: int,
    beside: Array | None = None,
) -> FrameSearch:
    """Look for groups of spots that lie where another listed frame would put them.

    Parameters
    ----------
    observations : Observations
        n spots; nothing is found where they do not tell their frames.
    reference : (n, 3) array
        Where they were found [mm].
    same_frame : bool
        Source and reference claim to be in one coordinate system: then all spots together may be off as well.
    seed : int
    beside : (n, 3) array, optional
        Shifts by other effects, source frame, where the spots are written [mm].
    """
    if observations.frames is None or len(observations) < LEAST_SPOTS:
        return FrameSearch(observations)

    def question(seen: Observations) -> _Question:
        there = seen if beside is None else replace(seen, positions=seen.positions + beside)
        return _Question(there, reference, same_frame, seed)

    terms: list[Term] = []
    effects: list[Effect] = []
    unproved: tuple[Term, ...] = ()
    while len(terms) < _MOST:
        taken = [rows_of(observations, term) for term in terms]
        step = _best(question(at_frames(observations, terms)), taken)
        if step is None:
            break
        term, effect = step
        if effect is None:
            unproved = (term,)
            break
        terms.append(term)
        effects.append(effect)
    if len(terms) > 1:  # each is judged again where the others are right: they were no rivals
        for place, term in enumerate(terms):
            others = [other for other in terms if other is not term]
            taken = [rows_of(observations, other) for other in others]
            again = _best(question(at_frames(observations, others)), taken)
            if again is not None and again[1] is not None and again[0].where == term.where:
                effects[place] = again[1]
    return FrameSearch(_seen_at(observations, terms), tuple(terms), tuple(effects), unproved)


def _seen_at(observations: Observations, terms: Sequence[Term]) -> Observations:
    """Spots where the frames found put them; without joints where the robot that is known cannot reach them."""
    for term in terms:
        reached = observations.joints is None or joints_under(observations, term) is not None
        observations = at_frames(observations, [term])
        if not reached:
            observations = replace(observations, joints=None, measured_joints=None)
    return observations


def _groups(question: _Question) -> list[_Group]:
    """Groups of spots that name one frame: by program, all of them, by columns; the same spots once."""
    observations = question.observations
    frames = observations.frames
    assert frames is not None  # noqa: S101 - asked before
    columns = ["program", "", *(name for name, column in observations.columns.items() if column.role == "group")]
    found: list[_Group] = []
    for kind in FRAME_KINDS:
        if kind == "tool" and observations.rotations is None:
            continue
        named = np.array(frames.columns[kind])
        for name in dict.fromkeys(frames.columns[kind]):
            if not name:
                continue
            whole = named == name
            tried = tuple(exchanges(frames, kind, name))
            seen: set[bytes] = set()
            for place, spots in _parts(observations, whole, columns):
                key = np.packbits(spots).tobytes()
                absorbed = kind == "base" and bool(spots.all()) and not question.same_frame
                if key in seen or absorbed or int(spots.sum()) < LEAST_OF_A_GROUP or not tried:
                    continue
                seen.add(key)
                found.append(_Group(place, spots, tried))
    return found


def _parts(observations: Observations, whole: Mask, columns: list[str]) -> Iterator[tuple[Mapping[str, str], Mask]]:
    for column in columns:
        if not column:
            yield {}, whole
            continue
        labels = np.array(labels_of(observations, column) or [""] * len(whole))
        for level in np.unique(labels[whole]).tolist():
            if level:
                yield {"column": column, "level": level}, whole & (labels == level)


def _best(question: _Question, taken: list[Mask]) -> tuple[Term, Effect | None] | None:
    """Return the exchange that explains most, with its record if it is proved; spots of ``taken`` have one already."""
    free = ~np.any([np.zeros(len(question.reference), dtype=np.bool_), *taken], axis=0)
    groups = [group for group in _groups(question) if bool(free[group.spots].all())]
    tries = [made for group in groups for exchange in group.tried if (made := _tried(question, group, exchange))]
    if not tries:
        return None
    noise = max(min(each.fit.scale for each in tries), _FLOOR_MM)
    costs = np.array([each.cost(noise, question.same_frame) for each in tries])
    equal = [place for place in np.argsort(costs).tolist() if costs[place] < costs.min() + CLEAR]
    best = tries[min(equal, key=lambda place: int(tries[place].group.spots.sum()))]  # that the fewest are wrong
    gain = _cost(question.plain, question.observations.positions, noise, question.same_frame) - float(costs.min())
    left = _left(question, best)
    tolerance = left.size + left.width
    chance = _chance(question, groups, best, left)
    met = (left.p_value >= _AGREES and chance < CHANCE) or chance < _CLEARLY_MET
    if gain < _GAIN or not met:
        return (best.term, None) if gain >= _GAIN and left.p_value >= _AGREES else None
    order = [int(place) for place in np.argsort(costs) if tries[int(place)] is not best]
    lead = {place: float(costs[place] - costs.min()) for place in order}
    rivals = [tries[place] for place in order if lead[place] < CLEAR or _as_near(best, tries[place], tolerance)]
    others = [tries[place] for place in order[:3]]
    effect = _effect(question, best, left, chance, rivals, others, gain, min(lead.values(), default=None))
    return best.term, effect


def _tried(question: _Question, group: _Group, exchange: Exchange) -> _Try | None:
    """Fit of all spots with an exchange; None where it does not even halve what the group lies off by the others."""
    observations, spots = question.observations, group.spots
    points, _ = moved_by(exchange, observations.positions, observations.rotations)
    points = np.where(spots[:, None], points, observations.positions)
    if spots.all() and exchange.kind == "tool":  # nothing beside the group tells where it should be
        fit = _fit(question, points)
        lengths = [np.linalg.norm(each.rigid.residuals, axis=1) for each in (question.plain, fit) if each is not None]
        better = fit is not None and float(np.median(lengths[1])) <= _BETTER * float(np.median(lengths[0]))
        return _Try(group, exchange, points, fit) if fit is not None and better else None
    wanted, own = question.reference[spots], observations.positions[spots]
    if not spots.all():
        others = question.of_others(spots)
        if others is None:
            return None
        wanted = (wanted - others.rigid.translation) @ others.rigid.rotation
    before, after = (float(np.median(np.linalg.norm(each - wanted, axis=1))) for each in (own, points[spots]))
    fit = None if after > _BETTER * before else _fit(question, points)
    return None if fit is None else _Try(group, exchange, points, fit)


def _fit(question: _Question, points: Array) -> RobustFit | None:
    """Fit of all spots; None where they do not determine one."""
    try:
        return fit_robust(points, question.reference, seed=question.seed)
    except RegistrationError:
        return None


def _cost(fit: RobustFit, points: Array, noise: float, same_frame: bool) -> float:
    """What a fit leaves, in squares of the noise, far spots capped; in one frame with what its deviation costs.

    That is its 6 parameters, as by Schwarz, or less where none is needed; and how large it is beside what is plausible.
    """
    left = fit.rigid.residuals
    total = float(np.minimum(np.sum(left**2, axis=1) / noise**2, _CAP).sum())
    if not same_frame:
        return total
    reference = fit.rigid.predict(points) - left
    apart = (points - reference)[fit.inliers]
    none = float(np.sum(apart**2) - np.sum(left[fit.inliers] ** 2)) / noise**2
    size = float(np.mean(np.sum((points - fit.rigid.predict(points)) ** 2, axis=1))) / _PLAUSIBLE_MM**2
    return total + min(6.0 * float(np.log(left.size)), none) + min(size, _CAP)


def _left(question: _Question, one: _Try) -> _Left:
    """What the spots say of a motion of the group beside the exchange, with the rigid part of all spots free."""
    spots, fit, tool = one.group.spots, one.fit, one.exchange.kind == "tool"
    rotation, places = fit.rigid.rotation, fit.rigid.predict(one.points)
    residuals = fit.rigid.residuals
    used = fit.inliers & ~spots | _together(question, one)
    extent = max(float(np.sqrt(np.mean((places - places.mean(axis=0)) ** 2))), 1.0)
    middle = places[spots].mean(axis=0)
    rigid = jacobian((places - middle) / extent)
    if tool:
        assert question.observations.rotations is not None  # noqa: S101 - groups of tools have them
        own = rotation @ question.observations.rotations.as_matrix()
    else:
        own = rigid.copy()
    own = own * spots[:, None, None]
    if spots.all() and not tool:  # in one frame: there is nothing beside the group
        rigid, residuals, rotation = rigid[:, :, :0], one.points - question.reference, np.eye(3)
    design = np.concatenate([rigid, own], axis=2)[used].reshape(-1, rigid.shape[2] + own.shape[2])
    wanted = -residuals[used].ravel()
    inverse = np.linalg.pinv(design.T @ design, rcond=_RCOND, hermitian=True)
    answer = inverse @ (design.T @ wanted)
    free = max(len(wanted) - int(np.linalg.matrix_rank(design)), 1)
    variance = max(float(np.sum((wanted - design @ answer) ** 2)) / free, _FLOOR_MM**2)
    first = rigid.shape[2]
    values, spread = answer[first:], variance * inverse[first:, first:]
    rows = own[spots]
    size = float(np.sqrt(np.mean(np.sum((rows @ values) ** 2, axis=1))))
    width = 2.0 * float(np.sqrt(np.mean(np.einsum("nik,kl,nil->n", rows, spread, rows))))
    rank = int(np.linalg.matrix_rank(rows.reshape(-1, rows.shape[2])))
    square = float(values @ np.linalg.pinv(spread, rcond=_RCOND, hermitian=True) @ values)
    turn = np.eye(3) if tool else rotation.T
    return _Left(
        size,
        width,
        float(stats.f.sf(square / rank, rank, free)),
        turn @ values[:3],
        np.sqrt(np.maximum(np.diag(turn @ spread[:3, :3] @ turn.T), 0.0)),
    )


def _together(question: _Question, one: _Try) -> Mask:
    """Spots (n,) of a group that lie off alike: not those that are off by themselves, whatever the group is off."""
    spots, residuals = one.group.spots, one.fit.rigid.residuals
    if one.exchange.kind == "tool" and question.observations.rotations is not None:
        residuals = question.observations.rotations.inv().apply(residuals @ one.fit.rigid.rotation)
    elif spots.all():
        residuals = one.points - question.reference
    apart = np.linalg.norm(residuals - np.median(residuals[spots], axis=0), axis=1)
    moved = _shifts_of(question, one.group, one.exchange)[1]
    alike: Mask = spots & (apart <= max(one.fit.threshold, _LARGE * moved))
    return alike


def _chance(question: _Question, groups: list[_Group], best: _Try, left: _Left) -> float:
    """How many of all exchanges that were tried come by chance as near to what the spots show.

    By the shift of the middle of the group, or where that hardly moves by all that its spots move.
    """
    reach = float(np.linalg.norm(left.shift)) + 2.0 * float(np.linalg.norm(left.sd))
    expected = np.zeros(2)
    size = np.array(_shifts_of(question, best.group, best.exchange))
    for group in groups:
        for exchange in group.tried:
            other = np.array(_shifts_of(question, group, exchange))
            met = np.minimum(1.0, (np.array([reach, left.size + left.width]) / np.maximum(other, 1e-9)) ** 3)
            expected += np.where(other > size / 3.0, met, 0.0)  # a nearer one cannot have been taken for it
    return float(min(1.0, 2.0 * expected.min()))  # the better of two looks


def _shifts_of(question: _Question, group: _Group, exchange: Exchange) -> tuple[float, float]:
    """What an exchange moves the middle of a group by, or what it shifts a tool by; and all of its spots, RMS [mm]."""
    observations = question.observations
    points, _ = moved_by(exchange, observations.positions, observations.rotations)
    apart = (points - observations.positions)[group.spots]
    whole = float(np.sqrt(np.mean(np.sum(apart**2, axis=1))))
    return (whole if exchange.kind == "tool" else float(np.linalg.norm(apart.mean(axis=0)))), whole


def _as_near(best: _Try, other: _Try, tolerance: float) -> bool:
    """Whether two exchanges put the same spots in places that the tolerance [mm] does not tell apart."""
    if not np.array_equal(best.group.spots, other.group.spots):
        return False
    apart = (best.points - other.points)[best.group.spots]
    return float(np.sqrt(np.mean(np.sum(apart**2, axis=1)))) <= tolerance


def _effect(
    question: _Question,
    best: _Try,
    left: _Left,
    chance: float,
    rivals: list[_Try],
    others: list[_Try],
    gain: float,
    lead: float | None,
) -> Effect:
    exchange, spots = best.exchange, best.group.spots
    alike = [replace_real(best.term, name) for name in exchange.alike]
    names = tuple(dict.fromkeys([*(term.label for term in alike), *(each.term.label for each in rivals)]))
    observations = question.observations
    listed = np.asarray(exchange.motion.translation)
    if exchange.kind == "base":
        listed = (best.points - observations.positions)[spots].mean(axis=0)
    seen = listed + left.shift
    plain = rms(leave_one_out(observations.positions, question.reference, best.fit.inliers))
    with_it = rms(leave_one_out(best.points, question.reference, best.fit.inliers))
    text = remedy_text(
        exchange, best.group.place, listed, left.size, [*exchange.alike, *(_short(best, each) for each in rivals)]
    )
    return Effect(
        name=NAME,
        where=dict(best.term.where),
        named=not names,
        remedy=remedy_of(exchange, text),
        heldout_gain=plain - with_it,
        p_value=chance,
        parameters={
            axis: {"value": value, "unit": "mm", "ci95": [value - 2.0 * sd, value + 2.0 * sd]}
            for axis, value, sd in zip("xyz", seen.tolist(), left.sd.tolist(), strict=True)
        },
        not_separated_from=names,
        rivals=(
            Rival("without it", plain),
            *(
                Rival(each.term.label, rms(leave_one_out(each.points, question.reference, best.fit.inliers)))
                for each in others
            ),
        ),
        evidence={
            "listed_shift": listed.tolist(),
            "turn_deg": float(np.degrees(exchange.motion.rotation.magnitude())),
            "met_within": left.size,
            "met_width": left.width,
            "agreement_p": left.p_value,
            "spots": int(spots.sum()),
            "gain": gain,
            "criterion_lead": lead,
            "heldout_rms": with_it,
        },
    )


def replace_real(term: Term, name: str) -> Term:
    """Return a term with another frame that puts the spots in the same places."""
    return replace(term, where={**term.where, "real": name})


def _short(best: _Try, other: _Try) -> str:
    """Name a rival: its frame, and its group where that is another."""
    place, own = other.group.place, other.exchange
    if np.array_equal(best.group.spots, other.group.spots):
        return own.real.text
    whose = f"{place['column']} {place['level']}" if place else f"the spots under {own.written.text}"
    return f"for {whose} {own.real.text} in the place of {own.written.text}"
