"""What an effect offers to a fit: places where it may be, columns that it adds there, and what to do about it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from respot.calibration.effects.effect import Remedy
from respot.calibration.observations import Observations

Array = NDArray[np.float64]
Acts = Literal["joints", "arm", "tool", "part"]


@dataclass(frozen=True)
class Parameter:
    """One parameter of a term.

    Attributes
    ----------
    name, unit : str
    prior : float
        Standard deviation of what is plausible in a plant, in the unit: what the spots say less than this about is not
        determined by them.
    """

    name: str
    unit: str
    prior: float


@dataclass(frozen=True)
class Term:
    """An effect at one place, in one form.

    Attributes
    ----------
    effect : str
        Name of the effect.
    where : mapping
        Its place, as reports say it: axis (from 1), column, level, ...
    form : mapping
        Constants of its form that are chosen by trying: harmonics, time constants. Two terms that differ only here are
        the same finding.
    parameters : tuple of Parameter
        One for each column.
    own : str
        The table column that it follows; held-out errors are never folded by it.
    family : str
        Effects of one family are one finding in several forms; by default an effect is its own family.
    """

    effect: str
    where: Mapping[str, Any]
    parameters: tuple[Parameter, ...]
    form: Mapping[str, Any] = field(default_factory=dict)
    own: str = ""
    family: str = ""

    @property
    def key(self) -> tuple[Any, ...]:
        """What makes two terms the same finding: family and place."""
        return (self.family or self.effect, tuple(sorted((name, _frozen(value)) for name, value in self.where.items())))

    @property
    def label(self) -> str:
        """Short text for lists of rivals: ``joint_zero axis 3``."""
        return " ".join([self.effect, *(f"{name} {_shown(value)}" for name, value in self.where.items())])

    def to_dict(self) -> dict[str, Any]:
        """JSON values."""
        return {
            "effect": self.effect,
            "where": dict(self.where),
            "form": dict(self.form),
            "parameters": [{"name": p.name, "unit": p.unit, "prior": p.prior} for p in self.parameters],
            "own": self.own,
            "family": self.family,
        }

    @classmethod
    def from_dict(cls, record: Mapping[str, Any]) -> Term:
        """Read what `to_dict` made.

        Raises
        ------
        KeyError, TypeError, ValueError
            Entries that are missing or wrong.
        """
        parameters = tuple(
            Parameter(str(each["name"]), str(each["unit"]), float(each["prior"])) for each in record["parameters"]
        )
        where, form = dict(record["where"]), dict(record["form"])
        return cls(str(record["effect"]), where, parameters, form, str(record["own"]), str(record["family"]))


def _frozen(value: object) -> object:
    return tuple(value) if isinstance(value, list) else value


def _shown(value: object) -> str:
    return ", ".join(str(item) for item in value) if isinstance(value, list | tuple) else str(value)


@dataclass(frozen=True)
class Mechanism:
    """An effect of the catalogue.

    Attributes
    ----------
    name : str
    acts : str
        Where it acts: on the ``"joints"`` (columns are degrees of each axis), on the ``"arm"`` otherwise, on the
        ``"tool"`` (shifts that turn with it), on the ``"part"`` or on the measuring.
    terms : callable
        Every place and form to try with some observations.
    columns : callable
        Of a term: (n, 3, k) shifts in the source frame [mm per unit]; of one that acts on joints (n, axes, k), degrees
        of each axis per unit.
    remedy : callable
        Where a person would fix it, from the term and its values.
    needs : str
        What the spots must come with.
    separates : str
        What measurement tells it from what it is confounded with.
    turns : callable, optional
        Of a term: by which rotation vector each tool turns, source frame, (n, 3, k) degrees per unit of each parameter.
    describes : bool
        It describes a shape and is no cause: it comes after all that may be one, and is never named.
    points : bool
        It tells where to look for the cause and is none itself: it is never named.
    constants : callable, optional
        Of a term: constants of its form that may be refined, each with the least and the largest value to look at.
    many : bool
        It has so many parameters that it comes near to almost any noise: it is never named.
    """

    name: str
    acts: Acts
    terms: Callable[[Observations], list[Term]]
    columns: Callable[[Observations, Term], Array]
    remedy: Callable[[Term, Array], Remedy]
    needs: str
    separates: str
    turns: Callable[[Observations, Term], Array] | None = None
    describes: bool = False
    points: bool = False
    many: bool = False
    constants: Callable[[Term], Mapping[str, tuple[float, float]]] | None = None

    def shifts(self, observations: Observations, term: Term) -> Array:
        """Shifts of the TCP (n, 3, k) in the source frame per unit of each parameter [mm], to first order."""
        columns = self.columns(observations, term)
        if self.acts == "joints":
            return np.asarray(observations.joint_columns @ columns)
        return columns


def body_turns(values: Array, parameters: int) -> Array:
    """Rotation vectors (n, 3, k) of columns that `motion_about` made, k a multiple of 6 or 3 [deg per unit]."""
    found = np.zeros((len(values), 3, parameters))
    for start in range(0, parameters - 5, 6):
        found[:, :, start + 3 : start + 6] = along(values)
    return found


def along(values: Array, size: int = 3) -> Array:
    """Columns (n, 3, 3) of a shift along x, y and z that follows values (n,)."""
    return np.asarray(values[:, None, None] * np.eye(size))


def vector(prefix: str, unit: str, prior: float) -> tuple[Parameter, ...]:
    """Three parameters, along x, y and z."""
    return tuple(Parameter(f"{prefix}{axis}", unit, prior) for axis in "xyz")


def motion_about(points: Array, values: Array, centre: Array) -> Array:
    """Columns (n, 3, 6) of a rigid motion [mm, deg] about a centre (3,) [mm] that follows values (n,)."""
    turning = np.radians(np.cross(np.eye(3)[None], (points - centre)[:, None, :]))
    return np.concatenate([along(values), values[:, None, None] * np.swapaxes(turning, 1, 2)], axis=2)
