"""Changed text comes from templates: literals with the gaps and number style of their source, and the header.

Robot-code templates use ``<< >>``, ``<% %>`` and ``<# #>``, since KRL has braces of its own; they render with line
feeds and get the file's line end afterwards. Text of a program reaches a template as data only.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from functools import cache
from pathlib import Path

from respot.issues import BadInputError
from respot.languages.overlay import COMMENT_MARKS, environment, render
from respot.program.targets import Number
from respot.source import SourceText, Span
from respot.tolerance import MOST_DECIMALS, NumberStyle, spell


@dataclass(frozen=True)
class Change:
    """A number of a literal and what it becomes.

    Parameters
    ----------
    number : Number
        The number as it stands.
    value : float or Decimal
        Its new value.
    style : NumberStyle
        How the new value is spelled.
    """

    number: Number
    value: Decimal | float
    style: NumberStyle


@dataclass(frozen=True)
class Field:
    """What a template gets for one number: the text before it, its value and its style."""

    gap: str
    value: Decimal | float
    style: NumberStyle


@dataclass(frozen=True)
class Header:
    """What the header of a changed file says.

    Parameters
    ----------
    version : str
        Version of respot.
    direction : str
        ``align`` or ``compensate``.
    kind : str
        ``theory`` or ``measured``.
    source_sha256, calibration_sha256 : str
        Hash of the file before the change and of the calibration.
    earlier : tuple of str
        Hashes of calibrations that were applied to the file before.
    snapped : bool
        Welds were shifted one by one: the change is no rigid motion, and none turns it back.
    """

    version: str
    direction: str
    kind: str
    source_sha256: str
    calibration_sha256: str
    earlier: tuple[str, ...] = ()
    snapped: bool = False


class Templates:
    """The templates of one language.

    Parameters
    ----------
    language : str
        Folder under ``templates``.
    overlay : Path, optional
        A plant's own templates; its ``<language>`` folder is searched first.
    """

    def __init__(self, language: str, overlay: Path | None = None) -> None:
        self._overlay = overlay
        self._environment = environment(language, overlay)
        self._mark = COMMENT_MARKS[language]

    def literal(self, text: str, span: Span, changes: Iterable[Change]) -> str:
        """Text of a literal with some of its numbers changed.

        Parameters
        ----------
        text : str
            The file.
        span : tuple
            Span of the literal.
        changes : iterable of Change
            Numbers within the span, in any order.

        Raises
        ------
        BadInputError
            ``BAD_TEMPLATE``, as for all texts of a plant's template that fails.
        """
        return self._numbers("literal.j2", text, span, changes)

    def frame(self, text: str, span: Span, changes: Iterable[Change]) -> str:
        """Text of a tool or base with some of its numbers changed; as `literal`."""
        return self._numbers("frame.j2", text, span, changes)

    def _numbers(self, template: str, text: str, span: Span, changes: Iterable[Change]) -> str:
        fields: list[Field] = []
        position, end = span
        for change in sorted(changes, key=lambda change: change.number.span):
            fields.append(Field(text[position : change.number.span[0]], change.value, change.style))
            position = change.number.span[1]
        return self._render(template, text[slice(*span)], fields=fields, tail=text[position:end])

    def complete(self, literal: str, missing: Mapping[str, float], style: NumberStyle) -> str:
        """Text of a literal with components that it left out."""
        return self._render("complete.j2", literal, literal=literal, missing=missing, style=style)

    def header(self, header: Header, newline: str) -> str:
        """Text of the header, every line ended.

        Raises
        ------
        BadInputError
            ``BAD_TEMPLATE`` if it would not be found again, or does not say what was applied to what.
        """
        text = self._render("header.j2", "", header=header)
        self._check_header(text, header)
        return "".join(line + newline for line in text.splitlines())

    def _render(self, name: str, source: str, **data: object) -> str:
        """Render a template; every character beyond ASCII must come from the ``source``, whose code page has it."""
        text = render(self._environment, name, self._overlay, data)
        strange = set() if text.isascii() else {character for character in text if ord(character) > 127} - set(source)
        if strange:
            message = f"writes {''.join(sorted(strange))!r}: not every controller has such letters; write plain ASCII"
            raise self._bad(name, message)
        return text

    def _check_header(self, text: str, header: Header) -> None:
        start = f"{self._mark}respot: "
        for line in text.splitlines():
            if not line.strip(" \t").startswith(start) or _HEADER_LINE.fullmatch(f"{line}\n") is None:
                message = f"writes the line {line!r}: each must begin with {start!r}, or the header is not found again"
                raise self._bad("header.j2", message)
        said = f"{start}{header.version} {header.direction} {header.kind}{' snapped' if header.snapped else ''}"
        compensated = (header.direction, header.kind) == ("compensate", "measured")
        as_read = (_COMPENSATED.search(text) is not None, _SNAPPED.search(text) is not None)
        if said not in text or as_read != (compensated, header.snapped):
            raise self._bad("header.j2", f"has no line {said!r}, which says what was done and for which cell")
        if set(_APPLIED.findall(text)) != {header.calibration_sha256, *header.earlier}:
            message = (
                f"lacks '{start}calibration sha256 ...' or '{start}earlier calibration sha256 ...': without them a "
                "calibration could be applied twice"
            )
            raise self._bad("header.j2", message)
        if f"{start}source sha256 {header.source_sha256}" not in text:
            raise self._bad("header.j2", f"lacks '{start}source sha256 ...', the file that it was made from")

    def _bad(self, name: str, message: str) -> BadInputError:
        path = self._environment.get_template(name).filename
        return BadInputError("BAD_TEMPLATE", f"{message}. Nothing was written", path)


@cache
def templates(language: str, overlay: Path | None = None) -> Templates:
    """Return the templates of a language, loaded once."""
    return Templates(language, overlay)


#: A line of a header of ours, whatever the comment mark: ``;respot: ..``, ``  !respot: ..``
_HEADER_LINE = re.compile(r"[ \t]*[;!]respot: [^\r\n]*(?:\r*\n|\r|$)")
_COMPENSATED = re.compile(r"[;!]respot: \S+ compensate measured\b")
_SNAPPED = re.compile(r"[;!]respot: \S+ \S+ \S+ snapped\b")
_APPLIED = re.compile(r"[;!]respot: (?:earlier )?calibration sha256 ([0-9a-f]{64})")


def header_span(source: SourceText, after_line: int) -> Span:
    """Span of our header below a line: empty, at the start of the next line, if there is none."""
    starts = source.line_starts
    start = starts[after_line] if after_line < len(starts) else len(source.text)
    end = start
    while match := _HEADER_LINE.match(source.text, end):
        if match.end() == end:
            break
        end = match.end()
    return start, end


def applied_calibrations(source: SourceText) -> set[str]:
    """Hashes of the calibrations that the file's header names."""
    return set(_APPLIED.findall(source.text))


def says_compensated(source: SourceText) -> bool:
    """Whether the file's header says that its points were compensated by a measurement, and not turned back since."""
    return _COMPENSATED.search(source.text) is not None


def says_snapped(source: SourceText) -> bool:
    """Whether the file's header says that its welds were shifted one by one."""
    return _SNAPPED.search(source.text) is not None


def finest(numbers: Iterable[Number], least: int) -> int:
    """Decimals of numbers that change together: those of the finest, at least ``least``.

    Each new number depends on all old ones. A coarse one among them would keep the others from coming back to the last
    digit when the change is turned back.
    """
    own = (-int(number.value.as_tuple().exponent) for number in numbers if not number.value.is_zero())
    return min(max(least, *own, 0), MOST_DECIMALS)


def changes_of(
    text: str, numbers: Mapping[str, Number], values: Mapping[str, float], decimals: Mapping[str, int]
) -> Sequence[Change]:
    """Changes of a literal's fields to new values, each with its source's decimals but at least ``decimals``.

    A field whose new value spells like the old one, digit by digit, stays as it is.
    """
    changes = []
    for name, value in values.items():
        number = numbers[name]
        style = NumberStyle.changed(text[slice(*number.span)], decimals[name])
        apart = abs(value - float(number.value)) > 10.0**-style.decimals
        if apart or spell(value, style) != spell(number.value, style):
            changes.append(Change(number, value, style))
    return changes
