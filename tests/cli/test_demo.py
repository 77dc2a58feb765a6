"""The first thing a newcomer runs."""

from __future__ import annotations

import json
import shlex

from tests.cli.conftest import SAMPLES


def test_demo_shows_both_robots_and_the_commands_that_made_it(respot, tmp_path):
    result = respot("demo")
    assert result.code == 0, result.err
    assert "KUKA KRL" in result.out
    assert "ABB RAPID" in result.out
    assert result.out.count("14 of 14 spots within 10 mm after") == 2
    assert result.out.count("the real old cell must never load these files") == 2
    for robot in ("kuka", "abb"):
        record = json.loads((tmp_path / "respot-demo" / robot / "respot.json").read_text())
        assert record["verified"] is True
        assert record["refused"] == []


def test_the_commands_shown_are_real(respot, tmp_path):
    """Each command, run as it is shown, gives the files that the demo wrote, byte for byte."""
    out = respot("demo").out
    commands = [line.strip()[2:] for line in out.splitlines() if line.startswith("$ respot convert ")]
    assert len(commands) == 2
    for command, robot in zip(commands, ("kuka", "abb"), strict=True):
        arguments = shlex.split(command)[1:]
        arguments[arguments.index("-o") + 1] = f"again/{robot}"
        assert respot(*arguments).code == 0
        made = {
            path.relative_to(tmp_path / "again"): path
            for path in (tmp_path / "again" / robot).rglob("*")
            if path.is_file()
        }
        assert len(made) > len([path for path in (SAMPLES / robot).rglob("*") if path.is_file()])
        for name, path in made.items():
            if name.name != "respot.json":
                assert path.read_bytes() == (tmp_path / "respot-demo" / name).read_bytes()


def test_a_demo_replaces_only_a_demo(respot, tmp_path):
    assert respot("demo").code == 0
    assert respot("demo").code == 0
    (tmp_path / "respot-demo" / "mine.txt").write_text("precious")
    result = respot("demo")
    assert result.code == 2
    assert "OUTPUT_EXISTS" in result.err
    assert (tmp_path / "respot-demo" / "mine.txt").read_text() == "precious"
