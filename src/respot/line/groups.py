"""What robots that share a fixture or a rail have in common, as one fit of them all would have it.

Each robot is fitted by itself. Weighing each robot's values by the inverse of their covariance gives what one
least-squares fit of all robots gives, with the effect in common and everything else of each robot its own. Nothing here
changes a robot's own programs.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from respot.line.fleet import Row, key_of, label_of, place_of

Array = NDArray[np.float64]
#: Effects that lie in what is shared; mastering of an axis or a worn tip is each robot's own affair.
_SHARED = ("group_shift", "rail", "scale", "deformation")
#: Half a 95 % interval in standard deviations.
_HALF = 1.959964
#: Robots disagree below this chance.
_RARE = 0.01


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
        found: dict[str, list[tuple[str, Row]]] = {}
        for robot in fitted:
            for effect in robot["effects"]:
                if effect["name"] in _SHARED:
                    found.setdefault(key_of(effect), []).append((robot["name"], effect))
        told = [common for pairs in found.values() if (common := _common(pairs)) is not None]
        groups.append({"group": group, "robots": [robot["name"] for robot in fitted], "effects": told})
    return groups


def _common(pairs: Sequence[tuple[str, Row]]) -> dict[str, Any] | None:
    """Estimate of an effect from several robots together; None where they do not say the same, or not how surely."""
    first = pairs[0][1]
    names = list(first["parameters"])
    known = []
    for robot, effect in pairs:
        way = _to_the_form_of(first, effect)
        if way is None or list(effect["parameters"]) != names or not effect["covariance"]:
            continue
        values = np.array([effect["parameters"][name]["value"] for name in names], dtype=float)  # None is none
        covariance = np.array(effect["covariance"])
        if np.isfinite(values).all() and np.isfinite(covariance).all():
            known.append((robot, way @ values, way @ covariance @ way.T))
    if len(known) < 2:
        return None
    weights = [np.linalg.pinv(covariance, hermitian=True) for _, _, covariance in known]
    together = np.linalg.pinv(np.sum(weights, axis=0), hermitian=True)
    mean = together @ np.sum([weight @ value for weight, (_, value, _) in zip(weights, known, strict=True)], axis=0)
    off = [(value - mean, weight) for weight, (_, value, _) in zip(weights, known, strict=True)]
    agree = float(chdtrc((len(known) - 1) * len(names), sum(float(shift @ weight @ shift) for shift, weight in off)))
    half = _HALF * np.sqrt(np.maximum(np.diag(together), 0.0))
    return {
        "effect": {"name": first["name"], "where": place_of(first)},
        "label": label_of(first),
        "robots": [robot for robot, _, _ in known],
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


def _to_the_form_of(first: Row, effect: Row) -> Array | None:
    """Matrix that turns an effect's values into what they would be in the form of another; None if there is none.

    Forms hold what each robot's own data decide: a centre of its spots, the travel of its rail.
    """
    own, other = effect["form"], first["form"]
    n = len(effect["parameters"])
    if own is None or other is None:
        return None
    if effect["name"] == "group_shift" and own.get("moves") == other.get("moves") in ("shift", "body"):
        return np.eye(n) if n == 3 else _motion_about(np.subtract(other["centre"], own["centre"]))
    if effect["name"] == "scale":  # a shift of its centre is one of the whole, and each robot's own
        return np.eye(n)
    if effect["name"] == "rail" and own.get("form") == other.get("form") == "direction":
        return np.asarray(np.eye(n) * (other["half"] / own["half"]))
    return np.eye(n) if own == other else None


def _motion_about(to: Array) -> Array:
    """Matrix (6, 6) that gives a small rigid motion [mm, deg] about a centre that lies ``to`` (3,) [mm] farther on."""
    x, y, z = np.radians(to)
    way = np.eye(6)
    way[:3, 3:] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    return way
