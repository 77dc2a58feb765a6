"""Effect ``swapped_ids``: spots carry each other's names. Coordinates are never exchanged."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from respot.calibration.effects.effect import Effect, Remedy, Rival
from respot.calibration.effects.naming import NamingEvidence, naming_evidence
from respot.registration.exchanged import Exchange, ExchangeResult

Array = NDArray[np.float64]

NAME = "swapped_ids"
_LISTS = {
    ("source", "theory"): "the robot programs",
    ("source", "measured"): "the robot programs",
    ("reference", "theory"): "the theoretical list",
    ("reference", "measured"): "the measured list",
}


def effects_of(found: ExchangeResult, ids: Sequence[str], reference: Array, *, kind: str) -> tuple[Effect, ...]:
    """One effect for every accepted cycle of names.

    Parameters
    ----------
    found : ExchangeResult
    ids : sequence of n str
        Names of the pairs as given.
    reference : (n, 3) array
        Reference spots as named [mm].
    kind : str
        ``"theory"`` or ``"measured"``.
    """
    return tuple(_effect(cycle, naming_evidence(cycle.rows, ids, reference), kind) for cycle in found.cycles)


def _effect(cycle: Exchange, naming: NamingEvidence, kind: str) -> Effect:
    return Effect(
        name=NAME,
        where={"ids": list(cycle.ids)},
        named=True,
        remedy=Remedy("spot_list", remedy_text(cycle.ids, naming, kind)),
        heldout_gain=cycle.loo_before - cycle.loo_after,
        p_value=cycle.p_value,
        rivals=(Rival("names right, spots displaced", cycle.members_before),),
        evidence={
            "loo_before": cycle.loo_before,
            "loo_after": cycle.loo_after,
            "members_heldout_before": cycle.members_before,
            "members_heldout_after": cycle.members_after,
            "worst_before": cycle.worst_before,
            "worst_after": cycle.worst_after,
            "threshold": cycle.threshold,
            "wrong_list": naming.wrong_list,
            "wrong_list_reason": naming.reason,
        },
    )


def remedy_text(ids: Sequence[str], naming: NamingEvidence, kind: str) -> str:
    """Say what a person should do about it, in full sentences."""
    if len(ids) == 2:
        what = f"Spots {ids[0]} and {ids[1]} carry each other's names in one of the two lists."
    else:
        what = f"Spots {' -> '.join([*ids, ids[0]])} carry each other's names, passed round, in one of the two lists."
    if naming.wrong_list == "either":
        because = f" ({naming.reason})" if naming.reason else ""
        which = f"Coordinates alone cannot tell which list is wrong{because}: look at the part, or at the drawing."
    else:
        suspect = _LISTS[naming.wrong_list, kind]
        which = f"The names point to {suspect} as the wrong list (evidence, not proof): {naming.reason}."
    return (
        f"{what} {which} Correct the names there. No coordinates are exchanged: each point stays the place "
        "where the robot welds. Check the weld schedules of these spots: they may have travelled with the names."
    )
