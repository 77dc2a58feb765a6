from __future__ import annotations

import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.correction.small import krl
from tests.output.runs import CLI, Runner, calibration, in_process, warmed, write

#: Files beside the programs, so that writing takes its time.
MORE = {
    f"KRC/R1/Program/more{number:02d}.src": f"DEF more{number:02d}( )\n;{'.' * 3000}\nEND\n" for number in range(25)
}


def _backup(folder: Path) -> Path:
    return write(folder / "backup", krl(more={Path(path).name: text for path, text in MORE.items()}))


@pytest.fixture
def backup(tmp_path: Path) -> Path:
    return _backup(tmp_path)


@pytest.fixture
def cal(tmp_path: Path) -> Path:
    return calibration(tmp_path / "cal.json")


@pytest.fixture(scope="module")
def driver(tmp_path_factory: pytest.TempPathFactory) -> Iterator[subprocess.Popen]:
    folder = tmp_path_factory.mktemp("warm")
    with warmed("convert", _backup(folder), "-c", calibration(folder / "cal.json"), "--dry-run") as process:
        yield process


@pytest.fixture
def respot(driver: subprocess.Popen, tmp_path: Path) -> Runner:
    """Runs a command in a child of a warmed process."""
    return Runner(driver, tmp_path)


@pytest.fixture
def cli(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> CLI:
    """Runs a command in this process."""
    monkeypatch.chdir(tmp_path)
    return in_process
