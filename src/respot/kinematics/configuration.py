"""Status and turn, or confdata, of moved targets.

The old numbers and the old pose define the joints of the taught point. The moved point gets the joint solution
nearest to them, full turns included, and its numbers follow from that. Nothing is guessed: a taught point whose
numbers fit none of its solutions, a solution outside the limits, a pose out of reach are reasons, not answers.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import RigidTransform

from respot.geometry import Array
from respot.kinematics import confdata, status_turn
from respot.kinematics.cell import Reason, RobotCell
from respot.kinematics.opw import OpwRobot
from respot.kinematics.path import singularity_distances
from respot.kinematics.turns import ROUNDING, TURNS, chosen_turn, nearest_turn, outside

Integers = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

#: A moved angle this near to a border keeps the old number if that is the one on the other side [deg; mm].
KEEP = ROUNDING
#: Taught points are printed with few digits: their joints may lie so far beyond a border of the old numbers [deg; mm].
TAUGHT = 0.02
#: The nominal joints of an absolutely accurate robot are not its joints; within this of a border they decide nothing.
ACCURATE = 0.5
#: Taught points that are looked at together: the trials of full turns take 5 kB each, several times.
_AT_ONCE = 4096
#: No status, turn or quadrant is as large.
NO_NUMBER = 1_000_000


class Scheme(Protocol):
    """What a language's module offers: `respot.kinematics.status_turn`, `respot.kinematics.confdata`."""

    def posture_matches(self, model: OpwRobot, joints: Array, old: Integers, tolerance: Array) -> Bools:
        """Whether solutions have the old branch."""

    def turn_matches(self, joints: Array, old: Integers, tolerance: Array) -> Bools:
        """Whether angles plus full turns have the old turns."""

    def undefined(self, old: Integers) -> Bools:
        """Whether the old numbers are no such numbers."""

    def margins(self, model: OpwRobot, joints: Array) -> Array:
        """Distances from the borders."""

    def text(self, configuration: npt.ArrayLike) -> str:
        """As people write it."""


@dataclass(frozen=True, eq=False)
class Reconfiguration:
    """Configuration of n moved targets.

    Parameters
    ----------
    configuration : ndarray of int
        ``S, T`` (n, 2) or ``cf1, cf4, cf6, cfx`` (n, 4); where there is a reason, the old numbers.
    joints : Array
        Joints of the moved targets, shape (n, 6), degrees; NaN where there is a reason that leaves none.
    old_joints : Array
        Joints of the taught points, shape (n, 6); NaN where none fits.
    reasons : tuple of (Reason or None)
        Why a target has no valid configuration; None where it has.
    """

    configuration: Integers
    joints: Array
    old_joints: Array
    reasons: tuple[Reason | None, ...]

    @property
    def valid(self) -> Bools:
        """Whether each target has a configuration."""
        return np.array([reason is None for reason in self.reasons], dtype=bool)


def configuration_of(cell: RobotCell, joints: npt.ArrayLike, previous: npt.ArrayLike | None = None) -> Integers:
    """Status and turn (n, 2), or confdata (n, 4), of joints (n, 6) [deg]; ``previous`` as in `status_turn`, `confdata`.

    Raises
    ------
    ValueError
        The robot has no spherical wrist, or a joint is not finite.
    """
    if not isinstance(cell.model, OpwRobot):
        raise ValueError(f"status, turn and confdata are not defined for {cell.model.name or 'this robot'}")
    angles = np.atleast_2d(np.asarray(joints, dtype=float))
    if not np.isfinite(angles).all():
        raise ValueError("a joint is not finite")
    write = status_turn.status_turn if cell.language == "krl" else confdata.confdata
    return write(cell.model, angles, previous, KEEP)


def taught_joints(
    cell: RobotCell, tool2flange: RigidTransform, tool2world: RigidTransform, configuration: npt.ArrayLike
) -> tuple[Array, tuple[Reason | None, ...]]:
    """Joints (n, 6) [deg] of n taught points, and for each without joints the reason why none fits; NaN there."""
    refused = _refused(cell)
    old = _whole(configuration)
    if refused is not None or not isinstance(cell.model, OpwRobot):
        return np.full((len(old), 6), np.nan), (refused,) * len(old)
    branches = all_solutions(cell, cell.model, tool2world, tool2flange, len(old))
    pieces = [slice(start, start + _AT_ONCE) for start in range(0, max(len(old), 1), _AT_ONCE)]
    taught = [_taught(cell, cell.model, branches[piece], old[piece]) for piece in pieces]
    return np.concatenate([joints for joints, _ in taught]), tuple(reason for _, some in taught for reason in some)


def reconfigure(
    cell: RobotCell,
    tool2flange: RigidTransform,
    old_tool2world: RigidTransform,
    new_tool2world: RigidTransform,
    configuration: npt.ArrayLike,
    new_tool2flange: RigidTransform | None = None,
) -> Reconfiguration:
    """Status and turn, or confdata, of moved targets.

    Parameters
    ----------
    cell : RobotCell
        The robot; one that moves with an external axis stands where `RobotCell.at` puts it.
    tool2flange : RigidTransform
        TCP seen from the flange, one for all or n. For an external TCP the old target seen from the flange.
    old_tool2world, new_tool2world : RigidTransform
        TCP poses in the world before and after, one or n; the new ones as they are printed. For an external TCP the
        gun.
    configuration : array_like of int
        Old ``S, T`` (n, 2) or ``cf1, cf4, cf6, cfx`` (n, 4). What is no whole number fits no pose.
    new_tool2flange : RigidTransform, optional
        The same after the correction; without it the old one. For an external TCP the new target.
    """
    new_tool = tool2flange if new_tool2flange is None else new_tool2flange
    old = _whole(configuration)
    old_joints, reasons = taught_joints(cell, tool2flange, old_tool2world, old)
    joints, result = np.full((len(old), 6), np.nan), old.copy()
    rows = np.flatnonzero([reason is None for reason in reasons])
    model = cell.model
    if not len(rows) or not isinstance(model, OpwRobot):
        return Reconfiguration(result, joints, old_joints, reasons)
    branches = all_solutions(cell, model, new_tool2world, new_tool, len(old))
    joints[rows] = nearest_solution(model, branches[rows], old_joints[rows])
    found = list(reasons)
    reached = rows[np.isfinite(joints[rows]).all(axis=1)]
    if len(reached):
        result[reached] = configuration_of(cell, joints[reached], old[reached])
    for row in np.setdiff1d(rows, reached).tolist():
        found[row] = _unreached(cell, model, new_tool2world, new_tool, row)
    for row in reached[_doubtful(cell, model, joints[reached], old[reached])].tolist():
        found[row] = _objection(cell, model, joints[row], old_joints[row], old[row])
    refused = np.array([reason is not None for reason in found])
    result[refused] = old[refused]
    return Reconfiguration(result, joints, old_joints, tuple(found))


def _refused(cell: RobotCell) -> Reason | None:
    """Why no target of this cell can be computed."""
    name = cell.model.name or "the robot"
    if not isinstance(cell.model, OpwRobot):
        return Reason("CONFIG_NOT_CHECKED", f"{name} has no spherical wrist: no status, turn or confdata")
    if cell.on_track:
        return Reason("CONFIG_NOT_CHECKED", f"{name} stands on an external axis: where its base is, is not known")
    return None


def _whole(configuration: npt.ArrayLike) -> Integers:
    """Configurations (n, k) as integers; a row with anything else becomes one that no pose has."""
    numbers = np.atleast_2d(np.asarray(configuration, dtype=float))
    whole = (np.abs(numbers) < NO_NUMBER) & (numbers == np.round(numbers))
    return np.where(whole.all(axis=1, keepdims=True), numbers, -NO_NUMBER).astype(np.int64)


def _accurate(cell: RobotCell, old: Integers) -> Bools:
    """Whether each target belongs to an absolutely accurate robot; KUKA writes it into bit 4 of the status."""
    marked = (old[:, 0] & 16) > 0 if cell.language == "krl" else np.zeros(len(old), dtype=bool)
    return np.asarray(marked | cell.absolute_accuracy)


def _scheme(cell: RobotCell) -> Scheme:
    return status_turn if cell.language == "krl" else confdata


def all_solutions(
    cell: RobotCell, model: OpwRobot, tool2world: RigidTransform, tool2flange: RigidTransform, count: int
) -> Array:
    """All solutions of n TCP poses, shape (n, 8, 6); NaN for a pose that is no number."""
    (tool2world, first), (tool2flange, second) = _finite(tool2world), _finite(tool2flange)
    found = np.array(model.inverse(cell.flange2base(tool2world, tool2flange)))
    found = np.array(np.broadcast_to(found, (count, *found.shape[1:])))
    found[~np.broadcast_to(first & second, count)] = np.nan
    return found


def _finite(poses: RigidTransform) -> tuple[RigidTransform, Bools]:
    """Poses with zeros in place of what is no number, and which are numbers."""
    finite = np.atleast_1d(np.isfinite(poses.translation).all(axis=-1))
    if finite.all():
        return poses, finite
    places = np.nan_to_num(poses.translation, nan=0.0, posinf=0.0, neginf=0.0)
    return RigidTransform.from_components(places, poses.rotation), finite


def _taught(
    cell: RobotCell, model: OpwRobot, branches: Array, old: Integers
) -> tuple[Array, tuple[Reason | None, ...]]:
    """Solution of each taught point that has its old numbers."""
    scheme = _scheme(cell)
    tolerance = np.where(_accurate(cell, old), ACCURATE, TAUGHT)[:, None, None]
    exists: Bools = np.asarray(np.isfinite(branches).all(axis=-1))
    fits = exists & scheme.posture_matches(model, branches, old, tolerance)
    exactly = scheme.posture_matches(model, branches, old, np.zeros_like(tolerance))
    angles, turned = chosen_turn(
        branches[..., None] + TURNS, scheme.turn_matches(branches, old, tolerance), cell.limits
    )
    inside = (outside(angles, cell.limits) <= tolerance).all(axis=-1)
    usable = fits & turned.all(axis=-1) & inside
    # on both sides of a border a branch fits within the tolerance; the numbers say which side is meant
    cost = np.where(usable, np.abs(angles).sum(axis=-1) + 1e6 * ~exactly, np.inf)
    best = np.argmin(cost, axis=1)
    joints = angles[np.arange(len(old)), best]
    fitting = usable.any(axis=1) & ~scheme.undefined(old)
    doubtful = ~fitting | _near_singular(model, np.where(fitting[:, None], joints, 0.0))
    if model.coupled_23:
        doubtful |= usable.sum(axis=1) > 1
    reasons: list[Reason | None] = [None] * len(old)
    for row in np.flatnonzero(doubtful).tolist():
        if not fitting[row]:
            untold = (_undetermined(model, solution, "taught") for solution in branches[row, fits[row]])
            reasons[row] = next(filter(None, untold), None) or _misfit(cell, scheme, old[row], branches[row])
        elif model.coupled_23 and _differ(angles[row, usable[row]]):
            reasons[row] = _inconsistent(cell, f"{scheme.text(old[row])} fits several solutions of the taught pose")
        else:
            reasons[row] = _undetermined(model, joints[row], "taught")
    joints[[reason is not None for reason in reasons]] = np.nan
    return joints, tuple(reasons)


def _misfit(cell: RobotCell, scheme: Scheme, old: Integers, branches: Array) -> Reason:
    """Say why no solution (8, 6) of a taught point has its old numbers."""
    if (old == -NO_NUMBER).any():
        return _inconsistent(cell, "status, turn or confdata is not a whole number")
    shown = scheme.text(old)
    solutions = branches[np.isfinite(branches).all(axis=-1)]
    if not len(solutions):
        return _inconsistent(cell, "the taught pose itself is out of reach: tool, base or robot model differ")
    angles, _ = chosen_turn(solutions[..., None] + TURNS, np.ones((*solutions.shape, len(TURNS)), bool), cell.limits)
    inside = angles[(outside(angles, cell.limits) == 0.0).all(axis=-1)]
    if not len(inside):
        return _inconsistent(cell, "the taught pose itself is outside the limits: tool, base or robot model differ")
    others = dict.fromkeys(scheme.text(other) for other in configuration_of(cell, inside))
    return _inconsistent(cell, f"{shown} fits no joint solution of the taught pose; those have {' or '.join(others)}")


def _inconsistent(cell: RobotCell, message: str) -> Reason:
    return Reason("CONFIG_INCONSISTENT", f"{message} ({cell.model.name or 'robot'})")


def _near_singular(model: OpwRobot, joints: Array) -> Bools:
    """Which of n rows of joints `_undetermined` has something to say of."""
    overhead, _, straight = singularity_distances(model, joints).T
    return np.asarray((overhead <= TAUGHT) | (straight <= TAUGHT))


def _undetermined(model: OpwRobot, joints: Array, what: str) -> Reason | None:
    """Say which axes a pose does not tell: with axis 5 straight 4 and 6 are one, below the wrist centre axis 1 is free.

    The digits of a printed pose then turn them by any angle, and signs and quadrants mean nothing.
    """
    overhead, _, straight = singularity_distances(model, joints)[0]
    text = ""
    if straight <= TAUGHT:
        text = f"axis 5 of the {what} pose stands at {joints[4]:.4f} deg: it does not tell axes 4 and 6 apart"
    elif overhead <= TAUGHT:
        text = f"the wrist centre of the {what} pose is {overhead:.4f} mm from axis 1: it does not tell axis 1"
    return Reason("CONFIG_NOT_CHECKED", f"{text} ({model.name or 'robot'})") if text else None


def _differ(solutions: Array) -> bool:
    return bool(len(solutions) > 1 and np.ptp(solutions, axis=0).max() > 1e-3)


def nearest_solution(model: OpwRobot, branches: Array, old_joints: Array) -> Array:
    """Of all solutions (n, 8, 6), with their full turns, the one nearest to the old joints (n, 6), same shape."""
    turned = nearest_turn(branches, old_joints[:, None, :], model.revolute)
    travel = np.linalg.norm(turned - old_joints[:, None, :], axis=-1)
    best = np.argmin(np.where(np.isfinite(travel), travel, np.inf), axis=1)
    return np.asarray(turned[np.arange(len(best)), best])


def nearest_inside(model: OpwRobot, branches: Array, old_joints: Array, limits: Array | None) -> Array:
    """As `nearest_solution`, but a solution inside the limits goes before a nearer one outside."""
    if limits is None:
        return nearest_solution(model, branches, old_joints)
    turned = nearest_turn(branches, old_joints[:, None, :], model.revolute)
    turned = np.where(turned > limits[:, 1] + ROUNDING, turned - 360.0 * model.revolute, turned)
    turned = np.where(turned < limits[:, 0] - ROUNDING, turned + 360.0 * model.revolute, turned)
    allowed = (outside(turned, limits) == 0.0).all(axis=-1)
    inside = np.where(allowed[..., None], turned, np.nan)
    travel = np.linalg.norm(inside - old_joints[:, None, :], axis=-1)
    best = np.argmin(np.where(np.isfinite(travel), travel, np.inf), axis=1)
    found = inside[np.arange(len(best)), best]
    any_inside = allowed.any(axis=1)[:, None]
    return np.asarray(np.where(any_inside, found, nearest_solution(model, branches, old_joints)))


def _unreached(
    cell: RobotCell, model: OpwRobot, tool2world: RigidTransform, tool2flange: RigidTransform, row: int
) -> Reason:
    """Say why a moved target has no joints."""
    world, tool, root = (p if p.single else p[row] for p in (tool2world, tool2flange, cell.robroot))
    if not (np.isfinite(world.translation).all() and np.isfinite(tool.translation).all()):
        return Reason("OUT_OF_REACH", "the moved pose is not a number")
    flange = replace(cell, robroot=root).flange2base(world, tool)
    return Reason("OUT_OF_REACH", f"out of reach: {model.reach_text(flange)}")


def _doubtful(cell: RobotCell, model: OpwRobot, joints: Array, old: Integers) -> Bools:
    """Which of n moved targets `_objection` may have something against."""
    doubtful = _near_singular(model, joints) | _accurate(cell, old)
    return np.asarray(doubtful | (outside(joints, cell.limits) > 0.0).any(axis=1))


def _objection(cell: RobotCell, model: OpwRobot, joints: Array, old_joints: Array, old: Integers) -> Reason | None:
    """Say why a moved target must not be written with these joints."""
    undetermined = _undetermined(model, joints, "moved")
    if undetermined is not None:
        return undetermined
    beyond = outside(joints, cell.limits)
    if cell.limits is not None and beyond.max() > 0.0:
        axis = int(np.argmax(beyond))
        low, high = cell.limits[axis]
        return Reason(
            "OUT_OF_LIMITS",
            f"axis {axis + 1} would stand at {joints[axis]:.3f} deg, outside its limits {low:g} .. {high:g} "
            f"(before: {old_joints[axis]:.3f})",
        )
    if _accurate(cell, old[None])[0]:
        margin = float(_scheme(cell).margins(model, joints[None]).min())
        if margin < ACCURATE:
            return Reason(
                "CONFIG_NOT_CHECKED",
                f"an absolutely accurate robot {margin:.2f} deg from a change of its configuration: "
                "joints from nominal lengths cannot decide it",
            )
    return None
