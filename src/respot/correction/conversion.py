"""A backup in, a corrected backup out: the function behind `respot convert`."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from respot import __version__
from respot.calibration.calibration import Calibration
from respot.calibration.report import report
from respot.calibration.source_fit import FitOptions, SourceFit, fit_source
from respot.calibration.stored import load_calibration, source_issues
from respot.correction.correction import Correction, correct
from respot.correction.image import Image, RigidImage
from respot.correction.images import image_of, refuse_other_state
from respot.correction.marks import mark_of, still_applied
from respot.correction.options import CorrectionOptions
from respot.correction.snap import SnappedImage
from respot.correction.written import tool_offset_of
from respot.issues import BadInputError, Issue
from respot.languages import LANGUAGES
from respot.languages.overlay import check_overlay
from respot.languages.writing import applied_calibrations, says_compensated, says_snapped
from respot.program.moves import Move
from respot.program.robot import Robot
from respot.spots import Source, read_source

#: Record of a conversion, in the output folder.
RECORD = "respot.json"


@dataclass(frozen=True, eq=False)
class Conversion:
    """What a conversion is going to write.

    Parameters
    ----------
    source : Source
        The backup.
    calibration : Calibration
        The model.
    fitted : SourceFit or None
        The fit it comes from; None where it was loaded.
    image : Image
        What became of each target.
    correction : Correction
        Edits, refusals, changed files.
    issues : sequence of Issue
        Everything noticed.
    """

    source: Source
    calibration: Calibration
    fitted: SourceFit | None
    image: Image
    correction: Correction
    issues: Sequence[Issue]

    @property
    def robot(self) -> Robot:
        """The robot that is converted."""
        return self.correction.robot

    @property
    def files(self) -> dict[str, bytes]:
        """Files of the robot as they were; of a backup with several robots only its own."""
        backup = self.source.backup
        assert backup is not None  # noqa: S101 - a conversion is made of a backup
        return backup.files_of(self.robot)

    def as_json(self) -> dict[str, Any]:
        """Record of INTERFACES.md, `convert`, without schema, version and issues."""
        correction = self.correction
        snaps = self.image.parts if isinstance(self.image, SnappedImage) else {}
        record: dict[str, Any] = {
            "direction": correction.direction,
            "robot": {"name": self.robot.name, "language": self.robot.language, "model": self.robot.machine.model},
            "calibration": {"hash": self.calibration.content_hash, "kind": self.calibration.kind},
            **self.image.record(),
            "edits": [
                {
                    "path": edit.path,
                    "line": edit.line,
                    "target": edit.target,
                    "depth": edit.depth,
                    "reason": edit.edit.reason,
                    "before": edit.before,
                    "after": edit.after,
                    "shift_mm": edit.shift_mm,
                    "turn_deg": edit.turn_deg,
                    **({"snap_mm": snaps.get((edit.path, edit.edit.span), 0.0)} if snaps else {}),
                }
                for edit in correction.edits
            ],
            "unmoved": [
                {"target": stay.target.name, "code": stay.code, "path": stay.target.path, "line": stay.target.line}
                for stay in correction.stays
            ],
            "transitions": [
                {"from": item.start, "to": item.end, "program": item.program, "path": item.path, "line": item.line}
                for item in correction.transitions
            ],
            "refused": [
                {"program": refusal.program, "target": refusal.target, "code": refusal.code, "message": refusal.message}
                for refusal in correction.refused
            ],
        }
        if self.fitted is not None:
            record["fit"] = report(self.fitted.fit)
        return record


def convert(
    source: Path,
    reference: Path | None,
    calibration: Path | None,
    fit_options: FitOptions,
    options: CorrectionOptions,
) -> Conversion:
    """Plan a conversion: fit or load the model, and correct every target in scope.

    Parameters
    ----------
    source : Path
        A backup or program.
    reference : Path or None
        What to fit to; None where ``calibration`` is given.
    calibration : Path or None
        A saved calibration.
    fit_options, options :
        What a person decided.

    Raises
    ------
    BadInputError
        Anything that makes a correct conversion impossible as a whole.
    """
    if options.templates is not None:
        check_overlay(options.templates)
    if reference is not None:
        fitted = fit_source(source, reference, fit_options)
        model, read, issues = fitted.fit.calibration, fitted.source, list(fitted.issues)
        ids: Sequence[str] = fitted.fit.ids
    else:
        assert calibration is not None  # noqa: S101 - the command line asks for one of both
        fitted, model = None, load_calibration(calibration)
        read = read_source(source, model.ids, fit_options.spot_id, fit_options.robot_name, fit_options.profiles)
        issues, ids = list(read.issues), model.ids
        if read.robot is None or not _says(read.robot, mark_of(model, inverse=not options.inverse)):
            issues += source_issues(model, read, any_robot=options.any_source, option="--force")
    if read.robot is None:
        raise BadInputError("NO_ROBOT", "is a table: only a backup or a program can be converted", str(source))
    in_tool = _offset_in_tool(read, model, options)
    if options.inverse:
        _refuse_snapped(read, read.robot)
    image = image_of(model, fitted, read, options, str(calibration or reference), in_tool)
    mark = mark_of(model, inverse=options.inverse)
    _refuse_recorded(read, _mark(mark, read.robot))
    if model.kind == "measured" and not options.inverse:
        _refuse_compensated(read, read.robot)
    _refuse_headed(read.robot, mark)
    if fitted is None and not options.inverse and not _says(read.robot, mark_of(model, inverse=True)):
        refuse_other_state(model, read, options, str(calibration))
    moves = _moves_of(read, ids)
    if not moves:
        detail = f": {read.spots.issues[0]}" if read.spots.issues else ""
        message = f"holds none of the spots that the calibration was fitted to{detail}"
        raise BadInputError("NO_COMMON_IDS", message, str(source))
    language = LANGUAGES[read.robot.language].with_plant(read.backup.profiles if read.backup is not None else ())
    correction = correct(read.robot, language, image, model.kind, mark, moves, options)
    if options.covariates is not None and isinstance(image, RigidImage | SnappedImage):
        message = "nothing uses --covariates: no effect of this calibration follows a column"
        issues.append(Issue("OPTION_UNUSED", message, str(options.covariates)))
    refused = [
        Issue(refusal.code, f"{refusal.target}: {refusal.message}", refusal.path, refusal.line)
        for refusal in correction.refused
    ]
    return Conversion(read, model, fitted, image, correction, [*issues, *refused, *correction.issues])


def _record(source: Source) -> Mapping[str, Any]:
    """The backup's own record, which an earlier conversion wrote; empty if there is none that can be read."""
    data = source.backup.files.get(RECORD) if source.backup is not None else None
    try:
        found = {} if data is None else json.loads(data)
    except ValueError:
        return {}
    return found if isinstance(found, dict) else {}


def _applied(source: Source) -> list[str]:
    """Hashes of the calibrations that the backup's own record says were applied to it."""
    applied = _record(source).get("applied", [])
    return [item for item in applied if isinstance(item, str)] if isinstance(applied, list) else []


def _says(robot: Robot, mark: str) -> bool:
    """Whether programs say that a calibration was applied to them: they are those of its robot, whatever its name."""
    return any(mark in applied_calibrations(file.source) for file in robot.files.values())


def _refuse_headed(robot: Robot, mark: str) -> None:
    for path, file in robot.files.items():
        if mark in applied_calibrations(file.source):
            message = "this calibration was applied to this file before: start from the original backup"
            raise BadInputError("ALREADY_APPLIED", message, path)


def _offset_in_tool(source: Source, calibration: Calibration, options: CorrectionOptions) -> bool | None:
    """Whether a tool offset that is taken out again stands in the tool's data; None of one that is put in.

    Raises
    ------
    BadInputError
        ``BAD_OPTION``: the record says that it stands elsewhere than ``--apply`` says, or nothing says where.
    """
    if tool_offset_of(calibration) is None:
        return None
    last, place = _record(source), str(source.path / RECORD)
    made = last.get("calibration")
    known = isinstance(made, dict) and made.get("hash") == calibration.content_hash
    if not options.inverse and last.get("direction") == ("align" if calibration.kind == "theory" else "compensate"):
        return None  # it is no way back, but twice the same
    edits = last.get("edits") if known else None
    frames = options.apply == "frames"
    if not isinstance(edits, list):
        if frames and options.inverse and calibration.kind == "measured":
            message = "nothing says that the tool data hold the offset of this calibration: no record of it is found"
            raise BadInputError("BAD_OPTION", f"--apply frames: {message}", place)
        return None
    depths = {edit.get("depth") for edit in edits if isinstance(edit, dict)}
    written = "the tool offset of this calibration was written into the"
    if "tool" in depths and not frames:
        raise BadInputError("BAD_OPTION", f"{written} tool data: add --apply frames", place)
    if frames and depths.isdisjoint(("tool", "base")):
        raise BadInputError("BAD_OPTION", f"{written} points: leave --apply frames out", place)
    return "tool" in depths


def _refuse_snapped(source: Source, robot: Robot) -> None:
    """Only the rigid part of snapped programs could be turned back: their welds were shifted one by one.

    Raises
    ------
    BadInputError
        ``BAD_OPTION``: the record, or a file's header, says that they were snapped.
    """
    place = str(source.path / RECORD) if _record(source).get("snap") else None
    place = place or next((path for path, file in robot.files.items() if says_snapped(file.source)), None)
    if place is not None:
        message = (
            "these programs were snapped onto a list: --inverse would turn back their rigid motion and leave what each "
            "weld was shifted by; start from the original backup, or use respot undo after --in-place"
        )
        raise BadInputError("BAD_OPTION", message, place)


def _refuse_compensated(source: Source, robot: Robot) -> None:
    """Compensated points no longer say where spots should be: compensating them aims at the wrong places.

    Raises
    ------
    BadInputError
        ``ALREADY_APPLIED``: the record, or a file's header, says that they are.
    """
    last = _record(source)
    calibration, files = last.get("calibration"), last.get("files")
    kind = calibration.get("kind") if isinstance(calibration, dict) else None
    if isinstance(files, dict) and files and not set(files) & set(robot.files):
        kind = None  # in place, the last conversion of a tree may have been that of another robot in it
    place = str(source.path / RECORD) if (last.get("direction"), kind) == ("compensate", "measured") else None
    headed = (path for path, file in robot.files.items() if says_compensated(file.source))
    place = place or next(headed, None)
    if place is not None:
        message = (
            "these programs were compensated before: their points no longer say where spots should be, and a fresh "
            "measurement does not tell it either. Start from the original backup, or turn it back with --inverse first"
        )
        raise BadInputError("ALREADY_APPLIED", message, place)


def _mark(mark: str, robot: Robot) -> str:
    """Return what the record says of a calibration that was applied; of several robots of one controller, to which."""
    return f"{mark} {robot.task}".rstrip()


def _refuse_recorded(source: Source, mark: str) -> None:
    if mark in _applied(source):
        message = "this calibration was applied to this backup before: start from the original"
        raise BadInputError("ALREADY_APPLIED", message, str(source.path / RECORD))


def _moves_of(source: Source, ids: Sequence[str]) -> list[Move]:
    wanted = set(ids)
    return [move for name, move in zip(source.spots.ids, source.spots.moves, strict=True) if name in wanted]


def record_of(conversion: Conversion) -> dict[str, Any]:
    """What ``respot.json`` holds: what was applied to what, so that a reader can check and never apply it twice."""
    correction, files = conversion.correction, conversion.files
    return {
        "schema": "respot.convert/1",
        "version": __version__,
        "source": str(conversion.source.path),
        "source_sha256": conversion.source.sha256,
        "verified": True,
        "applied": _applied_after(conversion),
        "issues": [issue.as_json() for issue in conversion.issues],
        "contents": {path: _sha256(correction.files.get(path, data)) for path, data in files.items()},
        "files": {
            path: {"before": _sha256(files[path]), "after": _sha256(data)} for path, data in correction.files.items()
        },
        **conversion.as_json(),
    }


def _applied_after(conversion: Conversion) -> list[str]:
    """Marks of all calibrations that are in force in what is written."""
    correction = conversion.correction
    own, others = list[str](), list[str]()
    for mark in _applied(conversion.source):
        (own if _mark(mark.partition(" ")[0], correction.robot) == mark else others).append(mark)
    kept = still_applied((mark.partition(" ")[0] for mark in own), correction.calibration_hash)
    return [*others, *(_mark(mark, correction.robot) for mark in (*kept, correction.calibration_hash))]


def _sha256(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
