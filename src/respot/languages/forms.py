"""Data-driven knowledge of instruction forms: one profile, a small TOML file, for each dialect.

A profile says which calls and instructions weld, where a spot's ID may stand, which routines look after the gun, and
where the copies of a form's fields stand. Profiles of a language lie in its folder ``profiles``; a plant may lay its
own before them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

from respot.languages.profile import FormRule, IdRule, Profile, WeldCall, WrapperRule
from respot.languages.profile_file import read_profile
from respot.program.moves import Label, LabelKind


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
