"""Data-driven knowledge of a language's instruction forms: welds, spot IDs, service routines."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class WeldCall:
    """A call that welds, with the first argument it must have, if any."""

    name: str
    argument: str = ""


@dataclass(frozen=True)
class Forms:
    """The forms of one language, from its ``forms.toml``."""

    weld_calls: Sequence[WeldCall]
    weld_instructions: re.Pattern[str] | None
    id_patterns: Sequence[re.Pattern[str]]
    data_id_patterns: Sequence[re.Pattern[str]]
    home: re.Pattern[str] | None
    harmless: frozenset[str]
    service: Sequence[re.Pattern[str]]

    @classmethod
    def load(cls, path: Path) -> Forms:
        """Read a profile file."""
        data = tomllib.loads(path.read_text(encoding="utf-8"))
        instructions, home = data.get("weld_instruction"), data.get("home")
        spot_id = data.get("spot_id", {})
        return cls(
            weld_calls=[WeldCall(call["name"].upper(), call.get("argument", "").upper()) for call in data["weld_call"]],
            weld_instructions=re.compile(instructions, re.IGNORECASE) if instructions else None,
            id_patterns=_patterns(spot_id.get("names", [])),
            data_id_patterns=_patterns(spot_id.get("data", [])),
            home=re.compile(home, re.IGNORECASE) if home else None,
            harmless=frozenset(name.upper() for name in data.get("harmless", {}).get("calls", [])),
            service=_patterns(data.get("service", {}).get("routines", [])),
        )

    def welds(self, name: str, arguments: Sequence[str]) -> bool:
        """Whether a call welds."""
        first = arguments[0].upper() if arguments else ""
        return any(call.name == name.upper() and call.argument in ("", first) for call in self.weld_calls)

    def is_harmless(self, name: str) -> bool:
        """Whether a call is known to change neither frames nor positions."""
        return name.upper() in self.harmless or any(call.name == name.upper() for call in self.weld_calls)

    def is_home(self, name: str) -> bool:
        """Whether a position that the source does not declare is a home position: joints, which never move."""
        return self.home is not None and bool(self.home.fullmatch(name))

    def is_service(self, routine: str) -> bool:
        """Whether a routine looks after the gun, by its name."""
        return any(pattern.search(routine) for pattern in self.service)

    def spot_ids(self, name: str, data_names: Sequence[str] = ()) -> tuple[str, ...]:
        """Return what may be the spot ID, best first: of the target's name, then of the weld data's names."""
        found = [match.group(1) for pattern in self.id_patterns if (match := pattern.match(name))]
        for data_name in data_names:
            found += [match.group(1) for pattern in self.data_id_patterns if (match := pattern.match(data_name))]
        return tuple(dict.fromkeys(found))


def _patterns(texts: Sequence[str]) -> list[re.Pattern[str]]:
    return [re.compile(text, re.IGNORECASE) for text in texts]
