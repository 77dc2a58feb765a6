"""What holds while a routine runs: tool, base, load and interpolation mode, or why one of them is not known."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import reduce
from typing import TypeAlias, TypeVar

from respot.languages.krl.symbols import Aggregate
from respot.program.frames import Frame, Load

SLOTS = ("tool", "base", "load", "external", "pending")


@dataclass(frozen=True)
class Why:
    """Something is not known before the robot runs, and this is why."""

    reason: str


#: What a routine finds when it is called, which its callers decide.
ENTRY = Why("the routine does not set it")

Slot: TypeAlias = "Frame | Load | Aggregate | bool | Why"
_T = TypeVar("_T")


@dataclass(frozen=True)
class State:
    """What holds before a statement.

    Parameters
    ----------
    tool, base : Frame or Why
        ``$TOOL`` and ``$BASE``.
    load : Load or Why
        ``$LOAD``.
    external : bool or Why
        ``$IPO_MODE`` is ``#TCP``.
    pending : Aggregate or Why
        ``FDAT_ACT``, which ``BAS`` will apply.
    """

    tool: Frame | Why = ENTRY
    base: Frame | Why = ENTRY
    load: Load | Why = ENTRY
    external: bool | Why = ENTRY
    pending: Aggregate | Why = ENTRY

    @classmethod
    def unknown(cls, reason: str) -> State:
        """Nothing is known any more."""
        why = Why(reason)
        return cls(why, why, why, why, why)

    def forget(self, slots: Iterable[str], reason: str) -> State:
        """These are not known any more."""
        values = dict.fromkeys(slots, Why(reason))
        return replace(self, **values) if values else self

    def merge(self, other: State) -> State:
        """State behind two branches: only what both agree on."""
        if self is other or self == other:
            return self
        return State(
            _same(self.tool, other.tool),
            _same(self.base, other.base),
            _same(self.load, other.load),
            _same(self.external, other.external),
            _same(self.pending, other.pending),
        )

    def within(self, caller: State) -> State:
        """Return this state with what the caller decides: what a routine leaves is what it found."""
        return State(
            caller.tool if self.tool is ENTRY else self.tool,
            caller.base if self.base is ENTRY else self.base,
            caller.load if self.load is ENTRY else self.load,
            caller.external if self.external is ENTRY else self.external,
            caller.pending if self.pending is ENTRY else self.pending,
        )

    def touched(self) -> set[str]:
        """Return what is no longer as the caller left it."""
        return {name for name in SLOTS if getattr(self, name) is not ENTRY}


def merged(states: Iterable[State]) -> State:
    """State behind several branches."""
    return reduce(State.merge, states)


def _same(first: _T | Why, second: _T | Why) -> _T | Why:
    if first is second or first == second:
        return first
    for one in (first, second):
        if isinstance(one, Why) and one is not ENTRY:
            return one
    return Why("branches before it set it differently")
