"""What robots of a group have in common is what one fit of them all would say."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from respot.figures.line_page import common_text
from respot.line.groups import groups_of
from tests.line.found import effect, robot


def shared(values, covariance, form=None, name="deformation"):
    return effect(name, {}, values, np.asarray(covariance).tolist(), form)


def the_one(robots):
    ((common,),) = [group["effects"] for group in groups_of(robots)]
    return common


@given(st.integers(0, 10_000), st.integers(2, 4))
def test_the_common_values_are_those_of_one_fit_of_all_robots(seed, members):
    """Stacked least squares, the effect in common and the rest of each robot its own, by numbers drawn at random."""
    chance = np.random.default_rng(seed)
    sd, true = 0.1, chance.normal(size=2)
    robots, rows, results = [], [], []
    for member in range(members):
        own, common = chance.normal(size=(30, 6)), chance.normal(size=(30, 2))
        seen = own @ chance.normal(size=6) + common @ true + chance.normal(0.0, sd, 30)
        alone = np.hstack([own, common])
        covariance = sd**2 * np.linalg.inv(alone.T @ alone)
        values = np.linalg.lstsq(alone, seen, rcond=None)[0][6:]
        robots.append(robot(f"{member}", shared(values, covariance[6:, 6:]), group="F1"))
        block = np.zeros((30, 6 * members + 2))
        block[:, 6 * member : 6 * member + 6], block[:, -2:] = own, common
        rows.append(block)
        results.append(seen)
    everything = np.vstack(rows)
    expected = np.linalg.lstsq(everything, np.concatenate(results), rcond=None)[0][-2:]
    spread = np.sqrt(np.diag(sd**2 * np.linalg.inv(everything.T @ everything))[-2:])
    told = the_one(robots)
    for row, name in enumerate(("v0", "v1")):
        held = told["parameters"][name]
        assert held["value"] == pytest.approx(expected[row], rel=1e-6, abs=1e-9)
        assert np.diff(held["ci95"])[0] / 2.0 == pytest.approx(1.959964 * spread[row], rel=1e-6)


def test_robots_that_differ_are_said_to_differ():
    alike = [robot("A", shared((0.10,), [[1e-4]]), group="F"), robot("C", spots=None, group="F")]
    near, far = (robot("B", shared((value,), [[1e-4]]), group="F") for value in (0.11, 0.20))
    same, apart = the_one([*alike, near]), the_one([*alike, far])
    assert (same["agree"], apart["agree"]) == (True, False)
    assert common_text(same).startswith("v0 0.105 +- 0.014")
    assert common_text(apart).startswith("they do NOT agree")


def test_what_is_each_robots_own_affair_is_not_put_together():
    own = [robot(name, effect("joint_zero", None, (0.1,), [[1e-4]]), group="F") for name in "AB"]
    assert groups_of(own) == [{"group": "F", "robots": ["A", "B"], "effects": []}]


def test_a_robot_that_does_not_determine_every_value_has_no_part():
    sure = [robot(name, shared((value, 1.0), np.eye(2)), group="F") for name, value in (("A", 0.1), ("B", 0.3))]
    unsure = robot("C", shared((0.2, None), np.eye(2)), group="F")
    common = the_one([*sure, unsure])
    assert common["robots"] == ["A", "B"]
    assert common["parameters"]["v0"]["value"] == pytest.approx(0.2)


def test_forms_that_cannot_be_compared_are_not_put_together():
    robots = [
        robot(name, shared((0.1,), [[1e-4]], {"order": order}), group="F") for name, order in (("A", 1), ("B", 2))
    ]
    assert groups_of(robots)[0]["effects"] == []


def test_a_motion_of_a_fixture_is_the_same_whatever_spots_each_robot_has():
    """Each robot tells the motion about the middle of its own spots; it is one motion all the same."""
    turn, shift = np.array([0.02, -0.05, 0.04]), np.array([1.0, -2.0, 0.5])
    robots = []
    for name, centre in (("A", [1500.0, 200.0, 900.0]), ("B", [-800.0, 2600.0, 300.0])):
        moved = Rotation.from_rotvec(turn, degrees=True).apply(centre) + shift - centre
        form = {"moves": "body", "centre": centre, "known": [name]}
        found = effect(
            "group_shift", {"column": "fixture", "level": "F1"}, (*moved, *turn), (np.eye(6) * 1e-4).tolist(), form
        )
        robots.append(robot(name, found, group="F1"))
    common = the_one(robots)
    assert common["agree"]
    assert [common["parameters"][f"v{row}"]["value"] for row in (3, 4, 5)] == pytest.approx(turn, abs=1e-4)
    first = [held["value"] for held in robots[0]["effects"][0]["parameters"].values()]
    assert [held["value"] for held in common["parameters"].values()] == pytest.approx(first, abs=5e-3)


def test_a_rail_is_the_same_whatever_part_of_it_each_robot_travels():
    robots = []
    for name, half in (("A", 2000.0), ("B", 500.0)):
        form = {"form": "direction", "middle": 10.0 * half, "half": half}
        slope = np.array([0.1, -0.2, 0.3]) / 1000.0
        robots.append(
            robot(
                name, effect("rail", {"external_axis": 1}, slope * half, (np.eye(3) * 1e-4).tolist(), form), group="F"
            )
        )
    common = the_one(robots)
    assert common["agree_p"] == pytest.approx(1.0)
    assert [held["value"] for held in common["parameters"].values()] == pytest.approx([0.2, -0.4, 0.6])
