"""Which effects the pairs show: exchanged names and a wrong tool are each judged with the other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from respot.calibration.effects import EFFECTS, swapped_ids, tool_offset
from respot.calibration.effects.tool_offset import ToolTrial
from respot.calibration.effects.tool_robust import fit_tool_robust
from respot.registration.errors import RegistrationError
from respot.registration.exchanged import ExchangeResult, find_exchanged
from respot.registration.robust import fit_robust

Array = NDArray[np.float64]
Effects = Literal["auto"] | Sequence[str]

RIGID_ONLY: tuple[str, ...] = (swapped_ids.NAME,)
"""Effects that leave the model a rigid transform: what a library call, and a correction of programs, looks for."""


def effects_of(effects: Effects) -> tuple[str, ...]:
    """Names of the effects to look for.

    Raises
    ------
    RegistrationError
        ``BAD_OPTION`` for a name that no effect has.
    """
    names = tuple(EFFECTS) if effects == "auto" else tuple(effects)
    for name in names:
        if name not in EFFECTS:
            raise RegistrationError("BAD_OPTION", f"there is no effect {name!r}; there are {', '.join(EFFECTS)}")
    return names


def search_effects(
    ids: Sequence[str],
    source: Array,
    reference: Array,
    rotations: Rotation | None,
    effects: Effects,
    *,
    kind: str,
    noise: float | None,
    seed: int,
) -> tuple[ExchangeResult, ToolTrial | None]:
    """Look for effects among paired spots.

    With a wrong tool spots that turn otherwise miss their places and pass for exchanged: names are judged with the
    offset taken out first, and the offset with the names repaired. Where the offset is not accepted, names are judged
    without it.

    Parameters
    ----------
    ids : sequence of n str
    source, reference : (n, 3) arrays
        Pairs as named [mm].
    rotations : Rotation of n, or None
        Tool orientations in the source frame.
    effects : "auto" or names
        One asked for by its name must be determined; "auto" takes what is.
    kind : str
        ``"theory"`` or ``"measured"``.
    noise : float or None
        Standard deviation per coordinate, known independently [mm].
    seed : int

    Returns
    -------
    (ExchangeResult, ToolTrial or None)
        Names; and the tool offset, where it was looked for. Of an accepted offset the first's ``robust`` is of the
        moved spots.

    Raises
    ------
    RegistrationError
        As `effects_of` and `respot.registration.robust.fit_robust`; ``NO_ORIENTATION``, ``TOOL_NOT_DETERMINED`` or
        ``TOO_FEW_PAIRS`` for a tool offset that is asked for and cannot be tried.
    """
    looked_for = effects_of(effects)

    def names_of(points: Array) -> ExchangeResult:
        if swapped_ids.NAME in looked_for:
            return find_exchanged(ids, points, reference, seed=seed)
        return ExchangeResult((), np.arange(len(ids), dtype=np.intp), fit_robust(points, reference, seed=seed))

    if tool_offset.NAME not in looked_for:
        return names_of(source), None
    if rotations is None:
        verdict = "a tool offset needs the orientation of the tool at the spots of the source, and there is none"
        trial = ToolTrial(False, verdict, "NO_ORIENTATION")
    else:
        try:
            rough = fit_tool_robust(source, rotations.as_matrix(), reference, seed=seed)
            exchanged = names_of(rough.moved)
        except RegistrationError as error:
            trial = ToolTrial(False, str(error), error.code)
        else:
            repaired = reference[exchanged.permutation]
            same = np.array_equal(exchanged.permutation, np.arange(len(ids)))
            trial = tool_offset.investigate(
                source, rotations, repaired, kind=kind, noise=noise, seed=seed, fit=rough if same else None
            )
            if trial.accepted:
                return exchanged, trial
    if trial.code is not None and effects != "auto":
        raise RegistrationError(trial.code, trial.verdict)
    return names_of(source), trial
