"""What tables say of spots, for every place of a program: approaches take it from the spot that they lead to."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from respot.calibration.covariates import Covariate
from respot.correction.goals import Goal
from respot.program.robot import Routine

Rows = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class SpotColumns:
    """Columns of spots.

    Parameters
    ----------
    ids : sequence of m str
        Names of the spots.
    columns : mapping of str to Covariate
        Of m rows each.
    """

    ids: Sequence[str] = ()
    columns: Mapping[str, Covariate] = field(default_factory=dict)

    def of(self, rows: Rows) -> dict[str, Covariate]:
        """Columns of n places; a row of -1 is not known: NaN, and no label."""
        return {name: _taken(column, rows) for name, column in self.columns.items() if column.role != "approach"}

    def rows_of(self, names: Iterable[str]) -> Rows:
        """Row (n,) of each spot, -1 where the columns do not tell of it."""
        known = {name.casefold(): row for row, name in enumerate(self.ids)}
        return np.array([known.get(name.casefold(), -1) for name in names], dtype=np.intp)


def _taken(column: Covariate, rows: Rows) -> Covariate:
    values = None if column.values is None else np.where(rows >= 0, column.values[rows], np.nan)
    labels = None if column.labels is None else tuple(column.labels[row] if row >= 0 else "" for row in rows)
    return Covariate(column.name, column.role, values, labels)


def spots_ahead(routines: Sequence[Routine], spots: Mapping[int, str]) -> dict[int, str]:
    """ID of the spot that each motion leads to in its routine, by `id`; behind the last spot that of the last.

    Parameters
    ----------
    routines : sequence of Routine
    spots : mapping of int to str
        ID of the spot by `id` of the target.
    """
    found: dict[int, str] = {}
    for routine in routines:
        moves = list(routine.moves)
        names = [spots.get(id(move.target), "") for move in moves]
        own = np.flatnonzero(names)
        if len(own):
            ahead = np.searchsorted(own, np.arange(len(moves)))
            found |= {id(move): names[own[min(place, len(own) - 1)]] for move, place in zip(moves, ahead, strict=True)}
    return found


def names_at(goals: Sequence[Goal], ahead: Mapping[int, str]) -> list[str]:
    """ID of the spot that each goal is, or leads to."""
    return [goal.spot or ahead.get(id(goal.move), "") for goal in goals]
