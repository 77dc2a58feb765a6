"""`respot check`: what is read, what is opaque, what can be written back."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import pytest

from tests.cli.conftest import SAMPLES


def files(result) -> dict[str, dict]:
    return {Path(record["path"]).name: record for record in result.json["files"]}


def test_the_samples_are_understood_in_full(respot):
    result = respot("check", SAMPLES / "kuka", SAMPLES / "abb", "--json")
    assert result.code == 0, result.err
    totals = result.json["totals"]
    assert totals["files"] == 14
    assert (totals["opaque"], totals["roundtrip_failures"]) == (0, 0)
    assert result.json["issues"] == []
    found = files(result)
    assert found["rear_door_u.src"]["encoding"] == "cp1252"
    assert found["RearDoor.mod"]["encoding"] == "latin-1"
    assert {record["newline"] for record in found.values()} == {"CRLF"}
    assert found["rear_door_u.dat"]["bytes"] == (SAMPLES / "kuka/KRC/R1/Program/rear_door_u.dat").stat().st_size


def test_statements_are_no_blank_lines_comments_or_fold_marks(respot, tmp_path):
    (tmp_path / "a.src").write_text("&REL 1\nDEF a( )\n;FOLD x\n\n; words\nHALT\n;ENDFOLD\nEND\n")
    (tmp_path / "b.mod").write_text("MODULE b\n ! words\n\n PROC main()\n  Stop; Stop;\n ENDPROC\nENDMODULE\nafter\n")
    found = files(respot("check", ".", "--json"))
    assert found["a.src"]["statements"] == 4
    assert found["b.mod"]["statements"] == 6


def test_an_opaque_statement_is_a_warning_with_its_place(respot, tmp_path):
    (tmp_path / "a.src").write_text("DEF a( )\n  x := 1\nEND\n")
    result = respot("check", "a.src", "--json")
    assert result.code == 0
    (issue,) = result.json["issues"]
    assert (issue["code"], issue["level"], issue["path"], issue["line"], issue["column"]) == (
        "OPAQUE_STATEMENT", "warning", "a.src", 2, 3,
    )  # fmt: skip
    assert files(result)["a.src"]["opaque"] == 1


@pytest.mark.parametrize(
    "number", ["9E+09", "-0", "007", ".5", "1.", "2.80000E+06", "-1.5e-05", "+3.10", "- 4", "1E400"]
)
def test_every_spelling_of_a_number_is_rendered_again(respot, tmp_path, number):
    (tmp_path / "a.dat").write_text(f"DEFDAT a\nDECL REAL x={number}\nENDDAT\n")
    result = respot("check", "a.dat", "--json")
    assert result.code == 0, result.out
    assert files(result)["a.dat"]["roundtrip"] is True


def test_a_number_that_is_spelled_otherwise_is_a_failure(respot, tmp_path, monkeypatch):
    """The round trip is real: with a writer that drops a digit the answer is no."""
    from respot.languages import overlay, writing

    writing.templates.cache_clear()
    monkeypatch.setattr(overlay, "spell", lambda value, style: f"{float(value):.1f}")
    (tmp_path / "a.dat").write_text("DEFDAT a\nDECL REAL x=1.25\nENDDAT\n")
    try:
        result = respot("check", "a.dat", "--json")
    finally:
        writing.templates.cache_clear()
    assert result.code == 1
    assert result.json["totals"]["roundtrip_failures"] == 1


def test_what_only_has_the_name_of_a_program_is_left_alone(respot, tmp_path):
    (tmp_path / "points.dat").write_text("1.0 2.0 3.0\n4.0 5.0 6.0\n" * 20)
    (tmp_path / "main.src").write_text("#include <stdio.h>\nint main() {\n  return 0;\n}\n")
    (tmp_path / "encoded.sys").write_bytes(b"\xfc\x01\x02\xff" * 9)
    (tmp_path / "driver.sys").write_bytes(b"MZ\x90\0\x03\0")
    (tmp_path / "notes.txt").write_text("no program")
    found = files(respot("check", ".", "--json"))
    assert {name: record["language"] for name, record in found.items()} == {
        "points.dat": "other",
        "main.src": "other",
        "encoded.sys": "binary",
        "driver.sys": "other",
    }


def test_a_zip_is_checked_without_unpacking(respot, tmp_path):
    with zipfile.ZipFile(tmp_path / "backup.zip", "w") as archive:
        for path in (SAMPLES / "abb").rglob("*"):
            if path.is_file():
                archive.write(path, path.relative_to(SAMPLES).as_posix())
    result = respot("check", "backup.zip", "--json")
    assert result.json["totals"]["files"] == 5
    assert all(record["path"].startswith("backup.zip:abb/") for record in result.json["files"])


def many(tmp_path: Path, count: int, lines: int = 20) -> None:
    for number in range(count):
        body = "".join(f"DECL E6POS XP{row}={{X {row}.5,Y -{number}.25,Z 3.0,A 0,B 0,C 0}}\n" for row in range(lines))
        (tmp_path / f"m{number:03d}.dat").write_text(f"DEFDAT m{number:03d}\n{body}ENDDAT\n")


def test_all_cores_find_what_one_finds(respot, tmp_path):
    many(tmp_path, 30)
    one, two = (respot("check", ".", "-j", jobs, "--json").json for jobs in (1, 2))
    assert one["files"] == two["files"]
    assert one["totals"]["statements"] == two["totals"]["statements"] == 30 * 22


def test_ctrl_c_ends_the_pool(tmp_path):
    many(tmp_path, 200, lines=2000)
    process = subprocess.Popen(
        [sys.executable, "-m", "respot", "check", ".", "-j", "2"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    children = Path(f"/proc/{process.pid}/task/{process.pid}/children")
    deadline = time.monotonic() + 60
    while len(children.read_text().split()) < 3 and time.monotonic() < deadline:
        time.sleep(0.05)
    workers = [int(pid) for pid in children.read_text().split()]
    assert workers, "no worker started"
    os.killpg(process.pid, signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130, err
    assert "Traceback" not in err
    deadline = time.monotonic() + 20
    while any(running(pid) for pid in workers) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert not [pid for pid in workers if running(pid)]


def running(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def test_missing_path(respot):
    result = respot("check", "nowhere")
    assert result.code == 2
    assert "CANNOT_READ" in result.err


def test_nul_bytes_in_a_program_are_no_reason_to_skip_it(respot, tmp_path):
    (tmp_path / "a.dat").write_bytes(b"DEFDAT a\r\n\0\0\r\nDECL INT x=1\r\nENDDAT\r\n")
    result = respot("check", "a.dat", "--json")
    record = files(result)["a.dat"]
    assert (record["language"], record["opaque"], record["roundtrip"]) == ("krl", 1, True)
