from __future__ import annotations

from pathlib import Path

import pytest

from tests.convert.independent import ROBOTS, RobotFiles


@pytest.fixture(params=ROBOTS, ids=lambda robot: robot.name)
def robot(request: pytest.FixtureRequest) -> RobotFiles:
    return request.param


@pytest.fixture(scope="session")
def theory() -> Path:
    return Path(__file__).parents[2] / "samples" / "rear_door" / "theory.csv"
