"""Torques of gravity on the axes, as a basis.

Masses are rarely known, but the torque of an arm's weight is linear in mass and first moments of its links: these are
the columns. Gravity points down the world; how the robot is mounted is in ``robroot`` (``$ROBROOT``, the base frame
of ``MOC.cfg``).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from respot.geometry import Array
from respot.kinematics.cell import RobotCell
from respot.kinematics.model import RobotModel

#: Down, along the axes of the world.
DOWN = np.array([0.0, 0.0, -1.0])
#: Columns of `gravity_basis` for each link: mass, and first moments along the axes of the link's own frame.
COLUMNS = ("mass", "moment_x", "moment_y", "moment_z")


def gravity_in_base(cell: RobotCell) -> Array:
    """Direction of gravity along the axes of the robot's base, shape (3,); (n, 3) for a cell at n places.

    What the controller was told (``gravity_alpha``, ``gravity_beta`` of ``MOC.cfg``) goes before the base frame.
    """
    if cell.gravity is not None:
        return np.asarray(cell.gravity)
    return np.asarray(cell.robroot.rotation.inv().apply(DOWN))


def gravity_basis(model: RobotModel, joints: npt.ArrayLike, gravity: npt.ArrayLike) -> Array:
    """Load of gravity on each axis per unit of weight and moment of each link, shape (n, axes, axes, 4).

    ``[:, j, k]`` is what link k (the body behind axis k) adds to axis j, 0 for k < j: column 0 per unit of weight
    [mm] with the mass at the origin of the link's frame (`RobotModel.frames`), columns 1..3 per unit of weight times
    mm along the x, y and z axes of that frame. Weight in N gives N mm; for a linear axis, N. Positive drives the
    joint to larger values.

    Parameters
    ----------
    model : RobotModel
        The robot.
    joints : array_like
        Joints (n, axes), degrees or mm.
    gravity : array_like
        Unit vector of gravity in the base frame, shape (3,) or (n, 3): `gravity_in_base`.
    """
    chain = model.run(joints)
    down = np.asarray(gravity, dtype=float)
    places = [i for i, step in enumerate(model.steps) if step.joint >= 0]
    count = chain.position.shape[1]
    found = np.zeros((count, model.axes, model.axes, 4))
    for j, place in enumerate(places):
        axis, origin = chain.axes[place].T, chain.origins[place].T
        lever = np.cross(down, axis)
        for k in range(j, model.axes):
            columns, position = chain.links[k]
            if model.revolute[j]:
                found[:, j, k, 0] = np.einsum("ni,ni->n", position.T - origin, lever)
                found[:, j, k, 1:] = np.stack([np.einsum("in,ni->n", column, lever) for column in columns], axis=-1)
            else:
                found[:, j, k, 0] = np.sum(axis * down, axis=-1)
    return np.asarray(np.einsum("ij,nikl->njkl", model.coupling, found))
