"""Fits what a source holds to a reference: the function behind `respot fit`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from respot import __version__
from respot.calibration.calibration import Frame, Kind
from respot.calibration.fit import SpotFit, fit_tables
from respot.issues import BadInputError, Issue
from respot.registration.errors import RegistrationError
from respot.spots import Source, read_source

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
    """

    kind: Kind = "theory"
    frame: Frame | None = None
    robot_name: str | None = None
    spot_id: str | None = None
    noise: float | None = None
    seed: int = 0


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
    reference = read_source(reference_path, spot_id=options.spot_id)
    source = read_source(source_path, reference.spots.ids, options.spot_id, options.robot_name)
    for side, path in ((source, source_path), (reference, reference_path)):
        if not side.spots.ids:
            detail = f": {side.spots.issues[0]}" if side.spots.issues else "; --spot-id REGEX tells how they are named"
            raise BadInputError("NO_COMMON_IDS", f"holds no weld spot that can be used{detail}", str(path))
    try:
        fit = fit_tables(
            source.spots.ids,
            source.spots.positions,
            reference.spots.ids,
            reference.spots.positions,
            kind=options.kind,
            frame=options.frame,
            source_rotations=source.spots.rotations,
            noise=options.noise,
            seed=options.seed,
            provenance={
                "version": __version__,
                "source": str(source_path),
                "source_sha256": source.sha256,
                "reference": str(reference_path),
                "reference_sha256": reference.sha256,
            },
        )
    except RegistrationError as error:
        raise BadInputError(error.code, _advice(error, source, reference), str(reference_path)) from error
    return SourceFit(source, reference, fit, [*source.issues, *reference.issues, *_fit_issues(fit, source, reference)])


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
        issues += _listed("UNMATCHED_SOURCE", fit.match.missing, f"not in {reference.path}", source.path)
        issues += _listed("UNMATCHED_REFERENCE", fit.match.extra, f"not in {source.path}", reference.path)
    for effect in fit.effects:
        if effect.name == "swapped_ids":
            names = ", ".join(str(name) for name in effect.where["ids"])
            issues.append(Issue("EXCHANGED_NAMES", f"{names} carry each other's names in one of the two lists"))
    if not fit.support.supported:
        issues.append(Issue("ROTATION_NOT_SUPPORTED", fit.support.verdict))
    errors = np.linalg.norm(fit.robust.rigid.residuals, axis=1)
    for name, inlier, error in zip(fit.ids, fit.robust.inliers, errors, strict=True):
        if not inlier:
            issues.append(Issue("OUTLIER", f"{name} is {error:.2f} mm from where the model puts it"))
    return issues


def _listed(code: str, names: Sequence[str], what: str, path: Path) -> list[Issue]:
    if not names:
        return []
    more = f" and {len(names) - _MOST_LISTED} more" if len(names) > _MOST_LISTED else ""
    return [Issue(code, f"{', '.join(names[:_MOST_LISTED])}{more}: {what}", str(path))]
