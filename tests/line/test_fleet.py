"""What is said over all robots of a line: which effects return, on which robots, and what a group has in common."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import fisher_exact

from respot.figures.line_page import common_text, line_page
from respot.line.fleet import fleet_of, groups_of
from respot.line.summary import line_record, table

TRAITS = ("group", "station", "gun", "generation", "language", "model")


def effect(name="joint_zero", where=None, values=(0.1,), covariance=None, form=None, named=True):
    parameters = {f"v{row}": {"value": value, "unit": "deg", "ci95": None} for row, value in enumerate(values)}
    told = {"where": {"axis": 3} if where is None else where, "named": named, "covariance": covariance}
    return {"name": name, "parameters": parameters, "form": form or {}, **told}


def robot(name, *effects, spots=20, **traits):
    return {"name": name, "spots": spots, "effects": list(effects), **dict.fromkeys(TRAITS, ""), **traits}


def test_effects_are_counted_by_kind_and_place():
    robots = [
        robot("A", effect(), effect(where={"axis": 2})),
        robot("B", effect(values=(-0.3,), named=False)),
        robot("C", effect("swapped_ids", {"ids": ["P1", "P2"]})),
        robot("D", effect("swapped_ids", {"ids": ["P7", "P9"]})),
        robot("E"),
        robot("F", spots=None),
    ]
    rows = {(row["effect"]["name"], str(row["effect"]["where"])): row for row in fleet_of(robots)}
    first = rows["joint_zero", "{'axis': 3}"]
    assert (first["robots"], first["count"], first["of"], first["named"]) == (["A", "B"], 2, 5, 1)
    assert first["size"] == {"unit": "deg", "median": pytest.approx(0.2), "least": 0.1, "most": 0.3}
    assert rows["swapped_ids", "{}"]["robots"] == ["C", "D"]
    assert rows["joint_zero", "{'axis': 2}"]["count"] == 1


def test_robots_that_an_effect_gathers_on_are_told_with_their_chance():
    robots = [robot(f"W{n}", *([effect()] if n < 8 else []), gun="G2", station=f"{n}") for n in range(8)]
    robots += [robot(f"N{n}", *([effect()] if n < 1 else []), gun="G1", station=f"{n}") for n in range(12)]
    (row,) = fleet_of(robots)
    (found,) = row["goes_with"]
    assert (found["trait"], found["value"], found["showing"], found["of"]) == ("gun", "G2", 8, 8)
    assert found["elsewhere"] == {"showing": 1, "of": 12}
    looked_at = 2 + 12  # guns and stations
    expected = fisher_exact([[8, 0], [1, 11]], alternative="greater").pvalue * looked_at
    assert found["p_value"] == pytest.approx(expected)


def test_an_effect_that_is_spread_evenly_gathers_nowhere():
    robots = [robot(f"{n}", *([effect()] if n % 2 else []), gun=f"G{n // 2 % 2}") for n in range(40)]
    assert fleet_of(robots)[0]["goes_with"] == []


def test_by_luck_alone_an_effect_seldom_gathers_anywhere():
    chance = np.random.default_rng(1)
    false = 0
    for _ in range(300):
        shown = chance.uniform(size=40) < 0.3
        robots = [
            robot(f"{n}", *([effect()] if shown[n] else []), gun=f"G{n % 3}", station=f"{n // 4}") for n in range(40)
        ]
        false += any(row["goes_with"] for row in fleet_of(robots))
    assert false <= 9  # at most 1 in 100 is promised: 3 of 300


@given(st.integers(0, 10_000), st.integers(2, 4))
def test_the_common_values_are_those_of_one_fit_of_all_robots(seed, members):
    """Stacked least squares, the effect in common and the rest of each robot its own, by numbers drawn at random."""
    chance = np.random.default_rng(seed)
    sd, true = 0.1, chance.normal(size=2)
    robots, rows, results = [], [], []
    for member in range(members):
        own, shared = chance.normal(size=(30, 6)), chance.normal(size=(30, 2))
        seen = own @ chance.normal(size=6) + shared @ true + chance.normal(0.0, sd, 30)
        alone = np.hstack([own, shared])
        covariance = sd**2 * np.linalg.inv(alone.T @ alone)
        values = np.linalg.lstsq(alone, seen, rcond=None)[0][6:]
        robots.append(robot(f"{member}", effect(values=values, covariance=covariance[6:, 6:].tolist()), group="F1"))
        block = np.zeros((30, 6 * members + 2))
        block[:, 6 * member : 6 * member + 6], block[:, -2:] = own, shared
        rows.append(block)
        results.append(seen)
    everything = np.vstack(rows)
    expected = np.linalg.lstsq(everything, np.concatenate(results), rcond=None)[0][-2:]
    spread = np.sqrt(np.diag(sd**2 * np.linalg.inv(everything.T @ everything))[-2:])
    ((common,),) = [group["effects"] for group in groups_of(robots)]
    for row, name in enumerate(("v0", "v1")):
        held = common["parameters"][name]
        assert held["value"] == pytest.approx(expected[row], rel=1e-6, abs=1e-9)
        assert np.diff(held["ci95"])[0] / 2.0 == pytest.approx(1.959964 * spread[row], rel=1e-6)


def test_robots_that_differ_are_said_to_differ():
    sure = [[1e-4]]
    alike = [robot("A", effect(values=(0.10,), covariance=sure), group="F"), robot("C", spots=None, group="F")]
    near, far = (robot("B", effect(values=(value,), covariance=sure), group="F") for value in (0.11, 0.20))
    ((same,),) = [group["effects"] for group in groups_of([*alike, near])]
    ((apart,),) = [group["effects"] for group in groups_of([*alike, far])]
    assert (same["agree"], apart["agree"]) == (True, False)
    assert common_text(same).startswith("v0 0.105 +- 0.014")
    assert common_text(apart).startswith("they do NOT agree")


def test_values_that_each_robots_own_data_scale_are_no_common_ones():
    robots = [
        robot(name, effect(covariance=[[1e-4]], form={"full": full}), group="F")
        for name, full in (("A", 300), ("B", 590))
    ]
    assert groups_of(robots) == [{"group": "F", "robots": ["A", "B"], "effects": []}]


def row(name, state="done", **figures):
    failed = state == "failed"
    return {
        "name": name,
        "state": state,
        "code": "NO_ROBOT" if failed else "",
        "error": "<b>nothing there" if failed else "",
        "figures": figures,
        "traits": {"group": ""},
        "effects": [],
    }


def test_texts_of_strangers_are_escaped_and_links_lead_to_the_pages():
    done = row("R 1&2", spots=4, before=2.0, after=0.5, edits=8)
    record = line_record("<script>", [done, row("<i>", "failed"), row("W", "waiting")])
    page = line_page(record)
    assert "<script>" not in page
    assert "<i>" not in page
    assert "<b>nothing" not in page
    assert 'href="robots/R%201%262/fit.html"' in page
    assert "1 of 3 robots done, 1 failed, 1 still to do." in page


def test_totals_are_over_spots_and_the_table_has_a_row_a_robot():
    rows = [row("A", spots=10, before=3.0, after=1.0, edits=4), row("B", spots=30, before=1.0, after=1.0, edits=6)]
    record = line_record("line", rows)
    assert record["totals"]["before"] == pytest.approx(np.sqrt((10 * 9 + 30) / 40))
    assert (record["totals"]["spots"], record["totals"]["edits"]) == (40, 10)
    first, second, *_ = table(record["robots"]).splitlines()
    assert dict(zip(first.split(","), second.split(","), strict=True))["before"] == "3.000"
