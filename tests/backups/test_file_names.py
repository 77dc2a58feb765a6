"""Names in archives: code pages that are not said, the Unicode Path field, and that they are stable."""

from __future__ import annotations

import zipfile

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from respot.archives import read_tree
from tests.backups.raw_zip import Entry, raw_zip, unicode_path
from tests.backups.trees import src

PROGRAM = src("a").encode()


def read(tmp_path, *entries):
    path = tmp_path / "a.zip"
    path.write_bytes(raw_zip(*entries))
    return read_tree(path)


@pytest.mark.parametrize(
    ("raw", "name", "page"),
    [
        (b"\x94l.src", "öl.src", "cp437"),  # ä ö ü ß have one place in cp437 and cp850
        (b"Stra\xe1e.src", "Straße.src", "cp437"),
        (b"\xb5ngel.src", "Ángel.src", "cp850"),  # a corner of a box in cp437
        (b"\xd2tape.src", "Êtape.src", "cp850"),
        (b"\xe0.src", "α.src", "cp437"),  # letters in both: the standard decides
        ("Schweißpunkt_ü.src".encode(), "Schweißpunkt_ü.src", "utf-8"),  # macOS does not say so
    ],
)
def test_code_pages(tmp_path, raw, name, page):
    tree = read(tmp_path, Entry(b"KRC/R1/Program/" + raw, PROGRAM))
    assert list(tree.files) == [f"KRC/R1/Program/{name}"]
    (issue,) = tree.issues
    assert issue.code == "FILE_NAMES" and f"as {page}" in issue.message and name in issue.message
    assert name.encode(page) == raw


def test_one_page_for_a_whole_archive(tmp_path):
    """`\\xe0` alone is a letter in both; beside a name that only cp850 makes sense of it is read as cp850 too."""
    tree = read(tmp_path, Entry(b"\xe0.src", PROGRAM), Entry(b"\xb5.src", PROGRAM))
    assert list(tree.files) == ["Ó.src", "Á.src"]


def test_names_that_say_that_they_are_utf_8(tmp_path):
    tree = read(tmp_path, Entry("Ölwanne.src".encode(), PROGRAM, flags=0x800))
    assert list(tree.files) == ["Ölwanne.src"] and tree.issues == []


def test_unicode_path_field(tmp_path):
    raw = b"Kr_mmer.src"
    tree = read(tmp_path, Entry(raw, PROGRAM, extra=unicode_path(raw, "Krümmer.src")))
    assert list(tree.files) == ["Krümmer.src"]


def test_unicode_path_field_of_another_name_does_not_count(tmp_path):
    """A tool renamed the entry and left the field: its checksum tells."""
    tree = read(tmp_path, Entry(b"new.src", PROGRAM, extra=unicode_path(b"old.src", "old.src")))
    assert list(tree.files) == ["new.src"]


def test_unicode_path_field_leads_nowhere_else(respot, tmp_path):
    raw = b"a.src"
    (tmp_path / "a.zip").write_bytes(raw_zip(Entry(raw, PROGRAM, extra=unicode_path(raw, "../evil.src"))))
    result = respot("inspect", "a.zip")
    assert result.code == 2 and "evil.src" in result.err


NAME = st.text(
    st.characters(codec="utf-8", exclude_characters="\0/\\:", exclude_categories=("Cs",)), min_size=1, max_size=8
)
PATHS = st.lists(st.lists(NAME, min_size=1, max_size=4).map("/".join), max_size=8)


def clash(names) -> bool:
    """Whether a system might take two of the names for one, or a part for something else. Written for the test."""
    import unicodedata

    keys = ["/".join(p.rstrip(". ") for p in unicodedata.normalize("NFC", name).lower().split("/")) for name in names]
    folders = {key.rsplit("/", n)[0] for key in keys for n in range(1, key.count("/") + 1)}
    odd = any(not part.strip(". ") for name in names for part in name.split("/"))
    return odd or len(set(keys)) < len(keys) or bool(folders & set(keys))


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.filter_too_much], deadline=None)
@given(paths=PATHS, data=st.data(), packing=st.sampled_from([zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED]))
def test_what_is_packed_is_read(tmp_path, paths, data, packing):
    files = {path: data.draw(st.binary(max_size=40)) for path in paths}
    if clash(files):
        return
    with zipfile.ZipFile(tmp_path / "law.zip", "w", packing) as archive:
        for path, content in files.items():
            archive.writestr(zipfile.ZipInfo(path), content)
    assert read_tree(tmp_path / "law.zip").files == files


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(
    raw=st.lists(st.binary(min_size=1, max_size=6).filter(lambda name: not set(name) & set(b"\0/\\:. ")), max_size=6)
)
def test_a_name_goes_back_to_its_bytes(tmp_path, raw):
    """Whatever bytes: the page that the issue names gives them again, and none becomes another one."""
    tree_path = tmp_path / "bytes.zip"
    names = sorted({b"%d_" % n + name for n, name in enumerate(raw)})
    tree_path.write_bytes(raw_zip(*(Entry(name, b"") for name in names)))
    tree = read_tree(tree_path)
    pages = [
        issue.message.rsplit("read as ", 1)[1].split(",")[0] for issue in tree.issues if issue.code == "FILE_NAMES"
    ]
    assert len(tree.files) == len(names)
    assert sorted(name.encode(pages[0] if pages else "ascii") for name in tree.files) == names
