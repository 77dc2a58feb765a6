"""The list of effects, and how a wish such as ``joint_zero@3:0.5`` is read."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from difflib import get_close_matches

import numpy as np

from respot.simulation import effects_arm as arm
from respot.simulation import effects_cell as cell
from respot.simulation import effects_gun as gun
from respot.simulation import effects_outside as outside
from respot.simulation.state import Cell, Effect

Maker = Callable[[Cell, np.random.Generator, str | None], Effect]

_KNOWN: dict[str, Maker] = {
    "joint_zero": arm.joint_zero,
    "joint_profile": arm.joint_profile,
    "gear": arm.gear,
    "link_length": arm.link_length,
    "link_geometry": arm.link_geometry,
    "gravity_sag": arm.gravity_sag,
    "backlash": arm.backlash,
    "readback_lag": arm.readback_lag,
    "tool_offset": gun.tool_offset,
    "gun_sag": gun.gun_sag,
    "gun_deflection": gun.gun_deflection,
    "tip_wear": gun.tip_wear,
    "scale": cell.scale,
    "drift": cell.drift,
    "warmup": cell.warmup,
    "group_shift": cell.group_shift,
    "rail": cell.rail,
    "covariate": cell.covariate,
    "deformation": cell.deformation,
    "swapped_ids": cell.swapped_ids,
    "convention": cell.convention,
}
_OUTSIDE: dict[str, Maker] = {
    "axis_scale": outside.axis_scale,
    "gun_flex": outside.gun_flex,
    "refraction": outside.refraction,
    "hvac": outside.hvac,
    "cable_drag": outside.cable_drag,
    "floor": outside.floor,
}
#: Effects of the catalogue, and effects that the engine has no file for.
EFFECTS: tuple[str, ...] = tuple(_KNOWN)
OUTSIDE: tuple[str, ...] = tuple(_OUTSIDE)


@dataclass(frozen=True)
class Wish:
    """An effect as asked for: kind, place if any, and what it shall leave [mm]."""

    name: str
    place: str | None = None
    size: float | None = None


def read_wish(text: str) -> Wish:
    """Read ``NAME[@PLACE][:SIZE]``.

    Raises
    ------
    ValueError
        There is no such effect (the message suggests one), or the size is no positive number.
    """
    front, colon, size_text = text.partition(":")
    name, at, place = front.partition("@")
    if name not in _KNOWN and name not in _OUTSIDE:
        names = (*EFFECTS, *OUTSIDE)
        close = get_close_matches(name, names, n=1)
        hint = f"did you mean {close[0]}?" if close else f"there are {', '.join(names)}"
        raise ValueError(f"no effect {name} can be simulated: {hint}")
    size = None
    if colon:
        try:
            size = float(size_text)
        except ValueError:
            size = math.nan
        if not (math.isfinite(size) and size > 0):
            raise ValueError(f"{text}: {size_text!r} is no size in mm")
    if at and not place:
        raise ValueError(f"{text}: the place is empty")
    return Wish(name, place or None, size)


def make_effect(wish: Wish, where: Cell, rng: np.random.Generator) -> Effect:
    """Draw the effect that was asked for, at an amplitude of one."""
    if wish.name == "swapped_ids":
        return cell.swapped_ids(where, rng, wish.place, wish.size)
    return {**_KNOWN, **_OUTSIDE}[wish.name](where, rng, wish.place)
