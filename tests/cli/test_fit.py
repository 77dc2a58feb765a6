"""The numbers of the rear door, as `respot fit --json` says them."""

from __future__ import annotations

import csv

import numpy as np
import pytest

from tests.cli.conftest import SAMPLES

PRECISION = 0.002


def near(value: float) -> object:
    return pytest.approx(value, abs=PRECISION)


@pytest.fixture
def fitted(respot, backup, theory) -> dict:
    result = respot("fit", backup, "--theory", theory, "--json")
    assert result.code == 0, result.err
    return result.json


def test_counts(fitted):
    assert fitted["schema"] == "respot.fit/1"
    assert (fitted["kind"], fitted["frame"]) == ("theory", "same")
    assert [fitted[key] for key in ("n_source", "n_reference", "n_matched", "n_inliers")] == [14] * 4


def test_as_found(fitted):
    assert round(fitted["as_found"]["mean"], 2) == 76.19
    assert round(fitted["as_found"]["max"], 2) == 95.62


def test_as_labelled(fitted):
    assert fitted["before"] == {"rms": near(14.435), "mean": near(8.875), "max": near(40.323), "n": 14}


def test_twelve_free_parameters_of_the_papers_equation_6(fitted):
    assert fitted["affine_12"]["rms"] == near(14.111)
    assert np.abs(np.array(fitted["affine_12"]["matrix"])[:3, :3] - np.eye(3)).max() > 0.3  # no rotation at all


def test_only_the_two_names_are_exchanged(fitted):
    (effect,) = fitted["effects"]
    assert effect["name"] == "swapped_ids"
    assert effect["named"] is True
    assert set(effect["where"]["ids"]) == {"P02WP1615442", "P02WP1609713"}
    exchanged = {spot["id"]: spot["reference_id"] for spot in fitted["spots"] if spot["id"] != spot["reference_id"]}
    assert exchanged == {"P02WP1615442": "P02WP1609713", "P02WP1609713": "P02WP1615442"}
    assert effect["remedy"]["where"] == "spot_list"
    assert "coordinates are exchanged" in effect["remedy"]["text"]


def test_with_the_names_exchanged(fitted):
    assert fitted["after"] == {"rms": near(5.163), "mean": near(4.488), "max": near(9.662), "n": 14}
    assert all(spot["inlier"] and spot["after"] < 10.0 for spot in fitted["spots"])


def test_leave_one_out(fitted):
    assert fitted["leave_one_out"]["before"] == pytest.approx(16.50, abs=0.005)
    assert fitted["leave_one_out"]["after"] == pytest.approx(5.78, abs=0.005)


def test_a_rotation_is_not_supported(fitted):
    alone = fitted["translation_only"]
    assert (alone["rms"], alone["max"], alone["leave_one_out"]) == (near(5.255), near(9.239), near(5.659))
    assert fitted["rotation_support"]["supported"] is False
    assert "ROTATION_NOT_SUPPORTED" in {issue["code"] for issue in fitted["issues"]}


def test_residuals_point_along_the_flange(fitted):
    assert np.round(fitted["residual_sd_xyz"], 1).tolist() == [0.5, 4.9, 1.7]
    widest = max(fitted["residual_directions"], key=lambda direction: direction["sd"])
    assert abs(widest["axis"][1]) > 0.9


def test_transform_is_proper_and_carries_its_uncertainty(fitted):
    rotation = np.array(fitted["transform"]["rotation"])
    assert np.abs(rotation.T @ rotation - np.eye(3)).max() < 1e-12
    assert np.linalg.det(rotation) > 0
    covariance = np.array(fitted["transform"]["covariance"])
    assert covariance.shape == (6, 6)
    assert fitted["noise_directions"]["intervals_by_direction"] is True
    assert fitted["noise_directions"]["isotropy_p"] < 0.01
    # each direction by itself: sum of squares over n - 2, and that over sqrt(14) for the centre
    for row, name in enumerate(("dx", "dy", "dz")):
        square = sum(spot[name] ** 2 for spot in fitted["spots"])
        assert np.sqrt(covariance[row, row]) == pytest.approx(np.sqrt(square / 12 / 14), rel=1e-3)


def test_a_source_table_gives_the_same(respot, theory, fitted):
    result = respot("fit", SAMPLES / "actual.csv", "--theory", theory, "--json")
    assert result.json["after"]["rms"] == pytest.approx(fitted["after"]["rms"], abs=1e-4)


def test_the_whole_table_moved_and_another_pair_exchanged(respot, theory, tmp_path):
    """The pair is found wherever the tables stand, and the real one is found with it."""
    rng = np.random.default_rng(20260)
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    rotation = q * np.sign(np.diag(r))
    rotation *= np.sign(np.linalg.det(rotation))
    with (SAMPLES / "actual.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    points = np.array([[float(row[axis]) for axis in "xyz"] for row in rows]) @ rotation.T + rng.uniform(-5e3, 5e3, 3)
    names = [row["id"] for row in rows]
    first, second = names.index("P02WP1615435"), names.index("P02WP1615431")
    names[first], names[second] = names[second], names[first]
    lines = [f"{name},{x:.6f},{y:.6f},{z:.6f}" for name, (x, y, z) in zip(names, points, strict=True)]
    (tmp_path / "moved.csv").write_text("id,x,y,z\n" + "\n".join(lines) + "\n")
    found = respot("fit", "moved.csv", "--measured", theory, "--json").json
    pairs = {frozenset(effect["where"]["ids"]) for effect in found["effects"]}
    assert pairs == {frozenset(("P02WP1615435", "P02WP1615431")), frozenset(("P02WP1615442", "P02WP1609713"))}
    assert found["after"]["rms"] == pytest.approx(5.163, abs=0.002)


def test_a_saved_calibration_predicts_the_reference(respot, backup, theory, tmp_path):
    assert respot("fit", backup, "--theory", theory, "-o", "cal.json").code == 0
    again = respot("fit", backup, "--theory", theory, "-o", "cal.json")
    assert again.code == 2
    assert "OUTPUT_EXISTS" in again.err


def test_plain_text_when_piped(respot, backup, theory):
    result = respot("fit", backup, "--theory", theory)
    assert result.code == 0
    assert "\x1b" not in result.out
    assert "P02WP1615442 *" in result.out
    assert "14 of 14 spots within 10 mm after" in result.out
    assert "0.5 / 4.9 / 1.7 mm in x / y / z" in result.out
    assert "swapped_ids (named)" in result.out


def test_a_digit_too_many_is_an_outlier_not_a_line(respot, backup, theory, tmp_path):
    (tmp_path / "typo.csv").write_text(theory.read_text().replace("4306.86", "4306860.0"))
    found = respot("fit", backup, "--theory", "typo.csv", "--json").json
    assert [spot["id"] for spot in found["spots"] if not spot["inlier"]] == ["P02WP1615434"]
    assert found["n_inliers"] == 13
    assert found["after"]["max"] < 10.5
