"""The ways in which people write an orientation that are not ours: A, B, C about other axes, other signs, radians ...

A list was read as Z-Y-X angles in degrees, or as quaternions with the scalar first. A reading takes the same numbers in
another way. Where only the rotations are known, A, B, C are computed back from them: B lies within 90 degrees then, and
a list whose middle number went further was folded, ``(A, B, C)`` into ``(A + 180, 180 - B, C + 180)``. Readings for
which this matters come in both ways, row by row. At B = +-90 degrees only A -+ C is left: such rows are lost for every
reading of angles.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from respot.geometry import abc_from_rotation, quaternion_from_rotation

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Columns = Literal["abc", "quaternion"]

AS_WRITTEN = "as_written"
_LOST_DEG = 1e-3  # B this near to 90 degrees was not distinct in a table of three decimals


@dataclass(frozen=True)
class Reading:
    """Another way to read the numbers of one list.

    Attributes
    ----------
    key : str
        What reports and scripts call it.
    words : str
        What is said of the list: "the reference {words}".
    columns : "abc", "quaternion" or None
        Which numbers it is about; None: the rotation itself.
    make : callable
        From numbers (n, 3) in degrees, or (n, 4) scalar first, to rotations.
    folds : bool
        Whether folding angles into our range changes what they mean.
    """

    key: str
    words: str
    columns: Columns | None
    make: Callable[[Array], Rotation]
    folds: bool = False


@dataclass(frozen=True, eq=False)
class Rotations:
    """Readings of one list as quaternions, scalar first.

    Attributes
    ----------
    readings : sequence of k Reading
    quaternions : (k, 2, n, 4) array
        The second of each two is for numbers that were folded; where that makes no difference it is the first again.
    known : (k, n) bool array
        Whether the row's numbers are known.
    """

    readings: Sequence[Reading]
    quaternions: Array
    known: Mask


def read_all(
    rotations: Rotation, readings: Sequence[Reading], columns: Columns, numbers: Array | None = None
) -> Rotations:
    """Read a list in several ways.

    Parameters
    ----------
    rotations : Rotation of n
        As read in our convention.
    readings : sequence of Reading
    columns : "abc" or "quaternion"
        What the list is written in.
    numbers : (n, 3) array, optional
        A, B, C as they stand in the list, degrees; without them they are computed from the rotations.
    """
    quaternions = quaternion_from_rotation(rotations)
    angles = abc_from_rotation(rotations) if numbers is None or columns != "abc" else numbers
    exact = numbers is not None and columns == "abc"
    lost = np.zeros(len(angles), dtype=np.bool_) if exact else np.abs(np.abs(angles[:, 1]) - 90.0) < _LOST_DEG
    made: list[Array] = []
    known: list[Mask] = []
    for reading in readings:
        given = angles if reading.columns == "abc" else quaternions
        first = quaternion_from_rotation(reading.make(given))
        folded = reading.folds and not exact
        second = quaternion_from_rotation(reading.make(_folded(angles))) if folded else first
        made.append(np.stack([first, second]))
        known.append(~lost if reading.columns == "abc" else np.ones_like(lost))
    return Rotations(readings, np.array(made), np.array(known))


def _folded(angles: Array) -> Array:
    """The other triple of Z-Y-X angles of the same rotation, within 180 degrees."""
    other = np.stack([angles[:, 0] + 180.0, 180.0 - angles[:, 1], angles[:, 2] + 180.0], axis=1)
    return np.asarray((other + 180.0) % 360.0 - 180.0, dtype=np.float64)


def own_readings(columns: Columns) -> list[Reading]:
    """Readings of a list's own numbers, the likeliest first."""
    return [reading for reading in READINGS if reading.columns in (columns, None)]


def foreign_readings(columns: Columns) -> list[Reading]:
    """Readings of numbers that stood in the list before somebody converted it."""
    return [reading for reading in READINGS if reading.columns not in (columns, None)]


def reread(rotations: Rotation, key: str) -> Rotation:
    """Read rotations in the way ``key``; folded numbers are not unfolded.

    Parameters
    ----------
    rotations : Rotation of n
        As read in our convention.
    key : str
        Of `READINGS`, or ``"as_written"``.
    """
    if key == AS_WRITTEN:
        return rotations
    reading = next(reading for reading in READINGS if reading.key == key)
    numbers = abc_from_rotation(rotations) if reading.columns == "abc" else quaternion_from_rotation(rotations)
    return reading.make(numbers)


def _euler(order: str, columns: Sequence[int] = (0, 1, 2), degrees: bool = True) -> Callable[[Array], Rotation]:
    """Angles in the order of columns about moving axes (capitals) or fixed ones."""
    return lambda numbers: Rotation.from_euler(order, numbers[:, list(columns)], degrees=degrees)


def _signs(a: float, b: float, c: float) -> Callable[[Array], Rotation]:
    return lambda numbers: Rotation.from_euler("ZYX", numbers * [a, b, c], degrees=True)


def _vector(columns: Sequence[int], degrees: bool) -> Callable[[Array], Rotation]:
    return lambda numbers: Rotation.from_rotvec(numbers[:, list(columns)], degrees=degrees)


def _quaternion(order: Sequence[int], conjugate: bool = False) -> Callable[[Array], Rotation]:
    def make(numbers: Array) -> Rotation:
        rotations = Rotation.from_quat(numbers[:, list(order)], scalar_first=True)
        return rotations.inv() if conjugate else rotations

    return make


_LAST = (3, 0, 1, 2)

GIVEN = Reading(AS_WRITTEN, "is written as it was read", None, _quaternion((0, 1, 2, 3)))
"""Our own convention."""

READINGS: tuple[Reading, ...] = (
    Reading("inverse", "has the inverse orientations (reference to tool)", None, _quaternion((0, 1, 2, 3), True)),
    Reading(
        "xyz_fixed",
        "has A about x and C about z (fixed x, y, z: roll, pitch, yaw; or A and C exchanged)",
        "abc",
        _euler("xyz"),
    ),
    Reading("xyz_moving", "has its angles about moving x, y, z", "abc", _euler("XYZ")),
    Reading("zyx_fixed", "has its angles about fixed z, y, x", "abc", _euler("zyx")),
    Reading("zyx_radians", "has its angles in radians", "abc", _euler("ZYX", degrees=False)),
    Reading("sign_a", "has the sign of A turned round", "abc", _signs(-1.0, 1.0, 1.0)),
    Reading("sign_b", "has the sign of B turned round", "abc", _signs(1.0, -1.0, 1.0)),
    Reading("sign_c", "has the sign of C turned round", "abc", _signs(1.0, 1.0, -1.0)),
    Reading("sign_abc", "has the signs of A, B and C turned round", "abc", _signs(-1.0, -1.0, -1.0)),
    Reading("zyz_moving", "has its angles about moving z, y, z", "abc", _euler("ZYZ"), True),
    Reading("zxz_moving", "has its angles about moving z, x, z", "abc", _euler("ZXZ"), True),
    Reading("zyz_fixed", "has its angles about fixed z, y, z", "abc", _euler("zyz"), True),
    Reading("zxz_fixed", "has its angles about fixed z, x, z", "abc", _euler("zxz"), True),
    Reading(
        "xyz_fixed_radians",
        "has A about x and C about z (roll, pitch, yaw), in radians",
        "abc",
        _euler("xyz", degrees=False),
    ),
    Reading(
        "xyz_moving_radians", "has its angles about moving x, y, z, in radians", "abc", _euler("XYZ", (0, 1, 2), False)
    ),
    Reading(
        "zyx_fixed_radians", "has its angles about fixed z, y, x, in radians", "abc", _euler("zyx", (0, 1, 2), False)
    ),
    Reading(
        "zyz_moving_radians", "has its angles about moving z, y, z, in radians", "abc", _euler("ZYZ", (0, 1, 2), False)
    ),
    Reading(
        "zxz_moving_radians", "has its angles about moving z, x, z, in radians", "abc", _euler("ZXZ", (0, 1, 2), False)
    ),
    Reading("vector_xyz_radians", "has a rotation vector x, y, z in radians", "abc", _vector((0, 1, 2), False)),
    Reading("vector_zyx_radians", "has a rotation vector z, y, x in radians", "abc", _vector((2, 1, 0), False)),
    Reading("vector_xyz", "has a rotation vector x, y, z in degrees", "abc", _vector((0, 1, 2), True), True),
    Reading("vector_zyx", "has a rotation vector z, y, x in degrees", "abc", _vector((2, 1, 0), True), True),
    Reading("columns_ab", "has A and B exchanged", "abc", _euler("ZYX", (1, 0, 2)), True),
    Reading("columns_bc", "has B and C exchanged", "abc", _euler("ZYX", (0, 2, 1)), True),
    Reading("zxy_moving", "has its angles about moving z, x, y", "abc", _euler("ZXY")),
    Reading("yxz_moving", "has its angles about moving y, x, z", "abc", _euler("YXZ")),
    Reading("xzy_moving", "has its angles about moving x, z, y", "abc", _euler("XZY")),
    Reading("yzx_moving", "has its angles about moving y, z, x", "abc", _euler("YZX")),
    Reading("scalar_last", "has its quaternions scalar last", "quaternion", _quaternion(_LAST)),
    Reading(
        "scalar_last_inverse",
        "has its quaternions scalar last, and the inverse orientations",
        "quaternion",
        _quaternion(_LAST, True),
    ),
)
