"""Which list has the wrong names? Evidence from the naming of mirrored spots, never proof.

Left and right spots of a part are mostly named in one go, so that a spot and its mirror image carry nearby numbers.
Where reference spots are mirror images of each other, the naming that gives mirror pairs nearer numbers is likelier.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_MIRROR_MM = 1.0  # a mirror image is this near to its place in a list of nominal coordinates
_APART_MM = 10.0  # spots nearer than this to the mirror plane have no image of their own
_SHARE = 0.5  # at least this share of the spots has an image, or the part is not symmetric
_CLEAR = 5.0  # numbers of mirror pairs must differ by this factor between the two namings
_MOST_SPOTS = 2000
_NUMBER = re.compile(r"^(.*?)(\d+)$")


@dataclass(frozen=True)
class NamingEvidence:
    """``wrong_list`` is "source", "reference" or "either"; ``reason`` says why, and may be empty."""

    wrong_list: Literal["source", "reference", "either"]
    reason: str


def naming_evidence(rows: Sequence[int], ids: Sequence[str], reference: Array) -> NamingEvidence:
    """Weigh the names of a cycle's spots against the names of their mirror images.

    Parameters
    ----------
    rows : sequence of int
        The cycle: the spot that the source calls ``ids[rows[k]]`` lies where the reference has ``ids[rows[k + 1]]``.
    ids : sequence of n str
    reference : (n, 3) array
        Reference spots as named [mm].
    """
    images = _mirror_images(reference)
    if images is None:
        return NamingEvidence("either", "")
    following = {row: rows[(k + 1) % len(rows)] for k, row in enumerate(rows)}
    by_reference = by_source = 0
    pairs = []
    for row in rows:
        image = int(images[following[row]])
        if image < 0 or image in following:
            return NamingEvidence("either", "")
        gap_reference = _gap(ids[following[row]], ids[image])
        gap_source = _gap(ids[row], ids[image])
        if gap_reference is None or gap_source is None:
            return NamingEvidence("either", "")
        by_reference, by_source = by_reference + gap_reference, by_source + gap_source
        pairs.append((ids[image], ids[following[row]], ids[row]))
    if by_source >= _CLEAR * max(by_reference, 1):
        shown = " and ".join(f"{image} with {name}" for image, name, _ in pairs)
        return NamingEvidence("source", f"the reference pairs mirrored spots under nearby numbers ({shown})")
    if by_reference >= _CLEAR * max(by_source, 1):
        shown = " and ".join(f"{image} with {name}" for image, _, name in pairs)
        return NamingEvidence("reference", f"the source pairs mirrored spots under nearby numbers ({shown})")
    return NamingEvidence("either", "the numbers of mirrored spots favour neither list")


def _gap(first: str, second: str) -> int | None:
    """Difference of the numbers that end two names of the same prefix."""
    one, two = _NUMBER.match(first), _NUMBER.match(second)
    if one is None or two is None or one[1] != two[1]:
        return None
    return abs(int(one[2]) - int(two[2]))


def _mirror_images(points: Array) -> NDArray[np.intp] | None:
    """Row of each spot's mirror image (n,), -1 for none, about the coordinate plane that most spots agree on."""
    if len(points) > _MOST_SPOTS:
        return None
    best: NDArray[np.intp] | None = None
    for axis in range(3):
        others = [k for k in range(3) if k != axis]
        across = np.abs(points[:, None, others] - points[None, :, others]).max(axis=-1) <= _MIRROR_MM
        apart = np.abs(points[:, None, axis] - points[None, :, axis]) >= _APART_MM
        middles = (points[:, None, axis] + points[None, :, axis]) / 2.0
        possible = across & apart
        if not possible.any():
            continue
        ordered = np.sort(middles[possible])
        reach = np.searchsorted(ordered, ordered + _MIRROR_MM, side="right") - np.arange(len(ordered))
        plane = ordered[np.argmax(reach)] + _MIRROR_MM / 2.0
        matches = possible & (np.abs(middles - plane) <= _MIRROR_MM)
        image = np.where(matches.sum(axis=1) == 1, matches.argmax(axis=1), -1)
        if np.mean(image >= 0) >= _SHARE and (best is None or np.sum(image >= 0) > np.sum(best >= 0)):
            best = image.astype(np.intp)
    return best
