"""`respot migrate` from the outside: what is done, what is done again, what fails and takes nobody along."""

from __future__ import annotations

import json
import os
import re
import shutil
import sqlite3
import zipfile
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

from respot import __version__
from respot.cli import app
from respot.issues import BadInputError
from respot.line import folder as folders
from respot.line.jobs import job_of
from respot.line.ledger import Ledger, Lock
from respot.line.line_file import read_line
from respot.line.run import Workers, run_line
from respot.line.work import do_job
from tests.line.lines import contents, make_line

SAMPLES = Path(__file__).parents[2] / "samples" / "rear_door"
ROBOTS = 10


def migrate(*arguments: object, code: int = 0):
    """Run in this process: no time goes into starting others."""
    result = CliRunner().invoke(app, ["migrate", *(str(item) for item in arguments), "-j", "0", "--json"])
    assert result.exit_code == code, result.stderr
    return json.loads(result.stdout) if code < 2 else result.stderr


def states(record: dict) -> dict[str, str]:
    return {robot["name"]: robot["state"] for robot in record["robots"]}


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    return make_line(tmp_path_factory.mktemp("made"), ROBOTS)


@pytest.fixture
def line(made, tmp_path) -> Path:
    shutil.copytree(made.parent, tmp_path / "line")
    return tmp_path / "line" / "line.toml"


@pytest.fixture
def doors(tmp_path) -> Path:
    """Write a line of two robots that are quickly done."""
    for maker in ("kuka", "abb"):
        shutil.copytree(SAMPLES / maker, tmp_path / "doors" / maker)
    shutil.copy(SAMPLES / "theory.csv", tmp_path / "doors" / "theory.csv")
    text = (
        '[line]\nname = "doors"\ntheory = "theory.csv"\n[[robot]]\nname = "K"\nsource = "kuka"\n'
        '[[robot]]\nname = "A"\nsource = "abb"\n'
    )
    path = tmp_path / "doors" / "line.toml"
    path.write_text(text)
    return path


def test_every_robot_is_done_or_says_why_not(line, tmp_path):
    out = tmp_path / "out"
    record = migrate(line, "-o", out, code=1)
    truth = {robot["robot"]: robot for robot in json.loads((line.parent / "truth.json").read_text())["robots"]}
    for robot in record["robots"]:
        trouble = truth[robot["name"]]["trouble"]
        expected = {"": None, "cut short": "NO_ROBOT", "no programs": "NO_ROBOT", "wrong reference": "NOT_CONGRUENT"}
        assert (robot["error"] or {}).get("code") == expected[trouble]
        assert robot["state"] == ("failed" if trouble else "done")
        assert (out / "robots" / robot["name"]).is_dir() == (not trouble)
        if robot["programs"]:
            saved = json.loads((out / robot["programs"] / "respot.json").read_bytes())
            assert len(saved["edits"]) == robot["edits"]
            assert saved["verified"]
            assert str(line.parent) not in json.dumps(saved)  # paths are as the line file has them
    assert record["totals"]["done"] == ROBOTS - 3
    assert {robot["kind"] for robot in record["robots"] if robot["state"] == "done"} == {"theory", "measured"}
    page = (out / "index.html").read_text()
    assert all(robot["name"] in page for robot in record["robots"])
    assert (out / "line.csv").read_text().count("\n") == ROBOTS + 1
    assert not (out / ".work").exists()


def test_what_is_done_is_what_convert_does(doors, tmp_path, monkeypatch):
    migrate(doors, "-o", tmp_path / "out")
    monkeypatch.chdir(doors.parent)
    for name, source in (("K", "kuka"), ("A", "abb")):
        arguments = ["convert", source, "--theory", "theory.csv", "-o", str(tmp_path / "alone" / name)]
        assert CliRunner().invoke(app, arguments).exit_code == 0
        assert contents(tmp_path / "alone" / name) == contents(tmp_path / "out" / "robots" / name / "programs")


def test_a_second_run_does_what_is_missing_or_changed_and_no_more(doors, tmp_path):
    out = tmp_path / "out"
    assert states(migrate(doors, "-o", out)) == {"K": "done", "A": "done"}
    before = contents(out)
    assert states(migrate(doors, "-o", out)) == {"K": "skipped", "A": "skipped"}
    assert contents(out) == before
    (out / "robots" / "K" / "programs" / "KRC" / "R1" / "cell.src").write_text("touched")
    assert states(migrate(doors, "-o", out)) == {"K": "done", "A": "skipped"}
    assert contents(out) == before
    shutil.rmtree(out / "robots" / "A")
    assert states(migrate(doors, "-o", out)) == {"K": "skipped", "A": "done"}
    (doors.parent / "abb" / "note.txt").write_text("another input")
    assert states(migrate(doors, "-o", out)) == {"K": "skipped", "A": "done"}
    assert (out / "robots" / "A" / "programs" / "note.txt").is_file()
    doors.write_text(doors.read_text() + "seed = 5\n")
    assert states(migrate(doors, "-o", out)) == {"K": "skipped", "A": "done"}
    with (doors.parent / "theory.csv").open("a") as table:
        table.write("NOWHERE,1,2,3\n")
    assert states(migrate(doors, "-o", out)) == {"K": "done", "A": "done"}


def test_what_failed_is_tried_again_when_asked_or_when_its_inputs_change(doors, tmp_path):
    out, backup = tmp_path / "out", doors.parent / "kuka"
    backup.rename(doors.parent / "away")
    assert migrate(doors, "-o", out, code=1)["robots"][0]["error"]["code"] == "CANNOT_READ"
    with closing(sqlite3.connect(out / "ledger.sqlite")) as ledger:
        tried = "SELECT attempts FROM jobs WHERE robot = 'K'"
        assert ledger.execute(tried).fetchone() == (1,)
        migrate(doors, "-o", out, code=1)
        assert ledger.execute(tried).fetchone() == (1,)
        migrate(doors, "-o", out, "--retry", code=1)
        assert ledger.execute(tried).fetchone() == (2,)
        (doors.parent / "away").rename(backup)
        assert states(migrate(doors, "-o", out)) == {"K": "done", "A": "skipped"}


def test_a_robot_that_fails_now_leaves_no_old_programs_behind(doors, tmp_path):
    migrate(doors, "-o", tmp_path / "out")
    (doors.parent / "theory.csv").write_text("id,x,y,z\n")
    migrate(doors, "-o", tmp_path / "out", code=1)
    assert not list((tmp_path / "out" / "robots").iterdir())


def test_a_robot_with_a_calibration_is_converted_without_a_fit(doors, tmp_path, monkeypatch):
    monkeypatch.chdir(doors.parent)
    fitted = CliRunner().invoke(app, ["fit", "kuka", "--theory", "theory.csv", "-o", "cal.json", "--effects", "none"])
    assert fitted.exit_code == 0, fitted.stderr
    doors.write_text(doors.read_text().replace('source = "kuka"', 'source = "kuka"\ncalibration = "cal.json"'))
    robot, _ = migrate(doors, "-o", tmp_path / "out")["robots"]
    assert (robot["state"], robot["spots"], robot["page"]) == ("done", None, None)
    assert robot["edits"] > 10
    assert not (tmp_path / "out" / "robots" / "K" / "fit.html").exists()


def test_options_of_a_robot_are_obeyed(doors, tmp_path):
    text = doors.read_text().replace('source = "kuka"', 'source = "kuka"\nmax-shift = 2.0')
    doors.write_text(text.replace('source = "abb"', 'source = "abb"\nholdout = 0.2\nseed = 4'))
    first, second = migrate(doors, "-o", tmp_path / "out", code=1)["robots"]
    assert first["refused"] == ["rear_door_o: SHIFT_TOO_LARGE", "rear_door_u: SHIFT_TOO_LARGE"]
    assert (first["state"], first["edits"]) == ("done", 0)
    assert second["spots"] == 11


def test_a_robot_that_left_the_line_is_told_and_its_folder_stays(doors, tmp_path):
    migrate(doors, "-o", tmp_path / "out")
    text = doors.read_text()
    doors.write_text(text[: text.rindex("[[robot]]")])
    record = migrate(doors, "-o", tmp_path / "out")
    assert states(record) == {"K": "skipped"}
    assert [issue["code"] for issue in record["issues"]] == ["ROBOT_LEFT_LINE"]
    assert (tmp_path / "out" / "robots" / "A").is_dir()


def test_where_nobody_looks_each_robot_is_a_plain_line_with_the_pace(doors, tmp_path):
    done = CliRunner().invoke(app, ["migrate", str(doors), "-o", str(tmp_path / "out"), "-j", "0"])
    assert done.exit_code == 0
    lines = done.stderr.splitlines()
    for number, name in enumerate("KA"):
        said = rf"\[{number + 1}/2\] {name} done, 14 spots, 14\.4\d\d -> 5\.1\d\d mm, swapped_ids; "
        assert re.match(said, lines[number])
    assert all("robots a minute" in line and "left" in line for line in lines[:2])
    assert "2 of 2 robots done." in done.stdout


def test_a_dry_run_writes_nothing(doors, tmp_path):
    record = migrate(doors, "--dry-run", "-o", tmp_path / "out")
    assert states(record) == {"K": "dry-run", "A": "dry-run"}
    assert all(robot["edits"] > 0 for robot in record["robots"])
    assert not (tmp_path / "out").exists()


def test_status_tells_how_the_line_stands(doors, tmp_path):
    assert "holds no ledger" in migrate(doors, "--status", "-o", tmp_path / "out", code=2)
    migrate(doors, "-o", tmp_path / "out")
    record = migrate(doors, "--status", "-o", tmp_path / "out")
    assert (states(record), record["running"]) == ({"K": "done", "A": "done"}, None)
    assert all(robot["seconds"] > 0 and robot["attempts"] == 1 for robot in record["robots"])


def test_status_while_it_runs_and_a_second_run_on_the_folder(doors, tmp_path):
    out, seen = tmp_path / "out", []

    def watch(event):
        seen.append(migrate(doors, "--status", "-o", out))
        seen.append(migrate(doors, "-o", out, code=2))

    run_line(read_line(doors), out, Workers(0), retry=False, watch=watch)
    record, refusal = seen[:2]
    assert states(record) == {"K": "done", "A": "waiting"}
    assert record["running"].startswith("process ")
    assert f"IN_USE process {os.getpid()} on " in " ".join(refusal.split(": "))
    assert "started 20" in refusal
    assert states(migrate(doors, "--status", "-o", out))["A"] == "done"


def test_a_folder_of_another_line(doors, tmp_path):
    migrate(doors, "-o", tmp_path / "out")
    before = contents(tmp_path / "out")
    doors.write_text(doors.read_text().replace('"doors"', '"other doors"'))
    for more in ((), ("--status",)):
        error = migrate(doors, "-o", tmp_path / "out", *more, code=2)
        assert "ANOTHER_LINE" in error
        assert "'doors'" in error
    assert contents(tmp_path / "out") == before


@pytest.mark.parametrize(("version", "said"), [(0, "older respot"), (99, "newer respot")])
def test_a_ledger_of_another_version_is_refused_with_words(doors, tmp_path, version, said):
    migrate(doors, "-o", tmp_path / "out")
    with closing(sqlite3.connect(tmp_path / "out" / "ledger.sqlite")) as ledger:
        ledger.execute(f"PRAGMA user_version={version}")
    error = migrate(doors, "-o", tmp_path / "out", code=2)
    assert "BAD_LEDGER" in error
    assert said in error


@pytest.mark.parametrize("data", [b"no database" * 100, None])
def test_a_file_that_is_no_ledger(doors, tmp_path, data):
    out = tmp_path / "out"
    out.mkdir()
    if data is not None:
        (out / "ledger.sqlite").write_bytes(data)
    else:
        with closing(sqlite3.connect(out / "ledger.sqlite")) as other:
            other.execute("CREATE TABLE customers (name TEXT)")
    assert "BAD_LEDGER" in migrate(doors, "-o", out, code=2)


def test_a_folder_that_no_line_wrote_or_that_is_read(doors, tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "mine.txt").write_text("mine")
    assert "OUTPUT_EXISTS" in migrate(doors, "-o", tmp_path / "out", code=2)
    for place in (doors.parent / "kuka", doors.parent / "kuka" / "out", doors.parent):
        assert "OUTPUT_EXISTS" in migrate(doors, "-o", place, code=2)
    assert "-o OUTDIR" in migrate(doors, code=2)
    assert "--scheduler" in migrate(doors, "-o", tmp_path / "x", "--ship", code=2)


def test_a_full_disk_fails_that_robot_and_no_other(doors, tmp_path, monkeypatch):
    real = folders.OutputFolder.put

    def full(self, name, made):
        if name == "K":
            raise OSError(28, "No space left on device")
        real(self, name, made)

    monkeypatch.setattr(folders.OutputFolder, "put", full)
    record = migrate(doors, "-o", tmp_path / "out", code=1)
    assert states(record) == {"K": "failed", "A": "done"}
    assert "No space left on device" in record["robots"][0]["error"]["message"]
    monkeypatch.undo()
    assert states(migrate(doors, "-o", tmp_path / "out", "--retry")) == {"K": "done", "A": "skipped"}


def test_a_full_disk_under_the_ledger_stops_the_line_and_keeps_what_is_done(doors, tmp_path, monkeypatch):
    real = Ledger.finish

    def finish(self, result, seconds):
        if result.name == "A":  # SQLite itself says that it is full
            (pages,) = self._db.execute("PRAGMA page_count").fetchone()
            self._db.execute(f"PRAGMA max_page_count={pages}")
            result = replace(result, details="long" * 100_000)
        real(self, result, seconds)

    out = tmp_path / "out"
    monkeypatch.setattr(Ledger, "finish", finish)
    error = migrate(doors, "-o", out, code=2)
    assert "LEDGER_STOPPED" in error
    assert "full" in error
    assert "what is done is kept" in error
    monkeypatch.undo()
    assert states(migrate(doors, "-o", out)) == {"K": "skipped", "A": "done"}


def test_a_folder_with_the_lock_of_a_run_that_ended_at_once(doors, tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / ".lock").touch()
    assert states(migrate(doors, "-o", tmp_path / "out")) == {"K": "done", "A": "done"}


def test_what_was_running_when_its_process_was_killed_is_waiting(doors, tmp_path, monkeypatch):
    monkeypatch.setattr(Ledger, "finish", lambda self, result, seconds: None)
    migrate(doors, "-o", tmp_path / "out")
    assert states(migrate(doors, "--status", "-o", tmp_path / "out")) == {"K": "waiting", "A": "waiting"}


def test_the_lock_goes_with_its_holder(tmp_path):
    first, second = Lock(tmp_path), Lock(tmp_path)
    assert first.take()
    assert not second.take()
    first.release()
    assert second.take()
    second.release()


def test_a_backup_that_changes_while_it_is_read(doors, tmp_path, monkeypatch):
    from respot.line import work

    real = work.convert

    def meanwhile(source, *arguments):
        if source == Path("kuka"):
            (doors.parent / "kuka" / "late.txt").write_text("somebody copies")
        return real(source, *arguments)

    monkeypatch.setattr(work, "convert", meanwhile)
    record = migrate(doors, "-o", tmp_path / "out", code=1)
    assert record["robots"][0]["error"]["code"] == "SOURCE_CHANGED"
    assert states(record)["A"] == "done"


def test_a_fault_of_ours_fails_that_robot_and_keeps_its_traceback(doors, tmp_path, monkeypatch):
    from respot.line import work

    real = work.convert

    def broken(source, *arguments):
        if source == Path("kuka"):
            raise ZeroDivisionError("a fault")
        return real(source, *arguments)

    monkeypatch.setattr(work, "convert", broken)
    record = migrate(doors, "-o", tmp_path / "out", code=1)
    assert record["robots"][0]["error"] == {
        "code": "INTERNAL_FAULT",
        "message": "ZeroDivisionError: a fault; please report it",
    }
    with closing(sqlite3.connect(tmp_path / "out" / "ledger.sqlite")) as ledger:
        assert "Traceback" in ledger.execute("SELECT details FROM jobs WHERE robot = 'K'").fetchone()[0]


def test_a_figure_that_is_no_number_fails_its_robot_and_not_the_summary(doors, tmp_path, monkeypatch):
    from respot.line import work

    real = work.fit_figures
    monkeypatch.setattr(work, "fit_figures", lambda record: {**real(record), "after": float("nan")})
    record = migrate(doors, "-o", tmp_path / "out", code=1)
    assert [robot["error"]["code"] for robot in record["robots"]] == ["INTERNAL_FAULT"] * 2
    assert (tmp_path / "out" / "line.json").is_file()


def test_the_json_has_what_scripts_rely_on(doors, tmp_path):
    record = migrate(doors, "-o", tmp_path / "out")
    assert (record["schema"], record["version"], record["issues"]) == ("respot.migrate/1", __version__, [])
    promised = {"name", "state", "seconds", "spots", "before", "after", "effects", "edits", "refused", "error"}
    assert all(promised <= set(robot) for robot in record["robots"])
    assert record["totals"]["robots"] == 2


def test_a_zip_is_read_like_a_folder(doors, tmp_path):
    with zipfile.ZipFile(doors.parent / "kuka.zip", "w") as archive:
        for path in sorted((doors.parent / "kuka").rglob("*")):
            archive.write(path, path.relative_to(doors.parent / "kuka"))
    shutil.rmtree(doors.parent / "kuka")
    doors.write_text(doors.read_text().replace('"kuka"', '"kuka.zip"'))
    assert states(migrate(doors, "-o", tmp_path / "out")) == {"K": "done", "A": "done"}


def test_the_ledger_holds_fits_edits_and_outputs(doors, tmp_path):
    record = migrate(doors, "-o", tmp_path / "out")
    with closing(sqlite3.connect(tmp_path / "out" / "ledger.sqlite")) as ledger:
        for robot in record["robots"]:
            name = (robot["name"],)
            spots, after = ledger.execute("SELECT spots, after_rms FROM fits WHERE robot = ?", name).fetchone()
            assert (spots, after) == (robot["spots"], robot["after"])
            assert ledger.execute("SELECT count(*) FROM edits WHERE robot = ?", name).fetchone() == (robot["edits"],)
            outputs = {path for (path,) in ledger.execute("SELECT path FROM outputs WHERE robot = ?", name)}
            assert outputs == set(contents(tmp_path / "out" / "robots" / robot["name"]))


def test_errors_of_one_robot_carry_its_own_words(tmp_path, doors):
    doors.write_text(doors.read_text().replace('source = "abb"', 'source = "abb"\ntheory = "none.csv"'))
    record = migrate(doors, "-o", tmp_path / "out", code=1)
    error = record["robots"][1]["error"]
    assert error["code"] == "CANNOT_READ"
    assert error["message"].startswith("none.csv: ")


def test_a_ledger_that_is_not_there_cannot_be_looked_at(tmp_path):
    with pytest.raises(BadInputError, match="BAD_LEDGER"):
        Ledger(tmp_path, readonly=True)


def test_a_robot_that_is_done_twice_is_done(tmp_path):
    """Of a worker that was lost nobody knows how far it came: the next one must not find its folder taken."""
    line = read_line(make_line(tmp_path / "line", 8))
    job = job_of(line, line.robots[0])
    staging = tmp_path / "staging" / job.name
    staging.parent.mkdir()
    results = [do_job(job, str(staging)) for _ in range(2)]
    assert [result.state for result in results] == ["done", "done"], results[1].error
    assert results[0].outputs == results[1].outputs
    assert sorted(path.name for path in staging.parent.iterdir()) == sorted(result.made for result in results)
