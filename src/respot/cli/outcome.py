"""One object owns what a command says and the code it exits with.

Exit codes: 0 done; 1 the answer is no, or ``--strict`` and an issue of level error; 2 bad usage or input, nothing
written; 3 internal error; 130 interrupted. Data go to stdout, words to stderr.
"""

from __future__ import annotations

import gc
import json
import sys
import tempfile
import traceback
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import typer

from respot import __version__
from respot.issues import BadInputError, Issue, Level, has_errors

DONE, NO, BAD_INPUT, INTERNAL, INTERRUPTED = 0, 1, 2, 3, 130
#: Issues of one code that are written in full; the rest are counted.
_MOST_OF_A_CODE = 10
#: JSON values below this level stand on one line, however long; others if they are short.
_DEEPEST = 4
_LONGEST_LINE = 160
#: New objects after which Python looks for garbage.
_GARBAGE = 1_000_000


@dataclass
class Outcome:
    """What a command found.

    Parameters
    ----------
    command : str
        Name of the command, for the schema.
    data : mapping
        The JSON record without schema, version and issues.
    show : callable
        Prints the result for people on stdout.
    issues : list of Issue
        What a person should know.
    answer_is_no : bool
        Exit code 1.
    """

    command: str
    data: Mapping[str, Any]
    show: Callable[[], None]
    issues: list[Issue] = field(default_factory=list)
    answer_is_no: bool = False

    def emit(self, as_json: bool, strict: bool) -> None:
        """Print, and exit with the right code."""
        if as_json:
            record = {
                "schema": f"respot.{self.command}/1",
                "version": __version__,
                "issues": [issue.as_json() for issue in self.issues],
                **self.data,
            }
            typer.echo(printable(json_text(record)))
        else:
            self.show()
            say(self.issues)
        if self.answer_is_no or (strict and has_errors(self.issues)):
            raise typer.Exit(NO)


def json_text(value: object, level: int = 0) -> str:
    """JSON for people and programs: the outer levels indented, each record of a list on a line of its own."""
    short = json.dumps(value, ensure_ascii=False, allow_nan=False) if level >= _DEEPEST or _is_plain(value) else None
    if short is not None and (level >= _DEEPEST or len(short) <= _LONGEST_LINE):
        return short
    pad = "  " * (level + 1)
    if isinstance(value, dict):
        rows = [
            f"{json.dumps(str(name), ensure_ascii=False)}: {json_text(item, level + 1)}" for name, item in value.items()
        ]
        brackets = "{}"
    elif isinstance(value, list | tuple):
        rows, brackets = [json_text(item, level + 1) for item in value], "[]"
    else:
        return json.dumps(value, ensure_ascii=False, allow_nan=False)
    inner = ",".join(f"\n{pad}{row}" for row in rows)
    return f"{brackets[0]}{inner}\n{'  ' * level}{brackets[1]}"


def _is_plain(value: object) -> bool:
    """Whether a value holds at most containers of plain values: what can be read on one line."""
    items = value.values() if isinstance(value, dict) else value if isinstance(value, list | tuple) else ()
    return all(not isinstance(item, dict | list | tuple) or _is_flat(item) for item in items)


def _is_flat(value: dict[str, object] | list[object] | tuple[object, ...]) -> bool:
    items = value.values() if isinstance(value, dict) else value
    return len(value) <= _LONGEST_LINE and not any(isinstance(item, dict | list | tuple) for item in items)


#: What a terminal takes for an order, or for a change of the direction of writing; a program's text may hold any.
_ORDERS = (*range(9), *range(11, 32), *range(127, 160), *range(0x202A, 0x202F), *range(0x2066, 0x206A))
_SPELLED = {order: f"\\u{order:04x}" for order in _ORDERS}


def printable(text: str) -> str:
    r"""Text that any terminal takes, and takes for nothing but text.

    Control characters, and bytes of a file name that are no UTF-8, are spelled as in JSON: ``\u001b``, ``\udcfc``.
    """
    return text.translate(_SPELLED).encode("utf-8", "backslashreplace").decode()


def say(issues: Iterable[Issue]) -> None:
    """Write issues to stderr, the serious ones first; many of one code are cut short."""
    order = [Level.ERROR, Level.WARNING, Level.INFO]
    by_code: dict[str, list[Issue]] = {}
    for issue in sorted(issues, key=lambda issue: order.index(issue.level)):
        by_code.setdefault(issue.code, []).append(issue)
    for same in by_code.values():
        for issue in same[:_MOST_OF_A_CODE]:
            colour = {Level.ERROR: typer.colors.RED, Level.WARNING: typer.colors.YELLOW, Level.INFO: None}[issue.level]
            typer.secho(printable(f"{issue.level}: {issue}"), err=True, fg=colour)
        if len(same) > _MOST_OF_A_CODE:
            typer.echo(f"... and {len(same) - _MOST_OF_A_CODE} more {same[0].code}", err=True)


def run(make: Callable[[], Outcome], as_json: bool = False, strict: bool = False) -> None:
    """Run a command's work and turn every way it can end into words and an exit code."""
    gc.set_threshold(_GARBAGE)  # what is read is no garbage: looking for it again and again takes half the time
    try:
        make().emit(as_json, strict)
        sys.stdout.flush()
    except typer.Exit:
        raise
    except BrokenPipeError:  # the reader, such as `head`, has seen enough
        sys.stdout = None
    except BadInputError as error:
        typer.secho(printable(f"error: {error.issue}"), err=True, fg=typer.colors.RED)
        raise typer.Exit(BAD_INPUT) from None
    except KeyboardInterrupt:
        typer.echo("interrupted: nothing was left half-written", err=True)
        raise typer.Exit(INTERRUPTED) from None
    except Exception as error:
        message = printable(f"internal error: {error}\nThe details are in {_log()}; please report it.")
        typer.secho(message, err=True, fg=typer.colors.RED)
        raise typer.Exit(INTERNAL) from None


def _log() -> str:
    with tempfile.NamedTemporaryFile("w", prefix="respot-", suffix=".log", delete=False, encoding="utf-8") as file:
        file.write(f"respot {__version__}, Python {sys.version}\n{' '.join(sys.argv)}\n\n{traceback.format_exc()}")
    return file.name
