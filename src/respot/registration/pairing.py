"""Which spot of one list is which of the other: by name, by place, and never against what distances say."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from respot.registration.congruence import Congruence, congruence, shifted_rows, unit_factor
from respot.registration.errors import RegistrationError
from respot.registration.geometry_matching import GeometryMatch, match_by_geometry
from respot.registration.matching import EXACT, PLACE, SPELLING, IdMatch, Matching, match_by_name, match_of_places

Array = NDArray[np.float64]

_LISTED = 5
_LEAST = 4


@dataclass(frozen=True)
class Note:
    """Something that a person should know about the pairs: the code of an issue, and what happened."""

    code: str
    message: str


@dataclass(frozen=True, eq=False)
class Pairing:
    """Pairs and their evidence.

    Attributes
    ----------
    match : IdMatch
    geometry : GeometryMatch or None
        Where places made the pairs.
    notes : tuple of Note
    """

    match: IdMatch
    geometry: GeometryMatch | None
    notes: tuple[Note, ...]


def pair_spots(
    source_ids: Sequence[str],
    source: Array,
    reference_ids: Sequence[str],
    reference: Array,
    *,
    way: Matching = "auto",
    same_frame: bool = False,
    seed: int = 0,
) -> Pairing:
    """Pair two lists of spots.

    Parameters
    ----------
    source_ids, source : n names and (n, 3) array
        Finite [mm].
    reference_ids, reference : m names and (m, 3) array
        Finite [mm].
    way : "auto", "id" or "geometry"
        By name; by place; "auto": by name, and by place where fewer than 4 names agree.
    same_frame : bool
        Both frames claim to be the same: see `match_by_geometry`.
    seed : int

    Raises
    ------
    RegistrationError
        ``DUPLICATE_ID`` for a name that occurs twice in a list; ``NO_COMMON_IDS`` where no name is in both (and places
        do not help); ``UNIT_MISMATCH``, ``ROWS_SHIFTED``, ``NOT_CONGRUENT`` where the pairs by name cannot be the same
        body (a note for "id" between two frames that nobody claims to be the same); as `match_by_geometry`.
    """
    by_name = match_by_name(source_ids, reference_ids)
    for which, names in (("source", by_name.source_duplicates), ("reference", by_name.reference_duplicates)):
        if names:
            message = f"named more than once in the {which} list: {_shown(names)}"
            raise RegistrationError("DUPLICATE_ID", message, ids=names)
    if way == "geometry":
        return _by_place(source_ids, source, reference_ids, reference, by_name, same_frame, seed)
    if way == "auto" and len(by_name.ids) < _LEAST <= min(len(source_ids), len(reference_ids)):
        try:
            pairing = _by_place(source_ids, source, reference_ids, reference, by_name, same_frame, seed)
        except RegistrationError as error:
            if error.code in ("UNIT_MISMATCH", "NOT_A_NUMBER"):
                raise
            if not by_name.ids:
                raise RegistrationError(
                    "NO_COMMON_IDS", f"{_nothing_common(by_name)}; nor do places: {error}"
                ) from error
        else:
            if any(note.code == "NAMES_DISAGREE" for note in pairing.notes):
                raise RegistrationError(
                    "AMBIGUOUS_MATCH",
                    f"only {len(by_name.ids)} names are common, and places contradict them "
                    f"({pairing.notes[-1].message}): say --match id or --match geometry",
                )
            return pairing
    if not by_name.ids:
        raise RegistrationError("NO_COMMON_IDS", _nothing_common(by_name))
    insisted = way == "id" and not same_frame
    doubts = _require_same_body(by_name, source, reference, same_frame, seed, insisted)
    return Pairing(by_name, None, (*_rule_notes(by_name), *doubts))


def _nothing_common(match: IdMatch) -> str:
    return f"none of the {match.n_source} source spots has the name of one of the {match.n_reference} reference spots"


def _shown(names: Sequence[str]) -> str:
    return ", ".join(names[:_LISTED]) + (f" and {len(names) - _LISTED} more" if len(names) > _LISTED else "")


def _rule_notes(match: IdMatch) -> tuple[Note, ...]:
    """What was not an equal name, a note for each rule; a spelling is said as well, more quietly."""
    notes = []
    for rule in dict.fromkeys(match.rules):
        if rule in (EXACT, PLACE):
            continue
        pairs = [
            f"{own} = {other}"
            for own, other, why in zip(match.ids, match.reference_ids, match.rules, strict=True)
            if why == rule
        ]
        code = "NAMES_SPELLED" if rule == SPELLING else "NAMES_BY_RULE"
        notes.append(Note(code, f"{len(pairs)} names are taken for the same but for {rule}: {_shown(pairs)}"))
    return tuple(notes)


def _by_place(
    source_ids: Sequence[str],
    source: Array,
    reference_ids: Sequence[str],
    reference: Array,
    by_name: IdMatch,
    same_frame: bool,
    seed: int,
) -> Pairing:
    try:
        found = match_by_geometry(source, reference, same_frame=same_frame, seed=seed)
    except RegistrationError as error:
        if error.code == "NOT_CONGRUENT":
            _say_unit_of_places(source, reference, same_frame, seed, error)
        raise
    best = found.best
    match = match_of_places(source_ids, reference_ids, best.source_rows, best.reference_rows)
    other = found.runner_up
    rival = (
        "no other placement pairs other spots"
        if other is None
        else f"the runner-up pairs {len(other.source_rows)}, with {found.rivalry:.0%} of the support"
    )
    root = float(np.sqrt(np.mean(best.lengths**2)))
    notes = [
        Note(
            "MATCHED_BY_GEOMETRY",
            f"{len(match.ids)} of {match.n_source} source spots are paired with {match.n_reference} reference spots by "
            f"their places, not by name ({root:.2f} mm RMS, none beyond {found.limit:.2f} mm; {rival})",
        )
    ]
    if found.doubtful:
        names = _shown([source_ids[row] for row in found.doubtful])
        message = f"{names}: a neighbour is nearer than {found.limit:.2f} mm, the noise may have exchanged them"
        notes.append(Note("DOUBTFUL_PAIR", message))
    named = dict(zip(by_name.ids, by_name.reference_ids, strict=True))
    apart = [
        f"{own} lies at the place of {place}"
        for own, place in zip(match.ids, match.reference_ids, strict=True)
        if named.get(own, place) != place
    ]
    if apart:
        message = f"{_shown(apart)}: these names are in both lists and stand for different places"
        notes.append(Note("NAMES_DISAGREE", message))
    return Pairing(match, found, tuple(notes))


def _say_unit_of_places(source: Array, reference: Array, same_frame: bool, seed: int, error: RegistrationError) -> None:
    """A list in another unit has no placement; with the unit set right it has one.

    Raises
    ------
    RegistrationError
        ``UNIT_MISMATCH``
    """
    extents = [
        float(np.sqrt(np.mean(np.sum((points - points.mean(axis=0)) ** 2, axis=1)))) for points in (source, reference)
    ]
    if min(extents) <= 0.0:
        return
    for factor, unit in ((25.4, "inches"), (1000.0, "metres"), (10.0, "centimetres")):
        for scale in (factor, 1.0 / factor):
            if abs(np.log(extents[1] / extents[0] / scale)) > 0.5:
                continue
            try:
                match_by_geometry(source, reference / scale, same_frame=same_frame, seed=seed)
            except RegistrationError:
                continue
            raise RegistrationError("UNIT_MISMATCH", _unit_message(scale, unit)) from error


def _unit_message(factor: float, unit: str) -> str:
    return (
        f"distances between spots are {factor:.6g} times as long in the reference as in the source: one of the two "
        f"lists is in {unit}; everything must be in mm"
    )


def _require_same_body(
    match: IdMatch, source: Array, reference: Array, same_frame: bool, seed: int, insisted: bool
) -> tuple[Note, ...]:
    """Refuse pairs whose distances say that names, rows, units or the whole list are wrong.

    A person who insists on the names is told instead: poses programmed with the wrong tool, or with none, are no rigid
    image of the places that were measured, and their names may well be right.

    Raises
    ------
    RegistrationError
        ``UNIT_MISMATCH``, ``ROWS_SHIFTED`` or ``NOT_CONGRUENT``.
    """
    first, second = source[match.source_rows], reference[match.reference_rows]
    if len(first) < 3 or not (np.isfinite(first).all() and np.isfinite(second).all()):
        return ()
    unit = unit_factor(first, second)
    if unit is not None:
        raise RegistrationError("UNIT_MISMATCH", _unit_message(*unit))
    found = congruence(first, second)
    for which, rows in (("reference", match.reference_rows), ("source", match.source_rows)):
        order = np.argsort(rows, kind="stable")
        shifted = shifted_rows(first[order], second[order], seed=seed)
        if shifted is not None:
            shift, agreed = shifted
            raise RegistrationError(
                "ROWS_SHIFTED",
                f"the names of the {which} list seem to have slipped by {abs(shift)} row{'s' * (abs(shift) > 1)} "
                f"against its coordinates: as named {int(found.group.sum())} of {len(found.group)} spots keep their "
                f"distances, moved back {int(agreed.group.sum())} do; correct the list",
            )
    if found.same_body:
        return ()
    message = _disagreement(match, source, reference, found, same_frame, seed)
    if insisted:
        return (Note("NOT_CONGRUENT", message),)
    raise RegistrationError("NOT_CONGRUENT", message)


def _disagreement(
    match: IdMatch, source: Array, reference: Array, found: Congruence, same_frame: bool, seed: int
) -> str:
    cases = []
    for row in found.suspects[:_LISTED]:
        other, own, theirs = found.widest(row)
        cases.append(
            f"{match.ids[row]} is {own:.0f} mm from {match.ids[other]} in the source, {theirs:.0f} mm in the reference"
        )
    text = (
        f"the two lists cannot be the same body under these names: only {int(found.group.sum())} of {len(found.group)} "
        f"spots keep their distances within {found.tolerance:.0f} mm; {'; '.join(cases)}"
    )
    try:
        places = match_by_geometry(source, reference, same_frame=same_frame, seed=seed)
    except RegistrationError:
        insist = "" if same_frame else " If the names are right and the tool is wrong or missing, say --match id"
        return f"{text}; nor do the places agree without names: another robot's list, or another part?{insist}"
    return (
        f"{text}; without names {len(places.best.source_rows)} places agree: the names are mixed up. Correct them, "
        "or use --match geometry"
    )
