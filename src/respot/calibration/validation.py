"""Fresh measurements against a stored calibration: out of tolerance, and is its promise kept. Behind `respot validate`.

Nothing is fitted here: names as given, every pair by name, the stored transform as it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats
from scipy.spatial.transform import Rotation

from respot.calibration.calibration import Calibration, CalibrationError, Kind
from respot.calibration.effects.moved import missing
from respot.calibration.observations import Observations
from respot.calibration.prediction import Prediction, UseOptions, beyond_range, extrapolated, predict_spots, read_for
from respot.calibration.source_observations import SourceObservations
from respot.calibration.stored import arm_of, load_calibration
from respot.issues import BadInputError, Issue
from respot.registration.errors import RegistrationError
from respot.registration.matching import EXACT, IdMatch, match_by_name
from respot.registration.statistics import Distances, distances
from respot.spots import Source, read_source

Array = NDArray[np.float64]

#: A promise counts as broken where errors as large would come by chance less often than this.
SIGNIFICANCE = 0.05
_ROUNDING_MM = 1e-6
_MOST_LISTED = 20


@dataclass(frozen=True)
class Promise:
    """Whether fresh errors are what the held-out errors promised.

    Attributes
    ----------
    rms : float or None
        RMS of the errors held out when it was fitted [mm]; None where the calibration does not say.
    n : int
        Of how many spots.
    f_value, p_value : float or None
        Fresh over promised mean square, and how often chance makes it as large.
    kept : bool or None
        ``p_value`` of at least 0.05; None where nothing was promised.
    verdict : str
        The same in words.
    """

    rms: float | None
    n: int
    f_value: float | None
    p_value: float | None
    kept: bool | None
    verdict: str


@dataclass(frozen=True, eq=False)
class Validation:
    """Fresh pairs under a calibration that took no part of them. All lengths mm.

    Attributes
    ----------
    prediction : Prediction
        Of the paired spots.
    reference_ids : tuple of n str
    residuals : (n, 3) array
        Predicted minus measured.
    tolerance : float
    promise : Promise
    """

    prediction: Prediction
    reference_ids: tuple[str, ...]
    residuals: Array
    tolerance: float
    promise: Promise

    @property
    def ids(self) -> tuple[str, ...]:
        """Names of the pairs in the source."""
        return self.prediction.ids

    @property
    def figures(self) -> Distances:
        """RMS, mean and maximum of the distances."""
        return distances(self.residuals)

    @property
    def out_of_tolerance(self) -> tuple[str, ...]:
        """Spots farther off than the tolerance, the farthest first."""
        lengths = np.linalg.norm(self.residuals, axis=1)
        order = np.argsort(-lengths, kind="stable")
        return tuple(self.ids[row] for row in order if lengths[row] > self.tolerance)

    def to_dict(self) -> dict[str, Any]:
        """JSON values, without schema, version and issues."""
        figures, promise = self.figures, self.promise
        return {
            "n": figures.n,
            "rms": figures.rms,
            "mean": figures.mean,
            "max": figures.max,
            "tolerance": self.tolerance,
            "out_of_tolerance": list(self.out_of_tolerance),
            "heldout_promise": {"rms": promise.rms, "n": promise.n},
            "kept": promise.kept,
            "kept_test": {"f_value": promise.f_value, "p_value": promise.p_value, "verdict": promise.verdict},
            "spots": [
                {
                    **spot,
                    "reference_id": name,
                    "distance": float(np.linalg.norm(residual)),
                    **dict(zip(("dx", "dy", "dz"), residual.tolist(), strict=True)),
                }
                for spot, name, residual in zip(
                    self.prediction.to_dict(), self.reference_ids, self.residuals, strict=True
                )
            ],
        }


def validate_spots(
    calibration: Calibration,
    ids: Sequence[str],
    source: ArrayLike,
    reference: ArrayLike,
    *,
    rotations: Rotation | None = None,
    reference_ids: Sequence[str] | None = None,
    tolerance: float = 10.0,
    observations: Observations | None = None,
) -> Validation:
    """Compare fresh pairs with where a calibration puts them.

    Parameters
    ----------
    calibration : Calibration
    ids : sequence of n str, n >= 1
    source, reference : (n, 3) arrays
        Fresh pairs: source frame, reference frame [mm].
    rotations : Rotation of n, optional
        Tool orientations in the source frame.
    reference_ids : sequence of n str, optional
        Names in the reference; default ``ids``.
    tolerance : float
        Largest distance of a good spot [mm].
    observations : Observations of n, optional
        What else is known of the pairs: needed for effects.

    Raises
    ------
    RegistrationError
        ``SHAPE_MISMATCH`` or ``TOO_FEW_PAIRS``.
    CalibrationError
        As `Calibration.predict`.
    """
    first, second = np.asarray(source, dtype=np.float64), np.asarray(reference, dtype=np.float64)
    if first.shape != (len(ids), 3) or second.shape != first.shape:
        raise RegistrationError("SHAPE_MISMATCH", f"{len(ids)} names for points {first.shape} and {second.shape}")
    if not len(ids):
        raise RegistrationError("TOO_FEW_PAIRS", "no pair to compare")
    prediction = predict_spots(calibration, ids, first, rotations, observations)
    residuals = prediction.positions - second
    names = tuple(ids if reference_ids is None else reference_ids)
    return Validation(prediction, names, residuals, tolerance, promise_of(calibration, residuals))


def promise_of(calibration: Calibration, residuals: Array) -> Promise:
    """Test whether fresh residuals (n, 3) are as small as the held-out errors promised [mm].

    F test of the mean squares, one-sided: larger alone breaks a promise. Degrees of freedom are 3n and those of the
    fit, both times `Precision.direction_share`, since errors along one direction tell a third of what errors along
    three do.
    """
    sure = calibration.precision
    fresh = float(np.sqrt(np.mean(np.sum(residuals**2, axis=1))))
    if sure is None or sure.heldout_rms is None:
        verdict = "the calibration holds no held-out error, so there is no promise to compare with"
        return Promise(None, 0, None, None, None, verdict)
    promised = sure.heldout_rms
    free = float(3 * sure.heldout_n - sure.parameters)
    share = sure.direction_share
    f_value = fresh**2 / max(promised, _ROUNDING_MM) ** 2
    p_value = float(stats.f.sf(f_value, 3 * len(residuals) * share, max(free * share, 1.0)))
    kept = p_value >= SIGNIFICANCE or fresh <= _ROUNDING_MM
    said = f"{fresh:.3f} mm RMS over {len(residuals)} fresh spots, {promised:.3f} mm promised from {sure.heldout_n}"
    words = "by chance alone it would be as large or larger in"
    if kept:
        verdict = f"the promise is kept: {said} ({words} {100 * p_value:.2g} % of validations)"
    else:
        verdict = (
            f"the promise is NOT kept: {said} ({words} only {100 * p_value:.2g} % of validations): something changed "
            "since it was fitted, or spots or names are not the same"
        )
    return Promise(promised, sure.heldout_n, float(f_value), p_value, bool(kept), verdict)


@dataclass(frozen=True, eq=False)
class SourceValidation:
    """A validation with where it came from.

    Parameters
    ----------
    source, reference : Source
    calibration : Calibration
    validation : Validation
    issues : sequence of Issue
    """

    source: Source
    reference: Source
    calibration: Calibration
    validation: Validation
    issues: Sequence[Issue]


def validate_source(
    source_path: Path,
    reference_path: Path,
    calibration_path: Path,
    kind: Kind,
    options: UseOptions,
    tolerance: float = 10.0,
) -> SourceValidation:
    """Compare a source and a fresh reference under a stored calibration.

    Parameters
    ----------
    source_path, reference_path, calibration_path : Path
    kind : "theory" or "measured"
        What the reference is; must be the calibration's own.
    options : UseOptions
    tolerance : float
        [mm]

    Raises
    ------
    BadInputError
        A file cannot be used, kinds differ, no name is in both lists, or the source is another robot's.
    """
    calibration = load_calibration(calibration_path)
    if calibration.kind != kind:
        message = f"was fitted with --{calibration.kind}, so a --{kind} reference cannot validate it"
        raise BadInputError("BAD_OPTION", message, str(calibration_path))
    reference = read_source(reference_path, spot_id=options.spot_id, profiles=options.profiles)
    source, issues = read_for(calibration, source_path, options)
    match = match_by_name(source.spots.ids, reference.spots.ids)
    if not match.ids:
        own = source.spots.ids[0]
        other = f" (for instance {own} and {reference.spots.ids[0]})" if reference.spots.ids else ""
        message = f"shares no spot ID with the source{other}; --spot-id REGEX tells which part of a name is the ID"
        raise BadInputError("NO_COMMON_IDS", message, str(reference_path))
    spots = source.spots
    used, observations, found = _seen(calibration, source, reference, match, options)
    issues = [*issues, *found]
    try:
        validation = validate_spots(
            used,
            match.ids,
            spots.positions[match.source_rows],
            reference.spots.positions[match.reference_rows],
            rotations=None if spots.rotations is None else spots.rotations[match.source_rows],
            reference_ids=match.reference_ids,
            tolerance=tolerance,
            observations=observations,
        )
    except CalibrationError as error:
        raise BadInputError("NO_ORIENTATION", str(error), str(source_path)) from error
    if calibration.provenance.get("reference_sha256") == reference.sha256:
        message = "is what the calibration was fitted to: its errors prove nothing; validate with fresh measurements"
        issues.append(Issue("NOT_FRESH", message, str(reference_path)))
    issues = [*issues, *reference.issues, *_pair_issues(match, source, reference), *_issues(validation)]
    issues += extrapolated(validation.prediction)
    return SourceValidation(source, reference, calibration, validation, issues)


def _seen(
    calibration: Calibration, source: Source, reference: Source, match: IdMatch, options: UseOptions
) -> tuple[Calibration, Observations | None, list[Issue]]:
    """What the pairs tell for the effects of a calibration, which are left out where they do not."""
    if not calibration.terms:
        return calibration, None, []
    robot, other_arm = arm_of(calibration, options.robot, str(source.path), any_robot=options.any_robot)
    gathered = SourceObservations(source, reference, robot, constant=True)
    observations = gathered.of(match.source_rows, match.reference_rows)
    lacking = [term for term in calibration.terms if missing(observations, term)]
    issues = [
        Issue(
            "EFFECT_LEFT_OUT", f"{term.label} is left out: {missing(observations, term)} is not known", str(source.path)
        )
        for term in lacking
    ]
    used = calibration.without(lacking)
    return used, observations, [*other_arm, *gathered.issues, *issues, *beyond_range(used, observations, source)]


def _pair_issues(match: IdMatch, source: Source, reference: Source) -> list[Issue]:
    issues = []
    for code, names, where in (
        ("UNMATCHED_SOURCE", match.missing, reference.path),
        ("UNMATCHED_REFERENCE", match.extra, source.path),
    ):
        if names:
            issues.append(Issue(code, f"{_some(names)}: not in {where}, so not compared"))
    rules = sorted({rule for rule in match.rules if rule != EXACT})
    if rules:
        taken = zip(match.ids, match.reference_ids, match.rules, strict=True)
        pairs = [f"{own} = {other}" for own, other, rule in taken if rule != EXACT]
        issues.append(Issue("NAMES_BY_RULE", f"taken for the same by {', '.join(rules)}: {_some(pairs)}"))
    return issues


def _issues(validation: Validation) -> list[Issue]:
    """What the answer is made of, and where two names may be exchanged."""
    issues = []
    far = validation.out_of_tolerance
    lengths = dict(zip(validation.ids, np.linalg.norm(validation.residuals, axis=1), strict=True))
    if far:
        listed = _some([f"{name} ({lengths[name]:.2f} mm)" for name in far])
        message = f"{len(far)} of {len(lengths)} spots are farther than {validation.tolerance:g} mm: {listed}"
        issues.append(Issue("OUT_OF_TOLERANCE", message))
    if validation.promise.kept is False:
        issues.append(Issue("PROMISE_NOT_KEPT", validation.promise.verdict))
    if validation.promise.kept is None:
        issues.append(Issue("NO_INTERVAL", validation.promise.verdict))
    predicted = validation.prediction.positions
    measured = predicted - validation.residuals
    rows = {name: row for row, name in enumerate(validation.ids)}
    for place, first in enumerate(far):
        for second in far[place + 1 :]:
            i, j = rows[first], rows[second]
            apart = np.linalg.norm([predicted[i] - measured[j], predicted[j] - measured[i]], axis=1)
            if apart.max() <= validation.tolerance:
                message = f"{first} and {second} lie at each other's places: names are probably exchanged"
                issues.append(Issue("EXCHANGED_NAMES", message))
    return issues


def _some(names: Sequence[str]) -> str:
    more = f" and {len(names) - _MOST_LISTED} more" if len(names) > _MOST_LISTED else ""
    return ", ".join(names[:_MOST_LISTED]) + more
