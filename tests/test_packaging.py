"""Wheel, source archive, editable install and checkout find grammars, templates and samples by one helper."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tarfile
import venv
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FIND = """
import sys
from respot.resources import resource
for parts in (("grammars", "krl.lark"), ("grammars", "rapid.lark"), ("templates", "krl", "literal.j2"),
              ("templates", "rapid", "header.j2"), ("samples", "rear_door", "theory.csv")):
    path = resource(*parts)
    assert path.is_file() and path.is_relative_to(sys.argv[1]), path
import respot.languages.krl.forms, respot.kinematics.robots
respot.kinematics.robots.find_robot("kr210_r2700_extra")
print("found")
"""


def find_in(folder: Path, python: str = sys.executable, path: Path | None = None, cwd: Path | None = None) -> None:
    environment = {key: value for key, value in os.environ.items() if key not in {"PYTHONPATH"}}
    if path is not None:
        environment["PYTHONPATH"] = str(path)
    arguments = [python, "-c", FIND, str(folder)]
    done = subprocess.run(arguments, env=environment, cwd=cwd or folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == "found"


@pytest.fixture(scope="module")
def clean_checkout(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("checkout") / "respot"
    ignored = shutil.ignore_patterns(".git", ".venv*", "__pycache__", ".*_cache", ".hypothesis", "*.egg-info", "dist")
    shutil.copytree(ROOT, folder, ignore=ignored)
    return folder


@pytest.fixture(scope="module")
def built(clean_checkout) -> Path:
    for target in ("wheel", "sdist"):
        done = subprocess.run(
            [sys.executable, "-m", "hatchling", "build", "-t", target],
            cwd=clean_checkout,
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0, done.stderr
    return clean_checkout / "dist"


def test_a_wheel_finds_its_resources(built, tmp_path):
    (wheel,) = built.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(tmp_path)
    assert not (tmp_path / "tests").exists()
    find_in(tmp_path, path=tmp_path)


def test_a_source_archive_finds_its_resources(built, tmp_path):
    (sdist,) = built.glob("*.tar.gz")
    with tarfile.open(sdist) as archive:
        archive.extractall(tmp_path, filter="data")
    (folder,) = tmp_path.iterdir()
    find_in(folder, path=folder / "src")


def test_a_checkout_finds_its_resources(clean_checkout):
    find_in(clean_checkout, path=clean_checkout / "src")


def test_an_editable_install_finds_its_resources(clean_checkout, tmp_path):
    venv.create(tmp_path / "env", system_site_packages=False, with_pip=False, symlinks=True)
    python = tmp_path / "env" / "bin" / "python"
    site = next((tmp_path / "env").glob("lib/python*/site-packages"))
    # the new environment borrows what this one has installed, but not this one's respot
    borrowed = [path for path in sys.path if path.endswith("site-packages")]
    (site / "borrowed.pth").write_text("\n".join(borrowed))
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "pip",
            "--python",
            str(python),
            "install",
            "-q",
            "--no-deps",
            "--no-build-isolation",
            "-e",
            ".",
        ],
        cwd=clean_checkout,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    find_in(clean_checkout, python=str(python), cwd=tmp_path)
