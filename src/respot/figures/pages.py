"""Renders pages from ``templates/pages``: one file, nothing from outside, every text escaped."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined, select_autoescape

from respot.resources import resource


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=FileSystemLoader(resource("templates", "pages")),
        # Jinja takes .html.j2 for no page of its own: what is escaped is said, and all else is escaped too
        autoescape=select_autoescape(("html.j2",), ("css.j2",), default=True, default_for_string=True),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters["signs"] = signs
    return environment


def signs(text: object) -> str:
    """Set the signs that plain words spell with what a keyboard has: a true plus-minus and a true minus."""
    spelled = str(text).replace("+-", "±")
    return f"−{spelled[1:]}" if spelled.startswith("-") and len(spelled) > 1 else spelled


def render(name: str, values: Mapping[str, Any]) -> str:
    """Render a page; what UTF-8 cannot hold is spelled as JSON spells it."""
    text = _environment().get_template(name).render(**values)
    return text.encode("utf-8", "backslashreplace").decode("utf-8")
