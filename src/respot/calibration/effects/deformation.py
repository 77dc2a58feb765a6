"""Effect ``deformation``: a smooth field over the part. It can imitate most others, and so it comes last."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from respot.calibration.effects.effect import Remedy
from respot.calibration.effects.term import Mechanism, Parameter, Term, along
from respot.calibration.observations import Observations

NAME = "deformation"
PLAUSIBLE_MM = 5.0
_CUBES = ((0, 0, 0), (1, 1, 1), (2, 2, 2), (0, 0, 1), (0, 0, 2), (1, 1, 0), (1, 1, 2), (2, 2, 0), (2, 2, 1), (0, 1, 2))
_LEAST_FOR_CUBES = 40
_STRAINS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


def _terms(observations: Observations) -> list[Term]:
    centre = observations.positions.mean(axis=0)
    half = np.maximum(np.abs(observations.positions - centre).max(axis=0), 1.0)
    own = {"centre": centre.tolist(), "half": half.tolist()}
    growth = tuple(Parameter(f"growth_{axis}", "mm", PLAUSIBLE_MM) for axis in "xyz")
    # growth alike in all directions is the effect `scale`
    strain = tuple(
        Parameter(name, "mm", PLAUSIBLE_MM) for name in ("y_over_x", "z_over_x", "shear_xy", "shear_xz", "shear_yz")
    )
    bend = tuple(
        Parameter(f"bend_{axis}_{'xyz'[i]}{'xyz'[j]}", "mm", PLAUSIBLE_MM) for i, j in _STRAINS for axis in "xyz"
    )
    found = [Term(NAME, {}, strain, {**own, "order": 1}), Term(NAME, {}, (*strain, *bend), {**own, "order": 2})]
    # most parts bend or grow one way
    found += [Term(NAME, {}, (growth[axis],), {**own, "growth": axis}) for axis in range(3)]
    found += [Term(NAME, {}, bend[3 * k : 3 * k + 3], {**own, "bend": k}) for k in range(len(_STRAINS))]
    if len(observations) >= _LEAST_FOR_CUBES:
        twist = tuple(
            Parameter(f"twist_{axis}_{''.join('xyz'[i] for i in cube)}", "mm", PLAUSIBLE_MM)
            for cube in _CUBES
            for axis in "xyz"
        )
        found.append(Term(NAME, {}, (*strain, *bend, *twist), {**own, "order": 3}))
    return found


def _columns(observations: Observations, term: Term) -> NDArray[np.float64]:
    even = (observations.positions - np.array(term.form["centre"])) / np.array(term.form["half"])
    if "growth" in term.form:
        axis = term.form["growth"]
        return np.where(np.arange(3) == axis, even, 0.0)[:, :, None]
    if "bend" in term.form:
        return along(np.prod(even[:, list(_STRAINS[term.form["bend"]])], axis=1))
    real, half = even * np.array(term.form["half"]), max(term.form["half"])
    columns = [np.stack([-real[:, 0], real[:, 1], 0.0 * real[:, 2]], axis=1) / half]
    columns.append(np.stack([-real[:, 0], 0.0 * real[:, 1], real[:, 2]], axis=1) / half)
    for i, j in _STRAINS[3:]:
        column = np.zeros_like(even)
        column[:, i], column[:, j] = real[:, j] / half, real[:, i] / half
        columns.append(column)
    powers: list[tuple[int, ...]] = []
    if term.form["order"] >= 2:
        powers += _STRAINS
    if term.form["order"] == 3:
        powers += _CUBES
    for some in powers:
        product = np.prod(even[:, list(some)], axis=1)
        columns += [np.where(np.arange(3) == axis, product[:, None], 0.0) for axis in range(3)]
    return np.stack(columns, axis=-1)


def _remedy(term: Term, values: NDArray[np.float64]) -> Remedy:  # noqa: ARG001 - one place only
    text = (
        f"The part is not the shape of its drawing: a smooth field of up to about {np.abs(values).max():.2f} mm. It "
        "describes what is left and is no cause: clamping, spring-back, heat. Measure the part by itself, then correct "
        "the points where it is accepted as it is."
    )
    return Remedy("points", text)


MECHANISM = Mechanism(
    NAME,
    "part",
    _terms,
    _columns,
    _remedy,
    needs="positions",
    separates="the part measured by itself, away from the robot",
    describes=True,
)
