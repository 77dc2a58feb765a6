"""Folds of a routine while it is followed, and the texts about a motion in which a spot's ID may stand.

A motion belongs to the innermost fold with a title; a fold without one (``;FOLD ;%{h}``, VKRC's ``;FOLD {H}``) belongs
to the fold around it (facts: krl.md section 6).
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from respot.languages.krl.syntax import COMMENT, END_FOLD, FOLD
from respot.program.moves import Label, LabelKind
from respot.program.statement import Statement

_MARK = re.compile(r";\s*FOLD\b\s*", re.IGNORECASE)
_TAIL = re.compile(r"\s*;\s*%.*|\s*%?\{[A-Za-z]+\}.*", re.DOTALL)
_PARAMS = re.compile(r";\s*Params\b", re.IGNORECASE)
#: Title of the fold that carries parameters and no motion.
_CARRIER = "PARAMETERS"


@dataclass
class Fold:
    """An open fold.

    Parameters
    ----------
    title : str
        Text of its opening line up to the ``%`` tail.
    comments : list of str
        Comments right above it.
    params : list of str
        Its ``;Params`` lines.
    assigned : dict of str to str
        Names that its statements assigned, with what they got.
    motions : int
        Motions in it and in folds within it so far.
    """

    title: str = ""
    comments: list[str] = field(default_factory=list)
    params: list[str] = field(default_factory=list)
    assigned: dict[str, str] = field(default_factory=dict)
    motions: int = 0


def title_of(source: str) -> str:
    """Title in the opening line of a fold, without its tail; empty if it has none."""
    return _TAIL.sub("", _MARK.sub("", source, count=1)).strip(" ;\t")


class Folds:
    """The folds around a statement, as a routine is followed from its top."""

    def __init__(self) -> None:
        self._root = Fold()
        self._open: list[Fold] = []
        self._comments: list[str] = []
        self._line = 0  # the last line of the comments right above

    @property
    def form(self) -> Fold:
        """The innermost fold with a title, or the routine itself."""
        return next((fold for fold in reversed(self._open) if fold.title), self._root)

    def step(self, statement: Statement) -> None:
        """Follow one statement."""
        kind = statement.kind
        if kind == COMMENT:
            source = statement.source
            if _PARAMS.match(source):
                self.form.params.append(source.lstrip("; \t"))
                return
            if statement.line != self._line + 1:
                self._comments = []
            self._comments.append(source.lstrip("; \t"))
            self._line = statement.line
        elif kind == FOLD:
            above = self._above(statement.line)
            title = title_of(statement.source)
            self._open.append(Fold("" if title.upper() == _CARRIER else title, above))
            self._comments = []
        elif kind == END_FOLD:
            if self._open:
                self._open.pop()
            self._comments = []

    def _above(self, line: int) -> list[str]:
        """Comments that end right above a line."""
        return self._comments if self._comments and self._line == line - 1 else []

    def assign(self, name: str, value: str) -> None:
        """Keep what a name got."""
        self.form.assigned[name] = value

    def labels(self, statement: Statement) -> list[Label]:
        """Title, parameters and comments of a motion."""
        form = self.form
        found = [Label(LabelKind.TITLE, form.title)] if form.title else []
        found += [Label(LabelKind.PARAMS, text) for text in form.params]
        comments = list(self._above(statement.line))
        if form.motions == 0:
            comments += form.comments
        if ";" in statement.source:
            comments.append(_trailing(statement))
        found += [Label(LabelKind.COMMENT, text) for text in comments if text]
        for fold in (self._root, *self._open):
            fold.motions += 1
        self._comments = []
        return found


def _trailing(statement: Statement) -> str:
    tokens = statement.tokens()
    behind = statement.text[tokens[-1][1] : statement.end] if tokens else ""
    return behind.strip().lstrip("; \t")
