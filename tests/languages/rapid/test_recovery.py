"""Broken code: it stays opaque, at the right line, and takes nothing with it."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from respot.languages.rapid.blocks import block_issues
from respot.program.statement import OPAQUE, Statement

Code = Callable[[str], list[Statement]]

#: Statements that are no RAPID, each on one line of a routine.
NO_RAPID = [
    "x = 3;",
    "x := = 3;",
    "x := 3",
    "x := 3 4;",
    "x := ;",
    ":= 3;",
    "x := (1+2;",
    "x := 1+2);",
    "x := [1,2;",
    "x := [1,,2];",
    "x := [1,2,];",
    "x := 3..4;",
    "x := a.;",
    "x := f(1,);",
    "x := f().y;",
    "x{} := 1;",
    'TPWrite "open;',
    'TPWrite open";',
    "MoveL p1,v100,z10,tGun\\WObj=w;",
    "MoveL p1,v100,z10,tGun",
    "MoveL p1,,z10,tGun;",
    "MoveL p1 v100,z10,tGun;",
    "MoveL [[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9],v100,z10,tGun;",
    "MoveL(p1,v100,z10,tGun);;",
    "proc();",
    "GOTO;",
    "GOTO 3;",
    "RETURN 1,2;",
    "EXIT 1;",
    "CONNECT i1 t1;",
    "IF x=1 ;",
    "IF x==1 THEN",
    "IF THEN",
    "IF x:=1 THEN",
    "ELSEIF x=1",
    "FOR i FROM 1 DO",
    "FOR i=1 TO 3 DO",
    "FOR i FROM 1 TO 3",
    "WHILE x=1",
    "WHILE DO",
    "CASE 1",
    "DEFAULT",
    "%x;",
    "%%%",
    "3;",
    ";",
    "THEN",
    "a b c;",
    "VAR num;",
    "VAR num x = 3;",
    "VAR num x{};",
    "VAR num x:=3",
    "x: =3;",
    "&x;",
    "x := a & b;",
    "x ? y;",
    "x := 'a';",
    "x := #1;",
    "\0",
]


@pytest.mark.parametrize("broken", NO_RAPID)
def test_broken_statement_is_opaque_and_takes_nothing_with_it(code: Code, broken: str) -> None:
    text = f"MODULE m\nPROC p()\na:=1;\n{broken}\nb:=2;\nMoveL p1,v100,z10,tGun;\nENDPROC\nENDMODULE\n"
    statements = code(text)
    opaque = [found for found in statements if found.kind == OPAQUE]
    assert {found.line for found in opaque} == {4}
    assert [found.line for found in statements if found.kind != OPAQUE and found.line != 4] == [1, 2, 3, 5, 6, 7, 8]


@pytest.mark.parametrize("broken", [found for found in NO_RAPID if not found.endswith((";", "3", "1", "tGun"))])
def test_broken_line_before_a_block_word(code: Code, broken: str) -> None:
    statements = code(f"PROC p()\n{broken}\nENDPROC\nPROC q()\nENDPROC\n")
    assert [found.line for found in statements if found.kind != OPAQUE] == [1, 3, 4, 5]


#: Lines of a module (line 2 is broken) and the lines that must still be understood.
HEADS = [
    ("MODULE m\nPROC p(\nENDPROC\nENDMODULE", [1, 3, 4]),
    ("MODULE m\nPROC\nENDPROC\nENDMODULE", [1, 3, 4]),
    ("MODULE m\nPROC p\na:=1;\nENDPROC\nENDMODULE", [1, 3, 4, 5]),
    ("MODULE m\nPROC p(num a\na:=1;\nENDPROC\nENDMODULE", [1, 3, 4, 5]),
    ("MODULE m\nPROC p(num a,)\na:=1;\nENDPROC\nENDMODULE", [1, 3, 4, 5]),
    ("MODULE m\nFUNC f()\nRETURN 1;\nENDFUNC\nENDMODULE", [1, 3, 4, 5]),
    ("MODULE m\nTRAP\nENDTRAP\nENDMODULE", [1, 3, 4]),
    ("MODULE m\nALIAS num;\nVAR num x;\nENDMODULE", [1, 3, 4]),
    ("MODULE m\nLOCAL num x;\nVAR num x;\nENDMODULE", [1, 3, 4]),
    ("MODULE m\nERROR(a\nRETRY;\nENDMODULE", [1, 3, 4]),
    ("! c\nMODULE (SYSMODULE)\nVAR num x;\nENDMODULE", [3, 4]),
    ("! c\nMODULE m(NOSUCH)\nVAR num x;\nENDMODULE", [3, 4]),
    ("! c\nMODULE m(SYSMODULE\nVAR num x;\nENDMODULE", [3, 4]),
]


@pytest.mark.parametrize(("text", "understood"), HEADS)
def test_broken_head(code: Code, text: str, understood: list[int]) -> None:
    statements = code(text)
    assert [found.line for found in statements if found.kind != OPAQUE] == understood
    assert any(found.kind == OPAQUE and found.line == 2 for found in statements)


def test_lost_semicolon_costs_one_statement_each(code: Code) -> None:
    lines = ["x:=1", "MoveL p1,v100,z10,tGun", "x:=f(1)", 'TPWrite "a"', "Foo", "RETURN", "Bar \\On", "y{2}:=[1,2]"]
    statements = code("\n".join(f"  {line}" for line in lines) + "\n  x:=2;\n")
    assert [(found.kind, found.line) for found in statements] == [
        *((OPAQUE, line) for line in range(1, len(lines) + 1)),
        ("assignment", len(lines) + 1),
    ]


def test_call_over_lines_is_no_lost_semicolon(code: Code) -> None:
    text = (
        "PROC p()\n  Foo\n    a;\n  IF x=1\n    Foo;\n  IF x=1\n  Foo;\n  MoveL\n    p1,\n  v100,z10,tGun;\nENDPROC\n"
    )
    assert [found.kind for found in code(text)] == [
        "procedure",
        "call",
        "compact_if",
        "compact_if",
        "call",
        "end_procedure",
    ]


def test_comments_after_a_broken_statement_stay_comments(read: Code) -> None:
    statements = read("x:=1\n! c\n\n! d\ny:=2;\n")
    assert [(found.kind, found.line) for found in statements] == [
        (OPAQUE, 1), ("comment", 2), ("comment", 4), ("assignment", 5),
    ]  # fmt: skip


def test_reason_says_what_is_wrong(code: Code) -> None:
    assert code("x = 3;")[0].shape.reason == "'=' is not expected here"
    assert code("x := 3\ny := 4;")[0].shape.reason == "ends too early"


#: Modules and the lines of their unbalanced blocks.
UNBALANCED = [
    ("MODULE m\nPROC p()\n  IF a THEN\n    b:=1;\nENDPROC\nENDMODULE", [3]),
    ("MODULE m\nPROC p()\n  IF a THEN\n    IF b THEN\n    c:=1;\n  ENDIF\nENDPROC\nENDMODULE", [4]),
    ("MODULE m\nPROC p()\n  IF a THEN\n    WHILE b DO\n  ENDIF\nENDPROC\nENDMODULE", [4]),
    ("MODULE m\nPROC p()\n  ENDIF\nENDPROC\nENDMODULE", [3]),
    ("MODULE m\nPROC p()\n  IF a THEN\n      c:=1;\n    ENDIF\n  ENDIF\nENDPROC\nENDMODULE", [5]),
    ("MODULE m\nPROC p()\n  ELSE\n  CASE 1:\nENDPROC\nENDMODULE", [3, 4]),
    ("MODULE m\nPROC p()\n  IF a THEN\n  ELSE\n  ELSEIF b THEN\n  ENDIF\nENDPROC\nENDMODULE", [5]),
    ("MODULE m\nPROC p()\nPROC q()\nENDPROC\nENDMODULE", [2]),
    ("MODULE m\nPROC p()\nENDFUNC\nENDMODULE", [3]),
    ("MODULE m\nb:=1;\nc:=1;\nENDPROC\nENDMODULE", [2, 4]),
    ("MODULE m\nRECORD r\nnum x;\nPROC p()\nENDPROC\nENDMODULE", [2]),
    ("MODULE m\nENDRECORD\nENDMODULE", [2]),
    ("MODULE m\nPROC p()\nENDPROC\n", [1]),
    ("PROC p()\nENDPROC\nENDMODULE\n", [3]),
    ("MODULE m\nPROC p()\n  IF a THEN\n  ERROR\n  RETRY;\nENDPROC\nENDMODULE", [3]),
    ("MODULE m\nPROC p()\n  IF a\n    b:=1;\n  ENDIF\nENDPROC\nENDMODULE", [3]),
    ("MODULE m\nPROC p()\n  IF a\n    b:=1;\n  ELSE\n    b:=2;\n  ENDIF\nENDPROC\nENDMODULE", [3]),
    ("MODULE m\nPROC p()\n  IF a==1 THEN\n    b:=1;\n  ENDIF\nENDPROC\nENDMODULE", []),
    ("MODULE m\nPROC p(num)\n  b:=1;\nENDPROC\nENDMODULE", []),
    ("MODULE m\nPROC p()\n  IF a b:=1;\nENDPROC\nENDMODULE", []),
    ("PROC p()\nENDPROC\n", []),
]


@pytest.mark.parametrize(("text", "lines"), UNBALANCED)
def test_unbalanced_blocks(read: Code, text: str, lines: list[int]) -> None:
    issues = block_issues("a.mod", read(text))
    assert [found.line for found in issues] == lines
    assert all(found.code == "UNBALANCED_BLOCK" and found.path == "a.mod" for found in issues)


def test_a_stray_quote_is_no_string(code: Code) -> None:
    """Both would be one token of the same look; neither may lend the other its shape."""
    for lines in (['Foo ";', 'Foo "x";'], ['Bar "x";', 'Bar ";']):
        kinds = {found.source: found.kind for found in code("\n".join(lines))}
        assert kinds == {line: "call" if '"x"' in line else OPAQUE for line in lines}
