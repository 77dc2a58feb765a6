"""What carries a robot along: a linear unit, or a turning column, on one external axis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import RigidTransform, Rotation

from respot.geometry import IDENTITY, pose


@dataclass(frozen=True, eq=False)
class Track:
    """A moving foot of a robot.

    Parameters
    ----------
    axis : int
        External axis that drives it, from 0: E1 or eax_a.
    start : RigidTransform
        Frame of the axis in the world (``axis2world``), at zero.
    direction : tuple of float
        Unit vector along which, or about which, the axis moves, in that frame.
    carriage : RigidTransform
        Robot base seen from the moved frame (``base2carriage``).
    turns : bool
        It turns, in degrees; otherwise it slides, in mm.
    name : str
        What people call it.
    """

    axis: int
    start: RigidTransform = IDENTITY
    direction: tuple[float, float, float] = (0.0, 0.0, 1.0)
    carriage: RigidTransform = IDENTITY
    turns: bool = False
    name: str = ""

    def base2world(self, external: npt.ArrayLike) -> RigidTransform:
        """Robot base in the world for external axes (n, k) or (k,).

        Raises
        ------
        ValueError
            The axis that drives the robot is not given.
        """
        values = np.asarray(external, dtype=float)
        if values.shape[-1] <= self.axis or not np.isfinite(values[..., self.axis]).all():
            raise ValueError(f"external axis {self.axis + 1}, which carries the robot, is not given")
        way = values[..., self.axis, None] * np.asarray(self.direction)
        moved = (
            RigidTransform.from_rotation(Rotation.from_rotvec(way, degrees=True))
            if self.turns
            else pose(way, Rotation.identity(len(way)) if way.ndim == 2 else Rotation.identity())
        )
        return self.start * moved * self.carriage
