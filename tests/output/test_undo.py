"""``respot undo``: the last conversion goes, and nothing that a person did."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from tests.correction.small import krl
from tests.output.runs import CLI, SAMPLES, calibration, state, write

THEORY = SAMPLES / "theory.csv"
DAT = "KRC/R1/Program/weld.dat"


@pytest.fixture
def respot(cli: CLI) -> CLI:
    return cli


@pytest.fixture
def backup(tmp_path: Path) -> Path:
    return write(tmp_path / "backup", krl(more={"other.src": "DEF other( )\nEND\n"}))


@pytest.fixture
def cal(tmp_path: Path) -> Path:
    return calibration(tmp_path / "cal.json")


@pytest.mark.parametrize("robot", ["kuka", "abb"])
@pytest.mark.parametrize("named", ["folder", "record"])
def test_undo_restores_bytes_times_and_rights(respot, tmp_path, robot, named):
    backup = tmp_path / "backup"
    shutil.copytree(SAMPLES / robot, backup)
    before = state(backup)
    assert respot("convert", backup, "--theory", THEORY, "--in-place").code == 0
    assert state(backup) != before
    result = respot("undo", backup if named == "folder" else backup / "respot.json", "--json")
    assert result.code == 0, result.err
    assert state(backup) == before
    assert (result.json["schema"], result.json["kind"], result.json["left"]) == ("respot.undo/1", "in_place", 0)
    assert result.json["removed"] == ["respot.json"]
    assert set(result.json["restored"]) < set(before)
    assert [path.name for path in tmp_path.iterdir()] == ["backup"]
    again = respot("undo", backup)
    assert (again.code, "NOTHING_TO_UNDO" in again.err) == (2, True)
    assert state(backup) == before


def test_several_conversions_go_one_at_a_time_the_last_one_first(respot, tmp_path, backup):
    states, records = [state(backup)], []
    for number in range(3):
        cal = calibration(tmp_path / f"{number}.json", float(number))
        assert respot("convert", backup, "-c", cal, "--in-place").code == 0
        records.append(json.loads((backup / "respot.json").read_text()))
        states.append(state(backup))
    assert [len(record["applied"]) for record in records] == [1, 2, 3]
    assert sorted(path.name for path in (backup / ".respot").iterdir()) == ["0001", "0002", "0003"]
    for number in (2, 1, 0):
        result = respot("undo", backup, "--json")
        assert (result.code, result.json["left"]) == (0, number)
        assert result.json["calibration"] == records[number]["applied"][-1]
        assert state(backup) == states[number]
    assert respot("undo", backup).code == 2


def test_a_file_that_was_changed_since_stops_undo(respot, backup, cal):
    assert respot("convert", backup, "-c", cal, "--in-place").code == 0
    (backup / DAT).write_bytes((backup / DAT).read_bytes().replace(b"END", b"; taught\r\nEND"))
    before = state(backup)
    result = respot("undo", backup)
    assert (result.code, "CHANGED_SINCE" in result.err, DAT in result.err) == (2, True, True)
    assert "--force" in result.err and state(backup) == before


def test_force_restores_and_keeps_what_was_changed(respot, backup, cal):
    before = state(backup)
    for number in range(1, 3):
        assert respot("convert", backup, "-c", cal, "--in-place").code == 0
        mine = (backup / DAT).read_bytes() + b"; mine %d\r\n" % number
        (backup / DAT).write_bytes(mine)
        (backup / "respot.json").unlink()
        result = respot("undo", backup, "--force", "--json")
        assert result.code == 0, result.err
        (aside,) = result.json["set_aside"]
        assert (backup / aside).read_bytes() == mine
        assert [issue["code"] for issue in result.json["issues"]] == ["SET_ASIDE"]
        now = state(backup)
        assert {name: now[name] for name in now if not name.startswith(".respot")} == before
        assert respot("check", backup, "--json").json["totals"]["files"] == 4
    assert len(list((backup / ".respot").rglob("*.changed*"))) == 2


def test_a_file_that_was_removed_since_stops_undo_and_comes_back_by_force(respot, backup, cal):
    before = state(backup)
    assert respot("convert", backup, "-c", cal, "--in-place").code == 0
    (backup / DAT).unlink()
    result = respot("undo", backup)
    assert (result.code, "(or removed)" in result.err) == (2, True)
    assert respot("undo", backup, "--force").code == 0
    after = state(backup)
    assert after.keys() == before.keys() and after[DAT] == before[DAT]


def test_what_a_person_did_beside_the_conversion_stays(respot, backup, cal):
    assert respot("convert", backup, "-c", cal, "--in-place").code == 0
    (backup / "KRC/R1/Program/other.src").write_text("DEF other( )\n;mine\nEND\n")
    (backup / "KRC/R1/Program/mine.src").write_text("DEF mine( )\nEND\n")
    result = respot("undo", backup, "--json")
    assert result.code == 0, result.err
    (issue,) = result.json["issues"]
    assert (issue["code"], issue["path"]) == ("STAYS_CHANGED", str(backup / "KRC/R1/Program/other.src"))
    assert ";mine" in (backup / "KRC/R1/Program/other.src").read_text()
    assert (backup / "KRC/R1/Program/mine.src").exists()
    assert "respot: " not in (backup / DAT).read_text(encoding="latin-1")


@pytest.mark.parametrize("damage", ["changed", "gone", "list gone", "list damaged", "all gone", "a link"])
def test_originals_that_are_lost_are_said_and_nothing_is_touched(respot, tmp_path, backup, cal, damage):
    assert respot("convert", backup, "-c", cal, "--in-place").code == 0
    kept = backup / ".respot" / "0001"
    original = kept / "originals" / f"{DAT}.original"
    if damage == "changed":
        original.write_text("DEFDAT weld\nENDDAT\n")
    elif damage == "gone":
        original.unlink()
    elif damage == "list gone":
        (kept / "kept.json").unlink()
    elif damage == "list damaged":
        (kept / "kept.json").write_text("{")
    elif damage == "a link":
        shutil.copy(original, tmp_path / "copy")
        original.unlink()
        original.symlink_to(tmp_path / "copy")
    else:
        shutil.rmtree(backup / ".respot")
    before = state(backup)
    for options in ([], ["--force"]):
        result = respot("undo", backup, *options)
        assert (result.code, "ORIGINALS_LOST" in result.err) == (2, True), result.err
        assert state(backup) == before


@pytest.mark.parametrize("path", ["../outside.src", "/etc/outside.src", "a/../../outside.src", "..\\outside.src", ""])
def test_a_list_from_a_stranger_restores_nothing_outside(respot, tmp_path, backup, cal, path):
    assert respot("convert", backup, "-c", cal, "--in-place").code == 0
    place = backup / ".respot" / "0001" / "kept.json"
    listed = json.loads(place.read_text())
    listed["files"][path] = {"before": None, "after": "0" * 64}
    place.write_text(json.dumps(listed))
    (tmp_path / "outside.src").write_text("mine")
    before = state(tmp_path)
    result = respot("undo", backup, "--force")
    assert (result.code, "ORIGINALS_LOST" in result.err) == (2, True)
    assert state(tmp_path) == before


# --------------------------------------------------------------------------------------------------------- a new folder


def test_a_new_folder_goes_and_the_source_stays(respot, tmp_path, backup, cal):
    before, out = state(backup), tmp_path / "out"
    assert respot("convert", backup, "-c", cal, "-o", out).code == 0
    files = sorted(path.relative_to(out).as_posix() for path in out.rglob("*") if path.is_file())
    result = respot("undo", out, "--json")
    assert (result.code, result.json["kind"], result.json["removed"]) == (0, "folder", files)
    assert state(backup) == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["backup", "cal.json"]


@pytest.mark.parametrize("change", ["notes.txt", DAT, "KRC/R1/Program/more/new.src"])
def test_a_new_folder_in_which_a_person_worked_stays(respot, tmp_path, backup, cal, change):
    out = tmp_path / "out"
    assert respot("convert", backup, "-c", cal, "-o", out).code == 0
    (out / change).parent.mkdir(exist_ok=True)
    (out / change).write_text("mine")
    before = state(out)
    for options in ([], ["--force"]):
        result = respot("undo", out, *options)
        assert (result.code, "CHANGED_SINCE" in result.err, change in result.err) == (2, True, True)
        assert state(out) == before


@pytest.mark.parametrize("loss", ["gone", "changed", "moved"])
def test_a_new_folder_that_may_be_the_only_copy_stays(respot, tmp_path, backup, cal, loss):
    out = tmp_path / "out"
    assert respot("convert", backup, "-c", cal, "-o", out).code == 0
    if loss == "changed":
        (backup / DAT).write_text("DEFDAT weld\nENDDAT\n")
    elif loss == "moved":
        backup.rename(tmp_path / "elsewhere")
    else:
        shutil.rmtree(backup)
    before = state(out)
    result = respot("undo", out)
    assert (result.code, "only copy" in result.err) == (2, True)
    assert state(out) == before
    assert respot("undo", out, "--force").code == 0
    assert not out.exists()


def test_a_conversion_in_place_of_a_new_folder_goes_first_and_then_the_folder(respot, tmp_path, backup, cal):
    out = tmp_path / "out"
    assert respot("convert", backup, "-c", cal, "-o", out).code == 0
    before = state(out)
    assert respot("convert", out, "-c", calibration(tmp_path / "more.json", 1.0), "--in-place").code == 0
    assert respot("undo", out).code == 0
    assert state(out) == before
    assert respot("undo", out).code == 0
    assert not out.exists()


@pytest.mark.parametrize("what", ["no folder", "any folder", "any record"])
def test_what_respot_did_not_write_is_not_undone(respot, tmp_path, backup, what):
    place = backup if what == "any folder" else tmp_path / "nowhere"
    if what == "any record":
        place = tmp_path / "mine"
        place.mkdir()
        (place / "respot.json").write_text('{"schema": "mine"}')
        (place / "precious.txt").write_text("mine")
    before = state(tmp_path)
    result = respot("undo", place, "--force")
    assert result.code == 2
    assert state(tmp_path) == before
