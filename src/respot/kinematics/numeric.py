"""Inverse kinematics by damped least squares, for robots without a closed form; vectorised over the poses.

Levenberg-Marquardt on the pose error, damped in proportion to the squared error (Sugihara, IEEE Trans. Robotics 27,
2011) so that it converges fast at singular joints too; the factor is each pose's own, and a step that makes a pose
worse is taken back. Poses that do not converge start again from other joints.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import RigidTransform, Rotation

from respot.geometry import Array
from respot.kinematics.chain import Pass, Step

#: A pose is reached when its error is below this [mm and, times the robot's size, rad].
REACHED_MM = 1e-8
ITERATIONS = 60


def solve(
    steps: Sequence[Step], poses: RigidTransform, start: Array, size_mm: float, spans: Array
) -> tuple[Array, npt.NDArray[np.bool_]]:
    """Chain joints that reach n poses from n starts.

    Parameters
    ----------
    steps : sequence of Step
        The chain.
    poses : RigidTransform
        n flange poses in the base frame.
    start : Array
        Chain joints to start from, shape (n, axes), degrees or mm.
    size_mm : float
        Length that makes a radian comparable with a millimetre: about the robot's reach.
    spans : Array
        What one unit of a normalised joint is, shape (axes,): degrees or mm.

    Returns
    -------
    joints, reached : Array
        Shape (n, axes) and (n,).
    """
    count, axes = start.shape
    places = [i for i, step in enumerate(steps) if step.joint >= 0]
    goal_r, goal_p = poses.rotation.as_matrix(), poses.translation
    joints = start.copy()
    error, chain = _error(steps, joints, goal_r, goal_p, size_mm)
    jacobian = _scaled(chain, places, size_mm, spans)
    cost = np.sum(error**2, axis=1)
    damping = np.full(count, 0.1)
    active = np.arange(count)
    goal = (REACHED_MM / size_mm) ** 2
    for _ in range(ITERATIONS):
        active = active[cost[active] > goal]
        if not len(active):
            break
        j, e = jacobian[active], error[active]
        normal = np.einsum("nki,nkj->nij", j, j)
        normal += (damping[active] * cost[active] + 1e-15)[:, None, None] * np.eye(axes)
        step = np.linalg.solve(normal, np.einsum("nki,nk->ni", j, e)[:, :, None])[:, :, 0]
        trial = joints[active] + step * spans
        trial_error, trial_chain = _error(steps, trial, goal_r[active], goal_p[active], size_mm)
        trial_cost = np.sum(trial_error**2, axis=1)
        better = trial_cost < cost[active]
        taken = active[better]
        joints[taken], error[taken], cost[taken] = trial[better], trial_error[better], trial_cost[better]
        jacobian[taken] = _scaled(trial_chain, places, size_mm, spans)[better]
        damping[taken] = np.maximum(damping[taken] * 0.3, 1e-4)
        damping[active[~better]] *= 4.0
    # within a thousandth of a micrometre is reached too where rounding stops the descent
    return joints, cost <= 1e4 * goal


def starts(count: int, limits: Array, seed: int) -> Array:
    """Joints to start from, spread over the limits, shape (count, axes); the same for the same seed."""
    random = np.random.default_rng(seed)
    return np.asarray(limits[:, 0] + (limits[:, 1] - limits[:, 0]) * random.random((count, len(limits))))


def _error(steps: Sequence[Step], joints: Array, goal_r: Array, goal_p: Array, size_mm: float) -> tuple[Array, Pass]:
    """Remaining translation (over the size) and rotation vector [rad] in the base frame, shape (n, 6)."""
    chain = Pass(steps, joints)
    now = np.stack([column.T for column in chain.columns], axis=-1)
    turn = np.asarray(Rotation.from_matrix(goal_r @ np.swapaxes(now, 1, 2)).as_rotvec())
    return np.concatenate([(goal_p - chain.position.T) / size_mm, turn], axis=1), chain


def _scaled(chain: Pass, places: Sequence[int], size_mm: float, spans: Array) -> Array:
    """Jacobian of the scaled error with respect to normalised joints."""
    jacobian = chain.twists(places) * spans
    jacobian[:, :3] /= size_mm
    jacobian[:, 3:] = np.radians(jacobian[:, 3:])
    return jacobian
