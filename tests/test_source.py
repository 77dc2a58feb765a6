"""Bytes to text and back; edits."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from respot.source import Edit, SourceText, splice


@given(st.binary(max_size=300))
def test_every_byte_comes_back(data):
    for encodings in (("cp1252", "latin-1"), ("latin-1",)):
        source = SourceText("x", data, encodings)
        assert source.encode(source.text) == data


@pytest.mark.parametrize(
    ("data", "encoding"),
    [
        (b"plain", "ascii"),
        ("Kühlwasser".encode(), "utf-8"),
        (b"K\xfchlwasser \x80", "cp1252"),
        (b"K\xfchlwasser \x81", "latin-1"),  # 81 is undefined in cp1252
        (b"\xef\xbb\xbfDEF a()", "ascii"),
    ],
)
def test_encoding(data, encoding):
    assert SourceText("x", data).encoding == encoding


def test_places_count_every_kind_of_line_end():
    source = SourceText("x", b"a\r\nb\nc\rd\r\r\ne")
    places = [source.place(source.text.index(letter)) for letter in "abcde"]
    assert places == [(1, 1), (2, 1), (3, 1), (4, 1), (5, 1)]
    assert [source.line_text(line) for line in range(1, 6)] == list("abcde")
    assert SourceText("x", b"a\r\nb\r\nc\n").newline == "\r\n"


@given(
    st.text(max_size=40), st.lists(st.tuples(st.integers(0, 40), st.integers(0, 5), st.text(max_size=4)), max_size=5)
)
def test_edits_apply_in_any_order(text, wanted):
    edits, end = [], 0
    for start, length, replacement in sorted(wanted):
        if start >= end and start + length <= len(text):
            edits.append(Edit((start, start + length), replacement, "test"))
            end = start + length + 1
    expected = text
    for edit in reversed(edits):
        expected = expected[: edit.span[0]] + edit.replacement + expected[edit.span[1] :]
    assert splice(text, reversed(edits)) == expected


@pytest.mark.parametrize("spans", [[(0, 3), (2, 4)], [(3, 2)], [(0, 99)]])
def test_edits_that_overlap_or_leave_the_text_are_refused(spans):
    with pytest.raises(ValueError, match="overlaps"):
        splice("0123456789", [Edit(span, "x", "test") for span in spans])
