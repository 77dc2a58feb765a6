"""The record of an effect that was found, in the shape that every report shows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

RemedyPlace = Literal["tool", "base", "points", "spot_list", "robot", "process"]


@dataclass(frozen=True)
class Remedy:
    """Where a person would fix the cause, and how."""

    where: RemedyPlace
    text: str


@dataclass(frozen=True)
class Rival:
    """Another explanation that was tried, and its held-out RMS [mm]; None where no way to fold is fair to it."""

    name: str
    heldout_rms: float | None


@dataclass(frozen=True)
class Effect:
    """One effect; ``parameters`` maps a name to ``{value, unit, ci95}``; ``p_value`` is None where none exists."""

    name: str
    where: Mapping[str, Any]
    named: bool
    remedy: Remedy
    heldout_gain: float | None
    p_value: float | None = None
    parameters: Mapping[str, Any] = field(default_factory=dict)
    not_separated_from: tuple[str, ...] = ()
    rivals: tuple[Rival, ...] = ()
    evidence: Mapping[str, Any] = field(default_factory=dict)

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON object of ``effects`` in the result of a fit."""
        return {
            "name": self.name,
            "where": dict(self.where),
            "parameters": dict(self.parameters),
            "named": self.named,
            "not_separated_from": list(self.not_separated_from),
            "rivals": [{"name": rival.name, "heldout_rms": rival.heldout_rms} for rival in self.rivals],
            "p_value": self.p_value,
            "heldout_gain": self.heldout_gain,
            "heldout_rms": self.evidence.get("heldout_rms"),
            "remedy": {"where": self.remedy.where, "text": self.remedy.text},
            "evidence": dict(self.evidence),
        }
