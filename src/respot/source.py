r"""Bytes to text and back without losing one of them, and edits as spans.

Line ends, byte order mark, trailing bytes and code page travel with the text. The text keeps the line ends as they are
(``\r\n``, ``\n``, ``\r``, ``\r\r\n``), so that a position in it is a position in the file.
"""

from __future__ import annotations

import codecs
import hashlib
import re
from bisect import bisect_right
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate

#: A line end of any kind met in controller backups; RobotStudio 5.08 wrote 0D 0D 0A (facts: rapid.md 4.2).
NEWLINE = re.compile(r"\r*\n|\r")

#: A line with its end; what stands behind the last line end is none.
_LINE = re.compile(r"[^\r\n]*(?:\r*\n|\r)")

Span = tuple[int, int]


@dataclass(frozen=True)
class Edit:
    """Replace the characters of ``span`` by ``replacement``; the reason is for the reviewer."""

    span: Span
    replacement: str
    reason: str


class SourceText:
    """A text file of a backup.

    Parameters
    ----------
    path : str
        Path inside the backup, with ``/``.
    data : bytes
        The file.
    encodings : sequence of str
        Code pages to try in order after ASCII and UTF-8; the last must accept every byte.
    """

    def __init__(self, path: str, data: bytes, encodings: Sequence[str] = ("cp1252", "latin-1")) -> None:
        self.path = path
        self.data = data
        self.bom = codecs.BOM_UTF8 if data.startswith(codecs.BOM_UTF8) else b""
        self.text, self.encoding = _decode(data[len(self.bom) :], encodings)

    @cached_property
    def newline(self) -> str:
        """Most frequent line end; a line feed where there is none."""
        counts: dict[str, int] = {}
        for found in NEWLINE.findall(self.text):
            counts[found] = counts.get(found, 0) + 1
        return max(counts, key=counts.__getitem__) if counts else "\n"

    @cached_property
    def line_starts(self) -> list[int]:
        """Offset of the first character of every line."""
        return [0, *accumulate(map(len, _LINE.findall(self.text)))]

    def place(self, offset: int) -> tuple[int, int]:
        """Line and column of an offset, counted from 1."""
        line = bisect_right(self.line_starts, offset)
        return line, offset - self.line_starts[line - 1] + 1

    def line_text(self, line: int) -> str:
        """Text of a line, counted from 1, without its end."""
        start = self.line_starts[line - 1]
        end = self.line_starts[line] if line < len(self.line_starts) else len(self.text)
        return self.text[start:end].rstrip("\r\n")

    @cached_property
    def sha256(self) -> str:
        """Hash of the file's bytes."""
        return hashlib.sha256(self.data).hexdigest()

    def encode(self, text: str) -> bytes:
        """Bytes of a changed text, in this file's encoding and with its byte order mark.

        Raises
        ------
        UnicodeEncodeError
            The new text holds a character that the file's code page lacks.
        """
        return self.bom + text.encode(self.encoding)


def _decode(data: bytes, encodings: Sequence[str]) -> tuple[str, str]:
    for encoding in ("ascii", "utf-8", *encodings):
        try:
            return data.decode(encoding), encoding
        except UnicodeDecodeError:
            continue
    raise ValueError(f"none of {', '.join(encodings)} accepts every byte")


def splice(text: str, edits: Iterable[Edit]) -> str:
    """Apply edits to a text.

    Raises
    ------
    ValueError
        Two edits overlap, or one lies outside the text.
    """
    parts: list[str] = []
    position = 0
    for edit in sorted(edits, key=lambda edit: edit.span):
        start, end = edit.span
        if start < position or end < start or end > len(text):
            raise ValueError(f"edit {edit.span} ({edit.reason}) overlaps another or leaves the text")
        parts += (text[position:start], edit.replacement)
        position = end
    parts.append(text[position:])
    return "".join(parts)
