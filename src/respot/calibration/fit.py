"""The fit of paired spots, end to end: as found, names, robust inliers, least squares, held-out errors, report."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from respot.calibration import effects_model
from respot.calibration.calibration import Calibration, Frame, Kind
from respot.calibration.causes import Causes, Observe, Written, find_causes, names_of
from respot.calibration.discovery.records import effects_of as discovered_effects
from respot.calibration.effects import swapped_ids, tool_model, tool_offset
from respot.calibration.effects.orientations import OrientationFit, compare_orientations
from respot.calibration.effects.search import RIGID_ONLY, Effects
from respot.calibration.effects.tool_fit import moved_by
from respot.calibration.effects.tool_robust import fit_tool_robust
from respot.calibration.methods import affine_fit, paper_fit
from respot.calibration.observations import Observations
from respot.calibration.spot_fit import Method, SpotFit
from respot.calibration.uncertainty import TransformUncertainty, transform_uncertainty, uncertainty_by_direction
from respot.kinematics.robot_file import robot_record
from respot.registration.affine import fit_affine
from respot.registration.alternatives import fit_translation
from respot.registration.anisotropy import isotropy_p_value
from respot.registration.congruence import congruence
from respot.registration.errors import DegenerateError, RegistrationError
from respot.registration.leave_one_out import leave_one_out
from respot.registration.matching import IdMatch, Matching, match_by_name
from respot.registration.pairing import Note, Pairing, pair_spots
from respot.registration.rigid import RigidFit, check_pairs, fit_rigid
from respot.registration.robust import RobustFit
from respot.registration.statistics import residual_directions
from respot.registration.support import rotation_support

Array = NDArray[np.float64]
PairedObserve = Callable[[Sequence[int] | NDArray[np.intp], Sequence[int] | NDArray[np.intp]], Observations]

LEAST_PAIRS = 4
DEFAULT_FRAME: Mapping[Kind, Frame] = {"theory": "same", "measured": "free"}
LEAST_FOR_DIRECTIONS = 8
"""Fewer residuals do not tell the noise of three directions."""
LATERAL_NOISE = 3.0
"""Spots must stray from their best line by this many times the noise (RMS), or the turn about it is noise alone."""


def fit_tables(
    source_ids: Sequence[str],
    source: ArrayLike,
    reference_ids: Sequence[str],
    reference: ArrayLike,
    *,
    kind: Kind = "theory",
    frame: Frame | None = None,
    source_rotations: Rotation | None = None,
    reference_rotations: Rotation | None = None,
    noise: float | None = None,
    noise_source: str = "--noise",
    seed: int = 0,
    method: Method = "robust",
    tau: float | None = None,
    n_min: int | None = None,
    matching: Matching = "auto",
    effects: Effects = RIGID_ONLY,
    provenance: Mapping[str, Any] | None = None,
    written: Written | None = None,
    observe: PairedObserve | None = None,
    nested: bool = True,
    progress: Callable[[], None] = lambda: None,
) -> SpotFit:
    """Pair two lists and fit them; parameters and errors as `fit_spots`.

    Parameters
    ----------
    source_ids, source, source_rotations
        The spots of the programs: n names, (n, 3) [mm], n orientations.
    reference_ids, reference, reference_rotations
        What they are compared with: m names, (m, 3) [mm], m orientations.
    matching : "auto", "id" or "geometry"
        How spots are paired; see `respot.registration.pairing.pair_spots`. Where names and distances disagree and the
        effect ``tool_offset`` is looked for, pairs by name are taken if an offset makes the two lists congruent.
    written : Written, optional
        How both lists write orientations; default as programs do.
    observe : callable, optional
        From rows of source and reference to `respot.calibration.observations.Observations` of the pairs.

    Raises
    ------
    RegistrationError
        Also as `respot.registration.pairing.pair_spots`.
    """
    for which, ids, points in (("source", source_ids, source), ("reference", reference_ids, reference)):
        if np.shape(points) != (len(ids), 3):
            raise RegistrationError("SHAPE_MISMATCH", f"{which}: {len(ids)} names for points {np.shape(points)}")
    first, second = np.asarray(source, dtype=np.float64), np.asarray(reference, dtype=np.float64)
    same_frame = (frame or DEFAULT_FRAME[kind]) == "same"
    looked_for = names_of(effects)

    def pair(points: Array) -> Pairing:
        return pair_spots(source_ids, points, reference_ids, second, way=matching, same_frame=same_frame, seed=seed)

    pairing, doubt = None, None
    try:
        pairing = pair(first)
        notes = pairing.notes
        doubtful = any(note.code == "NOT_CONGRUENT" for note in notes)
    except RegistrationError as error:
        if error.code != "NOT_CONGRUENT":
            raise
        doubt, doubtful = error, True
    if doubtful and tool_offset.NAME in looked_for and source_rotations is not None and method == "robust":
        moved = _congruent_by_tool(source_ids, first, source_rotations, reference_ids, second, seed)
        if moved is not None:
            pairing = pair(moved)
            message = (
                "distances between spots agree with the reference after a constant offset in the tool frame and not "
                "before: the poses are those of another TCP (the flange, or a wrong tool)"
            )
            notes = (*pairing.notes, Note("CONGRUENT_BY_TOOL", message))
    if pairing is None:
        assert doubt is not None  # noqa: S101 - without a pairing there was an error
        raise doubt
    match = pairing.match
    fit = fit_spots(
        match.ids,
        first[match.source_rows],
        second[match.reference_rows],
        kind=kind,
        frame=frame,
        source_rotations=None if source_rotations is None else source_rotations[match.source_rows],
        reference_rotations=None if reference_rotations is None else reference_rotations[match.reference_rows],
        noise=noise,
        noise_source=noise_source,
        seed=seed,
        method=method,
        tau=tau,
        n_min=n_min,
        effects=effects,
        provenance=provenance,
        match=match,
        notes=notes,
        written=written,
        observe=None
        if observe is None
        else lambda permutation: observe(match.source_rows, match.reference_rows[permutation]),
        nested=nested,
        progress=progress,
    )
    if doubt is not None and not any(effect.name == tool_offset.NAME for effect in fit.effects):
        raise doubt
    return fit


def _congruent_by_tool(
    source_ids: Sequence[str],
    source: Array,
    rotations: Rotation,
    reference_ids: Sequence[str],
    reference: Array,
    seed: int,
) -> Array | None:
    """Source spots (n, 3) moved by the tool offset under which the pairs by name are one body; None without any."""
    match = match_by_name(source_ids, reference_ids)
    first, second = source[match.source_rows], reference[match.reference_rows]
    tools = rotations.as_matrix()
    if len(first) < LEAST_PAIRS or not (np.isfinite(first).all() and np.isfinite(second).all()):
        return None
    try:
        fit = fit_tool_robust(first, tools[match.source_rows], second, seed=seed)
    except RegistrationError:
        return None
    return moved_by(source, tools, fit.offset) if congruence(fit.moved, second).same_body else None


def fit_spots(
    ids: Sequence[str],
    source: ArrayLike,
    reference: ArrayLike,
    *,
    kind: Kind = "theory",
    frame: Frame | None = None,
    source_rotations: Rotation | None = None,
    reference_rotations: Rotation | None = None,
    noise: float | None = None,
    noise_source: str = "--noise",
    seed: int = 0,
    method: Method = "robust",
    tau: float | None = None,
    n_min: int | None = None,
    effects: Effects = RIGID_ONLY,
    provenance: Mapping[str, Any] | None = None,
    match: IdMatch | None = None,
    notes: tuple[Note, ...] = (),
    written: Written | None = None,
    observe: Observe | None = None,
    nested: bool = True,
    progress: Callable[[], None] = lambda: None,
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
    reference_rotations : Rotation of n, optional
        Tool orientations in the reference frame. They are compared, and never move the fit.
    noise : float, optional
        Standard deviation per coordinate, known independently [mm].
    noise_source : str
        Where that is known from, for the report.
    seed : int
        Of the consensus start, of permutation draws and of the paper's random subsets.
    method : "robust", "paper" or "affine"
        The final model: ours, the paper's own method, or its unconstrained equation (6), which is no calibration.
    tau : float, optional
        Of the method "paper": largest residual of an inlier [mm].
    n_min : int, optional
        Of the method "paper": a subset qualifies with more inliers than this.
    effects : "auto" or names
        Effects to look for. One that is asked for by its name must be determined by the spots; "auto" looks for all
        that are.
    provenance : mapping, optional
        JSON values that the calibration keeps.
    match : IdMatch, optional
        Where the pairs come from, for the counts and the reference's own names.
    notes : tuple of Note
        What was noticed while pairing.
    written : Written, optional
        How both lists write orientations; default as programs do.
    observe : callable, optional
        What else is known of the pairs: `respot.calibration.causes.Observe`.
    nested : bool
        Also choose and fit without each fifth of the spots, to judge what is found by spots that took no part.
    progress : callable
        Called as the search for effects goes on.

    Raises
    ------
    RegistrationError
        ``SHAPE_MISMATCH``, ``NOT_A_NUMBER``, ``TOO_FEW_PAIRS``, ``DUPLICATE_ID``; as `fit_paper` for the method
        "paper"; ``COPLANAR_SPOTS`` for the method "affine"; ``BAD_OPTION`` for an unknown effect; ``NO_ORIENTATION``
        or ``TOOL_NOT_DETERMINED`` where a tool offset is asked for and cannot be tried.
    DegenerateError
        ``COLLINEAR_SPOTS``: on a line, or off it by no more than `LATERAL_NOISE` times the noise.
    """
    names = tuple(str(name) for name in ids)
    first, second = _check(names, source, reference)
    causes = find_causes(
        names,
        first,
        second,
        source_rotations,
        effects,
        observe,
        kind=kind,
        noise=noise,
        seed=seed,
        reference_rotations=reference_rotations,
        written=written,
        nested=nested,
        progress=progress,
    )
    repaired = second[causes.exchanged.permutation]
    model = _model_of(causes, first, repaired, seed)
    robust, moved, inliers = model.robust, model.moved, model.robust.inliers
    _require_breadth(robust.rigid, model.uncertainty.sigma)
    exchanged, trial = causes.exchanged, causes.trial
    found = swapped_ids.effects_of(exchanged, names, second, kind=kind)
    reading = causes.convention
    if reading is not None and reading.finding is not None:
        found = (*found, reading.finding.effect)
    if trial is not None and trial.effect is not None:
        found = (*found, trial.effect)
    if causes.in_model is not None:
        found = (*found, *discovered_effects(causes.in_model))
    reference_names = names if match is None or not match.reference_ids else match.reference_ids
    fit = SpotFit(
        model=_calibration_of(causes, model, names, kind, frame, provenance),
        match=match,
        ids=names,
        reference_ids=tuple(reference_names[row] for row in exchanged.permutation),
        source=first,
        reference=repaired,
        source_rotations=causes.rotations,
        as_found=first - second,
        before=fit_rigid(first, second, checked=False),
        before_loo=leave_one_out(first, second),
        after_loo=model.left_out,
        exchanged=exchanged,
        robust=robust,
        affine=fit_affine(first, second),
        translation=fit_translation(moved[inliers], repaired[inliers]),
        directions=residual_directions(robust.rigid.residuals[inliers]),
        support=rotation_support(moved[inliers], repaired[inliers]),
        uncertainty=model.uncertainty,
        effects=found,
        noise=noise,
        notes=notes if not model.has_tool else tuple(note for note in notes if note.code != "NOT_CONGRUENT"),
        tool=trial,
        orientations=_orientations(robust, source_rotations, reference_rotations, causes, written, kind),
        convention=reading,
        discovery=causes.discovery,
        observations=causes.observations,
        noise_source=noise_source if noise is not None else None,
        kind_of_search="all" if effects == "auto" else "some",
    )
    if method == "paper":
        return paper_fit(fit, tau=tau, n_min=n_min, seed=seed)
    return affine_fit(fit) if method == "affine" else fit


@dataclass(frozen=True, eq=False)
class _Model:
    """The final model of a fit, whatever effects are in it: the robust fit of the moved spots, and how sure it is."""

    robust: RobustFit
    moved: Array
    rotations: Rotation | None
    uncertainty: TransformUncertainty
    left_out: Array
    has_tool: bool


def _model_of(causes: Causes, source: Array, repaired: Array, seed: int) -> _Model:
    rotations = causes.rotations
    trial, joint = causes.trial, causes.in_model
    if joint is not None:
        robust = effects_model.robust_of(joint.fit, repaired)
        calibrated = robust.rigid.predict(joint.fit.moved)
        sure = effects_model.uncertainty_of(joint.fit, calibrated)
        has_tool = any(term.effect == tool_offset.NAME for term in joint.fit.terms)
        left_out = effects_model.left_out_of(joint.fit)
        return _Model(robust, joint.fit.moved, joint.fit.rotations, sure, left_out, has_tool)
    if trial is not None and trial.accepted and trial.fit is not None:
        left = trial.fit.residuals if trial.left_out is None else trial.left_out
        robust = tool_model.robust_of(trial.fit, repaired)
        return _Model(robust, trial.fit.moved, rotations, tool_model.uncertainty_of(trial.fit), left, True)
    robust = causes.exchanged.robust
    inliers = robust.inliers
    points, left = robust.rigid.predict(source)[inliers], robust.rigid.residuals[inliers]
    uncertainty = transform_uncertainty(points, left)
    if len(points) >= LEAST_FOR_DIRECTIONS:
        alike = isotropy_p_value(source[inliers], repaired[inliers], seed=seed)
        uncertainty = uncertainty_by_direction(uncertainty, points, left, alike)
    return _Model(robust, source, rotations, uncertainty, leave_one_out(source, repaired, inliers), False)


def _calibration_of(
    causes: Causes,
    model: _Model,
    names: tuple[str, ...],
    kind: Kind,
    frame: Frame | None,
    provenance: Mapping[str, Any] | None,
) -> Calibration:
    joint, trial = causes.in_model, causes.trial
    robot = causes.observations.robot if causes.observations is not None else None
    return Calibration(
        rotation=model.robust.rigid.rotation,
        translation=model.robust.rigid.translation,
        kind=kind,
        frame=frame or DEFAULT_FRAME[kind],
        ids=names,
        provenance=dict(provenance or {}),
        tool_offset=trial.fit.offset if trial is not None and trial.accepted and trial.fit is not None else None,
        terms=() if joint is None else joint.fit.terms,
        values=() if joint is None else joint.fit.values,
        robot=None if joint is None or robot is None else robot_record(robot),
    )


def _orientations(
    robust: RobustFit,
    source: Rotation | None,
    reference: Rotation | None,
    causes: Causes,
    written: Written | None,
    kind: Kind,
) -> OrientationFit | None:
    if source is None or reference is None:
        return None
    rows = np.flatnonzero(robust.inliers)
    return compare_orientations(
        robust.rigid.rotation,
        source[rows],
        reference[causes.exchanged.permutation[rows]],
        kind=kind,
        source_columns=(written.source if written else None) or "abc",
        reference_columns=(written.reference if written else None) or "abc",
        finding=None if causes.convention is None else causes.convention.finding,
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
