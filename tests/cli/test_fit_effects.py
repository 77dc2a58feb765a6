"""``respot fit --effects`` and what ``convert`` says to a tool offset."""

from __future__ import annotations

import numpy as np
import pytest

OFFSET = (20.0, -150.0, 600.0)


def turn(axis: int, degrees: float) -> np.ndarray:
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    one, two = (axis + 1) % 3, (axis + 2) % 3
    result = np.eye(3)
    result[[one, two], [one, two]] = c
    result[one, two], result[two, one] = -s, s
    return result


@pytest.fixture
def tables(tmp_path):
    """Flange poses as KUKA angles against measured points; the same with a gun that never turns."""
    rng = np.random.default_rng(17)
    points = rng.uniform(-1.0, 1.0, (18, 3)) * [900.0, 500.0, 600.0] + [1800.0, 0.0, 900.0]
    angles = rng.uniform(-60.0, 60.0, (18, 3))
    frame = turn(2, 40.0) @ turn(0, 3.0)
    for name, abc in (("", angles), ("still_", np.zeros((18, 3)))):
        rows, measured = ["id,x,y,z,a,b,c"], ["id,x,y,z"]
        for number, (point, (a, b, c)) in enumerate(zip(points, abc, strict=True)):
            tool = turn(2, a) @ turn(1, b) @ turn(0, c)
            seen = frame @ (point + tool @ np.array(OFFSET)) + [5000.0, 100.0, -50.0] + rng.normal(0.0, 0.2, 3)
            rows.append(f"S{number}," + ",".join(f"{value:.5f}" for value in (*point, a, b, c)))
            measured.append(f"S{number}," + ",".join(f"{value:.5f}" for value in seen))
        (tmp_path / f"{name}poses.csv").write_text("\n".join(rows) + "\n")
        (tmp_path / f"{name}tracker.csv").write_text("\n".join(measured) + "\n")
    return tmp_path


def test_flange_poses_against_a_tracker(respot, tables):
    result = respot("fit", "poses.csv", "--measured", "tracker.csv", "--noise", "0.2", "-o", "cal.json", "--json")
    assert result.code == 0, result.err
    (effect,) = result.json["effects"]
    assert (effect["name"], effect["named"]) == ("tool_offset", True)
    found = [effect["parameters"][name]["value"] for name in "xyz"]
    np.testing.assert_allclose(found, OFFSET, atol=1.0)
    codes = {issue["code"] for issue in result.json["issues"]}
    assert {"CONGRUENT_BY_TOOL", "TOOL_OFFSET"} <= codes
    assert "NOT_CONGRUENT" not in codes
    assert result.json["leave_one_out"]["after"] < 0.7
    assert (tables / "cal.json").exists()
    words = respot("fit", "poses.csv", "--measured", "tracker.csv")
    assert "tool_offset (consistent with)" in words.out
    assert "the noise is not known" in words.out


def test_without_looking_for_it_the_lists_are_refused(respot, tables):
    for effects in ("none", "swapped_ids"):
        result = respot("fit", "poses.csv", "--measured", "tracker.csv", "--effects", effects)
        assert result.code == 2
        assert "NOT_CONGRUENT" in result.err


def test_a_gun_that_never_turns(respot, tables):
    named = respot("fit", "still_poses.csv", "--measured", "still_tracker.csv", "--effects", "tool_offset")
    assert named.code == 2
    assert "TOOL_NOT_DETERMINED" in named.err
    result = respot("fit", "still_poses.csv", "--measured", "still_tracker.csv", "--json")
    assert result.code == 0
    assert result.json["effects"] == []
    assert "TOOL_NOT_TRIED" in {issue["code"] for issue in result.json["issues"]}


def test_an_unknown_effect(respot, tables):
    result = respot("fit", "poses.csv", "--measured", "tracker.csv", "--effects", "tool-offset")
    assert result.code == 2
    assert "there are swapped_ids, convention, tool_offset, scale" in result.err


def test_the_rear_door_has_no_tool_offset(respot, backup, theory):
    result = respot("fit", backup, "--theory", theory, "--json").json
    assert [effect["name"] for effect in result["effects"]] == ["swapped_ids"]


def test_none_leaves_names_as_given(respot, backup, theory):
    result = respot("fit", backup, "--theory", theory, "--effects", "none", "--json").json
    assert result["effects"] == []
    assert all(spot["id"] == spot["reference_id"] for spot in result["spots"])


def test_a_saved_tool_offset_is_not_left_out_by_convert(respot, backup, tables):
    from respot.calibration import Calibration

    model = Calibration(np.eye(3), np.zeros(3), "theory", "same", tool_offset=np.array(OFFSET))
    model.save(tables / "cal.json")
    result = respot("convert", backup, "-c", "cal.json", "-o", "out")
    assert result.code == 2
    assert "tool offset" in result.err
    assert not (tables / "out").exists()
