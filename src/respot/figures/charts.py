"""Small charts as plain numbers: a template draws them as SVG.

Coordinates are those of the drawing (x to the right, y downwards), in units that a template scales to the page.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

#: Width of every drawing, and the margins of a scale.
WIDTH = 640.0
_SIDE = 14.0
#: A tolerance this many times the largest error would squeeze everything else together.
_FAR = 2.5
_TALLEST, _FLATTEST = 420.0, 90.0
#: Part of the drawing's width that a long arrow takes.
_ARROW = 0.09
_NAMED_SPOTS = 3
#: Width of a letter and height of a line at the size that a narrow page uses.
_LETTER, _LINE = 11.0, 21.0


@dataclass(frozen=True)
class Tick:
    """A mark of a scale."""

    x: float
    text: str


@dataclass(frozen=True)
class Strip:
    """Errors of the spots as dots over one scale, a row for each state.

    Parameters
    ----------
    width, height, base : float
        Size of the drawing, and where the scale lies.
    ticks : tuple of Tick
        Marks of the scale [mm].
    rows : tuple of tuple
        Label, height, and the dots: place, whether it stands out, name with error.
    tolerance : float or None
        Place of the tolerance; None where it lies outside.
    """

    width: float
    height: float
    base: float
    ticks: tuple[Tick, ...]
    rows: tuple[tuple[str, float, tuple[tuple[float, bool, str], ...]], ...]
    tolerance: float | None


@dataclass(frozen=True)
class Arrow:
    """A spot on the map: where it should be, where the magnified error leads, the arrow's head, what it is."""

    x: float
    y: float
    tip_x: float
    tip_y: float
    head: str
    drawn: bool
    outlier: bool
    title: str
    label: str
    label_y: float
    anchor: str
    leader: bool


@dataclass(frozen=True)
class Map:
    """The spots seen along one axis, with what is left at each as an arrow drawn ``magnified`` times longer."""

    width: float
    height: float
    right: str
    up: str
    away: str
    arrows: tuple[Arrow, ...]
    magnified: float
    scale_length: float
    scale_text: str
    arrow_length: float
    arrow_text: str


def share(value: float | None, largest: float) -> float:
    """Length of a bar in percent of the longest."""
    return 0.0 if value is None or largest <= 0 else round(100.0 * min(abs(value) / largest, 1.0), 2)


def nice(size: float) -> float:
    """Round down to 1, 2 or 5 times a power of ten."""
    if size <= 0 or not math.isfinite(size):
        return 1.0
    power = 10.0 ** math.floor(math.log10(size))
    return next(step * power for step in (5.0, 2.0, 1.0) if step * power <= size * (1 + 1e-9))


def strip(states: Sequence[tuple[str, Sequence[tuple[str, float, bool]]]], tolerance: float) -> Strip | None:
    """Lay out errors as dots.

    Parameters
    ----------
    states : sequence
        Label of each row, and its spots: name, error [mm], whether it stands out.
    tolerance : float
        Drawn as a line where it is near the errors [mm].
    """
    largest = max((error for _, spots in states for _, error, _ in spots), default=0.0)
    if largest <= 0:
        return None
    shown = 0 < tolerance <= _FAR * largest
    end = max(largest, tolerance if shown else 0.0)
    scale = (WIDTH - 2 * _SIDE) / end

    def at(value: float) -> float:
        return round(_SIDE + value * scale, 1)

    step = nice(end / 4)
    ticks = tuple(Tick(at(step * i), f"{step * i:g}") for i in range(int(end / step * (1 + 1e-9)) + 1))
    rows = tuple(
        (
            label,
            36.0 + 50.0 * row,
            tuple((at(error), stands_out, f"{name}: {error:.2f} mm") for name, error, stands_out in spots),
        )
        for row, (label, spots) in enumerate(states)
    )
    base = 8.0 + 50.0 * len(rows)
    return Strip(WIDTH, base + 30.0, base, ticks, rows, at(tolerance) if shown else None)


def spot_map(spots: Sequence[Mapping[str, Any]], away: int) -> Map | None:
    """Lay out the spots as seen along one axis.

    Parameters
    ----------
    spots : sequence of mapping
        Spots of the record: ``x y z`` where the model puts them, ``dx dy dz`` from the reference to there [mm].
    away : int
        The axis that points away from the page, 0 to 2.
    """
    right, up = (axis for axis in range(3) if axis != away)
    if len(spots) < 3:
        return None
    shifts = [(float(spot["d" + "xyz"[right]]), float(spot["d" + "xyz"[up]])) for spot in spots]
    places = [
        (float(spot["xyz"[right]]) - du, float(spot["xyz"[up]]) - dv)
        for spot, (du, dv) in zip(spots, shifts, strict=True)
    ]
    left, bottom = min(u for u, _ in places), min(v for _, v in places)
    wide, tall = max(u for u, _ in places) - left, max(v for _, v in places) - bottom
    if max(wide, tall) <= 0:
        return None
    margin = 0.12 * WIDTH
    scale = min((WIDTH - 2 * margin) / max(wide, 1e-9), _TALLEST / max(tall, 1e-9))
    inner = max(tall * scale, _FLATTEST)
    shift_x = margin + (WIDTH - 2 * margin - wide * scale) / 2
    shift_y = 70.0 + (inner - tall * scale) / 2
    kept = sorted(math.hypot(*shift) for shift, spot in zip(shifts, spots, strict=True) if spot.get("inlier", True))
    typical = kept[int(0.9 * (len(kept) - 1))] if kept else 0.0
    magnified = nice(_ARROW * WIDTH / (typical * scale)) if typical > 0 else 1.0
    worst = sorted(range(len(spots)), key=lambda row: -float(spots[row]["after"]))[:_NAMED_SPOTS]
    arrows, taken = [], list[tuple[float, float, float]]()
    for row, (spot, (u, v), (du, dv)) in enumerate(zip(spots, places, shifts, strict=True)):
        x, y = round(shift_x + (u - left) * scale, 1), round(shift_y + (tall - (v - bottom)) * scale, 1)
        inlier = bool(spot.get("inlier", True))
        tip_x, tip_y = round(x + du * scale * magnified, 1), round(y - dv * scale * magnified, 1)
        drawn = inlier and 0 <= tip_x <= WIDTH and 0 <= tip_y <= inner + 140
        title = f"{spot['id']}: {float(spot['after']):.2f} mm"
        label = str(spot["id"]) if row in worst else ""
        head = _head(x, y, tip_x, tip_y) if drawn else ""
        label_y = _free_height(x, y, drawn and tip_y < y, label, taken) if label else 0.0
        leader = bool(label) and abs(label_y - y) > 1.5 * _LINE
        arrows.append(Arrow(x, y, tip_x, tip_y, head, drawn, not inlier, title, label, label_y, _anchor(x), leader))
    length, error = nice(0.25 * WIDTH / scale), nice(0.12 * WIDTH / (scale * magnified))
    return Map(
        WIDTH,
        round(inner + 140, 1),
        "xyz"[right],
        "xyz"[up],
        "xyz"[away],
        tuple(arrows),
        magnified,
        round(length * scale, 1),
        f"{length:g} mm on the part",
        round(error * scale * magnified, 1),
        f"{error:g} mm of error",
    )


def _anchor(x: float) -> str:
    return "end" if x > 0.75 * WIDTH else "start" if x < 0.25 * WIDTH else "middle"


def _free_height(x: float, y: float, below: bool, label: str, taken: list[tuple[float, float, float]]) -> float:
    """Height for a name, on the side that the arrow leaves free and away from the names that stand already."""
    half = len(label) * _LETTER / 2
    middle = x + {"start": half, "middle": 0.0, "end": -half}[_anchor(x)]
    heights = [y + 20.0 + _LINE * step for step in range(3)], [y - 10.0 - _LINE * step for step in range(3)]
    for height in (*heights[not below], *heights[below]):
        if all(
            abs(height - other_y) >= _LINE or abs(middle - other) >= half + reach for other, other_y, reach in taken
        ):
            break
    taken.append((middle, height, half))
    return round(height, 1)


def _head(x: float, y: float, tip_x: float, tip_y: float) -> str:
    """Corners of an arrow's head; empty for an arrow too short to have one."""
    length = math.hypot(tip_x - x, tip_y - y)
    if length < 3.0:
        return ""
    size = min(8.0, 0.6 * length)
    u, v = (tip_x - x) / length, (tip_y - y) / length
    back_x, back_y = tip_x - size * u, tip_y - size * v
    corners = (
        (tip_x, tip_y),
        (back_x - 0.45 * size * v, back_y + 0.45 * size * u),
        (back_x + 0.45 * size * v, back_y - 0.45 * size * u),
    )
    return " ".join(f"{px:.1f},{py:.1f}" for px, py in corners)


def views(spots: Sequence[Mapping[str, Any]]) -> list[Map]:
    """Draw the view that shows the part at its largest, and one that shows the widest error where that hides it."""
    if not spots:
        return []
    extents = [
        max(float(spot[axis]) for spot in spots) - min(float(spot[axis]) for spot in spots) for axis in ("x", "y", "z")
    ]
    inliers = [spot for spot in spots if spot.get("inlier", True)] or list(spots)
    spreads = [math.fsum(float(spot[axis]) ** 2 for spot in inliers) for axis in ("dx", "dy", "dz")]
    order = sorted(range(3), key=lambda axis: extents[axis])
    chosen = [order[0]] + ([order[1]] if spreads[order[0]] == max(spreads) else [])
    return [drawn for away in chosen if (drawn := spot_map(spots, away)) is not None]
