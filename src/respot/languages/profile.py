"""What a profile of instruction forms says of one dialect."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from respot.program.forms import Spelling
from respot.program.moves import LabelKind, Motion


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
