"""What the tests of RAPID share: fixtures on disk, reading, and trees as text."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from respot.languages.rapid.syntax import ENCODINGS, NO_STATEMENT, read_statements
from respot.program.statement import Node, Statement
from respot.source import SourceText

DATA = Path(__file__).resolve().parents[2] / "data" / "rapid"


def read_text(text: str) -> list[Statement]:
    source = SourceText("a.mod", text.encode("utf-8"), ENCODINGS)
    return read_statements(source.text, source.line_starts)


def tree_text(node: Node) -> str:
    """One tree on one line: rules in parentheses, tokens as they are written."""
    inner = [tree_text(child) if isinstance(child, Node) else f"{child.type}={child.text}" for child in node.children]
    return f"({' '.join([node.kind, *inner])})"


def golden(path: Path) -> str:
    """All statements of a file: line, and the tree or what stands in its place."""
    source = SourceText(path.name, path.read_bytes(), ENCODINGS)
    lines = []
    for statement in read_statements(source.text, source.line_starts):
        tree = f"({statement.kind})" if statement.shape.tree is None else tree_text(statement.node)
        lines.append(f"{statement.line:3} {tree}".replace("\r", "").replace("\n", " "))
    return "\n".join([*lines, ""])


@pytest.fixture
def read() -> Callable[[str], list[Statement]]:
    return read_text


@pytest.fixture
def code() -> Callable[[str], list[Statement]]:
    """Statements without the comments."""
    return lambda text: [found for found in read_text(text) if found.kind not in NO_STATEMENT]
