"""Effect ``wrong_frame``: spots lie where another listed tool or base would put them, not the one that is written.

World pose of a spot, KUKA and ABB: ``base2world * target`` (ABB: ``uframe * oframe * target``), so base k in the place
of base j moves it by ``D = B_k B_j^-1``, whatever the target. With tool k in the place of tool j at the same flange the
TCP is at ``P T_j^-1 T_k``. Both are exact and known from the backup: the term has no parameter, and is applied before
all other effects, as repaired names are. `respot.calibration.effects.wrong_frame_search` looks for it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from respot.calibration.effects.effect import Remedy, RemedyPlace
from respot.calibration.effects.term import Mechanism, Term
from respot.calibration.observations import Observations
from respot.calibration.spot_frames import FrameKind, ListedFrame, SpotFrames
from respot.geometry import IDENTITY

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Part = Literal["tool", "base", "uframe", "oframe"]

NAME = "wrong_frame"
SAME_MM, SAME_DEG = 1e-3, 1e-4
"""Frames that are nearer than this are the same numbers."""


@dataclass(frozen=True, eq=False)
class Exchange:
    """A listed frame in the place of the one that is written.

    Attributes
    ----------
    part : str
        ``"tool"``, ``"base"``, or of a work object its ``"uframe"`` or ``"oframe"`` alone.
    written, real : ListedFrame
    motion : RigidTransform
        ``D`` of a base, world; ``T_j^-1 T_k`` of a tool, in the axes of the written tool.
    alike : tuple of str
        Other listed frames that put the spots in the same places.
    """

    part: Part
    written: ListedFrame
    real: ListedFrame
    motion: RigidTransform
    alike: tuple[str, ...] = ()

    @property
    def kind(self) -> FrameKind:
        """Tool or base."""
        return "tool" if self.part == "tool" else "base"

    def term(self, place: Mapping[str, str]) -> Term:
        """Term of the spots that name the written frame, of one group where a place is given: column and level."""
        where = {**place, "frame": self.part, "written": self.written.name, "real": self.real.name}
        form = {
            "translation": np.asarray(self.motion.translation).tolist(),
            "quaternion": self.motion.rotation.as_quat(scalar_first=True).tolist(),
        }
        return Term(NAME, where, (), form, own=place.get("column", ""))


def exchanges(frames: SpotFrames, kind: FrameKind, name: str) -> list[Exchange]:
    """Every other listed frame in the place of one, those that are the same numbers once.

    A work object's user or object frame alone comes after whole ones; what a whole one does already is not repeated.
    """
    listed = frames.listed[kind]
    written = listed[name]
    found: list[Exchange] = []
    for each in _possible(listed, kind, written):
        if _near(each.motion, IDENTITY):
            continue
        twin = next((place for place, other in enumerate(found) if _near(each.motion, other.motion)), None)
        if twin is None:
            found.append(each)
            continue
        other = found[twin]
        unset = _near(each.real.pose, IDENTITY) and _near(other.real.pose, IDENTITY)  # numbers that nobody filled in
        if each.real.name not in (other.real.name, *other.alike) and not unset:
            found[twin] = replace(other, alike=(*other.alike, each.real.name))
    return found


def _possible(listed: Mapping[str, ListedFrame], kind: FrameKind, written: ListedFrame) -> Iterator[Exchange]:
    for real in listed.values():
        if kind == "tool":
            yield Exchange("tool", written, real, written.pose.inv() * real.pose)
        else:
            yield Exchange("base", written, real, real.pose * written.pose.inv())
    if kind == "tool" or written.user is None:
        return
    back, own = written.pose.inv(), written.user.inv() * written.pose
    for real in listed.values():
        user = IDENTITY if real.user is None else real.user
        yield Exchange("uframe", written, real, user * own * back)
        yield Exchange("oframe", written, real, written.user * (user.inv() * real.pose) * back)


def _near(one: RigidTransform, other: RigidTransform) -> bool:
    if float(np.linalg.norm(np.asarray(one.translation) - np.asarray(other.translation))) > SAME_MM:
        return False
    return float(np.degrees((one.rotation.inv() * other.rotation).magnitude())) <= SAME_DEG


def moved_by(exchange: Exchange, positions: Array, rotations: Rotation | None) -> tuple[Array, Rotation | None]:
    """Poses of all n spots under another frame, positions (n, 3) [mm]; those of a tool need orientations."""
    return _moved(exchange.motion, exchange.kind, positions, rotations)


def _moved(
    motion: RigidTransform, kind: str, positions: Array, rotations: Rotation | None
) -> tuple[Array, Rotation | None]:
    if kind == "tool":
        assert rotations is not None  # noqa: S101 - without orientations tools are not exchanged
        return positions + rotations.apply(np.asarray(motion.translation)), rotations * motion.rotation
    return np.asarray(motion.apply(positions)), None if rotations is None else motion.rotation * rotations


def frames_of(terms: Sequence[Term]) -> list[Term]:
    """Terms of this effect among others."""
    return [term for term in terms if term.effect == NAME]


def rows_of(observations: Observations, term: Term) -> Mask:
    """Spots (n,) that a term moves: those that still name the written frame, of its group."""
    frames = observations.frames
    assert frames is not None  # noqa: S101 - `missing` asks first
    named = frames.tools if term.where["frame"] == "tool" else frames.bases
    rows = np.array([name == term.where["written"] for name in named], dtype=np.bool_)
    if "column" in term.where:
        labels = labels_of(observations, term.where["column"])
        rows &= np.array([label == term.where["level"] for label in labels or ()], dtype=np.bool_)
    return rows


def labels_of(observations: Observations, column: str) -> tuple[str, ...] | None:
    """Groups of the spots by a column: by the backup's own program, tool and base, else by the tables'."""
    if observations.frames is not None and column in observations.frames.columns:
        return observations.frames.columns[column]
    known = observations.columns.get(column)
    return None if known is None else known.labels


def lacking(observations: Observations, term: Term) -> str:
    """Say what observations lack that a term of this effect needs; empty if nothing."""
    if observations.frames is None:
        return "the tools and bases that programs name"
    if "column" in term.where and labels_of(observations, term.where["column"]) is None:
        return f"the column {term.where['column']} as groups"
    if term.where["frame"] == "tool" and observations.rotations is None:
        return "the orientation of the tool"
    return ""


def at_frames(observations: Observations, terms: Sequence[Term]) -> Observations:
    """Return the spots where the frames among terms put them, with the joints that reach there; columns stay."""
    for term in frames_of(terms):
        rows, own = rows_of(observations, term), observations.rotations
        points, turned = _moved(_motion_of(term), _kind_of(term), observations.positions, own)
        points = np.where(rows[:, None], points, observations.positions)
        if own is not None and turned is not None:
            own = Rotation.from_quat(np.where(rows[:, None], turned.as_quat(), own.as_quat()))
        joints = observations.joints
        if joints is not None and (found := joints_under(observations, term)) is not None:
            joints = found
        observations = replace(observations, positions=points, rotations=own, joints=joints)
    return observations


def joints_under(observations: Observations, term: Term) -> Array | None:
    """Joints (n, axes) under another base, nearest to those of the written one; None where a spot is out of reach.

    Under another tool the flange, and so the joints, are the same.
    """
    joints, robot = observations.joints, observations.robot
    if joints is None or robot is None or _kind_of(term) == "tool":
        return joints
    base = observations.base2source
    there = base.inv() * (_motion_of(term) * (base * observations.flange2base))
    branches = robot.inverse(there, near=joints)
    apart = np.sum((branches - joints[:, None, :]) ** 2, axis=2)
    known = np.isfinite(apart)
    rows = rows_of(observations, term)
    if not known[rows].any(axis=1).all():
        return None
    nearest = branches[np.arange(len(joints)), np.argmin(np.where(known, apart, np.inf), axis=1)]
    return np.where(rows[:, None], nearest, joints)


def before_frames(observations: Observations, terms: Sequence[Term], points: Array) -> Array:
    """Positions (n, 3) that the frames among terms move to ``points`` (n, 3) [mm]; orientations as observed."""
    for number, term in reversed(list(enumerate(frames_of(terms)))):
        seen = at_frames(observations, frames_of(terms)[:number])
        rows, motion = rows_of(seen, term), _motion_of(term)
        if _kind_of(term) == "tool":
            assert seen.rotations is not None  # noqa: S101 - `lacking` asks first
            back = points - seen.rotations.apply(np.asarray(motion.translation))
        else:
            back = np.asarray(motion.inv().apply(points))
        points = np.where(rows[:, None], back, points)
    return points


def turned_back(observations: Observations, terms: Sequence[Term], shifts: Array) -> Array:
    """Shifts (n, 3) of spots where the frames among terms put them, as they are where these are written [mm]."""
    for term in reversed(frames_of(terms)):
        if _kind_of(term) == "base":
            back = _motion_of(term).rotation.inv().apply(shifts)
            shifts = np.where(rows_of(observations, term)[:, None], back, shifts)
    return shifts


def _motion_of(term: Term) -> RigidTransform:
    turn = Rotation.from_quat(term.form["quaternion"], scalar_first=True)
    return RigidTransform.from_components(np.array(term.form["translation"]), turn)


def _kind_of(term: Term) -> str:
    return "tool" if term.where["frame"] == "tool" else "base"


_PARTS: Mapping[Part, str] = {"tool": "tool", "base": "base", "uframe": "user frame", "oframe": "object frame"}


def remedy_text(exchange: Exchange, place: Mapping[str, str], shift: Array, met: float, rivals: Sequence[str]) -> str:
    """Say what lies where, and what a person should do about it, in full sentences.

    Parameters
    ----------
    exchange : Exchange
    place : mapping
        Column and level, or nothing for all spots under the written frame.
    shift : (3,) array
        What the other frame moves the middle of the spots by, source frame; of a tool, in its axes [mm].
    met : float
        How near the spots come to it [mm, RMS].
    rivals : sequence of str
        Other frames that fit as well.
    """
    whose = f"of {place['column']} {place['level']}" if place else f"under {exchange.written.text}"
    part = _PARTS[exchange.part]
    of_it = "" if exchange.part in ("tool", "base") else f"the {part} of "
    x, y, z = shift.tolist()
    turn = float(np.degrees(exchange.motion.rotation.magnitude()))
    turned = f" and a turn of {turn:.3f} degrees" if turn > SAME_DEG else ""
    axes = " along the tool's axes" if exchange.part == "tool" else ""
    text = (
        f"The spots {whose} lie where {of_it}{exchange.real.text} would put them, not {exchange.written.text} that is "
        f"written: a shift of {x:+.2f} {y:+.2f} {z:+.2f} mm{axes}{turned}, met within {met:.2f} mm."
    )
    if rivals:
        text += f" {', '.join(rivals)} would put them there as well."
    number = "tool" if exchange.kind == "tool" else "base or work object"
    return (
        f"{text} Look which {number} the robot really runs with: correct its name in the program, or its data if they "
        "stand under the wrong name, and fit again."
    )


def remedy_of(exchange: Exchange, text: str) -> Remedy:
    """Where a person fixes it."""
    where: RemedyPlace = exchange.kind
    return Remedy(where, text)


def _no_terms(observations: Observations) -> list[Term]:  # noqa: ARG001 - it is looked for before all others
    return []


def _no_columns(observations: Observations, term: Term) -> Array:  # noqa: ARG001 - nothing about it is fitted
    return np.zeros((len(observations), 3, 0))


def _remedy(term: Term, values: Array) -> Remedy:  # noqa: ARG001
    place: Any = _kind_of(term)
    text = f"Spots lie where {term.where['real']} would put them, not {term.where['written']} that is written."
    return Remedy(place, text)


MECHANISM = Mechanism(
    NAME,
    "part",
    _no_terms,
    _no_columns,
    _remedy,
    needs="a backup with its tools and bases",
    separates="the tool or base that is active on the controller when the program runs",
)
