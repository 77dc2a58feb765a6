"""The result page of a fit: every part is told, nothing comes from outside, no text becomes markup."""

from __future__ import annotations

import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from respot.calibration.report import report
from respot.calibration.source_fit import FitOptions, fit_source
from respot.figures.fit_page import fit_page
from respot.figures.fit_sections import rigid_shift

ROOT = Path(__file__).parents[2]
VOID = {"meta", "br", "link", "img", "hr", "input"}


class Page(HTMLParser):
    """Checks that tags nest, and keeps the text, the attributes and the cells of a page."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.attributes: list[tuple[str, str, str]] = []
        self.texts: list[str] = []
        self.feed(html)
        self.close()
        assert not self.open, self.open

    def handle_starttag(self, tag, attrs):
        self.attributes += [(tag, name, value or "") for name, value in attrs]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.attributes += [(tag, name, value or "") for name, value in attrs]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if "style" not in self.open:
            self.texts.append(data)

    @property
    def text(self) -> str:
        return re.sub(r"\s+", " ", " ".join(self.texts))


def page(record: dict[str, Any], **more: Any) -> str:
    told = {"title": "040R02", "source": "backup.zip", "reference": "tracker.csv", "tolerance": 1.0, **more}
    return fit_page(record, **told)


def text_of(record: dict[str, Any], **more: Any) -> str:
    return Page(page(record, **more)).text


@pytest.mark.parametrize(
    "told",
    [
        "Four causes were found beyond a plain shift and turn: one named, three not proved.",
        "With these in the model the error of spots that took no part falls from 1.51 to 0.21 mm (RMS).",
        "Correct the spot list. Then check what is not proved, and put the robot right",
        "Not separated from sag of the arm under weight: that would fit as well.",
        "Measured: the reference says where the robot really went.",
        "100 in the source, 98 in the reference",
        "2 spots do not follow the model: more than 0.74 mm from where the model puts them : SP005 and SP041",
        "Only in the source : SP097, SP098, SP099 and SP100",
        "Only in the reference : TB_01 and TB_02",
        "SP003 = sp_003",
        "where the real robot goes",
        "the spots miss by 1.42 mm RMS",
        "What is left points mostly along y (direction 0.10, 0.99, 0.10), 3 times as much",
        "0.120 ± 0.013 degrees",
        "−0.00070 ± 0.00020 mm",
        "0.50 (0.10 to 1.60)",
        "not determined by these spots",
        "chance that luck alone shows this much: 1 in 1,000 (p = 0.001)",
        "spots left out of the fit miss by 0.92 mm less",
        "With this effect 0.21 Sag of the arm under weight 0.23 Mastering of axis 2 1.10",
        "Sag of axis 2 under weight 0.23 4 in 1,000 Lost to mastering of an axis.",
        "6 more",
        "How spots were held out: nested, 5 blocks in space (96 spots).",
        "judged under their repaired names: SP011 and SP021",
        "so what is left is 1.38 times the noise. The noise floor is not reached",
        "At the robot consistent with for: mastering of axis 3 Master axis 3 again at its mark",
        "never both",
        "Mastering of axis 1 100 %",
        "93 % shift and turn and mastering of an axis The same spots near and far from the robot.",
        "12 more spots needed",
        "Twelve spots with the elbow down.",
        "What is left is larger than the noise and follows temperature_c.",
        "temperature_c 0.41 2 in 1,000",
        "mastering of axis 3, or sag of the arm under weight",
        "2 of 96 lie more than 1 mm off",
        "SP005 is 7.31 mm off OUTLIER, t.csv:6",
        "Intervals hold only given the model that was chosen",
        "Collisions are never checked",
        "respot 9.9, method robust",
        "respot fit backup.zip",
        "3 (the same seed gives the same page)",
    ],
)
def test_everything_is_told(records, told):
    assert told.replace(" :", ":") in text_of(records.everything(), command="respot fit backup.zip").replace(" :", ":")


def test_as_found_is_not_shown_where_the_lists_share_no_coordinates(records):
    record = records.everything()
    assert "641" not in text_of(record)
    assert "641.0" in text_of({**record, "frame": "same"})


def test_nothing_found_is_a_result_too_and_is_said(records):
    text = text_of(records.nothing_found())
    assert "Nothing was found beyond a plain shift and turn of the whole list." in text
    assert "Nothing found is a result too." in text
    assert "Nothing: no effect explained the spots better" in text
    assert "The real, old cell must never load those files." in text
    assert "No single direction stands out." in text
    assert "consistent with" not in text.lower()
    assert "shift in x 10.000 ± 0.050 mm" in text


def test_something_unexplained_is_no_nothing(records):
    record = records.nothing_found()
    record["unexplained"] = {"present": True, "correlates": [{"column": "shift", "strength": 0.5, "p_value": 0.001}]}
    text = text_of(record)
    assert "no known effect explains it" in text
    assert "Repair nothing yet: measure more first. It goes together with shift." in text


def test_an_effect_that_does_not_help_is_not_sold(records):
    record = records.everything()
    record["heldout"]["after"]["rms"] = 2.0
    assert "does not fall" in text_of(record)


@pytest.mark.parametrize("make", ["everything", "nothing_found"])
def test_a_page_needs_nothing_from_outside(records, make):
    html = page(getattr(records, make)())
    assert not re.search(r"<script|<link|<img|<iframe|@import|url\(|https?:|\son\w+=", html, re.IGNORECASE)
    places = [value for _, name, value in Page(html).attributes if name in {"href", "src", "action", "data"}]
    assert all(place.startswith("#") for place in places)
    assert "default-src 'none'" in html


EVIL = "<script>alert('x')</script>&\"'"


def poisoned(value: Any, path: tuple[str, ...] = ()) -> Any:
    """Append markup to every text of a record but the words that it is read by."""
    if isinstance(value, dict):
        return {
            key if path != ("parameters",) else key + EVIL: poisoned(item, (*path, key)) for key, item in value.items()
        }
    if isinstance(value, list):
        return [poisoned(item, path) for item in value]
    return value + EVIL if isinstance(value, str) and path[-1] not in {"kind", "frame", "level"} else value


def test_a_text_never_becomes_markup(records):
    record = poisoned(records.everything())
    html = page(record, title=EVIL, source=EVIL, reference=EVIL, command=EVIL)
    assert "<script" not in html
    assert html.count("&lt;script&gt;") > 100
    assert EVIL in Page(html).text


def test_text_of_a_record_is_never_taken_for_a_template(records):
    record = records.nothing_found()
    record["spots"][0]["id"] = "{{ 7 * 7 }}{% raw %}"
    assert "{{ 7 * 7 }}{% raw %}" in text_of(record)


@pytest.mark.parametrize("key", sorted({"version", "method", "robust", "missing", "extra", "matching", "transform", "affine_12",
    "translation_only", "rotation_support", "residual_directions", "residual_sd_xyz", "effects", "effects_tried", "as_found",
    "after_all", "leave_one_out", "heldout", "inlier_threshold", "noise_floor", "noise", "unexplained", "spots", "hidden",
    "questions", "measure_next", "issues", "seed"}))  # fmt: skip
def test_what_a_record_lacks_is_left_out(records, key):
    for make in (records.everything, records.nothing_found):
        record = make()
        record.pop(key, None)
        Page(page(record))
        Page(page({**record, key: None}))


def test_effects_need_no_more_than_their_name(records):
    record = records.everything()
    record["effects"] = [{"name": "gun_flex_of_a_new_kind"}, {"name": "joint_zero"}]
    record["effects_tried"] = record["hidden"] = [{"name": "covariate"}]
    record["questions"] = [{"text": "why"}]
    record["unexplained"] = {"correlates": [{"column": "a"}]}
    text = text_of(record)
    assert "The spots follow gun flex of a new kind." in text
    assert "An axis of the robot is mastered off." in text


def test_many_parameters_are_folded_away(records):
    record = records.everything()
    value = {"value": 0.5, "unit": "deg", "ci95": [0.4, 0.6]}
    record["effects"] = [{"name": "link_geometry", "parameters": {f"axis_{i}": value for i in range(30)}}]
    html = page(record)
    assert "30 parameters, with 95 % intervals" in html
    assert html.count("0.50 ± 0.10 degrees") == 30
    assert html.index("0.50 ± 0.10 degrees") > html.index("30 parameters")


def test_spots_stand_worst_first_and_marked(records):
    html = page(records.everything())
    table = html[html.index('<div class="spots">') :]
    rows = re.findall(r"<tr( class=\"out\")?><td>(SP\d+)</td><td class=\"n\">([\d.]+)</td>", table)
    after = [float(value) for _, _, value in rows]
    assert len(rows) == 96
    assert after == sorted(after, reverse=True)
    assert [name for marked, name, _ in rows if marked] == ["SP005", "SP041"]
    assert "out of tolerance, outlier" in table
    assert table.count("name repaired") == 2


def test_drawings_hold_finite_numbers(records):
    for record in (records.everything(), records.nothing_found()):
        html = page(record)
        for tag, name, value in Page(html).attributes:
            if tag in {"rect", "line", "circle", "svg", "text"} and name in {
                "x",
                "y",
                "x1",
                "x2",
                "y1",
                "y2",
                "cx",
                "cy",
                "r",
            }:
                assert abs(float(value)) < 5_000
        assert not re.search(r"\b(nan|inf|None|Undefined)\b", html)


def test_bytes_that_are_no_text_do_not_stop_a_page(records):
    html = page(records.nothing_found(), source="backup\udcfc.zip")
    assert "backup\\udcfc.zip" in html
    html.encode("utf-8")


@pytest.mark.parametrize("method", ["robust", "paper", "affine"])
def test_the_rear_door(method):
    fitted = fit_source(
        ROOT / "samples/rear_door/kuka", ROOT / "samples/rear_door/theory.csv", FitOptions("theory", method=method)
    )
    record = report(fitted.fit)
    text = text_of(record, tolerance=10.0, issues=[issue.as_json() for issue in fitted.issues])
    assert "Spots P02WP1615442 and P02WP1609713 carry each other's names in one of the two lists." in text
    assert "falls from 16.50 to 5.78 mm" in text
    assert "Correct the spot list." in text
    assert "EXCHANGED_NAMES" in text
    assert ("for comparison only" in text) == (method == "affine")
    assert ("programs for the cell as simulated" in text) == (method != "affine")


def test_many_spots(records):
    record = records.nothing_found()
    record["spots"] = records.spots(2000, 0.3)
    html = page(record)
    assert html.count("<td>SP") == 2000
    assert len(html) < 2_500_000


def test_the_shift_is_that_of_the_middle_of_the_spots():
    centre, turn, shift = np.array([4300.0, 20.0, 1400.0]), np.array([0.4, -0.3, 1.2]), np.array([60.0, -20.0, 30.0])
    rotation = Rotation.from_rotvec(turn, degrees=True)
    transform = {
        "rotation": rotation.as_matrix().tolist(),
        "translation": (centre - rotation.apply(centre - shift)).tolist(),
        "centroid": centre.tolist(),
        "ci95": dict.fromkeys(("tx", "ty", "tz", "rx", "ry", "rz"), 0.01),
    }
    told = rigid_shift({"frame": "same", "transform": transform})
    assert told is not None
    values = [float(value.split(" +- ")[0]) for _, value in told["rows"]]
    assert values == pytest.approx([*shift, *turn], abs=0.001)
