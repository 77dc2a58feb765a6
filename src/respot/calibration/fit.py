"""The fit of paired spots, end to end: as found, names, robust inliers, least squares, held-out errors, report."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from respot.calibration.calibration import Calibration, Frame, Kind
from respot.calibration.causes import Causes, Observe, Question, Written, find_causes
from respot.calibration.discovery.records import effects_of as discovered_effects
from respot.calibration.effects import group_shift, swapped_ids, tool_offset
from respot.calibration.effects.effect import Effect
from respot.calibration.effects.orientations import OrientationFit, compare_orientations
from respot.calibration.effects.readings import reread
from respot.calibration.effects.search import RIGID_ONLY, Effects
from respot.calibration.effects.term import Term
from respot.calibration.final_model import FinalModel, final_model
from respot.calibration.methods import affine_fit, paper_fit
from respot.calibration.pairs import DEFAULT_FRAME, LEAST_PAIRS, Asked, Listed, PairedObserve, Pairs, pair_lists
from respot.calibration.spot_fit import Method, Orientations, SpotFit, Weights
from respot.kinematics.robot_file import robot_record
from respot.registration.affine import fit_affine
from respot.registration.alternatives import fit_translation
from respot.registration.errors import DegenerateError, RegistrationError
from respot.registration.leave_one_out import leave_one_out
from respot.registration.matching import IdMatch, Matching
from respot.registration.pairing import Note
from respot.registration.rigid import RigidFit, check_pairs, fit_rigid
from respot.registration.statistics import residual_directions
from respot.registration.support import rotation_support

Array = NDArray[np.float64]

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
    weights: Weights = "even",
    orientations: Orientations = "compare",
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
    asked = Asked(
        kind=kind,
        frame=frame,
        noise=noise,
        noise_source=noise_source,
        seed=seed,
        method=method,
        tau=tau,
        n_min=n_min,
        effects=effects,
        provenance=provenance,
        written=written,
        nested=nested,
        progress=progress,
        weights=weights,
        orientations=orientations,
    )
    own = Listed(source_ids, np.asarray(source, dtype=np.float64), source_rotations)
    other = Listed(reference_ids, np.asarray(reference, dtype=np.float64), reference_rotations)
    pairs, doubt = pair_lists(own, other, asked, matching, observe)
    fit = _fit(pairs, asked)
    if doubt is not None and not any(effect.name == tool_offset.NAME for effect in fit.effects):
        raise doubt
    return fit


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
    weights: Weights = "even",
    orientations: Orientations = "compare",
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
        Tool orientations in the reference frame. They are compared, and do not move the fit unless ``orientations``
        says so.
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
    weights : "even" or "direction"
        Of the final rigid fit by the method "robust": a residual counts the same along all axes, or by the noise of its
        direction (`respot.registration.anisotropy.fit_weighted`), which at least 7 inliers must tell. A model with
        effects is fitted evenly, and a note says so.
    orientations : "compare" or "fit"
        Whether orientations are compared after the final rigid fit, or fitted with the positions
        (`respot.registration.oriented.fit_rigid_oriented`); with effects as before. Names and inliers are those that
        positions tell by themselves.

    Raises
    ------
    RegistrationError
        ``SHAPE_MISMATCH``, ``NOT_A_NUMBER``, ``TOO_FEW_PAIRS``, ``DUPLICATE_ID``; as `fit_paper` for the method
        "paper"; ``COPLANAR_SPOTS`` for the method "affine"; ``BAD_OPTION`` for an unknown effect, and for weights or
        orientations that do not go together, with the method, or with what the lists mean; ``NO_ORIENTATION``
        or ``TOOL_NOT_DETERMINED`` where a tool offset, or a fit of orientations, is asked for and cannot be tried.
    DegenerateError
        ``COLLINEAR_SPOTS``: on a line, or off it by no more than `LATERAL_NOISE` times the noise.
    """
    names = tuple(str(name) for name in ids)
    asked = Asked(
        kind=kind,
        frame=frame,
        noise=noise,
        noise_source=noise_source,
        seed=seed,
        method=method,
        tau=tau,
        n_min=n_min,
        effects=effects,
        provenance=provenance,
        written=written,
        nested=nested,
        progress=progress,
        weights=weights,
        orientations=orientations,
    )
    pairs = Pairs(
        ids=names,
        source=np.asarray(source, dtype=np.float64),
        reference=np.asarray(reference, dtype=np.float64),
        source_rotations=source_rotations,
        reference_rotations=reference_rotations,
        match=match,
        notes=notes,
        observe=observe,
    )
    return _fit(pairs, asked)


def _fit(pairs: Pairs, asked: Asked) -> SpotFit:
    """Fit pairs by the method that was asked for."""
    _check(pairs.ids, pairs.source, pairs.reference)
    _require_sense(pairs, asked)
    question = Question(
        ids=pairs.ids,
        source=pairs.source,
        reference=pairs.reference,
        rotations=pairs.source_rotations,
        effects=asked.effects,
        kind=asked.kind,
        noise=asked.noise,
        seed=asked.seed,
        observe=pairs.observe,
        reference_rotations=pairs.reference_rotations,
        written=asked.written or Written(),
        nested=asked.nested,
        progress=asked.progress,
        same_frame=asked.same_frame,
    )
    causes = find_causes(question)
    repaired = pairs.reference[causes.exchanged.permutation]
    turned = _read_again(pairs, causes)
    if asked.orientations == "fit":
        _require_same_tool(causes, turned, asked)
    model = final_model(
        causes,
        pairs.source,
        repaired,
        turned,
        weights=asked.weights,
        orientations=asked.orientations,
        seed=asked.seed,
    )
    _require_breadth(model.robust.rigid, model.uncertainty.sigma)
    fit = _collected(pairs, asked, causes, model, repaired)
    if asked.method == "paper":
        return paper_fit(fit, tau=asked.tau, n_min=asked.n_min, seed=asked.seed)
    return affine_fit(fit) if asked.method == "affine" else fit


def _collected(pairs: Pairs, asked: Asked, causes: Causes, model: FinalModel, repaired: Array) -> SpotFit:
    """Everything that was found, with the figures to compare it with."""
    first, second, robust = pairs.source, pairs.reference, model.robust
    inliers, exchanged = robust.inliers, causes.exchanged
    named = pairs.ids if pairs.match is None or not pairs.match.reference_ids else pairs.match.reference_ids
    return SpotFit(
        model=_calibration_of(causes, model, pairs.ids, asked),
        match=pairs.match,
        ids=pairs.ids,
        reference_ids=tuple(named[row] for row in exchanged.permutation),
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
        translation=fit_translation(model.moved[inliers], repaired[inliers]),
        directions=residual_directions(robust.rigid.residuals[inliers]),
        support=rotation_support(model.moved[inliers], repaired[inliers]),
        uncertainty=model.uncertainty,
        effects=_effects_of(pairs, asked, causes),
        noise=asked.noise,
        notes=_notes(pairs, asked, model),
        tool=causes.trial,
        orientations=_orientations(model, pairs, causes, asked),
        convention=causes.convention,
        discovery=causes.discovery,
        observations=causes.observations,
        noise_source=asked.noise_source if asked.noise is not None else None,
        kind_of_search="all" if asked.effects == "auto" else "some",
        weighted=model.weighted,
        oriented=model.oriented,
    )


def _effects_of(pairs: Pairs, asked: Asked, causes: Causes) -> tuple[Effect, ...]:
    found = swapped_ids.effects_of(causes.exchanged, pairs.ids, pairs.reference, kind=asked.kind)
    if causes.frames is not None:
        found = (*found, *causes.frames.effects)
    reading, trial = causes.convention, causes.trial
    if reading is not None and reading.finding is not None:
        found = (*found, reading.finding.effect)
    if trial is not None and trial.effect is not None:
        found = (*found, trial.effect)
    if causes.in_model is None:
        return found
    doubts = () if causes.frames is None else causes.frames.unproved
    return (*found, *(_doubted(effect, doubts) for effect in discovered_effects(causes.in_model)))


def _doubted(effect: Effect, doubts: Sequence[Term]) -> Effect:
    """A moved group that a listed frame would explain as well, though chance may meet it, is not named."""
    rivals = tuple(term.label for term in doubts if effect.name == group_shift.NAME)
    if not rivals:
        return effect
    return replace(effect, named=False, not_separated_from=(*effect.not_separated_from, *rivals))


def _notes(pairs: Pairs, asked: Asked, model: FinalModel) -> tuple[Note, ...]:
    notes = pairs.notes if not model.has_tool else tuple(note for note in pairs.notes if note.code != "NOT_CONGRUENT")
    if asked.plain or model.weighted is not None or model.oriented is not None:
        return notes
    what = "weights by direction" if asked.weights == "direction" else "a fit of orientations"
    message = f"{what} are for a rigid transform alone, and this model has effects: it is plain least squares"
    return (*notes, Note("OPTION_UNUSED", message.replace("orientations are", "orientations is")))


def _read_again(pairs: Pairs, causes: Causes) -> Rotation | None:
    """Tool orientations of the reference, in the order of the repaired names, read as a named convention has it."""
    if pairs.reference_rotations is None:
        return None
    rotations = pairs.reference_rotations
    finding = None if causes.convention is None else causes.convention.finding
    if finding is not None and finding.side == "reference" and finding.effect.named:
        rotations = reread(rotations, finding.reading)
    return rotations[causes.exchanged.permutation]


def _calibration_of(causes: Causes, model: FinalModel, names: tuple[str, ...], asked: Asked) -> Calibration:
    joint, trial = causes.in_model, causes.trial
    robot = causes.observations.robot if causes.observations is not None else None
    how = {"weights": "direction"} if model.weighted is not None else {}
    how |= {"orientations": "fit"} if model.oriented is not None else {}
    return Calibration(
        rotation=model.robust.rigid.rotation,
        translation=model.robust.rigid.translation,
        kind=asked.kind,
        frame=asked.frame or DEFAULT_FRAME[asked.kind],
        ids=names,
        provenance={**dict(asked.provenance or {}), **how},
        tool_offset=trial.fit.offset if trial is not None and trial.accepted and trial.fit is not None else None,
        terms=() if joint is None else joint.fit.terms,
        values=() if joint is None else joint.fit.values,
        robot=None if joint is None or robot is None else robot_record(robot),
    )


def _orientations(model: FinalModel, pairs: Pairs, causes: Causes, asked: Asked) -> OrientationFit | None:
    source, reference, written = pairs.source_rotations, pairs.reference_rotations, asked.written or Written()
    if causes.frames is not None and causes.frames.terms:
        source = causes.frames.observations.rotations
    if source is None or reference is None:
        return None
    rows = np.flatnonzero(model.robust.inliers)
    return compare_orientations(
        model.robust.rigid.rotation,
        source[rows],
        reference[causes.exchanged.permutation[rows]],
        kind=asked.kind,
        source_columns=written.source or "abc",
        reference_columns=written.reference or "abc",
        finding=None if causes.convention is None else causes.convention.finding,
    )


def _require_sense(pairs: Pairs, asked: Asked) -> None:
    """Refuse options that do not go together, or with what the lists have."""
    if asked.plain:
        return
    if asked.method != "robust":
        message = (
            f"weights and orientations are of our own rigid fit: the method {asked.method} has a transform of its own"
        )
        raise RegistrationError("BAD_OPTION", message)
    if asked.orientations == "compare":
        return
    if asked.weights == "direction":
        message = "weights by direction and a fit of orientations each make the transform: ask for one of them"
        raise RegistrationError("BAD_OPTION", message)
    for which, rotations in (("source", pairs.source_rotations), ("reference", pairs.reference_rotations)):
        if rotations is None:
            message = f"the {which} does not tell the orientation of the tool at every spot, and they are to be fitted"
            raise RegistrationError("NO_ORIENTATION", message)


def _require_same_tool(causes: Causes, turned: Rotation | None, asked: Asked) -> None:
    """Refuse to fit orientations that do not mean the same tool directions, under the transform of the positions."""
    robust, own, written = causes.exchanged.robust, causes.rotations, asked.written or Written()
    assert own is not None and turned is not None  # noqa: S101 - asked before
    rows = np.flatnonzero(robust.inliers)
    found = compare_orientations(
        robust.rigid.rotation,
        own[rows],
        turned[rows],
        kind=asked.kind,
        source_columns=written.source or "abc",
        reference_columns=written.reference or "abc",
    )
    if found.code in ("ORIENTATIONS_DISAGREE", "ORIENTATION_CONVENTION"):
        raise RegistrationError("BAD_OPTION", f"orientations cannot be fitted: {found.verdict}")


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
