"""Fits what a source holds to a reference: the function behind `respot fit`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from respot import __version__
from respot.calibration.calibration import Frame, Kind
from respot.calibration.causes import Written, names_of
from respot.calibration.effects import swapped_ids, tool_offset, wrong_frame
from respot.calibration.effects.readings import Columns
from respot.calibration.effects.search import RIGID_ONLY, Effects
from respot.calibration.effects.tool_fit import moved_by
from respot.calibration.fit import fit_tables
from respot.calibration.holdout import Split, judged, split_off
from respot.calibration.prediction import table_of_joints
from respot.calibration.repeats import noise_from_repeats
from respot.calibration.source_observations import SourceObservations
from respot.calibration.spot_fit import Method, Orientations, SpotFit, Weights
from respot.calibration.stored import robot_identity
from respot.issues import BadInputError, Issue
from respot.kinematics.model import RobotModel
from respot.registration.errors import RegistrationError
from respot.registration.matching import Matching
from respot.spots import Source, is_backup, read_source
from respot.tables import Table, read_table

#: Repeats tell the noise with this many degrees of freedom or more.
_LEAST_REPEATS = 15
#: At most this many spots are listed one by one in issues.
_MOST_LISTED = 20


@dataclass(frozen=True)
class FitOptions:
    """Options of `fit`.

    Parameters
    ----------
    kind : str
        ``"theory"`` or ``"measured"``: what the reference is.
    frame : str, optional
        ``"same"`` or ``"free"``; by default that of the kind.
    robot_name, reference_robot_name : str, optional
        Which robot of a backup with several.
    spot_id : str, optional
        Regular expression for spot IDs.
    noise : float, optional
        Known standard deviation of the reference per coordinate, mm.
    seed : int
        Of everything that is drawn.
    method : str
        ``"robust"``, ``"paper"`` or ``"affine"``.
    tau : float, optional
        Of the method "paper": largest residual of an inlier by its largest coordinate, mm.
    n_min : int, optional
        Of the method "paper": a subset qualifies with more inliers than this outside of it.
    match : str
        ``"auto"``, ``"id"`` or ``"geometry"``: how spots are paired.
    profiles : sequence of Path
        A plant's instruction forms.
    effects : "auto" or names
        Effects to look for.
    robot : RobotModel, optional
        Kinematics for a table's joints, or in the place of the backup's own.
    progress : callable
        Called as the search for effects goes on.
    holdout : float or Path, optional
        Share of the pairs, or a table of the spots, that take no part and are judged by the fit of the others.
    weights : "even" or "direction"
        Of the final rigid fit; see `respot.calibration.fit.fit_spots`.
    orientations : "compare" or "fit"
        Likewise.
    """

    kind: Kind = "theory"
    frame: Frame | None = None
    robot_name: str | None = None
    spot_id: str | None = None
    noise: float | None = None
    seed: int = 0
    method: Method = "robust"
    tau: float | None = None
    n_min: int | None = None
    match: Matching = "auto"
    profiles: Sequence[Path] = ()
    effects: Effects = RIGID_ONLY
    robot: RobotModel | None = None
    progress: Callable[[], None] = lambda: None
    holdout: float | Path | None = None
    weights: Weights = "even"
    orientations: Orientations = "compare"


@dataclass(frozen=True, eq=False)
class SourceFit:
    """A fit with where it came from.

    Parameters
    ----------
    source, reference : Source
        What was compared.
    fit : SpotFit
        The fit.
    issues : sequence of Issue
        What was noticed on the way.
    """

    source: Source
    reference: Source
    fit: SpotFit
    issues: Sequence[Issue]


def fit_source(source_path: Path, reference_path: Path, options: FitOptions) -> SourceFit:
    """Fit the spots of a backup, program or table to those of a reference.

    Raises
    ------
    BadInputError
        The source or reference cannot be used, or they do not determine a transform.
    """
    reference = read_source(reference_path, spot_id=options.spot_id, profiles=options.profiles)
    wanted = read_table(options.holdout, pose_needed=False) if isinstance(options.holdout, Path) else options.holdout
    listed = [*reference.spots.ids, *(wanted.ids if isinstance(wanted, Table) else ())]
    source = _source_of(source_path, listed, options)
    for side, path in ((source, source_path), (reference, reference_path)):
        if not side.spots.ids:
            detail = f": {side.spots.issues[0]}" if side.spots.issues else "; --spot-id REGEX tells how they are named"
            raise BadInputError("NO_COMMON_IDS", f"holds no weld spot that can be used{detail}", str(path))
    split = split_off(source, reference, wanted, seed=options.seed, by_name=options.match != "geometry")
    observations = SourceObservations(source, reference, options.robot)
    try:
        fit = _fit(source, reference, split, observations, options)
    except RegistrationError as error:
        raise BadInputError(error.code, _advice(error, source, reference), str(reference_path)) from error
    repair = swapped_ids.NAME in names_of(options.effects)
    fit, found = judged(fit, split, source, observations, seed=options.seed, repair=repair)
    issues = [*source.issues, *reference.issues, *_fit_issues(fit, source, reference), *found]
    if isinstance(wanted, Table):
        issues += wanted.issues
    if fit.discovery is not None:
        issues += [*observations.issues, *_effect_issues(fit, source)]
    return SourceFit(source, reference, fit, issues)


def _fit(
    source: Source, reference: Source, split: Split, observations: SourceObservations, options: FitOptions
) -> SpotFit:
    """Fit the spots that take part; rows and counts of the pairs are those of the whole lists."""
    own, other = split.source_rows, split.reference_rows
    noise, noise_source = _noise_of(options, reference, split)
    fit = fit_tables(
        [source.spots.ids[row] for row in own],
        source.spots.positions[own],
        [reference.spots.ids[row] for row in other],
        reference.spots.positions[other],
        kind=options.kind,
        frame=options.frame,
        source_rotations=None if source.spots.rotations is None else source.spots.rotations[own],
        reference_rotations=None if reference.spots.rotations is None else reference.spots.rotations[other],
        noise=noise,
        noise_source=noise_source,
        seed=options.seed,
        method=options.method,
        tau=options.tau,
        n_min=options.n_min,
        matching=options.match,
        effects=options.effects,
        written=Written(_columns_of(source), _columns_of(reference)),
        observe=lambda rows, theirs: observations.of(own[rows], other[theirs]),
        progress=options.progress,
        provenance=_provenance(source, reference, split),
        weights=options.weights,
        orientations=options.orientations,
    )
    if not len(split) or fit.match is None:
        return fit
    match = replace(
        fit.match,
        source_rows=own[fit.match.source_rows],
        reference_rows=other[fit.match.reference_rows],
        n_source=len(source.spots.ids),
        n_reference=len(reference.spots.ids),
    )
    return replace(fit, match=match, beside=None if fit.beside is None else replace(fit.beside, match=match))


def _provenance(source: Source, reference: Source, split: Split) -> dict[str, Any]:
    return {
        "version": __version__,
        "source": str(source.path),
        "source_sha256": source.sha256,
        "reference": str(reference.path),
        "reference_sha256": reference.sha256,
        **({} if source.robot is None else {"robot": robot_identity(source.robot)}),
        **({"held_out": [source.spots.ids[row] for row in split.held_source]} if len(split) else {}),
    }


def _columns_of(source: Source) -> Columns | None:
    """How a list writes orientations; None for a program."""
    if source.table is None:
        return None
    return "quaternion" if "q1" in source.table.columns else "abc"


def _source_of(path: Path, listed: Sequence[str], options: FitOptions) -> Source:
    """Read the source; a table of joints without positions by the named robot's flange."""
    if options.robot is not None and not is_backup(path):
        found, used = table_of_joints(path, options.robot)
        if used.code != "OPTION_UNUSED":
            return found
    return read_source(path, listed, options.spot_id, options.robot_name, options.profiles)


def _noise_of(options: FitOptions, reference: Source, split: Split) -> tuple[float | None, str]:
    """Noise per coordinate that is known independently [mm], and where from: the user's word, else repeats.

    Repeats of spots that are held out do not count.
    """
    if options.noise is not None:
        return options.noise, "--noise"
    every = None if reference.table is None else reference.table.repeats
    if every is None or every.positions is None:
        return None, ""
    held = {reference.spots.ids[row].casefold() for row in split.held_reference if row >= 0}
    rows = [row for row, name in enumerate(every.ids) if name.casefold() not in held]
    repeats = noise_from_repeats([every.ids[row] for row in rows], every.positions[rows])
    if repeats.sigma is None or repeats.degrees_of_freedom < _LEAST_REPEATS:
        return None, ""
    return repeats.sigma_of_mean, "repeats"


def _effect_issues(fit: SpotFit, source: Source) -> list[Issue]:
    """What discovery found, in one line each."""
    issues = []
    found = fit.discovery
    assert found is not None  # noqa: S101 - asked only where there is one
    for effect in fit.effects if fit.model.terms else ():
        if effect.name != "swapped_ids":
            how = "named" if effect.named else "consistent with"
            place = " ".join(f"{key} {value}" for key, value in effect.where.items() if key != "frame")
            issues.append(
                Issue("EFFECT_FOUND", f"{how}: {effect.name} {place}: {effect.remedy.text}", str(source.path))
            )
    seen = fit.observations
    if wrong_frame.frames_of(fit.model.terms) and seen is not None and seen.robot is not None and seen.joints is None:
        message = (
            "where the other base puts the spots the robot has no joints for them: effects of the arm are not looked "
            "for; correct the base and fit again"
        )
        issues.append(Issue("JOINTS_NOT_USED", message, str(source.path)))
    if found.unexplained.present:
        issues.append(Issue("UNEXPLAINED", found.unexplained.text, str(source.path)))
    if fit.observations is not None and fit.observations.absolute_accuracy:
        message = (
            "the controller compensates the arm's own errors, and joints from nominal lengths are not the robot's: "
            "effects of the arm are not looked for; rigid part, tool, wear, time and groups are"
        )
        issues.append(Issue("ABSOLUTE_ACCURACY", message, str(source.path)))
    return issues


def _advice(error: RegistrationError, source: Source, reference: Source) -> str:
    if error.code == "NO_COMMON_IDS":
        own, other = source.spots.ids[0], reference.spots.ids[0]
        return f"{error} (for instance {own} and {other}); --spot-id REGEX tells which part of a name is the ID"
    if error.code == "TOO_FEW_PAIRS":
        return f"{error}; add spots that both hold under the same ID"
    return str(error)


def _fit_issues(fit: SpotFit, source: Source, reference: Source) -> list[Issue]:
    issues: list[Issue] = []
    if fit.match is not None:
        issues += [Issue(note.code, note.message, str(reference.path)) for note in fit.notes]
        issues += _renamed(fit, source, reference)
        issues += _listed("UNMATCHED_SOURCE", fit.match.missing, f"not in {reference.path}", source.path)
        issues += _listed("UNMATCHED_REFERENCE", fit.match.extra, f"not in {source.path}", reference.path)
    issues += _paper_issues(fit)
    for effect in (fit.beside or fit).effects:
        if effect.name == "swapped_ids":
            names = ", ".join(str(name) for name in effect.where["ids"])
            issues.append(Issue("EXCHANGED_NAMES", f"{names} carry each other's names in one of the two lists"))
    issues += _tool_issues(fit.beside or fit, source)
    if fit.method == "affine":
        issues.append(
            Issue("NOT_RIGID", "12 free parameters are for comparison only: no calibration, nothing to convert by")
        )
    if not fit.support.supported:
        issues.append(Issue("ROTATION_NOT_SUPPORTED", fit.support.verdict))
    errors = np.linalg.norm(fit.robust.rigid.residuals, axis=1)
    for name, inlier, error in zip(fit.ids, fit.robust.inliers, errors, strict=True):
        if not inlier:
            issues.append(Issue("OUTLIER", f"{name} is {error:.2f} mm from where the model puts it"))
    return issues


def _tool_issues(fit: SpotFit, source: Source) -> list[Issue]:
    """A tool offset in the model, one that could not be tried, and what orientations say."""
    found = [effect for effect in fit.effects if effect.name == tool_offset.NAME]
    issues = [Issue("TOOL_OFFSET", effect.remedy.text, str(source.path)) for effect in found]
    if fit.tool is not None and fit.tool.code == "TOOL_NOT_DETERMINED":
        issues.append(Issue("TOOL_NOT_TRIED", fit.tool.verdict, str(source.path)))
    if fit.orientations is not None and fit.orientations.code is not None:
        issues.append(Issue(fit.orientations.code, fit.orientations.verdict, str(source.path)))
    return issues


def _renamed(fit: SpotFit, source: Source, reference: Source) -> list[Issue]:
    """Spots without a partner that lie where the other list has one without a partner: probably renamed."""
    assert fit.match is not None  # noqa: S101 - only called where two lists were paired
    missing, extra = set(fit.match.missing), set(fit.match.extra)
    own = [row for row, name in enumerate(source.spots.ids) if name in missing]
    other = [row for row, name in enumerate(reference.spots.ids) if name in extra]
    if not own or not other:
        return []
    model = fit.beside or fit
    points = source.spots.positions[own]
    if model.model.tool_offset is not None and source.spots.rotations is not None:
        points = moved_by(points, source.spots.rotations[own].as_matrix(), model.model.tool_offset)
    images = model.robust.rigid.predict(points)
    apart = np.linalg.norm(images[:, None, :] - reference.spots.positions[other][None, :, :], axis=-1)
    near = apart <= model.robust.threshold
    pairs = [
        f"{source.spots.ids[own[i]]} = {reference.spots.ids[other[j]]} ({apart[i, j]:.2f} mm)"
        for i, j in np.argwhere(near)
        if near[i].sum() == 1 and near[:, j].sum() == 1
    ]
    if not pairs:
        return []
    shown = ", ".join(pairs[:_MOST_LISTED]) + (
        f" and {len(pairs) - _MOST_LISTED} more" if len(pairs) > _MOST_LISTED else ""
    )
    message = (
        f"without a partner by name and at the same place, so probably renamed: {shown}; they took no part in the fit"
    )
    return [Issue("PROBABLY_RENAMED", message, str(reference.path))]


def _paper_issues(fit: SpotFit) -> list[Issue]:
    """What the paper's method cannot see by itself."""
    if fit.paper is None or fit.beside is None:
        return []
    issues = []
    if fit.paper.beyond:
        names = ", ".join(fit.ids[row] for row in fit.paper.beyond)
        message = (
            f"{names} lie beyond tau and are still part of the subset that made the transform: it never tests its own"
        )
        issues.append(Issue("SUBSET_NOT_TESTED", message))
    other = fit.paper_mean_square
    if other is not None and other.dropped != fit.paper.dropped:
        names = ", ".join(fit.ids[row] for row in other.dropped) or "no spot"
        issues.append(Issue("PAPER_AMBIGUOUS", f"D_n as a mean square, the other way to read it, drops {names}"))
    apart = np.linalg.norm(fit.calibrated - fit.beside.calibrated, axis=1)
    worst = int(np.argmax(apart))
    message = f"the paper's transform and ours put {fit.ids[worst]} up to {apart[worst]:.2f} mm apart"
    issues.append(Issue("PAPER_COMPARED", message))
    return issues


def _listed(code: str, names: Sequence[str], what: str, path: Path) -> list[Issue]:
    if not names:
        return []
    more = f" and {len(names) - _MOST_LISTED} more" if len(names) > _MOST_LISTED else ""
    return [Issue(code, f"{', '.join(names[:_MOST_LISTED])}{more}: {what}", str(path))]
