"""A plant's own templates, laid over ours: which files they may be, in a sandbox, with errors that say file and line.

A template of a plant is somebody else's text: it gets what it is to write, and reaches nothing else. What it may write
is not judged here: that is what the proof of the written files is for.
"""

from __future__ import annotations

import difflib
import traceback
from collections.abc import Mapping
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined, TemplateError, TemplateNotFound, TemplateSyntaxError
from jinja2.sandbox import ImmutableSandboxedEnvironment

from respot.issues import BadInputError
from respot.resources import resource
from respot.tolerance import spell

#: Languages with templates, and what starts a comment in each.
COMMENT_MARKS = {"krl": ";", "rapid": "!"}
#: What a template's text can make of the data that it gets.
_FOREIGN = (
    TemplateError, OSError, ValueError, TypeError, AttributeError, ArithmeticError, LookupError, RecursionError,
)  # fmt: skip
#: Other folders that a plant may keep beside them.
_OTHERS = ("pages",)


def environment(language: str, overlay: Path | None) -> Environment:
    """Make the environment of a language's templates; with a plant's templates it is a sandbox."""
    folders = [resource("templates", language)]
    if overlay is not None:
        folders.insert(0, overlay / language)
    # robot code is no HTML: escaping would change it
    made = (Environment if overlay is None else ImmutableSandboxedEnvironment)(
        loader=FileSystemLoader(folders),
        block_start_string="<%",
        block_end_string="%>",
        variable_start_string="<<",
        variable_end_string=">>",
        comment_start_string="<#",
        comment_end_string="#>",
        undefined=StrictUndefined,
        autoescape=False,
        keep_trailing_newline=False,
        auto_reload=overlay is not None,  # ours do not change while we run
    )
    made.filters["spell"] = spell
    return made


def check_overlay(overlay: Path) -> None:
    """Refuse a folder of templates that would override nothing, or something that respot does not know.

    Raises
    ------
    BadInputError
        ``BAD_OPTION`` if it is no folder; ``BAD_TEMPLATE`` for a folder or file of another name than respot's own, or
        a template that cannot be read as one.
    """
    if not overlay.is_dir():
        raise BadInputError("BAD_OPTION", "--templates is no folder", str(overlay))
    for path in sorted(overlay.iterdir()):
        if path.is_dir() and path.name not in (*COMMENT_MARKS, *_OTHERS) and not path.name.startswith("."):
            raise _unknown(path, tuple(COMMENT_MARKS), "folder of templates")
    languages = [language for language in COMMENT_MARKS if (overlay / language).is_dir()]
    if not languages:
        message = "holds no folder krl or rapid, so it overrides nothing: a template lies in krl or in rapid"
        raise BadInputError("BAD_TEMPLATE", message, str(overlay))
    for language in languages:
        known = sorted(path.name for path in resource("templates", language).iterdir())
        for path in sorted((overlay / language).iterdir()):
            if path.name.startswith("."):
                continue
            if path.name not in known or not path.is_file():
                raise _unknown(path, known, f"template of {language}")
            render(environment(language, overlay), path.name, overlay, None)


def overridden(overlay: Path, language: str) -> list[Path]:
    """Templates of a language that a plant lays over ours."""
    names = {path.name for path in resource("templates", language).iterdir()}
    return sorted(path for path in (overlay / language).glob("*") if path.name in names)


def render(made: Environment, name: str, overlay: Path | None, data: Mapping[str, object] | None) -> str:
    """Render a template; without data it is only read.

    Raises
    ------
    BadInputError
        ``BAD_TEMPLATE`` where a plant's template cannot be read or rendered, with its file and line. An error of
        respot's own templates is a fault of ours and raised as it is.
    """
    try:
        template = made.get_template(name)
        return "" if data is None else template.render(data)
    except _FOREIGN as error:
        place = None if overlay is None else _place(error, overlay, name)
        if place is None:
            raise
        reason = getattr(error, "message", None) or str(error) or type(error).__name__
        if isinstance(error, TemplateNotFound):
            reason = f"template {error.name} is not found"
        raise BadInputError("BAD_TEMPLATE", f"{reason}. Nothing was written", *place) from error


def _place(error: Exception, overlay: Path, name: str) -> tuple[str, int | None] | None:
    """File and line of a plant's template at which an error arose; None if it arose in none of them."""
    if isinstance(error, TemplateSyntaxError) and error.filename is not None:
        return (error.filename, error.lineno) if overlay in Path(error.filename).parents else None
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if overlay in Path(frame.filename).parents]
    if own:
        return own[-1].filename, own[-1].lineno
    found = [path for language in COMMENT_MARKS if (path := overlay / language / name).is_file()]
    return (str(found[0]), None) if found and isinstance(error, (OSError, UnicodeDecodeError)) else None


def _unknown(path: Path, known: list[str] | tuple[str, ...], what: str) -> BadInputError:
    close = difflib.get_close_matches(path.name.lower(), known, 1, 0.5)
    hint = f"did you mean {close[0]}?" if close else f"there is {', '.join(known)}"
    return BadInputError("BAD_TEMPLATE", f"is no {what}: {hint}", str(path))
