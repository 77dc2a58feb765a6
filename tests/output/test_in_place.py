"""``convert --in-place``: the backup itself changes and keeps its originals, where nothing takes them for programs."""

from __future__ import annotations

import json
import os
import shutil
import zipfile
from pathlib import Path

import pytest

from respot.backups import open_backup
from tests.correction.small import krl, rapid
from tests.difference.witness import assert_witnessed
from tests.output.runs import CLI, SAMPLES, calibration, state, write

THEORY = SAMPLES / "theory.csv"


@pytest.fixture
def respot(cli: CLI) -> CLI:
    return cli


@pytest.mark.parametrize("robot", ["kuka", "abb"])
def test_in_place_a_backup_becomes_what_a_new_folder_would_be(respot, tmp_path, robot):
    backup, out = tmp_path / "backup", tmp_path / "out"
    shutil.copytree(SAMPLES / robot, backup)
    assert respot("convert", backup, "--theory", THEORY, "-o", out).code == 0
    result = respot("convert", backup, "--theory", THEORY, "--in-place", "--json")
    assert result.code == 0, result.err
    assert (result.json["output"], result.json["in_place"]) == (str(backup), True)
    records = [json.loads((folder / "respot.json").read_text()) for folder in (backup, out)]
    assert records[0].pop("in_place") == 1
    assert records[0] == records[1]
    changed, written = state(backup, times=False), state(out, times=False)
    own = {name for name in changed if name.partition("/")[0] == ".respot"}
    assert own and {name: changed[name] for name in changed if name not in {*own, "respot.json"}} == {
        name: written[name] for name in written if name != "respot.json"
    }
    assert_witnessed(result.json["edits"], SAMPLES / robot, backup)


def test_originals_are_kept_as_they_were_and_files_that_do_not_change_are_the_same_files(respot, tmp_path):
    backup = write(tmp_path / "backup", krl())
    (backup / "KRC" / "empty").mkdir()
    for number, path in enumerate(sorted(backup.rglob("*"), reverse=True)):
        if path.is_file():
            path.chmod(0o640)
        os.utime(path, ns=(10**18 + number, 10**18 + number))
    os.utime(backup, ns=(10**18, 10**18))
    before = {path.relative_to(backup).as_posix(): path.stat() for path in backup.rglob("*")}
    bytes_before = {name: (backup / name).read_bytes() for name in before if (backup / name).is_file()}
    assert respot("convert", backup, "-c", calibration(tmp_path / "cal.json"), "--in-place").code == 0
    changed = [name for name in bytes_before if (backup / name).read_bytes() != bytes_before[name]]
    assert changed == ["KRC/R1/Program/weld.dat"]
    for name, was in before.items():
        now = (backup / name).stat()
        assert now.st_mode == was.st_mode
        if name not in changed:
            assert now.st_mtime_ns == was.st_mtime_ns
        if name in bytes_before and name not in changed:
            assert now.st_ino == was.st_ino
    kept = backup / ".respot" / "0001" / "originals" / f"{changed[0]}.original"
    assert kept.read_bytes() == bytes_before[changed[0]]
    assert kept.stat().st_mtime_ns == before[changed[0]].st_mtime_ns


def test_no_command_takes_the_originals_for_programs(respot, tmp_path):
    backup = tmp_path / "backups" / "one"
    shutil.copytree(SAMPLES / "kuka", backup)
    programs = respot("check", backup, "--json").json["totals"]["files"]
    targets = [robot["targets"] for robot in respot("inspect", backup, "--json").json["robots"]]
    assert respot("convert", backup, "--theory", THEORY, "--in-place").code == 0
    assert respot("check", backup, "--json").json["totals"]["files"] == programs
    assert respot("check", backup.parent, "--json").json["totals"]["files"] == programs
    found = respot("inspect", backup.parent, "--json").json
    (robot,) = found["robots"]
    assert len(robot["targets"]) == len(targets[0])
    assert "OWN_FOLDER" in {issue["code"] for issue in found["issues"]}
    assert not any(".respot" in path for path in open_backup(backup).files)
    moved = shutil.copytree(backup, tmp_path / "moved", ignore=shutil.ignore_patterns(".respot"))
    assert open_backup(moved).sha256 == open_backup(backup).sha256
    assert respot("diff", moved, backup).code == 0
    packed = shutil.make_archive(str(tmp_path / "packed"), "zip", backup)
    assert any(".respot" in name for name in zipfile.ZipFile(packed).namelist())
    assert open_backup(Path(packed)).sha256 == open_backup(backup).sha256
    assert respot("convert", packed, "--theory", THEORY, "-o", tmp_path / "out").code == 0
    assert not (tmp_path / "out" / ".respot").exists()


def test_work_that_a_killed_run_left_is_no_robot(respot, tmp_path):
    shutil.copytree(SAMPLES / "kuka", tmp_path / "backups" / "one")
    shutil.copytree(SAMPLES / "kuka", tmp_path / "backups" / ".one.respot" / "new")
    assert len(respot("inspect", tmp_path / "backups", "--json").json["robots"]) == 1


def test_the_same_calibration_is_never_applied_twice_and_again_after_undo(respot, tmp_path):
    backup, cal = write(tmp_path / "backup", krl()), calibration(tmp_path / "cal.json")
    assert respot("convert", backup, "-c", cal, "--in-place").code == 0
    once = state(backup)
    again = respot("convert", backup, "-c", cal, "--in-place")
    assert (again.code, "ALREADY_APPLIED" in again.err) == (2, True)
    assert state(backup) == once
    assert respot("undo", backup).code == 0
    assert respot("convert", backup, "-c", cal, "--in-place").code == 0
    assert state(backup, times=False) == {name: (each[0], each[1], 0) for name, each in once.items()}


def test_two_robots_of_one_tree_are_converted_one_after_the_other(respot, tmp_path):
    tree = tmp_path / "line"
    for name, files in (("R1", krl()), ("R2", rapid())):
        write(tree / name, files)
    cal, other = calibration(tmp_path / "one.json"), calibration(tmp_path / "two.json", 1.0)
    first, second = (state(tree / name) for name in ("R1", "R2"))
    assert respot("convert", tree, "-c", cal, "--in-place", "--robot-name", "R1").code == 0
    assert state(tree / "R1") != first and state(tree / "R2") == second
    made = respot("convert", tree, "-c", other, "--in-place", "--robot-name", "R2", "--keep-config")
    assert made.code == 0, made.err
    assert state(tree / "R2") != second
    assert respot("undo", tree).code == 0
    assert state(tree / "R1") != first and state(tree / "R2") == second
    assert respot("undo", tree).code == 0
    assert state(tree / "R1") == first and sorted(path.name for path in tree.iterdir()) == ["R1", "R2"]


def test_where_nothing_moves_nothing_is_written(respot, tmp_path):
    backup = write(tmp_path / "backup", krl())
    before = state(backup)
    result = respot("convert", backup, "-c", calibration(tmp_path / "cal.json"), "--in-place", "--max-shift", "1")
    assert result.code == 1 and "no file changes, nothing written" in result.out
    assert state(backup) == before


def test_a_dry_run_in_place_changes_nothing(respot, tmp_path):
    backup = write(tmp_path / "backup", krl())
    before = state(backup)
    result = respot("convert", backup, "-c", calibration(tmp_path / "cal.json"), "--in-place", "--dry-run", "--json")
    assert (result.code, result.json["output"], result.json["in_place"]) == (0, None, False)
    assert result.json["edits"] and state(backup) == before


def test_a_file_that_changes_while_respot_reads_is_not_overwritten(respot, tmp_path, monkeypatch):
    """The point that a person teaches between the reading and the writing is not lost."""
    from respot.output import in_place

    backup = write(tmp_path / "backup", krl())
    for name in ("weld.dat", "weld.src", "new.src"):
        place = backup / "KRC" / "R1" / "Program" / name
        old = place.read_bytes() if place.exists() else None
        mirror = in_place.mirror

        def late(source, staged, place=place, mirror=mirror):
            place.write_bytes(b"DEF touched( )\r\nEND\r\n")
            mirror(source, staged)

        monkeypatch.setattr(in_place, "mirror", late)
        result = respot("convert", backup, "-c", calibration(tmp_path / "cal.json"), "--in-place")
        monkeypatch.undo()
        assert (result.code, f"{place}: SOURCE_CHANGED" in result.err) == (2, True), result.err
        assert place.read_bytes().startswith(b"DEF touched")
        assert not (backup / "respot.json").exists()
        place.unlink() if old is None else place.write_bytes(old)


@pytest.mark.parametrize("kind", ["zip", "file"])
def test_only_a_folder_is_changed_in_place(respot, tmp_path, kind):
    backup = write(tmp_path / "backup", krl())
    source = backup / "KRC" / "R1" / "Program" / "weld.src"
    if kind == "zip":
        source = Path(shutil.make_archive(str(tmp_path / "packed"), "zip", backup))
    before = source.read_bytes()
    result = respot("convert", source, "-c", calibration(tmp_path / "cal.json"), "--in-place")
    assert result.code == 2 and "BAD_OPTION" in result.err and "-o OUTDIR" in result.err
    assert source.read_bytes() == before


@pytest.mark.parametrize(
    ("options", "words"), [(["-o", "out", "--in-place"], "not both"), ([], "--in-place to change the backup itself")]
)
def test_where_to_write_is_said_once(respot, tmp_path, options, words):
    backup = write(tmp_path / "backup", krl())
    result = respot("convert", backup, "-c", calibration(tmp_path / "cal.json"), *options)
    assert (result.code, words in result.err) == (2, True)


def test_a_folder_that_one_stands_in_is_not_pulled_away(respot, tmp_path, monkeypatch):
    backup, cal = write(tmp_path / "backup", krl()), calibration(tmp_path / "cal.json")
    before = state(backup)
    for place in (backup, backup / "KRC"):
        monkeypatch.chdir(place)
        result = respot("convert", backup, "-c", cal, "--in-place")
        assert (result.code, "leave it (cd ..)" in result.err) == (2, True)
        assert state(backup) == before


def test_a_link_to_the_backup_stays_a_link(respot, tmp_path):
    backup, cal = write(tmp_path / "disk" / "backup", krl()), calibration(tmp_path / "cal.json")
    (tmp_path / "short").symlink_to(backup)
    assert respot("convert", tmp_path / "short", "-c", cal, "--in-place").code == 0
    assert (tmp_path / "short").is_symlink() and (backup / "respot.json").exists()
    assert respot("undo", tmp_path / "short").code == 0
    assert (tmp_path / "short").is_symlink() and not (backup / "respot.json").exists()


def test_force_never_replaces_a_backup_that_was_converted_in_place(respot, tmp_path):
    """Its record knows all that is in it; the originals would go with it."""
    backup, other = write(tmp_path / "backup", krl()), write(tmp_path / "other", krl())
    cal = calibration(tmp_path / "cal.json")
    assert respot("convert", backup, "-c", cal, "--in-place").code == 0
    before = state(backup)
    result = respot("convert", other, "-c", cal, "-o", backup, "--force")
    assert (result.code, "originals of a conversion in place" in result.err) == (2, True)
    assert state(backup) == before


def test_a_link_inside_a_folder_of_originals_is_refused(respot, tmp_path):
    """What is written into it would land elsewhere."""
    backup, cal = write(tmp_path / "backup", krl()), calibration(tmp_path / "cal.json")
    (tmp_path / "elsewhere").mkdir()
    (backup / ".respot").symlink_to(tmp_path / "elsewhere")
    result = respot("convert", backup, "-c", cal, "--in-place")
    assert (result.code, "UNSAFE_ARCHIVE" in result.err) == (2, True)
    assert list((tmp_path / "elsewhere").iterdir()) == []
