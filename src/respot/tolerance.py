"""The one place for numeric tolerances and for how a changed number is rounded."""

from __future__ import annotations

from dataclasses import dataclass

#: Decimals that a changed number gets at least, whatever its source had (DESIGN section 4, precision).
LENGTH_DECIMALS = 3
ANGLE_DECIMALS = 4
QUATERNION_DECIMALS = 7

#: Below these a target counts as not moved: no number on a controller resolves them.
SAME_POSITION_MM = 1e-9
SAME_ROTATION_DEG = 1e-9

#: |q| of a programmed quaternion may differ from 1 by this much; pendants print six digits.
QUATERNION_NORM = 1e-3


@dataclass(frozen=True)
class NumberStyle:
    """How a number is spelled in its source.

    Parameters
    ----------
    decimals : int
        Digits after the point.
    plain_integer : bool
        Spelled without a point, as simulation systems write ``0``.
    """

    decimals: int
    plain_integer: bool = False

    @classmethod
    def of(cls, text: str) -> NumberStyle:
        """Style of a number token. An exponent counts: ``-8.62E-05`` has 7 decimals."""
        mantissa, _, exponent = text.strip().lower().partition("e")
        _, point, fraction = mantissa.partition(".")
        decimals = len(fraction) - (int(exponent) if exponent else 0)
        return cls(max(decimals, 0), plain_integer=not point and not exponent)

    def at_least(self, decimals: int) -> NumberStyle:
        """Give the style for a changed number: the source's decimals, but never fewer than asked for."""
        return NumberStyle(max(self.decimals, decimals))

    @property
    def half_digit(self) -> float:
        """Largest difference that rounding to this style can make."""
        return 0.5 * 10.0**-self.decimals


def spell(value: float, style: NumberStyle) -> str:
    """Write ``value`` in ``style``; never ``-0.000``, never an exponent.

    >>> spell(-0.00001, NumberStyle(3))
    '0.000'
    """
    text = f"{value:.{style.decimals}f}"
    return text.lstrip("-") if float(text) == 0.0 else text
