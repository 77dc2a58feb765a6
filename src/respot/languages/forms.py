"""Data-driven knowledge of instruction forms: one profile, a small TOML file, for each dialect.

A profile says which calls and instructions weld, where a spot's ID may stand, which routines look after the gun, and
where the copies of a form's fields stand. Profiles of a language lie in its folder ``profiles``; a plant may lay its
own before them.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from string import Formatter
from typing import Any

from respot.issues import BadInputError
from respot.program.forms import REGIONS, Spelling
from respot.program.moves import Label, LabelKind, Motion
from respot.tolerance import MOST_DECIMALS


@dataclass(frozen=True)
class WeldCall:
    """A call that welds, with the first argument it must have, if any, and what its arguments must begin with.

    The pattern sees the arguments without blanks, with commas between them.
    """

    name: str
    argument: str = ""
    pattern: re.Pattern[str] | None = None

    def fits(self, arguments: Sequence[str]) -> bool:
        """Whether a call with these arguments welds."""
        if self.argument and (not arguments or arguments[0].strip().upper() != self.argument.upper()):
            return False
        return self.pattern is None or bool(self.pattern.match(",".join("".join(text.split()) for text in arguments)))


@dataclass(frozen=True)
class IdRule:
    """Where a spot ID may stand.

    Parameters
    ----------
    where : LabelKind
        What of a motion is searched.
    pattern : re.Pattern
        Its first group is the ID.
    weld : bool
        Whatever it finds is a weld spot, even if nothing else tells that the motion welds.
    fallback : bool
        Tried after the rules of all profiles.
    """

    where: LabelKind
    pattern: re.Pattern[str]
    weld: bool = False
    fallback: bool = False


@dataclass(frozen=True)
class WrapperRule:
    """A routine that moves the robot to a position it is handed, where the backup does not hold the routine itself.

    Parameters
    ----------
    name : re.Pattern
        What its whole name must match.
    motion : Motion
        Kind of path.
    weld : bool
        It welds there.
    target, tool, base : int or str
        Which of its arguments without a name each is, from 1; a text is the name of the datum that the routine itself
        uses. 0: the types of the arguments tell.
    """

    name: re.Pattern[str]
    motion: Motion
    weld: bool = False
    target: int | str = 0
    tool: int | str = 0
    base: int | str = 0


@dataclass(frozen=True)
class CopyRule:
    """Where copies of a form's fields stand.

    Parameters
    ----------
    region : str
        One of `REGIONS`. ``title``: the opening line without its tail. ``tail``: from ``%{`` on. ``params``: each
        ``;Params`` line and the opening line of each fold within that is no form itself. ``body``: each statement,
        without a comment behind it. ``data``: the declaration of a datum that the body names, from its name on.
    pattern : re.Pattern
        Each named group is a copy of the field of that name; every match in the region counts.
    name : str
        In ``data``: the name of the datum, with fields in braces: ``F{point}``.
    when : re.Pattern or None
        What the opening line must hold for the rule to count.
    yes, no : str or None
        For a field that is there or not: its texts, such as ``" C_DIS"`` and ``""``.
    decimals : int
        A changed number gets at least so many decimals.
    suggestion : bool
        What it finds is only proposed for the next form; it follows a change where it holds the same name.
    """

    region: str
    pattern: re.Pattern[str]
    name: str = ""
    when: re.Pattern[str] | None = None
    yes: str | None = None
    no: str = ""
    decimals: int = 0
    suggestion: bool = False

    @cached_property
    def _spellings(self) -> tuple[Spelling, Spelling]:
        texts = (self.yes, self.no, self.decimals)
        return Spelling(False, *texts), Spelling(True, *texts)

    def spelling(self, number: bool) -> Spelling:
        """How its copies are written, of a number or of anything else."""
        return self._spellings[number]


@dataclass(frozen=True)
class FormRule:
    """An inline form: how it is known, and where each of its fields stands.

    Parameters
    ----------
    title : re.Pattern
        What the opening line of its fold must hold, tail included.
    copies : sequence of CopyRule
        Where the fields stand.
    numbers : frozenset of str
        Fields that are compared as numbers; any other is compared without case.
    params : re.Pattern or None
        What a ``;Params`` line of it must hold.
    fixed : frozenset of str
        Fields that are never changed by themselves, since something else depends on them that is no copy.
    common : bool
        It has the copies too that are common to all forms of the language.
    block : bool
        Other forms stand within it, as in a spline block; otherwise a form ends where the next one begins.
    """

    title: re.Pattern[str]
    copies: Sequence[CopyRule]
    numbers: frozenset[str] = frozenset()
    params: re.Pattern[str] | None = None
    fixed: frozenset[str] = frozenset()
    common: bool = True
    block: bool = False


@dataclass(frozen=True)
class Profile:
    """One dialect, from its TOML file.

    Parameters
    ----------
    name, language, title : str
        Name of the file, language it is for, what it is for people.
    weld_calls : sequence of WeldCall
        A motion welds if one of them follows it before the next motion.
    weld_instructions : sequence of re.Pattern
        Instructions that weld by their name.
    ids : sequence of IdRule
        Where spot IDs stand, best first.
    home : sequence of re.Pattern
        Names of positions that are joints wherever they are declared.
    harmless : frozenset of str
        Calls, in upper case, that change neither frames nor positions.
    service : sequence of re.Pattern
        Names of routines that look after the gun.
    forms : sequence of FormRule
        Inline forms.
    copies : sequence of CopyRule
        Copies that are common to all forms of the language.
    numbers, fixed : frozenset of str
        As in `FormRule`, for these copies.
    wrappers : sequence of WrapperRule
        Routines that move the robot and are not in the backup.
    """

    name: str
    language: str
    title: str
    weld_calls: Sequence[WeldCall] = ()
    weld_instructions: Sequence[re.Pattern[str]] = ()
    ids: Sequence[IdRule] = ()
    home: Sequence[re.Pattern[str]] = ()
    harmless: frozenset[str] = frozenset()
    service: Sequence[re.Pattern[str]] = ()
    forms: Sequence[FormRule] = ()
    copies: Sequence[CopyRule] = ()
    numbers: frozenset[str] = frozenset()
    fixed: frozenset[str] = frozenset()
    wrappers: Sequence[WrapperRule] = ()


@dataclass(frozen=True)
class Forms:
    """The profiles of one language, those of the plant first."""

    profiles: Sequence[Profile]

    @classmethod
    def load(cls, folder: Path) -> Forms:
        """Read every profile of a folder, in the order of their names."""
        return cls([read_profile(path) for path in sorted(folder.glob("*.toml"))])

    def with_plant(self, profiles: Iterable[Profile]) -> Forms:
        """Return these forms with a plant's profiles before them."""
        return Forms([*profiles, *self.profiles])

    @cached_property
    def _weld_calls(self) -> Mapping[str, Sequence[WeldCall]]:
        """Calls that weld, by their name in upper case."""
        found: dict[str, list[WeldCall]] = {}
        for profile in self.profiles:
            for call in profile.weld_calls:
                found.setdefault(call.name.upper(), []).append(call)
        return found

    @cached_property
    def _harmless(self) -> frozenset[str]:
        return frozenset(self._weld_calls).union(*(profile.harmless for profile in self.profiles))

    @cached_property
    def _rules(self) -> Sequence[IdRule]:
        rules = [rule for profile in self.profiles for rule in profile.ids]
        # a comment or a routine's name never comes before what the motion itself says
        return sorted(rules, key=lambda rule: (rule.fallback, rule.where in (LabelKind.COMMENT, LabelKind.ROUTINE)))

    @cached_property
    def forms(self) -> Sequence[tuple[Profile, FormRule]]:
        """Every inline form with its profile, in the order to try; the copies that all forms have are added."""
        copies = [copy for profile in self.profiles for copy in profile.copies]
        numbers = frozenset().union(*(profile.numbers for profile in self.profiles))
        fixed = frozenset().union(*(profile.fixed for profile in self.profiles))
        found = []
        for profile in self.profiles:
            for form in profile.forms:
                if form.common:
                    form = replace(
                        form,
                        copies=[*copies, *form.copies],
                        numbers=form.numbers | numbers,
                        fixed=form.fixed | fixed,
                    )
                found.append((profile, form))
        return found

    def welds(self, name: str, arguments: Sequence[str] = ()) -> bool:
        """Whether a call welds the target of the motion before it."""
        return any(call.fits(arguments) for call in self._weld_calls.get(name.upper(), ()))

    def is_weld_instruction(self, name: str) -> bool:
        """Whether a motion welds by its own name."""
        return any(pattern.fullmatch(name) for profile in self.profiles for pattern in profile.weld_instructions)

    def wrapper(self, name: str) -> WrapperRule | None:
        """Return what is known of a routine that the backup does not hold."""
        rules = (rule for profile in self.profiles for rule in profile.wrappers)
        return next((rule for rule in rules if rule.name.fullmatch(name)), None)

    def is_harmless(self, name: str) -> bool:
        """Whether a call is known to change neither frames nor positions."""
        return name.upper() in self._harmless

    def is_home(self, name: str) -> bool:
        """Whether a position that the source does not declare is a home position: joints, which never move."""
        return any(pattern.fullmatch(name) for profile in self.profiles for pattern in profile.home)

    def is_service(self, routine: str) -> bool:
        """Whether a routine looks after the gun, by its name."""
        return any(pattern.search(routine) for profile in self.profiles for pattern in profile.service)

    def spot_ids(self, labels: Sequence[Label]) -> tuple[tuple[str, ...], bool]:
        """Return what may be the spot ID, best first, and whether a name by itself tells a weld spot."""
        found: list[str] = []
        named = False
        for rule in self._rules:
            for label in labels:
                if label.kind is rule.where and (match := rule.pattern.search(label.text)):
                    found.append(match.group(1))
                    named |= rule.weld
        return tuple(dict.fromkeys(found)), named


def read_profile(path: Path) -> Profile:
    """Read one profile.

    Raises
    ------
    BadInputError
        ``BAD_PROFILE``: it is no TOML, has a key that no profile has, or a pattern that is no regular expression.
    """
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise BadInputError("CANNOT_READ", error.strerror or str(error), str(path)) from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise BadInputError("BAD_PROFILE", f"is no TOML: {error}", str(path)) from error
    try:
        return _profile(path.stem, data)
    except _ProfileError as error:
        raise BadInputError("BAD_PROFILE", str(error), str(path)) from error


_TOP = "the profile"


class _ProfileError(Exception):
    """What is wrong with a profile."""


def _profile(name: str, data: dict[str, Any]) -> Profile:
    table = _Table(data, _TOP)
    profile = Profile(
        name=name,
        language=table.text("language", one_of=("krl", "rapid")),
        title=table.text("title"),
        weld_calls=[_weld_call(item) for item in table.tables("weld_call")],
        weld_instructions=table.patterns("weld_instructions"),
        ids=[_id_rule(item) for item in table.tables("spot_id")],
        home=table.patterns("home"),
        harmless=frozenset(text.upper() for text in table.texts("harmless_calls")),
        service=table.patterns("service_routines"),
        forms=[_form_rule(item) for item in table.tables("form")],
        copies=[_copy_rule(item) for item in table.tables("copy")],
        numbers=frozenset(table.texts("numbers")),
        fixed=frozenset(table.texts("fixed")),
        wrappers=[_wrapper_rule(item) for item in table.tables("wrapper")],
    )
    table.done()
    return profile


def _id_rule(table: _Table) -> IdRule:
    kind = LabelKind(table.text("in", one_of=[kind.value for kind in LabelKind]))
    rule = IdRule(kind, table.pattern("pattern"), table.flag("weld"), table.flag("fallback"))
    if rule.pattern.groups < 1:
        raise _ProfileError(f"{table.name}: the pattern needs a group for the ID: {rule.pattern.pattern}")
    table.done()
    return rule


def _wrapper_rule(table: _Table) -> WrapperRule:
    rule = WrapperRule(
        name=table.pattern("name"),
        motion=Motion(table.text("motion", one_of=[kind.value for kind in Motion])),
        weld=table.flag("weld"),
        target=table.argument("target"),
        tool=table.argument("tool"),
        base=table.argument("wobj"),
    )
    table.done()
    return rule


def _weld_call(table: _Table) -> WeldCall:
    call = WeldCall(table.text("name"), table.text("argument", default=""), table.pattern_or_none("pattern"))
    table.done()
    return call


def _form_rule(table: _Table) -> FormRule:
    rule = FormRule(
        title=table.pattern("title"),
        copies=[_copy_rule(item) for item in table.tables("copy")],
        numbers=frozenset(table.texts("numbers")),
        params=table.pattern_or_none("params"),
        fixed=frozenset(table.texts("fixed")),
        common=table.flag("common", default=True),
        block=table.flag("block"),
    )
    table.done()
    return rule


def _copy_rule(table: _Table) -> CopyRule:
    rule = CopyRule(
        region=table.text("in", one_of=REGIONS),
        pattern=table.pattern("pattern"),
        name=table.text("name", default=""),
        when=table.pattern_or_none("when"),
        yes=table.text_or_none("yes"),
        no=table.text("no", default=""),
        decimals=table.count("decimals"),
        suggestion=table.flag("suggestion"),
    )
    table.done()
    if not rule.pattern.groupindex:
        raise _ProfileError(f"{table.name}: the pattern names no field: {rule.pattern.pattern}")
    if bool(rule.name) != (rule.region == "data"):
        raise _ProfileError(f"{table.name}: a copy in data, and only such a copy, needs the name of its datum")
    if rule.no and rule.yes is None:
        raise _ProfileError(f"{table.name}: a copy with a text for no needs one for yes")
    try:
        names = [name for _, name, _, _ in Formatter().parse(rule.name) if name is not None]
    except ValueError as error:
        raise _ProfileError(f"{table.name}: the name {rule.name!r} is not well formed: {error}") from error
    if not all(name.isidentifier() for name in names):
        raise _ProfileError(f"{table.name}: the name {rule.name!r} needs names of fields in its braces")
    return rule


class _Table:
    """A TOML table that knows which of its keys were asked for."""

    def __init__(self, data: Mapping[str, Any], name: str) -> None:
        self.name = name
        self._data = data
        self._known: set[str] = set()

    def _get(self, key: str) -> Any:
        self._known.add(key)
        return self._data.get(key)

    def text(self, key: str, default: str | None = None, one_of: Sequence[str] = ()) -> str:
        value = self._get(key)
        if value is None and default is not None:
            return default
        if not isinstance(value, str):
            raise _ProfileError(f"{self.name} needs a text {key}")
        if one_of and value not in one_of:
            raise _ProfileError(f"{self.name}: {key} is {value!r}; it must be one of {', '.join(one_of)}")
        return value

    def texts(self, key: str) -> list[str]:
        value = self._get(key)
        if value is None:
            return []
        if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
            raise _ProfileError(f"{self.name}: {key} must be a list of texts")
        return value

    def text_or_none(self, key: str) -> str | None:
        return None if self._get(key) is None else self.text(key)

    def flag(self, key: str, default: bool = False) -> bool:
        value = self._get(key)
        if value is None:
            return default
        if not isinstance(value, bool):
            raise _ProfileError(f"{self.name}: {key} must be true or false")
        return value

    def count(self, key: str) -> int:
        value = self._get(key)
        if value is None:
            return 0
        if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= MOST_DECIMALS:
            raise _ProfileError(f"{self.name}: {key} must be a whole number from 0 to {MOST_DECIMALS}")
        return value

    def argument(self, key: str) -> int | str:
        value = self._get(key)
        if value is None:
            return 0
        if isinstance(value, bool) or not isinstance(value, int | str) or (isinstance(value, int) and value < 1):
            raise _ProfileError(f"{self.name}: {key} must be the place of an argument, from 1, or the name of a datum")
        return value

    def pattern(self, key: str) -> re.Pattern[str]:
        return self._compiled(self.text(key))

    def pattern_or_none(self, key: str) -> re.Pattern[str] | None:
        return None if self._get(key) is None else self.pattern(key)

    def patterns(self, key: str) -> list[re.Pattern[str]]:
        return [self._compiled(text) for text in self.texts(key)]

    def _compiled(self, text: str) -> re.Pattern[str]:
        try:
            return re.compile(text, re.IGNORECASE)
        except re.error as error:
            raise _ProfileError(f"{self.name}: {text!r} is no regular expression: {error}") from error

    def tables(self, key: str) -> list[_Table]:
        value = self._get(key)
        if value is None:
            return []
        if not isinstance(value, list) or not all(isinstance(item, dict) for item in value):
            raise _ProfileError(f"{self.name}: {key} must be written [[{key}]]")
        inside = "" if self.name == _TOP else f"{self.name}, "
        return [_Table(item, f"{inside}{key} {number}") for number, item in enumerate(value, 1)]

    def done(self) -> None:
        unknown = [key for key in self._data if key not in self._known]
        if unknown:
            known = ", ".join(sorted(self._known))
            raise _ProfileError(f"{self.name} has the unknown key {unknown[0]}; it may have {known}")
