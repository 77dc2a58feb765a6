"""Where a key stands in a TOML file: what `tomllib` does not tell, and a person needs to find it."""

from __future__ import annotations

import re
from collections.abc import Iterator

_HEADER = re.compile(r"\s*(\[\[?)\s*([^\]]+?)\s*\]\]?\s*(?:#.*)?$")
_KEY = re.compile(r"""\s*(?:"([^"]*)"|'([^']*)'|([\w-]+))\s*[.=]""")


class Places:
    """Lines of headers and keys, as far as one key a line tells them; inline tables have none.

    Parameters
    ----------
    text : str
        The file.
    """

    def __init__(self, text: str) -> None:
        self._lines = dict(_walk(text))

    def line(self, section: str, number: int = 0, key: str | None = None) -> int | None:
        """Line of a key, else of its section's header; None where neither is seen.

        Parameters
        ----------
        section : str
            Name of the table; empty for the top of the file.
        number : int
            Which one of an array of tables, from 0.
        key : str, optional
            None asks for the header; ``_`` and ``-`` are one.
        """
        found = self._lines.get((section, number, key)) if key is not None else None
        return found or self._lines.get((section, number, None))


def _walk(text: str) -> Iterator[tuple[tuple[str, int, str | None], int]]:
    seen: dict[str, int] = {}
    section, number = "", 0
    for line, content in enumerate(text.splitlines(), start=1):
        header = _HEADER.match(content)
        if header is not None:
            section = header[2].strip("\"'")
            number = seen.get(section, -1) + 1 if header[1] == "[[" else 0
            seen[section] = number
            yield (section, number, None), line
        elif (key := _KEY.match(content)) is not None:
            yield (section, number, (key[1] or key[2] or key[3]).replace("-", "_")), line
