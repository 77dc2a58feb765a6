"""A robot that takes all time or all memory, or whose process is killed, fails by its own reason; the others are done."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="limits of address space hold on Linux")
SAMPLES = Path(__file__).parents[2] / "samples" / "rear_door"


def migrate(folder: Path, *more: str) -> dict:
    command = [sys.executable, "-m", "respot", "migrate", "line.toml", "-o", "out", "--json", *more]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert done.returncode == 1, done.stderr
    assert sum(json.loads(text)["event"] == "robot" for text in done.stderr.splitlines()) == 2
    return {robot["name"]: robot for robot in json.loads(done.stdout)["robots"]}


@pytest.fixture
def poisoned(tmp_path) -> Path:
    for name in ("good", "bad"):
        shutil.copytree(SAMPLES / "kuka", tmp_path / name)
    shutil.copy(SAMPLES / "theory.csv", tmp_path)
    text = '[line]\nname = "x"\ntheory = "theory.csv"\n'
    text += "".join(f'[[robot]]\nname = "{name}"\nsource = "{name}"\n' for name in ("bad", "good"))
    (tmp_path / "line.toml").write_text(text)
    return tmp_path


def test_a_pattern_that_never_ends(poisoned):
    line = poisoned / "line.toml"
    line.write_text(line.read_text().replace('source = "bad"', "source = \"bad\"\nspot_id = '(.*.*)*=$'"))
    robots = migrate(poisoned, "-j", "2", "--timeout", "8")
    assert robots["bad"]["error"]["code"] == "TIMED_OUT"
    assert "--timeout" in robots["bad"]["error"]["message"]
    assert robots["good"]["state"] == "done"
    assert [path.name for path in (poisoned / "out" / "robots").iterdir()] == ["good"]


def test_a_backup_that_takes_all_memory(poisoned):
    """A log of a controller that was never emptied: nothing but its size is wrong with it."""
    with (poisoned / "bad" / "huge.log").open("wb") as log:
        log.truncate(900 * 1024**2)
    robots = migrate(poisoned, "-j", "2", "--memory", "1200")
    assert robots["bad"]["error"]["code"] == "OUT_OF_MEMORY"
    assert "--memory" in robots["bad"]["error"]["message"]
    assert robots["good"]["state"] == "done"
