"""Write what `respot convert` makes of the small backups in ``tests/goldens``.

Each folder there holds one trap: ``in``, a backup written by hand whose program says in a comment what the trap is;
``out``, the converted backup; ``record.json``, what moved, what stayed and why. All are converted by
``calibration.json`` beside them (30 mm, and 2 degrees about a skew axis), or by one of their own; a file ``options``
holds further options, one a line. A golden changes only with a reason in the commit, and its numbers are not believed
because respot made them: ``tests/goldens`` recomputes them without respot.

    python scripts/make_goldens.py            write ``out`` and ``record.json`` of all
    python scripts/make_goldens.py --check    convert again beside them; exit 1 if any byte differs
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent / "tests" / "goldens"
#: No machine data stand in these backups: configurations are kept.
DEFAULT_OPTIONS = ["--keep-config"]
RECORD = "record.json"


def command(golden: Path, output: Path) -> list[str]:
    """Return the options of ``respot`` that convert a golden."""
    own, options = golden / "calibration.json", golden / "options"
    calibration = own if own.is_file() else golden.parent / "calibration.json"
    more = options.read_text(encoding="utf-8").split() if options.is_file() else DEFAULT_OPTIONS
    return ["convert", str(golden / "in"), "-c", str(calibration), "-o", str(output), "--json", *more]


def kept_record(record: dict[str, list[dict[str, object]]]) -> str:
    """What is kept of the record of a conversion, as text."""
    fields = {
        "edits": ("path", "line", "target", "depth"),
        "unmoved": ("target", "code"),
        "transitions": ("from", "to", "program"),
        "refused": ("program", "target", "code"),
    }
    lines = []
    for name, keys in fields.items():
        items = ",\n    ".join(json.dumps({key: item[key] for key in keys}) for item in record[name])
        lines.append(f'  "{name}": [{chr(10) + "    " if items else ""}{items}{chr(10) + "  " if items else ""}]')
    return "{\n" + ",\n".join(lines) + "\n}\n"


def files_of(folder: Path) -> dict[str, bytes]:
    """Files of a converted backup by path, without respot's own record."""
    found = (path for path in folder.rglob("*") if path.is_file() and path.name != "respot.json")
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in found}


def converted(golden: Path) -> dict[str, bytes]:
    """Convert a golden; return its files below ``out/`` and its record, as they should stand beside ``in``."""
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder) / "out"
        run = [sys.executable, "-m", "respot", *command(golden, output)]
        done = subprocess.run(run, capture_output=True, text=True, encoding="utf-8", check=False)
        if done.returncode not in (0, 1):
            raise RuntimeError(f"{golden.name}: {done.stderr}")
        files = {f"out/{path}": data for path, data in files_of(output).items()}
    return {**files, RECORD: kept_record(json.loads(done.stdout)).encode()}


def stored(golden: Path) -> dict[str, bytes]:
    """What stands beside ``in``."""
    files = {f"out/{path}": data for path, data in files_of(golden / "out").items()}
    record = golden / RECORD
    return {**files, RECORD: record.read_bytes()} if record.is_file() else files


def main() -> int:
    """Write or check all goldens."""
    parser = argparse.ArgumentParser(description="Write or check the goldens of respot convert.")
    parser.add_argument("--check", action="store_true", help="compare only; exit 1 if a byte differs")
    arguments = parser.parse_args()
    wrong = 0
    for golden in sorted(path.parent for path in ROOT.glob("*/in")):
        made, before = converted(golden), stored(golden)
        differing = sorted(path for path in {*made, *before} if made.get(path) != before.get(path))
        wrong += bool(differing)
        for path in differing:
            print(f"{golden.name}/{path}: {'differs' if arguments.check else 'written'}")
        if differing and not arguments.check:
            shutil.rmtree(golden / "out", ignore_errors=True)
            for path, data in made.items():
                place = golden / path
                place.parent.mkdir(parents=True, exist_ok=True)
                place.write_bytes(data)
    return 1 if wrong and arguments.check else 0


if __name__ == "__main__":
    sys.exit(main())
