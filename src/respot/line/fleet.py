"""Looks over all robots of a line: which effects return, on which robots, and whether robots of a group agree.

Nothing here changes a robot's own result. Robots of one group are fitted one by one; what they have in common is told
from their results, with the test whether these agree.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import comb, isfinite, sqrt
from statistics import median
from typing import Any

from scipy.special import chdtrc

from respot.figures.words import effect_noun

Row = Mapping[str, Any]
#: What tells one occurrence of an effect from another; names of spots do not.
_PLACES = ("axis", "axes", "parameter", "link", "column", "level", "external_axis", "frame")
_TRAITS = ("group", "station", "gun", "generation", "language", "model")
#: Half a 95 % interval in standard deviations.
_HALF = 1.959964
#: A trait goes together with an effect, or robots of a group disagree, below this chance.
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
        ``effect``, ``label``, ``robots`` that show it, ``of`` how many that were fitted, ``named`` on how many,
        ``sizes`` of each parameter (median, least, greatest), and ``goes_with``: traits whose robots show it more often
        than the others would by luck (one-sided, hypergeometric, times the number of values that were looked at).
    """
    fitted = [robot for robot in robots if robot["spots"] is not None]
    found: dict[str, list[tuple[Row, Row]]] = {}
    for robot in fitted:
        for effect in robot["effects"]:
            found.setdefault(_key(effect), []).append((robot, effect))
    rows = [_effect(pairs, fitted) for pairs in found.values()]
    return sorted(rows, key=lambda row: (-row["count"], row["label"]))


def groups_of(robots: Sequence[Row]) -> list[dict[str, Any]]:
    """Common effects of the robots of each group.

    Returns
    -------
    list of dict
        ``group``, ``robots`` fitted, and for each effect that two or more of them show ``parameters``: the common value
        with its 95 % interval (each robot's weighs by its own), and ``agree_p``, the chance that they differ as much
        though they are one. Vectors are in each robot's own world frame.
    """
    members: dict[str, list[Row]] = {}
    for robot in robots:
        if robot["group"] and robot["spots"] is not None:
            members.setdefault(robot["group"], []).append(robot)
    groups = []
    for group, fitted in members.items():
        found: dict[str, list[tuple[Row, Row]]] = {}
        for robot in fitted:
            for effect in robot["effects"]:
                found.setdefault(_key(effect), []).append((robot, effect))
        common = [_common(pairs) for pairs in found.values() if len({robot["name"] for robot, _ in pairs}) > 1]
        told = [effect for effect in common if effect["parameters"]]
        groups.append({"group": group, "robots": [robot["name"] for robot in fitted], "effects": told})
    return groups


def label_of(effect: Row) -> str:
    """What an effect is called, with its place."""
    return effect_noun(effect["name"], _place(effect))


def _place(effect: Row) -> dict[str, Any]:
    return {key: effect["where"][key] for key in _PLACES if key in (effect.get("where") or {})}


def _key(effect: Row) -> str:
    return f"{effect['name']} {_place(effect)}"


def _effect(pairs: Sequence[tuple[Row, Row]], fitted: Sequence[Row]) -> dict[str, Any]:
    first = pairs[0][1]
    names = {robot["name"] for robot, _ in pairs}
    return {
        "effect": {"name": first["name"], "where": _place(first)},
        "label": label_of(first),
        "robots": [robot["name"] for robot in fitted if robot["name"] in names],
        "count": len(names),
        "of": len(fitted),
        "named": sum(bool(effect["named"]) for _, effect in pairs),
        "sizes": _sizes([effect for _, effect in pairs]),
        "goes_with": _goes_with(names, fitted),
    }


def _sizes(effects: Sequence[Row]) -> dict[str, dict[str, Any]]:
    sizes = {}
    for name in dict.fromkeys(name for effect in effects for name in effect["parameters"]):
        held = [effect["parameters"][name] for effect in effects if name in effect["parameters"]]
        values = [item["value"] for item in held if item["value"] is not None]
        if values:
            sizes[name] = {"unit": held[0]["unit"], "median": median(values), "least": min(values), "most": max(values)}
    return sizes


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


def _common(pairs: Sequence[tuple[Row, Row]]) -> dict[str, Any]:
    first = pairs[0][1]
    parameters = {}
    for name, held in first["parameters"].items():
        values = [_value_and_sd(effect["parameters"].get(name)) for _, effect in pairs]
        known = [value for value in values if value is not None]
        if len(known) < 2:
            continue
        weights = [1.0 / sd**2 for _, sd in known]
        mean = sum(weight * value for weight, (value, _) in zip(weights, known, strict=True)) / sum(weights)
        spread = sum(weight * (value - mean) ** 2 for weight, (value, _) in zip(weights, known, strict=True))
        half = _HALF / sqrt(sum(weights))
        agree = float(chdtrc(len(known) - 1, spread))
        parameters[name] = {
            "unit": held["unit"],
            "value": mean,
            "ci95": [mean - half, mean + half],
            "agree_p": agree,
            "agree": agree >= _RARE,
        }
    return {
        "effect": {"name": first["name"], "where": _place(first)},
        "label": label_of(first),
        "robots": [robot["name"] for robot, _ in pairs],
        "parameters": parameters,
    }


def _value_and_sd(parameter: Row | None) -> tuple[float, float] | None:
    """Value and standard deviation of a parameter with an interval."""
    if parameter is None or parameter["value"] is None or not parameter.get("ci95"):
        return None
    low, high = parameter["ci95"]
    if low is None or high is None or not isfinite(high - low) or high <= low:
        return None
    return float(parameter["value"]), (high - low) / (2.0 * _HALF)
