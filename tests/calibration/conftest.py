"""The `points` fixture: the module beside this file, loaded by path since tests are no package."""

from __future__ import annotations

from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType

import pytest


@pytest.fixture(scope="session")
def points() -> ModuleType:
    spec = spec_from_file_location("points_of_tests", Path(__file__).parents[1] / "registration" / "points.py")
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
