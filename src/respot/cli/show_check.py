"""A check on the terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from respot.cli.display import Column, line, table

if TYPE_CHECKING:
    from respot.checking import CheckedFile

_MOST_FILES = 40


def show_files(files: Sequence[CheckedFile], totals: Mapping[str, float]) -> None:
    """Print the files that need a look, or all of a few, and the totals."""
    worth = [file for file in files if file.opaque or not file.roundtrip] if len(files) > _MOST_FILES else files
    columns = [Column("file", number=False), Column("language", number=False), Column("encoding", number=False)]
    columns += [Column("newline", number=False), Column("bytes"), Column("statements"), Column("opaque")]
    columns += [Column("round trip", number=False)]
    rows = [
        [
            *(file.path, file.language, file.encoding, file.newline),
            *(str(file.bytes), str(file.statements), str(file.opaque)),
            "yes" if file.roundtrip else "NO",
        ]
        for file in worth
    ]
    if rows:
        table(columns, rows, marked=[bool(file.opaque) or not file.roundtrip for file in worth])
    if len(worth) < len(files):
        line(f"{len(files) - len(worth)} more files without an opaque statement")
    share = totals["opaque"] / totals["statements"] if totals["statements"] else 0.0
    line(
        f"{totals['files']:.0f} files, {totals['bytes'] / 1e6:.2f} MB, {totals['statements']:.0f} statements, "
        f"{totals['opaque']:.0f} opaque ({share:.3%}), {totals['roundtrip_failures']:.0f} without round trip, "
        f"{totals['seconds']:.1f} s"
    )
