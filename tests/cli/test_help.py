"""Help is quick, and the version is said."""

from __future__ import annotations

import subprocess
import sys

import pytest
from typer.testing import CliRunner

import respot
from respot.cli import app

HEAVY = ("numpy", "scipy", "lark", "jinja2", "plotly")
COMMANDS = sorted(command.name for command in app.registered_commands)


def test_there_are_commands():
    assert {"demo", "fit", "convert", "inspect"} <= set(COMMANDS)


@pytest.mark.parametrize(
    "arguments", [["--help"], *([name, "--help"] for name in COMMANDS), ["--show-completion", "bash"]]
)
def test_help_imports_nothing_heavy(arguments):
    code = f"""
import sys
sys.argv = ["respot", *{arguments!r}]
from respot.cli import main
try:
    main()
except SystemExit as end:
    assert not end.code, end.code
heavy = [name for name in {HEAVY!r} if name in sys.modules]
assert not heavy, heavy
"""
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=False,
        env={"SHELL": "/bin/bash", "_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "1"},
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip()


def test_version():
    result = CliRunner().invoke(app, ["--version"])
    assert result.exit_code == 0
    assert result.stdout == f"respot {respot.__version__}\n"


def test_python_m_respot():
    done = subprocess.run([sys.executable, "-m", "respot", "--version"], capture_output=True, text=True, check=True)
    assert done.stdout == f"respot {respot.__version__}\n"
