"""Reading, for the tests of RAPID."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from respot.languages.rapid.syntax import ENCODINGS, NO_STATEMENT, read_statements
from respot.program.statement import Statement
from respot.source import SourceText


def read_text(text: str) -> list[Statement]:
    source = SourceText("a.mod", text.encode("utf-8"), ENCODINGS)
    return read_statements(source.text, source.line_starts)


@pytest.fixture
def read() -> Callable[[str], list[Statement]]:
    return read_text


@pytest.fixture
def code() -> Callable[[str], list[Statement]]:
    """Statements without the comments."""
    return lambda text: [found for found in read_text(text) if found.kind not in NO_STATEMENT]
