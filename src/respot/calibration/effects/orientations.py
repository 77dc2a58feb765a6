"""Tool orientations of source and reference, compared under the fitted rotation: constant turns and wrong conventions.

Orientations never move the fit: a convention that one list got wrong would move the positions with it. They are looked
at afterwards, and what they say is reported.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from respot.calibration.effects.convention import ConventionFinding, find_convention
from respot.calibration.effects.readings import Columns

Array = NDArray[np.float64]

TURN_DEG = 0.5
"""A constant turn below this is the scatter of orientations."""
SCATTER_DEG = 5.0
"""Above this (RMS about the constant turn) the two lists do not mean the same orientations."""


@dataclass(frozen=True, eq=False)
class OrientationFit:
    """How orientations compare; all angles in degrees.

    Attributes
    ----------
    as_found, after : (n,) arrays
        Angle between source and reference orientation, without any transform and under the fitted rotation.
    turn : (3,) array
        Rotation vector, tool frame, of the constant turn from the source's tool frame to the reference's.
    scatter : (n,) array
        Angle that is left at each spot beside the constant turn.
    convention : str or None
        Another way to read one of the lists under which they agree far better.
    code : str or None
        ``ORIENTATIONS_TURNED``, ``ORIENTATION_CONVENTION`` or ``ORIENTATIONS_DISAGREE``, where there is something.
    verdict : str
        What it comes to, in words.
    """

    as_found: Array
    after: Array
    turn: Array
    scatter: Array
    convention: str | None
    code: str | None
    verdict: str

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON object ``orientations`` of a fit."""
        return {
            "unit": "deg",
            "as_found": _figures(self.as_found),
            "after": _figures(self.after),
            "constant_turn": {"angle": float(np.linalg.norm(self.turn)), "rotation_vector": self.turn.tolist()},
            "beside_the_turn": _figures(self.scatter),
            "convention": self.convention,
            "verdict": self.verdict,
        }


def _figures(angles: Array) -> dict[str, float | int]:
    return {
        "rms": _rms(angles),
        "mean": float(angles.mean()),
        "max": float(angles.max()),
        "n": len(angles),
    }


def _rms(angles: Array) -> float:
    return float(np.sqrt(np.mean(angles**2)))


def compare_orientations(
    rotation: Array,
    source: Rotation,
    reference: Rotation,
    *,
    kind: str = "measured",
    source_columns: Columns = "abc",
    reference_columns: Columns = "abc",
    finding: ConventionFinding | None = None,
) -> OrientationFit:
    """Compare orientations under the rotation that the positions gave.

    Parameters
    ----------
    rotation : (3, 3) array
        Source to reference.
    source, reference : Rotation of n
        Tool orientations of the same spots, each in its own frame, as they were read.
    kind : str
        ``"theory"`` or ``"measured"``.
    source_columns, reference_columns : "abc" or "quaternion"
        What each list is written in.
    finding : ConventionFinding, optional
        Of the effect ``convention``, where it is known already; searched for otherwise.
    """
    turned = Rotation.from_matrix(rotation) * source
    found, after = _angles(source, reference), _angles(turned, reference)
    turn, scatter = _constant_turn(rotation, source, reference)
    angle = float(np.linalg.norm(turn))
    code = None
    if finding is None and _rms(scatter) > SCATTER_DEG:
        finding = find_convention(
            source,
            reference,
            registration=rotation,
            kind=kind,
            source_columns=source_columns,
            reference_columns=reference_columns,
        )
    convention = None if finding is None else finding.text
    if finding is not None:
        code = "ORIENTATION_CONVENTION"
        verdict = _convention_text(finding, _rms(scatter))
    elif _rms(scatter) > SCATTER_DEG:
        code = "ORIENTATIONS_DISAGREE"
        verdict = (
            f"orientations disagree by {_rms(scatter):.1f} degrees (RMS) beside any constant turn, and no other "
            "convention explains it: the two lists do not mean the same tool directions"
        )
    elif angle > max(TURN_DEG, 3.0 * _rms(scatter) / np.sqrt(len(after))):
        code = "ORIENTATIONS_TURNED"
        axis = turn / angle
        verdict = (
            f"the tool frame of the reference is turned by {angle:.2f} degrees about ({axis[0]:+.2f} {axis[1]:+.2f} "
            f"{axis[2]:+.2f}) of the source's tool frame at all spots ({_rms(scatter):.2f} degrees are left): a "
            "constant turn of the tool frame, or a convention"
        )
    else:
        verdict = f"orientations agree within {_rms(after):.2f} degrees (RMS)"
    return OrientationFit(found, after, turn, scatter, convention, code, verdict)


def _convention_text(finding: ConventionFinding, scatter: float) -> str:
    unsure = "" if finding.side_known else ", or the other list does: orientations alone cannot tell which"
    others = "" if finding.effect.named else " (other readings or a turned frame would do as well on these spots)"
    return (
        f"orientations disagree by {scatter:.1f} degrees (RMS), and agree if {finding.text}{unsure}{others}: the "
        "convention of that list is probably wrong. Positions are not touched by it"
    )


def _angles(first: Rotation, second: Rotation) -> Array:
    return np.asarray(np.degrees((first.inv() * second).magnitude()), dtype=np.float64)


def _constant_turn(rotation: Array, source: Rotation, reference: Rotation) -> tuple[Array, Array]:
    between = (Rotation.from_matrix(rotation) * source).inv() * reference
    mean = between.mean()
    return np.degrees(mean.as_rotvec()), np.asarray(np.degrees((mean.inv() * between).magnitude()), dtype=np.float64)
