"""Spots held out: drawn over the part, without a part in the fit, judged under their own names."""

from __future__ import annotations

import numpy as np
import pytest

from respot.calibration.holdout import spread_sample
from respot.calibration.source_fit import FitOptions, fit_source
from respot.issues import BadInputError

TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def write(path, ids, points, **columns):
    rows = [",".join(["id", "x", "y", "z", *columns])]
    rows += [
        ",".join([name, *(f"{value:.6f}" for value in point), *(str(values[row]) for values in columns.values())])
        for row, (name, point) in enumerate(zip(ids, points, strict=True))
    ]
    path.write_text("\n".join(rows) + "\n")
    return path


def list_names(path, names):
    path.write_text("id,note\n" + "".join(f"{name},\n" for name in names))


@pytest.fixture
def lists(tmp_path):
    """24 spots, 0.2 mm of noise, the reference turned by a right angle."""
    dice = np.random.default_rng(5)
    ids = [f"S{row}" for row in range(24)]
    source = dice.uniform(-0.5, 0.5, (24, 3)) * [1600.0, 800.0, 1200.0]
    measured = source @ TURN.T + [5000.0, 10.0, -30.0] + dice.normal(0.0, 0.2, (24, 3))
    write(tmp_path / "source.csv", ids, source)
    write(tmp_path / "measured.csv", ids, measured)
    return tmp_path, ids, source, measured


def fit(folder, **options):
    chosen = FitOptions(**{"kind": "measured", **options})
    return fit_source(folder / "source.csv", folder / "measured.csv", chosen)


def test_one_spot_of_each_part_is_drawn():
    line = np.stack([np.arange(100.0), np.zeros(100), np.zeros(100)], axis=1)
    for seed in range(5):
        drawn = spread_sample(line, 10, seed)
        assert sorted((drawn // 10).tolist()) == list(range(10))
    assert len({tuple(spread_sample(line, 10, seed)) for seed in range(5)}) == 5


def test_the_draw_does_not_depend_on_the_order_of_rows():
    dice = np.random.default_rng(1)
    points, order = dice.uniform(0.0, 1000.0, (40, 3)), dice.permutation(40)
    there = spread_sample(points, 8, 3)
    again = order[spread_sample(points[order], 8, 3)]
    assert sorted(there.tolist()) == sorted(again.tolist())
    assert len(set(there.tolist())) == 8


def test_a_share_is_held_out_and_predicted(lists):
    folder, ids, source, measured = lists
    whole, part = fit(folder).fit, fit(folder, holdout=0.25).fit
    assert whole.heldout is None
    held = part.heldout
    assert len(held.ids) == 6
    assert len(part.ids) == 18
    assert not set(held.ids) & set(part.ids)
    assert not set(held.ids) & set(part.calibration.ids)
    rows = [ids.index(name) for name in held.ids]
    predicted, _ = part.calibration.predict(source[rows])
    np.testing.assert_allclose(held.after, predicted - measured[rows], atol=1e-5)
    assert 0.1 < np.sqrt(np.mean(held.after**2)) < 0.4
    assert part.match.n_source == 24
    assert [ids[row] for row in part.match.source_rows] == list(part.ids)
    assert fit(folder, holdout=0.25, seed=1).fit.heldout.ids != held.ids


def test_what_is_held_out_takes_no_part(lists):
    folder, ids, _, measured = lists
    fitted = fit(folder, holdout=0.25).fit
    wrong = measured.copy()
    wrong[[ids.index(name) for name in fitted.heldout.ids]] += [0.0, 40.0, 0.0]
    write(folder / "measured.csv", ids, wrong)
    again = fit(folder, holdout=0.25).fit
    assert again.calibration.content_hash == fitted.calibration.content_hash
    np.testing.assert_allclose(again.heldout.after - fitted.heldout.after, [[0.0, -40.0, 0.0]] * 6, atol=1e-5)


def test_a_table_judges_spots_in_the_reference_and_beside_it(lists):
    folder, ids, source, measured = lists
    write(folder / "measured.csv", ids[:20], measured[:20])
    fresh = write(folder / "fresh.csv", [*ids[18:], "OTHER"], np.vstack([measured[18:], [[0.0, 0.0, 0.0]]]) + 1.0)
    fitted = fit(folder, holdout=fresh)
    held = fitted.fit.heldout
    assert held.ids == tuple(ids[18:])
    assert set(fitted.fit.ids) == set(ids[:18])
    predicted, _ = fitted.fit.calibration.predict(source[18:])
    np.testing.assert_allclose(held.after, predicted - measured[18:] - 1.0, atol=1e-5)
    said = [issue.message for issue in fitted.issues if issue.code == "UNMATCHED_REFERENCE"]
    assert any("OTHER" in message for message in said)
    write(folder / "measured.csv", ids[:18], measured[:18])
    alone = fit(folder).fit
    np.testing.assert_allclose(alone.calibration.rotation, fitted.fit.calibration.rotation, atol=1e-12)


def test_a_table_of_names_alone(lists):
    folder, ids, *_ = lists
    names = folder / "names.csv"
    list_names(names, ids[:3])
    held = fit(folder, holdout=names).fit.heldout
    assert held.ids == tuple(ids[:3])
    assert np.linalg.norm(held.after, axis=1).max() < 1.0


@pytest.mark.parametrize("both", [True, False])
def test_exchanged_names_of_spots_held_out(lists, both):
    folder, ids, _, measured = lists
    measured[[3, 11]] = measured[[11, 3]]
    write(folder / "measured.csv", ids, measured)
    names = folder / "names.csv"
    list_names(names, ["S3", "S7", *["S11"] * both])
    fitted = fit(folder, holdout=names)
    held = fitted.fit.heldout
    flagged = [name for name, changed in zip(held.ids, held.repaired, strict=True) if changed]
    assert flagged == (["S3", "S11"] if both else ["S3"])
    assert held.reference_ids[held.ids.index("S3")] == "S11"
    assert np.linalg.norm(held.after, axis=1).max() < 1.0
    assert np.linalg.norm(held.before, axis=1).max() > 100.0
    assert [issue.code for issue in fitted.issues].count("EXCHANGED_NAMES") == 1
    plain = fit(folder, holdout=names, effects=()).fit.heldout
    assert not plain.repaired.any()
    assert np.linalg.norm(plain.after, axis=1).max() > 100.0


def test_a_column_that_an_effect_follows_is_the_tables_own(lists):
    folder, ids, _, measured = lists
    minutes = np.random.default_rng(2).permutation(24) * 5.0
    drift = np.outer(minutes, [0.0, 0.02, 0.05])
    write(folder / "measured.csv", ids, measured + drift, time_min=minutes)
    late = measured[:6] + np.outer(np.full(6, 100.0), [0.0, 0.02, 0.05])
    table = write(folder / "late.csv", ids[:6], late, time_min=[100.0] * 6)
    fitted = fit(folder, holdout=table, effects="auto", noise=0.2).fit
    assert [effect.name for effect in fitted.effects] == ["drift"]
    assert np.sqrt(np.mean(fitted.heldout.after**2)) < 0.4
    assert np.sqrt(np.mean(fitted.heldout.before**2)) > 1.0
    bare = fit(folder, holdout=write(folder / "bare.csv", ids[:6], measured[:6] + drift[:6]), effects="auto", noise=0.2)
    assert np.sqrt(np.mean(bare.fit.heldout.after**2)) < 0.4
    write(folder / "measured.csv", ids[6:], (measured + drift)[6:], time_min=minutes[6:])
    lost = fit(folder, holdout=folder / "bare.csv", effects="auto", noise=0.2)
    assert "EFFECT_LEFT_OUT" in {issue.code for issue in lost.issues}


def test_a_method_for_comparison_is_judged_by_the_same_spots(lists):
    folder, *_ = lists
    for method in ("paper", "affine"):
        fitted = fit(folder, holdout=0.25, method=method).fit
        robust = fit(folder, holdout=0.25).fit.heldout
        assert fitted.heldout.ids == robust.ids
        np.testing.assert_allclose(fitted.beside.heldout.after, robust.after)
        assert not np.allclose(fitted.heldout.after, robust.after, atol=1e-6)


def test_repeats_of_spots_held_out_tell_no_noise(lists):
    folder, ids, _, measured = lists
    dice = np.random.default_rng(9)
    rows, points = [*ids, *ids[:8]], np.vstack([measured, measured[:8] + dice.normal(0.0, 0.2, (8, 3))])
    write(folder / "measured.csv", rows, points, repeat=[1] * 24 + [2] * 8)
    assert fit(folder).fit.noise is not None
    names = folder / "names.csv"
    list_names(names, ids[:6])
    assert fit(folder, holdout=names).fit.noise is None


@pytest.mark.parametrize("share", [0.0, -0.1, 0.51, float("nan"), 5.0])
def test_a_share_out_of_range(lists, share):
    with pytest.raises(BadInputError, match=r"above 0 and up to 0\.5"):
        fit(lists[0], holdout=share)


def test_too_few_are_left(lists):
    folder, ids, _, measured = lists
    names = folder / "names.csv"
    list_names(names, ids[:21])
    with pytest.raises(BadInputError, match=r"21 of 24 pairs .* 3 are left"):
        fit(folder, holdout=names)
    write(folder / "measured.csv", ids[:4], measured[:4])
    with pytest.raises(BadInputError, match="at least 4"):
        fit(folder, holdout=0.2)


def test_a_table_of_strangers(lists):
    with pytest.raises(BadInputError, match="names no spot of the source"):
        fit(lists[0], holdout=write(lists[0] / "other.csv", ["X1", "X2"], np.zeros((2, 3))))


def test_pairs_by_place_have_no_judge(lists):
    with pytest.raises(BadInputError, match="places"):
        fit(lists[0], holdout=0.2, match="geometry")
