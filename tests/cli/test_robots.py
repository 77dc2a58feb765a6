"""The list of robots, and ``--robot`` of ``convert``."""

from __future__ import annotations

import pytest

from tests.cli.conftest import SAMPLES


def test_the_list_says_where_its_numbers_come_from(respot):
    record = respot("robots", "--json").json
    assert record["schema"] == "respot.robots/1"
    robots = {robot["name"]: robot for robot in record["robots"]}
    assert len(robots) > 50
    assert all(robot["source"] and robot["limits"] == "limits unknown, not checked" for robot in robots.values())
    prime = robots["kr210_r2700_prime"]
    # facts: krl.md section 7
    assert prime["lengths"] == {"a1": 350, "a2": 41, "b": 0, "c1": 675, "c2": 1150, "c3": 1200, "c4": 240}
    assert robots["kr210_r2700_2"]["lengths"]["a2"] == -115


def test_the_list_on_the_terminal(respot):
    result = respot("robots")
    assert result.code == 0
    lines = result.out.splitlines()
    assert any(line.split()[:3] == ["irb2400", "100", "-135"] for line in lines)
    assert "limits unknown, not checked" in result.out


def convert(respot, *options):
    source = SAMPLES / "kuka"
    return respot("convert", source, "--theory", SAMPLES / "theory.csv", "-o", "out", "--json", *options)


def test_an_unknown_robot_is_bad_input_with_suggestions(respot, tmp_path):
    result = convert(respot, "--robot", "kr210_r2700_extro")
    assert result.code == 2
    assert "kr210_r2700_extra" in result.err
    assert not (tmp_path / "out").exists()


def test_a_robot_file_that_does_not_exist(respot):
    result = convert(respot, "--robot", "missing.toml")
    assert result.code == 2
    assert "missing.toml" in result.err


@pytest.mark.parametrize("name", ["KR210 R2700 Extra", "mine.toml"])
def test_a_named_robot_is_used_and_said(respot, tmp_path, name):
    lengths = "a1 = 350\na2 = 41\nc1 = 675\nc2 = 1150\nc3 = 1200\nc4 = 215\n"
    signs = "signs = [-1, 1, 1, -1, 1, -1]\noffsets_deg = [0, -90, 0, 0, 0, 0]\n"
    (tmp_path / "mine.toml").write_text(f'convention = "opw"\n{lengths}{signs}')
    result = convert(respot, "--robot", name)
    assert result.code == 0, result.err
    assert any("named by the user" in issue["message"] for issue in result.json["issues"])


def test_a_robot_that_is_not_this_one_is_refused(respot):
    result = convert(respot, "--robot", "kr6_r900_sixx")
    assert result.code == 1
    assert {refusal["code"] for refusal in result.json["refused"]} == {"CONFIG_INCONSISTENT"}
