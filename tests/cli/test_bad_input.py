"""Bad input: one clear message with file and line, exit code 2, nothing written."""

from __future__ import annotations

import os
import shutil
import signal
import socket
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import pytest

from tests.cli.conftest import SAMPLES

GOOD = (SAMPLES / "theory.csv").read_text().splitlines()


def table(tmp_path: Path, *lines: str, name: str = "table.csv") -> Path:
    path = tmp_path / name
    path.write_text("\n".join(lines) + "\n")
    return path


def refused(result, tmp_path: Path, code: str, *words: str) -> None:
    assert result.code == 2, result.err
    assert result.out == ""
    assert len(result.err.strip().splitlines()) == 1, result.err
    for word in (code, *words):
        assert word in result.err
    assert not (tmp_path / "out").exists()
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]


def changed(row: int, text: str) -> list[str]:
    return [*GOOD[: row - 1], text, *GOOD[row:]]


TABLES = {
    "empty": ([""], "BAD_TABLE", "table.csv"),
    "header_only": (GOOD[:1], "BAD_TABLE", "table.csv:1"),
    "no_x_column": (["id,u,y,z", *GOOD[1:]], "MISSING_COLUMN", "table.csv:1", "column x"),
    "a_nan": (changed(5, "P02WP1615435,nan,240.44,1276.54"), "NOT_A_NUMBER", "table.csv:5", "x is 'nan'"),
    "a_word": (changed(5, "P02WP1615435,twelve,240.44,1276.54"), "NOT_A_NUMBER", "table.csv:5"),
    "a_missing_cell": (changed(5, "P02WP1615435,4313.76,240.44"), "BAD_TABLE", "table.csv:5"),
    "an_empty_id": (changed(5, ",4313.76,240.44,1276.54"), "BAD_TABLE", "table.csv:5"),
    "a_duplicate_id": ([*GOOD, GOOD[3]], "DUPLICATE_ID", "table.csv:16", "line 4"),
    "no_common_ids": (["id,x,y,z", "A1,0,0,0", "A2,1,0,0", "A3,0,1,0", "A4,0,0,1"], "NO_COMMON_IDS", "--spot-id"),
    "three_pairs": (GOOD[:4], "TOO_FEW_PAIRS", "table.csv"),
    "half_an_orientation": (["id,x,y,z,a", *(f"{line},0" for line in GOOD[1:])], "MISSING_COLUMN", "b, c"),
    "two_x_columns": (["id,x,y,z,x", *(f"{line},0" for line in GOOD[1:])], "BAD_TABLE", "table.csv:1", "two columns"),
}


@pytest.mark.parametrize("command", ["fit", "convert"])
@pytest.mark.parametrize("name", TABLES)
def test_table(respot, tmp_path, name, command):
    lines, code, *words = TABLES[name]
    output = ["-o", "out"] if command == "convert" else ["--json"]
    result = respot(command, SAMPLES / "kuka", "--theory", table(tmp_path, *lines), *output)
    refused(result, tmp_path, code, *words)


def test_collinear_spots(respot, tmp_path):
    names = [line.split(",")[0] for line in GOOD[1:]]
    source = table(
        tmp_path, "id,x,y,z", *(f"{name},{10 * row},0,0" for row, name in enumerate(names)), name="source.csv"
    )
    reference = table(tmp_path, "id,x,y,z", *(f"{name},0,{10 * row},5" for row, name in enumerate(names)))
    refused(
        respot("fit", source, "--theory", reference), tmp_path, "COLLINEAR_SPOTS", "rotation about", "not determined"
    )


def test_a_missing_source(respot, tmp_path, theory):
    refused(respot("fit", "nowhere", "--theory", theory), tmp_path, "CANNOT_READ", "nowhere")
    refused(respot("convert", "nowhere.zip", "--theory", theory, "-o", "out"), tmp_path, "CANNOT_READ", "nowhere.zip")


def test_a_missing_reference(respot, tmp_path):
    refused(respot("fit", SAMPLES / "kuka", "--theory", "nowhere.csv"), tmp_path, "CANNOT_READ", "nowhere.csv")


def test_an_unreadable_reference(respot, tmp_path):
    """A socket is a path that even root cannot open for reading."""
    with socket.socket(socket.AF_UNIX) as server:
        server.bind("table.csv")
        refused(respot("fit", SAMPLES / "kuka", "--theory", "table.csv"), tmp_path, "CANNOT_READ", "table.csv")


def test_an_unreadable_reference_that_is_a_folder_of_no_robot(respot, tmp_path):
    (tmp_path / "empty").mkdir()
    refused(respot("fit", SAMPLES / "kuka", "--theory", "empty"), tmp_path, "NO_ROBOT", "empty")


def test_a_broken_zip(respot, tmp_path, theory):
    (tmp_path / "broken.zip").write_bytes(b"PK\x03\x04 no archive")
    refused(respot("convert", "broken.zip", "--theory", theory, "-o", "out"), tmp_path, "NO_ROBOT", "broken.zip")


@pytest.mark.parametrize("entry", ["../evil.src", "/evil.src", "C:/evil.src", "KRC\\..\\..\\evil.src"])
def test_an_archive_that_would_leave_its_folder(respot, tmp_path, theory, entry):
    with zipfile.ZipFile(tmp_path / "evil.zip", "w") as archive:
        archive.writestr(entry, "DEF evil()\r\nEND\r\n")
    refused(respot("convert", "evil.zip", "--theory", theory, "-o", "out"), tmp_path, "UNSAFE_ARCHIVE", "evil.src")


def test_a_backup_with_links(respot, tmp_path, theory):
    (tmp_path / "linked" / "KRC").mkdir(parents=True)
    (tmp_path / "linked" / "KRC" / "a.src").symlink_to("/etc/hostname")
    refused(respot("convert", "linked", "--theory", theory, "-o", "out"), tmp_path, "UNSAFE_ARCHIVE", "a.src")


def test_an_output_folder_that_is_not_empty(respot, tmp_path, theory):
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "precious.txt").write_text("mine")
    result = respot("convert", SAMPLES / "abb", "--theory", theory, "-o", "full")
    refused(result, tmp_path, "OUTPUT_EXISTS", "--force")
    assert [path.name for path in (tmp_path / "full").iterdir()] == ["precious.txt"]
    result = respot("convert", SAMPLES / "abb", "--theory", theory, "-o", "full", "--force")
    refused(result, tmp_path, "OUTPUT_EXISTS", "only what respot wrote")
    assert (tmp_path / "full" / "precious.txt").read_text() == "mine"


def test_force_replaces_what_respot_wrote(respot, tmp_path, theory):
    assert respot("convert", SAMPLES / "kuka", "--theory", theory, "-o", "done").code == 0
    assert respot("convert", SAMPLES / "abb", "--theory", theory, "-o", "done").code == 2
    assert (tmp_path / "done" / "KRC").is_dir()
    assert respot("convert", SAMPLES / "abb", "--theory", theory, "-o", "done", "--force").code == 0
    assert not (tmp_path / "done" / "KRC").exists()
    assert (tmp_path / "done" / "RAPID").is_dir()


@pytest.mark.parametrize("change", ["notes.txt", "RAPID/TASK1/PROGMOD/RearDoor.mod"])
def test_force_keeps_what_a_person_added_or_changed(respot, tmp_path, theory, change):
    assert respot("convert", SAMPLES / "abb", "--theory", theory, "-o", "done").code == 0
    (tmp_path / "done" / change).write_text("mine")
    result = respot("convert", SAMPLES / "abb", "--theory", theory, "-o", "done", "--force")
    refused(result, tmp_path, "OUTPUT_EXISTS", change.rpartition("/")[2])
    assert (tmp_path / "done" / change).read_text() == "mine"


def test_a_file_name_that_is_no_utf_8(respot, tmp_path, theory):
    shutil.copytree(SAMPLES / "kuka", tmp_path / "kuka")
    raw = os.fsencode(tmp_path / "kuka" / "KRC" / "R1" / "Program") + b"/\xfcbung.src"
    with open(raw, "wb") as file:  # noqa: PTH123
        file.write(b"DEF uebung( )\r\nLINN X\r\nEND\r\n")
    assert respot("check", "kuka").code == 0
    result = respot("convert", "kuka", "--theory", theory, "-o", "out", "--json")
    assert result.code == 0, result.err
    copied = os.fsencode(tmp_path / "out" / "KRC" / "R1" / "Program") + b"/\xfcbung.src"
    assert os.path.exists(copied)  # noqa: PTH110


def test_fit_writes_into_no_input(respot, tmp_path, theory):
    shutil.copytree(SAMPLES / "abb", tmp_path / "abb")
    shutil.copy(theory, tmp_path / "theory.csv")
    for output in ("abb/cal.json", "theory.csv"):
        refused(respot("fit", "abb", "--theory", "theory.csv", "-o", output, "--force"), tmp_path, "OUTPUT_EXISTS")
    assert (tmp_path / "theory.csv").read_bytes() == theory.read_bytes()


def test_an_output_folder_around_the_source(respot, tmp_path, theory):
    shutil.copytree(SAMPLES / "abb", tmp_path / "line" / "abb")
    for output in ("line", "line/abb", "line/abb/new"):
        result = respot("convert", "line/abb", "--theory", theory, "-o", output, "--force")
        refused(result, tmp_path, "OUTPUT_EXISTS", "line/abb")
    assert (tmp_path / "line" / "abb" / "system.xml").is_file()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ([], "--theory REF or --measured REF"),
        (["--theory", "a.csv", "--measured", "b.csv"], "--theory REF or --measured REF"),
        (["--theory", "a.csv", "-c", "b.json"], "not both"),
        (["--theory", "a.csv", "--max-shift", "far"], "--max-shift"),
        (["--theory", "a.csv", "--frame", "any"], "--frame"),
    ],
)
def test_options_that_make_no_sense(respot, tmp_path, options, words):
    refused(respot("convert", SAMPLES / "abb", *options, "-o", "out"), tmp_path, "BAD_OPTION", words)


def test_a_measured_reference_without_effects_has_nothing_to_write(respot, tmp_path, theory):
    result = respot("convert", SAMPLES / "abb", "--measured", theory, "-o", "out")
    refused(result, tmp_path, "BAD_OPTION", "nothing to compensate")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("{", "JSON"),
        ("[]", "object"),
        ('{"schema": "other/1"}', "schema"),
        ('{"schema": "respot.calibration/1"}', "lacks"),
    ],
)
def test_a_calibration_that_is_none(respot, tmp_path, text, words):
    (tmp_path / "cal.json").write_text(text)
    refused(respot("convert", SAMPLES / "abb", "-c", "cal.json", "-o", "out"), tmp_path, "BAD_CALIBRATION", words)


def test_a_calibration_that_was_changed_by_hand(respot, tmp_path, theory):
    assert respot("fit", SAMPLES / "abb", "--theory", theory, "-o", "cal.json").code == 0
    text = (tmp_path / "cal.json").read_text()
    (tmp_path / "cal.json").write_text(text.replace('"kind": "theory"', '"kind": "measured"'))
    refused(respot("convert", SAMPLES / "abb", "-c", "cal.json", "-o", "out"), tmp_path, "BAD_CALIBRATION", "changed")


def test_unknown_robot_name(respot, tmp_path, theory):
    result = respot("fit", SAMPLES / "abb", "--theory", theory, "--robot-name", "R99")
    refused(result, tmp_path, "NO_ROBOT", "R99", "ST140R02")


def test_spot_id_that_is_no_pattern(respot, tmp_path, theory):
    result = respot("fit", SAMPLES / "abb", "--theory", theory, "--spot-id", "(")
    refused(result, tmp_path, "BAD_OPTION", "--spot-id")


INTERRUPTED = """
import sys, threading, _thread
from pathlib import Path
wait = threading.Event()
write = Path.write_bytes
def slow(path, data):
    if path.name == {name!r}:
        print("writing", flush=True)
        wait.wait(30)
    return write(path, data)
Path.write_bytes = slow
sys.argv = ["respot", "convert", {source!r}, "--theory", {theory!r}, "-o", "out"]
from respot.cli import main
main()
"""


@pytest.mark.parametrize("name", ["RearDoor.mod", "system.xml"])
def test_ctrl_c_while_writing_leaves_nothing(tmp_path, theory, name):
    """The interrupt hits the writing itself: the program says when it writes the file, and waits there."""
    code = INTERRUPTED.format(name=name, source=str(SAMPLES / "abb"), theory=str(theory))
    process = subprocess.Popen(
        [sys.executable, "-c", code], cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdout.readline() == "writing\n"
    assert list(tmp_path.iterdir()), "it was not writing"
    time.sleep(0.1)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=30)
    assert process.returncode == 130, err
    assert "interrupted" in err
    assert list(tmp_path.iterdir()) == []


def test_what_is_written_is_read_back(respot, tmp_path, theory, monkeypatch):
    """A disk that changes a digit: nothing is left, and the message names the file."""
    write = Path.write_bytes

    def damage(path: Path, data: bytes) -> int:
        if path.name == "RearDoor.mod":
            data = data.replace(b"z50", b"z60", 1)
        return write(path, data)

    monkeypatch.setattr(Path, "write_bytes", damage)
    result = respot("convert", SAMPLES / "abb", "--theory", theory, "-o", "out")
    assert result.code == 3
    assert "RearDoor.mod" in result.err
    assert not list(tmp_path.iterdir())
