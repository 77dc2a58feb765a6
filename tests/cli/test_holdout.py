"""``respot fit --holdout``."""

from __future__ import annotations

import pytest


def test_a_share_of_a_backup(respot, backup, theory, tmp_path):
    page = tmp_path / "page.html"
    result = respot(
        "fit", backup, "--theory", theory, "--effects", "swapped_ids", "--holdout", "0.2", "--report", page, "--json"
    )
    assert result.code == 0, result.err
    held = result.json["heldout"]
    assert (held["scheme"], held["n"], held["before"]["n"], held["after"]["n"]) == ("held out: 3 spots", 3, 3, 3)
    names = {spot["id"] for spot in held["spots"]}
    assert len(names) == 3
    assert not names & {spot["id"] for spot in result.json["spots"]}
    assert (result.json["n_source"], result.json["n_matched"]) == (14, 11)
    assert result.json["missing"] == []
    assert "held out: 3 spots" in page.read_text(encoding="utf-8")
    words = respot("fit", backup, "--theory", theory, "--effects", "swapped_ids", "--holdout", "0.2").out
    assert "3 held out, 11 matched" in words
    assert "held out before: rigid of the others, names as given" in words
    assert "held out after: final model of the others" in words


def test_a_spot_with_anothers_name(respot, backup, theory, tmp_path):
    (tmp_path / "names.csv").write_text("id,note\nP02WP1609713,\nP02WP1615430,\n")
    arguments = ("fit", backup, "--theory", theory, "--effects", "swapped_ids", "--holdout", "names.csv")
    held = respot(*arguments, "--json").json["heldout"]
    assert held["repaired_ids"] == ["P02WP1609713"]
    assert [spot["reference_id"] for spot in held["spots"] if spot["repaired"]] == ["P02WP1615442"]
    assert held["after"]["max"] < 10.0 < 30.0 < held["before"]["max"]
    words = respot(*arguments)
    assert "P02WP1609713, held out, lies at the place that the reference calls P02WP1615442" in words.out
    assert "spots held out are among them" in words.err


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ("0", "above 0 and up to 0.5"),
        ("0.6", "above 0 and up to 0.5"),
        ("nan", "above 0 and up to 0.5"),
        ("a fifth", "neither"),
        ("lost.csv", "neither"),
        ("strangers.csv", "names no spot of the source"),
    ],
)
def test_bad_values(respot, backup, theory, tmp_path, value, words):
    (tmp_path / "strangers.csv").write_text("id,x,y,z\nA,1,2,3\n")
    result = respot("fit", backup, "--theory", theory, "--holdout", value)
    assert result.code == 2
    assert words in result.err


def test_the_table_is_not_written_over(respot, backup, theory, tmp_path):
    (tmp_path / "names.csv").write_text("id,note\nP02WP1609713,\n")
    result = respot("fit", backup, "--theory", theory, "--holdout", "names.csv", "-o", "names.csv", "--force")
    assert result.code == 2
    assert (tmp_path / "names.csv").read_text() == "id,note\nP02WP1609713,\n"
