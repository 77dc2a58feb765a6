"""Where a correction is written: into points alone, or into the bases and tools that are its cause.

Depth changes where a number is written, never where the flange goes (DESIGN section 6). With W the frame that carries
the part and N the other one of a motion, the flange stands at W P N^-1 where the robot holds the gun, and at N (W P)^-1
where it holds the part. Depth `points` writes P1 for P. With W' = W M for a part that is off by M, and N' = N d for a
tool that is wrong by d, the same flange needs P' = W'^-1 W P1 N^-1 N' in both cases; an offset along the base turns by
W'^-1 W. What is off as a whole leaves P' = P: the target keeps its numbers.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from scipy.spatial.transform import RigidTransform

from respot.correction.changeable import Changeable, roles
from respot.correction.points import PointEdit, in_base, moves_at_all
from respot.correction.scope import Moving, Scope
from respot.geometry import Array, batch, distance_mm, replaced, turn_deg
from respot.issues import Issue
from respot.languages import Language
from respot.languages.writing import Templates, changes_of
from respot.program.frames import Frame, PoseLiteral, Role
from respot.program.moves import Move
from respot.program.robot import Robot
from respot.program.targets import Target, TargetKind
from respot.source import Edit


class Causes(Protocol):
    """What of a correction bases and tools are the cause of."""

    def deviation(self, base2spots: RigidTransform) -> RigidTransform | None:
        """Rigid motion of all under a base, in the coordinates in which spots are compared [mm], or None."""

    def tool_change(self, tool: Frame) -> RigidTransform | None:
        """What the data of a tool become on the right, N' = N d; None of a tool that is right."""


@dataclass(frozen=True, eq=False)
class FrameChange:
    """A tool or base that changes.

    Parameters
    ----------
    frame : Frame
    role : str
        ``base`` or ``tool``.
    after : RigidTransform
        Its new pose as a whole [mm].
    literal : PoseLiteral
        What is written anew: of a work object the object frame, or the user frame.
    written : RigidTransform
        New pose of the literal.
    programs : collection of str
        Programs that move with it.
    users : sequence of Moving
        Its targets.
    """

    frame: Frame
    role: Role
    after: RigidTransform
    literal: PoseLiteral
    written: RigidTransform
    programs: Collection[str]
    users: Sequence[Moving]


@dataclass(frozen=True, eq=False)
class Depth:
    """What is written where.

    Parameters
    ----------
    changes : mapping of int to FrameChange
        Changed frames by `id`; none for depth `points`.
    issues : sequence of Issue
        Frames that are off and stay as they are, and why; what may use those that change.
    """

    changes: Mapping[int, FrameChange] = field(default_factory=dict)
    issues: Sequence[Issue] = ()

    def targets(self, moving: Sequence[Moving], poses: RigidTransform) -> RigidTransform:
        """``target2base`` of n targets under the new frames, for those under the old ones."""
        pairs = [_frames(item.moves[0]) for item in moving]
        known = {id(frame): self._change(frame) for pair in pairs for frame in pair} if self.changes else {}
        lefts, rights = ([known.get(id(pair[side])) for pair in pairs] for side in (0, 1))
        rows = [row for row, left in enumerate(lefts) if left is not None]
        if rows:
            poses = replaced(poses, rows, batch([left for left in lefts if left is not None]).inv() * poses[rows])
        rows = [row for row, right in enumerate(rights) if right is not None]
        if rows:
            poses = replaced(poses, rows, poses[rows] * batch([right for right in rights if right is not None]))
        return poses

    def offset(self, move: Move, values: Array) -> Array:
        """Components (3,) of an offset along the base under the new frames, for those under the old ones [mm]."""
        left = self._change(move.workpiece)
        return values if left is None else np.asarray(left.rotation.inv().apply(values))

    def _change(self, frame: Frame | None) -> RigidTransform | None:
        """What a frame gets on its right, F^-1 F'."""
        change = None if frame is None else self.changes.get(id(frame))
        if change is None or frame is None or frame.pose is None:
            return None
        return frame.pose.inv() * change.after


def depth_of(scope: Scope, causes: Causes, changeable: Changeable) -> Depth:
    """Decide which frames change: all that are off and that nothing else uses.

    Parameters
    ----------
    scope : Scope
        What moves.
    causes : Causes
        What of it bases and tools are the cause of.
    changeable : Changeable
        Which of them may be changed.
    """
    wanted: dict[int, tuple[Frame, Role, RigidTransform, Sequence[Moving]]] = {}
    kept: dict[int, str] = {}
    for frame, role, users in roles(scope.moving):
        after = _after(frame, users, causes)
        if after is None or frame.pose is None:
            continue
        objection = "it is both a base and a tool" if id(frame) in wanted else changeable.objection(frame, role)
        if objection:
            kept[id(frame)] = objection
        wanted[id(frame)] = (frame, role, after, users)
    _keep_together(scope, wanted, kept)
    changes = {key: _change(*what, changeable) for key, what in wanted.items() if key not in kept}
    issues = [
        Issue(
            "FRAME_KEPT",
            f"{wanted[key][0]} stays as it is, and its error goes into the points: {reason}",
            wanted[key][0].path,
            wanted[key][0].line,
        )
        for key, reason in kept.items()
    ]
    return Depth(changes, [*issues, *changeable.unseen(change.frame for change in changes.values())])


def _after(frame: Frame, users: Sequence[Moving], causes: Causes) -> RigidTransform | None:
    """New pose of a frame as a whole; None where it is right."""
    if frame.pose is None:
        return None
    after = frame.pose
    carrying = next((item for item in users if any(move.workpiece is frame for move in item.moves)), None)
    if carrying is not None:
        deviation = causes.deviation(carrying.base2spots)
        after = after if deviation is None else after * in_base(carrying.base2spots, deviation)
    else:
        change = causes.tool_change(frame)
        after = after if change is None else after * change
    return after if moves_at_all(frame.pose, after) else None


def _keep_together(scope: Scope, wanted: Mapping[int, object], kept: dict[int, str]) -> None:
    """Keep frames that one target is used with, if any of them stays: one literal cannot be right for two."""
    growing = True
    while growing:
        growing = False
        for item in scope.moving:
            for side in (0, 1):
                frames = {id(frame): frame for move in item.moves if (frame := _frames(move)[side]) is not None}
                changing = [key for key in frames if key in wanted and key not in kept]
                if changing and len(changing) < len(frames):
                    reason = f"{item.target.name} is used with another frame as well"
                    kept |= dict.fromkeys(changing, reason)
                    growing = True


def _frames(move: Move) -> tuple[Frame | None, Frame | None]:
    """Return the frame that carries the part, and the other one."""
    part = move.workpiece
    return part, move.tool if part is move.base else move.base


def _change(
    frame: Frame, role: Role, after: RigidTransform, users: Sequence[Moving], changeable: Changeable
) -> FrameChange:
    literal, user = frame.literal, frame.user_literal
    assert literal is not None  # noqa: S101 - it would be kept
    written = after
    if user is not None:
        # numbers stay where people keep them: a frame that is nothing stays nothing
        if moves_at_all(literal.pose, RigidTransform.identity()):
            written = user.pose.inv() * after
        else:
            literal, written = user, after * literal.pose.inv()
    return FrameChange(frame, role, after, literal, written, changeable.programs(frame), users)


def frame_edit(
    change: FrameChange, points: Mapping[int, RigidTransform], robot: Robot, language: Language, templates: Templates
) -> PointEdit | None:
    """Edit of a tool or base; None where its literal already says the new pose to the last digit.

    Parameters
    ----------
    change : FrameChange
    points : mapping of int to RigidTransform
        New poses of its targets under the old frames, by `id` of the target.
    robot : Robot
    language, templates :
        How it is written.
    """
    literal = change.literal
    components = tuple(float(number.value) for number in literal.numbers.values())
    as_target = Target(
        name=change.frame.name,
        kind=TargetKind.POSE,
        path=literal.path,
        line=literal.line,
        column=1,
        span=literal.span,
        numbers=literal.numbers,
        components=components,
    )
    text = robot.files[literal.path].source.text
    values = language.pose_values([as_target], RigidTransform.concatenate([change.written]))[0]
    usual = language.decimals(as_target)
    decimals = {name: max(least, usual[name]) for name, least in language.frame_decimals.items()}
    changes = changes_of(text, literal.numbers, values, decimals)
    if not changes:
        return None
    replacement = templates.frame(text, literal.span, changes)
    pairs = [(item.target.pose, points[id(item.target)]) for item in change.users if item.target.pose is not None]
    return PointEdit(
        path=literal.path,
        line=literal.line,
        target=str(change.frame),
        programs=frozenset(change.programs),
        edit=Edit(literal.span, replacement, change.role),
        before=text[slice(*literal.span)],
        after=replacement,
        intended=values,
        shift_mm=max((float(distance_mm(*pair)) for pair in pairs), default=0.0),
        turn_deg=max((float(turn_deg(*pair)) for pair in pairs), default=0.0),
        depth=change.role,
    )
