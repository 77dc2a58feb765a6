"""Checks along a program: singularities, branch changes between neighbours, joint travel, limits.

All of them look at joints, one row per motion in the order of the program; a row of NaN is a motion whose joints are
not known and is left out.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from respot.geometry import Array
from respot.kinematics.cell import RobotCell
from respot.kinematics.opw import OpwRobot
from respot.kinematics.posture import ELBOW, FRONT, WRIST, posture
from respot.kinematics.turns import ROUNDING

#: Nearer to a singularity than this a path is worth a look: axis 5 and elbow [deg], wrist centre from axis 1 [mm].
NEAR_DEG, NEAR_MM = 2.0, 50.0
#: A correction must not change the travel of an axis by more: something unwinds.
LARGEST_CHANGE_DEG = 180.0
#: Distance from a software limit that is worth a word [deg].
LIMIT_MARGIN_DEG = 1.0
#: A finding that was there before a correction is worse after it if so much of its margin is gone.
WORSE = 0.1


@dataclass(frozen=True)
class Finding:
    """Something about the motion of a row.

    Parameters
    ----------
    code : str
        ``NEAR_SINGULARITY``, ``BRANCH_CHANGE``, ``NEAR_LIMIT``, ``OUT_OF_LIMITS`` or ``JOINT_TRAVEL``.
    row : int
        The motion; for a pair of motions the second.
    message : str
        What it is, with axis and angle.
    subject : str
        What it is about: an axis, a singularity, a branch.
    room : float
        What is left to the border, as a share of the distance that is worth a word; 0 where there is no distance.
    """

    code: str
    row: int
    message: str
    subject: str = ""
    room: float = 0.0


def singularity_distances(model: OpwRobot, joints: npt.ArrayLike) -> Array:
    """Distance of each row from the three singularities, shape (n, 3).

    Columns: overhead, the distance of the wrist centre from axis 1 [mm]; elbow, the angle of axis 3 from the
    stretched or the folded arm [deg]; wrist, the angle of axis 5 from 0 or 180 [deg].
    """
    found = posture(model, np.atleast_2d(np.asarray(joints, dtype=float)))
    overhead = np.hypot(found[:, FRONT], model.b)
    folded = np.abs(found[:, [ELBOW, WRIST]]) % 180.0
    return np.column_stack([overhead, np.minimum(folded, 180.0 - folded)])


def travel(joints: npt.ArrayLike) -> Array:
    """How far each axis turns from row to row, signed, shape (n - 1, axes) [deg or mm]."""
    return np.diff(np.atleast_2d(np.asarray(joints, dtype=float)), axis=0)


def check_path(cell: RobotCell, joints: npt.ArrayLike) -> list[Finding]:
    """Singularities, branch changes and limits along a path of n rows of joints (n, axes)."""
    angles = np.atleast_2d(np.asarray(joints, dtype=float))
    found = list(_limits(cell, angles))
    if isinstance(cell.model, OpwRobot):
        found += [*_singularities(cell.model, angles), *_branch_changes(cell.model, angles)]
    return sorted(found, key=lambda finding: finding.row)


def check_travel(before: npt.ArrayLike, after: npt.ArrayLike) -> list[Finding]:
    """Motions whose joint travel a correction changes by more than 180 degrees on an axis; same rows, (n, axes)."""
    old, new = travel(before), travel(after)
    change = np.nan_to_num(np.abs(new - old))
    found = []
    for row in np.flatnonzero(change.max(axis=1, initial=0.0) > LARGEST_CHANGE_DEG):
        axis = int(np.argmax(change[row]))
        turns = f"turns {new[row, axis]:.1f} deg to this target, {old[row, axis]:.1f} before the correction"
        found.append(Finding("JOINT_TRAVEL", int(row) + 1, f"axis {axis + 1} {turns}"))
    return found


def made_worse(before: Iterable[Finding], after: Iterable[Finding]) -> list[Finding]:
    """Findings that a correction brought, or made clearly worse; same rows."""
    known = {(finding.row, finding.subject): finding.room for finding in before}
    worse = []
    for finding in after:
        room = known.get((finding.row, finding.subject))
        if room is None or room - finding.room > WORSE:
            worse.append(finding)
    return worse


def _limits(cell: RobotCell, joints: Array) -> Iterator[Finding]:
    if cell.limits is None:
        return
    room = np.minimum(joints - cell.limits[:, 0], cell.limits[:, 1] - joints)
    for row, axis in np.argwhere(room < LIMIT_MARGIN_DEG):
        low, high = cell.limits[axis]
        text = f"axis {axis + 1} stands at {joints[row, axis]:.3f}, limits {low:g} .. {high:g}"
        code = "OUT_OF_LIMITS" if room[row, axis] < -ROUNDING else "NEAR_LIMIT"
        yield Finding(code, int(row), text, f"axis {axis + 1}", float(room[row, axis]) / LIMIT_MARGIN_DEG)


def _singularities(model: OpwRobot, joints: Array) -> Iterator[Finding]:
    names = ("the wrist centre stands {:.1f} mm from axis 1", "the arm is {:.2f} deg from stretched or folded",
             "axis 5 stands {:.2f} deg from 0: axes 4 and 6 are in line")  # fmt: skip
    distances = singularity_distances(model, joints)
    margins = np.array([NEAR_MM, NEAR_DEG, NEAR_DEG])
    for row, column in np.argwhere(distances < margins):
        distance = float(distances[row, column])
        subject = ("overhead", "elbow", "wrist")[column]
        room = distance / float(margins[column])
        yield Finding("NEAR_SINGULARITY", int(row), names[column].format(distance), subject, room)


def _branch_changes(model: OpwRobot, joints: Array) -> Iterator[Finding]:
    names = ("the wrist centre changes to the other side of axis 1", "the elbow turns over", "axis 5 changes its sign")
    known = np.flatnonzero(np.isfinite(joints).all(axis=1))
    behind = posture(model, joints[known]) < -ROUNDING
    for pair, column in np.argwhere(behind[1:] != behind[:-1]):
        yield Finding("BRANCH_CHANGE", int(known[pair + 1]), names[column], names[column])
