"""Looks over all robots of a line: which effects return, and on which kind of robots."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import comb, hypot
from statistics import median
from typing import Any

from respot.figures.words import effect_noun

Row = Mapping[str, Any]
#: What tells one occurrence of an effect from another; names of spots do not.
_PLACES = ("axis", "axes", "parameter", "link", "column", "level", "external_axis", "frame")
_TRAITS = ("group", "station", "gun", "generation", "language", "model")
#: A trait goes together with an effect below this chance.
_RARE = 0.01


def fleet_of(robots: Sequence[Row]) -> list[dict[str, Any]]:
    """Effects of a line, those on most robots first.

    Parameters
    ----------
    robots : sequence of mapping
        Robots of a line's record.

    Returns
    -------
    list of dict
        ``effect``, ``label``, ``robots`` that show it, ``of`` how many that were fitted, ``named`` on how many, its
        ``size`` (median, least, most; None where one number does not tell it), and ``goes_with``: traits whose robots
        show it more often than they would by luck (one-sided, hypergeometric, times the number of values looked at).
    """
    fitted = [robot for robot in robots if robot["spots"] is not None]
    found: dict[str, list[tuple[Row, Row]]] = {}
    for robot in fitted:
        for effect in robot["effects"]:
            found.setdefault(key_of(effect), []).append((robot, effect))
    rows = [_effect(pairs, fitted) for pairs in found.values()]
    return sorted(rows, key=lambda row: (-row["count"], row["label"]))


def label_of(effect: Row) -> str:
    """What an effect is called, with its place."""
    return effect_noun(effect["name"], place_of(effect))


def place_of(effect: Row) -> dict[str, Any]:
    """Where an effect is, as far as it is the same on several robots."""
    return {key: effect["where"][key] for key in _PLACES if key in (effect.get("where") or {})}


def key_of(effect: Row) -> str:
    """What makes effects of two robots the same."""
    return f"{effect['name']} {place_of(effect)}"


def _effect(pairs: Sequence[tuple[Row, Row]], fitted: Sequence[Row]) -> dict[str, Any]:
    first = pairs[0][1]
    names = {robot["name"] for robot, _ in pairs}
    return {
        "effect": {"name": first["name"], "where": place_of(first)},
        "label": label_of(first),
        "robots": [robot["name"] for robot in fitted if robot["name"] in names],
        "count": len(names),
        "of": len(fitted),
        "named": sum(bool(effect["named"]) for _, effect in pairs),
        "size": _size([effect for _, effect in pairs]),
        "goes_with": _goes_with(names, fitted),
    }


def _goes_with(names: set[str], fitted: Sequence[Row]) -> list[dict[str, Any]]:
    """Values of traits whose robots show an effect more often than luck would have it."""
    if len(names) < 2:
        return []
    looked_at = [
        (trait, value)
        for trait in _TRAITS
        for value in sorted({robot[trait] for robot in fitted if robot[trait]})
        if len({robot[trait] for robot in fitted}) > 1
    ]
    found = []
    for trait, value in looked_at:
        those = [robot["name"] for robot in fitted if robot[trait] == value]
        showing = sum(name in names for name in those)
        p_value = min(1.0, _tail(showing, len(those), len(names), len(fitted)) * len(looked_at))
        if p_value < _RARE:
            elsewhere = {"showing": len(names) - showing, "of": len(fitted) - len(those)}
            found.append(
                {"trait": trait, "value": value, "showing": showing, "of": len(those), "elsewhere": elsewhere}
                | {"p_value": p_value}
            )
    return sorted(found, key=lambda item: item["p_value"])


def _tail(showing: int, drawn: int, marked: int, total: int) -> float:
    """Chance that of ``drawn`` robots ``showing`` or more are among the ``marked`` of all."""
    ways = sum(
        comb(marked, k) * comb(total - marked, drawn - k)
        for k in range(showing, min(drawn, marked) + 1)
        if drawn - k <= total - marked
    )
    return ways / comb(total, drawn)


def _magnitude(effect: Row) -> tuple[float, str] | None:
    """How large an effect is as one number: its one parameter, or the length of its shift in mm."""
    known = {name: held for name, held in effect["parameters"].items() if held["value"] is not None}
    if len(known) == 1:
        (held,) = known.values()
        return abs(held["value"]), held["unit"]
    if not set("xyz") <= set(known) or any(known[axis]["unit"] != "mm" for axis in "xyz"):
        return None
    return hypot(*(known[axis]["value"] for axis in "xyz")), "mm"


def _size(effects: Sequence[Row]) -> dict[str, Any] | None:
    found = [magnitude for effect in effects if (magnitude := _magnitude(effect)) is not None]
    if not found or len({unit for _, unit in found}) > 1:
        return None
    values = [value for value, _ in found]
    return {"unit": found[0][1], "median": median(values), "least": min(values), "most": max(values)}
