"""Which image a calibration makes of programs: a rigid motion, or effects that are solved for; or why none."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from respot.calibration.calibration import Calibration
from respot.calibration.covariates import covariates_of
from respot.calibration.source_fit import SourceFit
from respot.calibration.stored import arm_of
from respot.correction.columns import SpotColumns
from respot.correction.compensation import Cell, Choice, Compensation
from respot.correction.image import Image, RigidImage
from respot.correction.options import CorrectionOptions
from respot.correction.snap import snapped
from respot.correction.written import Split, split, tool_offset_of
from respot.issues import BadInputError
from respot.kinematics.cell import Reason, RobotCell
from respot.kinematics.from_backup import cell_of
from respot.kinematics.opw import OpwRobot
from respot.languages import LANGUAGES
from respot.spots import Source
from respot.tables import read_table


def image_of(
    calibration: Calibration,
    fitted: SourceFit | None,
    source: Source,
    options: CorrectionOptions,
    path: str,
    in_tool: bool | None = None,
) -> Image:
    """Choose the image.

    Parameters
    ----------
    calibration : Calibration
    fitted : SourceFit or None
        The fit it comes from; None where it was loaded.
    source : Source
        What is converted.
    options : CorrectionOptions
    path : str
        The calibration, or the reference that it was fitted to, for messages.
    in_tool : bool or None
        Whether a tool offset that is taken out again stands in the tool's data; None where nothing says.

    Raises
    ------
    BadInputError
        Nothing can be written, or not rightly.
    """
    if tool_offset_of(calibration) is not None and calibration.kind == "theory" and options.apply is None:
        message = (
            "the calibration has a tool offset, and what becomes of it is for you to say: --apply frames corrects the "
            "tool data and the points, --apply points the points alone, for a simulation that brings its own tool"
        )
        raise BadInputError("BAD_OPTION", message, path)
    effects = bool(calibration.terms) or calibration.tool_offset is not None
    if options.snap:
        return _snapped(calibration, fitted, options, path)
    if not effects:
        return _rigid(calibration, options)
    parts = split(calibration, path, inverse=options.inverse)
    cell = _cell(calibration, parts, fitted, source, options)
    choice = Choice(options.inverse, options.bases, options.max_residual, in_tool)
    return Compensation(cell, calibration, parts, choice)


def _snapped(calibration: Calibration, fitted: SourceFit | None, options: CorrectionOptions, path: str) -> Image:
    """Refuse what --snap cannot be joined with.

    Raises
    ------
    BadInputError
        ``BAD_OPTION``, and as `respot.correction.snap.snapped`.
    """
    reason = ""
    if fitted is None or calibration.kind != "theory":
        reason = "takes the positions of the list that is fitted to: give it with --theory"
    elif options.inverse:
        reason = "and --inverse are opposites: the list says where spots should be, not where the floor has them"
    elif options.apply == "frames":
        reason = "shifts each weld by itself, which no base or tool can: leave --apply frames out"
    elif options.partial:
        reason = "takes programs whole: a point that --partial leaves behind tears the path that is blended"
    elif calibration.terms or calibration.tool_offset is not None:
        reason = (
            "shifts welds by whatever the rigid motion leaves, effects would be in it twice: leave --effects out, and "
            "put their causes right first"
        )
    if reason or fitted is None:
        raise BadInputError("BAD_OPTION", f"--snap {reason}", path)
    return snapped(RigidImage(calibration.source2reference, "align"), fitted, options.max_residual)


def _rigid(calibration: Calibration, options: CorrectionOptions) -> Image:
    if calibration.kind == "theory":
        if options.inverse:
            return RigidImage(calibration.source2reference.inv(), "compensate")
        return RigidImage(calibration.source2reference, "align")
    if calibration.frame == "same":  # both frames claim to be one: the rigid part is how far the robot is off
        if options.inverse:
            return RigidImage(calibration.source2reference, "align")
        return RigidImage(calibration.source2reference.inv(), "compensate")
    message = (
        "a measured reference without effects registers two coordinate systems and has nothing to compensate; "
        "to move programs onto another list of spots, give it with --theory"
    )
    raise BadInputError("BAD_OPTION", message)


def refuse_other_state(calibration: Calibration, source: Source, options: CorrectionOptions, path: str) -> None:
    """Refuse a calibration of other programs: it holds for the programs, tools and bases that it was fitted to.

    Raises
    ------
    BadInputError
        ``ANOTHER_SOURCE``
    """
    stated = calibration.provenance.get("source_sha256")
    effects = bool(calibration.terms) or calibration.tool_offset is not None
    if options.any_source or stated == source.sha256 or (stated is None and not effects):
        return
    first = calibration.provenance.get("source", "an unnamed source")
    joints = "joints, " if effects else ""
    message = (
        f"the calibration was fitted to another state of the programs ({first}); it holds for the {joints}tools and "
        "bases of that one. Fit again on this backup, or say --force if you know that it holds here"
    )
    raise BadInputError("ANOTHER_SOURCE", message, path)


def _cell(
    calibration: Calibration,
    parts: Split,
    fitted: SourceFit | None,
    source: Source,
    options: CorrectionOptions,
) -> Cell:
    """What is known of the robot and its spots.

    Raises
    ------
    BadInputError
        The arm matters, and no model of it is known, or its controller compensates it already.
    """
    robot, spots = source.robot, source.spots
    assert robot is not None  # noqa: S101 - asked before
    if any(move.external_tcp for move in spots.moves):
        message = "the robot holds the part: effects of a gun on the robot are not written into its points"
        raise BadInputError("EXTERNAL_TCP", message, str(source.path))
    arm, _ = arm_of(calibration, options.robot, str(source.path), any_robot=options.any_source)
    kinematics = cell_of(robot.machine, robot.language, arm if arm is not None else options.robot)
    if parts.of_the_arm:
        _check_arm(kinematics, parts, str(source.path))
    named: Mapping[int, str] = {
        id(move.target): name for name, move in zip(spots.ids, spots.moves, strict=True) if move.target is not None
    }
    language = LANGUAGES[robot.language].with_plant(source.backup.profiles if source.backup is not None else ())
    return Cell(robot, language, kinematics, named, _columns(fitted, options.covariates))


def _check_arm(kinematics: RobotCell | Reason, parts: Split, path: str) -> None:
    names = ", ".join(parts.written)
    if isinstance(kinematics, Reason) or not isinstance(kinematics.model, OpwRobot):
        why = kinematics.message if isinstance(kinematics, Reason) else "its wrist is not spherical"
        message = (
            f"effects of the arm ({names}) need the joints of every target, and no kinematic model is known: {why}; "
            "name the robot with --robot"
        )
        raise BadInputError("NO_KINEMATICS", message, path)
    if kinematics.absolute_accuracy:
        message = (
            f"the controller compensates the arm's own errors, and the calibration has effects of the arm ({names}): "
            "they would be corrected twice. Fit again; on such a robot effects of the arm are not looked for"
        )
        raise BadInputError("ABSOLUTE_ACCURACY", message, path)


def _columns(fitted: SourceFit | None, covariates: Path | None) -> SpotColumns:
    """What tables say of spots: of ``--covariates``, else of the reference that was fitted to."""
    if covariates is not None:
        table = read_table(covariates, pose_needed=False)
        found, _ = covariates_of(table.columns, table.numbers, ("id", "x", "y", "z"), constant=True)
        return SpotColumns(table.ids, found)
    seen = None if fitted is None else fitted.fit.observations
    if fitted is None or seen is None or len(seen) != len(fitted.fit.ids):
        return SpotColumns()
    return SpotColumns(fitted.fit.ids, seen.columns)
