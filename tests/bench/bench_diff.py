"""What `respot diff` costs beside checking both sides with `respot check -j 1`, on made-up backups, in one run.

Usage: ``python tests/bench/bench_diff.py [--megabytes 20] [--repeat 3]``

The new backup is the old one after a day of work: every KRL file has another edit counter, one point in twenty is
touched up, a base is measured anew, speeds and names change, blocks of code move, one program is new. All are run as a
user runs them, in processes of their own, one after the other; the fastest of each counts, in seconds of processor time,
so that other work on the machine does not. The promise is 2.5.
"""

from __future__ import annotations

import argparse
import random
import re
import resource
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from bench_inspect import krl_backup, rapid_backup

_POINT = re.compile(rb"(?<=X )-?\d+\.\d+(?=,Y)|(?<=:=\[\[)-?\d+\.\d+(?=,)")


def edit(data: bytes, dice: random.Random) -> bytes:
    """Return a program file after a day of work."""

    def touched(match: re.Match[bytes]) -> bytes:
        return b"%.4f" % (float(match[0]) + dice.uniform(-2, 2)) if dice.random() < 0.05 else match[0]

    data = re.sub(rb"&REL \d+", b"&REL %d" % dice.randrange(400, 999), data)
    data = _POINT.sub(touched, data)
    lines = data.split(b"\r\n")
    for _ in range(max(1, len(lines) // 200)):
        at = dice.randrange(len(lines))
        choice = dice.randrange(4)
        if choice == 0:
            lines[at] = lines[at].replace(b"C_DIS", b"C_ORI").replace(b"v500", b"v400").replace(b"0.5", b"0.4")
        elif choice == 1 and b"WAIT" in lines[at].upper():
            lines.insert(at, lines[at])
        elif choice == 2:
            lines[at] = lines[at] + b"  "
        elif b"LIN " in lines[at] or b"MoveL" in lines[at]:
            lines.insert(dice.randrange(len(lines) // 2, len(lines) - 2), lines.pop(at))
    return b"\r\n".join(lines)


def change(folder: Path, seed: int = 11) -> None:
    """Edit every program of a backup."""
    dice = random.Random(seed)
    for path in sorted(folder.rglob("*")):
        if path.name == "$config.dat":
            path.write_bytes(path.read_bytes().replace(b"BASE_DATA[3]={X 3.0", b"BASE_DATA[3]={X 4.5"))
        elif path.is_file():
            path.write_bytes(edit(path.read_bytes(), dice))
    last = max(path for path in folder.rglob("*") if path.is_file() and path.name != "$config.dat")
    shutil.copy(last, last.with_name(f"new_{last.name}"))


def main() -> None:
    """Print the ratio for both languages."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--megabytes", type=float, default=20.0)
    parser.add_argument("--repeat", type=int, default=3)
    options = parser.parse_args()
    for name, make in (("KRL", krl_backup), ("RAPID", rapid_backup)):
        with tempfile.TemporaryDirectory() as folder:
            old, new = Path(folder, "old"), Path(folder, "new")
            old.mkdir()
            make(old, int(options.megabytes * 1e6))
            shutil.copytree(old, new)
            change(new)
            size = sum(file.stat().st_size for file in Path(folder).rglob("*") if file.is_file())
            best: dict[str, float] = {}
            for _ in range(options.repeat):
                for command in (("check", "-j", "1"), ("diff",), ("diff", "--json")):
                    taken = _run([*command[:1], str(old), str(new), *command[1:]])
                    key = " ".join(command)
                    best[key] = min(taken, best.get(key, taken))
            check = best.pop("check -j 1")
            ratios = ", ".join(f"{key} {taken / check:.2f}x" for key, taken in best.items())
            print(f"{name}: {size / 1e6:.1f} MB, check -j 1 = 1 ({size / 1e6 / check:.1f} MB/s): {ratios}", flush=True)


def _run(arguments: list[str]) -> float:
    start = _spent()
    done = subprocess.run(
        [sys.executable, "-m", "respot", *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, check=False
    )
    if done.returncode > 1:
        raise SystemExit(done.stderr.decode(errors="replace"))
    return _spent() - start


def _spent() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


if __name__ == "__main__":
    main()
