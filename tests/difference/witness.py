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
    """Every edit is seen as a move, by as much; nothing else is seen, but our own headers."""
    seen = {}
    for robot in record["robots"]:
        for item in robot["moved"]:
            seen.setdefault((item["old"]["path"], item["old"]["line"]), []).append(item)
        assert not [robot[name] for name in ("frames", "added", "removed", "renamed", "code", "files") if robot[name]]
        assert set(robot["noise_counts"]) <= {"respot"}
    assert not record["files"]
    claimed: dict[tuple[str, int], list[dict]] = {}
    for edit in edits:
        claimed.setdefault((edit["path"], edit["line"]), []).append(edit)
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
