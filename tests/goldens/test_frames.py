"""Depth `frames`: the flange goes where the points alone would take it, as readers without respot see the stored files."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.convert.independent import NUMBER, from_abb, from_kuka

ROOT = Path(__file__).parent
TIP = (1.5, -2.25, 4.0)


def texts(folder: Path) -> str:
    return "\n".join(path.read_bytes().decode("latin-1") for path in sorted(folder.rglob("*")) if path.is_file())


def krl(folder: Path, name: str) -> np.ndarray:
    members = re.search(rf"{re.escape(name)}=\{{(.*?)\}}", texts(folder))[1].split(",")[:6]
    return from_kuka(*(float(member.split()[1]) for member in members))


def rapid(folder: Path, name: str) -> np.ndarray:
    """Pose of a target or tool, or of a work object the product of its frames."""
    found = [float(text) for text in re.findall(NUMBER, re.search(rf" {name}:=(\[.*\]);", texts(folder))[1])]
    return from_abb(*found[:7]) @ (from_abb(*found[7:14]) if name.startswith("w") else np.eye(4))


def transform(golden: str) -> np.ndarray:
    own = ROOT / golden / "calibration.json"
    model = json.loads((own if own.is_file() else ROOT / "calibration.json").read_text())
    made = np.eye(4)
    made[:3, :3], made[:3, 3] = model["rotation"], model["translation"]
    return made


def flange(read: Callable[[Path, str], np.ndarray], folder: Path, base: str, target: str, tool: str) -> np.ndarray:
    return read(folder, base) @ read(folder, target) @ np.linalg.inv(read(folder, tool))


BASES = [
    ("krl_frames", krl, "BASE_DATA[1]", "XS1", "TOOL_DATA[1]"),
    ("krl_frames", krl, "BASE_DATA[1]", "XS2", "TOOL_DATA[1]"),
    ("krl_frames", krl, "BASE_DATA[3]", "XS3", "TOOL_DATA[1]"),
    ("rapid_frames", rapid, "wDoor", "S1", "tGun"),
    ("rapid_frames", rapid, "wLid", "S2", "tGun"),
]
TOOLS = [
    ("krl_frames_tool", krl, "BASE_DATA[1]", "XS1", "TOOL_DATA[1]"),
    ("krl_frames_tool", krl, "BASE_DATA[1]", "XS2", "TOOL_DATA[1]"),
    ("rapid_frames_tool", rapid, "wDoor", "S1", "tGun"),
    ("rapid_frames_tool", rapid, "wDoor", "S2", "tGun"),
]


@pytest.mark.parametrize(("golden", "read", "base", "target", "tool"), BASES)
def test_a_base_takes_the_flange_to_the_image_of_where_it_went(golden, read, base, target, tool):
    old, new = (flange(read, ROOT / golden / side, base, target, tool) for side in ("in", "out"))
    assert new == pytest.approx(transform(golden) @ old, abs=1e-3)
    assert np.abs(new - old).max() > 5.0


@pytest.mark.parametrize(("golden", "read", "base", "target", "tool"), TOOLS)
def test_a_wrong_tool_brings_the_true_tip_to_where_the_target_says(golden, read, base, target, tool):
    """True tip = flange * told tool * d: with TOOL' = TOOL d the flange stands back by d."""
    error = np.eye(4)
    error[:3, 3] = TIP
    new = flange(read, ROOT / golden / "out", base, target, tool)
    there = new @ read(ROOT / golden / "in", tool) @ error
    assert there == pytest.approx(read(ROOT / golden / "in", base) @ read(ROOT / golden / "in", target), abs=1e-5)


@pytest.mark.parametrize("golden", sorted({case[0] for case in (*BASES, *TOOLS)}))
def test_nothing_but_the_numbers_of_the_edits_changed(golden):
    edits = json.loads((ROOT / golden / "record.json").read_text())["edits"]
    changed = set()
    for old in (path for path in (ROOT / golden / "in").rglob("*") if path.is_file()):
        path = old.relative_to(ROOT / golden / "in")
        before = old.read_bytes().decode("latin-1").split("\r\n")
        after = (ROOT / golden / "out" / path).read_bytes().decode("latin-1").split("\r\n")
        after = [line for line in after if "respot: " not in line]
        assert len(before) == len(after)
        for number, (one, other) in enumerate(zip(before, after, strict=True), 1):
            assert re.sub(NUMBER, "#", one) == re.sub(NUMBER, "#", other)
            if one != other:
                changed.add((path.as_posix(), number))
    assert changed == {(edit["path"], edit["line"]) for edit in edits}
