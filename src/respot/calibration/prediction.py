"""Where each spot of a source will be in the reference frame, and how sure that is: behind `respot predict`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from respot.calibration.ball import SHARE, ball_radius
from respot.calibration.calibration import Calibration, CalibrationError
from respot.calibration.covariates import covariates_of
from respot.calibration.effects.moved import beyond, missing
from respot.calibration.observations import Observations
from respot.calibration.source_observations import SourceObservations
from respot.calibration.stored import arm_of, load_calibration, source_issues
from respot.geometry import abc_from_rotation
from respot.issues import BadInputError, Issue
from respot.kinematics.model import RobotModel
from respot.registration.rigid import transform_of
from respot.spots import Source, is_backup, read_source, spots_of_table
from respot.tables import Table, read_table

Array = NDArray[np.float64]

_MOST_LISTED = 20
_DRAWS_AT_ONCE = 200


@dataclass(frozen=True, eq=False)
class Prediction:
    """Predicted spots. All lengths mm.

    Attributes
    ----------
    ids : tuple of n str
    positions : (n, 3) array
        Reference frame.
    rotations : Rotation of n, or None
        Tool orientations in the reference frame.
    ci95 : (n,) array or None
        Radius of the ball that holds the true place of the model with 95 %: the uncertainty of the fitted parameters
        alone. None where the calibration does not say how sure it is.
    ci95_new : (n,) array or None
        The same for one new measurement of the spot: parameters and noise.
    leverage : (n,) array or None
        Variance by the parameters, as a share of the noise's.
    extrapolated : (n,) bool array or None
        Outside the hull of the fitted spots, or the range of what an effect follows: there the model was never tested,
        and intervals only say what follows from it.
    """

    ids: tuple[str, ...]
    positions: Array
    rotations: Rotation | None
    ci95: Array | None = None
    ci95_new: Array | None = None
    leverage: Array | None = None
    extrapolated: NDArray[np.bool_] | None = None

    def to_dict(self) -> list[dict[str, Any]]:
        """JSON values: one record a spot; what is not known is null."""
        angles = None if self.rotations is None else abc_from_rotation(self.rotations).reshape(-1, 3)
        rows = []
        for row, name in enumerate(self.ids):
            a, b, c = (None, None, None) if angles is None else angles[row].tolist()
            x, y, z = self.positions[row].tolist()
            rows.append(
                {
                    "id": name,
                    "x": x,
                    "y": y,
                    "z": z,
                    "a": a,
                    "b": b,
                    "c": c,
                    "ci95": None if self.ci95 is None else float(self.ci95[row]),
                    "ci95_new": None if self.ci95_new is None else float(self.ci95_new[row]),
                    "leverage": None if self.leverage is None else float(self.leverage[row]),
                    "extrapolated": None if self.extrapolated is None else bool(self.extrapolated[row]),
                }
            )
        return rows


def predict_spots(
    calibration: Calibration,
    ids: Sequence[str],
    positions: ArrayLike,
    rotations: Rotation | None = None,
    observations: Observations | None = None,
    *,
    share: float = SHARE,
    bootstrap: int = 0,
    seed: int = 0,
) -> Prediction:
    """Predict spots with intervals.

    Intervals hold given the model and the choice of inliers, for noise that is Gaussian and may differ by
    direction; a bootstrap takes the residuals themselves, and is a little too narrow for few spots.

    Parameters
    ----------
    calibration : Calibration
    ids : sequence of n str
    positions : (n, 3) array
        Source frame [mm].
    rotations : Rotation of n, optional
        Tool orientations in the source frame.
    observations : Observations of n, optional
        What else is known of the spots: needed for effects.
    share : float
        Probability of the ball, between 0 and 1.
    bootstrap : int
        Take intervals from this many refits to residuals drawn anew, instead of from the covariance.
    seed : int
        Of the draws.

    Raises
    ------
    CalibrationError
        As `Calibration.predict`; ``CALIBRATION_INCOMPLETE`` for a bootstrap of a calibration that does not hold its
        spots and residuals.
    """
    given = np.asarray(positions, dtype=np.float64).reshape(-1, 3)
    moved, turned = calibration.predict(given, rotations, observations)
    names, sure = tuple(ids), calibration.precision
    if bootstrap:
        radii = _bootstrap(calibration, given, share, bootstrap, seed)
    if sure is None:
        return Prediction(names, moved, turned)
    covariance = sure.covariance_of(moved, columns_at(calibration, given, rotations, turned, observations))
    if not bootstrap:
        free = sure.degrees_of_freedom
        radii = ball_radius(covariance, free, share), ball_radius(covariance + sure.noise, free, share)
    extrapolated = sure.outside(given)
    if observations is not None:
        for term in calibration.terms:
            extrapolated = extrapolated | beyond(observations, term)
    return Prediction(names, moved, turned, *radii, sure.leverage_of(covariance), extrapolated)


def columns_at(
    calibration: Calibration,
    points: Array,
    rotations: Rotation | None,
    turned: Rotation | None,
    observations: Observations | None,
) -> Array | None:
    """Shift (n, 3, k) of each spot per unit of each parameter of its effects, reference frame; None without effects.

    Parameters
    ----------
    calibration : Calibration
    points, rotations
        Source frame [mm].
    turned : Rotation of n, or None
        Tool orientations in the reference frame.
    observations : Observations of n, or None
    """
    if calibration.terms and observations is not None:
        return calibration.effect_columns(replace(observations, positions=points, rotations=rotations))
    return np.asarray(turned.as_matrix()) if calibration.tool_offset is not None and turned is not None else None


def _bootstrap(calibration: Calibration, points: Array, share: float, draws: int, seed: int) -> tuple[Array, Array]:
    """Radii (n,) by refits to residual vectors drawn with replacement, scaled to the noise; without and with noise."""
    sure = calibration.precision
    if sure is None or sure.residuals is None or calibration.tool_offset is not None or calibration.terms:
        message = "a bootstrap needs the spots and residuals of one rigid least-squares fit; the calibration has none"
        raise CalibrationError("CALIBRATION_INCOMPLETE", message)
    spots = sure.regions[0]
    residuals = sure.residuals - sure.residuals.mean(axis=0)
    residuals = residuals * np.sqrt(residuals.size / max(residuals.size - sure.parameters, 1))
    fitted, moved = calibration.predict(spots)[0], calibration.predict(points)[0]
    rng = np.random.default_rng(seed)
    shifts, news = [], []
    for start in range(0, draws, _DRAWS_AT_ONCE):
        count = min(_DRAWS_AT_ONCE, draws - start)
        drawn = fitted + residuals[rng.integers(len(spots), size=(count, len(spots)))]
        turns, moves = transform_of(np.broadcast_to(spots, drawn.shape), drawn)
        apart = points @ np.swapaxes(turns, 1, 2) + moves[:, None, :] - moved
        shifts.append(np.linalg.norm(apart, axis=2))
        news.append(np.linalg.norm(apart + residuals[rng.integers(len(spots), size=apart.shape[:2])], axis=2))
    radii = (np.quantile(np.concatenate(lengths), share, axis=0) for lengths in (shifts, news))
    alone, new = (np.asarray(radius, dtype=np.float64) for radius in radii)
    return alone, new


@dataclass(frozen=True)
class UseOptions:
    """Options of `predict_source` and of `respot.calibration.validation.validate_source`.

    Parameters
    ----------
    robot_name : str, optional
        Which robot of a backup with several.
    spot_id : str, optional
        Regular expression for spot IDs.
    profiles : sequence of Path
        A plant's instruction forms.
    robot : RobotModel, optional
        Kinematics for a table of joints without poses.
    any_robot : bool
        Use the calibration though the source is of another robot.
    """

    robot_name: str | None = None
    spot_id: str | None = None
    profiles: Sequence[Path] = ()
    robot: RobotModel | None = None
    any_robot: bool = False


@dataclass(frozen=True, eq=False)
class SourcePrediction:
    """A prediction with where it came from.

    Parameters
    ----------
    source : Source
    calibration : Calibration
    prediction : Prediction
    issues : sequence of Issue
    """

    source: Source
    calibration: Calibration
    prediction: Prediction
    issues: Sequence[Issue]


def predict_source(
    source_path: Path,
    calibration_path: Path,
    options: UseOptions,
    *,
    covariates: Path | None = None,
    bootstrap: int = 0,
    seed: int = 0,
) -> SourcePrediction:
    """Predict the spots of a backup, program or table by a stored calibration.

    Parameters
    ----------
    source_path, calibration_path : Path
    options : UseOptions
    covariates : Path, optional
        Table of columns that effects follow.
    bootstrap, seed : int
        As `predict_spots`.

    Raises
    ------
    BadInputError
        The source or calibration cannot be used, or they are of different robots.
    """
    calibration = load_calibration(calibration_path)
    source, issues = read_for(calibration, source_path, options)
    used, observations, found = seen_by(calibration, source, options, covariates)
    issues += found
    spots = source.spots
    try:
        prediction = predict_spots(
            used, spots.ids, spots.positions, spots.rotations, observations, bootstrap=bootstrap, seed=seed
        )
    except CalibrationError as error:
        raise refused(error, source_path, calibration_path) from error
    if prediction.ci95 is None:
        message = "does not say how sure it is, so no intervals: fit it again with this version"
        issues.append(Issue("NO_INTERVAL", message, str(calibration_path)))
    return SourcePrediction(source, calibration, prediction, [*issues, *extrapolated(prediction)])


def refused(error: CalibrationError, source_path: Path, calibration_path: Path) -> BadInputError:
    """What is said where a calibration cannot predict the spots of a source."""
    code = "NO_ORIENTATION" if error.code == "CALIBRATION_NEEDS_ORIENTATION" else "BAD_CALIBRATION"
    return BadInputError(code, str(error), str(source_path if code == "NO_ORIENTATION" else calibration_path))


def read_for(calibration: Calibration, path: Path, options: UseOptions) -> tuple[Source, list[Issue]]:
    """Read the spots of a source that a stored calibration is used on, and what is to be said about it.

    Raises
    ------
    BadInputError
        The source cannot be read, holds no spot, or is another robot's.
    """
    issues = []
    if is_backup(path) or options.robot is None:
        source = read_source(path, calibration.ids, options.spot_id, options.robot_name, options.profiles)
        if options.robot is not None and not calibration.terms:
            issues.append(Issue("OPTION_UNUSED", "--robot is for tables of joints; the programs tell poses", str(path)))
    else:
        source, used = table_of_joints(path, options.robot)
        if used.code != "OPTION_UNUSED" or not calibration.terms:  # effects of the arm need the robot as well
            issues.append(used)
    if not source.spots.ids:
        detail = f": {source.spots.issues[0]}" if source.spots.issues else "; --spot-id REGEX tells how they are named"
        raise BadInputError("NO_COMMON_IDS", f"holds no weld spot that can be used{detail}", str(path))
    found = source_issues(calibration, source, any_robot=options.any_robot)
    return source, [*source.issues, *issues, *found]


def table_of_joints(path: Path, robot: RobotModel) -> tuple[Source, Issue]:
    """Read a table with a robot at hand: it says where the flange is if the table has joints and no positions."""
    table = read_table(path)
    if table.xyz is not None or table.joints is None:
        message = "--robot is for tables of joints without positions; this one tells positions"
        return Source(path, spots_of_table(table), table.sha256, table=table), Issue(
            "OPTION_UNUSED", message, str(path)
        )
    missing = np.flatnonzero(~np.isfinite(table.joints).all(axis=1))
    if len(missing):
        row = int(missing[0])
        message = f"{table.ids[row]} has no joints; fill them in or delete the row"
        raise BadInputError("NOT_A_NUMBER", message, str(path), table.lines[row])
    if table.joints.shape[1] != robot.axes:
        message = f"has {table.joints.shape[1]} joints, and the robot has {robot.axes} axes"
        raise BadInputError("BAD_TABLE", message, str(path))
    flange = robot.forward(table.joints)
    every = [True] * len(table.ids)
    moved = replace(table, xyz=np.asarray(flange.translation), rotations=flange.rotation, oriented=every)
    message = "has joints and no positions: they are those of the flange in the robot's base, no tool is known"
    return Source(path, spots_of_table(moved), table.sha256, table=moved), Issue("TABLE_COLUMNS", message, str(path))


def seen_by(
    calibration: Calibration, source: Source, options: UseOptions, covariates: Path | None
) -> tuple[Calibration, Observations | None, list[Issue]]:
    """Observations of a source for the effects of a calibration, which are left out where these do not tell them.

    Parameters
    ----------
    calibration : Calibration
    source : Source
    options : UseOptions
    covariates : Path, optional
        Table of columns, joined by id.

    Returns
    -------
    (Calibration, Observations or None, list of Issue)
        The calibration without the effects that are left out; None without effects.
    """
    issues: list[Issue] = []
    table = None if covariates is None else read_table(covariates, pose_needed=False)
    if not calibration.terms:
        return calibration, None, [] if table is None else [_unused(table, source)]
    robot, other_arm = arm_of(calibration, options.robot, str(source.path), any_robot=options.any_robot)
    gathered = SourceObservations(source, None, robot, constant=True)
    observations = gathered.of(np.arange(len(source.spots.ids)))
    unused: Mapping[str, str] = {}
    if table is not None:
        observations, unused = _joined(observations, source, table)
    lacking = [term for term in calibration.terms if missing(observations, term)]
    for term in lacking:
        column = str(term.where.get("column", ""))
        why = "--covariates TABLE tells columns"
        if column in unused:
            why = f"{covariates}: its column {column} {unused[column]}"
        message = (
            f"{term.label} is left out: {missing(observations, term)} is not known ({why}); the intervals are as much "
            "wider"
        )
        issues.append(Issue("EFFECT_LEFT_OUT", message, str(source.path)))
    used = calibration.without(lacking)
    return used, observations, [*other_arm, *gathered.issues, *issues, *beyond_range(used, observations, source)]


def beyond_range(calibration: Calibration, observations: Observations, source: Source) -> list[Issue]:
    """One issue for each effect that is asked outside the range of what it follows."""
    issues = []
    for term in calibration.terms:
        count = int(beyond(observations, term).sum())
        if count:
            message = (
                f"{term.label} is used on {count} of {len(observations)} spots outside the range of "
                f"{term.own or 'angles'} that it was fitted to: there it is a guess, and intervals only say what "
                "follows from it"
            )
            issues.append(Issue("EXTRAPOLATED", message, str(source.path)))
    return issues


def _joined(observations: Observations, source: Source, table: Table) -> tuple[Observations, Mapping[str, str]]:
    """Observations with the columns of a table that names all spots of the source, and why columns cannot be used."""
    rows = {name.casefold(): row for row, name in enumerate(table.ids)}
    order = [rows.get(name.casefold(), -1) for name in source.spots.ids]
    if min(order, default=-1) < 0:
        lost = next(name for name, row in zip(source.spots.ids, order, strict=True) if row < 0)
        raise BadInputError("NO_COMMON_IDS", f"does not name the spot {lost}; give every spot a row", table.path)
    found, unused = covariates_of(table.columns, table.numbers, ("id", "x", "y", "z"), constant=True)
    taken = {name: column.rows(np.array(order)) for name, column in found.items()}
    measured = observations.measured_joints
    if measured is None and table.measured_joints is not None:
        measured = table.measured_joints[order]
    joined = replace(observations, columns={**observations.columns, **taken}, measured_joints=measured)
    return joined, unused


def _unused(table: Table, source: Source) -> Issue:
    """What is said of covariates where no effect follows a column."""
    names = {name.casefold() for name in table.ids}
    known = sum(name.casefold() in names for name in source.spots.ids)
    message = (
        f"nothing uses it: no effect of this calibration follows a column (it names {known} of {len(source.spots.ids)} "
        "spots); the prediction is the same without"
    )
    return Issue("OPTION_UNUSED", message, table.path)


def extrapolated(prediction: Prediction) -> list[Issue]:
    """One issue for all spots outside the hull of the fitted ones, or the range of what effects follow."""
    if prediction.extrapolated is None or prediction.leverage is None or not prediction.extrapolated.any():
        return []
    rows = np.flatnonzero(prediction.extrapolated)
    names = [prediction.ids[row] for row in rows]
    more = f" and {len(names) - _MOST_LISTED} more" if len(names) > _MOST_LISTED else ""
    worst = int(rows[np.argmax(prediction.leverage[rows])])
    message = (
        f"{len(names)} of {len(prediction.ids)} spots lie outside of what was fitted, where the model was "
        f"never tested: {', '.join(names[:_MOST_LISTED])}{more}; the highest leverage is "
        f"{prediction.leverage[worst]:.2g} at {prediction.ids[worst]}"
    )
    return [Issue("EXTRAPOLATED", message)]
