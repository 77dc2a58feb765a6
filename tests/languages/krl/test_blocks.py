"""Routines, and blocks that do not balance."""

from __future__ import annotations

import pytest

from respot.languages.krl.blocks import block_issues, routines

NESTED = """\
DEF a ( )
  IF X THEN
    FOR I=1 TO 3
      SWITCH I
        CASE 1
          LOOP
            EXIT
          ENDLOOP
        DEFAULT
      ENDSWITCH
    ENDFOR
  ELSE
    WHILE Y
      REPEAT
        IF Z THEN
          IF W THEN
          ENDIF
        ENDIF
      UNTIL A
    ENDWHILE
  ENDIF
END
DEFFCT INT b ( )
  RETURN 1
ENDFCT
"""
CLOSER_TO_OPENER = {17: 16, 18: 15, 21: 2, 11: 3, 20: 13, 19: 14, 10: 4, 8: 6, 22: 1, 25: 23}


def _issues(read, text):
    _, statements = read(text.encode())
    return [(issue.line, issue.message) for issue in block_issues("a.src", statements)]


def test_balanced(program, read):
    _, statements = read(program.read_bytes())
    issues = block_issues(program.name, statements)
    assert [issue.line for issue in issues] == ([9] if program.name == "unbalanced_folds.src" else [])


def test_nested_is_balanced(read):
    assert _issues(read, NESTED) == []


@pytest.mark.parametrize(("closer", "opener"), CLOSER_TO_OPENER.items())
def test_a_deleted_end_is_found_where_the_block_begins(closer, opener, read):
    lines = NESTED.splitlines()
    del lines[closer - 1]
    found = _issues(read, "\n".join(lines))
    assert [line for line, _ in found] == [opener]
    assert found[0][1].endswith("is not closed")


@pytest.mark.parametrize(("closer", "opener"), CLOSER_TO_OPENER.items())
def test_a_deleted_beginning_is_found_where_the_block_ends(closer, opener, read):
    lines = NESTED.splitlines()
    lines[opener - 1] = ";"
    found = _issues(read, "\n".join(lines))
    inner = {2: [12], 4: [5, 9]}.get(opener, [])  # ELSE, CASE and DEFAULT have lost their block too
    assert [line for line, _ in found] == [*inner, closer]


def test_without_indentation_the_words_decide(read):
    lines = [line.strip() for line in NESTED.splitlines()]
    del lines[16]  # the innermost ENDIF: the UNTIL finds the outer IF open
    assert _issues(read, "\n".join(lines)) == [(15, "IF is not closed")]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (";ENDFOLD\n", [(1, "ENDFOLD closes no FOLD")]),
        (";FOLD a\n;FOLD b\n;ENDFOLD\n", [(1, "FOLD is not closed")]),
        ("ENDIF\n", [(1, "ENDIF closes no IF")]),
        ("END\n", [(1, "END closes no DEF")]),
        ("ENDFCT\n", [(1, "ENDFCT closes no DEF")]),
        ("DEFDAT a\nEND\n", [(1, "DEFDAT is not closed"), (2, "END closes no DEF")]),
        ("DEF a()\nDEF b()\nEND\n", [(1, "DEF is not closed")]),
        ("DEF a()\nLOOP\nEND\n", [(2, "LOOP is not closed")]),
        ("SPLINE\nSPL X\n", [(1, "SPLINE is not closed")]),
        ("IF a THEN\nENDWHILE\nENDIF\n", [(2, "ENDWHILE closes no WHILE")]),
        ("CASE 1\n", [(1, "CASE stands in no SWITCH")]),
        ("DEFAULT\n", [(1, "DEFAULT stands in no SWITCH")]),
    ],
)
def test_issue(text, expected, read):
    assert _issues(read, text) == expected


def test_place_and_excerpt(read):
    _, statements = read(b"DEF a ( )\r\n  IF X THEN\r\nEND\r\n")
    [issue] = block_issues("p/a.src", statements)
    assert str(issue) == "p/a.src:2:3: UNBALANCED_BLOCK IF is not closed\n      IF X THEN\n      ^"


def test_routines(read):
    _, statements = read(
        b"&REL 1\nGLOBAL DEF Main ( )\nx=1\n;c\nEND\nstray\nDEFFCT INT f ( )\nDEFDAT d PUBLIC\nINT a\nENDDAT\n"
    )
    found = routines(statements)
    assert [(routine.name, routine.head.line, len(routine.body)) for routine in found] == [
        ("Main", 2, 2),
        ("f", 7, 0),
        ("d", 8, 1),
    ]
    assert [routine.end and routine.end.line for routine in found] == [5, None, 10]
