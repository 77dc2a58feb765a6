"""Encodings, line ends and sizes: no byte is lost, nothing stalls."""

from __future__ import annotations

import tracemalloc

import pytest

from respot.languages.rapid.blocks import block_issues
from respot.languages.rapid.syntax import ENCODINGS, LONGEST_TABLE, read_statements
from respot.program.statement import OPAQUE, Statement
from respot.source import SourceText

LINES = [
    "MODULE m",
    "  ! Maß",
    "  VAR num a:=1;",
    "  PROC prüfen()",
    "    a:=",
    "      2; b:=3;",
    "  ENDPROC",
    "ENDMODULE",
]
KINDS = ["module", "comment", "data", "procedure", "assignment", "assignment", "end_procedure", "end_module"]
NUMBERS = [1, 2, 3, 4, 5, 6, 7, 8]
ROW = "[[1.5,-2,3E1],[1,0,0,0],[0,-1,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"

LONG_ROW = (
    "[[1366.65,-1108.96,920.06],[0.004443,-0.707121,0.707107,0.0031],[1,0,-2,0],[9E+09,115.5,9E+09,9E+09,9E+09,9E+09]]"
)


def _read(data: bytes) -> tuple[SourceText, list[Statement]]:
    source = SourceText("a.mod", data, ENCODINGS)
    assert source.encode(source.text) == data
    return source, read_statements(source.text, source.line_starts)


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r", "\r\r\n"], ids=repr)
@pytest.mark.parametrize("encoding", ["latin-1", "utf-8", "utf-8-sig"])
@pytest.mark.parametrize("tail", ["", None, "\x1a", "\n\x1a", "\n\n  \n"], ids=repr)
def test_line_ends_and_encodings(end: str, encoding: str, tail: str | None) -> None:
    text = end.join(LINES) + (end if tail is None else tail)
    source, statements = _read(text.encode(encoding))
    assert [found.kind for found in statements] == KINDS
    assert [found.line for found in statements] == [1, 2, 3, 4, 5, 6, 7, 8]
    assert statements[4].source == f"a:={end}      2;"
    assert source.encoding == ("latin-1" if encoding == "latin-1" else "utf-8")


def test_mixed_line_ends() -> None:
    text = "MODULE m\nVAR num a;\r\nVAR num b;\rVAR num c;\r\r\nENDMODULE"
    assert [(found.kind, found.line) for found in _read(text.encode())[1]] == [
        ("module", 1), ("data", 2), ("data", 3), ("data", 4), ("end_module", 5),
    ]  # fmt: skip


@pytest.mark.parametrize("data", [b"", b"\n", b"\x1a", b"   \r\n\t", b"\xef\xbb\xbf"], ids=repr)
def test_nothing(data: bytes) -> None:
    assert _read(data)[1] == []


def test_nul_bytes() -> None:
    statements = _read(b"MODULE m\nVAR num a\0;\nVAR num b;\n\0\0\0\nENDMODULE\n")[1]
    assert [(found.kind, found.line) for found in statements] == [
        ("module", 1), (OPAQUE, 2), ("data", 3), (OPAQUE, 4), ("end_module", 5),
    ]  # fmt: skip


def test_parentheses_without_end() -> None:
    for text in (
        "x:=" + "(" * 10_000 + "1" + ")" * 10_000 + ";",
        "x:=" + "[" * 10_000 + ";",
        "x:=1" + "+1" * 10_000 + ";",
    ):
        statements = _read(f"MODULE m\n{text}\ny:=1;\nENDMODULE\n".encode())[1]
        assert [found.kind for found in statements] == ["module", OPAQUE, "assignment", "end_module"]
        assert statements[1].shape.reason


@pytest.mark.parametrize(
    "line",
    [
        "x:=" + "1+" * 1_000_000 + "1;",
        "x" * 4_000_000,
        '"' * 2_000_001,
        "!" + "c" * 4_000_000,
        "CALL " + "a," * 1_000_000 + "a;",
        ";" * 200_000,
        " " * 4_000_000 + ";",
    ],
    ids=["sum", "word", "quotes", "comment", "call", "semicolons", "blanks"],
)
def test_very_long_line(line: str) -> None:
    statements = _read(f"MODULE m\n{line}\nVAR num a;\nENDMODULE\n".encode())[1]
    assert [found.kind for found in statements if found.line != 2] == ["module", "data", "end_module"]
    assert {found.kind for found in statements if found.line == 2} == {"comment" if line[0] == "!" else OPAQUE}


def _table(rows: int, end: str = ",\n  ") -> bytes:
    return f"MODULE m\nPERS robtarget t{{{rows}}}:=[{end.join([ROW] * rows)}];\nVAR num a;\nENDMODULE\n".encode()


@pytest.mark.parametrize("end", [",\n  ", ","], ids=["lines", "line"])
def test_table_of_ten_thousand_targets(end: str) -> None:
    statements = _read(_table(10_000, end))[1]
    assert [found.kind for found in statements] == ["module", "data", "data", "end_module"]
    rows = statements[1].node.first("aggregate")
    assert rows is not None
    nodes = rows.nodes
    assert len(nodes) == 10_000
    last = nodes[-1]
    assert last.text == ROW
    assert [number.text for number in last.nodes[0].nodes] == ["1.5", "-2", "3E1"]
    numbers = statements[1].numbers()
    assert len(numbers.values) == 170_001  # the dimension is one
    assert numbers.values[-17:] == [1.5, -2, 30, 1, 0, 0, 0, 0, -1, 0, 0] + [9e9] * 6


def test_memory_of_a_table_grows_with_the_table() -> None:
    large = _table(16_001)
    large = large.replace(ROW.encode(), LONG_ROW.encode())
    tracemalloc.start()
    kept = _read(large)[1]
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert kept
    assert peak < 15 * len(large)  # one statement of 670,000 tokens
    _read(b"")
    many = "".join(f"CONST robtarget p{index}:={LONG_ROW};\n" for index in range(16_000)).encode()
    tracemalloc.start()
    kept = _read(many)[1]
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert len(kept) == 16_000
    assert peak < 12 * len(many)


def test_broken_table_costs_one_statement() -> None:
    data = _table(3_000).replace(b"]],\n", b"],\n", 1)
    assert [found.kind for found in _read(data)[1]] == ["module", OPAQUE, "data", "end_module"]
    unclosed = _table(3_000).replace(b"]];\n", b"\n")
    assert [found.kind for found in _read(unclosed)[1]] == ["module", OPAQUE, "data", "end_module"]


def test_table_without_end_of_memory() -> None:
    rows = LONGEST_TABLE // len(ROW) + 10
    assert [found.kind for found in _read(_table(rows))[1]] == ["module", OPAQUE, "data", "end_module"]


def test_many_lines_that_never_end() -> None:
    for line in ("a,\n", "f(\n", ")\n", "x\n", "THEN\n", "IF\n", "PROC(\n", '"a;"\n', "[a,\n"):
        source, statements = _read(b"PROC f(\n" + (line * 20_000).encode())
        block_issues("a.mod", statements)
        assert statements[-1].end >= len(source.text.rstrip()) - 1
