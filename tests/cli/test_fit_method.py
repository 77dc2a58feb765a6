"""`--method` and `--match` of `respot fit` and `respot convert`, on the rear door."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest

from respot.calibration.calibration import Calibration, CalibrationError
from respot.calibration.fit import fit_spots
from tests.cli.conftest import SAMPLES

EXCHANGED = {"P02WP1615442", "P02WP1609713"}
ACTUAL = SAMPLES / "actual.csv"


@pytest.fixture
def paper(respot, backup, theory) -> dict:
    result = respot("fit", backup, "--theory", theory, "--method", "paper", "--json")
    assert result.code == 0, result.err
    return result.json


def test_what_the_papers_method_drops_and_chooses(paper):
    chosen = paper["paper"]
    assert (paper["method"], chosen["tau"], chosen["n_min"], chosen["subset_size"]) == ("paper", 10.0, 5, 4)
    assert chosen["subsets"] == {"tried": 1001, "all": True, "on_a_line": 0, "qualified": 660}
    assert set(chosen["dropped"]) == EXCHANGED | {"P02WP1615441"}
    assert len(chosen["inliers"]) == 7
    assert chosen["d_n"] == pytest.approx(0.587, abs=0.002)
    assert chosen["runner_up"]["rank"] == 2
    assert chosen["runner_up"]["dropped"] == ["P02WP1615439"]
    assert set(chosen["mean_square_reading"]["dropped"]) == EXCHANGED | {"P02WP1615439", "P02WP1609707"}
    held = [abs(np.array([spot["dx"], spot["dy"], spot["dz"]])).max() for spot in paper["spots"]]
    assert held == pytest.approx(list(chosen["delta"].values()))
    assert {spot["id"] for spot, most in zip(paper["spots"], held, strict=True) if most > 10.0} == set(
        chosen["dropped"]
    )


def test_our_fit_stands_beside_it(paper, respot, backup, theory):
    ours = respot("fit", backup, "--theory", theory, "--json").json
    assert paper["robust"]["after"] == ours["after"]
    assert paper["robust"]["effects"] == ours["effects"]
    assert (paper["effects"], paper["n_inliers"]) == ([], 11)
    assert not any(spot["repaired"] for spot in paper["spots"])
    assert {"EXCHANGED_NAMES", "OUTLIER", "PAPER_AMBIGUOUS", "PAPER_COMPARED"} <= {
        issue["code"] for issue in paper["issues"]
    }


def test_tau_and_n_min_change_the_answer_and_the_subset_itself_goes_untested(respot, backup, theory):
    wide = respot("fit", backup, "--theory", theory, "--method", "paper", "--tau", 12, "--json").json
    assert set(wide["paper"]["dropped"]) == EXCHANGED
    many = respot("fit", backup, "--theory", theory, "--method", "paper", "--n-min", 7, "--json").json
    assert many["paper"]["dropped"] == ["P02WP1615439"]
    assert set(many["paper"]["subset_beyond_tau"]) == EXCHANGED
    assert "SUBSET_NOT_TESTED" in {issue["code"] for issue in many["issues"]}


def test_the_terminal_says_what_it_drops_and_what_the_paper_leaves_unsaid(respot, backup, theory):
    out = respot("fit", backup, "--theory", theory, "--method", "paper").out
    for words in ("the paper states neither", "D_n = 0.5866", "drops:   P02WP1615441", "robust:  drops none"):
        assert words in out


def test_the_published_result_is_the_plain_fit_of_all_spots(paper):
    """Its Table 2 has 8.87 mm; that is least squares over all 14, with nothing dropped."""
    assert paper["before"]["mean"] == pytest.approx(8.875, abs=0.002)
    assert paper["before"]["rms"] == pytest.approx(14.435, abs=0.002)


def test_the_smallest_tau_that_would_do_is_named(respot, backup, theory):
    result = respot("fit", backup, "--theory", theory, "--method", "paper", "--tau", 1)
    assert result.code == 2
    assert "NO_SUBSET" in result.err
    assert "smallest --tau that would do is 2.8" in result.err


def test_a_paper_calibration_is_saved_loaded_and_applied_once(respot, backup, theory, tmp_path):
    assert respot("fit", backup, "--theory", theory, "--method", "paper", "-o", "cal.json").code == 0
    saved = Calibration.load(tmp_path / "cal.json")
    assert saved.method == "paper"
    assert saved.provenance["paper"] == {"tau": 10.0, "n_min": 5, "subset_size": 4, "seed": 0}
    direct = respot("convert", backup, "--theory", theory, "--method", "paper", "-o", "direct", "--json")
    stored = respot("convert", backup, "-c", "cal.json", "-o", "stored", "--json")
    assert (direct.code, stored.code) == (0, 0), direct.err
    assert direct.json["calibration"]["hash"] == stored.json["calibration"]["hash"] == saved.content_hash
    assert direct.json["edits"] == stored.json["edits"]
    robust = respot("convert", backup, "--theory", theory, "-o", "robust", "--json").json
    assert robust["calibration"]["hash"] != saved.content_hash
    again = respot("convert", "stored", "-c", "cal.json", "-o", "again")
    assert again.code == 2
    assert "ALREADY_APPLIED" in again.err


def test_affine_is_shown_and_never_applied(respot, backup, theory, tmp_path):
    record = respot("fit", backup, "--theory", theory, "--method", "affine", "--json").json
    assert (record["method"], record["transform"], record["calibration_hash"]) == ("affine", None, None)
    assert record["after"]["rms"] == record["affine_12"]["rms"] == pytest.approx(14.111, abs=0.002)
    assert record["leave_one_out"]["after"] == pytest.approx(21.05, abs=0.02)
    assert record["robust"]["after"]["rms"] == pytest.approx(5.163, abs=0.002)
    shown = respot("fit", backup, "--theory", theory, "--method", "affine").out
    assert "stretches 1.25" in shown
    for arguments in (
        ("convert", backup, "--theory", theory, "--method", "affine", "-o", "out"),
        ("fit", backup, "--theory", theory, "--method", "affine", "-o", "cal.json"),
    ):
        result = respot(*arguments)
        assert result.code == 2
        assert "BAD_OPTION" in result.err
    assert list(tmp_path.iterdir()) == []


def test_no_caller_gets_a_calibration_from_an_affine_fit():
    source = np.random.default_rng(1).uniform(-500, 500, (8, 3))
    fit = fit_spots([f"S{k}" for k in range(8)], source, source + 1.0, method="affine")
    with pytest.raises(CalibrationError, match="no rigid motion"):
        _ = fit.calibration


@pytest.mark.parametrize(
    "extra",
    [
        ("--tau", "5"),
        ("--n-min", "3"),
        ("--method", "affine", "--tau", "5"),
        ("--method", "ransac"),
        ("--match", "order"),
        ("--method", "paper", "--tau", "0"),
        ("--method", "paper", "--n-min", "10"),
    ],
)
def test_options_that_make_no_sense(respot, backup, theory, extra):
    result = respot("fit", backup, "--theory", theory, *extra)
    assert result.code == 2
    assert "BAD_OPTION" in result.err


def test_a_stored_calibration_takes_no_options_of_a_fit(respot, backup, theory):
    respot("fit", backup, "--theory", theory, "-o", "cal.json")
    for extra in (("--method", "paper"), ("--match", "geometry")):
        result = respot("convert", backup, "-c", "cal.json", "-o", "out", *extra)
        assert result.code == 2
        assert "BAD_OPTION" in result.err


def test_an_older_calibration_without_the_word_keeps_its_hash_and_a_changed_word_is_seen(
    respot, backup, theory, tmp_path
):
    respot("fit", backup, "--theory", theory, "-o", "robust.json")
    record = json.loads((tmp_path / "robust.json").read_text())
    assert record.pop("method") == "robust"
    assert Calibration.from_json(json.dumps(record)).method == "robust"
    for method, code in (("paper", "CALIBRATION_CHANGED"), ("affine", "CALIBRATION_INCOMPLETE")):
        with pytest.raises(CalibrationError) as caught:
            Calibration.from_json(json.dumps({**record, "method": method}))
        assert caught.value.code == code


def rewritten(theory, path, change):
    """The theory with every row [id, x, y, z] changed."""
    with theory.open(newline="") as file:
        title, *rows = csv.reader(file)
    with path.open("w", newline="") as file:
        csv.writer(file).writerows([title, *change(rows)])
    return path


def test_a_list_without_common_names_is_matched_by_place(respot, backup, theory, tmp_path):
    other = rewritten(
        theory, tmp_path / "o.csv", lambda rows: [[f"N{k}", *row[1:]] for k, row in enumerate(rows[::-1])]
    )
    record = respot("fit", backup, "--theory", other, "--json").json
    assert record["matching"]["by"] == "geometry"
    assert record["n_matched"] == record["n_inliers"] == 14
    assert record["after"]["rms"] == pytest.approx(5.163, abs=0.002)
    assert "MATCHED_BY_GEOMETRY" in {issue["code"] for issue in record["issues"]}
    result = respot("fit", backup, "--theory", other, "--match", "id")
    assert result.code == 2
    assert "NO_COMMON_IDS" in result.err


def test_geometry_finds_the_two_exchanged_names_by_itself(respot, backup, theory):
    record = respot("fit", backup, "--theory", theory, "--match", "geometry", "--json").json
    assert record["after"]["rms"] == pytest.approx(5.163, abs=0.002)
    pairs = {spot["id"]: spot["reference_id"] for spot in record["spots"] if spot["id"] != spot["reference_id"]}
    assert pairs == {"P02WP1615442": "P02WP1609713", "P02WP1609713": "P02WP1615442"}
    assert "NAMES_DISAGREE" in {issue["code"] for issue in record["issues"]}


@pytest.mark.parametrize(
    ("change", "code"),
    [
        (lambda rows: [[name, *(str(float(v) / 25.4) for v in values)] for name, *values in rows], "UNIT_MISMATCH"),
        (lambda rows: [[name, *(str(float(v) / 1000) for v in values)] for name, *values in rows], "UNIT_MISMATCH"),
        (lambda rows: [[rows[k - 1][0], *row[1:]] for k, row in enumerate(rows)], "ROWS_SHIFTED"),
        (lambda rows: [[rows[k * 5 % 14][0], *row[1:]] for k, row in enumerate(rows)], "NOT_CONGRUENT"),
        (
            lambda rows: [[row[0], str(k * k * 90), str(k * 300 % 700), row[3]] for k, row in enumerate(rows)],
            "NOT_CONGRUENT",
        ),
    ],
    ids=["inches", "metres", "rows", "names", "other robot"],
)
def test_a_wrong_list_is_refused_with_its_reason(respot, theory, tmp_path, change, code):
    wrong = rewritten(theory, tmp_path / "wrong.csv", change)
    result = respot("fit", ACTUAL, "--theory", wrong)
    assert result.code == 2
    assert code in result.err


def test_names_spelled_otherwise_are_matched_and_said(respot, theory, tmp_path):
    other = rewritten(theory, tmp_path / "o.csv", lambda rows: [[f"020R01_{row[0]}", *row[1:]] for row in rows])
    record = respot("fit", ACTUAL, "--theory", other, "--json").json
    assert record["n_matched"] == 14
    assert record["matching"]["not_equal_names"][0]["rule"] == "prefix or suffix"
    assert "NAMES_BY_RULE" in {issue["code"] for issue in record["issues"]}
    assert len(record["effects"]) == 1


def test_a_renamed_spot_is_said(respot, theory, tmp_path):
    other = rewritten(theory, tmp_path / "o.csv", lambda rows: [["NEW", *rows[0][1:]], *rows[1:]])
    record = respot("fit", ACTUAL, "--theory", other, "--json").json
    (issue,) = [issue for issue in record["issues"] if issue["code"] == "PROBABLY_RENAMED"]
    assert "P02WP1615438 = NEW" in issue["message"]
