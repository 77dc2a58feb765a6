"""Disks that are full, read-only, foreign or shared: nothing half-written, the old state intact, the file and a way out named."""

from __future__ import annotations

import fcntl
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.output.runs import SAMPLES, Runner, state


def listed(folder: Path) -> list[str]:
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*"))


def refused(ended, path: Path, *words: str) -> str:
    """The command ended with one message that names the file, and what to do."""
    assert ended.code == 2, (ended.code, ended.err)
    (line,) = [line for line in ended.err.splitlines() if line.startswith("error: ")]
    assert re.match(rf"error: {re.escape(str(path))}\S*: [A-Z_]+ ", line), line
    for word in words:
        assert word in line, line
    return line


# ------------------------------------------------------------------------------------------------------------ full disks


def full_disk(place: Path) -> dict:
    """A disk of its own of 96 kB, where the system lets us mount one."""
    place.mkdir(exist_ok=True)
    return {"mounts": [{"path": str(place), "size": "96k"}], "list": str(place)}


def test_a_full_disk(respot: Runner, tmp_path, backup, cal):
    """A disk that fills up; where nobody may mount one, a limit of the size of a file stands in for it."""
    before, disk = state(backup), tmp_path / "disk"
    ended = respot("convert", backup, "-c", cal, "-o", disk / "out", **full_disk(disk))
    if ended.code == 0:  # nothing was mounted
        assert not ended.mounted
        shutil.rmtree(disk / "out")
    else:
        refused(ended, disk / "out", "CANNOT_WRITE", "No space left on device", "free some space", "-o")
        assert ended.left == []
    assert state(backup) == before


def test_a_file_that_may_not_become_so_large(respot: Runner, tmp_path, backup, cal):
    before, out = state(backup), tmp_path / "out"
    for target in (["-o", out], ["--in-place"]):
        ended = respot("convert", backup, "-c", cal, *target, largest_file=2500)
        refused(ended, out if target[0] == "-o" else backup, "CANNOT_WRITE", "File too large", "lift the limit")
        assert state(backup) == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["backup", "cal.json"]


def test_a_disk_that_is_full_in_place_and_at_undo(respot: Runner, tmp_path, backup, cal):
    old = state(backup)
    assert respot("convert", backup, "-c", cal, "--in-place").code == 0
    new = state(backup)
    ended = respot("undo", backup, largest_file=600, no_links=True)
    refused(ended, backup, "CANNOT_WRITE", "File too large")
    assert state(backup) == new
    assert respot("undo", backup).code == 0
    assert state(backup) == old
    assert sorted(path.name for path in tmp_path.iterdir()) == ["backup", "cal.json"]


def test_a_report_that_finds_no_room(respot: Runner, tmp_path, backup, cal):
    ended = respot("convert", backup, "-c", cal, "-o", tmp_path / "out", largest_file=5000)
    refused(ended, tmp_path / "out" / "respot.json", "CANNOT_WRITE")
    assert not (tmp_path / "out").exists()


# --------------------------------------------------------------------------------------------- what may not be written to


def test_a_disk_that_is_read_only(respot: Runner, tmp_path, backup, cal):
    disk = tmp_path / "disk"
    disk.mkdir()
    how = {"mounts": [{"path": str(disk), "size": "1m", "read_only": True}], "list": str(disk)}
    ended = respot("convert", backup, "-c", cal, "-o", disk / "deep" / "out", **how)
    if ended.code == 0:  # nothing was mounted: rights stand in for it in the test below
        assert not ended.mounted
        return
    refused(ended, disk, "CANNOT_WRITE", "Read-only file system", "another one")
    assert ended.left == []


@pytest.mark.parametrize("command", ["new", "in place", "undo"])
def test_a_folder_that_this_account_may_not_write_to(respot: Runner, tmp_path, backup, cal, command):
    closed = tmp_path / "closed"
    closed.mkdir()
    inside = closed / "backup"
    shutil.copytree(backup, inside)
    if command == "undo":
        assert respot("convert", inside, "-c", cal, "--in-place").code == 0
    before = state(closed)
    closed.chmod(0o555)
    arguments = {
        "new": ["convert", backup, "-c", cal, "-o", closed / "out"],
        "in place": ["convert", inside, "-c", cal, "--in-place"],
        "undo": ["undo", inside],
    }[command]
    try:
        ended = respot(*arguments, drop_rights=True)
        refused(ended, closed, "CANNOT_WRITE", "Permission denied", "may not write there")
        assert state(closed) == before
    finally:
        closed.chmod(0o755)


def test_a_file_of_the_source_that_this_account_may_not_read(respot: Runner, tmp_path, backup, cal):
    locked = backup / "KRC" / "R1" / "Program" / "more07.src"
    before = state(backup)
    locked.chmod(0o000)
    for target in (["-o", tmp_path / "out"], ["--in-place"]):
        ended = respot("convert", backup, "-c", cal, *target, drop_rights=True)
        refused(ended, locked, "CANNOT_READ", "Permission denied")
    locked.chmod(before["KRC/R1/Program/more07.src"][1])
    assert state(backup) == before and not (tmp_path / "out").exists()


# ------------------------------------------------------------------------------------------------------- where it may lie


def test_an_output_folder_with_nothing_above_it(respot: Runner, tmp_path, backup, cal):
    out = tmp_path / "a" / "b" / "c"
    assert respot("convert", backup, "-c", cal, "-o", out, largest_file=2500).code == 2
    assert not (tmp_path / "a").exists()
    assert respot("convert", backup, "-c", cal, "-o", out).code == 0
    assert listed(tmp_path / "a" / "b") == ["c", *(f"c/{name}" for name in listed(out))]


@pytest.mark.parametrize("place", ["file", "file/out", "file/deep/out"])
def test_an_output_folder_whose_place_is_a_file(respot: Runner, tmp_path, backup, cal, place):
    (tmp_path / "file").write_text("mine")
    ended = respot("convert", backup, "-c", cal, "-o", tmp_path / place)
    refused(ended, tmp_path / "file", "name another")
    assert (tmp_path / "file").read_text() == "mine"


def test_a_path_that_is_too_long(respot: Runner, tmp_path, backup, cal):
    for name in ("x" * 300, "x" * 250, "/".join(["y" * 200] * 22)):
        ended = respot("convert", backup, "-c", cal, "-o", tmp_path / name)
        refused(ended, tmp_path / name[0], "CANNOT_WRITE", "shorter path")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["backup", "cal.json"]


@pytest.mark.parametrize("command", ["new", "in place"])
def test_a_folder_where_a_disk_is_mounted(respot: Runner, tmp_path, backup, cal, command):
    """It cannot be renamed; a folder in it can. Where nobody may mount a disk, the disk of the system itself is one."""
    disk = tmp_path / "disk"
    disk.mkdir()
    how = {"mounts": [{"path": str(disk), "size": "4m"}], "list": str(disk)}
    probe = respot("check", backup, **how)
    place = disk if probe.mounted else Path("/proc")
    arguments = ["-o", place] if command == "new" else ["--in-place"]
    ended = respot("convert", backup if command == "new" else place, "-c", cal, *arguments, **how)
    refused(ended, place, "CANNOT_WRITE", "where a disk is mounted")
    if probe.mounted:
        inside = respot("convert", backup, "-c", cal, "-o", disk / "out", **how)
        assert inside.code == 0 and "out/respot.json" in inside.left
        assert not [name for name in inside.left if not name.startswith("out")]


def test_an_output_folder_that_is_a_link(respot: Runner, tmp_path, backup, cal):
    (tmp_path / "real").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "real")
    refused(respot("convert", backup, "-c", cal, "-o", tmp_path / "link"), tmp_path / "link", "OUTPUT_EXISTS", "-o")
    assert list((tmp_path / "real").iterdir()) == []
    assert respot("convert", backup, "-c", cal, "-o", tmp_path / "link" / "out").code == 0
    assert listed(tmp_path / "real")[0] == "out"


def test_a_folder_in_the_way_that_respot_did_not_make_is_not_touched(respot: Runner, tmp_path, backup, cal):
    (tmp_path / ".out.respot").mkdir()
    (tmp_path / ".out.respot" / "precious.txt").write_text("mine")
    ended = respot("convert", backup, "-c", cal, "-o", tmp_path / "out")
    refused(ended, tmp_path / ".out.respot", "CANNOT_WRITE", "move it")
    assert (tmp_path / ".out.respot" / "precious.txt").read_text() == "mine"
    assert not (tmp_path / "out").exists()


# ------------------------------------------------------------------------------------------------------------------ locks


@pytest.mark.parametrize("command", ["new", "in place", "undo"])
def test_while_another_run_writes_a_folder_a_second_one_is_refused_with_its_process(
    respot: Runner, tmp_path, backup, cal, command
):
    if command == "undo":
        assert respot("convert", backup, "-c", cal, "--in-place").code == 0
    before = state(backup)
    target = tmp_path / "out" if command == "new" else backup
    work = tmp_path / f".{target.name}.respot"
    work.mkdir()
    (work / "new").mkdir()
    (work / "new" / "half.src").write_text("of the first")
    with (work / "lock").open("w") as lock:
        lock.write(json.dumps({"process": 4711, "host": "cell7", "started": "2026-01-02T03:04:05+00:00"}))
        lock.flush()
        fcntl.flock(lock, fcntl.LOCK_EX)
        arguments = {
            "new": ["convert", backup, "-c", cal, "-o", target],
            "in place": ["convert", backup, "-c", cal, "--in-place"],
            "undo": ["undo", backup],
        }[command]
        refused(respot(*arguments), target, "IN_USE", "process 4711 on cell7", "since 2026-01-02")
        assert state(backup) == before
        assert (work / "new" / "half.src").read_text() == "of the first"
    assert respot(*arguments).code == 0  # its process has ended, whatever it left
    assert not work.exists()


FIRST = """
import sys
from respot.output import new_folder
proved = new_folder.prove
def slow(*arguments):
    print("proving", flush=True)
    sys.stdin.readline()
    proved(*arguments)
new_folder.prove = slow
sys.argv = ["respot", *sys.argv[1:]]
from respot.cli import main
main()
"""


def test_two_runs_at_once_on_one_folder(respot: Runner, tmp_path, backup, cal):
    """The first waits while it writes; the second says whose folder it is; then the first ends as if alone."""
    out = tmp_path / "out"
    arguments = ["convert", str(backup), "-c", str(cal), "-o", str(out)]
    command = [sys.executable, "-c", FIRST, *arguments]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as first:
        assert first.stdout.readline() == b"proving\n"
        refused(respot(*arguments), out, "IN_USE", f"process {first.pid} on ")
        assert not out.exists()
        first.communicate(b"go\n")
    assert first.returncode == 0
    assert (out / "respot.json").exists()
    assert not (tmp_path / ".out.respot").exists()


# ------------------------------------------------------------------------------------------------------ what is on the disk


def test_what_is_proved_was_waited_for_and_moves_with_its_record(respot: Runner, tmp_path, backup, cal):
    """Everything is on the disk before it is proved, and in its place by the one rename that comes after."""
    files = len([path for path in backup.rglob("*") if path.is_file()])
    for target, rename in ((["-o", tmp_path / "out"], "rename"), (["--in-place"], "exchange")):
        for how in ({}, {"no_sync_disk": True}):
            ended = respot("convert", backup, "-c", cal, *target, **how)
            assert ended.code == 0, ended.err
            proved, moved = ended.steps.index("prove"), ended.steps.index(rename)
            waited = "fsync" if how else "sync_disk"
            assert ended.steps[:proved].count(waited) > (files if how else 0)
            assert not {"write_bytes", "link", "mkdir", "sync_disk", "fsync"} & set(ended.steps[proved:moved])
            assert not {"write_bytes", "link"} & set(ended.steps[ended.steps[:proved].index(waited) : proved])
            assert {"rename", "exchange"} & set(ended.steps) == {rename} and ended.steps.count(rename) == 1
            assert ended.steps[moved + 1] == "fsync"
            assert respot("undo", backup if target == ["--in-place"] else target[1]).code == 0


@pytest.mark.parametrize("command", ["fit", "diff", "predict", "predict_xlsx"])
def test_a_file_beside_the_answer_is_whole_or_as_it_was(respot: Runner, tmp_path, command):
    theory, name = SAMPLES / "theory.csv", f"made.{'xlsx' if command == 'predict_xlsx' else 'txt'}"
    made = tmp_path / (name if command != "predict" else "made.csv")
    assert respot("fit", SAMPLES / "kuka", "--theory", theory, "-o", tmp_path / "cal.json").code == 0
    arguments = {
        "fit": ["fit", SAMPLES / "kuka", "--theory", theory, "-o", made],
        "diff": ["diff", SAMPLES / "kuka", SAMPLES / "kuka", "--html", made],
    }.get(command, ["predict", SAMPLES / "kuka", "-c", tmp_path / "cal.json", "-o", made])
    made.write_text("of yesterday")
    refused(respot(*arguments, "--force", largest_file=600), made, "CANNOT_WRITE", "File too large")
    assert made.read_text() == "of yesterday"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["cal.json", made.name]
    assert respot(*arguments, "--force").code == 0
    assert made.stat().st_size > 600
    assert sorted(path.name for path in tmp_path.iterdir()) == ["cal.json", made.name]


def test_a_link_or_a_pipe_that_is_written_to_stays_one(respot: Runner, tmp_path):
    theory = SAMPLES / "theory.csv"
    (tmp_path / "real.json").write_text("of yesterday")
    (tmp_path / "link.json").symlink_to(tmp_path / "real.json")
    (tmp_path / "null").symlink_to("/dev/null")
    for name in ("link.json", "null"):
        assert respot("fit", SAMPLES / "kuka", "--theory", theory, "-o", tmp_path / name, "--force").code == 0
        assert (tmp_path / name).is_symlink()
    assert json.loads((tmp_path / "real.json").read_text())["kind"] == "theory"
    assert Path("/dev/null").is_char_device()
