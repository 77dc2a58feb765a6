"""Status and turn or confdata of moved targets, from the robot's kinematic model."""

from __future__ import annotations

from respot.correction.correction import Configurator
from respot.program.robot import Robot


def configurator_of(robot: Robot) -> Configurator | None:
    """Return the configurator of a robot; None where no kinematic model is known."""
    return None
