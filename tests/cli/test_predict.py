"""`respot predict`: each spot in the reference frame, with an interval."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from respot.kinematics.robots import find_robot
from respot.tables import read_table
from tests.cli.conftest import SAMPLES

ROBOTS = {
    "kuka": {"name": "ST140R01", "model": "KR210R2700 EXTRA C4 FLR", "language": "krl", "serial": "604217", "task": ""},
    "other": {
        "name": "ST140R09",
        "model": "KR210R2700 EXTRA C4 FLR",
        "language": "krl",
        "serial": "604218",
        "task": "",
    },
}


@pytest.fixture
def stored(respot, theory, tmp_path) -> Path:
    """The calibration of the KUKA sample."""
    done = respot("fit", SAMPLES / "kuka", "--theory", theory, "-o", "cal.json")
    assert done.code == 0, done.err
    return tmp_path / "cal.json"


def rewritten(path: Path, **provenance: object) -> Path:
    record = json.loads(path.read_text())
    record["provenance"].update(provenance)
    path.write_text(json.dumps(record))
    return path


def codes(result) -> list[str]:
    return [issue["code"] for issue in result.json["issues"]]


def test_where_each_spot_will_be(respot, stored, theory):
    """The sample's spots come within 9.66 mm of the theory, but for two that carry each other's names (its README)."""
    result = respot("predict", SAMPLES / "kuka", "-c", stored, "--json")
    assert result.code == 0, result.err
    assert result.json["schema"] == "respot.predict/1"
    wanted = read_table(theory)
    places = dict(zip(wanted.ids, wanted.positions, strict=True))
    swapped = {"P02WP1615442": "P02WP1609713", "P02WP1609713": "P02WP1615442"}
    assert len(result.json["spots"]) == 14
    for spot in result.json["spots"]:
        apart = np.linalg.norm(places[swapped.get(spot["id"], spot["id"])] - [spot[axis] for axis in "xyz"])
        assert apart < 9.67
        assert 0 < spot["ci95"] < spot["ci95_new"]
        assert None not in spot.values()
    assert codes(result) == []


def test_the_table_is_read_back(respot, stored, tmp_path):
    told = respot("predict", SAMPLES / "kuka", "-c", stored, "-o", "out.csv", "--json").json["spots"]
    assert (tmp_path / "out.csv").read_text().splitlines()[0] == "id,x,y,z,a,b,c,ci95,ci95_new,leverage,extrapolated"
    table = read_table(tmp_path / "out.csv")
    assert list(table.ids) == [spot["id"] for spot in told]
    np.testing.assert_allclose(table.positions, [[spot[axis] for axis in "xyz"] for spot in told], atol=6e-4)
    np.testing.assert_allclose(table.numbers["ci95"], [spot["ci95"] for spot in told], atol=6e-5)
    again = respot("predict", SAMPLES / "kuka", "-c", stored, "-o", "out.csv")
    assert (again.code, "OUTPUT_EXISTS" in again.err) == (2, True)
    assert respot("predict", SAMPLES / "kuka", "-c", stored, "-o", "out.csv", "--force").code == 0


@pytest.mark.parametrize("name", ["cal.json", "out.txt", "source/out.csv"])
def test_what_is_read_is_never_written(respot, stored, tmp_path, name):
    (tmp_path / "source").mkdir()
    (tmp_path / "source" / "actual.csv").write_bytes((SAMPLES / "actual.csv").read_bytes())
    before = stored.read_bytes()
    result = respot(
        "predict", "source/actual.csv", "-c", stored, "-o", name, "--force", "--covariates", "source/actual.csv"
    )
    if name.startswith("source/"):
        assert result.code == 0  # beside the table, not in it
        result = respot("predict", "source/actual.csv", "-c", stored, "-o", "source/actual.csv", "--force")
    assert result.code == 2
    assert stored.read_bytes() == before
    assert (tmp_path / "source" / "actual.csv").read_bytes() == (SAMPLES / "actual.csv").read_bytes()


def test_another_program_of_the_robot_is_a_warning_with_both_hashes(respot, stored):
    rewritten(stored, robot=ROBOTS["kuka"], source_sha256="abcdefabcdefabcdef", source="older.zip")
    result = respot("predict", SAMPLES / "kuka", "-c", stored, "--json")
    (issue,) = result.json["issues"]
    assert (result.code, issue["code"], issue["level"]) == (0, "ANOTHER_SOURCE", "warning")
    assert "older.zip" in issue["message"]
    assert "abcdefabcdef" in issue["message"]


def test_another_robot_is_refused_unless_it_is_said(respot, stored):
    rewritten(stored, robot=ROBOTS["other"], source_sha256="abcdefabcdefabcdef")
    result = respot("predict", SAMPLES / "kuka", "-c", stored)
    assert result.code == 2
    assert "ANOTHER_ROBOT" in result.err
    assert "604218" in result.err
    assert "604217" in result.err
    assert respot("predict", SAMPLES / "kuka", "-c", stored, "--any-robot").code == 0
    rewritten(stored, robot={**ROBOTS["other"], "serial": ""})
    assert "name ST140R09" in respot("predict", SAMPLES / "kuka", "-c", stored).err
    rewritten(
        stored, robot={**ROBOTS["kuka"], "name": "copy of a copy"}
    )  # a serial number says more than a file's name
    assert respot("predict", SAMPLES / "kuka", "-c", stored).code == 0


def test_covariates_that_nothing_uses_are_said(respot, stored, tmp_path):
    (tmp_path / "wear.csv").write_text("id,welds_since_cap\nP02WP1615438,12\nX,3\n")
    result = respot("predict", SAMPLES / "kuka", "-c", stored, "--covariates", "wear.csv", "--json")
    assert codes(result) == ["OPTION_UNUSED"]
    assert "1 of 14" in result.json["issues"][0]["message"]
    assert respot("predict", SAMPLES / "kuka", "-c", stored, "--covariates", "absent.csv").code == 2


def test_a_spot_outside_of_the_fitted_ones(respot, stored, tmp_path):
    (tmp_path / "more.csv").write_text("id,x,y,z\nIN,4220,20,1400\nFAR,4220,20,3400\n")
    result = respot("predict", "more.csv", "-c", stored, "--json")
    assert {"EXTRAPOLATED", "ANOTHER_SOURCE"} == set(codes(result))
    inside, far = result.json["spots"]
    assert (inside["extrapolated"], far["extrapolated"]) == (False, True)
    assert far["ci95"] > 3 * inside["ci95"]
    assert inside["a"] is None
    text = respot("predict", "more.csv", "-c", stored).out
    assert "outside" in next(row for row in text.splitlines() if row.startswith("FAR"))


def test_a_calibration_without_precision_predicts_without_interval(respot, stored, tmp_path):
    """As files of before have it."""
    record = json.loads(stored.read_text())
    del record["precision"], record["precision_hash"]
    stored.write_text(json.dumps(record))
    result = respot("predict", SAMPLES / "actual.csv", "-c", stored, "-o", "out.csv", "--json")
    assert result.code == 0
    assert "NO_INTERVAL" in codes(result)
    assert result.json["spots"][0]["ci95"] is None
    assert (tmp_path / "out.csv").read_text().splitlines()[1].endswith(",,,,")
    assert respot("predict", SAMPLES / "actual.csv", "-c", stored, "--bootstrap", 200).code == 2


def test_bootstrap(respot, stored):
    arguments = ("predict", SAMPLES / "kuka", "-c", stored, "--json", "--bootstrap")
    assert respot(*arguments, 50).code == 2
    first, again, other = (respot(*arguments, 400, "--seed", seed).json for seed in (1, 1, 2))
    assert first == again
    assert first["spots"] != other["spots"]
    assert first["intervals"] == "bootstrap"
    plain = respot("predict", SAMPLES / "kuka", "-c", stored, "--json").json
    for drawn, by_covariance in zip(first["spots"], plain["spots"], strict=True):
        assert drawn["ci95"] == pytest.approx(by_covariance["ci95"], rel=0.4)


def test_a_table_of_joints_is_where_the_flange_is(respot, stored, tmp_path):
    """KR 210 R2700-2 at its home position: a1 + c3 + c4 = 1765 mm ahead and c1 + c2 - a2 = 1910 mm up."""
    robot = find_robot("kr210_r2700_2")
    ahead, up = robot.a1 + robot.c3 + robot.c4, robot.c1 + robot.c2 - robot.a2
    (tmp_path / "joints.csv").write_text("id,j1,j2,j3,j4,j5,j6\nP1,0,-90,90,0,0,0\nP2,90,-90,90,0,0,0\n")
    assert respot("predict", "joints.csv", "-c", stored).code == 2
    done = respot("predict", "joints.csv", "-c", stored, "--robot", "kr210_r2700_2", "--json")
    assert done.code == 0, done.err
    record = json.loads(stored.read_text())
    rotation, shift = np.array(record["rotation"]), np.array(record["translation"])
    for spot, flange in zip(done.json["spots"], ([ahead, 0, up], [0, -ahead, up]), strict=True):
        np.testing.assert_allclose([spot[axis] for axis in "xyz"], rotation @ flange + shift, atol=1e-6)
    assert "flange" in next(i["message"] for i in done.json["issues"] if i["code"] == "TABLE_COLUMNS")
    unused = respot("predict", SAMPLES / "actual.csv", "-c", stored, "--robot", "kr210_r2700_2", "--json")
    assert "OPTION_UNUSED" in codes(unused)


@pytest.mark.parametrize(
    ("content", "words"),
    [("{}", "schema"), ("no", "not JSON"), ('{"schema": "respot.calibration/77"}', "newer respot")],
)
def test_a_file_that_is_no_calibration(respot, tmp_path, content, words):
    (tmp_path / "cal.json").write_text(content)
    result = respot("predict", SAMPLES / "kuka", "-c", "cal.json")
    assert (result.code, "BAD_CALIBRATION" in result.err, words in result.err) == (2, True, True)
