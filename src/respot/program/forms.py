"""Inline forms: one instruction that its fold writes down several times.

A form's field, such as its velocity, stands in the title of the fold, in its tail, in its parameters, in the code
below and in the data list. Each such place is a `Copy`. The robot obeys the code and the data; the pendant shows the
title and writes the rest anew from it at the next touch-up. Copies that disagree are therefore an issue, and a field is
changed in all its copies or in none.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal, InvalidOperation
from functools import cached_property
from pathlib import PurePosixPath
from typing import NamedTuple

from respot.issues import BadInputError, Issue
from respot.source import Edit, SourceText, Span
from respot.tolerance import NumberStyle, spell

#: Where a copy of a field may stand.
REGIONS = ("title", "tail", "params", "body", "data")
#: What the robot obeys comes first.
_RANK = {region: rank for rank, region in enumerate(("body", "data", "tail", "params", "title"))}
#: Values of a field that is either there or not.
ON, OFF = "on", "off"
_NAME_PART = re.compile(r"[\w$]", re.ASCII)
_NAME = re.compile(r"[A-Za-z_$][\w$]*", re.ASCII)
_STRING = re.compile(r'"[^"]*"')
_LONGEST_SHOWN = 60


@dataclass(frozen=True)
class Spelling:
    """How a copy writes its value.

    Parameters
    ----------
    number : bool
        The value is a number; a text that is none, such as a variable, cannot be compared.
    yes, no : str or None
        Texts of a field that is there or not: ``" CONT"`` and ``""``, ``True`` and ``False``; None for other fields.
    decimals : int
        A changed number gets at least so many decimals.
    """

    number: bool = False
    yes: str | None = None
    no: str = ""
    decimals: int = 0

    def value(self, text: str) -> str | None:
        """Value that a text stands for, the same for all spellings of it; None where it cannot be compared."""
        plain = text.strip()
        if self.yes is not None:
            off = self.no.strip()
            if plain.upper() == off.upper():
                return OFF
            return ON if plain.upper() == self.yes.strip().upper() or not off else None
        if self.number:
            number = _decimal(plain)
            return None if number is None else _plain(number)
        return plain

    def text(self, old: str, value: str) -> str | None:
        """Text of a new value in the manner of the old text; None where the copy cannot hold it."""
        if self.yes is not None:
            wanted = {ON: self.yes, OFF: self.no}.get(value)
            return old if wanted is None or self.value(old) == value else wanted
        if not self.number:
            return value
        number = _decimal(value)
        if number is None or self.value(old) is None:
            return None
        if number == _decimal(old):
            return old
        written = old.strip()
        style = NumberStyle.of(written)
        # 2.60000 is padded and stays so; 0.25 has the decimals that its value needs
        padded = style.decimals if written.endswith("0") else 0
        needed = max(0, -int(number.normalize().as_tuple().exponent))
        decimals = max(padded, needed, self.decimals)
        return spell(number, NumberStyle(decimals, point=decimals > 0))


_AS_IT_IS = Spelling()


class Copy(NamedTuple):
    """One place where a field of a form is written.

    Parameters
    ----------
    region : str
        One of `REGIONS`.
    path : str
        File.
    span : tuple
        Span of the value in the file.
    text : str
        The value as written.
    line : int
        Its line, from 1.
    shown : str
        The value with its label: ``Tool[28]``.
    within : tuple
        Span of the text in which the pattern found it.
    pattern : re.Pattern
        What found it.
    field : str
        Field it is a copy of.
    datum : str
        In the region ``data``: name of the declared datum.
    visible : bool
        Other modules can see the datum.
    spelling : Spelling
        How it writes its value.
    """

    region: str
    path: str
    span: Span
    text: str
    line: int
    shown: str
    within: Span
    pattern: re.Pattern[str]
    field: str
    datum: str = ""
    visible: bool = False
    spelling: Spelling = _AS_IT_IS

    @property
    def value(self) -> str | None:
        """Value that it stands for; None where it cannot be compared with others."""
        return self.spelling.value(self.text)

    @property
    def place(self) -> str:
        """Where it stands, for people."""
        where = {"params": "the parameters", "data": self.datum}.get(self.region, f"the {self.region}")
        return f"{where} ({self.path}:{self.line})"

    def accepts(self, source: str, text: str) -> bool:
        """Whether the same pattern would find a new text at this place, whole."""
        start, end = self.within
        at = self.span[0] - start
        changed = source[start : self.span[0]] + text + source[self.span[1] : end]
        return any(
            match.span(self.field) == (at, at + len(text))
            for match in self.pattern.finditer(changed)
            if match.groupdict().get(self.field) is not None
        )


@dataclass(frozen=True)
class Contents:
    """What is read from a form.

    Parameters
    ----------
    fields : mapping of str to sequence of Copy
        Copies of each field; the first says what the robot obeys.
    suggestions : mapping of str to sequence of Copy
        What the controller proposes for the next form. These are no copies, but may hold a name of this form.
    missing : mapping of str to sequence of str
        Data that the code names and that hold copies of a field, but are not declared in the files read.
    """

    fields: Mapping[str, Sequence[Copy]] = field(default_factory=dict)
    suggestions: Mapping[str, Sequence[Copy]] = field(default_factory=dict)
    missing: Mapping[str, Sequence[str]] = field(default_factory=dict)


class Form:
    """An inline form. Its fields are read when they are first asked for.

    Parameters
    ----------
    profile : str
        Name of the profile that knows it.
    path : str
        File.
    line : int
        Line of its title, from 1.
    span : tuple
        From its title to the end of its fold.
    read : callable
        Reads its contents.
    fixed : frozenset of str
        Fields that cannot be changed by themselves, since others depend on them.
    longest_name : int
        Most characters of a name in its language.
    comment : str
        What begins a comment in its language.
    """

    def __init__(
        self,
        profile: str,
        path: str,
        line: int,
        span: Span,
        read: Callable[[], Contents],
        fixed: frozenset[str] = frozenset(),
        longest_name: int = 24,
        comment: str = ";",
    ) -> None:
        self.profile = profile
        self.path = path
        self.line = line
        self.span = span
        self.fixed = fixed
        self.longest_name = longest_name
        self.comment = comment
        self._read = read

    @cached_property
    def contents(self) -> Contents:
        """Everything read from it."""
        return self._read()

    @property
    def fields(self) -> Mapping[str, Sequence[Copy]]:
        """Copies of each field, what the robot obeys first."""
        return self.contents.fields

    def value(self, name: str) -> str | None:
        """Value of a field as the robot obeys it.

        Numbers are written as short as can be, fields that are there or not are ``"on"`` or ``"off"``. None where the
        form has no such field, or only copies that are known while the robot runs.
        """
        return next((copy.value for copy in self.fields.get(name, ()) if copy.value is not None), None)

    def disagreements(self) -> list[Issue]:
        """One issue ``FORM_DISAGREES`` for each field whose copies are not the same.

        Names are compared without case, numbers by their value, fields that are there or not by that alone. A copy
        that is missing disagrees with nothing.
        """
        return [issue for name, copies in self.fields.items() for issue in self._compare(name, copies)]

    def _compare(self, name: str, copies: Sequence[Copy]) -> Iterator[Issue]:
        if all(copy.text == copies[0].text and copy.spelling is copies[0].spelling for copy in copies):
            return
        firsts: dict[str, Copy] = {}
        for copy in copies:
            if copy.value is not None:
                firsts.setdefault(copy.value.upper(), copy)
        if len(firsts) > 1:
            texts = [_shown(copy) for copy in firsts.values()]
            if len(set(texts)) < len(texts):  # they differ in how much of the text is the name: say what is compared
                texts = [f"{copy.value} ({text})" for copy, text in zip(firsts.values(), texts, strict=True)]
            said = ", ".join(f"{text} in {copy.place}" for text, copy in zip(texts, firsts.values(), strict=True))
            message = f"{name}: {said}; the robot obeys the code and its data"
            yield Issue("FORM_DISAGREES", message, self.path, self.line)

    def edits(self, name: str, value: str, files: Mapping[str, SourceText]) -> dict[str, list[Edit]]:
        """Edits that change all copies of a field, each in its own spelling.

        Parameters
        ----------
        name : str
            The field.
        value : str
            Its new value as `value` gives it: a number, ``"on"`` or ``"off"``, a name without the copies' prefixes.
        files : mapping of str to SourceText
            Every file that may use what the form declares, its own among them. Global data need all of the robot's.

        Returns
        -------
        dict of str to list of Edit
            Edits by file; empty where every copy has that value.

        Raises
        ------
        BadInputError
            ``FORM_NOT_CHANGED``: a copy cannot take the value, or something else depends on it.
        """
        return _Change(self, name, value, files).edits()

    def __repr__(self) -> str:
        return f"<{self.profile} form {self.path}:{self.line}>"


class _Change:
    """One field of one form gets a new value."""

    def __init__(self, form: Form, name: str, value: str, files: Mapping[str, SourceText]) -> None:
        self._form = form
        self._name = name
        self._value = value.strip()
        self._files = files
        self._copies = form.fields.get(name, ())

    def edits(self) -> dict[str, list[Edit]]:
        self._may_change()
        old = self._form.value(self._name)
        changed = [(copy, self._text(copy)) for copy in self._copies]
        changed = [(copy, text) for copy, text in changed if text != copy.text]
        if not changed:
            return {}
        self._check_names(changed)
        found: dict[str, list[Edit]] = {}
        for copy, text in [*changed, *self._suggested(old)]:
            reason = f"{self._name} of the form in line {self._form.line}: {copy.text.strip()!r} to {text.strip()!r}"
            found.setdefault(copy.path, []).append(Edit(copy.span, text, reason))
        return {path: sorted(edits, key=lambda edit: edit.span) for path, edits in found.items()}

    def _may_change(self) -> None:
        name, form = self._name, self._form
        if not self._copies:
            known = ", ".join(form.fields) or "none"
            raise self._refused(f"the form has no field {name}; it has {known}")
        if name in form.fixed:
            raise self._refused(f"{name} cannot be changed by itself: what depends on it is no copy of it")
        if form.contents.missing.get(name):
            missing = ", ".join(form.contents.missing[name])
            raise self._refused(f"{missing} holds {name} too and is not declared in the files that were read")
        for copy in self._copies:
            source = self._files.get(copy.path)
            if source is None or source.text[slice(*copy.span)] != copy.text:
                raise self._refused(f"{copy.path} is not among the files, or was changed since the form was read")
            if copy.region == "data" and _module(copy.path) != _module(form.path):
                raise self._refused(f"{copy.datum} is declared in another module ({copy.path}:{copy.line})")

    def _text(self, copy: Copy) -> str:
        """Text of a copy with the new value."""
        spelling = copy.spelling
        if spelling.yes is not None and self._value not in (ON, OFF):
            raise self._refused(f"{self._name} is either {ON} or {OFF}, not {self._value!r}")
        if not self._value.isprintable():
            raise self._refused(f"{self._value!r} does not fit on one line")
        if spelling.number and _decimal(self._value) is None:
            raise self._refused(f"{self._name} is a number; {self._value!r} is none")
        text = spelling.text(copy.text, self._value)
        if text is None:
            raise self._refused(f"{_shown(copy)} in {copy.place} is no number and may be used elsewhere")
        source = self._files[copy.path]
        try:
            source.encode(text)
        except UnicodeEncodeError:
            raise self._refused(f"{copy.path} cannot hold {text!r} in its code page {source.encoding}") from None
        if text != copy.text and not copy.accepts(source.text, text):
            raise self._refused(f"{copy.place} cannot hold {text!r}")
        return text

    def _check_names(self, changed: Sequence[tuple[Copy, str]]) -> None:
        """Check the names that become other names, and the data that change."""
        new: dict[str, str] = {}
        touched: dict[str, bool] = {}
        for copy, text in changed:
            if copy.region not in ("body", "data"):
                continue
            old, start = self._whole_name(copy)
            name = old[:start] + text + old[start + len(copy.text) :]
            if copy.datum:
                touched[copy.datum.upper()] = copy.visible
            if _NAME.fullmatch(old) and not copy.spelling.number and copy.spelling.yes is None:
                if not _NAME.fullmatch(name):
                    raise self._refused(f"{name!r} is no name")
                if self._is_constant(copy, start):
                    continue
                if len(name) > self._form.longest_name:
                    raise self._refused(
                        f"{name} has {len(name)} characters; a name has at most {self._form.longest_name}"
                    )
                new[old.upper()] = name
        for old in new:
            if old not in touched:
                raise self._refused(f"{old} is not declared in the files that were read")
        form, copies = self._form, [copy for copy, _ in changed]
        renamed = {old: touched[old] for old in new}
        kept = {name: visible for name, visible in touched.items() if name not in new}
        # a new name must reach every use, also within the form; a changed datum may serve this form alone
        proposed = [(copy.path, copy.within) for found in form.contents.suggestions.values() for copy in found]
        uses = [
            *self._uses(renamed, [*proposed, *((copy.path, copy.span) for copy in copies)]),
            *self._uses(kept, [*proposed, (form.path, form.span), *((copy.path, copy.within) for copy in copies)]),
        ]
        for name, source, line in uses:
            raise self._refused(f"{name} is used elsewhere too ({source.path}:{line}); that would change with it")
        for name, source, line in self._uses({name: True for name in new.values() if name.upper() not in new}, []):
            raise self._refused(f"the name {name} is taken already ({source.path}:{line})")

    def _is_constant(self, copy: Copy, start: int) -> bool:
        """Whether a name is the constant of an enumeration, as in ``#FIRST``."""
        before = copy.span[0] - start - 1
        return before >= 0 and self._files[copy.path].text[before] == "#"

    def _whole_name(self, copy: Copy) -> tuple[str, int]:
        """Return the name that a copy is a part of, and where in it the copy begins."""
        text = self._files[copy.path].text
        start, end = copy.span
        while start > 0 and _NAME_PART.match(text[start - 1]):
            start -= 1
        while end < len(text) and _NAME_PART.match(text[end]):
            end += 1
        return text[start:end], copy.span[0] - start

    def _uses(
        self, names: Mapping[str, bool], own: Sequence[tuple[str, Span]]
    ) -> Iterator[tuple[str, SourceText, int]]:
        """Uses of names outside places of one's own; names that no other module sees count in this module only."""
        if not names:
            return
        words = re.compile(rf"(?<![\w$])(?:{'|'.join(map(re.escape, names))})(?![\w$])", re.IGNORECASE)
        visible = {name.upper(): seen for name, seen in names.items()}
        for source in self._files.values():
            inside = _module(source.path) == _module(self._form.path)
            for match in words.finditer(source.text):
                if not inside and not visible[match[0].upper()]:
                    continue
                start, end = match.span()
                if any(path == source.path and first < end and start < last for path, (first, last) in own):
                    continue
                line, column = source.place(start)
                if self._form.comment not in _STRING.sub("", source.line_text(line)[: column - 1]):
                    yield match[0], source, line

    def _suggested(self, old: str | None) -> Iterator[tuple[Copy, str]]:
        """Suggestions that hold exactly the old name, with the new one.

        They do not move the robot. They follow a renamed point so that the pendant proposes no name that is gone.
        """
        for copy in self._form.contents.suggestions.get(self._name, ()):
            if old is not None and copy.text.strip().upper() == old.upper() and copy.path in self._files:
                width = len(copy.text) if copy.text != copy.text.rstrip() else 0
                yield copy, self._value.ljust(width)

    def _refused(self, reason: str) -> BadInputError:
        message = f"{self._name} stays as it is: {reason}"
        return BadInputError("FORM_NOT_CHANGED", message, self._form.path, self._form.line)


def ranked(copies: Sequence[Copy]) -> list[Copy]:
    """Copies with those first that the robot obeys; one place counts once."""
    once: dict[tuple[str, Span], Copy] = {}
    for copy in copies:
        once.setdefault((copy.path, copy.span), copy)
    return sorted(once.values(), key=lambda copy: _RANK[copy.region])


def _shown(copy: Copy) -> str:
    """Return the value with its label, or that it is not there."""
    shown = " ".join(copy.shown.split()) or "nothing"
    return shown if len(shown) <= _LONGEST_SHOWN else copy.text.strip()


def _decimal(text: str) -> Decimal | None:
    if not re.fullmatch(r"[+-]?(?:\d+\.?\d*|\.\d+)", text.strip(), re.ASCII):
        return None
    try:
        return Decimal(text.strip())
    except InvalidOperation:
        return None


def _plain(number: Decimal) -> str:
    """Write a number as short as can be."""
    text = f"{number:f}"
    text = text.rstrip("0").rstrip(".") if "." in text else text
    return "0" if text in ("-0", "") else text


def _module(path: str) -> str:
    """Key of the module that a file belongs to."""
    return str(PurePosixPath(path).with_suffix("")).upper()
