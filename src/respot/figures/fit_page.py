"""The page of ``respot fit``: what was found, how sure that is, what to do, for someone who never saw the program."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from respot import __version__
from respot.figures.charts import strip, views
from respot.figures.fit_sections import (
    added,
    compared,
    errors,
    losers,
    remedies,
    residual,
    rigid_shift,
    spot_rows,
    unsaid,
)
from respot.figures.pages import render
from respot.figures.verdict import record_of_causes, verdict
from respot.figures.words import figure

_LEVELS = ("error", "warning", "info")
#: More dots than this carry no names of their own: the page would grow by half.
_MOST_NAMED_DOTS = 400
_FINAL = {"paper": "the paper's method", "affine": "12 free numbers"}


def fit_page(
    record: Mapping[str, Any],
    *,
    title: str,
    source: str,
    reference: str,
    tolerance: float,
    command: str = "",
    issues: Sequence[Mapping[str, Any]] = (),
    seed: int | None = None,
) -> str:
    """Return the result page of a fit as one HTML file that needs nothing from outside.

    Parameters
    ----------
    record : mapping
        The JSON object of ``respot fit``; keys that it lacks leave their part of the page out.
    title : str
        What was fitted, e.g. the robot and its program.
    source, reference : str
        Where the two lists came from.
    tolerance : float
        Spots farther off after the fit are marked [mm].
    command : str
        The command line that made the result.
    issues : sequence of mapping
        Issues as in the JSON; those of the record where none are given.
    seed : int, optional
        Seed of what was drawn at random; that of the record where none is given.
    """
    causes = record_of_causes(record)
    spots: Sequence[Mapping[str, Any]] = record.get("spots") or ()
    told = list(issues or record.get("issues") or ())
    values = {
        "title": title,
        "theory": record.get("kind") == "theory",
        "method": record.get("method"),
        "verdict": verdict(record),
        "tiles": _tiles(record, tolerance),
        "compared": compared(record, source, reference),
        "shift": rigid_shift(record),
        "residual": residual(record),
        "effects": [added(effect) for effect in causes.get("effects") or ()],
        "losers": losers(record),
        "errors": errors(record),
        "strip": _strip(spots, tolerance),
        "maps": views(spots),
        "remedies": remedies(record),
        "unsaid": unsaid(record),
        "spots": spot_rows(record, tolerance),
        "tolerance": f"{tolerance:g}",
        "issues": sorted(told, key=lambda issue: _LEVELS.index(issue["level"]) if issue["level"] in _LEVELS else 0),
        "version": record.get("version") or __version__,
        "seed": record.get("seed") if seed is None else seed,
        "command": command,
        "hash": record.get("calibration_hash"),
    }
    return render("fit.html.j2", values)


def _tiles(record: Mapping[str, Any], tolerance: float) -> list[dict[str, str]]:
    """The four numbers at the top; each is an RMS of 3D distances but the last."""
    tiles = []
    if record.get("frame") == "same" and record.get("as_found"):
        tiles.append({"label": "as found", "value": figure(record["as_found"]["rms"]), "unit": "mm"})
    for label, key in (
        ("plain shift and turn", "before"),
        (_FINAL.get(str(record.get("method")), "final model"), "after"),
    ):
        tiles.append({"label": label, "value": figure(record[key]["rms"]), "unit": "mm"})
    heldout = (record.get("heldout") or {}).get("after")
    if heldout:
        tiles.append({"label": "spots held out", "value": figure(heldout["rms"]), "unit": "mm"})
    spots = record.get("spots") or ()
    within = sum(float(spot["after"]) <= tolerance for spot in spots)
    note = f"spots within {tolerance:g} mm"
    tiles.append({"label": note, "value": f"{within}", "unit": f"of {len(spots)}"})
    return tiles


def _strip(spots: Sequence[Mapping[str, Any]], tolerance: float) -> Any:
    def row(key: str) -> list[tuple[str, float, bool]]:
        named = len(spots) <= _MOST_NAMED_DOTS
        return [(str(spot["id"]) if named else "", float(spot[key]), not spot.get("inlier", True)) for spot in spots]

    return strip([("before", row("before")), ("after", row("after"))], tolerance) if spots else None
