"""Two lists become pairs: by name or place, and by name where only a wrong tool keeps them from being one body."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from respot.calibration.calibration import Frame, Kind
from respot.calibration.causes import Observe, Written, names_of
from respot.calibration.effects import tool_offset
from respot.calibration.effects.search import Effects
from respot.calibration.effects.tool_fit import moved_by
from respot.calibration.effects.tool_robust import fit_tool_robust
from respot.calibration.observations import Observations
from respot.calibration.spot_fit import Method, Orientations, Weights
from respot.registration.congruence import congruence
from respot.registration.errors import RegistrationError
from respot.registration.matching import IdMatch, Matching, match_by_name
from respot.registration.pairing import Note, Pairing, pair_spots

Array = NDArray[np.float64]
PairedObserve = Callable[[Sequence[int] | NDArray[np.intp], Sequence[int] | NDArray[np.intp]], Observations]

LEAST_PAIRS = 4
DEFAULT_FRAME: Mapping[Kind, Frame] = {"theory": "same", "measured": "free"}


@dataclass(frozen=True, kw_only=True)
class Asked:
    """What was asked for: the options of `fit_spots`, by the same names."""

    kind: Kind
    frame: Frame | None
    noise: float | None
    noise_source: str
    seed: int
    method: Method
    tau: float | None
    n_min: int | None
    effects: Effects
    provenance: Mapping[str, Any] | None
    written: Written | None
    nested: bool
    progress: Callable[[], None]
    weights: Weights
    orientations: Orientations

    @property
    def same_frame(self) -> bool:
        """Whether both coordinate systems claim to be the same."""
        return (self.frame or DEFAULT_FRAME[self.kind]) == "same"

    @property
    def plain(self) -> bool:
        """Whether the rigid part is least squares of the positions."""
        return self.weights == "even" and self.orientations == "compare"


@dataclass(frozen=True, kw_only=True, eq=False)
class Pairs:
    """Pairs as named: what `fit_spots` is given, by the same names."""

    ids: tuple[str, ...]
    source: Array
    reference: Array
    source_rotations: Rotation | None
    reference_rotations: Rotation | None
    match: IdMatch | None = None
    notes: tuple[Note, ...] = ()
    observe: Observe | None = None


@dataclass(frozen=True, eq=False)
class Listed:
    """One list: n names, (n, 3) positions [mm], n tool orientations."""

    ids: Sequence[str]
    positions: Array
    rotations: Rotation | None

    def rotations_of(self, rows: NDArray[np.intp]) -> Rotation | None:
        """Return the orientations of some rows."""
        return None if self.rotations is None else self.rotations[rows]


def pair_lists(
    own: Listed, other: Listed, asked: Asked, matching: Matching, observe: PairedObserve | None
) -> tuple[Pairs, RegistrationError | None]:
    """Pair two lists.

    Parameters
    ----------
    own, other : Listed
        Source and reference.
    asked : Asked
    matching : "auto", "id" or "geometry"
    observe : callable, optional
        What else is known, by rows of both lists.

    Returns
    -------
    Pairs
    RegistrationError or None
        What distances say, if only a tool offset makes the pairs one body: to be raised unless one is found.

    Raises
    ------
    RegistrationError
        As `respot.registration.pairing.pair_spots`.
    """
    looked_for = names_of(asked.effects)

    def pair(points: Array) -> Pairing:
        same = asked.same_frame
        return pair_spots(own.ids, points, other.ids, other.positions, way=matching, same_frame=same, seed=asked.seed)

    pairing: Pairing | None = None
    doubt: RegistrationError | None = None
    notes: tuple[Note, ...] = ()
    try:
        pairing = pair(own.positions)
        notes = pairing.notes
        doubtful = any(note.code == "NOT_CONGRUENT" for note in notes)
    except RegistrationError as error:
        if error.code != "NOT_CONGRUENT":
            raise
        doubt, doubtful = error, True
    if doubtful and tool_offset.NAME in looked_for and own.rotations is not None and asked.method == "robust":
        moved = _congruent_by_tool(own.ids, own.positions, own.rotations, other.ids, other.positions, asked.seed)
        if moved is not None:
            pairing = pair(moved)
            message = (
                "distances between spots agree with the reference after a constant offset in the tool frame and not "
                "before: the poses are those of another TCP (the flange, or a wrong tool)"
            )
            notes = (*pairing.notes, Note("CONGRUENT_BY_TOOL", message))
    if pairing is None:
        assert doubt is not None  # noqa: S101 - without a pairing there was an error
        raise doubt
    match = pairing.match
    pairs = Pairs(
        ids=match.ids,
        source=own.positions[match.source_rows],
        reference=other.positions[match.reference_rows],
        source_rotations=own.rotations_of(match.source_rows),
        reference_rotations=other.rotations_of(match.reference_rows),
        match=match,
        notes=notes,
        observe=None
        if observe is None
        else lambda permutation: observe(match.source_rows, match.reference_rows[permutation]),
    )
    return pairs, doubt


def _congruent_by_tool(
    source_ids: Sequence[str],
    source: Array,
    rotations: Rotation,
    reference_ids: Sequence[str],
    reference: Array,
    seed: int,
) -> Array | None:
    """Source spots (n, 3) moved by the tool offset under which the pairs by name are one body; None without any."""
    match = match_by_name(source_ids, reference_ids)
    first, second = source[match.source_rows], reference[match.reference_rows]
    tools = rotations.as_matrix()
    if len(first) < LEAST_PAIRS or not (np.isfinite(first).all() and np.isfinite(second).all()):
        return None
    try:
        fit = fit_tool_robust(first, tools[match.source_rows], second, seed=seed)
    except RegistrationError:
        return None
    return moved_by(source, tools, fit.offset) if congruence(fit.moved, second).same_body else None
