"""Holds what `convert` claims against what `diff` sees."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from respot.cli import app


def run(*arguments: object) -> tuple[int, str, str]:
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    return result.exit_code, result.stdout, result.stderr


def diff(old: Path, new: Path, *options: str) -> dict:
    code, out, err = run("diff", old, new, "--json", *options)
    assert code in (0, 1), err
    return json.loads(out)


def assert_agree(edits: list[dict], record: dict) -> None:
    """Every edit is seen as a move of a target or a change of a frame, by as much; nothing else, but our own headers."""
    seen, frames = {}, {}
    for robot in record["robots"]:
        taken_along = bool(robot["frames"])
        for item in robot["moved"]:
            if taken_along and not item["shift"]["distance"] and not item["turn_deg"] and not item["configuration"]:
                continue  # its numbers stay: it moves with its base
            seen.setdefault((item["old"]["path"], item["old"]["line"]), []).append(item)
        for item in robot["frames"]:
            frames.setdefault((item["old"]["path"], item["old"]["line"]), []).append(item)
        assert not [robot[name] for name in ("added", "removed", "renamed", "code", "files") if robot[name]]
        assert set(robot["noise_counts"]) <= {"respot"}
    assert not record["files"]
    claimed: dict[tuple[str, int], list[dict]] = {}
    for edit in edits:
        if edit["depth"] == "point":
            claimed.setdefault((edit["path"], edit["line"]), []).append(edit)
    assert {(edit["path"], edit["line"]) for edit in edits if edit["depth"] != "point"} == frames.keys()
    assert seen.keys() == claimed.keys()
    for place, found in seen.items():
        assert len(found) == len(claimed[place]), place
        for item, edit in zip(found, claimed[place], strict=True):
            assert item["shift"]["distance"] == pytest.approx(edit["shift_mm"], abs=2e-3), place
            assert item["turn_deg"] == pytest.approx(edit["turn_deg"], abs=2e-3), place
            if item["kind"] == "pose" and not item["target"].count("@"):
                assert item["target"] == edit["target"]


def assert_witnessed(edits: list[dict], old: Path, new: Path) -> None:
    """Compare two folders and hold the result against the edits."""
    assert_agree(edits, diff(old, new))
