"""Inline forms of KRL (facts: krl.md section 6)."""

from __future__ import annotations

from pathlib import Path

from respot.languages.forms import Forms

FORMS = Forms.load(Path(__file__).with_name("forms.toml"))
