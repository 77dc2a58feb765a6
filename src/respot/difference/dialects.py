"""The languages that can be compared: one line each."""

from __future__ import annotations

from respot.difference.dialect import Dialect
from respot.difference.krl import KRL
from respot.difference.rapid import RAPID

DIALECTS: dict[str, Dialect] = {"krl": KRL, "rapid": RAPID}
