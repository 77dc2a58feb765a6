"""What a person is told about a list whose orientations are written in another convention."""

from __future__ import annotations

from collections.abc import Sequence

from respot.calibration.effects.readings import READINGS, Reading

_LISTS = {
    ("source", "theory"): "the source list",
    ("source", "measured"): "the source list",
    ("reference", "theory"): "the theoretical list",
    ("reference", "measured"): "the measured list",
}

DOUBTS = {
    "wrong_frame": "A frame that is turned between positions and orientations would explain it as well.",
    "half_turn": (
        "Guns that are turned half round at some spots would explain it as well: the lists are 0 or 180 degrees apart."
    ),
}
"""What else may explain it, by the name that ``not_separated_from`` gives it."""


def remedy_text(
    side: str, reading: Reading, side_known: bool, tied: Sequence[Reading], doubts: Sequence[str], kind: str
) -> str:
    """Say which list it is, how it is written, and what to do, in full sentences.

    Parameters
    ----------
    side : str
        ``"source"`` or ``"reference"``.
    reading : Reading
    side_known : bool
        Whether the other list is right for sure.
    tied : sequence of Reading
        Readings that the spots do not tell from this one.
    doubts : sequence of str
        What else would explain it, of `DOUBTS`.
    kind : str
        ``"theory"`` or ``"measured"``.
    """
    first = _LISTS[side, kind]
    words = reading.words
    if side_known:
        what = f"{first.capitalize()} {words}."
    else:
        second = _LISTS["reference" if side == "source" else "source", kind]
        what = f"One of the two lists, {first} or {second}, {words}; orientations alone cannot tell which."
    others = list(dict.fromkeys(each.words for each in tied if each.key != reading.key))
    if others:
        what += f" These spots do not tell it from a list that {'; or '.join(others)}."
    what += "".join(f" {DOUBTS[doubt]}" for doubt in doubts)
    how = "A, B, C in degrees with R = Rz(A) Ry(B) Rx(C)"
    if reading.columns == "quaternion":
        how = "quaternions q1..q4 with the scalar first, from tool to frame"
    elif reading.columns is None:
        how = "orientations from tool to frame, not the reverse"
    return (
        f"{what} Export the list again with {how}, or say how it is written. Positions are not affected. "
        f"{len(READINGS)} readings were tried, beside a constant turn of the tool frame, which is no error."
    )
