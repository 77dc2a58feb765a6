"""Where effects move spots: exactly through the arm, forward and backward."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from respot.calibration.effects import joint_profile, tool_shift, wrong_frame
from respot.calibration.effects.catalogue import MECHANISMS
from respot.calibration.effects.term import Term
from respot.calibration.observations import Observations

Array = NDArray[np.float64]

_TURNS = 20
_STILL_MM, _NEARLY_MM = 1e-10, 1e-6
_NEAR = 1.2
"""A term holds as far as this many half ranges from the middle of what it follows."""


def moved(observations: Observations, terms: Sequence[Term], values: Sequence[Array]) -> tuple[Array, Rotation | None]:
    """Poses of the TCP with the effects in them, source frame.

    Frames that are wrong come first: where they put the spots all else is computed. Errors of joints and lengths go
    through the arm's own kinematics with the tool as it is (DESIGN section 6: ``FK(q + dq, geometry + dg) * tool *
    dtool``); other shifts in the tool turn with it; shifts of the part come last, and are those of the place where the
    tool really is.

    Parameters
    ----------
    observations : Observations
        n spots.
    terms, values : sequences of equal length
        Terms and the values of their parameters.

    Returns
    -------
    ((n, 3) array, Rotation of n or None)
        [mm]
    """
    observations = at_tip(observations, terms, values)
    points, rotations = observations.positions, observations.rotations
    turned: Rotation | None = None
    arm = [(term, value) for term, value in zip(terms, values, strict=True) if _through_arm(term)]
    if arm:
        points, turned = _through(observations, arm)
        rotations = None if rotations is None else turned * rotations
    for term, value in zip(terms, values, strict=True):
        if _through_arm(term) or term.effect in (tool_shift.NAME, wrong_frame.NAME):
            continue
        mechanism = MECHANISMS[term.effect]
        shift = mechanism.shifts(observations, term) @ value
        points = points + (turned.apply(shift) if turned is not None and mechanism.acts == "tool" else shift)
        if mechanism.turns is not None and rotations is not None:
            vectors = mechanism.turns(observations, term) @ value
            rotations = Rotation.from_rotvec(vectors, degrees=True) * rotations
    return points, rotations


def at_tip(observations: Observations, terms: Sequence[Term], values: Sequence[Array]) -> Observations:
    """Return the spots where the frames and a tool offset among the terms have them."""
    return wrong_frame.at_frames(observations, terms).tipped(tip_of(terms, values))


def tip_of(terms: Sequence[Term], values: Sequence[Array]) -> Array:
    """Offset (3,) of the tool among terms, 0 without one [mm]."""
    offsets = [value for term, value in zip(terms, values, strict=True) if term.effect == tool_shift.NAME]
    return np.asarray(np.sum([np.zeros(3), *offsets], axis=0))


def missing(observations: Observations, term: Term) -> str:
    """Say what observations lack that a term needs; empty if nothing."""
    mechanism = MECHANISMS[term.effect]
    if term.effect == wrong_frame.NAME:
        return wrong_frame.lacking(observations, term)
    column = str(term.where.get("column", ""))
    if column:
        if column not in observations.columns:
            return f"the column {column}"
        groups = "level" in term.where or "levels" in term.form
        known = observations.columns[column]
        if (known.labels if groups else known.values) is None:
            return f"the column {column} as {'groups' if groups else 'numbers'}"
    if mechanism.acts in ("joints", "arm") and not observations.has_arm:
        return "joints and a robot model"
    if (mechanism.acts == "tool" or term.form.get("frame") == "tool") and observations.rotations is None:
        return "the orientation of the tool"
    if term.effect == "readback_lag":
        measured, joints = observations.measured_joints, observations.joints
        if measured is None or joints is None or measured.shape != joints.shape or not np.isfinite(measured).all():
            return "measured joints"
    if term.effect == "backlash":
        signs = observations.approach
        if signs is None or not np.isfinite(signs[:, term.where["axis"] - 1]).all():
            return f"the column {term.own}"
    if term.effect == "rail":
        travel = observations.external_axes
        if travel is None or not np.isfinite(travel[:, term.where["external_axis"] - 1]).all():
            return f"external axis {term.where['external_axis']}"
    return ""


def beyond(observations: Observations, term: Term) -> NDArray[np.bool_]:
    """Which spots (n,) stand where a term was never seen: outside the range, or the groups, of what it follows."""
    form = term.form
    if "known" in form:
        column = observations.columns.get(str(term.where.get("column", "")))
        labels = () if column is None or column.labels is None else column.labels
        return np.array([label not in form["known"] for label in labels], dtype=np.bool_)
    if "start" in form and "span" in form:
        values, middle, half = _followed(observations, term), form["start"] + form["span"] / 2.0, form["span"] / 2.0
    elif "full" in form:
        values, middle, half = _followed(observations, term), 0.0, form["full"]
    elif "external_axis" in term.where and observations.external_axes is not None:
        values, middle, half = (
            observations.external_axes[:, term.where["external_axis"] - 1],
            form["middle"],
            form["half"],
        )
    elif joint_profile.MIDDLE in form and observations.joints is not None:
        values = observations.joints[:, term.where["axis"] - 1]
        middle, half = form[joint_profile.MIDDLE], form[joint_profile.HALF]
    else:
        return np.zeros(len(observations), dtype=np.bool_)
    if values is None:
        return np.zeros(len(observations), dtype=np.bool_)
    return np.asarray(np.abs(values - middle) > _NEAR * half)


def _followed(observations: Observations, term: Term) -> Array | None:
    column = observations.columns.get(str(term.where.get("column", "")))
    return None if column is None else column.values


def _through_arm(term: Term) -> bool:
    return MECHANISMS[term.effect].acts == "joints" or term.effect == "link_length"


def _through(observations: Observations, arm: Sequence[tuple[Term, Array]]) -> tuple[Array, Rotation]:
    """TCP (n, 3) of the arm with its errors [mm], and by which rotation its tools are turned; source frame."""
    robot, joints = observations.robot, observations.joints
    assert robot is not None and joints is not None  # noqa: S101 - terms of the arm were made of them
    lengths: dict[str, float] = {}
    for term, value in arm:
        if term.effect == "link_length":
            lengths[term.where["parameter"]] = lengths.get(term.where["parameter"], 0.0) + float(value[0])
        else:
            joints = joints + MECHANISMS[term.effect].columns(observations, term) @ value
    model = robot.with_parameters(lengths) if lengths else robot
    old, new = observations.flange2base, model.forward(joints)
    tip = old.inv().apply(observations.points_in_base)
    base = observations.base2source
    turned = base.rotation * (new.rotation * old.rotation.inv()) * base.rotation.inv()
    return np.asarray(base.apply(new.apply(tip))), turned


def unmoved(observations: Observations, terms: Sequence[Term], values: Sequence[Array], wanted: Array) -> Array:
    """Positions (n, 3) that the effects move to ``wanted`` (n, 3), by fixed point; joints and columns as observed [mm].

    What depends on the place itself (a scale, a turn) is computed at the place found.

    Raises
    ------
    ValueError
        The effects are so large that the places are not found.
    """
    others = [pair for pair in zip(terms, values, strict=True) if pair[0].effect != wrong_frame.NAME]
    framed = wrong_frame.at_frames(observations, terms)
    found, left = wanted.copy(), np.inf
    for _ in range(_TURNS):
        there, _ = moved(framed.at(found), [term for term, _ in others], [value for _, value in others])
        step = wanted - there
        found = found + step
        left = float(np.abs(step).max(initial=0.0))
        if left < _STILL_MM:
            break
    if left < _NEARLY_MM:
        return wrong_frame.before_frames(observations, terms, found)
    raise ValueError(f"the effects are so large that places are found to {left:.3g} mm only")
