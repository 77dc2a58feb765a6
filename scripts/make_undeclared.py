"""Write ``samples/undeclared``: three simulated lines, each with something that only its ``truth.json`` says.

python scripts/make_undeclared.py            write the lines
python scripts/make_undeclared.py --check    make them in memory; exit 1 if any byte on disk differs
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from respot.simulation import files_of, simulate

ROOT = Path(__file__).resolve().parent.parent / "samples" / "undeclared"
#: Beside the truth files this is the only place that says what is hidden.
LINES: dict[str, dict[str, Any]] = {
    "line_a": {"robot": "kr210_r2700_extra", "spots": 120, "effects": ["joint_zero@3:1.6"], "seed": 71},
    "line_b": {
        "robot": "kr210_r2700_2",
        "spots": 140,
        "effects": ["group_shift@station:1", "tip_wear:0.9"],
        "seed": 72,
    },
    "line_c": {"robot": "kr210_r3100_ultra", "spots": 96, "effects": ["gravity_sag:1.3"], "seed": 73},
}


def files() -> dict[Path, bytes]:
    """All files of the three lines, by their paths."""
    made = {}
    for name, options in LINES.items():
        for path, content in files_of(simulate(noise=0.1, **options)).items():
            if path != "programmed.csv":  # the backup says the same
                made[ROOT / name / path] = content
    return made


def main() -> int:
    """Write, or compare."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="compare with what is on disk, write nothing")
    check = parser.parse_args().check
    made = files()
    there = {path for name in LINES for path in (ROOT / name).rglob("*") if path.is_file()}
    wrong = [path for path, content in made.items() if path not in there or path.read_bytes() != content]
    wrong += sorted(there - set(made))
    if check:
        for path in wrong:
            print(f"differs: {path}", file=sys.stderr)
        print(f"{len(made)} files, {len(wrong)} differ")
        return int(bool(wrong))
    for path in there - set(made):
        path.unlink()
    for path, content in made.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    print(f"{len(made)} files in {ROOT}, {len(wrong)} changed")
    return 0


if __name__ == "__main__":
    sys.exit(main())
