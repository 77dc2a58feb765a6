"""What readers of all languages share."""

from __future__ import annotations

from respot.issues import Issue
from respot.program.robot import ProgramFile
from respot.program.statement import OPAQUE

_LONGEST_EXCERPT = 200


def opaque_issues(file: ProgramFile) -> list[Issue]:
    """Report the statements of a file that no rule knows."""
    source = file.source
    return [
        Issue(
            "OPAQUE_STATEMENT",
            f"kept as it is: {statement.shape.reason}",
            source.path,
            statement.line,
            source.place(statement.start)[1],
            source.line_text(statement.line)[:_LONGEST_EXCERPT],
        )
        for statement in file.statements
        if statement.kind == OPAQUE
    ]
