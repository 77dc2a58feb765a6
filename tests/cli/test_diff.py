"""`respot diff`: what a reviewer sees on the terminal, what a script gets, and what bad input says."""

from __future__ import annotations

import re
import shutil
import zipfile
from pathlib import Path

import pytest

from tests.cli.conftest import SAMPLES
from tests.difference.made_up_krl import Module, Point, Robot

TRAPS = Path(__file__).parents[1] / "difference" / "traps"
GOLDEN = Path(__file__).parents[1] / "difference" / "golden"


def sides(trap: str) -> tuple[Path, Path]:
    return TRAPS / trap / "old", TRAPS / trap / "new"


def write(folder: Path, files: dict[str, bytes]) -> Path:
    for name, data in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    return folder


def points(count: int, by: float = 0.0) -> Robot:
    steps = [
        Point(f"P{n}", (n + by, 2.0 * n, 300.0, 0.0, 0.0, 0.0), 2, 2, 1, 1, True, 1, False) for n in range(count)
    ]  # fmt: skip
    return Robot({1: (0.0,) * 6}, {1: (0.0,) * 6}, [Module("WELD", steps)])


# what is said


@pytest.mark.parametrize(
    "trap", ["krl/speed_in_the_code", "krl/only_the_base_moved", "rapid/inline_targets", "krl/block_moved", "rapid/persistent_values"]
)  # fmt: skip
@pytest.mark.parametrize("options", [(), ("--noise", "--color", "always")], ids=["plain", "coloured"])
def test_the_terminal_shows(respot, trap, options, monkeypatch):
    monkeypatch.chdir(TRAPS / trap)
    result = respot("diff", "old", "new", *options)
    name = f"{trap.replace('/', '_')}{'_coloured' if options else ''}.txt"
    path = GOLDEN / name
    if not path.exists():  # for a person to look at
        path.parent.mkdir(exist_ok=True)
        path.write_text(result.out, encoding="utf-8", newline="\n")
        pytest.fail(f"{name} was missing and is written: look at it")
    assert result.out == path.read_text(encoding="utf-8")
    assert result.code == 1


def test_the_same_is_zero(respot, backup):
    result = respot("diff", backup, backup)
    assert (result.code, "no difference" in result.out) == (0, True)


def test_noise_alone_is_zero(respot):
    result = respot("diff", *sides("krl/edit_counter"))
    assert result.code == 0
    assert "edit counters (&REL): 4" in result.out
    assert "&REL 31" not in result.out
    assert "+&REL 31" in respot("diff", *sides("krl/edit_counter"), "--noise").out


def test_no_colour_where_nobody_looks(respot, monkeypatch):
    assert "\x1b" not in respot("diff", *sides("krl/speed_in_the_code")).out
    assert "\x1b[31m-BAS" in respot("diff", *sides("krl/speed_in_the_code"), "--color", "always").out
    assert "\x1b" not in respot("diff", *sides("krl/speed_in_the_code"), "--color", "never").out


@pytest.mark.parametrize(("value", "coloured"), [("", True), ("1", False)])
def test_no_color_of_the_environment(monkeypatch, value, coloured):
    from respot.cli import diff

    monkeypatch.setenv("NO_COLOR", value)
    monkeypatch.setattr(diff, "is_terminal", lambda: True)
    assert diff.is_coloured(diff.Colour.AUTO) is coloured
    assert diff.is_coloured(diff.Colour.ALWAYS)


def test_small_shifts_are_noise_within_the_tolerance(respot):
    old, new = sides("rapid/original_of_a_touched_up_target")  # by 1.5 mm
    assert respot("diff", old, new, "--tolerance", "1.4").code == 1
    within = respot("diff", old, new, "--tolerance", "1.6", "--json")
    assert within.code == 0
    assert within.json["robots"][0]["noise_counts"] == {"rounding": 1}
    assert respot("diff", old, new, "--tolerance", "1.6,0").code == 0


@pytest.mark.parametrize("text", ["x", "-1", "1,2,3", "nan", "1,-2", ""])
def test_a_tolerance_that_is_none(respot, text):
    result = respot("diff", *sides("krl/edit_counter"), f"--tolerance={text}")
    assert result.code == 2
    assert "--tolerance is MM or MM,DEG" in result.err


def test_the_record(respot):
    found = respot("diff", *sides("krl/another_base_number"), "--json").json
    assert found["schema"] == "respot.diff/1"
    (robot,) = found["robots"]
    (item,) = robot["moved"]
    assert set(item["shift"]) == {"dx", "dy", "dz", "distance"}
    assert (item["target"], item["program"], item["turn_deg"]) == ("XP3", "weld", 0.0)
    assert (item["old_base"], item["base"], item["tool"]) == ("BASE_DATA[1]", "BASE_DATA[2]", "TOOL_DATA[1]")
    assert {"path", "kind", "old_lines", "new_lines"} <= set(robot["code"][0])
    assert {"moved", "frames", "added", "removed", "renamed", "code", "noise"} <= set(robot)


@pytest.mark.parametrize("width", [40, 60, 80, 120, 200])
def test_no_number_is_cut_on_a_narrow_terminal(respot, monkeypatch, width):
    """A target whose base alone moved is told by its way in the world: that column always stays."""
    from respot.cli import display, show_diff

    for module in (display, show_diff):
        monkeypatch.setattr(module, "terminal_width", lambda: width)
    monkeypatch.setattr(display, "is_terminal", lambda: True)
    monkeypatch.setenv("COLUMNS", str(width))
    out = respot("diff", *sides("krl/another_base_number")).out
    assert "…" not in out
    assert "714.143" in out
    assert "BASE_DATA[1] -> BASE_DATA[2]" in " ".join(out.split())
    assert ("too wide for this terminal" in out) == (width < 200)
    assert all(len(text) <= width for text in out.partition("\ncode")[0].splitlines())


def test_what_the_program_writes_is_said_to_be_doubtful(respot, tmp_path):
    old, new = sides("krl/handed_to_a_routine_that_is_not_there")
    respot("diff", old, new, "--html", tmp_path / "page.html")
    for text in (respot("diff", old, new).out, (tmp_path / "page.html").read_text(encoding="utf-8")):
        assert "nobody can tell whether someone edited them too" in text


def test_a_target_that_the_program_writes_is_warned_of(respot):
    result = respot("diff", *sides("rapid/part_that_the_program_does_not_write"), "--json")
    (issue,) = [issue for issue in result.json["issues"] if issue["code"] == "RUN_TIME_FRAME"]
    assert (issue["level"], issue["line"]) == ("warning", 14)
    assert "target pB differs by 10.000 mm" in issue["message"]


# pairing


def test_a_zip_against_the_folder_it_became(respot, tmp_path, backup):
    with zipfile.ZipFile(tmp_path / "b.zip", "w") as archive:
        for path in backup.rglob("*"):
            if path.is_file():
                archive.write(path, path.relative_to(backup).as_posix())
    assert respot("diff", tmp_path / "b.zip", backup).code == 0


def test_a_folder_more_or_less_moves_no_file(respot, tmp_path):
    shutil.copytree(SAMPLES / "kuka" / "KRC", tmp_path / "old" / "KRC")
    result = respot("diff", tmp_path / "old", tmp_path / "old" / "KRC", "--json")
    assert (result.code, result.json["robots"][0]["files"]) == (0, [])
    shutil.copytree(tmp_path / "old", tmp_path / "new")
    program = tmp_path / "new" / "KRC" / "R1" / "Program"
    (program / "below").mkdir()
    (program / "rear_door_o.src").rename(program / "below" / "rear_door_o.src")
    (robot,) = respot("diff", tmp_path / "old", tmp_path / "new", "--json").json["robots"]
    assert [item["change"] for item in robot["files"]] == ["moved"]


def test_a_converted_backup_differs_in_its_targets_alone(respot, tmp_path, backup, theory):
    assert respot("convert", backup, "--theory", theory, "-o", tmp_path / "out").code == 0
    (robot,) = respot("diff", backup, tmp_path / "out", "--json").json["robots"]
    assert len(robot["moved"]) >= 28
    assert not [name for name in ("frames", "added", "removed", "renamed", "code", "files") if robot[name]]
    assert set(robot["noise_counts"]) == {"respot"}


def test_robots_of_a_tree_are_paired_by_name(respot, tmp_path):
    for side, names in (("old", ("a", "b")), ("new", ("x", "y"))):
        for name, source in zip(names, ("kuka", "abb"), strict=True):
            shutil.copytree(SAMPLES / source, tmp_path / side / name)
    result = respot("diff", tmp_path / "old", tmp_path / "new", "--json")
    assert result.code == 0
    assert sorted(robot["name"] for robot in result.json["robots"]) == ["ST140R01", "ST140R02"]
    one = respot("diff", tmp_path / "old", tmp_path / "new", "--robot-name", "st140r02", "--json").json
    assert [robot["name"] for robot in one["robots"]] == ["ST140R02"]


def test_a_robot_that_only_one_side_has(respot, tmp_path):
    for side, sources in (("old", ("kuka",)), ("new", ("kuka", "abb"))):
        for source in sources:
            shutil.copytree(SAMPLES / source, tmp_path / side / source)
    result = respot("diff", tmp_path / "old", tmp_path / "new")
    assert result.code == 1
    assert "ST140R02: only in the new source" in result.out
    assert "1 of 2 robots without a difference" in result.out


def test_programs_may_have_any_name(respot, tmp_path):
    old, new = sides("krl/only_the_base_moved")
    for side, name in ((old, "before"), (new, "after")):
        for suffix in ("src", "dat"):
            shutil.copy(side / f"KRC/R1/Program/weld.{suffix}", tmp_path / f"{name}.{suffix}")
    assert respot("diff", tmp_path / "before.src", tmp_path / "after.src").code == 0


# bad input


def test_two_languages(respot):
    result = respot("diff", SAMPLES / "kuka", SAMPLES / "abb")
    assert result.code == 2
    assert "DIFFERENT_ROBOTS" in result.err and "translate" in result.err


def test_one_side_without_a_robot(respot, tmp_path):
    (tmp_path / "empty").mkdir()
    for arguments in ((SAMPLES / "kuka", tmp_path / "empty"), (tmp_path / "empty", SAMPLES / "kuka")):
        result = respot("diff", *arguments)
        assert result.code == 2
        assert "NO_ROBOT" in result.err


def test_a_side_that_is_not_there(respot, tmp_path):
    result = respot("diff", tmp_path / "nothing", SAMPLES / "kuka")
    assert (result.code, "CANNOT_READ" in result.err) == (2, True)


def test_a_table(respot):
    result = respot("diff", SAMPLES / "actual.csv", SAMPLES / "theory.csv")
    assert (result.code, "NO_ROBOT" in result.err) == (2, True)


def test_different_robots_are_compared_with_a_warning(respot, tmp_path):
    shutil.copytree(SAMPLES / "kuka", tmp_path / "other")
    ini = tmp_path / "other" / "am.ini"
    text = ini.read_bytes()
    assert b"IRSerialNr=" in text
    ini.write_bytes(re.sub(rb"IRSerialNr=\d+", b"IRSerialNr=999999", text))
    result = respot("diff", SAMPLES / "kuka", tmp_path / "other", "--json")
    assert "OTHER_ROBOT_COMPARED" in {issue["code"] for issue in result.json["issues"]}


def test_several_robots_without_a_common_one(respot, tmp_path):
    for side, names in (("old", "ab"), ("new", "cd")):
        for name in names:
            write(tmp_path / side / name, points(2).files())
    result = respot("diff", tmp_path / "old", tmp_path / "new")
    assert result.code == 2
    assert "no robot is on both sides" in result.err


@pytest.mark.parametrize("option", ["--noise", "--all", "--json"])
def test_no_order_of_a_program_reaches_the_terminal(respot, option):
    result = respot("diff", *sides("rapid/names_with_control_characters"), option, "--color", "never")
    assert "red" in result.out
    assert not re.search(r"[\x00-\x09\x0b-\x1f\x7f-\x9f]", result.out)
    assert r"\u001b[31m" in result.out


def test_nothing_is_dropped_silently(respot, tmp_path):
    old, new = write(tmp_path / "old", points(10_000).files()), write(tmp_path / "new", points(10_000, 0.5).files())
    result = respot("diff", old, new)
    assert result.code == 1
    assert "10000 targets moved" in result.out
    assert "... and 9975 more shifts; --all shows them, --json has them too" in result.out
    assert len(result.out.splitlines()) < 60
    assert len(respot("diff", old, new, "--json").json["robots"][0]["moved"]) == 10_000
    assert "XP9999" in respot("diff", old, new, "--all").out


# the page


def test_the_page_stands_alone_and_escapes(respot, tmp_path):
    evil = "<script>alert(1)</script>"
    files = points(3).files()
    path = "KRC/R1/Program/weld.src"
    old = write(tmp_path / "old", {**files, path: files[path].replace(b"END", b'MSG("a")\r\nEND')})
    new = write(tmp_path / "new", {**files, path: files[path].replace(b"END", f'MSG("{evil}")\r\nEND'.encode())})
    assert respot("diff", old, new, "--html", tmp_path / "page.html").code == 1
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert evil not in page and "&lt;script&gt;" in page
    assert not re.search(r'(?:src|href)="(?!#)', page)
    assert "http" not in page.replace("http-equiv", "")
    assert respot("diff", old, new, "--html", tmp_path / "page.html").code == 2
    assert respot("diff", old, new, "--html", tmp_path / "page.html", "--force").code == 1
    assert respot("diff", old, new, "--html", tmp_path / "old" / "page.html").code == 2


def test_the_page_may_lie_beside_the_program_but_not_on_its_data_list(respot, tmp_path):
    folder = sides("krl/point_renamed")[0] / "KRC/R1/Program"
    for suffix in ("src", "dat"):
        shutil.copy(folder / f"weld.{suffix}", tmp_path / f"weld.{suffix}")
    arguments = ("diff", tmp_path / "weld.src", tmp_path / "weld.src", "--html")
    assert respot(*arguments, tmp_path / "weld.html").code == 0
    assert respot(*arguments, tmp_path / "weld.dat", "--force").code == 2


@pytest.mark.parametrize(
    "trap", ["krl/only_the_base_moved", "rapid/persistent_values", "krl/point_renamed", "krl/block_moved"]
)
def test_the_page_says_what_the_terminal_says(respot, tmp_path, trap):
    respot("diff", *sides(trap), "--html", tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "There are differences" in page
    for item in respot("diff", *sides(trap), "--json").json["robots"][0]["moved"]:
        assert item["target"] in page
