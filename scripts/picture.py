"""Draws docs/rear_door.svg: what `respot fit` shows on a terminal for the rear door."""

from __future__ import annotations

import io
import os
import pty
import re
import subprocess
import sys
from pathlib import Path

from rich.console import Console
from rich.text import Text

ROOT = Path(__file__).resolve().parents[1]
WIDTH = 132


def on_a_terminal(arguments: list[str]) -> str:
    """Return what a command prints on a terminal of `WIDTH` columns, with its colours."""
    reader, writer = pty.openpty()
    environment = {**os.environ, "COLUMNS": str(WIDTH), "LINES": "60", "TERM": "xterm-256color"}
    process = subprocess.Popen(
        arguments, stdout=writer, stderr=subprocess.DEVNULL, stdin=subprocess.DEVNULL, env=environment, cwd=ROOT
    )
    os.close(writer)
    parts = []
    while True:
        try:
            part = os.read(reader, 65536)
        except OSError:  # the other end is closed
            break
        if not part:
            break
        parts.append(part)
    process.wait()
    return b"".join(parts).decode().replace("\r\n", "\n").strip("\n")


def main() -> None:
    """Write the picture."""
    door = Path("samples/rear_door")
    command = f"respot fit {door / 'kuka'} --theory {door / 'theory.csv'}"
    shown = on_a_terminal([sys.executable, "-m", *command.split()])
    console = Console(record=True, width=WIDTH, file=io.StringIO(), force_terminal=True)
    console.print(Text(f"$ {command}\n", style="bold cyan"), Text.from_ansi(shown))
    target = ROOT / "docs" / "rear_door.svg"
    target.parent.mkdir(exist_ok=True)
    svg = console.export_svg(title="respot", unique_id="respot")
    # no font from the network: a reader's own monospace font will do
    svg = re.sub(r"@font-face \{.*?\}", "", svg, flags=re.DOTALL)
    target.write_text("\n".join(line.rstrip() for line in svg.splitlines()) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
