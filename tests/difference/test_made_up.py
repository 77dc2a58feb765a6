"""For random edits of random programs the comparison lists exactly these edits."""

from __future__ import annotations

import random
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from respot.difference import compare
from respot.difference.record import as_record
from tests.difference import made_up_krl, made_up_rapid


def write(folder: Path, files: dict[str, bytes]) -> Path:
    for name, data in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    return folder


def lines(changes: list[dict], side: str, moved: bool = False) -> Counter[str]:
    """Lines that went or came, or that stand elsewhere; RAPID's comma before an option says nothing."""
    found = (line for change in changes if (change["kind"] == "moved") == moved for line in change[side])
    return Counter(line.replace(",\\WObj", "\\WObj") for line in found)


#: What all inline forms have in common, and a wait beside a point that went while another came: which of two forms such
#: a statement belongs to, nobody can tell (seed 901, 7 edits).
COMMON = ("$BWDSTART", "BAS(", "WAIT SEC")


def telling(found: Counter[str]) -> Counter[str]:
    return Counter({line: count for line, count in found.items() if not line.startswith(COMMON)})


@pytest.mark.parametrize("language", [made_up_krl, made_up_rapid], ids=["krl", "rapid"])
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(seed=st.integers(0, 2**32), count=st.integers(0, 9))
def test_exactly_the_edits_are_listed(language, seed, count, tmp_path_factory):
    dice = random.Random(seed)
    old = language.make(dice)
    edits = language.Edits(old, dice)
    edits.run(count)
    folder = tmp_path_factory.mktemp("backup")
    paths = write(folder / "old", old.files()), write(folder / "new", edits.new.files())
    comparison = compare(*paths)
    (robot,) = as_record(comparison)["robots"]
    wanted = edits.expected

    assert {(item["program"].upper(), item["target"]) for item in robot["moved"]} == set(wanted.moved)
    for item in robot["moved"]:
        own, world = wanted.moved[item["program"].upper(), item["target"]]
        assert np.allclose([item["shift"][axis] for axis in ("dx", "dy", "dz")], own, atol=1e-6)
        assert np.allclose([item["world"][axis] for axis in ("dx", "dy", "dz")], world, atol=1e-6)
        assert item["shift"]["distance"] == pytest.approx(np.linalg.norm(own), abs=1e-6)
    assert {item["name"] for item in robot["frames"]} == wanted.frames
    assert {item["target"] for item in robot["added"]} == wanted.added
    assert {item["target"] for item in robot["removed"]} == wanted.removed
    assert {(item["old_name"], item["new_name"]) for item in robot["renamed"]} == wanted.renamed
    gone, come = lines(robot["code"], "old_lines"), lines(robot["code"], "new_lines")
    assert gone - come == Counter(wanted.gone) - Counter(wanted.come)
    assert come - gone == Counter(wanted.come) - Counter(wanted.gone)
    assert not telling(gone - Counter(wanted.gone)) and not telling(come - Counter(wanted.come))
    assert telling(lines(robot["code"], "new_lines", moved=True)) == telling(Counter(wanted.blocks))
    assert wanted.noise <= set(robot["noise_counts"])
    assert not robot["files"]
    found = (wanted.moved, wanted.frames, wanted.added, wanted.removed, wanted.renamed, wanted.gone, wanted.come)
    assert comparison.same == (not any(found) and not wanted.blocks)
    if not count:
        assert not robot["noise"]
