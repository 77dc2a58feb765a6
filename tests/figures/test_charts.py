from __future__ import annotations

from itertools import pairwise

import pytest

from respot.figures.charts import WIDTH, nice, share, spot_map, strip, views


@pytest.mark.parametrize(
    ("size", "rounded"), [(9.9, 5), (5, 5), (4.9, 2), (1.9, 1), (0.03, 0.02), (1e-5, 1e-5), (0, 1)]
)
def test_nice_numbers(size, rounded):
    assert nice(size) == pytest.approx(rounded)


def test_bars_are_as_long_as_their_numbers():
    assert [share(value, 4.0) for value in (4.0, 1.0, 0.0, None, 9.0)] == [100.0, 25.0, 0.0, 0.0, 100.0]
    assert share(1.0, 0.0) == 0.0


def test_dots_lie_on_the_scale():
    drawn = strip([("before", [("A", 2.0, False), ("B", 8.0, True)]), ("after", [("A", 0.0, False)])], 4.0)
    assert drawn is not None
    zero, unit = drawn.ticks[0].x, (drawn.ticks[1].x - drawn.ticks[0].x) / float(drawn.ticks[1].text)
    before, after = (dots for _, _, dots in drawn.rows)
    assert [(x - zero) / unit for x, _, _ in before] == pytest.approx([2.0, 8.0], abs=0.01)
    assert after[0][0] == zero
    assert drawn.tolerance is not None
    assert (drawn.tolerance - zero) / unit == pytest.approx(4.0, abs=0.01)
    assert [outlier for _, outlier, _ in before] == [False, True]


def test_a_far_tolerance_does_not_squeeze_the_dots():
    drawn = strip([("before", [("A", 1.0, False)])], 10.0)
    assert drawn is not None
    assert drawn.tolerance is None


def test_without_errors_nothing_is_drawn():
    assert strip([("before", []), ("after", [("A", 0.0, False)])], 1.0) is None
    assert views([]) == []


def spot(name, place, shift, inlier=True):
    return {
        "id": name,
        **dict(zip("xyz", place, strict=True)),
        **dict(zip(("dx", "dy", "dz"), shift, strict=True)),
        "after": sum(part**2 for part in shift) ** 0.5,
        "inlier": inlier,
    }


def test_arrows_start_at_the_reference_and_lead_to_the_model():
    spots = [
        spot("A", (0.0, 1.0, 0.0), (0.0, 1.0, 0.0)),
        spot("B", (0.0, 400.0, 0.0), (0.0, 0.0, 0.0)),
        spot("C", (0.0, 400.0, 202.0), (0.0, 0.0, 2.0)),
        spot("D", (0.0, 0.0, 200.0), (9.0, 9.0, 9.0), inlier=False),
    ]
    drawn = spot_map(spots, 0)
    assert drawn is not None
    a, b, c, d = drawn.arrows
    assert (drawn.right, drawn.up, drawn.away) == ("y", "z", "x")
    unit = (b.x - a.x) / 400.0
    assert b.y == a.y
    assert b.y - c.y == pytest.approx(200.0 * unit, abs=0.2)
    assert a.tip_x - a.x == pytest.approx(unit * drawn.magnified, abs=0.2)
    assert (a.tip_y, c.tip_x) == (a.y, c.x)
    assert c.tip_y < c.y  # up
    assert d.outlier
    assert not d.drawn
    assert drawn.scale_length == pytest.approx(float(drawn.scale_text.split()[0]) * unit, abs=0.2)
    assert drawn.arrow_length == pytest.approx(float(drawn.arrow_text.split()[0]) * unit * drawn.magnified, abs=0.2)
    assert all(0 <= arrow.x <= WIDTH and 0 <= arrow.y <= drawn.height for arrow in drawn.arrows)


def test_a_second_view_shows_what_the_first_one_hides():
    flat = [spot(str(i), (0.0, 100.0 * i, 30.0 * (i % 3)), (0.0, 0.1, 0.0)) for i in range(8)]
    assert [view.away for view in views(flat)] == ["x"]
    deep = [{**one, "dx": 1.0} for one in flat]
    assert [view.away for view in views(deep)] == ["x", "z"]


def test_names_on_the_map_do_not_stand_on_each_other():
    spots = [spot(f"P02WP160970{i}", (0.0, 3.0 * i, 100.0 * (i > 5)), (0.0, 0.0, 1.0 + i / 10)) for i in range(9)]
    drawn = spot_map(spots, 0)
    assert drawn is not None
    heights = sorted(arrow.label_y for arrow in drawn.arrows if arrow.label)
    assert len(heights) == 3
    assert min(b - a for a, b in pairwise(heights)) >= 20


def test_spots_on_one_place_or_too_few_make_no_map():
    assert spot_map([spot("A", (1.0, 2.0, 3.0), (0.0, 0.0, 0.0))] * 4, 0) is None
    assert spot_map([spot("A", (1.0, 2.0, 3.0), (0.0, 0.0, 0.0))] * 2, 0) is None
