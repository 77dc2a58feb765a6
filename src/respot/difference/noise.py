"""Differences that say nothing about what the robot does: how a statement is spelled, comments, blanks, line ends."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator

from respot.difference.canonical import plain_tokens
from respot.difference.dialect import Dialect
from respot.difference.findings import Noise
from respot.difference.parts import Part
from respot.difference.programs import FilePair, Side
from respot.program.statement import Statement
from respot.source import NEWLINE, SourceText

_OURS = re.compile(r"[;!]respot: ")
_NEWLINE_NAMES = {"\r\n": "CRLF", "\n": "LF", "\r": "CR", "\r\r\n": "CRCRLF"}


def spelled_otherwise(new: Side, old_statement: Statement, statement: Statement) -> Noise:
    """Return how two statements differ that say the same."""
    tokens = plain_tokens(old_statement), plain_tokens(statement)
    kind = "spelling"
    if tokens[0] == tokens[1]:
        bare = ["".join(item.source.split()) for item in (old_statement, statement)]
        kind = "blanks" if bare[0] == bare[1] else "comments"
    return Noise(kind, new.path, statement.line, old_statement.source, statement.source)


def remarks(file: FilePair, parts: Iterable[tuple[Part, Part]]) -> Iterator[Noise]:
    """Yield comments and folds that came, went or changed, part by part."""
    for old, new in parts:
        texts = [[remark.source for remark in part.remarks] for part in (old, new)]
        if texts[0] == texts[1]:
            continue
        counts = [Counter(text) for text in texts]
        gone, come = counts[0] - counts[1], counts[1] - counts[0]
        for remark, left, is_old in [
            *((remark, gone, True) for remark in old.remarks),
            *((remark, come, False) for remark in new.remarks),
        ]:
            if left[remark.source] <= 0:
                continue
            left[remark.source] -= 1
            side = file.old if is_old else file.new
            text = (remark.source, "") if is_old else ("", remark.source)
            yield Noise(_remark_kind(remark, side.dialect), side.path, remark.line, *text)


def _remark_kind(remark: Statement, dialect: Dialect) -> str:
    if _OURS.match(remark.source):
        return "respot"
    return "folds" if remark.kind in dialect.folds else "comments"


def layout(old: SourceText, new: SourceText) -> Iterator[Noise]:
    """Yield line ends, code page, blanks at the beginning and end of lines, and empty lines, of a whole file."""
    if old.newline != new.newline and any(end in source.text for source in (old, new) for end in "\r\n"):
        names = [_NEWLINE_NAMES.get(source.newline, repr(source.newline)) for source in (old, new)]
        yield Noise("line_ends", new.path, None, names[0], names[1])
    pages = [source.encoding + (" with byte order mark" if source.bom else "") for source in (old, new)]
    if old.bom != new.bom or (old.encoding != new.encoding and "ascii" not in pages):
        yield Noise("encoding", new.path, None, pages[0], pages[1])
    lines = [NEWLINE.split(source.text) for source in (old, new)]
    bare = [Counter(stripped for line in found if (stripped := line.strip())) for found in lines]
    padded = [Counter(line for line in found if line.strip()) for found in lines]
    common = bare[0] & bare[1]
    # lines that are the same but for the blanks around them, and empty lines
    same = sum((padded[0] & padded[1]).values())
    differing = max(0, sum(common.values()) - same)
    empty = abs(sum(1 for line in lines[0] if not line.strip()) - sum(1 for line in lines[1] if not line.strip()))
    if differing or empty:
        yield Noise("blanks", new.path, count=differing + empty)
