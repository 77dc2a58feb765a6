"""Singularities, branch changes, limits and joint travel along a path."""

import numpy as np
import pytest

from respot.kinematics.cell import RobotCell
from respot.kinematics.path import check_path, check_travel, made_worse, singularity_distances, travel
from respot.kinematics.robots import find_robot

LIMITS = np.array([[-185, 185], [-140, -5], [-120, 155], [-350, 350], [-125, 125], [-350, 350.0]])
CELL = RobotCell(find_robot("kr210_r2700_prime").with_limits(LIMITS))
GOOD = [10, -80, 90, 20, 40, 20]


def codes(findings):
    return [(finding.code, finding.row) for finding in findings]


def test_distances_by_hand():
    # upright: the wrist centre is 350 + 1200 in front of axis 1, A3 is 90 + 1.9569 from stretched, A5 is 30 from 0
    phi = np.degrees(np.arctan2(41, 1200))
    assert singularity_distances(CELL.model, [0, -90, 90, 0, 30, 0])[0] == pytest.approx([1550, 180 - 90 - phi, 30])
    assert singularity_distances(CELL.model, [0, -90, -phi, 0, -30, 0])[0, 1:] == pytest.approx([0, 30], abs=1e-9)
    assert singularity_distances(CELL.model, [0, -90, 0, 0, 179, 0])[0, 2] == pytest.approx(1)


def test_a_good_path_has_nothing_to_say():
    assert check_path(CELL, [GOOD, [12, -82, 91, 25, 45, 10]]) == []


@pytest.mark.parametrize(
    ("row", "code"),
    [
        ([10, -80, 90, 20, 1.5, 20], "NEAR_SINGULARITY"),
        ([10, -60, -1.5, 20, 40, 20], "NEAR_SINGULARITY"),
        ([10, -107.5, -89, 20, 40, 20], "BRANCH_CHANGE"),
        ([10, -80, 90, 20, -40, 20], "BRANCH_CHANGE"),
        ([10, -80, -60, 20, 40, 20], "BRANCH_CHANGE"),
        ([10, -80, 90, 349.5, 40, 20], "NEAR_LIMIT"),
        ([10, -80, 90, 351, 40, 20], "OUT_OF_LIMITS"),
    ],
)
def test_what_is_worth_a_word(row, code):
    assert (code, 1) in codes(check_path(CELL, [GOOD, row]))


def test_overhead_singularity():
    # 350 forward to axis 2; the arm leans back until the wrist centre stands over axis 1
    a2 = -90 - np.degrees(np.arcsin((350 + 41) / (1150 + 1200)))
    findings = check_path(CELL, [[10, a2, 0, 20, 40, 20]])
    assert any("from axis 1" in finding.message for finding in findings)


def test_unknown_joints_are_left_out():
    path = [GOOD, [np.nan] * 6, [10, -80, 90, 20, -40, 20]]
    assert codes(check_path(CELL, path)) == [("BRANCH_CHANGE", 2)]
    assert check_travel(path, path) == []


def test_messages_name_axis_and_angle():
    finding = check_path(CELL, [[10, -80, 90, 351, 40, 20]])[0]
    assert "axis 4" in finding.message and "351.000" in finding.message and "-350 .. 350" in finding.message


def test_without_limits_nothing_is_checked():
    free = RobotCell(CELL.model.with_limits(None))
    assert check_path(free, [[10, -80, 90, 800, 40, 20]]) == []


def test_travel_changes_by_more_than_a_half_turn():
    before = [GOOD, [10, -80, 90, 170, 40, 20], [10, -80, 90, 30, 40, 20]]
    after = [GOOD, [10, -80, 90, -190, 40, 20], [10, -80, 90, 30, 40, 20]]
    assert travel(before)[:, 3] == pytest.approx([150, -140])
    assert codes(check_travel(before, after)) == [("JOINT_TRAVEL", 1), ("JOINT_TRAVEL", 2)]
    assert "axis 4" in check_travel(before, after)[0].message
    assert check_travel(before, before) == []
    assert check_travel([GOOD], [GOOD]) == []


@pytest.mark.parametrize(
    ("before", "after", "worse"),
    [
        (184.5, 184.5, []),
        (184.5, 184.45, []),
        (184.3, 184.5, ["NEAR_LIMIT"]),
        (184.5, 184.3, []),
        (180.0, 184.5, ["NEAR_LIMIT"]),
        (185.5, 184.5, []),
        (184.5, 185.5, ["OUT_OF_LIMITS"]),
    ],
)
def test_only_what_got_worse_is_worth_a_word(before, after, worse):
    old, new = (check_path(CELL, [[a1, *GOOD[1:]]]) for a1 in (before, after))
    assert [finding.code for finding in made_worse(old, new)] == worse
