"""The fit of paired spots, end to end: as found, names, robust inliers, least squares, held-out errors, report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from respot.calibration.calibration import Calibration, Frame, Kind
from respot.calibration.effects import swapped_ids
from respot.calibration.effects.effect import Effect
from respot.calibration.uncertainty import TransformUncertainty, transform_uncertainty
from respot.registration.alternatives import AffineFit, TranslationFit, fit_affine, fit_translation
from respot.registration.errors import DegenerateError, RegistrationError
from respot.registration.exchanged import ExchangeResult, find_exchanged
from respot.registration.leave_one_out import leave_one_out
from respot.registration.matching import IdMatch, match_by_id
from respot.registration.rigid import RigidFit, check_pairs, fit_rigid
from respot.registration.robust import RobustFit
from respot.registration.statistics import ResidualDirections, residual_directions
from respot.registration.support import RotationSupport, rotation_support

Array = NDArray[np.float64]

LEAST_PAIRS = 4
LATERAL_NOISE = 3.0
"""Spots must stray from their best line by this many times the noise (RMS), or the turn about it is noise alone."""


@dataclass(frozen=True, eq=False)
class SpotFit:
    """Everything that a fit of n pairs found. All lengths mm, all residuals predicted minus reference.

    Attributes
    ----------
    calibration : Calibration
        The final model.
    match : IdMatch or None
        How the pairs were formed, where two lists were given.
    ids, reference_ids : tuples of n str
        Name of each pair in the source; name of the reference spot it belongs to, repaired.
    source, reference : (n, 3) arrays
        Source spots; the reference spots they belong to, names repaired.
    source_rotations : Rotation of n, or None
    as_found : (n, 3) array
        Source minus reference as named.
    before : RigidFit
        Least squares of all pairs as named.
    before_loo, after_loo : (n, 3) arrays
        Leave-one-out residuals as named; and of the final structure (an outlier is judged by the fit of the inliers).
    exchanged : ExchangeResult
    robust : RobustFit
        Inliers, scale, and ``rigid``: the final least-squares fit.
    affine : AffineFit or None
        The unconstrained 12 parameters over all pairs as named; None for coplanar spots.
    translation : TranslationFit
        Translation alone, over the inliers with names repaired.
    directions : ResidualDirections
        Of the inliers.
    support : RotationSupport
    uncertainty : TransformUncertainty
    effects : tuple of Effect
    noise : float or None
        Noise per coordinate known from elsewhere.
    """

    calibration: Calibration
    match: IdMatch | None
    ids: tuple[str, ...]
    reference_ids: tuple[str, ...]
    source: Array
    reference: Array
    source_rotations: Rotation | None
    as_found: Array
    before: RigidFit
    before_loo: Array
    after_loo: Array
    exchanged: ExchangeResult
    robust: RobustFit
    affine: AffineFit | None
    translation: TranslationFit
    directions: ResidualDirections
    support: RotationSupport
    uncertainty: TransformUncertainty
    effects: tuple[Effect, ...]
    noise: float | None

    @property
    def calibrated(self) -> Array:
        """Source spots under the final model (n, 3), reference frame [mm]."""
        return self.robust.rigid.predict(self.source)

    @property
    def repaired(self) -> NDArray[np.bool_]:
        """Which pairs (n,) got another name than they came with."""
        changed: NDArray[np.bool_] = self.exchanged.permutation != np.arange(len(self.ids))
        return changed


def fit_tables(
    source_ids: Sequence[str],
    source: ArrayLike,
    reference_ids: Sequence[str],
    reference: ArrayLike,
    *,
    kind: Kind = "theory",
    frame: Frame | None = None,
    source_rotations: Rotation | None = None,
    noise: float | None = None,
    seed: int = 0,
    provenance: Mapping[str, Any] | None = None,
) -> SpotFit:
    """Match two lists by name and fit them; parameters and errors as `fit_spots`.

    Parameters
    ----------
    source_ids, source, source_rotations
        The spots of the programs: n names, (n, 3) [mm], n orientations.
    reference_ids, reference
        What they are compared with: m names, (m, 3) [mm].

    Raises
    ------
    RegistrationError
        Also ``DUPLICATE_ID`` for a name that occurs twice in a list, ``NO_COMMON_IDS`` where no name is in both.
    """
    for which, ids, points in (("source", source_ids, source), ("reference", reference_ids, reference)):
        if np.shape(points) != (len(ids), 3):
            raise RegistrationError("SHAPE_MISMATCH", f"{which}: {len(ids)} names for points {np.shape(points)}")
    match = match_by_id(source_ids, reference_ids)
    for which, names in (("source", match.source_duplicates), ("reference", match.reference_duplicates)):
        if names:
            shown = ", ".join(names[:5]) + (" ..." if len(names) > 5 else "")
            raise RegistrationError("DUPLICATE_ID", f"named more than once in the {which} list: {shown}", ids=names)
    if not match.ids:
        raise RegistrationError(
            "NO_COMMON_IDS",
            f"none of the {match.n_source} source spots has the name of one of the {match.n_reference} reference spots",
        )
    return fit_spots(
        match.ids,
        np.asarray(source, dtype=np.float64)[match.source_rows],
        np.asarray(reference, dtype=np.float64)[match.reference_rows],
        kind=kind,
        frame=frame,
        source_rotations=None if source_rotations is None else source_rotations[match.source_rows],
        noise=noise,
        seed=seed,
        provenance=provenance,
        match=match,
    )


def fit_spots(
    ids: Sequence[str],
    source: ArrayLike,
    reference: ArrayLike,
    *,
    kind: Kind = "theory",
    frame: Frame | None = None,
    source_rotations: Rotation | None = None,
    noise: float | None = None,
    seed: int = 0,
    provenance: Mapping[str, Any] | None = None,
    match: IdMatch | None = None,
) -> SpotFit:
    """Fit paired spots: names, inliers, rigid transform, and how sure all of it is.

    Parameters
    ----------
    ids : sequence of n different str, n >= 4
    source, reference : (n, 3) arrays
        Pairs as named [mm].
    kind : "theory" or "measured"
    frame : "same" or "free", optional
        Default "same" for theory, "free" for measured.
    source_rotations : Rotation of n, optional
        Tool orientations in the source frame.
    noise : float, optional
        Standard deviation per coordinate, known independently [mm].
    seed : int
        Of the consensus start and of permutation draws.
    provenance : mapping, optional
        JSON values that the calibration keeps.
    match : IdMatch, optional
        Where the pairs come from, for the counts.

    Raises
    ------
    RegistrationError
        ``SHAPE_MISMATCH``, ``NOT_A_NUMBER``, ``TOO_FEW_PAIRS``, ``DUPLICATE_ID``.
    DegenerateError
        ``COLLINEAR_SPOTS``: on a line, or off it by no more than `LATERAL_NOISE` times the noise.
    """
    names = tuple(str(name) for name in ids)
    first, second = _check(names, source, reference)
    before = fit_rigid(first, second, checked=False)
    exchanged = find_exchanged(names, first, second, seed=seed)
    robust, repaired = exchanged.robust, second[exchanged.permutation]
    inliers = robust.inliers
    calibrated = robust.rigid.predict(first)
    uncertainty = transform_uncertainty(calibrated[inliers], robust.rigid.residuals[inliers])
    _require_breadth(robust.rigid, uncertainty.sigma)
    calibration = Calibration(
        rotation=robust.rigid.rotation,
        translation=robust.rigid.translation,
        kind=kind,
        frame=frame or ("same" if kind == "theory" else "free"),
        ids=names,
        provenance=dict(provenance or {}),
    )
    return SpotFit(
        calibration=calibration,
        match=match,
        ids=names,
        reference_ids=tuple(names[row] for row in exchanged.permutation),
        source=first,
        reference=repaired,
        source_rotations=source_rotations,
        as_found=first - second,
        before=before,
        before_loo=leave_one_out(first, second),
        after_loo=leave_one_out(first, repaired, inliers),
        exchanged=exchanged,
        robust=robust,
        affine=fit_affine(first, second),
        translation=fit_translation(first[inliers], repaired[inliers]),
        directions=residual_directions(robust.rigid.residuals[inliers]),
        support=rotation_support(first[inliers], repaired[inliers]),
        uncertainty=uncertainty,
        effects=swapped_ids.effects_of(exchanged, names, second, kind=kind),
        noise=noise,
    )


def _check(names: tuple[str, ...], source: ArrayLike, reference: ArrayLike) -> tuple[Array, Array]:
    try:
        first, second = check_pairs(source, reference, minimum=LEAST_PAIRS)
    except RegistrationError as error:
        named = tuple(names[row] for row in error.rows if row < len(names))
        where = f" (spot {', '.join(named[:5])})" if named else ""
        raise RegistrationError(error.code, f"{error}{where}", ids=named, rows=error.rows) from error
    if len(names) != len(first):
        raise RegistrationError("SHAPE_MISMATCH", f"{len(names)} names for {len(first)} pairs")
    if len(set(names)) != len(names):
        twice = tuple(sorted({name for name in names if names.count(name) > 1}))
        raise RegistrationError("DUPLICATE_ID", f"named more than once: {', '.join(twice[:5])}", ids=twice)
    return first, second


def _require_breadth(fit: RigidFit, sigma: float) -> None:
    if fit.spread[1] <= LATERAL_NOISE * sigma:
        raise DegenerateError(
            f"the spots stray only {fit.spread[1]:.2f} mm (RMS) from one line, with residuals of {sigma:.2f} mm per "
            "coordinate: the rotation about that line is not determined; add spots away from it"
        )
