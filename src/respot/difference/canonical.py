"""What a statement says, apart from how it is spelled: the keys that statements are compared by.

Names and keywords are upper case, numbers have one spelling each, blanks and comments are gone. Two numbers are the
same if a controller holds the same for both: it keeps them in single precision (facts: krl.md 1, rapid.md 1.2) and
prints 467.13 as 467.130005.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Mapping
from functools import lru_cache

from respot.program.statement import Statement, number
from respot.source import Span

Key = tuple[str, ...]
#: Place of a literal that is compared by itself, and what stands for it in a key.
Mask = tuple[Span, str]

TARGET, NUMBER = "<target>", "<number>"
_LARGEST_SINGLE = 3.4e38
_NO_NAMES: Mapping[str, str] = {}


def single(value: float) -> float:
    """Return the number that a controller holds for a value: in single precision."""
    if abs(value) > _LARGEST_SINGLE:
        return value
    return float(struct.unpack("f", struct.pack("f", value))[0])


@lru_cache(maxsize=1 << 16)
def spelled(text: str) -> str:
    """Return the one spelling of a number literal, sign included; 0 has none.

    >>> spelled("- 1.50"), spelled("9E+09"), spelled("-0.0")
    ('-1.5', '9000000000', '0')
    """
    try:
        value = number(text)
    except ValueError:
        return text.upper()
    if value.is_integer():
        return str(int(value))
    return repr(single(value))


def key(statement: Statement, masks: Iterable[Mask] = (), names: Mapping[str, str] = _NO_NAMES) -> Key:
    r"""Return what a statement says, token by token.

    Parameters
    ----------
    statement : Statement
        The statement.
    masks : iterable of Mask
        Literals that are compared apart.
    names : mapping of str to str
        Other names that stand for some, both in upper case: what was renamed.

    Notes
    -----
    RAPID's comma before ``\`` may be left out and says nothing (facts: rapid.md 1.4).
    """
    text = statement.text
    units = {span[0]: (span[1], mark) for span, mark in masks}
    if statement.shape.tree is not None:
        numbers = statement.numbers()
        for written, span in zip(numbers.texts, numbers.spans, strict=True):
            units.setdefault(span[0], (span[1], spelled(written)))
    found: list[str] = []
    position = statement.start
    for start, end in statement.tokens():
        if start < position:
            continue
        unit = units.get(start)
        if unit is not None:
            position = max(unit[0], end)
            found.append(unit[1])
            continue
        word = text[start:end]
        if word[0] == '"':
            found.append(word)
            continue
        if word == "\\" and found and found[-1] == ",":
            found.pop()
        upper = spelled(word) if word[0].isdigit() else word.upper()
        found.append(names.get(upper, upper))
    return tuple(found)


def plain_tokens(statement: Statement) -> list[str]:
    """Return the tokens of a statement as written, comments left out."""
    return [statement.text[start:end] for start, end in statement.tokens()]
