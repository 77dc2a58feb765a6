"""Spots that are kept out of a fit from the start, and how well it predicts them.

What cross-validation promises is still told by the spots that everything was chosen by. Spots that took no part in
names, choosing or fitting are a witness from outside: so many of the pairs, drawn at random and spread over the part,
or those of a table, which may never have been in the reference.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from respot.calibration.calibration import Calibration
from respot.calibration.effects.moved import missing
from respot.calibration.effects.readings import reread
from respot.calibration.observations import Observations
from respot.calibration.source_observations import SourceObservations
from respot.issues import BadInputError, Issue
from respot.registration.exchanged import find_exchanged
from respot.registration.matching import match_by_name
from respot.registration.row_order import own_order
from respot.registration.statistics import distances
from respot.spots import Source, spots_of_table
from respot.tables import Table

if TYPE_CHECKING:
    from respot.calibration.spot_fit import SpotFit

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

LARGEST_FRACTION = 0.5
_LEAST_LEFT = 4
_MOST_LISTED = 20


@dataclass(frozen=True, eq=False)
class HeldOutSpots:
    """Errors of k spots that took no part, predicted minus reference [mm].

    Attributes
    ----------
    ids, reference_ids : tuples of k str
        Names in the source; names in the reference that they are judged under.
    before : (k, 3) array
        Under the rigid least-squares fit of the other spots, names as given.
    after : (k, 3) array
        Under the final model of the others, names repaired.
    repaired : (k,) bool array
        Judged under another name than its own: it and another spot carry each other's.
    exchanged : tuple of tuples of str
        Names that are exchanged, with a spot of these among them.
    """

    ids: tuple[str, ...]
    reference_ids: tuple[str, ...]
    before: Array
    after: Array
    repaired: NDArray[np.bool_]
    exchanged: tuple[tuple[str, ...], ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON object ``heldout`` of a fit."""
        rows = zip(self.ids, self.reference_ids, self.before, self.after, self.repaired, strict=True)
        return {
            "scheme": f"held out: {len(self.ids)} spots",
            "n": len(self.ids),
            "before": distances(self.before).to_dict(),
            "after": distances(self.after).to_dict(),
            "repaired_ids": [name for name, changed in zip(self.ids, self.repaired, strict=True) if changed],
            "spots": [
                {
                    "id": name,
                    "reference_id": other,
                    "before": float(np.linalg.norm(before)),
                    "after": float(np.linalg.norm(after)),
                    **dict(zip(("dx", "dy", "dz"), after.tolist(), strict=True)),
                    "repaired": bool(repaired),
                }
                for name, other, before, after, repaired in rows
            ],
        }


@dataclass(frozen=True, eq=False)
class Split:
    """Which spots of two lists take part, and which k are held out.

    Attributes
    ----------
    source_rows, reference_rows : int arrays
        Rows that take part.
    held_source, held_reference : (k,) int arrays
        Rows of the spots held out; -1 where the reference does not have it.
    names : tuple of k str
        Their names in the reference, or in the table.
    positions : (k, 3) array
        What they are judged by, reference frame [mm].
    table : Table or None
        Where that stands, if not in the reference.
    held_table : (k,) int array
        Rows of it.
    unknown : tuple of str
        Names of the table that the source lacks.
    """

    source_rows: Rows
    reference_rows: Rows
    held_source: Rows
    held_reference: Rows
    names: tuple[str, ...]
    positions: Array
    table: Table | None = None
    held_table: Rows | None = None
    unknown: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.held_source)


def split_off(source: Source, reference: Source, wanted: float | Table | None, *, seed: int, by_name: bool) -> Split:
    """Divide two lists into spots that take part and spots that are held out.

    Parameters
    ----------
    source, reference : Source
    wanted : float, Table or None
        Share of the pairs, above 0 and up to a half; or a table that names them; None holds out nothing.
    seed : int
        Of the draw.
    by_name : bool
        Whether names may make the pairs. A spot that is paired by its place has no other judge than its place.

    Raises
    ------
    BadInputError
        ``BAD_OPTION``, ``NO_COMMON_IDS`` or ``TOO_FEW_PAIRS``.
    """
    if wanted is None:
        none = np.zeros(0, dtype=np.intp)
        return Split(*_rest(source, reference, none, none), none, none, (), np.zeros((0, 3)))
    if not isinstance(wanted, Table) and not 0.0 < wanted <= LARGEST_FRACTION:
        message = f"a share of spots to hold out is above 0 and up to {LARGEST_FRACTION:g}, not {wanted:g}"
        raise BadInputError("BAD_OPTION", message)
    if not by_name:
        message = (
            "spots that are paired by their places cannot be held out: the nearest spot would be their partner, "
            "and its distance no error; pair by name (--match id)"
        )
        raise BadInputError("BAD_OPTION", message)
    match = match_by_name(source.spots.ids, reference.spots.ids)
    partner = dict(zip(match.source_rows.tolist(), match.reference_rows.tolist(), strict=True))
    if isinstance(wanted, Table):
        return _by_table(source, reference, partner, wanted)
    count = max(1, int(wanted * len(partner) + 0.5))
    _require_rest(len(partner), count, str(reference.path))
    rows = np.array(sorted(partner), dtype=np.intp)
    others = np.array([partner[row] for row in rows.tolist()], dtype=np.intp)
    drawn = spread_sample(source.spots.positions[rows], count, seed)
    held, other = rows[drawn], others[drawn]
    names = tuple(reference.spots.ids[row] for row in other)
    return Split(*_rest(source, reference, held, other), held, other, names, reference.spots.positions[other])


def spread_sample(points: Array, count: int, seed: int) -> Rows:
    """Rows (count,) of points drawn at random, one from each of as many parts of space of about as many points.

    Parts are made by halving along the widest direction. The order of the points plays no part.

    Parameters
    ----------
    points : (n, 3) array
        [mm]
    count : int
        Up to n.
    seed : int
    """
    order = own_order(points, points)
    rng = np.random.default_rng(seed)
    return np.array([cell[rng.integers(len(cell))] for cell in _cells(points, order, count)], dtype=np.intp)


def _cells(points: Array, rows: Rows, count: int) -> list[Rows]:
    if count == 1:
        return [rows]
    centred = points[rows] - points[rows].mean(axis=0)
    along = centred @ np.linalg.svd(centred, full_matrices=False)[2][0]
    ordered = rows[np.argsort(along, kind="stable")]
    low = count // 2
    cut = round(len(rows) * low / count)
    return [*_cells(points, ordered[:cut], low), *_cells(points, ordered[cut:], count - low)]


def _by_table(source: Source, reference: Source, partner: dict[int, int], table: Table) -> Split:
    """Hold out the spots that a table names; they are judged by its places, or by the reference's if it has none."""
    match = match_by_name(source.spots.ids, table.ids)
    rows, held = match.reference_rows, match.source_rows
    other = np.array([partner.get(row, -1) for row in held.tolist()], dtype=np.intp)
    if table.xyz is None:
        rows, held, other = rows[other >= 0], held[other >= 0], other[other >= 0]
    if not len(held):
        where = "" if table.xyz is not None else " that the reference has, and it has no columns x, y, z"
        raise BadInputError("NO_COMMON_IDS", f"names no spot of the source{where}: nothing to hold out", table.path)
    _require_rest(len(partner), int((other >= 0).sum()), table.path)
    positions = reference.spots.positions[other] if table.xyz is None else table.xyz[rows]
    names = tuple(
        table.ids[row] if there < 0 else reference.spots.ids[there]
        for row, there in zip(rows.tolist(), other.tolist(), strict=True)
    )
    kept = _rest(source, reference, held, other[other >= 0])
    return Split(*kept, held, other, names, positions, table, rows, match.extra)


def _require_rest(pairs: int, held: int, path: str) -> None:
    if pairs - held < _LEAST_LEFT:
        message = (
            f"{held} of {pairs} pairs by name are to be held out, {pairs - held} are left: a fit needs at least "
            f"{_LEAST_LEFT}"
        )
        raise BadInputError("TOO_FEW_PAIRS", message, path)


def _rest(source: Source, reference: Source, held: Rows, other: Rows) -> tuple[Rows, Rows]:
    """Rows of both lists that take part."""
    first, second = (
        np.setdiff1d(np.arange(len(side.spots.ids), dtype=np.intp), out)
        for side, out in ((source, held), (reference, other))
    )
    return first, second


def judged(
    fit: SpotFit, split: Split, source: Source, observations: SourceObservations, *, seed: int, repair: bool
) -> tuple[SpotFit, list[Issue]]:
    """Return a fit, and the fit beside it, with the errors of the spots that were held out of both.

    Parameters
    ----------
    fit : SpotFit
        Of the spots that took part.
    split : Split
    source : Source
    observations : SourceObservations
        What is known of the spots that both lists have.
    seed : int
    repair : bool
        Exchanged names are looked for.
    """
    if not len(split):
        return fit, []
    issues = []
    if split.unknown and split.table is not None:
        more = f" and {len(split.unknown) - _MOST_LISTED} more" if len(split.unknown) > _MOST_LISTED else ""
        message = f"{', '.join(split.unknown[:_MOST_LISTED])}{more}: not in {source.path}, cannot be predicted"
        issues.append(Issue("UNMATCHED_REFERENCE", message, split.table.path))
    beside = fit.beside
    if beside is not None:
        beside = replace(beside, heldout=_judge(beside, split, source, observations, seed, repair)[0])
    found, lacking = _judge(fit, split, source, observations, seed, repair)
    issues += [Issue("EFFECT_LEFT_OUT", text, str(source.path)) for text in lacking]
    for names in (beside.heldout if beside and beside.heldout else found).exchanged:
        message = f"{', '.join(names)} carry each other's names in one of the two lists; spots held out are among them"
        issues.append(Issue("EXCHANGED_NAMES", message))
    return replace(fit, heldout=found, beside=beside), issues


def _judge(
    fit: SpotFit, split: Split, source: Source, observations: SourceObservations, seed: int, repair: bool
) -> tuple[HeldOutSpots, list[str]]:
    points = source.spots.positions[split.held_source]
    predicted, lacking = _predicted(fit, split, source, observations)
    ids = tuple(source.spots.ids[row] for row in split.held_source)
    before = fit.before.predict(points) - split.positions
    plain = HeldOutSpots(ids, split.names, before, predicted - split.positions, np.zeros(len(ids), dtype=np.bool_))
    far = np.linalg.norm(plain.after, axis=1) > fit.robust.threshold
    if fit.method != "robust" or not repair or not far.any():
        return plain, lacking
    return _repaired(plain, fit, predicted, split.positions, seed), lacking


def _predicted(fit: SpotFit, split: Split, source: Source, observations: SourceObservations) -> tuple[Array, list[str]]:
    """Places (k, 3) of the spots held out under the final model, and which effects do not know them."""
    points, rotations = source.spots.positions[split.held_source], source.spots.rotations
    if fit.method == "affine" and fit.affine is not None:
        return points @ fit.affine.matrix[:3, :3].T + fit.affine.matrix[:3, 3], []
    if rotations is not None:
        finding = None if fit.convention is None else fit.convention.finding
        if finding is not None and finding.side == "source" and finding.effect.named:
            rotations = reread(rotations, finding.reading)
        rotations = rotations[split.held_source]
    predicted, lacking = np.empty_like(points), dict[str, list[str]]()
    for rows, seen in _seen(fit.model, split, source, observations):
        own = None if rotations is None else rotations[rows]
        unknown = [] if seen is None else [term for term in fit.model.terms if missing(seen, term)]
        for term in unknown:
            assert seen is not None  # noqa: S101 - something of it is missing
            what = f"{term.label} is left out: {missing(seen, term)} is not known of"
            lacking.setdefault(what, []).extend(source.spots.ids[split.held_source[row]] for row in rows)
        predicted[rows] = fit.model.without(unknown).predict(points[rows], own, seen)[0]
    texts = [f"{what} {', '.join(names[:_MOST_LISTED])}, held out" for what, names in lacking.items()]
    return predicted, texts


def _seen(
    model: Calibration, split: Split, source: Source, observations: SourceObservations
) -> list[tuple[Rows, Observations | None]]:
    """What is known of the spots held out: by the table or by the reference, whichever tells more of what effects need.

    Without effects nothing needs to be known.
    """
    every = np.arange(len(split), dtype=np.intp)
    if not model.terms:
        return [(every, None)]
    told = []
    if split.table is not None and split.held_table is not None and split.table.xyz is not None:
        side = Source(source.path, spots_of_table(split.table), split.table.sha256, table=split.table)
        theirs = SourceObservations(source, side, observations.robot, constant=True)
        told.append((theirs.of(split.held_source, split.held_table), every))
    listed = np.flatnonzero(split.held_reference >= 0)
    if len(listed):
        told.append((observations.of(split.held_source[listed], split.held_reference[listed]), listed))

    def lacks(seen: Observations) -> int:
        return sum(bool(missing(seen, term)) for term in model.terms)

    if len(told[0][1]) == len(every) and not lacks(told[0][0]):
        return [(every, told[0][0])]
    one_by_one: list[tuple[Rows, Observations | None]] = []
    for row in every:
        known = [seen.rows(np.flatnonzero(rows == row)) for seen, rows in told if row in rows]
        one_by_one.append((np.array([row]), min(known, key=lacks)))
    return one_by_one


def _repaired(plain: HeldOutSpots, fit: SpotFit, predicted: Array, positions: Array, seed: int) -> HeldOutSpots:
    """Errors under repaired names: exchanges with a spot held out among them, told as in a fit; the model stays."""
    count = len(fit.ids)
    ids, names = (*fit.ids, *plain.ids), (*fit.reference_ids, *plain.reference_ids)
    places = np.concatenate([fit.reference, positions])
    found = find_exchanged(ids, np.concatenate([fit.calibrated, predicted]), places, seed=seed)
    partner = found.permutation[count:]
    return replace(
        plain,
        reference_ids=tuple(names[row] for row in partner),
        after=predicted - places[partner],
        repaired=partner != np.arange(count, len(ids)),
        exchanged=tuple(cycle.ids for cycle in found.cycles if max(cycle.rows) >= count),
    )
