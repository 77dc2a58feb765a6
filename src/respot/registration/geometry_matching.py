"""Pairs by geometry alone: two lists of places, no names, an unknown rigid motion, spots missing and spots extra.

Triples of source spots are laid on all triples of the reference with nearly the same three distances; every such
placement is scored by how many source spots come to lie near a reference spot. The best ones are settled by least
squares and one-to-one assignment in turn (linear sum assignment). After M. A. Fischler and R. C. Bolles, Comm. ACM 24
(1981), and P. J. Besl and N. D. McKay, IEEE PAMI 14 (1992).

Symmetric parts and rows of equal pitch have several placements that are nearly as good. The best one that pairs other
spots, the runner-up, is always looked for and returned; where it is as good, nothing is matched.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import linear_sum_assignment
from scipy.spatial.distance import cdist

from respot.registration.congruence import distances_between
from respot.registration.errors import RegistrationError
from respot.registration.nearest import NearestSpots
from respot.registration.rigid import transform_of
from respot.registration.robust import INLIER_CHI, robust_scale
from respot.registration.triples import transforms_of_triples

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

REACH = 40.0
"""A spot pairs with none that lies further away [mm]: the threshold of an inlier at a noise of 10 mm per coordinate."""
LEAST_REACH = 3.0
AS_GOOD = 0.7
"""A runner-up with this share of the winner's support, both beyond the background, is as good: the match is refused."""
LEAST_SHARE = 0.5
"""A match holds at least this share of the shorter list, and at least 4 spots."""
SAME_FRAME_TURN = 15.0
"""Where both frames claim to be the same no placement turns by more than this [deg]."""
MOST_BY_CHANCE = 0.05
"""A match is refused where lists that have nothing in common would be expected to give this many as good."""
MOST_SPOTS = 2000
_SIDE = 35.0  # two sides of a triple agree up to this [mm]
_TRIPLES, _LEAST_TRIPLES = 25, 8  # with 30 % of the spots lost all 25 miss three in 100,000 times
_MOST_CANDIDATES, _LOOKED_AT, _SETTLED, _FIRST_LOOK = 20_000, 400, 8, 12
_ROUGHLY = 100  # source spots beyond which distances to the nearest reference spot are looked up in cells first
_COMPLETE = 0.9  # a match of this share of the shorter list is not the other hand of the part
_SHIFTS = 15
_QUICK = 200  # spots of both lists up to which the other hand is always tried
_NEARER = 0.5  # its residuals are this much smaller: not the part, but its mirror image
_ENOUGH = 0.4  # support per spot of the shorter list that no further triple has to beat


@dataclass(frozen=True, eq=False)
class Placement:
    """One way to lay the source on the reference.

    Attributes
    ----------
    rotation, translation :
        ``reference = rotation @ source + translation``; (3, 3) and (3,) [mm].
    source_rows, reference_rows : (k,) int arrays
        Pairs, in order of the source.
    lengths : (k,) array
        Distance of each pair [mm].
    support : float
        Sum of ``1 - (distance / limit)^2`` over the pairs: k for a perfect match.
    """

    rotation: Array
    translation: Array
    source_rows: Rows
    reference_rows: Rows
    lengths: Array
    support: float


@dataclass(frozen=True, eq=False)
class GeometryMatch:
    """Pairs by geometry, and what speaks against them.

    Attributes
    ----------
    best : Placement
    runner_up : Placement or None
        The best placement found that pairs at least half of the spots otherwise.
    limit : float
        Largest distance of a pair: 99.9 % of chi with 3 degrees of freedom times the noise, within 3 .. 40 mm.
    doubtful : tuple of int
        Source rows with a second reference spot, or a second source spot, as near as the limit: neighbours that the
        noise may have exchanged.
    background : float
        Support that the winner keeps when it is shifted by one to three limits along the part: what nearness alone is
        worth where spots are dense.
    by_chance : float
        How many placements as good are to be expected of two lists that have nothing in common; see `_by_chance`.
    """

    best: Placement
    runner_up: Placement | None
    limit: float
    doubtful: tuple[int, ...]
    background: float
    by_chance: float

    @property
    def rivalry(self) -> float:
        """Support of the runner-up over that of the winner, both beyond the background; 0 without one."""
        if self.runner_up is None:
            return 0.0
        own = self.best.support - self.background
        return 1.0 if own <= 0.0 else max(self.runner_up.support - self.background, 0.0) / own


def match_by_geometry(
    source: ArrayLike, reference: ArrayLike, *, same_frame: bool = False, seed: int = 0
) -> GeometryMatch:
    """Pair spots by their places alone.

    Parameters
    ----------
    source : (n, 3) array
    reference : (m, 3) array
        Finite [mm]; up to 2,000 spots each.
    same_frame : bool
        Both frames claim to be the same: placements that turn by more than 15 degrees are left out.
    seed : int
        Of the triples that are laid on the reference.

    Raises
    ------
    RegistrationError
        ``NOT_A_NUMBER``; ``TOO_FEW_PAIRS`` for fewer than 4 spots in a list, ``TOO_MANY_SPOTS``; ``NOT_CONGRUENT``
        where no placement pairs half of the shorter list; ``AMBIGUOUS_MATCH`` where another placement is as good, or so
        few spots agree so loosely that chance would do it.
    """
    first, second = np.asarray(source, dtype=np.float64), np.asarray(reference, dtype=np.float64)
    for which, points in (("source", first), ("reference", second)):
        broken = np.flatnonzero(~np.isfinite(points).all(axis=1))
        if len(broken):
            message = f"a coordinate is not a finite number in row {broken[0] + 1} of the {which} list"
            raise RegistrationError("NOT_A_NUMBER", message, rows=tuple(int(row) for row in broken))
    shorter = min(len(first), len(second))
    if shorter < 4:
        raise RegistrationError("TOO_FEW_PAIRS", f"{shorter} spots in a list: geometry needs at least 4 in both")
    if max(len(first), len(second)) > MOST_SPOTS:
        raise RegistrationError(
            "TOO_MANY_SPOTS", f"geometry matches up to {MOST_SPOTS} spots; match by name (--match id)"
        )
    found = _search(first, second, same_frame, np.random.default_rng(seed))
    least = max(4, int(np.ceil(LEAST_SHARE * shorter)))
    if found is None or len(found.best.source_rows) < least:
        count = 0 if found is None else len(found.best.source_rows)
        turned = f" turned by no more than {SAME_FRAME_TURN:g} degrees (both frames claim to be the same)" * same_frame
        raise RegistrationError(
            "NOT_CONGRUENT",
            f"no placement{turned} lays more than {count} of {len(first)} source spots on the {len(second)} reference "
            f"spots; at least {least} are needed: is it the same part, the same side, the same unit?",
        )
    if found.by_chance > MOST_BY_CHANCE:
        raise RegistrationError(
            "AMBIGUOUS_MATCH",
            f"the best placement pairs {len(found.best.source_rows)} of {len(first)} source spots with the "
            f"{len(second)} reference spots ({_rms(found.best):.2f} mm RMS): lists of two different parts would do as "
            "well; match by name (--match id), or add spots",
        )
    if len(found.best.source_rows) < _COMPLETE * shorter or len(first) + len(second) <= _QUICK:
        _refuse_mirrored(first, second, found, seed)
    other = found.runner_up
    if other is not None and found.rivalry >= AS_GOOD:
        raise RegistrationError(
            "AMBIGUOUS_MATCH",
            f"two placements are as good as each other: one pairs {len(found.best.source_rows)} spots "
            f"({_rms(found.best):.2f} mm RMS), the other {len(other.source_rows)} ({_rms(other):.2f} mm RMS), turned "
            f"by {_turn(found.best, other):.1f} degrees and {_apart(first, found.best, other):.0f} mm away: a "
            "symmetric part or a row of equal pitch; match by name (--match id), or add spots that break the symmetry",
        )
    return found


def _refuse_mirrored(source: Array, reference: Array, found: GeometryMatch, seed: int) -> None:
    """The other hand of a part agrees with it in every plane: a match that leaves spots out may be no more than that.

    So may a loose match of a part that is nearly flat; there the mirror image lies on the reference far better.
    """
    mirrored = _search(source * [1.0, -1.0, 1.0], reference, False, np.random.default_rng(seed), _LEAST_TRIPLES)
    if mirrored is None:
        return
    own, other = found.best, mirrored.best
    nearer = len(other.source_rows) >= len(own.source_rows) and _rms(other) < _NEARER * _rms(own)
    if nearer or _COMPLETE * len(other.source_rows) > len(own.source_rows):
        raise RegistrationError(
            "NOT_CONGRUENT",
            f"the mirror image of the source lies on {len(other.source_rows)} reference spots ({_rms(other):.2f} mm "
            f"RMS), the source itself on {len(own.source_rows)} ({_rms(own):.2f} mm): the left part was given for the "
            "right one, or an axis has the wrong sign",
        )


def _rms(placement: Placement) -> float:
    return float(np.sqrt(np.mean(placement.lengths**2)))


def _turn(one: Placement, two: Placement) -> float:
    cosine = (np.trace(one.rotation.T @ two.rotation) - 1.0) / 2.0
    return float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))


def _apart(source: Array, one: Placement, two: Placement) -> float:
    images = [source @ placement.rotation.T + placement.translation for placement in (one, two)]
    return float(np.mean(np.linalg.norm(images[0] - images[1], axis=1)))


def _search(
    source: Array, reference: Array, same_frame: bool, rng: np.random.Generator, triples: int = _TRIPLES
) -> GeometryMatch | None:
    """Lay triples on the reference until one placement holds most of the spots; then some of its own, for rivals."""
    places = NearestSpots(reference, REACH, roughly=len(source) > _ROUGHLY)
    shorter = min(len(source), len(reference))
    kept: list[Placement] = []
    tried = laid = 0
    for _ in range(triples):
        triple = _wide_triple(source, np.arange(len(source), dtype=np.intp), rng)
        placements, count = _lay(source, places, triple, same_frame)
        kept = _best(kept + placements)
        tried, laid = tried + 1, laid + count
        if tried >= _LEAST_TRIPLES and kept and kept[0].support >= _ENOUGH * shorter:
            break
    if not kept:
        return None
    for _ in range(_LEAST_TRIPLES // 2):
        if len(kept[0].source_rows) >= 3:
            triple = _wide_triple(source, kept[0].source_rows, rng)
            kept = _best(kept + _lay(source, places, triple, same_frame)[0])
    return _decide(source, reference, kept, laid / tried, rng)


def _wide_triple(source: Array, rows: Rows, rng: np.random.Generator) -> Rows:
    """Of some random triples the one of the largest triangle."""
    draws = np.argsort(rng.random((12, len(rows))), axis=1)[:, :3]
    triples = rows[draws]
    sides = source[triples[:, 1:]] - source[triples[:, :1]]
    areas = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    return np.asarray(triples[int(np.argmax(areas))], dtype=np.intp)


def _lay(source: Array, places: NearestSpots, triple: Rows, same_frame: bool) -> tuple[list[Placement], int]:
    """Lay one triple of the source on triples of the reference: the best placements, and how many there were."""
    candidates = _triples_like(places.between, distances_between(source[triple]))
    if not len(candidates):
        return [], 0
    rotations, translations = transforms_of_triples(
        np.broadcast_to(source[triple], (len(candidates), 3, 3)), places.spots[candidates]
    )
    if same_frame:
        upright = np.trace(rotations, axis1=1, axis2=2) >= 1.0 + 2.0 * np.cos(np.radians(SAME_FRAME_TURN))
        rotations, translations = rotations[upright], translations[upright]
        if not len(rotations):
            return [], 0
    count = len(rotations)
    if count > _LOOKED_AT:
        look = source[np.linspace(0, len(source) - 1, min(_FIRST_LOOK, len(source))).astype(int)]
        first = np.argsort(-_support(look, rotations, translations, places), kind="stable")[:_LOOKED_AT]
        rotations, translations = rotations[first], translations[first]
    full = _support(source, rotations, translations, places)
    placements: list[Placement] = []
    for row in np.argsort(-full, kind="stable")[: 3 * _SETTLED]:
        placement = _near(source, places, rotations[row], translations[row])
        if all(_different(placement, other) for other in placements):
            placements.append(_approach(source, places, placement))
    return placements, count


def _triples_like(between: Array, sides: Array) -> Rows:
    """Triples of the reference with the sides of one triangle (3, 3), the most alike if there are very many; (t, 3)."""
    second, third = np.abs(between - sides[0, 2]) <= _SIDE, np.abs(between - sides[1, 2]) <= _SIDE
    i, j = np.nonzero(np.abs(between - sides[0, 1]) <= _SIDE)
    i, j = i[i != j], j[i != j]
    misfits, found = [], []
    for start in range(0, len(i), 2000):
        one, two = i[start : start + 2000], j[start : start + 2000]
        row, k = np.nonzero(second[one] & third[two])
        one, two = one[row], two[row]
        apart = (k != one) & (k != two)
        k, one, two = k[apart], one[apart], two[apart]
        found.append(np.stack([one, two, k], axis=1))
        misses = between[one, two] - sides[0, 1], between[one, k] - sides[0, 2], between[two, k] - sides[1, 2]
        misfits.append(misses[0] ** 2 + misses[1] ** 2 + misses[2] ** 2)
    if not found:
        return np.empty((0, 3), dtype=np.intp)
    order = np.argsort(np.concatenate(misfits), kind="stable")[:_MOST_CANDIDATES]
    return np.asarray(np.concatenate(found)[order], dtype=np.intp)


def _support(points: Array, rotations: Array, translations: Array, places: NearestSpots) -> Array:
    """Support of placements (b,), each spot by its nearest reference spot within `REACH`."""
    images = points @ np.swapaxes(rotations, 1, 2) + translations[:, None]
    lengths = places.rough_lengths(images.reshape(-1, 3)).reshape(images.shape[:2])
    support: Array = np.clip(1.0 - (lengths / REACH) ** 2, 0.0, None).sum(axis=1)
    return support


def _near(source: Array, places: NearestSpots, rotation: Array, translation: Array) -> Placement:
    """Pair every spot with its nearest reference spot within `REACH`, each reference spot once."""
    lengths, columns = places.of(source @ rotation.T + translation)
    rows = np.flatnonzero(np.isfinite(lengths))
    rows = rows[np.argsort(lengths[rows], kind="stable")]
    _, first = np.unique(columns[rows], return_index=True)
    rows = np.sort(rows[first])
    support = float(np.sum(1.0 - (lengths[rows] / REACH) ** 2))
    return Placement(rotation, translation, rows, columns[rows], lengths[rows], support)


def _approach(source: Array, places: NearestSpots, placement: Placement) -> Placement:
    """A few steps of least squares over the nearest spots: quick, and near enough to be compared."""
    for _ in range(5):
        if len(placement.source_rows) < 3:
            break
        moved = transform_of(source[placement.source_rows], places.spots[placement.reference_rows])
        after = _near(source, places, *moved)
        if after.support <= placement.support:
            break
        placement = after
    return placement


def _settle(source: Array, reference: Array, rotation: Array, translation: Array, limit: float) -> Placement:
    """Least squares and one-to-one assignment in turn, until the pairs stay."""
    placement = _pair(source, reference, rotation, translation, limit)
    for _ in range(10):
        if len(placement.source_rows) < 3:
            break
        rotation, translation = transform_of(source[placement.source_rows], reference[placement.reference_rows])
        after = _pair(source, reference, rotation, translation, limit)
        same = np.array_equal(after.source_rows, placement.source_rows) and np.array_equal(
            after.reference_rows, placement.reference_rows
        )
        placement = after
        if same:
            break
    return placement


def _pair(source: Array, reference: Array, rotation: Array, translation: Array, limit: float) -> Placement:
    images = source @ rotation.T + translation
    squares = cdist(images, reference, "sqeuclidean")
    near = squares <= limit**2
    rows, columns = np.flatnonzero(near.any(axis=1)), np.flatnonzero(near.any(axis=0))
    cost = np.minimum(squares[np.ix_(rows, columns)], limit**2)
    i, j = linear_sum_assignment(cost)
    kept = cost[i, j] < limit**2
    lengths = np.sqrt(cost[i, j][kept])
    return Placement(
        rotation,
        translation,
        np.asarray(rows[i[kept]], dtype=np.intp),
        np.asarray(columns[j[kept]], dtype=np.intp),
        lengths,
        float(np.sum(1.0 - (lengths / limit) ** 2)),
    )


def _best(placements: list[Placement]) -> list[Placement]:
    """The best placements that differ from each other, best first."""
    kept: list[Placement] = []
    for placement in sorted(placements, key=lambda item: -item.support):
        if all(_different(placement, other) for other in kept):
            kept.append(placement)
        if len(kept) == _SETTLED:
            break
    return kept


def _different(one: Placement, two: Placement) -> bool:
    """Less than half of the pairs of either are pairs of both."""
    partner = np.full(1 + max(one.source_rows.max(initial=0), two.source_rows.max(initial=0)), -1, dtype=np.intp)
    partner[one.source_rows] = one.reference_rows
    shared = int(np.count_nonzero(partner[two.source_rows] == two.reference_rows))
    return 2 * shared < max(len(one.source_rows), len(two.source_rows))


def _decide(
    source: Array, reference: Array, kept: list[Placement], candidates: float, rng: np.random.Generator
) -> GeometryMatch:
    """Find the limit from the winner's own noise, settle all with it, and compare."""
    limit = REACH
    winner = kept[0]
    for _ in range(3):
        if len(winner.lengths) < 4:
            break
        limit = float(np.clip(INLIER_CHI * robust_scale(winner.lengths), LEAST_REACH, REACH))
        winner = _settle(source, reference, winner.rotation, winner.translation, limit)
    settled = [_settle(source, reference, other.rotation, other.translation, limit) for other in kept[1:]]
    ranked = sorted([winner, *settled], key=lambda item: -item.support)
    best = ranked[0]
    runner_up = next((other for other in ranked[1:] if _different(other, best)), None)
    by_chance = _by_chance(len(source), len(best.source_rows), candidates, _hit_rate(reference, limit, rng))
    background = _background(source, reference, best, limit, rng)
    return GeometryMatch(best, runner_up, limit, _doubtful(source, reference, best, limit), background, by_chance)


def _background(source: Array, reference: Array, best: Placement, limit: float, rng: np.random.Generator) -> float:
    """Median support of the winner shifted along the part, its pairs made anew."""
    supports = []
    for _ in range(_SHIFTS):
        one, two = reference[rng.choice(len(reference), 2, replace=False)]
        along = (two - one) / max(float(np.linalg.norm(two - one)), 1e-9)
        shift = along * limit * rng.uniform(1.0, 3.0)
        supports.append(_pair(source, reference, best.rotation, best.translation + shift, limit).support)
    return float(np.median(supports))


def _by_chance(n: int, matched: int, candidates: float, hit_rate: float) -> float:
    """Expected number of placements that pair so many spots by chance.

    Every one of the ``C(n, 3)`` triples has ``candidates`` placements, and each pairs ``matched - 3`` given spots of
    the other ``n - 3`` with probability ``hit_rate ** (matched - 3)``.
    """
    if matched < 4:
        return float("inf")
    logarithm = (
        math.log(math.comb(n, 3) * max(candidates, 1.0))
        + math.log(math.comb(n - 3, matched - 3))
        + (matched - 3) * math.log(max(hit_rate, 1e-12))
    )
    return math.exp(min(logarithm, 700.0))


def _hit_rate(reference: Array, limit: float, rng: np.random.Generator) -> float:
    """Chance that a place on the part, but none of its spots, lies within the limit of one.

    Places are drawn between two spots at random, so that a panel counts by its area and a flange by its length.
    """
    one, two = rng.integers(0, len(reference), (2, 2000))
    places = reference[one] + rng.random((2000, 1)) * (reference[two] - reference[one])
    squares = cdist(places, reference, "sqeuclidean")
    squares[np.arange(2000), one] = np.inf
    squares[np.arange(2000), two] = np.inf
    return float(np.mean(squares.min(axis=1) <= limit**2))


def _doubtful(source: Array, reference: Array, best: Placement, limit: float) -> tuple[int, ...]:
    images = source @ best.rotation.T + best.translation
    near = cdist(images, reference, "sqeuclidean") <= limit**2
    crowded = (near.sum(axis=1)[best.source_rows] > 1) | (near.sum(axis=0)[best.reference_rows] > 1)
    return tuple(int(row) for row in best.source_rows[crowded])
