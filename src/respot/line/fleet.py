"""Looks over all robots of a line: which effects return, on which robots, and whether robots of a group agree.

Nothing here changes a robot's own result: robots of one group are fitted one by one, and what they have in common is
told from their results, with the test whether these agree.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import comb, hypot
from statistics import median
from typing import Any

import numpy as np
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
        ``effect``, ``label``, ``robots`` that show it, ``of`` how many that were fitted, ``named`` on how many, its
        ``size`` (median, least, most; None where one number does not tell it), and ``goes_with``: traits whose robots
        show it more often than they would by luck (one-sided, hypergeometric, times the number of values looked at).
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
        ``group``, ``robots`` fitted, and ``effects`` that two or more of them show: ``parameters``, the common values
        with their 95 % intervals, and ``agree_p``, the chance that the robots differ as much though the values are one.
        Robots that do not show an effect have no part in its values. Vectors are in each robot's own world frame.
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
        told = [common for pairs in found.values() if (common := _common(pairs)) is not None]
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


def _common(pairs: Sequence[tuple[Row, Row]]) -> dict[str, Any] | None:
    """Estimate of an effect from several robots together; None where they do not say how sure they are.

    Weighing each robot's values by the inverse of their covariance gives what one least-squares fit of all robots
    gives, with the effect in common and everything else of each robot its own. Values that each robot's own data scale
    (the most welds of its caps, the middle of its spots) are no common ones.
    """
    first = pairs[0][1]
    names = list(first["parameters"])
    known = [
        (robot, np.array([effect["parameters"][name]["value"] for name in names]), np.array(effect["covariance"]))
        for robot, effect in pairs
        if list(effect["parameters"]) == names and effect["covariance"] and effect["form"] == first["form"]
    ]
    if len({robot["name"] for robot, _, _ in known}) < 2:
        return None
    weights = [np.linalg.pinv(covariance, hermitian=True) for _, _, covariance in known]
    together = np.linalg.pinv(np.sum(weights, axis=0), hermitian=True)
    mean = together @ np.sum([weight @ value for weight, (_, value, _) in zip(weights, known, strict=True)], axis=0)
    off = [(value - mean, weight) for weight, (_, value, _) in zip(weights, known, strict=True)]
    apart = sum(float(shift @ weight @ shift) for shift, weight in off)
    agree = float(chdtrc((len(known) - 1) * len(names), apart))
    half = _HALF * np.sqrt(np.maximum(np.diag(together), 0.0))
    return {
        "effect": {"name": first["name"], "where": _place(first)},
        "label": label_of(first),
        "robots": [robot["name"] for robot, _, _ in known],
        "parameters": {
            name: {
                "unit": first["parameters"][name]["unit"],
                "value": float(mean[row]),
                "ci95": [float(mean[row] - half[row]), float(mean[row] + half[row])],
            }
            for row, name in enumerate(names)
        },
        "agree_p": agree,
        "agree": agree >= _RARE,
    }


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
