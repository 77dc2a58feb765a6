"""What a language offers to the rest of respot."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from scipy.spatial.transform import RigidTransform

from respot.issues import Issue
from respot.languages.forms import Forms
from respot.languages.profile import Profile
from respot.program.robot import ProgramFile, Robot
from respot.program.statement import Statement
from respot.program.targets import Target
from respot.source import Span


@dataclass(frozen=True)
class Language:
    """A robot language.

    Parameters
    ----------
    name : str
        Name in JSON and folder of its templates.
    title : str
        Name for people.
    suffixes : sequence of str
        Suffixes of its program files.
    encodings : sequence of str
        Its code pages.
    no_statement : frozenset of str
        Kinds that count as no statement.
    recognise : callable
        What a file with such a suffix holds: the language's name, ``binary`` or ``other``.
    read_statements : callable
        ``read_statements(text, line_starts)``.
    block_issues : callable
        ``block_issues(path, statements)``: what is opened and not closed.
    forms : Forms
        Its instruction forms.
    read_robots : callable
        ``read_robots(name, root, files, forms)`` reads the files of one controller: its robots, one for each task that
        moves one.
    pose_values : callable
        ``pose_values(targets, poses)``: fields of n targets for new poses in their bases, a batch of n.
    decimals : callable
        ``decimals(target)``: how many decimals each field of a target gets at least when it changes.
    frame_decimals : mapping of str to int
        Decimals that a changed field of a tool or base gets at least.
    has_configuration : callable
        Whether a target carries status and turn or confdata.
    header_place : callable
        Where the header of a changed file goes.
    configuration_fields : sequence of str
        Names of status and turn or confdata.
    """

    name: str
    title: str
    suffixes: Sequence[str]
    encodings: Sequence[str]
    no_statement: frozenset[str]
    recognise: Callable[[bytes], str]
    read_statements: Callable[[str, list[int]], list[Statement]]
    block_issues: Callable[[str, Sequence[Statement]], list[Issue]]
    forms: Forms
    read_robots: Callable[[str, str, Mapping[str, bytes], Forms], list[Robot]]
    pose_values: Callable[[Sequence[Target], RigidTransform], list[dict[str, float]]]
    decimals: Callable[[Target], dict[str, int]]
    frame_decimals: Mapping[str, int]
    has_configuration: Callable[[Target], bool]
    header_place: Callable[[ProgramFile], Span | None]
    configuration_fields: Sequence[str]

    def with_plant(self, profiles: Iterable[Profile]) -> Language:
        """Return the language with a plant's profiles of it before its own."""
        own = [profile for profile in profiles if profile.language == self.name]
        return replace(self, forms=self.forms.with_plant(own)) if own else self
