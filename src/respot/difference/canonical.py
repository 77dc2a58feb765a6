"""What a statement says, apart from how it is spelled: the keys that statements are compared by.

Names and keywords are upper case, numbers have one spelling each, blanks and comments are gone. Two numbers are the
same if a controller holds the same for both: it keeps them in single precision (facts: krl.md 1, rapid.md 1.2) and
prints 467.13 as 467.130005.
"""

from __future__ import annotations

import re
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
_WHOLE = re.compile(r"[+-]?\s*\d+")
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


def upper_case(word: str) -> str:
    """Return a name in upper case; letters without one of their own, such as the sharp s, stay."""
    if word.isascii():
        return word.upper()
    return "".join(upper if len(upper := letter.upper()) == 1 else letter for letter in word)


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
    RAPID's comma before ``\`` may be left out and says nothing (facts: rapid.md 1.4). Where something is divided, 2 and
    2.0 are told apart: KRL divides whole numbers without a rest. RAPID's ``dnum`` is held in double precision.
    """
    text = statement.text
    units = {span[0]: (span[1], mark) for span, mark in masks}
    tokens = statement.tokens()
    words = [text[start:end] for start, end in tokens]
    divided, double = "/" in words, any(word.lower() == "dnum" for word in words[:4])
    if statement.shape.tree is not None:
        numbers = statement.numbers()
        for written, span in zip(numbers.texts, numbers.spans, strict=True):
            said = repr(number(written)) if double else spelled(written)
            if divided and not _WHOLE.fullmatch(written):
                said += " REAL"
            units.setdefault(span[0], (span[1], said))
    found: list[str] = []
    position = statement.start
    for (start, end), word in zip(tokens, words, strict=True):
        if start < position:
            continue
        unit = units.get(start)
        if unit is not None:
            position = max(unit[0], end)
            found.append(unit[1])
            continue
        if word[0] == '"':
            found.append(word)
            continue
        if word == "\\" and found and found[-1] == ",":
            found.pop()
        upper = spelled(word) if word[0].isdigit() else upper_case(word)
        found.append(names.get(upper, upper))
    return tuple(found)


def plain_tokens(statement: Statement) -> list[str]:
    """Return the tokens of a statement as written, comments left out."""
    return [statement.text[start:end] for start, end in statement.tokens()]
