"""Which effects of a calibration a program point can make good, and which only a person can.

What robot, tool or part do at a place, each time they are there, is written into the points of that place. What comes
and goes is not: a new cap, a warm motor or another day would find it in the points where it is no longer in the cell.
An error of reading or of measuring moved no spot at all. A wrong frame is a wrong number in the program: corrected
there, all poses and joints that the other effects were fitted at become those of the program.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from respot.calibration.calibration import Calibration
from respot.calibration.effects import tool_shift
from respot.calibration.effects.catalogue import MECHANISMS, OF_THE_ARM
from respot.calibration.effects.moved import tip_of
from respot.calibration.effects.term import Term
from respot.correction.landing import Errors
from respot.geometry import Array
from respot.issues import BadInputError, Issue

#: Effects that are properties of robot, tool or part.
WRITTEN = frozenset(
    {
        "tool_offset",
        "scale",
        "joint_zero",
        "joint_profile",
        "gear",
        "link_length",
        "link_geometry",
        "gravity_sag",
        "gun_sag",
        "gun_deflection",
        "backlash",
        "group_shift",
        "rail",
        "deformation",
    }
)
#: Columns that name a measurement, not a part of the cell.
_OF_MEASURING = re.compile(r"(.*_)?(session|messreihe)(_?(no|id|name|nr))?")


@dataclass(frozen=True, eq=False)
class Split:
    """The effects of a calibration by what becomes of them.

    Parameters
    ----------
    errors : Errors
        What is written into points.
    issues : sequence of Issue
        What of each effect a person must, or must not, do.
    written, left : sequences of str
        Labels of the effects that are written, and of those that are not.
    """

    errors: Errors
    issues: Sequence[Issue]
    written: Sequence[str]
    left: Sequence[str]

    @property
    def of_the_arm(self) -> bool:
        """Whether the joints of each place matter."""
        return any(term.effect in OF_THE_ARM for term in self.errors.terms)


def split(calibration: Calibration, path: str, *, inverse: bool = False) -> Split:
    """Split the effects of a calibration.

    Parameters
    ----------
    calibration : Calibration
    path : str
        Its file, for messages.
    inverse : bool
        Whether it is used the other way round.

    Raises
    ------
    BadInputError
        ``WRONG_FRAME`` where spots lie under another frame than is written.
    """
    kept: list[tuple[Term, Array]] = []
    issues: list[Issue] = []
    for term, value in zip(calibration.terms, calibration.values, strict=True):
        if term.effect == tool_shift.NAME:  # one offset of the tool, whatever it was found beside
            continue
        remedy = MECHANISMS[term.effect].remedy(term, value).text
        if term.effect == "wrong_frame":
            message = (
                f"{remedy} Points are not the place for it: correct the name of the frame in the programs, or its "
                "data, then fit again and convert"
            )
            raise BadInputError("WRONG_FRAME", message, path)
        if is_written(term):
            kept.append((term, value))
            message = f"{term.label} {_becomes(calibration.kind, inverse=inverse)}. {remedy}"
            issues.append(Issue("EFFECT_WRITTEN", message, path))
        else:
            issues.append(Issue("EFFECT_NOT_WRITTEN", f"{term.label} is not written into points. {remedy}", path))
    offset = tool_offset_of(calibration)
    return Split(
        Errors([term for term, _ in kept], [value for _, value in kept], offset),
        issues,
        [*([] if offset is None else [tool_shift.NAME]), *(term.label for term, _ in kept)],
        [term.label for term in calibration.terms if not is_written(term)],
    )


def tool_offset_of(calibration: Calibration) -> Array | None:
    """Offset (3,) of the tool in a calibration, by itself or among other effects [mm]; None without one."""
    own = calibration.tool_offset
    if all(term.effect != tool_shift.NAME for term in calibration.terms):
        return own
    offset = tip_of(calibration.terms, calibration.values)
    return offset if own is None else own + offset


def _becomes(kind: str, *, inverse: bool) -> str:
    """Say what becomes of an effect."""
    if inverse == (kind == "theory"):
        return "is written into the points: do not put it right elsewhere as well"
    if inverse:
        return "is taken out of the points"
    return "is in the points now: they are where the real robot goes with it"


def is_written(term: Term) -> bool:
    """Whether a point can make an effect good."""
    if term.effect == "group_shift" and _OF_MEASURING.fullmatch(str(term.where.get("column", "")).strip().casefold()):
        return False
    return term.effect in WRITTEN
