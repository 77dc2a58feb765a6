"""One pair of backups for each trap, named after it, with what is to be seen.

``expected.json`` is written by a person who looked at both sides. ``python -m tests.difference.test_traps`` writes those
that are missing, for a person to look at.
"""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from respot.difference import compare
from respot.difference.record import as_record

TRAPS = Path(__file__).parent / "traps"
ALL = sorted(path.parent for path in TRAPS.glob("*/*/old"))


def digest(folder: Path) -> dict:
    """What is seen, without places and digits that say nothing."""
    comparison = compare(folder / "old", folder / "new")
    record = as_record(comparison)
    robot = record["robots"][0]
    found = {
        "same": comparison.same,
        "moved": [_moved(item) for item in robot["moved"]],
        "frames": [_frame(item) for item in robot["frames"]],
        "added": [item["target"] for item in robot["added"]],
        "removed": [item["target"] for item in robot["removed"]],
        "renamed": [f"{item['old_name']} -> {item['new_name']}" for item in robot["renamed"]],
        "code": [
            {"kind": item["kind"], "aspects": item["aspects"], "-": item["old_lines"], "+": item["new_lines"]}
            for item in robot["code"]
        ],
        "files": [f"{item['change']} {item['kind']} {item['path']}" for item in (*robot["files"], *record["files"])],
        "noise": robot["noise_counts"] | {item["kind"]: 1 for item in record["noise"]},
    }
    return {name: value for name, value in found.items() if value or name == "same"}


def _moved(item: dict) -> dict:
    found: dict = {"target": item["target"], "kind": item["kind"]}
    if item["shift"] is not None:
        found["shift"] = [round(item["shift"][axis], 3) + 0.0 for axis in ("dx", "dy", "dz")]
    if item["world"] is not None:
        found["world"] = [round(item["world"][axis], 3) + 0.0 for axis in ("dx", "dy", "dz")]
    if item["turn_deg"]:
        found["turn"] = round(item["turn_deg"], 3)
    changes = {**item["configuration"], **item["axes"]}
    if changes:
        found["changes"] = changes
    if item["base"] != item["old_base"]:
        found["base"] = [item["old_base"], item["base"]]
    return found


def _frame(item: dict) -> dict:
    found = {"frame": f"{item['kind']} {item['name']} {item['change']}", "moves": item["moves"]}
    if item["shift"] is not None:
        found["shift"] = [round(item["shift"][axis], 3) + 0.0 for axis in ("dx", "dy", "dz")]
    if item["fields"]:
        found["fields"] = item["fields"]
    return found


@pytest.mark.parametrize("folder", ALL, ids=lambda folder: f"{folder.parent.name}-{folder.name}")
def test_trap(folder):
    assert digest(folder) == json.loads((folder / "expected.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("folder", ALL, ids=lambda folder: f"{folder.parent.name}-{folder.name}")
def test_nothing_differs_from_itself(folder):
    record = as_record(compare(folder / "new", folder / "new"))
    assert record["same"]
    assert not any(robot["noise"] for robot in record["robots"])


if __name__ == "__main__":
    for trap in ALL:
        place = trap / "expected.json"
        if not place.exists():
            place.write_text(json.dumps(digest(trap), indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
