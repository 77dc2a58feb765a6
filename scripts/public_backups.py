"""Convert whole backups by a known transform and back, judged by readers that share nothing with respot.

    python scripts/public_backups.py FOLDER... [--partial] [--keep OUT]

FOLDER is a backup of a KUKA or ABB robot, or a folder of programs; nothing of it is written or kept here. Of its named
targets a theory list is made (``NAME;x;y;z``: moved by 30 mm, and turned by 2 degrees about a skew axis), `respot fit`
finds the transform from it, `respot convert --programs "*"` writes all programs by it, ``--inverse`` turns them back.
``--partial`` corrects what can be corrected of a program with a refused motion; without it such a program stays.

Printed for each robot: program files; named targets that the list holds; targets and offsets that moved as they should;
those that moved where the readers do not know the base; refused motions by code; literals that came back; what is
wrong. Nothing is wrong if every target moved to half its last digit, every other byte is what it was, and every number
came back within its last digit.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from respot.calibration.calibration import Calibration
from tests.convert import laws
from tests.convert.known_transform import transform_about

#: The whole name of a target is its ID here. Targets far from the middle go far, and no machine data are asked for.
NAMES = ["--spot-id", r"^\w+(?:[\[{][\d,]+[\]}])?$"]
WHOLE = ["--programs", "*", "--keep-config", "--max-shift", "100000,10"]
MOST_NAMES = 400


@dataclass
class Row:
    """What became of one robot."""

    name: str
    files: int = 0
    listed: int = 0
    found: laws.Findings = field(default_factory=laws.Findings)
    refused: Counter[str] = field(default_factory=Counter)
    back: laws.Findings = field(default_factory=laws.Findings)
    error: str = ""
    note: str = ""
    record: dict[str, list[dict[str, object]]] = field(default_factory=dict)


def respot(*arguments: object) -> tuple[int, dict[str, list[dict[str, object]]], str]:
    """Run respot; return its exit code, record and words."""
    command = [sys.executable, "-m", "respot", *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, encoding="utf-8", check=False)
    return done.returncode, json.loads(done.stdout) if done.stdout.startswith("{") else {}, done.stderr.strip()


def named_places(files: dict[str, bytes]) -> dict[str, np.ndarray]:
    """World position of each target whose name stands once, as the readers see it."""
    places: dict[str, list[np.ndarray]] = {}
    spans: dict[str, set[tuple[str, tuple[int, int]]]] = {}
    for use in laws.read(files).uses:
        literal = use.literal
        if literal.name and literal.complete and use.base is not None and np.isfinite(literal.pose).all():
            places.setdefault(literal.name.upper(), []).append((use.base @ literal.pose)[:3, 3])
            spans.setdefault(literal.name.upper(), set()).add((literal.path, literal.span))
    once = {
        name: found for name, found in places.items() if len(spans[name]) == 1 and np.ptp(found, axis=0).max() < 1e-6
    }
    return {name: found[0] for name, found in list(once.items())[:MOST_NAMES]}


def convert(backup: Path, robot: str, work: Path, partial: bool) -> Row:
    """Convert one robot there and back."""
    old = laws.files_of(backup)
    row = Row(f"{backup.name}/{robot}")
    places = named_places(old)
    row.listed = len(places)
    if len(places) < 4:
        row.error = "the readers know the base of fewer than four named targets"
        return row
    transform = transform_about(np.median(list(places.values()), axis=0))
    lines = ["id;x;y;z"]
    for name, place in places.items():
        x, y, z = (transform @ np.append(place, 1.0))[:3]
        lines.append(f"{name};{x:.6f};{y:.6f};{z:.6f}")
    (work / "theory.csv").write_text("\n".join(lines) + "\n")
    calibration = work / "cal.json"
    # a robot may be named after its folder
    out, back = work / "out" / backup.name, work / "back" / backup.name
    which = ["--robot-name", robot]
    fit = ("fit", backup, "--theory", work / "theory.csv", "--effects", "none", "-o", calibration, "--json")
    code, _, said = respot(*fit, *which, *NAMES)
    if code != 0:  # too few of them can be fitted: the transform itself is taken
        row.note = f"fit: {said.splitlines()[0] if said else code}"
        model = Calibration(transform[:3, :3], transform[:3, 3], "theory", "same", tuple(places))
        calibration.write_text(model.to_json())
    stored = json.loads(calibration.read_text())
    fitted = np.eye(4)
    fitted[:3, :3], fitted[:3, 3] = stored["rotation"], stored["translation"]
    if np.abs(fitted - transform)[:3, :3].max() > 1e-6:
        row.error = "fit: found another transform than the list was made with"
        return row
    options = [*which, *NAMES, *WHOLE, "--json", *(["--partial"] if partial else [])]
    code, row.record, said = respot("convert", backup, "-c", calibration, "-o", out, *options)
    if code not in (0, 1):
        row.error = f"convert: {said.splitlines()[0] if said else code}"
        return row
    own = {path.relative_to(out).as_posix() for path in out.rglob("*") if path.is_file()}
    old = {path: data for path, data in old.items() if path in own}
    row.files = sum(Path(path).suffix.lower() in laws.SUFFIXES for path in old)
    row.found = laws.judge(old, laws.files_of(out), fitted, row.record)
    row.refused = Counter(str(item["code"]) for item in row.record["refused"])
    turned = ("convert", out, "-c", calibration, "--inverse", "-o", back, *options)
    code, _, said = respot(*turned)
    if code not in (0, 1):
        row.back.wrong.append(f"back: {said.splitlines()[0] if said else code}")
    else:
        row.back = laws.judge_back(old, laws.files_of(back), row.record["edits"], configurations=False)
    return row


def rows(backup: Path, partial: bool, keep: Path | None) -> Iterator[Row]:
    """Convert every robot of a backup."""
    code, record, said = respot("inspect", backup, "--json")
    if code != 0:
        yield Row(backup.name, error=said.splitlines()[0] if said else str(code))
        return
    for robot in record["robots"]:
        with tempfile.TemporaryDirectory() as folder:
            work = Path(folder) if keep is None else keep / backup.name / str(robot["name"]).replace("/", "_")
            work.mkdir(parents=True, exist_ok=True)
            yield convert(backup, str(robot["name"]), work, partial)


def main() -> int:
    """Print the table; exit 1 if anything is wrong."""
    parser = argparse.ArgumentParser(description="Convert backups by a known transform and back.")
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--partial", action="store_true", help="correct what can be corrected of a refused program")
    parser.add_argument("--keep", type=Path, help="folder to keep what was written in, which must be empty")
    parser.add_argument("--show", type=int, default=3, help="how many of each kind of finding to print")
    arguments = parser.parse_args()
    print("| robot | files | listed | moved | offsets | base not seen | refused | restored | wrong |")
    print("|---|---|---|---|---|---|---|---|---|")
    wrong, told = 0, []
    for folder in arguments.folders:
        for row in rows(folder, arguments.partial, arguments.keep):
            bad = [*row.found.wrong, *row.back.wrong]
            wrong += bool(bad)
            refused = ", ".join(f"{count} {code}" for code, count in row.refused.most_common()) or "-"
            found = row.found
            cells = (row.name, row.files, row.listed, found.moved, found.offsets, len(found.unseen), refused)
            print("|", " | ".join(map(str, cells)), "|", row.back.restored, "|", row.error or len(bad), "|", flush=True)
            told += [f"{row.name}: {text}" for text in [row.note, *bad[: arguments.show]] if text]
            seen: Counter[str] = Counter()
            for item in row.record.get("refused", []):
                seen[str(item["code"])] += 1
                if seen[str(item["code"])] <= arguments.show:
                    told.append(
                        f"{row.name}: refused {item['program']}:{item['target']}: {item['code']} {item['message']}"
                    )
    print("\n" + "\n".join(told))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
