"""Effect ``rail``: the axis that carries the robot does not run as straight, or as far, as the controller takes it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from respot.calibration.effects.effect import Remedy
from respot.calibration.effects.term import Mechanism, Parameter, Term, along, vector
from respot.calibration.observations import Observations

NAME = "rail"
PLAUSIBLE_MM, PLAUSIBLE_DEG = 5.0, 0.2
_FORMS = ("direction", "straightness", "angles", "all", "fine")
_POWERS = {"straightness": (2, 3), "all": (2, 3), "fine": (2, 3, 4, 5, 6)}
_TURNS = {"angles": (1,), "all": (1,), "fine": (1, 2, 3)}
"""Powers of the travel from the middle: how the rail bows, and how it pitches, rolls and yaws."""


def _terms(observations: Observations) -> list[Term]:
    if observations.external_axes is None:
        return []
    found = []
    for axis in range(observations.external_axes.shape[1]):
        travel = observations.external_axes[:, axis]
        if not np.isfinite(travel).all() or np.ptp(travel) <= 0.0 or observations.carried not in (None, axis):
            continue
        middle, half = float(travel.min() + np.ptp(travel) / 2.0), float(np.ptp(travel) / 2.0)
        for form in _FORMS:
            names: tuple[Parameter, ...] = ()
            if form in ("direction", "all", "fine"):
                names += vector("direction_", "mm", PLAUSIBLE_MM)
            for power in _POWERS.get(form, ()):
                names += vector(f"power_{power}_", "mm", PLAUSIBLE_MM)
            for power in _TURNS.get(form, ()):
                names += tuple(Parameter(f"turn_{power}_{way}", "deg", PLAUSIBLE_DEG) for way in "xyz")
            own = {"form": form, "middle": middle, "half": half}
            found.append(Term(NAME, {"external_axis": axis + 1}, names, own, own=f"e{axis + 1}"))
    return found


def _columns(observations: Observations, term: Term) -> NDArray[np.float64]:
    assert observations.external_axes is not None  # noqa: S101 - the term was made of it
    travel = observations.external_axes[:, term.where["external_axis"] - 1]
    even = (travel - term.form["middle"]) / term.form["half"]
    form = term.form["form"]
    columns = []
    if form in ("direction", "all", "fine"):
        columns.append(along(even))
    columns += [along(even**power) for power in _POWERS.get(form, ())]
    if form in _TURNS:
        foot = np.broadcast_to(np.asarray(observations.base2source.translation), observations.positions.shape)
        turning = np.radians(np.cross(np.eye(3)[None], (observations.positions - foot)[:, None, :]))
        columns += [even[:, None, None] ** power * np.swapaxes(turning, 1, 2) for power in _TURNS[form]]
    return np.concatenate(columns, axis=2)


def _remedy(term: Term, values: NDArray[np.float64]) -> Remedy:
    text = (
        f"Spots move with the position of external axis {term.where['external_axis']}: its direction, length or "
        f"straightness is off by about {float(np.abs(values[:3]).max()):.2f} mm from the middle to an end. Level and "
        "measure the rail; correct its direction and ratio in the machine data, and the rest in the points."
    )
    return Remedy("robot", text)


MECHANISM = Mechanism(
    NAME,
    "part",
    _terms,
    _columns,
    _remedy,
    needs="an external axis",
    separates="the same stations reached from several positions of the rail",
)
