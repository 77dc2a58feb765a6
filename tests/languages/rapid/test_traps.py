"""One file per trap of the language; the expected tree lies beside it (``NAME.tree``), checked by hand."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from lark import Tree

from respot.languages.rapid.blocks import block_issues
from respot.languages.rapid.recognition import recognise
from respot.languages.rapid.syntax import ENCODINGS, NO_STATEMENT, SHAPES, TOKEN, read_statements
from respot.program.statement import OPAQUE, Branch, Node, Statement
from respot.source import SourceText

DATA = Path(__file__).resolve().parents[2] / "data" / "rapid"
TRAPS = sorted(path for path in DATA.iterdir() if path.is_file() and path.suffix != ".tree")
#: Files that the plain grammar, which takes every line for a statement, cannot read as a whole.
NOT_PLAIN = {"several_modules.prg"}


def _read(path: Path) -> tuple[SourceText, list[Statement]]:
    source = SourceText(path.name, path.read_bytes(), ENCODINGS)
    return source, read_statements(source.text, source.line_starts)


def _tree(node: Node) -> str:
    inner = [_tree(child) if isinstance(child, Node) else f"{child.type}={child.text}" for child in node.children]
    return f"({' '.join([node.kind, *inner])})"


@pytest.mark.parametrize("path", TRAPS, ids=lambda path: path.name)
def test_tree(path: Path) -> None:
    found = []
    for statement in _read(path)[1]:
        tree = f"({statement.kind})" if statement.shape.tree is None else _tree(statement.node)
        found.append(f"{statement.line:3} {tree}".replace("\r", "").replace("\n", " "))
    assert found == path.with_name(path.name + ".tree").read_text(encoding="utf-8").splitlines()


@pytest.mark.parametrize("path", TRAPS, ids=lambda path: path.name)
def test_all_understood(path: Path) -> None:
    source, statements = _read(path)
    assert [found for found in statements if found.kind == OPAQUE] == []
    assert block_issues(path.name, statements) == []
    assert recognise(source.data) == "rapid"


@pytest.mark.parametrize("path", TRAPS, ids=lambda path: path.name)
def test_tokens_and_gaps_are_the_file(path: Path) -> None:
    source, statements = _read(path)
    position = 0
    for statement in statements:
        spans = statement.tokens() if statement.kind not in NO_STATEMENT else [(statement.start, statement.end)]
        for start, end in spans:
            gap = re.sub(r"![^\r\n]*", "", source.text[position:start])
            assert not gap.strip("\x1a\ufeff") or gap.isspace()
            position = end
    assert source.encode(source.text) == source.data


@pytest.mark.parametrize("path", TRAPS, ids=lambda path: path.name)
def test_token_pattern_is_larks_lexer(path: Path) -> None:
    text = _read(path)[0].text
    ours = [found.span() for found in TOKEN.finditer(text) if found.lastgroup != "comment"]
    assert ours == [(token.start_pos, token.end_pos) for token in SHAPES.lark.lex(text)]


@pytest.mark.parametrize("path", [path for path in TRAPS if path.name not in NOT_PLAIN], ids=lambda path: path.name)
def test_fast_path_is_the_plain_grammar(path: Path) -> None:
    source, statements = _read(path)
    plain = SHAPES.lark.parse(source.text, start="file").children
    ours = [found for found in statements if found.kind not in NO_STATEMENT]
    assert [_plain(piece) for piece in plain] == [_fast(found.node) for found in ours]


def _plain(tree: Tree) -> tuple:
    children = (child for child in tree.children if child is not None)
    inner = [
        _plain(child) if isinstance(child, Tree) else (child.type, child.start_pos, child.end_pos) for child in children
    ]
    span = (0, 0) if tree.meta.empty else (tree.meta.start_pos, tree.meta.end_pos)
    return (str(tree.data), *span, *inner)


def _fast(node: Node) -> tuple:
    inner = [_fast(child) if isinstance(child, Node) else (child.type, *child.span) for child in node.children]
    return (node.kind, *node.span, *inner)


def test_every_literal_aggregate_is_laid_in_as_parsed() -> None:
    """Aggregates of literals do not pass the grammar: what is built for them must be what it builds."""
    rows = '[TRUE,[1,-2.5,+3,- 4],"a",[],[[0x1F],[false]]]'
    text = f"VAR t x:={rows};"
    assert "Rows" not in repr(type(SHAPES.read(text)[0].shape.tree))
    plain = SHAPES.lark.parse(text, start="piece")
    large = f"VAR t x:=[{','.join([rows] * 30)},y];"
    assert _plain(plain) == _fast(Statement(text, 0, len(text), 1, SHAPES.read(text)[0].shape).node)
    shape = SHAPES.read(large)[0].shape
    assert isinstance(shape.tree, Branch)
    assert _plain(SHAPES.lark.parse(large, start="piece")) == _fast(Statement(large, 0, len(large), 1, shape).node)
    larger = f"VAR t x:=[{','.join([rows] * 30)}];"
    shape = SHAPES.read(larger)[0].shape
    assert _plain(SHAPES.lark.parse(larger, start="piece")) == _fast(Statement(larger, 0, len(larger), 1, shape).node)
