"""Plain words of the trade for what a fit found: effects, places, numbers, chances.

Shared by the page and the terminal, so nothing here knows of HTML. The spelling ``+-`` is plain on purpose: whoever can
show a better sign replaces it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

#: Names of spots that stand in running text; the rest are counted.
MOST_IN_A_SENTENCE = 6
#: Two half widths this close are one.
_ALIKE = 0.05
_COMPONENT = re.compile(r"[dt]?_?[xyz](?:_mm)?")
_LABEL = re.compile(r" (axis|axes|column|level|parameter|external_axis|ids|frame|link|list|reading|written|real) ")
_UNITS = {"deg": "degrees", "degree": "degrees", "1": "", "": "", "percent": "%"}


@dataclass(frozen=True)
class EffectWords:
    """How an effect is spoken of.

    Parameters
    ----------
    noun : str
        What it is called in a list of causes.
    sentence : str
        What it says about this robot; ``{where}`` and ``{size}`` are filled in (``{size}`` brings its own blank).
    somewhere : str
        Stands for ``{where}`` where the record names no place.
    placed : str
        What it is called together with its ``{where}``; the noun with the place behind it where nothing is given.
    """

    noun: str
    sentence: str
    somewhere: str = "the robot"
    placed: str = ""


EFFECTS: Mapping[str, EffectWords] = {
    "swapped_ids": EffectWords(
        "exchanged spot names",
        "{where} carry each other's names in one of the two lists",
        "some spots",
        "exchanged names of {where}",
    ),
    "convention": EffectWords(
        "another way of writing angles or units", "one of the two lists writes angles or units another way"
    ),
    "wrong_frame": EffectWords(
        "a wrong frame (tool or base)",
        "{where} ran under another frame than the one listed",
        "a group",
        "a wrong frame (tool or base): {where}",
    ),
    "tool_offset": EffectWords("a TCP that is off", "the TCP is {size}off, by the same amount at every spot"),
    "scale": EffectWords(
        "growth or shrinkage (scale)", "the two lists differ in size{scaled}, as after heating or cooling"
    ),
    "joint_zero": EffectWords(
        "mastering of an axis", "{where} is mastered {size}off", "an axis of the robot", "mastering of {where}"
    ),
    "joint_profile": EffectWords(
        "an error that follows the angle of an axis",
        "{where} has an error that follows its angle",
        "an axis",
        "an error that follows the angle of {where}",
    ),
    "gear": EffectWords(
        "gear error of an axis",
        "{where} has an error that repeats with the turn of its gear or motor",
        "an axis",
        "gear error of {where}",
    ),
    "link_length": EffectWords("a length of the arm", "{where} is {size}off", "a length of the arm", "{where}"),
    "link_geometry": EffectWords(
        "small errors of the arm's geometry", "the lengths and angles of the arm are off by small amounts"
    ),
    "gravity_sag": EffectWords(
        "sag of the arm under weight",
        "the weight of arm and load makes {where} sag",
        "the arm",
        "sag of {where} under weight",
    ),
    "gun_sag": EffectWords("sag of the gun or its docking", "the gun or its docking sags under the gun's weight"),
    "gun_deflection": EffectWords("bending under squeeze force", "the gun bends under the squeeze force"),
    "backlash": EffectWords(
        "play (backlash) of an axis",
        "{where} has play: a spot depends on the side the axis came from",
        "an axis",
        "play (backlash) of {where}",
    ),
    "readback_lag": EffectWords(
        "joint angles read too early",
        "the angles of {where} were read before the axis had settled",
        "the axes",
        "angles of {where} read too early",
    ),
    "drift": EffectWords("drift with time", "the spots wander steadily with time"),
    "warmup": EffectWords("warm-up", "the spots wander while the robot warms up, and then settle"),
    "tip_wear": EffectWords("wear of the electrode tips", "the spots move with the number of welds since the last cap"),
    "group_shift": EffectWords(
        "a group that moved as a body",
        "the spots of {where} are shifted {size}as one body",
        "one group",
        "a shift of {where} as a body",
    ),
    "rail": EffectWords(
        "error of the rail",
        "the travel along {where} is not what the model takes it for",
        "the rail",
        "error along {where}",
    ),
    "covariate": EffectWords(
        "an error that follows a column",
        "the error follows the {where}",
        "a column of the table",
        "an error that follows {where}",
    ),
    "deformation": EffectWords("bending of the part", "the part is bent or twisted smoothly"),
    "unexplained": EffectWords("something unexplained", "something is left that no known effect explains"),
}

#: Where a remedy belongs -> a heading, and what to do in a few words.
REMEDY_PLACES: Mapping[str, tuple[str, str]] = {
    "tool": ("At the tool data (TCP)", "correct the tool data (TCP)"),
    "base": ("At the base or work object", "correct the base or work object"),
    "points": ("In the points of the programs", "correct the points of the programs"),
    "spot_list": ("In the spot list", "correct the spot list"),
    "robot": ("At the robot", "put the robot right"),
    "process": ("In the process", "change the process"),
}

_SCHEMES = {"leave-one-out": "each spot in turn is left out of the fit and then predicted from all others"}


def effect_noun(name: str, where: Mapping[str, Any] | None = None) -> str:
    """Call an effect by plain words, with its place where it has one; unknown names and free text stay readable."""
    words = EFFECTS.get(name)
    spot = place(where or {})
    if words is not None:
        if spot and words.placed:
            return words.placed.format(where=spot)
        return f"{words.noun} ({spot})" if spot else words.noun
    if not spot and (labelled := _read_label(name)) is not None:
        return effect_noun(*labelled)
    text = in_plain_words(name) if " " in name else name.replace("_", " ")
    return f"{text} ({spot})" if spot else text


def _read_label(text: str) -> tuple[str, dict[str, str]] | None:
    """Read the short text that rivals are listed by, ``group_shift column station level S2``; None for free text."""
    name, _, rest = text.partition(" ")
    parts = _LABEL.split(f" {rest}")
    if name not in EFFECTS or len(parts) < 3 or any(not part.strip() for part in parts[1:]) or parts[0].strip():
        return None
    return name, dict(zip(parts[1::2], (part.strip() for part in parts[2::2]), strict=True))


def in_plain_words(text: str) -> str:
    """Replace names of effects such as ``joint_zero`` in a text; single words such as "scale" are common speech."""
    return re.sub(r"[a-z]+(?:_[a-z]+)+", lambda hit: EFFECTS[hit[0]].noun if hit[0] in EFFECTS else hit[0], text)


def place(where: Mapping[str, Any]) -> str:
    """Say where an effect sits: ``axis 3``, ``station S2``, ``spots A and B``; an empty text for no place."""
    where = dict(where)
    parts = []
    if "column" in where:
        column, level = where.pop("column"), where.pop("level", None)
        parts.append(f"column {column}" if level is None else f"{column} {level}")
    if "written" in where and "real" in where:
        real, written = _exchanged(str(where.pop("frame", "")), str(where.pop("real")), str(where.pop("written")))
        parts.append(f"{real} in the place of {written}")
    for key, value in where.items():
        several = isinstance(value, list | tuple)
        text = listing(value) if several else str(value)
        if key == "ids":
            parts.append(f"{'spots' if several and len(value) != 1 else 'spot'} {text}")
        elif key in {"axis", "axes"}:
            many = len(value) != 1 if several else "," in text
            parts.append(f"{'axes' if many else 'axis'} {text}")
        elif key == "parameter":
            parts.append(f"arm length {text}" if re.fullmatch(r"[abcd]_?\d*", text) else f"parameter {text}")
        elif key == "frame":
            parts.append(f"{text} frame")
        else:
            parts.append(f"{key.replace('_', ' ')} {text}")
    return ", ".join(parts)


def _exchanged(frame: str, real: str, written: str) -> tuple[str, str]:
    """Name two frames, or the parts of work objects that are exchanged: ``the user frame of wobj_a``."""
    part = {"uframe": "the user frame of ", "oframe": "the object frame of "}.get(frame, "")
    return f"{part}{real}", f"that of {written}" if part else written


def finding(effect: Mapping[str, Any]) -> str:
    """Say what an effect means for this robot, as a sentence without capital and full stop."""
    name, where = str(effect["name"]), effect.get("where") or {}
    words = EFFECTS.get(name)
    if words is None:
        return f"the spots follow {effect_noun(name, where)}"
    amount = size(effect.get("parameters") or {})
    if name == "wrong_frame" and "written" in where and "real" in where:
        real, written = _exchanged(str(where.get("frame") or ""), str(where["real"]), str(where["written"]))
        group = {key: where[key] for key in ("column", "level") if key in where}
        whose = f"of {place(group)}" if group else f"under {where['written']}"
        return f"the spots {whose} lie where {real} would put them, not {written}"
    spot = place(where)
    if name == "group_shift" and "column" in where and where.get("level") is None:
        return f"the groups of {spot} are shifted against each other"
    blank = f"{amount} " if amount else ""
    scaled = f" by {amount}" if amount else ""
    return words.sentence.format(where=spot or words.somewhere, size=blank, scaled=scaled)


def size(parameters: Mapping[str, Any]) -> str:
    """Give the one number that tells how large an effect is, with its unit; empty where several would be needed."""
    known = {
        name: (float(entry["value"]), str(entry.get("unit") or ""))
        for name, entry in parameters.items()
        if isinstance(entry, Mapping) and entry.get("value") is not None
    }
    if len(known) == 1:
        ((value, unit),) = known.values()
        return with_unit(figure(abs(value)), unit)
    shift = [amount for name, amount in known.items() if _COMPONENT.fullmatch(name)]
    if shift and all(unit == "mm" for _, unit in shift):
        return with_unit(figure(math.hypot(*(value for value, _ in shift))), "mm")
    return ""


def with_unit(text: str, unit: str) -> str:
    """Put the unit behind a number."""
    spelled = _UNITS.get(unit, unit)
    return f"{text} {spelled}" if spelled else text


def figure(value: float | None, decimals: int | None = None) -> str:
    """Spell a number: one decimal of a large one, two of most, more of a small one; or the decimals asked for."""
    if value is None or not math.isfinite(value):
        return "-"
    if decimals is None:
        decimals = 1 if abs(value) >= 100 else decimals_of(abs(value))
    text = f"{value:.{decimals}f}"
    return text.lstrip("-") if float(text) == 0 else text


def decimals_of(size_of_it: float, digits: int = 2) -> int:
    """Decimals that show ``digits`` significant digits of a size, two to five of them."""
    if size_of_it <= 0 or not math.isfinite(size_of_it):
        return 2
    return min(max(digits - 1 - math.floor(math.log10(size_of_it)), 2), 5)


def value_text(value: float | None, ci95: Sequence[float | None] | None, unit: str = "") -> str:
    """Spell a value with its 95 % interval: ``0.120 +- 0.013 degrees``, or ``(0.10 to 0.20)`` where it is lopsided."""
    if value is None:
        return "not determined by these spots"
    if ci95 is None or None in ci95:
        return with_unit(figure(value), unit)
    low, high = (float(end) for end in ci95 if end is not None)
    half = (high - low) / 2
    decimals = decimals_of(half)
    if abs((high + low) / 2 - value) <= _ALIKE * abs(half):
        return with_unit(f"{figure(value, decimals)} +- {figure(half, decimals)}", unit)
    ends = f"{figure(low, decimals)} to {figure(high, decimals)}"
    return with_unit(f"{figure(value, decimals)} ({ends})", unit)


def chance(p_value: float | None) -> str:
    """Say how often luck alone would show as much: ``3 in 1,000``."""
    if p_value is None:
        return "not computed"
    if p_value < 0.001:
        return "less than 1 in 1,000"
    if p_value < 0.095:
        return f"{max(round(p_value * 1000), 1)} in 1,000" if p_value < 0.01 else f"{round(p_value * 100)} in 100"
    return f"{round(p_value * 10)} in 10" if p_value < 0.95 else "nearly always"


def scheme_text(scheme: str | None) -> str:
    """Explain how spots were held out."""
    if not scheme:
        return "not said"
    explained = _SCHEMES.get(scheme)
    return scheme if explained is None else f"{scheme}: {explained}"


def separation(effect: Mapping[str, Any]) -> str:
    """Say how sure the cause is, as a sentence."""
    if effect.get("named"):
        return "The cause is named: the other explanations lost clearly."
    rivals = [effect_noun(str(name)) for name in effect.get("not_separated_from") or ()]
    if rivals:
        fits = "that would fit as well" if len(rivals) == 1 else "those would fit as well"
        return f"Not separated from {listing(rivals, last='or')}: {fits}."
    return "It fits, but nothing outside the fit shows that no other cause is at work."


def listing(items: Iterable[object], most: int = MOST_IN_A_SENTENCE, last: str = "and") -> str:
    """Join names for a sentence; beyond ``most`` the rest are counted."""
    texts = [str(item) for item in items]
    if len(texts) > most:
        return f"{', '.join(texts[: most - 1])} and {len(texts) - most + 1} more"
    return texts[0] if len(texts) == 1 else f"{', '.join(texts[:-1])} {last} {texts[-1]}" if texts else ""


def sentence(text: str) -> str:
    """Start with a capital and end with a full stop."""
    text = text.strip()
    if not text:
        return ""
    return text[0].upper() + text[1:] + ("" if text[-1] in ".!?" else ".")


_NUMBERS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve")


def number_word(number: int) -> str:
    """``three``; figures beyond twelve."""
    return _NUMBERS[number] if 0 <= number < len(_NUMBERS) else str(number)


def count(number: int, noun: str, plural: str | None = None) -> str:
    """``1 spot``, ``2 spots``."""
    return f"{number} {noun if number == 1 else plural or noun + 's'}"
