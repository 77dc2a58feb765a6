"""Effect ``convention``: one list's orientations are written in another way than they were read.

The right reading proves itself: ``reference = registration * source * turn`` with one turn between the tool frames, for
all spots. That turn is no error (a probe's frame, a Z axis that points the other way) and is allowed for. Another
reading is believed only where the lists disagree as written, agree several times better when one of them is read the
other way, and disagree under every reading that means something else on these spots.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from respot.calibration.effects.convention_text import DOUBTS, remedy_text
from respot.calibration.effects.effect import Effect, Remedy
from respot.calibration.effects.readings import (
    Columns,
    Reading,
    Rotations,
    foreign_readings,
    own_readings,
    read_all,
)
from respot.calibration.effects.turns import Turns, one_sided, two_sided
from respot.geometry import quaternion_from_rotation, rotation_from_quaternion

Array = NDArray[np.float64]
Side = Literal["source", "reference"]

NAME = "convention"
LEAST = 5

DISAGREE_DEG = 1.0
"""Lists that agree this well as written need no other reading."""
AGREE_DEG = 5.0
"""A reading under which more than this is left is not the right one."""
CLEARLY = 0.2
"""Another reading must leave this part of what is left as written, or less."""
TIED = 2.0
"""Readings that leave less than this times the best one's spread are not told apart from it."""
FAMILY_DEG = 3.0
FAMILIES_KNOWN, FAMILIES_JOINT = 3, 4
"""Different orientations that it takes, with the registration known from positions and without."""

_SAME = 1.02  # what is left under two readings that are one on these spots
_DUST_DEG = 1e-4  # printing
_HALF_TURN_DEG = 3.0
_FRAME, _HALF_TURN = DOUBTS
_LABEL = {"source": "the source", "reference": "the reference"}


@dataclass(frozen=True, eq=False)
class ConventionFinding:
    """A reading under which the lists agree.

    Attributes
    ----------
    side : "source" or "reference"
        The list that is read another way.
    reading : str
        Key of the reading (`respot.calibration.effects.readings.READINGS`).
    text : str
        "the reference has its angles about moving x, y, z".
    rotations : Rotation of n
        That list, read again.
    spread_before, spread_after : float
        Four in five spots stay within this, as written and under the reading, beside a constant turn [`unit`].
    runner_up : str or None
        Best reading that is not tied with this one, as "reference: xyz_moving".
    runner_up_spread : float
        What it leaves [`unit`].
    tied : tuple of str
        Readings that these spots do not tell from this one, as "source: sign_a".
    side_known : bool
        Whether the other list, read the same way, would not do as well.
    turn : (3,) array or None
        Rotation vector of the constant turn from the source's tool frame to the reference's [deg].
    unit : "deg" or "mm"
    effect : Effect
    """

    side: Side
    reading: str
    text: str
    rotations: Rotation
    spread_before: float
    spread_after: float
    runner_up: str | None
    runner_up_spread: float
    tied: tuple[str, ...]
    side_known: bool
    turn: Array | None
    unit: Literal["deg", "mm"]
    effect: Effect


@dataclass(frozen=True, eq=False)
class ConventionTrial:
    """What became of the search for another reading.

    Attributes
    ----------
    finding : ConventionFinding or None
    verdict : str
        Why, in words.
    """

    finding: ConventionFinding | None
    verdict: str

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON object of ``effects_tried``."""
        return {"name": NAME, "accepted": self.finding is not None, "verdict": self.verdict}


@dataclass(frozen=True, eq=False)
class Tried:
    """One reading of one list, tried."""

    side: Side
    reading: Reading
    row: int
    spread: float
    extra: float  # size of what had to be allowed for: between equal readings the smaller one is preferred

    @property
    def label(self) -> str:
        """Side and key."""
        return f"{self.side}: {self.reading.key}"


def find_convention(
    source_rotations: Rotation,
    reference_rotations: Rotation,
    *,
    registration: Array | None,
    kind: str,
    source_columns: Columns = "abc",
    reference_columns: Columns = "abc",
    source_numbers: Array | None = None,
    reference_numbers: Array | None = None,
    sides: Sequence[Side] = ("source", "reference"),
) -> ConventionFinding | None:
    """Find the list whose orientations are written in another convention. Parameters as `investigate_convention`."""
    return investigate_convention(
        source_rotations,
        reference_rotations,
        registration=registration,
        kind=kind,
        source_columns=source_columns,
        reference_columns=reference_columns,
        source_numbers=source_numbers,
        reference_numbers=reference_numbers,
        sides=sides,
    ).finding


def investigate_convention(
    source_rotations: Rotation,
    reference_rotations: Rotation,
    *,
    registration: Array | None,
    kind: str,
    source_columns: Columns = "abc",
    reference_columns: Columns = "abc",
    source_numbers: Array | None = None,
    reference_numbers: Array | None = None,
    sides: Sequence[Side] = ("source", "reference"),
) -> ConventionTrial:
    """Look for a list whose orientations are written in another convention, and say what came of it.

    Parameters
    ----------
    source_rotations, reference_rotations : Rotation of n
        Tool orientations of the same spots, each in its own frame, as read in our convention.
    registration : (3, 3) array or None
        Source to reference, from positions; None: found from the orientations.
    kind : str
        ``"theory"`` or ``"measured"``.
    source_columns, reference_columns : "abc" or "quaternion"
        What each list is written in.
    source_numbers, reference_numbers : (n, 3) array, optional
        A, B, C as they stand in the list, degrees. Without them they are computed from the rotations, and rows with B
        at 90 degrees cannot be judged.
    sides : sequence of "source" and "reference"
        Lists that may be wrong; robot programs cannot: the controller has the one convention.
    """
    n = len(source_rotations)
    if n < LEAST:
        return ConventionTrial(None, f"a convention is judged by {LEAST} spots with orientations or more, not {n}")
    lists = _Lists(
        {"source": source_rotations, "reference": reference_rotations},
        {"source": source_columns, "reference": reference_columns},
        {"source": source_numbers, "reference": reference_numbers},
        registration,
        kind,
    )
    written = lists.as_written(registration is not None)
    before = float(written.spread[0])
    if before <= DISAGREE_DEG:
        return ConventionTrial(None, f"orientations agree as written (within {before:.2f} degrees)")
    verdict = ""
    for choose in (own_readings, foreign_readings):
        turns = {side: lists.turns(side, choose(lists.columns[side])) for side in sides}
        tried = [each for side in sides for each in _tried(side, *turns[side])]
        best, tied, runner_up = rank(tried)
        if best is None or best.spread > min(CLEARLY * before, AGREE_DEG):
            left = "" if best is None or not np.isfinite(best.spread) else f": {best.spread:.1f} under the best"
            verdict = verdict or (
                f"orientations disagree by {before:.1f} degrees as written, and no other reading makes them agree{left}"
            )
            continue
        return _accept(lists, written, best, tied, runner_up, turns[best.side])
    return ConventionTrial(None, verdict)


@dataclass(frozen=True, eq=False)
class _Lists:
    """Both lists and how they were written."""

    rotations: dict[Side, Rotation]
    columns: dict[Side, Columns]
    numbers: dict[Side, Array | None]
    registration: Array | None
    kind: str

    def as_written(self, registered: bool) -> Turns:
        """The best constant turn without another reading; with ``registered`` under the known registration."""
        first, second = (quaternion_from_rotation(self.rotations[side])[None, None] for side in ("source", "reference"))
        both = np.broadcast_to(first, (1, 2, *first.shape[2:])), np.broadcast_to(second, (1, 2, *second.shape[2:]))
        known = np.ones(first.shape[1:3], dtype=np.bool_)
        return self._fit(*both, known, registered)

    def turns(self, side: Side, readings: Sequence[Reading]) -> tuple[Rotations, Turns]:
        """The best constant turn under each reading of one list."""
        read = read_all(self.rotations[side], readings, self.columns[side], self.numbers[side])
        other = quaternion_from_rotation(self.rotations["reference" if side == "source" else "source"])
        same = np.broadcast_to(other, (1, 2, *other.shape))
        pair = (read.quaternions, same) if side == "source" else (same, read.quaternions)
        return read, self._fit(*pair, read.known, self.registration is not None)

    def _fit(self, source: Array, reference: Array, known: NDArray[np.bool_], registered: bool) -> Turns:
        if not registered:
            return two_sided(source, reference, known)
        assert self.registration is not None  # noqa: S101 - the caller's meaning of registered
        left = quaternion_from_rotation(Rotation.from_matrix(self.registration))
        return one_sided(source, reference, known, left)


def _tried(side: Side, read: Rotations, turns: Turns) -> list[Tried]:
    size = 2.0 * np.degrees(np.arccos(np.clip(np.abs(turns.right[:, 0]), 0.0, 1.0)))
    return [
        Tried(side, reading, row, float(turns.spread[row]), float(size[row]))
        for row, reading in enumerate(read.readings)
    ]


def rank(tried: Sequence[Tried], dust: float = _DUST_DEG) -> tuple[Tried | None, tuple[Tried, ...], Tried | None]:
    """The best reading, those that the spots do not tell from it, and the best of the others.

    Of readings that leave the same, the one that takes the smallest turn of the tool frame is best, then the reference
    (robot programs are read by robots), then the likeliest.
    """
    if not tried:
        return None, (), None
    least = min(each.spread for each in tried)
    if not np.isfinite(least):
        return None, (), None
    equal = [each for each in tried if each.spread <= _SAME * least + dust]
    smallest = min(each.extra for each in equal)
    plain = [each for each in equal if each.extra <= smallest + 1.0]
    best = min(plain, key=lambda each: (each.side != "reference", each.row))
    tied = tuple(each for each in tried if each is not best and each.spread <= TIED * least + dust)
    others = [each for each in tried if each is not best and each not in tied]
    return best, tied, min(others, key=lambda each: each.spread, default=None)


def _accept(
    lists: _Lists,
    written: Turns,
    best: Tried,
    tied: tuple[Tried, ...],
    runner_up: Tried | None,
    found: tuple[Rotations, Turns],
) -> ConventionTrial:
    read, turns = found
    before = float(written.spread[0])
    inliers = turns.angles[best.row] <= 3.0 * best.spread + _DUST_DEG
    trusted = lists.rotations["reference" if best.side == "source" else "source"]
    needed = FAMILIES_JOINT if lists.registration is None else FAMILIES_KNOWN
    families = count_families(trusted[np.flatnonzero(inliers)], max(FAMILY_DEG, 4.0 * best.spread), needed)
    if families < needed:
        return ConventionTrial(
            None,
            f"orientations disagree by {before:.1f} degrees as written and agree if {_LABEL[best.side]} "
            f"{best.reading.words}, but they are only {families} different ones: {needed} are needed to tell a "
            "convention from a turned frame",
        )
    frame = float(lists.as_written(False).spread[0]) if lists.registration is not None else np.inf
    quaternions = read.quaternions[best.row][turns.chosen[best.row], np.arange(len(inliers))]
    right = rotation_from_quaternion(turns.right[best.row])
    evidence = {
        "spread_before_deg": before,
        "spread_after_deg": best.spread,
        "constant_turn_deg": float(np.degrees(right.magnitude())),
        "families_at_least": families,
        "rows_not_judged": int(np.count_nonzero(~read.known[best.row])),
    }
    doubts = [_FRAME] if frame <= TIED * best.spread + _DUST_DEG else []
    near = max(_HALF_TURN_DEG, 3.0 * best.spread)
    if bool(np.all(np.minimum(written.angles[0], np.abs(180.0 - written.angles[0]))[inliers] < near)):
        doubts.append(_HALF_TURN)
    finding = finding_of(best, tied, runner_up, before, lists.kind, "deg", evidence, doubts=doubts)
    finding = replace(finding, rotations=rotation_from_quaternion(quaternions), turn=np.degrees(right.as_rotvec()))
    return ConventionTrial(
        finding,
        f"orientations disagree by {before:.1f} degrees as written, and agree within {best.spread:.2f} if "
        f"{finding.text}",
    )


def finding_of(
    best: Tried,
    tied: tuple[Tried, ...],
    runner_up: Tried | None,
    before: float,
    kind: str,
    unit: Literal["deg", "mm"],
    evidence: dict[str, Any],
    *,
    doubts: Sequence[str] = (),
    named: bool = True,
    gain: float = 0.0,
) -> ConventionFinding:
    """Put the record together; its ``rotations`` are for the caller to fill in.

    Parameters
    ----------
    best, tied, runner_up
        As `rank` gave them.
    before : float
        Spread as written [unit].
    kind, unit, evidence
        For the record.
    doubts : sequence of str
        What else explains it, of `respot.calibration.effects.convention_text.DOUBTS`.
    named : bool
        Whether it may be named if nothing is tied with it.
    gain : float
        What the effect gains on held-out spots [mm].
    """
    side_known = all(each.reading.key != best.reading.key for each in tied)
    rivals = tuple(dict.fromkeys(each.reading.key for each in tied if each.reading.key != best.reading.key))
    text = f"{_LABEL[best.side]} {best.reading.words}"
    labels = tuple(each.label for each in tied)
    effect = Effect(
        name=NAME,
        where={"list": best.side if side_known else "either", "reading": best.reading.key},
        named=named and not rivals and not doubts,
        remedy=Remedy(
            "spot_list",
            remedy_text(best.side, best.reading, side_known, [each.reading for each in tied], doubts, kind)
            + f" Spread as written {before:.2f} {unit}, read so {best.spread:.2f}"
            + ("." if runner_up is None else f", under the best other reading {runner_up.spread:.2f} {unit}."),
        ),
        heldout_gain=gain,
        not_separated_from=(*(f"{NAME} ({key})" for key in rivals), *doubts),
        evidence={
            **evidence,
            "tied": list(labels),
            "runner_up": None if runner_up is None else runner_up.label,
            "runner_up_spread": _finite(runner_up),
            "unit": unit,
        },
    )
    return ConventionFinding(
        side=best.side,
        reading=best.reading.key,
        text=text,
        rotations=Rotation.identity(),
        spread_before=before,
        spread_after=best.spread,
        runner_up=None if runner_up is None else runner_up.label,
        runner_up_spread=np.inf if runner_up is None else runner_up.spread,
        tied=labels,
        side_known=side_known,
        turn=None,
        unit=unit,
        effect=effect,
    )


def _finite(tried: Tried | None) -> float | None:
    return None if tried is None or not np.isfinite(tried.spread) else tried.spread


def count_families(rotations: Rotation, apart: float, enough: int) -> int:
    """How many orientations lie more than ``apart`` degrees from one another, found greedily, at most ``enough``."""
    if len(rotations) == 0:
        return 0
    nearest = np.degrees((rotations[0].inv() * rotations).magnitude())
    count = 1
    while count < enough and nearest.max() > apart:
        centre = rotations[int(np.argmax(nearest))]
        nearest = np.minimum(nearest, np.degrees((centre.inv() * rotations).magnitude()))
        count += 1
    return count
