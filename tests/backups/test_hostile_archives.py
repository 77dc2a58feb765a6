"""Archives made to harm, or by tools with odd habits: exit code 2, one line, nothing written; or read as meant."""

from __future__ import annotations

import os
import stat
import zipfile
import zlib
from pathlib import Path

import pytest

from respot import archives
from respot.archives import read_tree
from respot.issues import BadInputError
from tests.backups.raw_zip import Entry, raw_zip
from tests.backups.trees import krc, packed, src, write

PROGRAM = src("a").encode()
GOOD = Entry(b"KRC/R1/Program/a.src", PROGRAM)


def deflated(data: bytes) -> bytes:
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    return packer.compress(data) + packer.flush()


#: name of the trap -> archive, code, a word of the message
HOSTILE = {
    "parent_folder": (raw_zip(GOOD, Entry(b"../evil.src", PROGRAM)), "UNSAFE_ARCHIVE", "evil.src"),
    "parent_folder_further_in": (raw_zip(GOOD, Entry(b"KRC/../../evil.src")), "UNSAFE_ARCHIVE", "evil.src"),
    "parent_folder_with_backslashes": (raw_zip(GOOD, Entry(b"KRC\\..\\..\\evil.src")), "UNSAFE_ARCHIVE", "evil.src"),
    "folder_entry_outside": (raw_zip(GOOD, Entry(b"../outside/")), "UNSAFE_ARCHIVE", "outside"),
    "absolute": (raw_zip(GOOD, Entry(b"/etc/evil.src")), "UNSAFE_ARCHIVE", "evil.src"),
    "absolute_with_backslash": (raw_zip(GOOD, Entry(b"\\evil.src")), "UNSAFE_ARCHIVE", "evil.src"),
    "network_drive": (raw_zip(GOOD, Entry(b"\\\\host\\share\\evil.src")), "UNSAFE_ARCHIVE", "evil.src"),
    "drive_letter": (raw_zip(GOOD, Entry(b"C:/evil.src")), "UNSAFE_ARCHIVE", "evil.src"),
    "drive_letter_without_slash": (raw_zip(GOOD, Entry(b"C:evil.src")), "UNSAFE_ARCHIVE", "evil.src"),
    "second_stream": (raw_zip(GOOD, Entry(b"KRC/R1/a.src:evil")), "UNSAFE_ARCHIVE", "evil"),
    "zero_byte": (raw_zip(GOOD, Entry(b"KRC/evil.src\0.txt", PROGRAM)), "UNSAFE_ARCHIVE", "zero byte"),
    "name_of_two_lines": (raw_zip(GOOD, Entry(b"../a\n\x1b[2Jevil.src")), "UNSAFE_ARCHIVE", "a\\n\\x1b[2Jevil.src"),
    "no_name": (raw_zip(GOOD, Entry(b".", PROGRAM)), "UNSAFE_ARCHIVE", "no name"),
    "link": (
        raw_zip(GOOD, Entry(b"KRC/evil.src", b"/etc/passwd", attributes=(stat.S_IFLNK | 0o777) << 16)),
        "UNSAFE_ARCHIVE",
        "link",
    ),
    "twice": (raw_zip(GOOD, GOOD), "UNSAFE_ARCHIVE", "twice"),
    "twice_with_either_slash": (raw_zip(GOOD, Entry(b"KRC\\R1\\Program\\a.src", PROGRAM)), "UNSAFE_ARCHIVE", "twice"),
    "twice_through_a_dot": (raw_zip(GOOD, Entry(b"KRC/./R1/Program/a.src", PROGRAM)), "UNSAFE_ARCHIVE", "twice"),
    "other_case": (raw_zip(GOOD, Entry(b"krc/r1/program/A.SRC", PROGRAM)), "UNSAFE_ARCHIVE", "only one"),
    "dot_at_the_end": (raw_zip(GOOD, Entry(b"KRC/R1/Program/a.src.", PROGRAM)), "UNSAFE_ARCHIVE", "only one"),
    "blank_at_the_end": (raw_zip(GOOD, Entry(b"KRC/R1/Program /a.src", PROGRAM)), "UNSAFE_ARCHIVE", "only one"),
    "other_form_of_an_accent": (
        raw_zip(Entry("ü.src".encode(), PROGRAM, flags=0x800), Entry("u\u0308.src".encode(), PROGRAM, flags=0x800)),
        "UNSAFE_ARCHIVE",
        "only one",
    ),
    "file_and_folder": (raw_zip(GOOD, Entry(b"krc/r1", b"x")), "UNSAFE_ARCHIVE", "folder of"),
    "bomb": (
        raw_zip(Entry(b"a.src", size=3 * 1024**3, stored=b"\3\0", method=8)), "UNSAFE_ARCHIVE", "times its size",
    ),
    "four_gigabytes": (
        raw_zip(*(Entry(b"%d.src" % n, size=3 * 1024**3, stored=b"\3\0", method=8) for n in range(2))),
        "UNSAFE_ARCHIVE",
        "6.4 GB",
    ),
    "overlapping": (
        raw_zip(Entry(b"a.src", PROGRAM), Entry(b"b.src", PROGRAM, offset=0)), "UNSAFE_ARCHIVE", "share bytes",
    ),
    "overlapping_the_next": (
        raw_zip(Entry(b"a.src", PROGRAM, compressed=len(PROGRAM) + 40), Entry(b"b.src", PROGRAM)),
        "UNSAFE_ARCHIVE",
        "share bytes",
    ),
    "overlapping_the_directory": (
        raw_zip(Entry(b"a.src", PROGRAM, compressed=len(PROGRAM) + 40)), "UNSAFE_ARCHIVE", "directory",
    ),
    "larger_than_it_says": (
        raw_zip(Entry(b"a.src", PROGRAM, size=5, stored=deflated(PROGRAM), method=8)), "CANNOT_READ", "a.src",
    ),
    "smaller_than_it_says": (
        raw_zip(Entry(b"a.src", PROGRAM, size=len(PROGRAM) + 5, stored=deflated(PROGRAM), method=8)),
        "UNSAFE_ARCHIVE",
        "not as large",
    ),
    "encrypted": (raw_zip(GOOD, Entry(b"b.src", PROGRAM, flags=1)), "CANNOT_READ", "password"),
    "strongly_encrypted": (raw_zip(GOOD, Entry(b"b.src", PROGRAM, flags=0x41)), "CANNOT_READ", "password"),
    "unknown_compression": (raw_zip(GOOD, Entry(b"b.src", PROGRAM, method=9)), "CANNOT_READ", "b.src"),
    "damaged_bytes": (raw_zip(Entry(b"a.src", PROGRAM, stored=PROGRAM[:-2] + b"!!")), "CANNOT_READ", "a.src"),
    "damaged_stream": (
        raw_zip(Entry(b"a.src", PROGRAM, stored=b"\xff" * 40, method=8)), "CANNOT_READ", "a.src",
    ),
    "name_that_is_no_utf_8": (raw_zip(Entry(b"\xff\xfe.src", PROGRAM, flags=0x800)), "CANNOT_READ", "utf-8"),
    "directory_that_points_nowhere": (raw_zip(Entry(b"b.src", PROGRAM, offset=0)), "CANNOT_READ", "b.src"),
    "cut_off": (raw_zip(GOOD)[:-10], "NO_ROBOT", "copy it"),
    "no_zip_at_all": (b"Rar!\x1a\x07\x00" + b"x" * 100, "NO_ROBOT", "no zip archive"),
    "nothing_in_it": (raw_zip(), "NO_ROBOT", ""),
}  # fmt: skip


#: In an archive without files no file fails its check.
EVERY = [
    (trap, command)
    for trap in HOSTILE
    for command in ("inspect", "fit", "convert", "check")
    if (trap, command) != ("nothing_in_it", "check")
]


@pytest.mark.parametrize(("trap", "command"), EVERY)
def test_hostile_archive(respot, tmp_path, trap, command):
    data, code, word = HOSTILE[trap]
    (tmp_path / "evil.zip").write_bytes(data)
    (tmp_path / "theory.csv").write_text("id,x,y,z\nS1,0,0,0\nS2,9,0,0\nS3,0,9,0\nS4,0,0,9\n")
    before = sorted(tmp_path.rglob("*"))
    more = {"fit": ["--theory", "theory.csv"], "convert": ["--theory", "theory.csv", "-o", "out"]}.get(command, [])
    result = respot(command, "evil.zip", *more)
    assert result.code == 2, (result.out, result.err)
    assert result.out == ""
    assert len(result.err.strip().splitlines()) == 1, result.err
    for expected in (code, word, "evil.zip"):
        assert expected in result.err
    assert sorted(tmp_path.rglob("*")) == before


def test_a_bomb_is_refused_before_it_is_unpacked(tmp_path, monkeypatch):
    with zipfile.ZipFile(tmp_path / "bomb.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        for number in range(9):
            archive.writestr(f"{number}.src", b" " * 10_000_000)
    monkeypatch.setattr(zipfile.ZipFile, "open", lambda *_, **__: pytest.fail("unpacked"))
    with pytest.raises(BadInputError, match="times its size"):
        read_tree(tmp_path / "bomb.zip")


def test_an_honest_archive_may_shrink_well(tmp_path):
    """Generated programs and empty logs: 60 MB of blanks are no bomb."""
    with zipfile.ZipFile(tmp_path / "log.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("KRC/R1/Program/a.src", PROGRAM)
        archive.writestr("C/KRC/Roboter/Log/trace.log", b" " * 60_000_000)
    assert len(read_tree(tmp_path / "log.zip").files["C/KRC/Roboter/Log/trace.log"]) == 60_000_000


def test_too_many_entries(tmp_path, monkeypatch):
    monkeypatch.setattr(archives, "MOST_ENTRIES", 3)
    for source in (packed(tmp_path / "many.zip", krc("A")), write(tmp_path / "many", krc("A"))):
        with pytest.raises(BadInputError, match="holds 5 files"):
            read_tree(source)


def test_a_folder_larger_than_any_backup_is_not_read(tmp_path, monkeypatch):
    monkeypatch.setattr(archives, "LARGEST_BACKUP", 1000)
    folder = write(tmp_path / "large", {"a.src": " " * 1001})
    monkeypatch.setattr(Path, "read_bytes", lambda _: pytest.fail("read"))
    with pytest.raises(BadInputError, match="UNSAFE_ARCHIVE"):
        read_tree(folder)


def test_a_link_in_a_folder(respot, tmp_path):
    folder = write(tmp_path / "linked", krc("A"))
    (folder / "KRC" / "R1" / "Program" / "evil.src").symlink_to("/etc/hostname")
    result = respot("inspect", "linked")
    assert result.code == 2 and "UNSAFE_ARCHIVE" in result.err and "evil.src" in result.err


def test_a_link_to_a_folder_is_not_followed(respot, tmp_path):
    folder = write(tmp_path / "linked", krc("A"))
    (folder / "KRC" / "R1" / "round").symlink_to(folder, target_is_directory=True)
    result = respot("inspect", "linked")
    assert result.code == 2 and "is a link" in result.err


def test_a_folder_that_may_not_be_listed_is_no_empty_folder(respot, tmp_path, monkeypatch):
    closed = tmp_path / "backup" / "KRC" / "R1"
    closed.mkdir(parents=True)
    (closed / "a.src").write_text("DEF a()\nEND\n")
    listing = os.scandir

    def scandir(place="."):
        if Path(place) == closed:
            raise PermissionError(13, "Permission denied", str(place))
        return listing(place)

    monkeypatch.setattr(os, "scandir", scandir)
    result = respot("inspect", tmp_path / "backup")
    assert result.code == 2
    assert "CANNOT_READ" in result.err and str(closed) in result.err


def test_a_folder_with_two_cases_of_a_name(respot, tmp_path):
    write(tmp_path / "both", {"KRC/R1/Program/a.src": src("a"), "KRC/R1/Program/A.SRC": src("a", 5)})
    result = respot("check", "both")
    assert result.code == 2 and "only one of them" in result.err


def test_names_that_only_windows_minds_are_fine(tmp_path):
    files = {"KRC/R1/Program/aux.src": src("aux"), "KRC/R1/Program/nul.dat": "DEFDAT nul\nENDDAT\n"}
    assert set(read_tree(packed(tmp_path / "a.zip", files)).files) == set(files)


def test_folders_made_by_windows_tools_are_no_files(tmp_path):
    """Without a slash at the end but with the attribute of a folder, or with a backslash at the end."""
    entries = [Entry(b"KRC", attributes=0x10), Entry(b"KRC\\R1\\"), Entry(b"./"), GOOD]
    (tmp_path / "a.zip").write_bytes(raw_zip(*entries))
    assert read_tree(tmp_path / "a.zip").files == {"KRC/R1/Program/a.src": PROGRAM}


def test_backslashes_are_separators(respot, tmp_path):
    files = {name.replace("/", "\\"): text for name, text in krc("ST10R01").items()}
    packed(tmp_path / "a.zip", files)
    result = respot("inspect", "a.zip", "--json")
    assert [robot["name"] for robot in result.json["robots"]] == ["ST10R01"]
    assert {target["path"] for target in result.json["robots"][0]["targets"]} == {"KRC/R1/Program/weld.src"}
