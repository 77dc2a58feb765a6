"""What causes the residuals of paired spots: names first, then the tool and all other effects."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from respot.calibration.discovery.discover import LEAST_SPOTS, Discovery, discover
from respot.calibration.discovery.records import effects_of
from respot.calibration.effects import EFFECTS, convention, group_shift, swapped_ids, tool_offset, wrong_frame
from respot.calibration.effects.catalogue import MECHANISMS
from respot.calibration.effects.convention import ConventionTrial, investigate_convention
from respot.calibration.effects.convention_tool import investigate_by_tool
from respot.calibration.effects.moved import moved
from respot.calibration.effects.readings import Columns, reread
from respot.calibration.effects.search import Effects, search_effects
from respot.calibration.effects.term import Term
from respot.calibration.effects.tool_offset import ToolTrial
from respot.calibration.effects.wrong_frame_search import FrameSearch, find_wrong_frames
from respot.calibration.observations import Observations
from respot.registration.errors import RegistrationError
from respot.registration.exchanged import ExchangeResult, find_exchanged
from respot.registration.robust import fit_robust

Array = NDArray[np.float64]
Rows = NDArray[np.intp]
_WITH_FRAMES = "where a frame is wrong, the tool is judged among all other effects"
Observe = Callable[[Rows], Observations]
"""Observations of the pairs, for a permutation (n,) of the reference's rows: names that are exchanged back."""


@dataclass(frozen=True)
class Written:
    """How lists write orientations: ``"abc"`` or ``"quaternion"``; None for a program, whose language says so."""

    source: Columns | None = None
    reference: Columns | None = None


@dataclass(frozen=True, eq=False)
class Causes:
    """What was found.

    Attributes
    ----------
    exchanged : ExchangeResult
        Names; ``robust`` is of the spots moved by an accepted tool offset.
    trial : ToolTrial or None
        The tool offset by itself, where it was looked for; accepted only if discovery, where it ran, has it and nothing
        beside.
    discovery : Discovery or None
        All other effects, where they were looked for.
    observations : Observations or None
        What discovery saw.
    rotations : Rotation of n, or None
        Tool orientations of the source, read as a named convention has it.
    convention : ConventionTrial or None
        Whether a list writes its orientations in another way, where that was asked.
    frames : FrameSearch or None
        Listed frames in the place of written ones, where that was asked; their terms are the first of the discovery's.
    """

    exchanged: ExchangeResult
    trial: ToolTrial | None
    discovery: Discovery | None = None
    observations: Observations | None = None
    rotations: Rotation | None = None
    convention: ConventionTrial | None = None
    frames: FrameSearch | None = None

    @property
    def in_model(self) -> Discovery | None:
        """The discovery, if its effects are the model."""
        alone = self.trial is not None and self.trial.accepted
        return self.discovery if self.discovery is not None and self.discovery.fit.terms and not alone else None


def every_effect() -> tuple[str, ...]:
    """Names of all effects, in the order in which they are looked for."""
    return tuple(dict.fromkeys([*EFFECTS, *MECHANISMS]))


def names_of(effects: Effects) -> tuple[str, ...]:
    """Names of the effects to look for.

    Raises
    ------
    RegistrationError
        ``BAD_OPTION`` for a name that no effect has.
    """
    known = every_effect()
    names = known if effects == "auto" else tuple(effects)
    for name in names:
        if name not in known:
            raise RegistrationError("BAD_OPTION", f"there is no effect {name!r}; there are {', '.join(known)}")
    return names


@dataclass(frozen=True, eq=False)
class Question:
    """Paired spots, and what is asked of them.

    Attributes
    ----------
    ids, source, reference, rotations, kind, noise, seed
        As `respot.calibration.effects.search.search_effects`.
    effects : "auto" or names
    observe : callable, optional
        What else is known of the pairs; default their poses alone.
    reference_rotations : Rotation of n, optional
        Tool orientations of the reference, by the names as given.
    written : Written
        How both lists write orientations; default as programs.
    nested : bool
        As `respot.calibration.discovery.discover.discover`.
    progress : callable
        Called as the work goes on.
    same_frame : bool
        Whether both coordinate systems claim to be the same.
    """

    ids: Sequence[str]
    source: Array
    reference: Array
    rotations: Rotation | None
    effects: Effects
    kind: str
    noise: float | None
    seed: int
    observe: Observe | None = None
    reference_rotations: Rotation | None = None
    written: Written = Written()
    nested: bool = True
    progress: Callable[[], None] = lambda: None
    same_frame: bool = False


def find_causes(asked: Question) -> Causes:
    """Look for causes among paired spots.

    Raises
    ------
    RegistrationError
        As `names_of` and `search_effects`.
    """
    if wrong_frame.NAME not in names_of(asked.effects) or asked.observe is None:
        return _causes(asked, None)
    every = np.arange(len(asked.ids), dtype=np.intp)
    seen = replace(asked.observe(every), positions=asked.source, rotations=asked.rotations)
    frames = find_wrong_frames(seen, asked.reference, same_frame=asked.same_frame, seed=asked.seed)
    found = _causes(asked, frames)
    # what other effects hide may be a listed frame as well, and beside them it is known better
    beside = _beside(found, frames.terms)
    if beside is None:
        return replace(found, frames=frames)
    repaired = asked.reference[found.exchanged.permutation]
    again = find_wrong_frames(seen, repaired, same_frame=asked.same_frame, seed=asked.seed, beside=beside)
    if {term.label for term in again.terms} != {term.label for term in frames.terms}:
        found = _causes(asked, again)
    return replace(found, frames=again)


def _beside(found: Causes, frames: Sequence[Term]) -> Array | None:
    """Shifts (n, 3) by all effects but frames and moved groups, as before the frames; None where no search needs them.

    That is where neither a group moved nor a frame is wrong, or no other effect is at work [mm].
    """
    discovery, seen = found.in_model, found.observations
    if discovery is None or seen is None:
        return None
    pairs = list(zip(discovery.fit.terms, discovery.fit.values, strict=True))
    others = [(term, value) for term, value in pairs if term.effect not in (group_shift.NAME, wrong_frame.NAME)]
    groups = any(term.effect == group_shift.NAME for term, _ in pairs)
    if not groups and not (frames and others):
        return None
    places, _ = moved(seen, [term for term, _ in others], [value for _, value in others])
    return wrong_frame.turned_back(seen, frames, places - seen.positions)


def _causes(asked: Question, frames: FrameSearch | None) -> Causes:
    """Names, convention, tool and all other effects, with the spots where proved frames put them."""
    as_given = asked.rotations
    framed = frames.observations if frames is not None and frames.terms else None
    if framed is not None:
        asked = replace(asked, source=framed.positions, rotations=framed.rotations)
    looked_for = names_of(asked.effects)
    exchanged, trial = _simple(asked)
    reading = None
    if convention.NAME in looked_for and asked.rotations is not None:
        reading = _reading(asked, asked.rotations, exchanged)
        finding = None if reading is None else reading.finding
        if finding is not None and finding.side == "source" and finding.effect.named:
            asked = replace(asked, rotations=reread(asked.rotations, finding.reading))
            exchanged, trial = _simple(asked)
    others = frozenset(name for name in looked_for if name in MECHANISMS and name != wrong_frame.NAME)
    if framed is None and (others <= {tool_offset.NAME} or len(asked.ids) < LEAST_SPOTS):
        return Causes(exchanged, trial, rotations=asked.rotations, convention=reading)
    found, seen = _discovered(asked, exchanged, others, framed)
    if found.accepted and swapped_ids.NAME in looked_for:
        again = find_exchanged(asked.ids, found.fit.moved, asked.reference, seed=asked.seed)
        if not np.array_equal(again.permutation, exchanged.permutation):
            exchanged = again
            found, seen = _discovered(asked, exchanged, others, framed)
    if frames is not None and framed is not None:
        none = (np.zeros(0),) * len(frames.terms)
        fit = replace(found.fit, terms=(*frames.terms, *found.fit.terms), values=(*none, *found.fit.values))
        trial = None if trial is None else replace(trial, accepted=False, effect=None, verdict=_WITH_FRAMES)
        return Causes(exchanged, trial, replace(found, fit=fit), seen, as_given, reading, frames)
    return Causes(*_settled(asked, exchanged, trial, found), found, seen, asked.rotations, reading)


def _simple(asked: Question) -> tuple[ExchangeResult, ToolTrial | None]:
    """Names and the tool by itself."""
    names = names_of(asked.effects)
    simple: Effects = "auto" if asked.effects == "auto" else tuple(name for name in names if name in EFFECTS)
    spots = (asked.ids, asked.source, asked.reference, asked.rotations)
    return search_effects(*spots, simple, kind=asked.kind, noise=asked.noise, seed=asked.seed)


def _discovered(
    asked: Question, names: ExchangeResult, effects: frozenset[str], framed: Observations | None
) -> tuple[Discovery, Observations]:
    """All other effects under some names, and what was known of the spots."""
    seen = Observations(asked.source, asked.rotations)
    if asked.observe is not None:
        seen = replace(asked.observe(names.permutation), positions=asked.source, rotations=asked.rotations)
    if framed is not None:
        measured = None if framed.joints is None else framed.measured_joints
        seen = replace(seen, joints=framed.joints, measured_joints=measured)
    found = discover(
        seen,
        asked.reference[names.permutation],
        inliers=names.robust.inliers,
        noise=asked.noise,
        seed=asked.seed,
        effects=effects,
        nested=asked.nested,
        progress=asked.progress,
    )
    return found, seen


def _reading(asked: Question, rotations: Rotation, exchanged: ExchangeResult) -> ConventionTrial | None:
    """Whether a list writes its orientations in another way; None where neither list can tell."""
    rows, written, others = np.flatnonzero(exchanged.robust.inliers), asked.written, asked.reference_rotations
    if others is None:
        if written.source is None:  # programs are read by their language: there is no other way
            return None
        repaired = asked.reference[exchanged.permutation]
        return investigate_by_tool(
            asked.source, rotations, repaired, seed=asked.seed, kind=asked.kind, columns=written.source
        )
    return investigate_convention(
        rotations[rows],
        others[exchanged.permutation][rows],
        registration=exchanged.robust.rigid.rotation if exchanged.robust.rigid.rank > 1 else None,
        kind=asked.kind,
        source_columns=written.source or "abc",
        reference_columns=written.reference or "abc",
        sides=("reference",) if written.source is None else ("source", "reference"),
    )


def _settled(
    asked: Question, exchanged: ExchangeResult, trial: ToolTrial | None, found: Discovery
) -> tuple[ExchangeResult, ToolTrial | None]:
    """Names and the tool's own trial, with what discovery says of the tool."""
    accepted = [each.term.effect for each in found.accepted]
    if trial is None or not trial.accepted:
        return exchanged, trial
    if accepted == [tool_offset.NAME] and trial.effect is not None:
        own = effects_of(found)[0]
        effect = replace(
            trial.effect,
            named=trial.effect.named and own.named,
            p_value=own.p_value,
            not_separated_from=tuple(dict.fromkeys([*trial.effect.not_separated_from, *own.not_separated_from])),
            rivals=(*trial.effect.rivals, *own.rivals[1:]),
        )
        return exchanged, replace(trial, effect=effect)
    verdict = "beside all other effects a tool offset is not needed" if accepted else "chance explains as much"
    trial = replace(trial, accepted=False, effect=None, verdict=verdict)
    if accepted:
        return exchanged, trial
    if swapped_ids.NAME in names_of(asked.effects):
        return find_exchanged(asked.ids, asked.source, asked.reference, seed=asked.seed), trial
    keep = np.arange(len(asked.ids), dtype=np.intp)
    return ExchangeResult((), keep, fit_robust(asked.source, asked.reference, seed=asked.seed)), trial
