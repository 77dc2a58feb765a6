"""What the fitted spots tell of a model and of its rivals, as products of columns: what a plan of further spots needs.

The information of a least-squares fit is a sum over its spots (the Fisher information for Gaussian noise), so further
spots add to what is kept here, whatever the fitted ones were: they need not be at hand any more.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from respot.calibration.discovery.evening import evening
from respot.calibration.effects.catalogue import MECHANISMS, columns_of
from respot.calibration.effects.moved import tip_of
from respot.calibration.effects.term import Term
from respot.kinematics.robot_file import robot_from_record, robot_record

if TYPE_CHECKING:
    from respot.calibration.spot_fit import SpotFit

Array = NDArray[np.float64]

RIGID = 6


@dataclass(frozen=True, eq=False)
class RivalColumns:
    """Another explanation of one effect that the fitted spots do not tell clearly from it.

    Attributes
    ----------
    effect : int
        Which of the model's terms it stands against.
    term : Term
    apart : float
        By how much its criterion is larger than the effect's (`respot.calibration.discovery.rivals`).
    cross : (6 + k, m) array
        Products of the model's columns with its own.
    own : (m, m) array
        And of its own with themselves.
    """

    effect: int
    term: Term
    apart: float
    cross: Array
    own: Array


@dataclass(frozen=True, eq=False)
class Information:
    """Products of columns over the fitted spots, in units of the parameters' priors and of the noise.

    Attributes
    ----------
    terms, values : tuples of equal length
        The model's effects, as `respot.calibration.calibration.Calibration` has them.
    centre : (3,) array
        About which the rigid part turns, source frame [mm].
    extent : float
        What its turns are multiplied by [mm].
    even : (3, 3) array
        Turns shifts of the source frame into units of the noise [1/mm].
    gram : (6 + k, 6 + k) array
        Of the rigid part and the model's parameters.
    rivals : tuple of RivalColumns
    noise_known : bool
        Whether the size of the noise is known independently of this fit.
    robot : mapping or None
        Kinematics of the columns, as `respot.kinematics.robot_file.robot_record`.

    Raises
    ------
    ValueError
        Shapes that do not belong together, or numbers that are not finite.
    """

    terms: tuple[Term, ...]
    values: tuple[Array, ...]
    centre: Array
    extent: float
    even: Array
    gram: Array
    rivals: tuple[RivalColumns, ...]
    noise_known: bool
    robot: Mapping[str, Any] | None

    def __post_init__(self) -> None:
        sizes = [len(term.parameters) for term in self.terms]
        width = RIGID + sum(sizes)
        fit = [np.shape(value) for value in self.values] == [(size,) for size in sizes]
        fit &= np.shape(self.centre) == (3,) and np.shape(self.even) == (3, 3)
        fit &= np.shape(self.gram) == (width, width)
        for rival in self.rivals:
            size = len(rival.term.parameters)
            fit &= rival.effect in range(len(self.terms)) and rival.cross.shape == (width, size)
            fit &= rival.own.shape == (size, size)
        if not fit:
            raise ValueError("what is kept of the rivals does not belong together")
        numbers = (*self.values, self.centre, self.even, self.gram, *(each.cross for each in self.rivals))
        if not all(np.isfinite(each).all() for each in numbers) or not 0.0 < self.extent < np.inf:
            raise ValueError("a number of what is kept of the rivals is not finite")
        known = all(term.effect in MECHANISMS for term in (*self.terms, *(each.term for each in self.rivals)))
        if not known:
            raise ValueError("what is kept of the rivals names an effect that does not exist")
        if self.robot is not None:
            robot_from_record(self.robot)

    @property
    def slices(self) -> tuple[slice, ...]:
        """Columns of each term."""
        stops = np.cumsum([RIGID, *(len(term.parameters) for term in self.terms)]).tolist()
        return tuple(slice(start, stop) for start, stop in pairwise(stops))

    def to_dict(self) -> dict[str, Any]:
        """JSON values."""
        pairs = zip(self.terms, self.values, strict=True)
        return {
            "effects": [{**term.to_dict(), "values": value.tolist()} for term, value in pairs],
            "centre": self.centre.tolist(),
            "extent": self.extent,
            "even": self.even.tolist(),
            "gram": self.gram.tolist(),
            "rivals": [
                {
                    "effect": rival.effect,
                    "term": rival.term.to_dict(),
                    "apart": rival.apart,
                    "cross": rival.cross.tolist(),
                    "own": rival.own.tolist(),
                }
                for rival in self.rivals
            ],
            "noise_known": self.noise_known,
            "robot": None if self.robot is None else dict(self.robot),
        }

    @classmethod
    def from_dict(cls, record: Mapping[str, Any]) -> Information:
        """Read what `to_dict` made.

        Raises
        ------
        KeyError, TypeError, ValueError
            Entries that are missing or wrong.
        """
        rivals = tuple(
            RivalColumns(
                int(each["effect"]),
                Term.from_dict(each["term"]),
                float(each["apart"]),
                np.array(each["cross"], dtype=np.float64),
                np.array(each["own"], dtype=np.float64),
            )
            for each in record["rivals"]
        )
        return cls(
            tuple(Term.from_dict(each) for each in record["effects"]),
            tuple(np.array(each["values"], dtype=np.float64) for each in record["effects"]),
            np.array(record["centre"], dtype=np.float64),
            float(record["extent"]),
            np.array(record["even"], dtype=np.float64),
            np.array(record["gram"], dtype=np.float64),
            rivals,
            bool(record["noise_known"]),
            None if record["robot"] is None else dict(record["robot"]),
        )


def information_of(fit: SpotFit) -> Information | None:
    """What the spots of a fit tell of its effects and of their rivals; None where no effect was accepted.

    Parameters
    ----------
    fit : SpotFit
    """
    found, seen = fit.discovery, fit.observations
    if found is None or seen is None or not found.accepted:
        return None
    joint, rows = found.fit, np.flatnonzero(found.fit.inliers)
    sigma = max(joint.sigma, fit.noise or 0.0)
    even = evening(joint.noise)
    white = (np.eye(3) if even is None else even) / sigma
    model = _whitened(white, joint.columns[rows])
    there = seen.rows(rows).tipped(tip_of(joint.terms, joint.values))
    rivals = []
    for accepted in found.accepted:
        near = {term.label: (term, apart) for term, apart in accepted.table.near}
        for alias in accepted.aliases:
            near.setdefault(alias.label, (alias, 0.0))
        for term, apart in near.values():
            own = _whitened(white, columns_of(there, [term]))
            rivals.append(RivalColumns(joint.terms.index(accepted.term), term, apart, model.T @ own, own.T @ own))
    return Information(
        joint.terms,
        joint.values,
        joint.moved[rows].mean(axis=0),
        joint.extent,
        white,
        model.T @ model,
        tuple(rivals),
        fit.noise is not None,
        None if seen.robot is None else robot_record(seen.robot),
    )


def _whitened(white: Array, columns: Array) -> Array:
    """Columns (n, 3, k) in units of the noise, as (3n, k)."""
    return np.asarray(np.einsum("ij,njk->nik", white, columns).reshape(-1, columns.shape[2]))
