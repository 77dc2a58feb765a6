"""The one place for numeric tolerances and for how a changed number is rounded and spelled."""

from __future__ import annotations

import re
from dataclasses import dataclass
from decimal import Decimal
from functools import cache, cached_property

#: Decimals that a changed number gets at least, whatever its source had (DESIGN section 4, precision).
LENGTH_DECIMALS = 3
ANGLE_DECIMALS = 4
QUATERNION_DECIMALS = 7
#: The same of a tool or base: its last digit is multiplied by the length of a part.
FRAME_LENGTH_DECIMALS = 6
FRAME_ANGLE_DECIMALS = 6
FRAME_QUATERNION_DECIMALS = 9
#: Digits of points, bases and tools together leave the flange this near to where it was intended.
FLANGE_MM, FLANGE_DEG = 0.01, 0.001
#: No changed number gets more decimals than a double can hold next to a metre.
MOST_DECIMALS = 12

#: Below these a target counts as not moved: no number on a controller resolves them.
SAME_POSITION_MM = 1e-9
SAME_ROTATION_DEG = 1e-9

#: Where A, B, C lock (B = +-90), A and C may go where they like if that turns the pose by no more than this: half the
#: last digit that is printed there.
LOCK_TURN_DEG = 5e-7
#: Cosine of B below which A, B, C get one decimal more, and one more again. Digits lost are lost in the rotation; going
#: back makes them larger by 1 / cos B in A and C, and must not change the last digit of a number by more than one.
STEEP = (0.75, 0.075)

#: A target under another name, used in the same way, is the same target up to this distance.
RENAMED_WITHIN_MM = 10.0

#: An axis that moves less than this between two targets does not move: play stays on the side that it came from.
AXIS_MOVES_DEG = 0.02

#: |q| of a programmed quaternion may differ from 1 by this much; pendants print six digits.
QUATERNION_NORM = 1e-3

#: KRL's numbers to the base 2, 16 and 10: ``'B0101'``, ``'H1F'``, ``'D10'`` (krl.md section 1).
_BASED = re.compile(r"'([BbHhDd])([0-9A-Fa-f]+)'")
_FORMATS = {"B": "b", "H": "X", "D": "d"}
_NUMBER = re.compile(r"([+-]?)(\s*)([0-9]*)(\.?)([0-9]*)(?:([eE])([+-]?)([0-9]+))?")


@dataclass(frozen=True)
class NumberStyle:
    """How a number is spelled in its source: all that `spell` needs to write it again, digit by digit.

    Parameters
    ----------
    decimals : int
        Digits after the point of the mantissa.
    point : bool
        There is a point; ``1.`` has one without decimals.
    digits : int
        Digits before the point at least: 0 for ``.5``, 2 for ``07``.
    exponent : str
        The exponent as written, e.g. ``E+09``; empty if none.
    sign : str
        A written ``+`` or, for a negative zero, ``-``.
    gap : str
        Blanks between sign and digits.
    base : str
        Letter of a KRL number to a base, as written: ``B`` of ``'B0101'``; empty for a decimal number.
    """

    decimals: int
    point: bool = True
    digits: int = 1
    exponent: str = ""
    sign: str = ""
    gap: str = ""
    base: str = ""

    @classmethod
    def of(cls, text: str) -> NumberStyle:
        """Style of a number token.

        Raises
        ------
        ValueError
            The text is no decimal number.
        """
        based = _BASED.fullmatch(text)
        if based is not None:
            return cls(0, point=False, digits=len(based[2]), base=based[1])
        match = _NUMBER.fullmatch(text)
        if match is None or not (match[3] or match[5]):
            raise ValueError(f"{text!r} is no number")
        sign, gap, whole, point, fraction, letter, exponent_sign, exponent = match.groups(default="")
        zero = not (whole + fraction).strip("0")
        return cls(
            decimals=len(fraction),
            point=bool(point),
            digits=len(whole) if whole.startswith("0") or not whole else 1,
            exponent=letter + exponent_sign + exponent,
            sign=sign if sign == "+" or zero else "",
            gap=gap,
        )

    def at_least(self, decimals: int) -> NumberStyle:
        """Style for a changed number: the source's decimals, but never fewer than asked for and without exponent."""
        if self.base and decimals <= 0:
            return self
        own = self.decimals - int(self.exponent[1:] or 0) if self.exponent else self.decimals
        count = min(max(own, decimals), max(MOST_DECIMALS, decimals))
        return NumberStyle(count, point=count > 0)

    @classmethod
    def changed(cls, text: str, decimals: int) -> NumberStyle:
        """Style for a changed number: `of` the old one, `at_least` so many decimals."""
        whole, _, fraction = text.removeprefix("-").partition(".")
        if text.isascii() and whole.isdigit() and fraction.isdigit():  # as nearly all numbers are
            return _plain(min(max(len(fraction), decimals), max(MOST_DECIMALS, decimals)))
        return cls.of(text).at_least(decimals)

    @cached_property
    def is_plain(self) -> bool:
        """Whether all there is to it are digits, and a point where there are decimals."""
        return self == NumberStyle(self.decimals, point=self.decimals > 0)

    @property
    def half_digit(self) -> float:
        """Largest difference that rounding to this style can make."""
        return 0.5 * 10.0**-self.decimals


@cache
def _plain(decimals: int) -> NumberStyle:
    return NumberStyle(decimals, point=decimals > 0)


def spell(value: Decimal | float, style: NumberStyle) -> str:
    """Write ``value`` in ``style``; a rounded negative zero loses its sign.

    >>> spell(-0.00001, NumberStyle(3))
    '0.000'
    >>> spell(Decimal("9E+09"), NumberStyle.of("9E+09"))
    '9E+09'
    """
    exact = value if isinstance(value, Decimal) else Decimal(repr(float(value)))
    if style.is_plain:
        text = f"{exact:.{style.decimals}f}"
        return text[1:] if text[0] == "-" and not text.strip("-0.") else text
    if style.base:
        digits = format(round(exact), _FORMATS[style.base.upper()]).rjust(style.digits, "0")
        return f"'{style.base}{digits}'"
    if style.exponent:
        exact = exact.scaleb(-int(style.exponent[1:]))
    text = f"{exact.copy_abs():.{style.decimals}f}"
    negative = exact < 0 and bool(text.strip("0."))
    whole, _, fraction = text.partition(".")
    whole = whole.rjust(style.digits, "0") if style.digits else whole.lstrip("0")
    sign = "-" if negative else style.sign
    return f"{sign}{style.gap}{whole}{'.' if style.point else ''}{fraction}{style.exponent}"
