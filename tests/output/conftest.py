from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.correction.small import krl
from tests.output.runs import CLI, Runner, calibration, in_process, warmed, write

#: Files beside the programs, so that writing takes its time.
MORE = {
    f"KRC/R1/Program/more{number:02d}.src": f"DEF more{number:02d}( )\n;{'.' * 3000}\nEND\n" for number in range(25)
}


@pytest.fixture
def backup(tmp_path: Path) -> Path:
    return write(tmp_path / "backup", krl(more={Path(path).name: text for path, text in MORE.items()}))


@pytest.fixture
def cal(tmp_path: Path) -> Path:
    return calibration(tmp_path / "cal.json")


@pytest.fixture
def respot(tmp_path: Path, backup: Path, cal: Path) -> Iterator[Runner]:
    with warmed(tmp_path, "convert", backup, "-c", cal, "--dry-run") as runner:
        yield runner


@pytest.fixture
def cli(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> CLI:
    """Runs a command in this process."""
    monkeypatch.chdir(tmp_path)
    return in_process
