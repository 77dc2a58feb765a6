"""Which further spots of a source to measure, in which order, and what each buys: behind `respot plan`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats
from scipy.spatial.transform import Rotation

from respot.calibration.calibration import Calibration, CalibrationError
from respot.calibration.discovery.rivals import CLEAR
from respot.calibration.effects.catalogue import MECHANISMS
from respot.calibration.observations import Observations
from respot.calibration.planning.design import Design
from respot.calibration.planning.discrimination import Pair, Unasked, pairs_of
from respot.calibration.planning.estimation import Estimation, ParameterOutlook, estimation_of
from respot.calibration.prediction import UseOptions, columns_at, read_for, refused, seen_by
from respot.calibration.stored import load_calibration
from respot.issues import Issue
from respot.spots import Source

Array = NDArray[np.float64]
Names = tuple[str, str]

_SURE = float(stats.norm.ppf(0.9))
"""A pair is promised where nine measurements of ten will separate it clearly."""
_SHOWN = 8
_BUYS = 0.05


@dataclass(frozen=True)
class PairOutlook:
    """How far two explanations are apart, in standard deviations of the noise.

    Attributes
    ----------
    names : pair of str
        Of the effect and its rival.
    before, after : float
        By the fitted spots; expected with the planned ones, whichever of the two is true.
    with_all : float
        Expected with every spot that is left.
    promised, possible : bool
        Whether the planned spots, or all, are expected to separate them clearly, nine times of ten.
    advice : str
        What measurement tells the effect from what it is confounded with.
    """

    names: Names
    before: float
    after: float
    with_all: float
    promised: bool
    possible: bool
    advice: str


@dataclass(frozen=True, eq=False)
class PlannedSpot:
    """A spot to measure.

    Attributes
    ----------
    id : str
    row : int
        Of the spots that were given.
    order : int
        From 1: the first buys most.
    position : (3,) array
        Source frame [mm].
    turned_deg : float or None
        Angle to the nearest tool orientation of a measured spot; None where not known.
    separates : tuple of pairs of str
        What is promised with this spot and those before it, and is not without it.
    buys : tuple of (pair of str, float, float)
        Pairs that are not separated before it, and that it brings further apart, most first: standard deviations before
        and after it.
    """

    id: str
    row: int
    order: int
    position: Array
    turned_deg: float | None
    separates: tuple[Names, ...]
    buys: tuple[tuple[Names, float, float], ...]


@dataclass(frozen=True, eq=False)
class Plan:
    """What to measure.

    Attributes
    ----------
    spots : tuple of PlannedSpot
        In order.
    pairs : tuple of PairOutlook
    unasked : tuple of Unasked
    parameters : tuple of ParameterOutlook
    worst : (str, float, float) or None
        The spot that is predicted worst now, and the radii of the worst 95 % balls of all spots, before and after [mm].
    measured, candidates : int
        Spots of the source that were measured, and that were not.
    noise_known : bool or None
        Whether the noise is known independently; None where the calibration does not say.
    """

    spots: tuple[PlannedSpot, ...]
    pairs: tuple[PairOutlook, ...]
    unasked: tuple[Unasked, ...]
    parameters: tuple[ParameterOutlook, ...]
    worst: tuple[str, float, float] | None
    measured: int
    candidates: int
    noise_known: bool | None

    def to_dict(self) -> dict[str, Any]:
        """JSON values."""
        worst = None if self.worst is None else dict(zip(("id", "before", "after"), self.worst, strict=True))
        return {
            "measured": self.measured,
            "candidates": self.candidates,
            "noise_known": self.noise_known,
            "spots": [
                {
                    "id": spot.id,
                    "order": spot.order,
                    "separates": [list(names) for names in spot.separates],
                    "buys": [
                        {"names": list(names), "before": before, "after": after} for names, before, after in spot.buys
                    ],
                    **dict(zip("xyz", spot.position.tolist(), strict=True)),
                    "turned_deg": spot.turned_deg,
                }
                for spot in self.spots
            ],
            "pairs": [
                {
                    "names": list(pair.names),
                    "before": pair.before,
                    "after": pair.after,
                    "with_all": pair.with_all,
                    "separated": pair.promised,
                    "separable": pair.possible,
                    "measure": pair.advice,
                }
                for pair in self.pairs
            ],
            "not_planned": [
                {"names": [each.effect.label, each.rival.label], "lacking": each.lacking} for each in self.unasked
            ],
            "parameters": [vars(each) for each in self.parameters],
            "worst": worst,
        }


def plan_spots(
    calibration: Calibration,
    ids: Sequence[str],
    positions: Array,
    rotations: Rotation | None,
    observations: Observations | None,
    count: int,
) -> Plan:
    """Choose further spots to measure.

    Spots are chosen by what they say of explanations that are not told apart, and where they say nothing of them by how
    much surer they make the model; without rivals by this alone. Each spot is measured once. The plan of more spots
    need not hold the plan of fewer; the spots of one plan stand in the order of what they buy.

    Parameters
    ----------
    calibration : Calibration
        With its precision.
    ids : sequence of n str
        All spots, measured ones among them.
    positions : (n, 3) array
        Source frame [mm].
    rotations : Rotation of n, or None
        Tool orientations.
    observations : Observations of n, or None
        What else is known of the spots: needed for effects.
    count : int
        How many to choose.

    Raises
    ------
    CalibrationError
        As `Calibration.predict`; ``CALIBRATION_INCOMPLETE`` where the calibration does not say how sure it is.
    """
    sure, information = calibration.precision, calibration.information
    if sure is None:
        raise CalibrationError("CALIBRATION_INCOMPLETE", "it does not say how sure it is: fit it again")
    done = {name.casefold() for name in (*calibration.ids, *calibration.provenance.get("held_out", ()))}
    measured = np.array([name.casefold() in done for name in ids], dtype=np.bool_)
    # the order of a list must not decide between spots that are worth the same
    free = np.array(sorted(np.flatnonzero(~measured).tolist(), key=lambda row: (ids[row].casefold(), ids[row])))
    free = free.astype(np.intp)
    places, turned = calibration.predict(positions, rotations, observations)
    rows = sure.rows_of(places, columns_at(calibration, positions, rotations, turned, observations))
    estimation = estimation_of(sure, rows[free])
    pairs: list[Pair] = []
    unasked: list[Unasked] = []
    if information is not None and observations is not None and len(free):
        seen = replace(observations, positions=positions, rotations=rotations)
        pairs, unasked = pairs_of(information, seen.rows(free))
    chosen, outlooks, found = _chosen(pairs, estimation, min(count, len(free)))
    return Plan(
        spots=tuple(
            PlannedSpot(
                ids[free[place]],
                int(free[place]),
                order,
                positions[free[place]],
                _turned(rotations, measured, int(free[place])),
                *found[order - 1],
            )
            for order, place in enumerate(chosen, 1)
        ),
        pairs=outlooks,
        unasked=tuple(unasked),
        parameters=estimation.parameters(calibration, len(chosen)),
        worst=_worst(estimation, rows, ids, len(chosen)),
        measured=int(measured.sum()),
        candidates=len(free),
        noise_known=None if information is None else information.noise_known,
    )


def _chosen(
    pairs: Sequence[Pair], estimation: Estimation, count: int
) -> tuple[list[int], tuple[PairOutlook, ...], list[tuple[tuple[Names, ...], tuple[tuple[Names, float, float], ...]]]]:
    """Candidates in order, what becomes of each pair, and what each candidate separates and buys."""
    questions = [question for pair in pairs for question in pair.questions]
    on_hand = [max(pair.apart, 0.0) for pair in pairs for _ in pair.questions]
    owners = np.array([place for place, pair in enumerate(pairs) for _ in pair.questions], dtype=np.intp)
    apart = np.array([pair.apart for pair in pairs])
    at_first = np.array([question.found for question in questions])

    def by_pair(squares: Array, chosen: Sequence[int]) -> Array:
        """What is added to each pair, whichever of its two is true."""
        least = np.full(len(pairs), np.inf)
        np.minimum.at(least, owners, squares)
        return np.asarray(np.maximum(least + [pair.more_directions(chosen) for pair in pairs], 0.0))

    every = range(len(estimation.question.error))
    with_all = by_pair(np.array([question.with_all() for question in questions]) - at_first, every)
    design = Design([*questions, estimation.question], [*on_hand, 0.0])
    rows = design.choose(count)
    for row in rows:
        design.drop(row)
    steps = design.in_order(rows)
    added = [np.zeros(len(pairs))]
    order = [row for row, _ in steps]
    added += [by_pair(squares[:-1] - on_hand, order[:place]) for place, (_, squares) in enumerate(steps, 1)]
    sigmas = [np.sqrt(np.maximum(apart + each, 0.0)) for each in added]
    safe = [_promised(apart, each) for each in added]
    possible = _promised(apart, with_all)
    outlooks = tuple(
        PairOutlook(
            pair.names,
            float(sigmas[0][place]),
            float(sigmas[-1][place]),
            float(np.sqrt(max(pair.apart + with_all[place], 0.0))),
            bool(safe[-1][place]),
            bool(possible[place]),
            MECHANISMS[pair.effect.effect].separates,
        )
        for place, pair in enumerate(pairs)
    )
    found = []
    for (before, after), (one, other) in zip(pairwise(sigmas), pairwise(safe), strict=True):
        separates = tuple(pairs[place].names for place in np.flatnonzero(other & ~one).tolist())
        nearer = ~one & (after - before > _BUYS)
        most = [place for place in np.argsort(before - after, kind="stable").tolist() if nearer[place]]
        buys = tuple((pairs[place].names, float(before[place]), float(after[place])) for place in most)
        found.append((separates, buys))
    return order, outlooks, found


def _promised(apart: Array, added: Array) -> NDArray[np.bool_]:
    """Whether a rival will lose clearly nine times of ten: what is added scatters by twice its root."""
    return np.asarray(apart + added - 2.0 * _SURE * np.sqrt(added) >= CLEAR)


def _turned(rotations: Rotation | None, measured: NDArray[np.bool_], row: int) -> float | None:
    """Angle to the nearest tool orientation of a measured spot [deg]."""
    if rotations is None or not measured.any():
        return None
    return float(np.degrees((rotations[row].inv() * rotations[np.flatnonzero(measured)]).magnitude().min()))


def _worst(estimation: Estimation, rows: Array, ids: Sequence[str], spots: int) -> tuple[str, float, float] | None:
    if not len(rows):
        return None
    before, after = estimation.balls(rows, spots)
    place = int(np.argmax(before))
    return ids[place], float(before[place]), float(after.max())


@dataclass(frozen=True, eq=False)
class SourcePlan:
    """A plan with where it came from."""

    source: Source
    calibration: Calibration
    plan: Plan
    issues: Sequence[Issue]


def plan_source(
    source_path: Path,
    calibration_path: Path,
    count: int,
    options: UseOptions,
    *,
    covariates: Path | None = None,
) -> SourcePlan:
    """Choose further spots of a backup, program or table to measure, by a stored calibration.

    Parameters
    ----------
    source_path, calibration_path : Path
    count : int
    options : UseOptions
    covariates : Path, optional
        Table of columns that effects follow, as they will be when the spots are measured.

    Raises
    ------
    BadInputError
        The source or calibration cannot be used, or they are of different robots.
    """
    calibration = load_calibration(calibration_path)
    source, issues = read_for(calibration, source_path, options)
    asked = calibration
    if calibration.information is not None and not calibration.terms:  # a tool offset alone is stored as such
        kept = calibration.information
        asked = replace(
            calibration, tool_offset=None, precision=None, terms=kept.terms, values=kept.values, robot=kept.robot
        )
    used, observations, found = seen_by(asked, source, options, covariates)
    if asked is not calibration:
        used = calibration
    spots = source.spots
    try:
        plan = plan_spots(used, spots.ids, spots.positions, spots.rotations, observations, count)
    except CalibrationError as error:
        raise refused(error, source_path, calibration_path) from error
    return SourcePlan(source, calibration, plan, [*issues, *found, *_issues(calibration, plan, count, source)])


def _issues(calibration: Calibration, plan: Plan, count: int, source: Source) -> list[Issue]:
    path, issues = str(source.path), []
    if plan.candidates < count:
        left = (
            f"{plan.candidates} spots of it were not measured" if plan.candidates else "every spot of it was measured"
        )
        message = (
            f"{left}, and {count} were asked for. Measured spots may be measured again: three times each tells the "
            "noise, and a mean of repeats is surer; it does not turn the tool or move the arm"
        )
        issues.append(Issue("FEW_CANDIDATES", message, path))
    if calibration.information is None or not calibration.information.rivals:
        chosen = "; the spots are those that make the model surer where it is least sure" if plan.spots else ""
        issues.append(Issue("NOTHING_TO_SEPARATE", f"{_why_nothing(calibration)}{chosen}"))
    for each in plan.unasked:
        message = (
            f"{each.effect.label} and {each.rival.label}: {each.lacking} is not known of the spots; --covariates TABLE "
            "tells columns, --robot the arm"
        )
        issues.append(Issue("NOT_PLANNED", message, path))
    hopeless = {pair.names[0]: pair.advice for pair in plan.pairs if not pair.possible}
    for effect, advice in hopeless.items():
        pairs = [pair for pair in plan.pairs if pair.names[0] == effect and not pair.possible]
        shown = ", ".join(f"{pair.names[1]} ({pair.with_all:.1f} sigma)" for pair in pairs[:_SHOWN])
        more = f" and {len(pairs) - _SHOWN} more" if len(pairs) > _SHOWN else ""
        message = (
            f"all {plan.candidates} spots that are left do not tell {effect} from {shown}{more}. What would: {advice}"
        )
        issues.append(Issue("NOT_SEPARABLE", message, path))
    return issues


def _why_nothing(calibration: Calibration) -> str:
    """Why there is nothing to tell apart."""
    if calibration.information is not None:
        return "every rival of its effects loses clearly already, so there is nothing to tell apart"
    if all(not term.parameters for term in calibration.terms) and calibration.tool_offset is None:
        return "it has no effect that is fitted, so there is nothing to tell apart"
    return (
        "it has effects and keeps no rivals of them: it was stored by an older version, or fitted to too few spots to "
        "look for them; fit it again to plan for them"
    )
