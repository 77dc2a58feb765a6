"""A run that is killed at any moment leaves the old state or the new one, and is not in the way of the next."""

from __future__ import annotations

import random
import shutil
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from typer.testing import CliRunner

from respot.cli import app
from respot.output import workplace as places
from tests.output.runs import Ended, Runner, State, state

#: Kills of a command: half of them at named steps, half at times that are drawn.
KILLS = 60


def steps_of(whole: Ended, count: int) -> Iterator[dict]:
    """Steps to kill at, before and after: the first and the last of each kind, and others spread over the run."""
    numbers = {whole.steps.index(name) + 1 for name in whole.steps}
    numbers |= {len(whole.steps) - whole.steps[::-1].index(name) for name in whole.steps}
    spread = [1 + round(number * (len(whole.steps) - 1) / (2 * count)) for number in range(2 * count)]
    chosen = sorted(numbers) + [number for number in dict.fromkeys(spread) if number not in numbers]
    for number, step in enumerate(sorted(chosen[:count])):
        yield {"step": step, "moment": ("before", "after")[number % 2]}


def workplace(folder: Path) -> Path:
    return folder.parent / f".{folder.name}.respot"


def killed_at_all(
    respot: Runner,
    arguments: tuple[object, ...],
    start: Callable[[], None],
    check: Callable[[Ended], None],
    target: Path,
    kills: int = KILLS,
) -> None:
    """Kill a command at half as many steps, and as often at times over all of it and over its writing."""
    start()
    whole = respot(*arguments)
    assert whole.code == 0, whole.err
    seen: Counter[str] = Counter()

    def look(ended: Ended) -> None:
        seen["killed"] += ended.killed
        seen["writing"] += ended.killed and workplace(target).exists()
        check(ended)

    for kill in steps_of(whole, kills // 2):
        start()
        shutil.rmtree(workplace(target), ignore_errors=True)  # the steps are those of a clean start
        ended = respot(*arguments, kill=kill)
        assert ended.killed, f"{kill}: {ended.err}"
        look(ended)
    assert seen["killed"] == kills // 2
    draw = random.Random(1)
    longest = {"start": whole.seconds, "begin": whole.seconds - whole.begun}
    while seen["killed"] < kills:
        since = ("start", "begin")[seen["killed"] % 3 > 0]
        seconds = draw.uniform(0.0, longest[since])
        start()  # what the last kill left is not cleaned away: the run has to cope with it
        ended = respot(*arguments, kill={"after": {"since": since, "seconds": seconds}})
        if not ended.killed:  # it was faster this time
            assert ended.code == 0, ended.err
            longest[since] = seconds
        look(ended)
    assert seen["writing"] >= 0.5 * kills, seen  # a kill beside the writing shows nothing


def test_a_new_folder_is_absent_or_complete(respot, tmp_path, backup, cal):
    out, before = tmp_path / "out", state(backup)
    arguments = ("convert", backup, "-c", cal, "-o", out)
    assert respot(*arguments).code == 0
    complete = state(out, times=False)
    assert len(complete) > 25 and "respot.json" in complete
    found: Counter[str] = Counter()

    def start() -> None:  # what a kill left beside the folder stays there: the next run has to cope
        if out.exists():
            shutil.rmtree(out)

    def check(ended: Ended) -> None:
        assert not out.exists() or state(out, times=False) == complete
        assert state(backup) == before
        found["complete" if out.exists() else "absent"] += 1

    killed_at_all(respot, arguments, start, check, out)
    assert min(found.values()) > 1, found
    start()
    assert respot(*arguments).code == 0
    assert state(out, times=False) == complete
    assert sorted(path.name for path in tmp_path.iterdir()) == ["backup", "cal.json", "out"]


def test_a_folder_that_is_replaced_is_the_old_one_or_the_new_one(respot, tmp_path, backup, cal):
    out = tmp_path / "out"
    assert respot("convert", backup, "-c", cal, "-o", out).code == 0
    older = tmp_path / "older"
    shutil.copytree(out, older)
    (backup / "KRC" / "R1" / "Program" / "late.txt").write_text("came later")
    arguments = ("convert", backup, "-c", cal, "-o", out, "--force")
    assert respot(*arguments).code == 0
    states = [state(older, times=False), state(out, times=False)]
    assert states[0] != states[1]

    def start() -> None:
        shutil.rmtree(out)
        shutil.copytree(older, out)

    killed_at_all(respot, arguments, start, lambda _: check_one_of(out, states), out, KILLS // 2)


def check_one_of(folder: Path, states: list[State]) -> int:
    now = state(folder, times=False)
    (which,) = [number for number, each in enumerate(states) if each == now]
    return which


def old_and_new(respot: Runner, tmp_path: Path, backup: Path, cal: Path) -> tuple[Path, Path, list[State]]:
    """The backup as it was and as it becomes in place, in folders of their own."""
    old, new = tmp_path / "old", tmp_path / "new"
    shutil.copytree(backup, old)
    assert respot("convert", backup, "-c", cal, "--in-place").code == 0
    shutil.copytree(backup, new)
    return old, new, [state(old, times=False), state(new, times=False)]


@pytest.mark.parametrize(("how", "kills"), [({}, KILLS), ({"no_links": True}, KILLS // 2)], ids=["links", "copies"])
def test_in_place_a_folder_is_wholly_old_or_wholly_new_and_undo_brings_it_back(
    respot, tmp_path, backup, cal, how, kills
):
    old, _, states = old_and_new(respot, tmp_path, backup, cal)
    before = state(old)
    assert states[0] != states[1]
    found: Counter[int] = Counter()

    def start() -> None:
        shutil.rmtree(backup)
        shutil.copytree(old, backup)

    def check(ended: Ended) -> None:
        which = check_one_of(backup, states)
        found[which] += 1
        undone = respot("undo", backup)
        assert (undone.code, "NOTHING_TO_UNDO" in undone.err) == ((0, False) if which else (2, True))
        assert state(backup) == before
        if which:
            assert not workplace(backup).exists()

    killed_at_all(
        lambda *a, **k: respot(*a, **how, **k),
        ("convert", backup, "-c", cal, "--in-place"),
        start,
        check,
        backup,
        kills,
    )
    assert min(found.values()) > 1, found


def test_undo_that_is_killed_leaves_the_new_state_or_the_old_one(respot, tmp_path, backup, cal):
    _, new, states = old_and_new(respot, tmp_path, backup, cal)
    found: Counter[int] = Counter()

    def start() -> None:
        shutil.rmtree(backup)
        shutil.copytree(new, backup)

    def check(ended: Ended) -> None:
        which = check_one_of(backup, states)
        found[which] += 1
        assert respot("undo", backup).code == (0 if which else 2)
        assert state(backup, times=False) == states[0]

    killed_at_all(respot, ("undo", backup), start, check, backup, KILLS // 2)
    assert min(found.values()) > 1, found


@pytest.mark.parametrize("then", ["convert", "undo"])
def test_where_folders_cannot_change_places_the_next_run_puts_back_what_a_kill_took(
    respot, tmp_path, backup, cal, then
):
    """Windows, and disks without an exchange: between two renames the folder is absent, and its old state is kept."""
    old, _, states = old_and_new(respot, tmp_path, backup, cal)
    arguments = ("convert", backup, "-c", cal, "--in-place")

    def start() -> None:
        for folder in (backup, workplace(backup)):
            shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(old, backup)

    start()
    whole = respot(*arguments, no_exchange=True)
    assert whole.code == 0 and check_one_of(backup, states) == 1
    absent = 0
    for step in [number + 1 for number, name in enumerate(whole.steps) if name == "rename"]:
        for moment in ("before", "after"):
            start()
            assert respot(*arguments, no_exchange=True, kill={"step": step, "moment": moment}).killed
            if not backup.exists():
                absent += 1
                looked = respot("check", backup)
                assert looked.code == 2 and f"respot undo {backup}" in looked.err
                if then == "undo":
                    undone = respot("undo", backup, "--json")
                    assert (undone.code, undone.json["kind"]) == (0, "cut_short")
                    assert check_one_of(backup, states) == 0
            if then == "convert" and check_or_absent(backup, states) != 1:
                assert respot(*arguments, no_exchange=True).code == 0
                assert check_one_of(backup, states) == 1
            assert check_one_of(backup, states) in (0, 1)
    assert absent == 2
    assert respot("undo", backup).code in (0, 2)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["backup", "cal.json", "new", "old"]


def test_a_folder_that_comes_back_is_not_replaced_without_force(respot, tmp_path, backup, cal):
    out = tmp_path / "out"
    assert respot("convert", backup, "-c", cal, "-o", out).code == 0
    older = state(out)
    (backup / "KRC" / "R1" / "Program" / "late.txt").write_text("came later")
    arguments = ("convert", backup, "-c", cal, "-o", out)
    whole = respot(*arguments, "--force", no_exchange=True)
    shutil.rmtree(out)
    (backup / "KRC" / "R1" / "Program" / "late.txt").unlink()
    assert respot(*arguments).code == 0
    (backup / "KRC" / "R1" / "Program" / "late.txt").write_text("came later")
    first = whole.steps.index("rename") + 1
    older = state(out)
    assert respot(*arguments, "--force", no_exchange=True, kill={"step": first, "moment": "after"}).killed
    assert not out.exists()
    refused = respot(*arguments)
    assert (refused.code, "OUTPUT_EXISTS" in refused.err) == (2, True)
    assert state(out) == older


def test_undo_of_a_new_folder_that_is_killed_leaves_all_of_it_or_nothing(respot, tmp_path, backup, cal):
    out, kept = tmp_path / "out", tmp_path / "kept"
    assert respot("convert", backup, "-c", cal, "-o", kept).code == 0
    complete = state(kept, times=False)
    found: Counter[bool] = Counter()

    def start() -> None:
        shutil.rmtree(out, ignore_errors=True)
        shutil.copytree(kept, out)

    def check(ended: Ended) -> None:
        found[out.exists()] += 1
        assert not out.exists() or state(out, times=False) == complete
        again = respot("undo", out)
        assert again.code == (0 if found[True] and not again.err else 2)
        assert not out.exists()

    killed_at_all(respot, ("undo", out), start, check, out, KILLS // 3)
    assert found[True] and found[False]


def check_or_absent(folder: Path, states: list[State]) -> int | None:
    return check_one_of(folder, states) if folder.exists() else None


@pytest.mark.parametrize("moment", ["before", "after"])
def test_an_interrupt_between_the_renames_keeps_the_old_folder(tmp_path, backup, cal, monkeypatch, moment):
    """Ctrl-C where folders cannot change places: the run itself puts the old one back."""
    out, rename, calls = tmp_path / "out", Path.rename, []
    arguments = ["convert", str(backup), "-c", str(cal), "-o", str(out)]
    assert CliRunner().invoke(app, arguments).exit_code == 0
    older = state(out)
    (backup / "KRC" / "R1" / "Program" / "late.txt").write_text("came later")

    def interrupted(path: Path, target: Path) -> Path:
        calls.append(path)
        if len(calls) == 1 and moment == "after":
            rename(path, target)
        if len(calls) == 1:
            raise KeyboardInterrupt
        return rename(path, target)

    monkeypatch.setattr(places, "exchange", lambda first, second: False)
    monkeypatch.setattr(Path, "rename", interrupted)
    assert CliRunner().invoke(app, [*arguments, "--force"]).exit_code == 130
    assert calls and state(out) == older
    assert sorted(path.name for path in tmp_path.iterdir()) == ["backup", "cal.json", "out"]
