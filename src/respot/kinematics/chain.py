"""A kinematic chain as a product of elementary steps, with its derivatives.

A step turns about, or moves along, the x, y or z axis that the steps before it have left. Every robot is a list of
such steps, whatever convention describes it. A small change of a step's value moves everything behind it as a screw:
about or along the step's axis, through its origin. So one pass along the chain gives the pose, the geometric Jacobian
of the joints and the derivative by every length, twist and offset.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from respot.geometry import Array

X, Y, Z = 0, 1, 2


@dataclass(frozen=True)
class Step:
    """One elementary transform of a chain.

    Parameters
    ----------
    axis : int
        0, 1, 2: the local x, y or z axis.
    turns : bool
        A rotation [deg]; otherwise a translation [mm].
    value : float
        Its constant part.
    joint : int
        Index of the joint that is added to the constant; -1 if none.
    parameter : str
        Name of the geometric parameter behind the constant; empty if it is none.
    gain : float
        Derivative of the constant with respect to the parameter: 1 or -1.
    """

    axis: int
    turns: bool
    value: float = 0.0
    joint: int = -1
    parameter: str = ""
    gain: float = 1.0


class Pass:
    """One pass along a chain for n joint vectors; poses are in the base frame, mm.

    Parameters
    ----------
    steps : sequence of Step
        The chain.
    joints : Array
        Joint values of the chain, shape (n, joints), degrees or mm.
    """

    def __init__(self, steps: Sequence[Step], joints: Array) -> None:
        count = len(joints)
        self.steps = steps
        self._joints = joints
        #: direction and origin of each step's axis, (3, n) each
        self.axes: list[Array] = []
        self.origins: list[Array] = []
        columns = [np.repeat(unit[:, None], count, axis=1) for unit in np.eye(3)]
        position = np.zeros((3, count))
        #: after each step that has a joint: the three columns of the rotation, and the origin
        self.links: list[tuple[list[Array], Array]] = []
        for step in steps:
            axis = columns[step.axis]
            self.axes.append(axis)
            self.origins.append(position)
            value = step.value + joints[:, step.joint] if step.joint >= 0 else step.value
            if step.turns:
                if step.joint >= 0 or value != 0.0:
                    columns = _turned(columns, step.axis, np.radians(value))
            elif step.joint >= 0 or value != 0.0:
                position = position + axis * value
            if step.joint >= 0:
                self.links.append((columns, position))
        self.columns = columns
        self.position = position

    @property
    def matrices(self) -> Array:
        """Poses of the end of the chain, shape (n, 4, 4)."""
        found = np.zeros((self.position.shape[1], 4, 4))
        for k, column in enumerate(self.columns):
            found[:, :3, k] = column.T
        found[:, :3, 3] = self.position.T
        found[:, 3, 3] = 1.0
        return found

    def twists(self, indices: Sequence[int]) -> Array:
        """Motion of the end of the chain per unit of each step, shape (n, 6, len(indices)).

        Rows 0..2: translation of the end's origin, mm per degree or per mm; rows 3..5: rotation vector, degrees per
        degree or per mm; both along the axes of the base.
        """
        found = np.zeros((self.position.shape[1], 6, len(indices)))
        for column, index in enumerate(indices):
            axis = self.axes[index]
            if self.steps[index].turns:
                found[:, :3, column] = np.radians(_cross(axis, self.position - self.origins[index])).T
                found[:, 3:, column] = axis.T
            else:
                found[:, :3, column] = axis.T
        return found


def _turned(columns: list[Array], axis: int, angle: Array | float) -> list[Array]:
    """Columns of R times a rotation about a local axis [rad]."""
    cosine, sine = np.cos(angle), np.sin(angle)
    first, second = (axis + 1) % 3, (axis + 2) % 3
    turned = list(columns)
    turned[first] = columns[first] * cosine + columns[second] * sine
    turned[second] = columns[second] * cosine - columns[first] * sine
    return turned


def _cross(a: Array, b: Array) -> Array:
    """Cross product of vectors (3, n)."""
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
