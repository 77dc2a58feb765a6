"""Is it RAPID? Files with the suffix of a module that are something else are left alone."""

from __future__ import annotations

import re

from respot.languages.rapid.syntax import NO_STATEMENT, read_statements
from respot.program.statement import OPAQUE, Statement
from respot.source import NEWLINE

#: First bytes of encoded modules (facts: rapid.md 4.2).
_ENCODED = frozenset((0xFC, 0xFD, 0xFE))
_MODULE_LINE = re.compile(
    rb"^[ \t]*MODULE[ \t]+(?:[^\W\d]|[\x80-\xff])[\w\x80-\xff]*[ \t]*(?:[(!\r\n]|\Z)", re.IGNORECASE | re.MULTILINE
)
_END_MODULE = re.compile(rb"\bENDMODULE\b", re.IGNORECASE)
#: So much of a file without MODULE and ENDMODULE is read to see what it is.
_SAMPLE = 16 * 1024
#: Statements that other languages with `;` and `:=` hardly have.
_TELLING = {
    *("module", "header", "data", "record", "end_record", "end_module", "elseif", "if_", "for_", "while_"),
    *("procedure", "end_procedure", "function", "end_function", "trap", "end_trap"),
    *("end_if", "end_for", "end_while", "end_test"),
}
_MOTION = re.compile(r"(?:Move|Spot|Arc|Trigg|Search)(?:Abs|Ext)?M?[LJC]\w*\b[^;]*,[^;]*,", re.IGNORECASE)


def recognise(data: bytes) -> str:
    """Return what a file with the suffix of a RAPID module holds.

    Parameters
    ----------
    data : bytes
        The file.

    Returns
    -------
    str
        ``rapid``; ``binary`` for an encoded module; ``other`` for a file of some other kind: a Modula module, a driver,
        a tracker tune, a FoxPro program, nothing at all.
    """
    module = _MODULE_LINE.search(data)
    if data[:1] and data[0] in _ENCODED and module is None:
        return "binary"
    if module is not None and _END_MODULE.search(data, module.end()):
        return "rapid"
    return "rapid" if _reads_like_rapid(data[:_SAMPLE]) else "other"


def looks_like_rapid(data: bytes | str) -> bool:
    """Whether a file with the suffix of a RAPID module holds RAPID in plain text."""
    return recognise(data.encode("utf-8") if isinstance(data, str) else data) == "rapid"


def _reads_like_rapid(sample: bytes) -> bool:
    """Whether the beginning of a file without a whole MODULE frame holds more RAPID than anything else."""
    text = sample.removeprefix(b"\xef\xbb\xbf").decode("latin-1")
    if "\0" in text:
        return False
    if len(sample) == _SAMPLE:  # the last line is cut
        text = text[: max(text.rfind("\n"), text.rfind("\r")) + 1]
    line_starts = [0, *(match.end() for match in NEWLINE.finditer(text))]
    statements = [found for found in read_statements(text, line_starts) if found.kind not in NO_STATEMENT]
    told = sum(map(_tells, statements))
    opaque = sum(found.kind == OPAQUE for found in statements)
    return told > opaque and 3 * opaque <= len(statements)


def _tells(statement: Statement) -> bool:
    """Whether a statement could hardly be of another language."""
    if statement.kind in _TELLING:
        return True
    if statement.kind not in ("call", "assignment", "compact_if"):
        return False
    if _MOTION.match(statement.source):
        return True
    telling = ("optional_argument", "conditional_argument", "aggregate")
    return any(node.kind in telling for node in statement.node.walk())
