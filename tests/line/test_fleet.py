"""What is said over all robots of a line: which effects return, and on which robots."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import fisher_exact

from respot.figures.line_page import line_page
from respot.line.fleet import fleet_of
from respot.line.summary import line_record, table
from tests.line.found import effect, robot


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
