"""Count for how many motions of many backups target, base and tool are known, and why they are not for the rest.

Usage: ``python scripts/binding_coverage.py PATH... [--reasons 12]``. A PATH is a backup (folder or zip) or a folder of
such; give the folder of one controller or of one repository. Motions to joints and motions relative to the last
position need no base and are counted apart.
"""

from __future__ import annotations

import argparse
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from respot.backups import open_backup
from respot.issues import BadInputError
from respot.program.frames import Frame
from respot.program.moves import Move
from respot.program.robot import Robot
from respot.program.targets import TargetKind

#: What differs from motion to motion in a reason: names, numbers, places.
_NAMES = re.compile(r"'[^']*'|\b[\w$]*[\d$_][\w$]*(?:\[[^\]]*\]|\{[^}]*\})?|\b[A-Z]{2,}\b|[\w./$-]+:\d+")


@dataclass
class Count:
    """Motions of one language."""

    robots: int = 0
    motions: int = 0
    joints: int = 0
    relative: int = 0
    target: int = 0
    base: int = 0
    tool: int = 0
    all: int = 0
    external: int = 0
    welds: int = 0
    reasons: Counter[str] = field(default_factory=Counter)

    def add(self, robot: Robot) -> None:
        """Count the motions of a robot."""
        self.robots += 1
        for move in robot.moves():
            self.motions += 1
            self.welds += move.weld
            self.external += move.external_tcp
            if move.target is not None and move.target.kind is TargetKind.JOINTS:
                self.joints += 1
            elif move.target is None and not move.unknown:
                self.relative += 1
            else:
                self._judge(move)

    def _judge(self, move: Move) -> None:
        target = not move.unknown and move.target is not None and move.target.pose is not None
        base, tool = _known(move.base), _known(move.tool)
        self.target += target
        self.base += base
        self.tool += tool
        self.all += target and base and tool
        if not target:
            reason = move.unknown or (move.target.unknown if move.target is not None else "no target")
            self.reasons["target: " + _general(reason)] += 1
        for name, frame, known in (("base", move.base, base), ("tool", move.tool, tool)):
            if not known:
                why = "the program does not tell it" if frame is None else frame.unknown
                self.reasons[f"{name}: {_general(why)}"] += 1


def _known(frame: Frame | None) -> bool:
    return frame is not None and frame.pose is not None


def _general(reason: str) -> str:
    return _NAMES.sub("..", reason)[:110]


def backups(path: Path) -> Iterator[Path]:
    """Yield the backup itself, or every entry of a folder of repositories, whose names hold a ``+``."""
    inner = sorted(entry for entry in path.iterdir() if "+" in entry.name) if path.is_dir() else []
    yield from inner or [path]


def main() -> None:
    """Print the table and the reasons."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("paths", nargs="+", type=Path)
    parser.add_argument("--reasons", type=int, default=12)
    options = parser.parse_args()
    counts: dict[str, Count] = {}
    refused: Counter[str] = Counter()
    for path in (inner for given in options.paths for inner in backups(given)):
        try:
            read = open_backup(path)
        except BadInputError as error:
            refused[error.issue.code] += 1
            print(f"not read: {error}")
            continue
        for robot in read.robots:
            counts.setdefault(robot.language, Count()).add(robot)
    titles = ("robots", "motions", "joints", "relative", "judged", "target", "base", "tool", "all", "external", "welds")
    print("language  " + "".join(f"{title:>12}" for title in titles))
    for language, count in counts.items():
        judged = count.motions - count.joints - count.relative
        shares = [f"{share / max(judged, 1):.1%}" for share in (count.target, count.base, count.tool, count.all)]
        plain = [str(number) for number in (count.robots, count.motions, count.joints, count.relative, judged)]
        cells = [*plain, *shares, str(count.external), str(count.welds)]
        print(f"{language:10}" + "".join(f"{cell:>12}" for cell in cells))
    for language, count in counts.items():
        print(f"\n{language}: why not")
        for reason, number in count.reasons.most_common(options.reasons):
            print(f"{number:8}  {reason}")


if __name__ == "__main__":
    main()
