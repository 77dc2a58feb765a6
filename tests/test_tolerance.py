"""Spelling of numbers."""

from __future__ import annotations

from decimal import Decimal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from respot.tolerance import NumberStyle, spell

SPELLED = st.from_regex(r"[+-]?([0-9]{1,12}(\.[0-9]{0,12})?|\.[0-9]{1,12})([eE][+-]?[0-9]{1,2})?", fullmatch=True)


@given(SPELLED)
def test_a_number_is_spelled_as_it_was_read(text):
    assert spell(Decimal(text), NumberStyle.of(text)) == text


@given(st.floats(-1e6, 1e6), st.integers(0, 9))
def test_a_changed_number_is_near_to_half_its_last_digit(value, decimals):
    style = NumberStyle(decimals, point=decimals > 0)
    assert abs(float(spell(value, style)) - value) <= style.half_digit * (1 + 1e-9) + 1e-9


@pytest.mark.parametrize(
    ("text", "at_least", "value", "wanted"),
    [
        ("467.13", 3, 468.5, "468.500"),  # at least 3 decimals for mm
        ("467.13579", 3, 468.5, "468.50000"),  # never fewer than the source
        ("72", 3, 72.1234, "72.123"),
        ("-8.62E-05", 7, 0.00012345678, "0.0001235"),  # its exponent counts as decimals
        ("2.80000E+06", 3, 2800001.5, "2800001.500"),
        ("0.0", 3, -0.0001, "0.000"),  # no -0.000
        (".5", 4, 0.25, "0.2500"),
        ("18", 0, 19.0, "19"),  # status, turn and confdata stay integers
        ("-1", 0, 0.0, "0"),
    ],
)
def test_style_of_a_changed_number(text, at_least, value, wanted):
    assert spell(value, NumberStyle.of(text).at_least(at_least)) == wanted


@pytest.mark.parametrize("text", ["", "-", ".", "1,5", "0x1F", "1e", "nan", "--1"])
def test_what_is_no_number(text):
    with pytest.raises(ValueError, match="no number"):
        NumberStyle.of(text)
