"""Does respot understand a file, and can it write it back? The work behind `respot check`.

A file round-trips if every number of every statement, parsed into its exact value and its style and rendered through
the template of its language between the gaps that the file has, gives the file's bytes again.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from pathlib import PurePosixPath

from respot.issues import Issue
from respot.languages import LANGUAGES, Language
from respot.languages.reading import opaque_issues
from respot.languages.writing import Change, templates
from respot.program.robot import ProgramFile
from respot.program.statement import OPAQUE, Statement
from respot.program.targets import Number
from respot.source import SourceText
from respot.tolerance import NumberStyle

_NEWLINE_NAMES = {"\r\n": "CRLF", "\n": "LF", "\r": "CR", "\r\r\n": "CRCRLF"}
#: Text that is never written by a language's template: it has no numbers that respot reads.
_BASED = ("0x", "0o", "0b")


@dataclass(frozen=True)
class CheckedFile:
    """What a check found in a file.

    Parameters
    ----------
    path : str
        As the user can find it.
    language : str
        ``krl``, ``rapid``, ``other`` or ``binary``.
    encoding, newline : str
        How it is written; empty for a binary file.
    bytes : int
        Its size.
    statements : int
        Statements: no blank lines, comments or fold marks.
    opaque : int
        Statements that no rule knows.
    roundtrip : bool
        Written back from what was read it is the same, byte for byte.
    issues : tuple of Issue
        Opaque statements and unbalanced blocks, with their place.
    """

    path: str
    language: str
    encoding: str
    newline: str
    bytes: int
    statements: int
    opaque: int
    roundtrip: bool
    issues: tuple[Issue, ...]


def language_of(path: str) -> Language | None:
    """Language that a file's suffix promises, None for a file that is no program."""
    suffix = PurePosixPath(path.lower()).suffix
    return next((language for language in LANGUAGES.values() if suffix in language.suffixes), None)


def check_file(item: tuple[str, bytes]) -> CheckedFile:
    """Check one file: its path as the user can find it, and its bytes."""
    path, data = item
    language = language_of(path)
    kind = "other" if language is None else language.recognise(data)
    if language is None or kind != language.name:
        return CheckedFile(path, kind, "", "", len(data), 0, 0, True, ())
    collecting = gc.isenabled()
    gc.disable()  # trees of a file are no cycles: collecting them over and over halves the speed
    try:
        return _check(path, data, language)
    finally:
        if collecting:
            gc.enable()


def _check(path: str, data: bytes, language: Language) -> CheckedFile:
    source = SourceText(path, data, language.encodings)
    statements = language.read_statements(source.text, source.line_starts)
    file = ProgramFile(source, PurePosixPath(path).stem, statements)
    counted = [statement for statement in statements if statement.kind not in language.no_statement]
    newline = source.newline if any(end in source.text for end in "\r\n") else ""
    return CheckedFile(
        path=path,
        language=language.name,
        encoding=source.encoding + (" with byte order mark" if source.bom else ""),
        newline=_NEWLINE_NAMES.get(newline, "none" if not newline else "other"),
        bytes=len(data),
        statements=len(counted),
        opaque=sum(statement.kind == OPAQUE for statement in counted),
        roundtrip=round_trips(source, statements, language),
        issues=(*opaque_issues(file), *language.block_issues(path, statements)),
    )


def round_trips(source: SourceText, statements: Sequence[Statement], language: Language) -> bool:
    """Whether rendering what was read gives the file's bytes."""
    text = source.text
    parts: list[str] = []
    position = 0
    made = templates(language.name)
    for statement in statements:
        if statement.start < position:
            return False
        parts.append(text[position : statement.start])
        span = (statement.start, statement.end)
        parts.append(made.literal(text, span, _numbers(statement)))
        position = statement.end
    parts.append(text[position:])
    return source.encode("".join(parts)) == source.data


def _numbers(statement: Statement) -> Iterator[Change]:
    if statement.shape.tree is None:
        return
    numbers = statement.numbers()
    for text, span in zip(numbers.texts, numbers.spans, strict=True):
        if text.lstrip("+- \t").lower().startswith(_BASED):
            continue
        value = _value(text)
        if value is not None:
            yield Change(Number(value, span), value, NumberStyle.of(text))


def _value(text: str) -> Decimal | None:
    try:
        return Decimal("".join(text.split()))
    except InvalidOperation:
        return None
