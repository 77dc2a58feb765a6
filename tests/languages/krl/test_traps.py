"""Each trap of the language (facts: krl.md sections 1 to 3 and 10) has a fixture and the tree we expect of it.

``RESPOT_WRITE_TREES=1 pytest tests/languages/krl/test_traps.py`` writes the trees anew: look at the difference.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest

DATA = Path(__file__).parents[2] / "data" / "krl"
NEGATIVE = (DATA / "must_be_opaque.txt").read_bytes().decode("cp1252").split("\n")[:-1]


def test_tree(program, read, describe):
    _, statements = read(program.read_bytes())
    found = "".join(f"{describe(statement)}\n" for statement in statements)
    golden = program.with_name(program.name + ".tree")
    if os.environ.get("RESPOT_WRITE_TREES"):
        golden.write_bytes(found.encode())
    assert found == golden.read_bytes().decode()
    assert "opaque" not in found


@pytest.mark.parametrize("text", NEGATIVE)
def test_must_be_opaque(text, read):
    _, statements = read(text.encode("cp1252"))
    assert [statement.kind for statement in statements] == ["opaque"]
    assert statements[0].shape.reason
    assert statements[0].source == text.strip(" \t\f")
    start, end = statements[0].fault
    assert 0 <= start < end <= len(text)


@pytest.mark.parametrize(
    ("text", "reason", "fault"),
    [
        ("PTP XP1 XP2", "a name is not expected here", "XP2"),
        ("interrupt A_LONG_NAME on", "a name is not expected here", "A_LONG_NAME"),
        ("a := b", "'=' is not expected here", "="),
        ("WAIT FOR a AND", "ends too early", "WAIT FOR a AND"),
        ("DECL E6POS P={X 1 Y 2}", "a name is not expected here", "Y"),
        ("x = 1 2 ; why", "a number is not expected here", "2"),
        ("(" * 101 + "1" + ")" * 101, "nested deeper than 100", None),
        ("a = " + "x+" * 20_000 + "1", "a tree deeper than 250", None),
        ("a = " + "x" * 70_000, "longer than 64 kB", None),
    ],
)
def test_reason_and_place(text, reason, fault, read):
    _, [statement] = read(text.encode())
    assert statement.shape.reason == reason
    if fault is not None:
        assert statement.text[slice(*statement.fault)] == fault


def test_reason_fits_every_statement_of_a_shape(read):
    # the second statement must not be told about a word of the first
    _, statements = read(b"PTP XP1 FIRST\nPTP XP1 SECOND\n")
    assert {statement.shape.reason for statement in statements} == {"a name is not expected here"}
    assert [statement.text[slice(*statement.fault)] for statement in statements] == ["FIRST", "SECOND"]


def test_an_opaque_statement_has_no_tree_but_tokens(read):
    _, [statement] = read(b"  a := 5 ; x\n")
    with pytest.raises(ValueError, match="line 1 is opaque: "):
        _ = statement.node
    assert [statement.text[slice(*span)] for span in statement.tokens()] == ["a", ":", "=", "5"]
    assert statement.numbers().texts == ()
