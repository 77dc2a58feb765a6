"""The house: rooms import only rooms above them; nothing below the command line prints, exits or reads the environment."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "src" / "respot"
ROOMS = (
    "resources",
    "issues",
    "tolerance",
    "geometry",
    "source",
    "program",
    "languages",
    "archives",
    "trees",
    "backups",
    "tables",
    "kinematics",
    "checking",
    "spots",
    "inspection",
    "registration",
    "calibration",
    "correction",
    "output",
    "difference",
    "figures",
    "parallel",
    "line",
    "translation",
    "simulation",
    "web",
    "cli",
)
FILES = sorted(PACKAGE.rglob("*.py"))
ENTRANCES = {"__init__", "__main__"}


def room(path: Path) -> str:
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


def imports(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            yield node.module or ""
            if node.module == "respot":
                yield from (f"respot.{alias.name}" for alias in node.names)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.relative_to(PACKAGE).as_posix())
def test_imports_run_one_way(path):
    own = room(path)
    if own in ENTRANCES:
        return
    assert own in ROOMS, f"{own} has no place in the house"
    for name in imports(path):
        parts = name.split(".")
        if parts[0] == "respot" and len(parts) > 1 and parts[1] != "__version__":
            assert ROOMS.index(parts[1]) <= ROOMS.index(own), f"{path.name} imports {name}"


@pytest.mark.parametrize("path", [path for path in FILES if room(path) not in {"cli", "web", *ENTRANCES}], ids=str)
def test_nothing_below_the_command_line_prints_exits_or_reads_the_environment(path):
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Call):
            called = ast.unparse(node.func)
            assert called not in {"print", "input", "exit", "sys.exit", "os._exit", "os.getenv"}, f"line {node.lineno}"
        if isinstance(node, ast.Attribute):
            assert ast.unparse(node) not in {"os.environ", "sys.argv", "sys.stdout", "sys.stderr"}, (
                f"line {node.lineno}"
            )


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.relative_to(PACKAGE).as_posix())
def test_no_module_needs_more_than_about_500_lines(path):
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 520


def test_simulation_stands_apart():
    for path in (PACKAGE / "simulation").rglob("*.py"):
        others = [name for name in imports(path) if name.startswith("respot")]
        assert all(f"{name}.".startswith("respot.simulation.") for name in others), f"{path.name} imports {others}"
