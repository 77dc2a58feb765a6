"""Instruction forms of RAPID (facts: rapid.md section 3)."""

from __future__ import annotations

from pathlib import Path

from respot.languages.forms import Forms

FORMS = Forms.load(Path(__file__).with_name("forms.toml"))
