"""The index page of ``respot migrate``: every robot of a line, what returns on many, and what failed and why."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any
from urllib.parse import quote

from respot import __version__
from respot.figures.pages import render
from respot.figures.words import count, decimals_of, effect_noun, figure, listing, size, with_unit

Row = Mapping[str, Any]
_TRAITS = {"language": "maker", "model": "robot type"}
_MAKERS = {"krl": "KUKA", "rapid": "ABB"}
#: Robots that are named beside an effect; the table below has them all.
_MOST_NAMED = 8
_MOST_VALUES = 6


def line_page(record: Mapping[str, Any]) -> str:
    """Return the page of a line as one HTML file; it links to the pages of its robots.

    Parameters
    ----------
    record : mapping
        The JSON object of ``respot migrate``.
    """
    robots: Sequence[Row] = record["robots"]
    values = {
        "line": record["line"],
        "headline": headline(record["totals"]),
        "tiles": _tiles(record["totals"]),
        "failed": [robot for robot in robots if robot["state"] == "failed"],
        "refused": [robot for robot in robots if robot["refused"]],
        "fleet": [_effect(row) for row in record["fleet"] if row["count"] > 1],
        "single": sum(row["count"] == 1 for row in record["fleet"]),
        "groups": [_group(group) for group in record["groups"] if group["effects"]],
        "robots": [_robot(robot) for robot in robots],
        "version": record.get("version") or __version__,
    }
    return render("line.html.j2", values)


def headline(totals: Mapping[str, Any]) -> str:
    """Say how a line stands, in a sentence."""
    parts = [f"{totals['done']} of {count(totals['robots'], 'robot')} done"]
    if totals["failed"]:
        parts.append(f"{totals['failed']} failed")
    if totals["refused"]:
        left = "as it was" if totals["refused"] == 1 else "as they were"
        parts.append(f"{count(totals['refused'], 'program')} refused and left {left}")
    open_ones = totals["waiting"] + totals["running"]
    if open_ones:
        parts.append(f"{open_ones} still to do")
    return ", ".join(parts) + "."


def _tiles(totals: Mapping[str, Any]) -> list[dict[str, str]]:
    return [
        {"label": "spots fitted", "value": str(totals["spots"]), "unit": ""},
        {"label": "before, RMS of all spots", "value": figure(totals["before"]), "unit": "mm"},
        {"label": "after", "value": figure(totals["after"]), "unit": "mm"},
        {"label": "robots with an effect", "value": str(totals["with_effects"]), "unit": ""},
        {"label": "targets changed", "value": str(totals["edits"]), "unit": ""},
    ]


def _effect(row: Row) -> dict[str, Any]:
    names = row["robots"]
    more = len(names) - _MOST_NAMED
    return {
        "label": row["label"],
        "count": row["count"],
        "of": row["of"],
        "named": row["named"],
        "size": size_text(row["size"]),
        "goes_with": [goes_with_text(item) for item in row["goes_with"]],
        "robots": ", ".join(names[:_MOST_NAMED]) + (f" and {more} more" if more > 0 else ""),
    }


def size_text(held: Row | None) -> str:
    """Say how large an effect is over the robots that show it; empty where one number does not tell."""
    if held is None:
        return ""
    low, middle, high = (figure(held[key]) for key in ("least", "median", "most"))
    return with_unit(f"{middle} ({low} to {high})", held["unit"])


def goes_with_text(item: Row) -> str:
    """Say on which robots an effect gathers."""
    value = _MAKERS.get(item["value"], item["value"])
    elsewhere = item["elsewhere"]
    return (
        f"{_TRAITS.get(item['trait'], item['trait'])} {value}: {item['showing']} of {item['of']}, elsewhere "
        f"{elsewhere['showing']} of {elsewhere['of']}"
    )


def common_text(effect: Row) -> str:
    """Say what values robots of a group have in common, or that they do not."""
    if not effect["agree"]:
        return f"they do NOT agree (p = {effect['agree_p']:.1g}): each has its own"
    if len(effect["parameters"]) > _MOST_VALUES:
        return f"they agree (p = {effect['agree_p']:.2g}); {len(effect['parameters'])} values, in the JSON"
    texts = []
    for name, held in effect["parameters"].items():
        half = (held["ci95"][1] - held["ci95"][0]) / 2.0
        value = f"{figure(held['value'], decimals_of(half))} +- {figure(half, decimals_of(half))}"
        texts.append(with_unit(f"{name} {value}", held["unit"]))
    return "; ".join(texts)


def _group(group: Row) -> dict[str, Any]:
    return {
        "group": group["group"],
        "robots": len(group["robots"]),
        "effects": [
            {
                "label": effect["label"],
                "robots": listing(effect["robots"]),
                "common": common_text(effect),
            }
            for effect in group["effects"]
        ],
    }


def _robot(robot: Row) -> dict[str, Any]:
    effects = []
    for effect in robot["effects"]:
        amount = size(effect["parameters"])
        text = effect_noun(effect["name"], effect["where"])
        effects.append({"text": f"{text}, {amount}" if amount else text, "named": effect["named"]})
    return {
        **robot,
        "href": None if robot["page"] is None else quote(robot["page"]),
        "maker": _MAKERS.get(robot["language"], ""),
        "found": effects,
        "numbers": [figure(robot[key]) if robot[key] is not None else "" for key in ("before", "after", "heldout")],
    }
