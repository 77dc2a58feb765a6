"""What a file with a suffix of KRL holds."""

from __future__ import annotations

import re

from respot.languages.krl.syntax import ENCODINGS, looks_like_krl
from respot.source import SourceText

_SAMPLE = 200_000
_HEAD = re.compile(rb"^[ \t]*(?:GLOBAL[ \t]+)?DEF(?:DAT|FCT)?[ \t]+\S", re.IGNORECASE | re.MULTILINE)


def recognise(data: bytes) -> str:
    """Return ``krl``, or ``other`` for a file of some other kind: C, a measuring program, a point cloud."""
    sample = data[:_SAMPLE]
    if b"\0" in sample and not _HEAD.search(sample):
        return "other"
    return "krl" if looks_like_krl(SourceText("", sample, ENCODINGS).text) else "other"
