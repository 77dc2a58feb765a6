"""No byte is lost and nothing stalls, whatever the file holds."""

from __future__ import annotations

import re

import pytest

from respot.languages.krl.syntax import NO_STATEMENT
from respot.program.statement import OPAQUE

LINES = [
    "&ACCESS RVP",
    "DEF a ( )",
    "; Schweißpunkt",
    "PTP XP1 C_DIS",
    'T[]="Tür; {"',
    "X=1 ; ü",
    "",
    "  a := b",
    "END",
]
BODIES = {
    "crlf": "\r\n".join(LINES) + "\r\n",
    "lf": "\n".join(LINES) + "\n",
    "cr": "\r".join(LINES) + "\r",
    "cr_cr_lf": "\r\r\n".join(LINES) + "\r\r\n",
    "mixed": "\r\n".join(LINES[:3]) + "\n" + "\r".join(LINES[3:]) + "\n\r",
    "no_last_newline": "\n".join(LINES),
    "trailing_1a": "\r\n".join(LINES) + "\r\n\x1a",
    "form_feed": "\n\f\n".join(LINES),
}


def _join(source, statements):
    """The text again, from gaps and statements; what stands outside statements must be blank."""
    pieces, position = [], 0
    for statement in statements:
        pieces += (source.text[position : statement.start], statement.source)
        position = statement.end
    pieces.append(source.text[position:])
    assert not "".join(pieces[::2]).strip(" \t\r\n\f\x1a\xa0")
    return source.encode("".join(pieces))


@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("encoding", ["cp1252", "latin-1", "utf-8", "utf-8-sig"])
def test_every_layout(body, encoding, read):
    data = BODIES[body].encode(encoding)
    source, statements = read(data)
    assert _join(source, statements) == data
    kinds = [statement.kind for statement in statements]
    assert kinds == ["header", "routine", "comment", "motion", "assignments", "assignments", "opaque", "end_routine"]
    # the same numbers of lines as any editor counts
    before = [re.findall(r"\r*\n|\r", source.text[: statement.start]) for statement in statements]
    assert [statement.line for statement in statements] == [1 + len(ends) for ends in before]


def test_bytes_that_cp1252_lacks(read):
    data = b'DEF a ( )\r\n; \x81\x8d\x8f\x90\x9d\r\nT[]="\x81"\r\nEND'
    source, statements = read(data)
    assert source.encoding == "latin-1"
    assert _join(source, statements) == data
    assert all(statement.kind != OPAQUE for statement in statements)


@pytest.mark.parametrize(
    "data", [b"", b"\n", b"\x1a", b"\x00", b"\x00" * 5000, b"\r", b";", b'"', b"{", b"\xff\xfe\x00", b"\xef\xbb\xbf"]
)
def test_next_to_nothing(data, read):
    source, statements = read(data)
    assert _join(source, statements) == data
    assert len(statements) <= 1


def test_nul_bytes_within(read):
    data = b"DEF a ( )\nPTP\x00XP1\nPTP XP1\n\x00\nEND\n"
    source, statements = read(data)
    assert [statement.kind for statement in statements] == ["routine", "opaque", "motion", "opaque", "end_routine"]
    assert _join(source, statements) == data


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("X=" + "(" * 10_000 + "1" + ")" * 10_000, "nested deeper than 100"),
        ("X=" + "[" * 10_000, "nested deeper than 100"),
        ("X=" + "-" * 10_000 + "1", "a tree deeper than 250"),
        ("X=1" + "+1" * 10_000, "a tree deeper than 250"),
        ("X=A" + ".B" * 30_000, ""),
        ("F(" + "1," * 30_000 + "2)", ""),
        ("X=" + "1" * 70_000, "longer than 64 kB"),
        ('X[]="' + "a;" * 60_000 + '"', "longer than 64 kB"),
        ("X[]=" + '"' * 60_000, "a string is not expected here"),
    ],
    ids=["parentheses", "brackets", "signs", "terms", "components", "arguments", "digits", "string", "quotes"],
)
def test_monstrous_line(line, reason, read):
    data = f"DEF a ( )\n{line}\nPTP XP1\nEND\n".encode()
    source, statements = read(data)
    assert _join(source, statements) == data
    assert [statement.line for statement in statements] == [1, 2, 3, 4]
    assert statements[1].shape.reason == reason
    assert statements[1].tokens()
    for statement in statements:
        if statement.kind not in (OPAQUE, *NO_STATEMENT):
            assert sum(1 for _ in statement.node.walk()) >= 1


def test_a_line_of_100_megabytes(read):
    data = b"DEF a ( )\n" + b"X 1.0," * 17_000_000 + b"\nEND\n"
    source, statements = read(data)
    assert [statement.kind for statement in statements] == ["routine", "opaque", "end_routine"]
    assert source.encode(source.text) == data


def test_caches_are_bounded(monkeypatch, read):
    from respot.languages import shapes

    monkeypatch.setattr(shapes, "MOST_SHAPES", 50)
    lines = "".join(f"A{'B' * (i % 97)}={'C' * (i % 89)}+{'(' * (i % 7)}{i}{')' * (i % 7)}\n" for i in range(2000))
    _, statements = read(lines.encode())
    assert {statement.kind for statement in statements} == {"assignments"}
    from respot.languages.krl import syntax

    assert len(syntax._LINES) <= 51
