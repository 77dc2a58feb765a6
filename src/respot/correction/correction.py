"""A calibration, a robot and its matched spots become edits; what cannot be corrected refuses its program."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from itertools import pairwise

import numpy as np
from scipy.spatial import KDTree
from scipy.spatial.transform import RigidTransform

from respot import __version__
from respot.calibration.region import outside
from respot.correction.changeable import Changeable
from respot.correction.configuration import configure
from respot.correction.depth import Depth, depth_of, frame_edit
from respot.correction.image import Image
from respot.correction.marks import still_applied
from respot.correction.options import CorrectionOptions
from respot.correction.points import (
    PointEdit,
    move_at_all,
    offset_edit,
    point_edits,
    printed_poses,
)
from respot.correction.pose_table import PoseTable
from respot.correction.preflight import Checked, Preflight
from respot.correction.scope import Moving, Refusal, Scope, Stay, find_scope
from respot.correction.sequence import sequences
from respot.geometry import Array, batch, distance_mm, turn_deg
from respot.issues import BadInputError, Issue
from respot.kinematics.cell import Reason, RobotCell
from respot.kinematics.from_backup import cell_of
from respot.languages import LANGUAGES, Language
from respot.languages.writing import Header, applied_calibrations, templates
from respot.program.moves import Move
from respot.program.poses import spot_poses, target_poses
from respot.program.robot import Robot
from respot.source import Edit, splice

#: What `--keep-config` may override: not a pose that the robot cannot reach.
_KEPT = frozenset(("CONFIG_NOT_CHECKED", "CONFIG_INCONSISTENT", "UNKNOWN_TOOL"))


@dataclass(frozen=True)
class Transition:
    """A motion from a moved to an unmoved target or back: its path changes, nobody checked it."""

    start: str
    end: str
    program: str
    path: str
    line: int


@dataclass(frozen=True, eq=False)
class Correction:
    """What a correction changes.

    Parameters
    ----------
    robot : Robot
        The robot.
    language : Language
        Its language.
    direction : str
        ``align`` or ``compensate``.
    calibration_hash : str
        Hash of the calibration.
    scope : Scope
        What moves and what stays.
    edits : sequence of PointEdit
        Changed literals.
    refused : sequence of Refusal
        What cannot be corrected.
    refused_programs : frozenset of str
        Programs that stay as they were.
    depth : Depth
        Tools and bases that change with them.
    transitions : sequence of Transition
        Motions between moved and unmoved targets.
    goals : mapping of int to RigidTransform
        New ``target2base`` of each target that moves, under the old bases and tools, by `id` of the target.
    offsets : mapping of int to (3,) array
        New offsets along the base of motions, under the old bases [mm], by `id` of the motion.
    files : mapping of str to bytes
        The changed files.
    reconfigured : bool
        Status/turn or confdata of all moved targets were computed anew; otherwise they were kept unchecked.
    issues : sequence of Issue
        What a person should know.
    """

    robot: Robot
    language: Language
    direction: str
    calibration_hash: str
    scope: Scope
    edits: Sequence[PointEdit]
    refused: Sequence[Refusal]
    refused_programs: frozenset[str]
    depth: Depth
    transitions: Sequence[Transition]
    goals: Mapping[int, RigidTransform]
    offsets: Mapping[int, Array]
    files: Mapping[str, bytes]
    reconfigured: bool
    issues: Sequence[Issue]

    @property
    def stays(self) -> Sequence[Stay]:
        """Targets that stay."""
        return self.scope.stays


def correct(
    robot: Robot,
    language: Language,
    image: Image,
    kind: str,
    calibration_hash: str,
    spot_moves: Sequence[Move],
    options: CorrectionOptions,
) -> Correction:
    """Write programs whose targets are the image of the old ones.

    Parameters
    ----------
    robot : Robot
        The robot.
    language : Language
        Its language, with the instruction forms that the robot was read with.
    image : Image
        What becomes of each target.
    kind : str
        ``theory`` or ``measured``: what the calibration's reference is.
    calibration_hash : str
        What tells this calibration, and the way it is applied, from others.
    spot_moves : sequence of Move
        Motions of the matched spots that the model was fitted to.
    options : CorrectionOptions
        What a person decided.

    Raises
    ------
    BadInputError
        ``BAD_OPTION``
    """
    _check_options(robot, options)
    scope = find_scope(robot, spot_moves, options.programs)
    changeable = Changeable(robot, scope) if options.apply == "frames" else None
    unseen = image.see(scope, changeable)
    depth = Depth() if changeable is None else depth_of(scope, image, changeable)
    new = _new_poses(scope, image, depth)
    moving, after = new.moving, new.after
    refused = [*scope.refusals, *unseen, *_too_far(moving, after, options.furthest(kind))]
    cell = cell_of(robot.machine, robot.language, options.robot)
    printed = _printed(robot, language, moving, after)
    configured = _configure(cell, moving, printed, language, options, refused)
    flight = Preflight(cell, robot, language, scope, printed, image.offset)
    together = [*(item.programs for item in scope.moving), *(change.programs for change in depth.changes.values())]
    checked, kept, refused_programs = _preflight(flight, together, moving, options, refused)
    edits = _edits(robot, language, options, kept, moving, after, new.written, configured, scope, image, depth)
    moved = {id(item.target) for item in moving if not kept.holds(item) and id(item.target) in new.shifted}
    header = _Header(image.direction, kind, calibration_hash)
    return Correction(
        robot=robot,
        language=language,
        direction=image.direction,
        calibration_hash=calibration_hash,
        scope=scope,
        edits=edits,
        refused=refused,
        refused_programs=refused_programs,
        depth=depth,
        transitions=_transitions(robot, scope, moved, refused_programs),
        offsets={id(move): image.offset(move) for move in _turning(scope, kept)},
        goals=after.only([id(item.target) for item in moving if not kept.holds(item)]),
        files=_changed_files(robot, language, options, edits, header),
        reconfigured=all(id(item) in configured for item in moving if language.has_configuration(item.target)),
        issues=[*_issues(robot, cell, scope, moving, spot_moves, edits), *image.issues, *depth.issues, *checked.issues],
    )


@dataclass(frozen=True)
class _Header:
    direction: str
    kind: str
    calibration_hash: str


class _Kept:
    """Tells what a refusal keeps as it was."""

    def __init__(self, refused: Iterable[Refusal], programs: frozenset[str], partial: bool) -> None:
        self._targets = {(refusal.program, refusal.target.lower()) for refusal in refused}
        self._programs = programs
        self._partial = partial

    def __call__(self, programs: Collection[str], target: str) -> bool:
        if self._partial:
            relative = target == str(None) and any(program in programs for program, _ in self._targets)
            return relative or any((program, target.lower()) in self._targets for program in programs)
        return any(program in self._programs for program in programs)

    def holds(self, item: Moving) -> bool:
        """Whether a target stays as it was; the original of a touched-up target stays with it."""
        names = [name for name in (item.target.name, item.target.original_of) if name]
        return any(self(item.programs, name) for name in names)


def _check_options(robot: Robot, options: CorrectionOptions) -> None:
    wanted = options.programs
    if wanted is not None and not any(fnmatchcase(name.lower(), wanted.lower()) for name in robot.programs):
        known = ", ".join(robot.programs[:10])
        raise BadInputError("BAD_OPTION", f"--programs {wanted} fits no program; there are {known}")


@dataclass(frozen=True, eq=False)
class _New:
    """New poses of everything in scope, by `id` of the target.

    Parameters
    ----------
    moving : sequence of Moving
        What gets other numbers: where a tool changes and the base that was taught with it stays, numbers change though
        nothing moves.
    shifted : frozenset of int
        Targets that move at all.
    after, written : PoseTable
        New ``target2base`` under the old frames, and under those that are written.
    """

    moving: Sequence[Moving] = ()
    shifted: frozenset[int] = frozenset()
    after: PoseTable = field(default_factory=PoseTable)
    written: PoseTable = field(default_factory=PoseTable)


def _new_poses(scope: Scope, image: Image, depth: Depth) -> _New:
    if not scope.moving:
        return _New()
    keys = [id(item.target) for item in scope.moving]
    before, after = target_poses([item.target for item in scope.moving]), image.poses(scope.moving)
    written = depth.targets(scope.moving, after)
    shifted = move_at_all(before, after)
    changed = shifted | move_at_all(before, written)
    return _New(
        [item for item, changes in zip(scope.moving, changed, strict=True) if changes],
        frozenset(key for key, moves in zip(keys, shifted, strict=True) if moves),
        PoseTable(keys, after),
        PoseTable(keys, written),
    )


def _printed(robot: Robot, language: Language, moving: Sequence[Moving], after: PoseTable) -> PoseTable:
    """New poses as they will be printed, by `id` of the target."""
    if not moving:
        return PoseTable()
    targets = [item.target for item in moving]
    keys = [id(target) for target in targets]
    return PoseTable(keys, printed_poses(targets, after.of(keys), robot.files, language))


def _too_far(moving: Sequence[Moving], after: PoseTable, limits: tuple[float, float]) -> list[Refusal]:
    if not moving:
        return []
    furthest, widest = limits
    old, new = target_poses([item.target for item in moving]), after.of([id(item.target) for item in moving])
    shifts, turns = distance_mm(old, new), turn_deg(old, new)
    found = []
    for row in np.flatnonzero((shifts > furthest) | (turns > widest)).tolist():
        message = (
            f"would move {shifts[row]:.1f} mm and {turns[row]:.2f} degrees; --max-shift allows {furthest:g},{widest:g}"
        )
        found += moving[row].refusals("SHIFT_TOO_LARGE", message)
    return found


def _configure(
    cell: RobotCell | Reason,
    moving: Sequence[Moving],
    after: PoseTable,
    language: Language,
    options: CorrectionOptions,
    refused: list[Refusal],
) -> dict[int, Mapping[str, float]]:
    """Configurations by target; targets without one are added to ``refused``."""
    carrying = [item for item in moving if language.has_configuration(item.target)]
    if not carrying:
        return {}
    results = configure(cell, language, carrying, after.of([id(item.target) for item in carrying]))
    found: dict[int, Mapping[str, float]] = {}
    for item, result in zip(carrying, results, strict=True):
        if not result.code:
            found[id(item)] = result.values
        elif not (options.keep_config and result.code in _KEPT):
            refused += item.refusals(result.code, f"{result.message}{_hint(result.code)}")
    return found


def _hint(code: str) -> str:
    return "; --keep-config keeps the old values" if code in _KEPT else ""


def _preflight(
    flight: Preflight,
    together: Sequence[Collection[str]],
    moving: Sequence[Moving],
    options: CorrectionOptions,
    refused: list[Refusal],
) -> tuple[Checked, _Kept, frozenset[str]]:
    """Check what is going to be written; a refused program stays, and what remains is checked again."""
    while True:
        programs = _refused_programs(together, refused) if not options.partial else frozenset[str]()
        kept = _Kept(refused, programs, options.partial)
        checked = flight.check({id(item.target) for item in moving if not kept.holds(item)})
        known = {(refusal.program, refusal.target, refusal.code) for refusal in refused}
        found = [
            replace(refusal, message=f"{refusal.message}{_hint(refusal.code)}")
            for refusal in checked.refusals
            if (refusal.program, refusal.target, refusal.code) not in known
            and not (options.keep_config and refusal.code in _KEPT)
        ]
        if not found:
            return checked, kept, programs
        refused += found


def _refused_programs(together: Sequence[Collection[str]], refused: Iterable[Refusal]) -> frozenset[str]:
    """Programs with a refusal, and all that share a moved target, or a changed frame, with one of them."""
    programs = {refusal.program for refusal in refused}
    growing = True
    while growing:
        more = {name for group in together if not programs.isdisjoint(group) for name in group} - programs
        programs |= more
        growing = bool(more)
    return frozenset(programs)


def _edits(
    robot: Robot,
    language: Language,
    options: CorrectionOptions,
    kept: _Kept,
    moving: Sequence[Moving],
    after: PoseTable,
    new: PoseTable,
    configured: Mapping[int, Mapping[str, float]],
    scope: Scope,
    image: Image,
    depth: Depth,
) -> list[PointEdit]:
    made = templates(language.name, options.templates)
    edits: list[PointEdit | None] = []
    written = [item for item in moving if not kept.holds(item)]
    if written:
        poses = new.of([id(item.target) for item in written])
        edits += point_edits(written, poses, configured, robot.files, language, made)
    # one offset that a call hands to a routine with several motions is one literal
    offsets = {(move.offset.path, move.offset.span): move for move in _turning(scope, kept) if move.offset is not None}
    edits += [
        offset_edit(move, depth.offset(move, image.offset(move)), robot.files[move.offset.path].source.text, made)
        for move in offsets.values()
        if move.offset is not None
    ]
    edits += [
        frame_edit(change, after, robot, language, made)
        for change in depth.changes.values()
        if not kept(change.programs, str(change.frame))
    ]
    return [edit for edit in edits if edit is not None]


def _turning(scope: Scope, kept: _Kept) -> list[Move]:
    """Motions whose offset along the base turns with what it starts from."""
    return [
        move
        for move in scope.offsets
        if not kept((move.program,), str(move.target)) and move.offset is not None and move.base2spots is not None
    ]


def _changed_files(
    robot: Robot, language: Language, options: CorrectionOptions, edits: Sequence[PointEdit], header: _Header
) -> dict[str, bytes]:
    made = templates(language.name, options.templates)
    by_path: dict[str, list[Edit]] = {}
    for edit in edits:
        by_path.setdefault(edit.path, []).append(edit.edit)
    files: dict[str, bytes] = {}
    for path, changes in by_path.items():
        file = robot.files[path]
        place = language.header_place(file)
        if place is not None:
            earlier = tuple(sorted(still_applied(applied_calibrations(file.source), header.calibration_hash)))
            said = Header(
                version=__version__,
                direction=header.direction,
                kind=header.kind,
                source_sha256=file.source.sha256,
                calibration_sha256=header.calibration_hash,
                earlier=earlier,
                snapped=options.snap,
            )
            changes = [*changes, Edit(place, made.header(said, file.source.newline), "header")]
        files[path] = file.source.encode(splice(file.source.text, changes))
    return files


def _transitions(robot: Robot, scope: Scope, moved: set[int], refused_programs: frozenset[str]) -> list[Transition]:
    """Motions between moved and unmoved targets, in the order in which routines in scope call each other."""
    found: dict[tuple[str, str, str, int], Transition] = {}
    for sequence in sequences(robot, scope.routines):
        for first, second in pairwise(move for move in sequence if move.target is not None):
            shifted = [id(m.target) in moved and m.program not in refused_programs for m in (first, second)]
            if shifted[0] != shifted[1]:
                item = Transition(str(first.target), str(second.target), second.program, second.path, second.line)
                found.setdefault((item.start, item.end, item.path, item.line), item)
    return list(found.values())


def _issues(
    robot: Robot,
    cell: RobotCell | Reason,
    scope: Scope,
    moving: Sequence[Moving],
    spot_moves: Sequence[Move],
    edits: Sequence[PointEdit],
) -> list[Issue]:
    issues = [Issue("NOT_CHECKED", "collisions are never checked: simulate or step through the programs before use")]
    unchecked = (f"reach, limits and joint travel: {cell}",) if isinstance(cell, Reason) else cell.notes
    issues += [Issue("NOT_CHECKED", note) for note in unchecked]
    left = [stay.target.name for stay in scope.stays if stay.code == "SAME_BASE_STAYS"]
    if left:
        names = ", ".join(left[:10]) + (" ..." if len(left) > 10 else "")
        message = "no routine that belongs to a matched spot goes there; --programs takes their programs in"
        issues.append(Issue("SAME_BASE_STAYS", f"{names}: {message}"))
    issues += _extrapolated(moving, spot_moves)
    for path in dict.fromkeys(edit.path for edit in edits):
        if LANGUAGES[robot.language].header_place(robot.files[path]) is None:
            issues.append(Issue("NOT_CHECKED", "has no head line: it carries no header that says it was changed", path))
    return issues


def _extrapolated(moving: Sequence[Moving], spot_moves: Sequence[Move]) -> list[Issue]:
    """One issue for all moved targets outside the hull of the fitted spots."""
    fitted = [move for move in spot_moves if move.has_spot_pose]
    if not moving or not fitted:
        return []
    spots = np.asarray(spot_poses(fitted).translation)
    # the target itself: where a motion shifts it to may be known only while the robot runs
    places = batch([item.base2spots for item in moving]) * target_poses([item.target for item in moving])
    points = np.asarray(places.translation)
    beyond = outside(spots, points)
    if not beyond.any():
        return []
    nearest = np.asarray(KDTree(spots).query(points[beyond])[0])
    names = [item.target.name for item, out in zip(moving, beyond, strict=True) if out]
    farthest = names[int(nearest.argmax())]
    message = (
        f"{int(beyond.sum())} of {len(points)} moved targets lie outside the hull of the {len(spots)} fitted spots; "
        f"the farthest is {farthest}, {float(nearest.max()):.0f} mm from the nearest spot"
    )
    return [Issue("EXTRAPOLATED", message)]
