"""What tells a calibration, and the way it is applied, from others, so that none is applied twice."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable

from respot.calibration.calibration import Calibration


def mark_of(calibration: Calibration, *, inverse: bool) -> str:
    """SHA-256 (hex) that tells a calibration, and the way it is applied, from others."""
    own = calibration.content_hash
    return _turned(own) if inverse else own


def still_applied(earlier: Iterable[str], mark: str) -> list[str]:
    """Marks of earlier calibrations that are in force once another is applied: what it turns back is not.

    Points that were turned back are the old ones to the last digit, so that fitting them again gives the very
    calibration that was turned back. It must not count as applied then.
    """
    return [other for other in earlier if _turned(other) != mark and other != _turned(mark)]


def _turned(mark: str) -> str:
    return hashlib.sha256(f"inverse {mark}".encode("ascii")).hexdigest()
