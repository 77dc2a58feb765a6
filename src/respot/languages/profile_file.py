"""Reads a profile of instruction forms from its TOML file; what no profile has is refused by its name."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from string import Formatter
from typing import Any

from respot.issues import BadInputError
from respot.languages.profile import CopyRule, FormRule, IdRule, Profile, WeldCall, WrapperRule
from respot.program.forms import REGIONS
from respot.program.moves import LabelKind, Motion
from respot.tolerance import MOST_DECIMALS


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
