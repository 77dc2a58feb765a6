"""What a source and its reference tell of each spot beside its place: joints, robot, external axes, columns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from respot.calibration.covariates import Covariate, covariates_of
from respot.calibration.observations import Observations
from respot.calibration.spot_frames import spot_frames
from respot.geometry import IDENTITY
from respot.issues import Issue
from respot.kinematics.cell import Reason, RobotCell
from respot.kinematics.configuration import taught_joints
from respot.kinematics.from_backup import cell_of
from respot.kinematics.gravity import gravity_in_base
from respot.kinematics.model import RobotModel
from respot.kinematics.motion_chain import Chain, chains_of, standing
from respot.languages import LANGUAGES
from respot.program.moves import Move
from respot.program.poses import target_poses
from respot.program.robot import Robot
from respot.program.targets import Target, TargetKind
from respot.spots import Source
from respot.tables import Table
from respot.tables.columns import ANGLES, EXTERNAL, POSITION, QUATERNION
from respot.tolerance import AXIS_MOVES_DEG

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

#: Poses and joints of a table belong together where one tool explains all of them to this.
_SAME_TOOL_MM, _SAME_TOOL_DEG = 1.0, 0.5
_JOINT_FIELDS = {"krl": tuple(f"A{n}" for n in range(1, 7)), "rapid": tuple(f"rax_{n}" for n in range(1, 7))}


@dataclass(eq=False)
class SourceObservations:
    """Observations of a source's spots, ready to be paired with a reference's rows.

    Parameters
    ----------
    source : Source
        A backup, program or table.
    reference : Source or None
        Its table's columns go with the reference's rows; None where there is no reference.
    robot : RobotModel or None
        The model that the user named.
    constant : bool
        Keep columns that are the same everywhere.

    Attributes
    ----------
    issues : list of Issue
        What could not be used, and why.
    """

    source: Source
    reference: Source | None = None
    robot: RobotModel | None = None
    constant: bool = False
    issues: list[Issue] = field(default_factory=list)
    _approach: Array | None = field(init=False, default=None)

    def __post_init__(self) -> None:
        spots = self.source.spots
        plain = Observations(spots.positions, spots.rotations)
        if self.source.robot is not None:
            self._all = self._of_robot(plain, self.source.robot)
        elif self.source.table is not None:
            self._all = self._of_table(plain, self.source.table)
        else:
            self._all = plain
        if self.source.robot is not None:
            self._all = replace(self._all, frames=spot_frames(self.source.robot, list(spots.moves)))
        self._own = {**self._named(), **self._columns(self.source)}
        self._other = {} if self.reference is None else self._columns(self.reference)

    def of(self, source_rows: Sequence[int] | Rows, reference_rows: Sequence[int] | Rows | None = None) -> Observations:
        """Observations of paired rows; a column that both lists have is the reference's.

        Parameters
        ----------
        source_rows, reference_rows : (n,) int arrays
        """
        rows = np.asarray(source_rows, dtype=np.intp)
        found = self._all.rows(rows)
        columns = {name: column.rows(rows) for name, column in self._own.items()}
        other = None if self.reference is None else self.reference.table
        joints, measured, external = found.joints, found.measured_joints, found.external_axes
        if reference_rows is not None:
            theirs = np.asarray(reference_rows, dtype=np.intp)
            columns |= {name: column.rows(theirs) for name, column in self._other.items()}
            if other is not None:
                measured = other.measured_joints[theirs] if other.measured_joints is not None else measured
                if external is None and other.external_axes is not None:
                    external = other.external_axes[theirs]
                if joints is None and other.joints is not None and found.robot is not None:
                    taken = other.joints[theirs]
                    joints = taken if self._one_tool(found, taken, other.path) else None
        made = Observations(
            found.positions,
            found.rotations,
            joints,
            measured,
            found.robot,
            found.base2source,
            found.gravity,
            external,
            found.carried,
            self._with_approach(columns, rows),
            found.absolute_accuracy,
            found.motor_turns,
            found.frames,
        )
        return made

    def _named(self) -> dict[str, Covariate]:
        """Program, base and tool of each spot of a backup as groups; of columns with the same groups the first."""
        frames = self._all.frames
        found: dict[str, Covariate] = {}
        known: list[list[int]] = []
        for name, labels in ({} if frames is None else frames.columns).items():
            groups = [labels.index(label) for label in labels]
            if self.constant or (len(set(groups)) > 1 and groups not in known):
                found[name] = Covariate(name, "group", None, labels)
                known.append(groups)
        return found

    def _columns(self, source: Source) -> dict[str, Covariate]:
        table = source.table
        if table is None:
            return {}
        known = {"id", "unit", *POSITION, *ANGLES, *QUATERNION, *EXTERNAL}
        known |= {f"{kind}{axis}" for kind in ("j", "jm") for axis in range(1, 8)}
        found, unused = covariates_of(table.columns, table.numbers, tuple(known), constant=self.constant)
        self.issues += [
            Issue("COLUMN_NOT_USED", f"its column {name} {reason}", table.path) for name, reason in unused.items()
        ]
        return found

    def _with_approach(self, columns: dict[str, Covariate], rows: Rows) -> dict[str, Covariate]:
        """Columns with the side that each axis comes from by the program's own path, where no column tells it."""
        if self._approach is None or any(column.role == "approach" for column in columns.values()):
            return columns
        signs = self._approach[rows]
        made = {
            f"approach_a{axis + 1}": Covariate(f"approach_a{axis + 1}", "approach", signs[:, axis], None)
            for axis in range(signs.shape[1])
            if np.isfinite(signs[:, axis]).all() and np.ptp(signs[:, axis]) > 0.0
        }
        return {**columns, **made}

    # --- tables

    def _of_table(self, plain: Observations, table: Table) -> Observations:
        joints = table.joints
        if joints is None and self.reference is not None and self.reference.table is not None:
            if self.robot is not None and self.reference.table.joints is not None and plain.rotations is not None:
                return self._checked_pairwise(plain, table)
            return self._with(plain, table)
        if joints is None or self.robot is None:
            if joints is not None:
                self._say(
                    "JOINTS_NOT_USED", "has joints, and no robot is named: --robot tells the arm's effects", table.path
                )
            elif self.robot is not None:
                self._say("OPTION_UNUSED", "--robot is named, and no list has joints", table.path)
            return self._with(plain, table)
        if joints.shape[1] != self.robot.axes or not np.isfinite(joints).all():
            what = f"has {joints.shape[1]} joints for {self.robot.axes} axes, or rows without"
            self._say("JOINTS_NOT_USED", what, table.path)
            return self._with(plain, table)
        if plain.rotations is not None and not self._one_tool(plain, joints, table.path):
            return self._with(plain, table)
        return Observations(
            plain.positions,
            plain.rotations,
            joints,
            table.measured_joints,
            self.robot,
            external_axes=table.external_axes,
        )

    def _with(self, plain: Observations, table: Table) -> Observations:
        return Observations(plain.positions, plain.rotations, external_axes=table.external_axes)

    def _checked_pairwise(self, plain: Observations, table: Table) -> Observations:
        """Keep the robot for joints that stand in the reference's table."""
        return Observations(plain.positions, plain.rotations, robot=self.robot, external_axes=table.external_axes)

    def _one_tool(self, plain: Observations, joints: Array, path: str) -> bool:
        assert self.robot is not None and plain.rotations is not None  # noqa: S101 - asked before
        if joints.shape[1] != self.robot.axes or not np.isfinite(joints).all():
            what = f"has {joints.shape[1]} joints for {self.robot.axes} axes, or rows without"
            self._say("JOINTS_NOT_USED", what, path)
            return False
        flange = self.robot.forward(joints)
        tools = flange.inv() * RigidTransform.from_components(plain.positions, plain.rotations)
        places = np.asarray(tools.translation)
        middle = np.median(places, axis=0)
        apart = float(np.median(np.linalg.norm(places - middle, axis=1)))
        turned = float(np.degrees(np.median((tools.rotation.mean().inv() * tools.rotation).magnitude())))
        if apart <= _SAME_TOOL_MM and turned <= _SAME_TOOL_DEG:
            return True
        message = (
            f"its joints and poses do not belong together for {self.robot.name}: one tool explains them only to "
            f"{apart:.1f} mm and {turned:.2f} degrees; poses must be in the robot's base frame, and the robot the "
            "right one. The arm's effects are not tried"
        )
        self._say("JOINTS_NOT_USED", message, path)
        return False

    # --- backups

    def _of_robot(self, plain: Observations, robot: Robot) -> Observations:
        path = str(self.source.path)
        moves = list(self.source.spots.moves)
        if not moves:
            return plain
        if moves[0].external_tcp:
            self._say("JOINTS_NOT_USED", "the robot holds the part: the arm's effects are not tried", path)
            return plain
        cell = cell_of(robot.machine, robot.language, self.robot)
        if isinstance(cell, Reason):
            self._say("JOINTS_NOT_USED", f"no kinematic model, so the arm's effects are not tried: {cell}", path)
            return plain
        joints, chains = _joints_of(cell, robot, moves)
        known = np.isfinite(joints).all(axis=1)
        external = None
        if chains is not None and np.isfinite(chains.external).any():
            external = chains.external
        if not known.all():
            message = (
                f"{int((~known).sum())} of {len(moves)} spots have no status and turn (or confdata) that the model "
                "agrees with: joints are not known, and the arm's effects are not tried"
            )
            self._say("JOINTS_NOT_USED", message, path)
            return Observations(plain.positions, plain.rotations, external_axes=external)
        if cell.track is None:
            external = None  # the opening of a servo gun, or a positioner's: no rail
        self._approach = _approach(cell, robot, moves, joints)
        placed = cell if chains is None else standing(cell, chains)
        down = np.atleast_2d(gravity_in_base(placed))[0]
        first = placed.robroot if placed.robroot.single else placed.robroot[0]
        return Observations(
            plain.positions,
            plain.rotations,
            joints,
            None,
            cell.model,
            placed.robroot,
            np.asarray(first.rotation.apply(down)),
            external,
            cell.track.axis if cell.track is not None else None,
            absolute_accuracy=cell.absolute_accuracy,
            motor_turns=cell.motor_turns,
        )

    def _say(self, code: str, message: str, path: str) -> None:
        self.issues.append(Issue(code, message, path))


def _joints_of(cell: RobotCell, robot: Robot, moves: Sequence[Move]) -> tuple[Array, Chain | None]:
    """Joints (n, 6) that the targets' own configurations define, NaN where none does, and their chains."""
    fields = LANGUAGES[robot.language].configuration_fields
    joints = np.full((len(moves), 6), np.nan)
    rows: list[int] = []
    targets: list[Target] = []
    numbers: list[list[float]] = []
    for row, move in enumerate(moves):
        target = move.target
        if target is None or not target.components or move.offset is not None or move.tool_offset is not IDENTITY:
            continue
        own = [number for name in fields if (number := target.number(name)) is not None]
        if len(own) == len(fields):
            rows.append(row)
            targets.append(target)
            numbers.append(own)
    if not rows:
        return joints, None
    reasons, chains = chains_of(cell, [moves[row] for row in rows], targets, [target_poses(targets)])
    if not chains:
        return joints, None
    chain = chains[0]
    numbers = [own for own, reason in zip(numbers, reasons, strict=True) if reason is None]
    rows = [row for row, reason in zip(rows, reasons, strict=True) if reason is None]
    joints[rows], _ = taught_joints(standing(cell, chain), chain.tool2flange, chain.tool2world, np.array(numbers))
    return joints, chain if len(rows) == len(moves) else None


def _approach(cell: RobotCell, robot: Robot, moves: Sequence[Move], joints: Array) -> Array:
    """Sign of the last motion of each axis (n, 6): from the target before in the same routine; NaN where not known."""
    before: dict[int, Move] = {}
    for routine in robot.routines:
        last: Move | None = None
        for step in routine.steps:
            if isinstance(step, Move):
                if last is not None:
                    before[id(step)] = last
                last = step
            else:
                last = None
    previous = [before.get(id(move)) for move in moves]
    signs = np.full(joints.shape, np.nan)
    rows = [row for row, move in enumerate(previous) if move is not None]
    if not rows:
        return signs
    others = [move for move in previous if move is not None]
    start, _ = _joints_of(cell, robot, others)
    for number, move in enumerate(others):
        if move.target is not None and move.target.kind is TargetKind.JOINTS:
            start[number] = _joint_position(robot.language, move.target)
    way = joints[rows] - start
    # an axis that hardly moves keeps its side, which the path alone does not tell
    signs[rows] = np.where(np.abs(way) > AXIS_MOVES_DEG, np.sign(way), np.nan)
    return signs


def _joint_position(language: str, target: Target) -> Array:
    numbers = [target.number(name) for name in _JOINT_FIELDS[language]]
    return np.array([np.nan if number is None else float(number) for number in numbers])
