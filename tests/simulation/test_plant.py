"""A simulated line: the same seed gives the same bytes, makers and kinds are mixed, three go wrong, names tell nothing."""

from __future__ import annotations

import io
import json
import re
import tomllib
import zipfile

import pytest
from typer.testing import CliRunner

from respot.cli import app
from respot.simulation import EFFECTS, plant_files

ROBOTS = 24


@pytest.fixture(scope="module")
def files() -> dict[str, bytes]:
    return dict(plant_files(ROBOTS, 10, 0.1, 4))


@pytest.fixture(scope="module")
def entries(files) -> list[dict]:
    return tomllib.loads(files["line.toml"].decode())["robot"]


@pytest.fixture(scope="module")
def truth(files) -> dict:
    return json.loads(files["truth.json"])


def test_the_same_seed_gives_the_same_bytes_and_another_does_not(files):
    assert dict(plant_files(ROBOTS, 10, 0.1, 4)) == files
    assert dict(plant_files(ROBOTS, 10, 0.1, 5)).keys() != files.keys()


def test_every_robot_has_what_the_line_file_names(files, entries):
    assert len(entries) == ROBOTS
    for entry in entries:
        assert any(path == entry["source"] or path.startswith(f"{entry['source']}/") for path in files)
        assert entry.get("theory", entry.get("measured")) in files
    kinds = {("theory" in entry, entry["source"].endswith(".zip")) for entry in entries}
    assert len(kinds) == 4
    inside = [name for path, data in files.items() if path.endswith(".zip") for name in names_in(data)]
    assert any("KRC/" in path for path in [*files, *inside])
    assert any("RAPID/" in path for path in [*files, *inside])


def names_in(data: bytes) -> list[str]:
    try:
        return zipfile.ZipFile(io.BytesIO(data)).namelist()
    except zipfile.BadZipFile:
        return []


def test_two_backups_are_broken_and_one_reference_is_of_other_spots(files, entries, truth):
    trouble = {robot["trouble"]: robot["robot"] for robot in truth["robots"] if robot["trouble"]}
    assert set(trouble) == {"cut short", "no programs", "wrong reference"}
    assert not names_in(files[f"backups/{trouble['cut short']}.zip"])
    bare = [path for path in files if path.startswith(f"backups/{trouble['no programs']}/")]
    assert bare
    assert not any(re.search(r"\.(src|dat|mod|sys)$", path, re.IGNORECASE) for path in bare)


def test_names_and_the_line_file_tell_nothing_of_the_truth(files):
    shown = " ".join(path for path in files if path != "truth.json") + files["line.toml"].decode()
    words = {name for name in EFFECTS if "_" in name} | {"trouble", "broken", "wrong", "swapped", "truth", "cut short"}
    assert not [word for word in words if word in shown]


def test_one_effect_returns_on_all_measured_robots_with_one_gun(entries, truth):
    recurring = truth["recurring"]
    for entry, robot in zip(entries, truth["robots"], strict=True):
        has = recurring["effect"] in [effect["name"] for effect in robot["effects"]]
        assert has == ("measured" in entry and entry["gun"] == recurring["gun"])


def test_the_command_writes_a_line_and_says_how_to_do_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(app, ["simulate", "mine", "--line", "8", "--spots", "8"])
    assert done.exit_code == 0, done.stderr
    assert "respot migrate mine/line.toml -o mine_done" in done.stdout
    assert (tmp_path / "mine" / "line.toml").is_file()
    again = CliRunner().invoke(app, ["simulate", "mine", "--line", "8"])
    assert (again.exit_code, "OUTPUT_EXISTS" in again.stderr) == (2, True)
    mixed = CliRunner().invoke(app, ["simulate", "other", "--line", "8", "--effect", "drift"])
    assert (mixed.exit_code, "BAD_OPTION" in mixed.stderr) == (2, True)


def test_a_line_of_too_few_robots():
    with pytest.raises(ValueError, match="at least 8"):
        list(plant_files(7))
