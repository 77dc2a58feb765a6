"""Effect ``gear``: the error of an axis repeats with every turn of a gear wheel or motor."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from respot.calibration.effects.effect import Remedy
from respot.calibration.effects.term import Mechanism, Parameter, Term
from respot.calibration.observations import Observations

NAME = "gear"
PLAUSIBLE_DEG = 0.1
LOWEST, HIGHEST = 5, 40
"""Waves per turn of the axis that are tried: fewer are a `joint_profile`; more need the ratio to be known."""
MOTOR = "motor"


def _terms(observations: Observations) -> list[Term]:
    if not observations.has_arm:
        return []
    assert observations.robot is not None and observations.joints is not None  # noqa: S101
    found = []
    for axis in np.flatnonzero(observations.robot.revolute):
        turns = float(np.ptp(observations.joints[:, axis])) / 360.0
        wheels: list[tuple[float, str]] = [(waves, "") for waves in range(LOWEST, HIGHEST + 1)]
        if observations.motor_turns is not None and np.isfinite(observations.motor_turns[axis]):
            wheels.append((float(observations.motor_turns[axis]), MOTOR))
        for waves, wheel in wheels:
            if turns * waves < 1.0:  # less than one wave in the range is a profile
                continue
            for overtones in (1, 2):
                names = tuple(
                    Parameter(f"{wave}_{n * waves:g}", "deg", PLAUSIBLE_DEG)
                    for n in range(1, overtones + 1)
                    for wave in ("cos", "sin")
                )
                form = {"waves": waves, "overtones": overtones, **({"wheel": wheel} if wheel else {})}
                found.append(Term(NAME, {"axis": int(axis) + 1}, names, form))
    return found


def _columns(observations: Observations, term: Term) -> NDArray[np.float64]:
    assert observations.joints is not None  # noqa: S101
    axis, waves = term.where["axis"] - 1, term.form["waves"]
    turns = np.radians(observations.joints[:, axis])
    values = [wave(n * waves * turns) for n in range(1, term.form["overtones"] + 1) for wave in (np.cos, np.sin)]
    columns = np.zeros((*observations.joints.shape, len(values)))
    columns[:, axis] = np.stack(values, axis=-1)
    return columns


def _remedy(term: Term, values: NDArray[np.float64]) -> Remedy:
    axis, waves = term.where["axis"], term.form["waves"]
    size = float(np.hypot(values[0], values[1]))
    text = (
        f"The error of axis {axis} swings by {size:.4f} degrees, {waves:g} times a turn: a wheel of its gear runs out "
        "of true, or its motor's encoder does. Look at the gear (noise, play, oil); until it is changed correct the "
        "points."
    )
    if term.form.get("wheel") == MOTOR:
        text = (
            f"The error of axis {axis} swings by {size:.4f} degrees with every turn of its motor ({waves:.2f} to a "
            "turn of the axis, by the machine data): look at the motor, its encoder and its coupling. A point that is "
            "shifted stands at another angle of the motor: do not correct points for it."
        )
    return Remedy("robot", text)


MECHANISM = Mechanism(
    NAME,
    "joints",
    _terms,
    _columns,
    _remedy,
    needs="joints",
    separates="one axis moved alone in steps of a degree over a tenth of a turn",
)
