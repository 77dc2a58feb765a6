"""What a line file may say, and how what is wrong with it is said."""

from __future__ import annotations

from pathlib import Path

import pytest
import typer
from typer.main import get_command

from respot.cli import app
from respot.issues import BadInputError
from respot.line.line_file import read_line
from respot.line.settings import OPTIONS, correction_options, fit_options

HEAD = '[line]\nname = "line 2"\n'
ROBOT = '[[robot]]\nname = "020R01"\nsource = "020R01.zip"\ntheory = "spots.csv"\n'


def written(folder: Path, text: str) -> Path:
    path = folder / "line.toml"
    path.write_text(text, encoding="utf-8")
    return path


def refused(folder: Path, text: str) -> tuple[str, int | None, str]:
    with pytest.raises(BadInputError) as caught:
        read_line(written(folder, text))
    issue = caught.value.issue
    assert issue.path == str(folder / "line.toml")
    return issue.code, issue.line, issue.message


def test_defaults_are_those_of_all_robots_and_a_robot_has_the_last_word(tmp_path):
    text = (
        '[line]\nname = "x"\nmeasured = "all.csv"\n[defaults]\nnoise = 0.2\nmax-shift = "20,3"\n'
        '[[robot]]\nname = "A"\nsource = "a"\ngroup = "fixture 1"\nstation = "010"\n'
        '[[robot]]\nname = "B"\nsource = "b"\ntheory = "b.csv"\nnoise = 0.05\nseed = 3\n'
        '[[robot]]\nname = "C"\nsource = "c"\ncalibration = "c.json"\n'
    )
    a, b, c = read_line(written(tmp_path, text)).robots
    assert (a.kind, a.reference, a.group, a.traits) == ("measured", "all.csv", "fixture 1", {"station": "010"})
    assert (b.kind, b.reference, b.options["noise"], b.options["seed"]) == ("theory", "b.csv", 0.05, 3)
    assert (c.kind, c.reference, c.calibration) == (None, None, "c.json")
    assert fit_options("measured", a.options).noise == 0.2
    assert fit_options("measured", a.options).effects == "auto"
    assert fit_options("theory", b.options).effects == ("swapped_ids",)
    assert correction_options(a.options).max_shift == (20.0, 3.0)
    assert correction_options(b.options).furthest("theory") == (20.0, 3.0)


#: Options of fit and convert that are of the command and not of a robot.
OF_THE_COMMAND = {
    "theory", "measured", "calibration", "output", "report", "json", "strict", "force", "dry_run", "in_place",
}  # fmt: skip


@pytest.mark.parametrize("command", ["fit", "convert"])
def test_every_long_option_of_fit_and_convert_is_a_key(command):
    parameters = get_command(app).commands[command].params
    names = {
        option.removeprefix("--").replace("-", "_")
        for parameter in parameters
        if isinstance(parameter, typer.core.TyperOption)
        for option in parameter.opts
        if option.startswith("--")
    }
    assert names - OF_THE_COMMAND - {"help"} <= set(OPTIONS)


@pytest.mark.parametrize(
    ("text", "code", "line", "said"),
    [
        ("[line]\nname = \n", "BAD_LINE_FILE", 2, "no TOML"),
        ("[line]\n" + ROBOT, "BAD_LINE_FILE", 1, "has no name"),
        (HEAD, "BAD_LINE_FILE", None, "no robot"),
        (HEAD + ROBOT + "max_shit = 3\n", "UNKNOWN_KEY", 7, "did you mean max_shift?"),
        (HEAD + "theroy = 'a'\n" + ROBOT, "UNKNOWN_KEY", 3, "did you mean theory?"),
        (HEAD + "[defualts]\nseed = 1\n" + ROBOT, "UNKNOWN_KEY", 3, "did you mean defaults?"),
        (HEAD + "[defaults]\nname = 'a'\n" + ROBOT, "UNKNOWN_KEY", 4, "'name'"),
        (HEAD + "[defaults]\nseed = 1\nnoise = 'much'\n" + ROBOT, "BAD_LINE_FILE", 5, "noise must be a number"),
        (HEAD + ROBOT + "seed = -1\n", "BAD_LINE_FILE", 7, "seed must be a whole number"),
        (HEAD + ROBOT + "seed = true\n", "BAD_LINE_FILE", 7, "seed must be a whole number"),
        (HEAD + ROBOT + "partial = 1\n", "BAD_LINE_FILE", 7, "partial must be true or false"),
        (HEAD + ROBOT + "noise = inf\n", "BAD_LINE_FILE", 7, "noise must be a number"),
        (HEAD + ROBOT + "method = 'best'\n", "BAD_LINE_FILE", 7, '"robust" or "paper"'),
        (HEAD + ROBOT + "method = 'affine'\n", "BAD_LINE_FILE", 7, "no rigid motion"),
        (HEAD + ROBOT + "tau = 3.0\n", "BAD_LINE_FILE", 7, "paper"),
        (HEAD + ROBOT + "apply = 'frames'\npartial = true\n", "BAD_LINE_FILE", 8, "leaves targets behind"),
        (HEAD + ROBOT + "effects = 'joint_sero'\n", "BAD_LINE_FILE", 7, "joint_zero"),
        (HEAD + ROBOT + "max_shift = '1,2,3'\n", "BAD_LINE_FILE", 7, "MM,DEG"),
        (HEAD + ROBOT + "profile = []\n", "BAD_LINE_FILE", 7, "profile must be a text"),
        (HEAD + ROBOT + "robot = 'kr999'\n", "BAD_LINE_FILE", 7, "kr999"),
        (HEAD + ROBOT + "robot = 'none.toml'\n", "BAD_LINE_FILE", 7, "none.toml"),
        (HEAD + ROBOT + "measured = 'm.csv'\n", "BAD_LINE_FILE", 7, "one of both"),
        (HEAD + ROBOT + "calibration = 'c.json'\n", "BAD_LINE_FILE", 7, "leave one out"),
        (HEAD + "[[robot]]\nname = 'A'\nsource = 'a'\n", "BAD_LINE_FILE", 3, "no reference"),
        (HEAD + "[[robot]]\nname = 'A'\ntheory = 'a'\n", "BAD_LINE_FILE", 3, "no source"),
        (HEAD + "[[robot]]\nsource = 'A'\ntheory = 'a'\n", "BAD_LINE_FILE", 3, "no name"),
        (HEAD + ROBOT.replace("020R01\"\n", "../020R01\"\n"), "BAD_LINE_FILE", 4, "name of a folder"),
        (HEAD + ROBOT.replace("020R01\"\n", "con\"\n"), "BAD_LINE_FILE", 4, "name of a folder"),
        (HEAD + "robot = 1\n" + ROBOT.replace("[[robot]]", "[[robots]]"), "UNKNOWN_KEY", 4, "robot"),
        (HEAD + ROBOT + ROBOT.replace("020R01.zip", "b.zip"), "SAME_ROBOT_TWICE", 8, "stands twice"),
        (HEAD + ROBOT + ROBOT.replace("020R01\"\n", "020r01\"\n"), "SAME_ROBOT_TWICE", 8, "stands twice"),
        (
            HEAD + ROBOT + ROBOT.replace("020R01\"\n", "B\"\n").replace("020R01.zip", "./x/../020R01.zip"),
            "SAME_ROBOT_TWICE",
            9,
            "backup of robot 020R01",
        ),
        (
            HEAD + "[[robot]]\nname = 'A'\nsource = 'a'\ncalibration = 'c.json'\nmethod = 'paper'\n",
            "BAD_LINE_FILE",
            7,
            "fitted already",
        ),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said_with_its_line(tmp_path, text, code, line, said):
    found = refused(tmp_path, text)
    assert found[:2] == (code, line)
    assert said in found[2]


def test_two_robots_of_one_backup_are_two_where_they_are_named(tmp_path):
    second = ROBOT.replace('020R01"\n', 'B"\n').replace("020R01.zip", "020R01.zip")
    text = HEAD + ROBOT + "robot_name = 'ROB1'\n" + second + "robot-name = 'ROB2'\n"
    assert [robot.options["robot_name"] for robot in read_line(written(tmp_path, text)).robots] == ["ROB1", "ROB2"]


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(BadInputError, match="CANNOT_READ"):
        read_line(tmp_path / "line.toml")


def test_a_robot_file_beside_the_line_file_is_found_from_anywhere(tmp_path, monkeypatch):
    arm = 'convention = "opw"\na1 = 350\na2 = 41\nb = 0\nc1 = 675\nc2 = 1150\nc3 = 1200\nc4 = 215\n'
    (tmp_path / "arm.toml").write_text(arm)
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    assert read_line(written(tmp_path, HEAD + ROBOT + "robot = 'arm.toml'\n")).robots[0].options["robot"] == "arm.toml"
