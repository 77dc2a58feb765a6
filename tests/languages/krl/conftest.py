"""What the tests of KRL share: the fixtures in ``tests/data/krl`` and trees as text."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from respot.languages.krl.syntax import ENCODINGS, NO_STATEMENT, read_statements
from respot.program.statement import OPAQUE, Node, Statement
from respot.source import SourceText

DATA = Path(__file__).parents[2] / "data" / "krl"


def outline(node: Node) -> str:
    """A tree on one line: ``motion(MOVE=PTP, reference(NAME=XP1))``."""
    children = [outline(child) if isinstance(child, Node) else f"{child.type}={child.text}" for child in node.children]
    return f"{node.kind}({', '.join(children)})" if children else node.kind


def describe(statement: Statement) -> str:
    """A statement on one line, with its line number."""
    if statement.kind == OPAQUE:
        return f"{statement.line}: opaque: {statement.shape.reason}"
    if statement.kind in NO_STATEMENT:
        return f"{statement.line}: {statement.kind} {statement.source}"
    return f"{statement.line}: {outline(statement.node)}"


def read(data: bytes) -> tuple[SourceText, list[Statement]]:
    source = SourceText("a.src", data, ENCODINGS)
    return source, read_statements(source.text, source.line_starts)


@pytest.fixture(name="read")
def _read() -> Callable[[bytes], tuple[SourceText, list[Statement]]]:
    return read


@pytest.fixture(name="describe")
def _describe() -> Callable[[Statement], str]:
    return describe


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Run a test that takes ``program`` on every fixture."""
    if "program" in metafunc.fixturenames:
        files = sorted(path for path in DATA.iterdir() if path.suffix in (".src", ".dat"))
        metafunc.parametrize("program", files, ids=[path.name for path in files])
